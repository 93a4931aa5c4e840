#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <stdexcept>
#include <string>

namespace cb {

/// How the program ends (docs/interface.md, "Exit codes").
enum ExitCode : int { finished = 0, program_fault = 1, wrong_input = 2, not_finished = 3 };

/// Flags that cannot be what the user meant: what() names the flag and the fix.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Writes to standard error and lets a failure be: there is nowhere left to say so.
void print_error(const std::string& text);

/// What is left to do once the flags are read; returns an ExitCode.
using Action = std::function<int()>;

/// Subcommands, one a file (run.cpp, ...): each adds its flags to the program and sets the action where it was chosen.
void add_run(CLI::App& program, Action& action);
void add_solve(CLI::App& program, Action& action);
void add_judge(CLI::App& program, Action& action);
void add_check(CLI::App& program, Action& action);
void add_completion(CLI::App& program, Action& action);
void add_list(CLI::App& program, Action& action);

}  // namespace cb
