#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "scenario/scenario.h"

namespace cb {

using Text = std::optional<std::string>;

/// The value of a numeric flag. Throws UsageError with `expected` ("a positive number of seconds") where the text is no
/// finite number in [low, high].
double number_flag(std::string_view flag, const std::string& value, double low, double high, std::string_view expected);
/// The same for a number that must be greater than zero.
double positive_flag(std::string_view flag, const std::string& value, std::string_view expected);
/// The same for whole numbers.
long whole_flag(std::string_view flag, const std::string& value, long low, long high, std::string_view expected);
/// on | off
bool on_off_flag(std::string_view flag, const std::string& value, std::string_view expected = "on or off");
/// NAME=VALUE pairs of --set.
Overrides set_flags(const std::vector<std::string>& values);
/// Throws UsageError where a step is longer than the run, or there are more steps than anybody means, unless they say
/// how long they will wait.
void check_steps(double step, double duration, bool time_limit);
/// The part of a folder's name that a value makes: of a long one, or one with signs that names lack, a number of all of
/// it, too.
std::string file_name_part(const std::string& value);

/// Throws UsageError where the first argument is neither a flag nor a command.
void check_command(const CLI::App& program, const std::string& first);
/// Throws UsageError where another flag stands in the place of a flag's value.
void check_values(const CLI::App& program, const std::string& command, std::span<const char* const> arguments);
/// The commands there are, as a message goes on.
std::string commands_of(const CLI::App& program);
/// The message for arguments that no flag took.
std::string unknown_flag(CLI::App& program, const std::string& command);

}  // namespace cb
