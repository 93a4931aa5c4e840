#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "commands.h"
#include "flags.h"
#include "lcp/lcp.h"
#include "methods/outside.h"
#include "scenario/scenario.h"

namespace cb {

namespace {

using Words = std::vector<std::string>;

Words stems_of_scenes() {
  Words names;
  for (const std::string& file : bundled_scenarios()) names.push_back(std::filesystem::path(file).filename().string());
  return names;
}

/// What may stand after a flag: from the tables, or from its type where that lists words ("on|off"). Empty: anything.
Words values_of(const CLI::Option& option) {
  const std::string name = option.get_lnames().empty() ? "" : option.get_lnames().front();
  Words words;
  const auto add = [&](std::string_view word) {
    if (!word.empty() && std::find(words.begin(), words.end(), word) == words.end()) words.emplace_back(word);
  };
  if (name == "law")
    for (const Law& law : laws()) add(law.name);
  if (name == "method") add("external");
  for (const MethodRow& row : methods()) {
    if (name == "method") add(row.name);
    if (name == "variant")
      for (const std::string_view variant : row.variants) add(variant);
    if (name == "solver")
      for (const SolverRow& solver : row.solvers) add(solver.name);
  }
  if (name == "solver")
    for (const LcpSolverRow& row : lcp_solvers()) add(row.name);
  const std::string type = option.get_type_name();
  if (type.find('|') != std::string::npos)
    for (std::size_t at = 0; at < type.size();) {
      const std::size_t end = std::min(type.find('|', at), type.size());
      add(std::string_view(type).substr(at, end - at));
      at = end + 1;
    }
  return words;
}

/// The commands and their flags, as the parser has them.
struct Command {
  std::string name, summary;
  std::vector<const CLI::Option*> flags;
  Words first;  ///< what its first word may be, besides a file
};

std::vector<Command> commands_in(const CLI::App& program) {
  std::vector<Command> all;
  for (const CLI::App* app : program.get_subcommands(nullptr)) {
    Command& command = all.emplace_back();
    command.name = app->get_name();
    command.summary = app->get_description();
    for (const CLI::Option* option : app->get_options())
      if (!option->get_lnames().empty())
        command.flags.push_back(option);
      else if (option->get_name() == "scenario")
        command.first = stems_of_scenes();
      else if (!values_of(*option).empty())
        command.first = values_of(*option);
  }
  return all;
}

std::string quoted(std::string text) {
  for (std::size_t at = text.find('\''); at != std::string::npos; at = text.find('\'', at + 4))
    text.replace(at, 1, "'\\''");
  return "'" + text + "'";
}

std::string flag_name(const CLI::Option& option) { return "--" + option.get_lnames().front(); }

void print_bash(const std::vector<Command>& commands) {
  Words names;
  for (const Command& command : commands) names.push_back(command.name);
  fmt::print(
      "# Completion of contactbench for bash:  source <(contactbench completion bash)\n"
      "_contactbench() {{\n"
      "  local current=${{COMP_WORDS[COMP_CWORD]}} words=\n"
      "  COMPREPLY=()\n"
      "  if [ \"$COMP_CWORD\" -eq 1 ]; then\n"
      "    COMPREPLY=($(compgen -W {} -- \"$current\"))\n"
      "    return\n"
      "  fi\n"
      "  case \"${{COMP_WORDS[1]}} ${{COMP_WORDS[COMP_CWORD-1]}}\" in\n",
      quoted(fmt::format("{} --help --version", fmt::join(names, " "))));
  for (const Command& command : commands)
    for (const CLI::Option* option : command.flags)
      if (const Words words = values_of(*option); !words.empty())
        fmt::print("    {}) words={} ;;\n", quoted(command.name + " " + flag_name(*option)),
                   quoted(fmt::format("{}", fmt::join(words, " "))));
  fmt::print(
      "  esac\n"
      "  if [ -n \"$words\" ]; then\n"
      "    COMPREPLY=($(compgen -W \"$words\" -- \"$current\"))\n"
      "    return\n"
      "  fi\n"
      "  case \"${{COMP_WORDS[1]}}\" in\n");
  for (const Command& command : commands) {
    Words flags;
    for (const CLI::Option* option : command.flags) flags.push_back(flag_name(*option));
    fmt::print("    {})\n      words={}\n", command.name, quoted(fmt::format("{}", fmt::join(flags, " "))));
    if (!command.first.empty())
      fmt::print("      [[ $current == -* ]] || words={}\n", quoted(fmt::format("{}", fmt::join(command.first, " "))));
    fmt::print("      ;;\n");
  }
  fmt::print(
      "  esac\n"
      "  COMPREPLY=($(compgen -W \"$words\" -- \"$current\"))\n"
      "  [[ $current == -* ]] || COMPREPLY+=($(compgen -f -- \"$current\"))\n"
      "}}\n"
      "complete -o filenames -F _contactbench contactbench\n");
}

void print_zsh(const std::vector<Command>& commands) {
  // What _describe shows: name:words.
  const auto described = [](const std::string& name, std::string summary) {
    std::replace(summary.begin(), summary.end(), '\n', ' ');
    return quoted(name + ":" + summary);
  };
  fmt::print(
      "#compdef contactbench\n"
      "# Completion of contactbench for zsh:  source <(contactbench completion zsh), or as _contactbench in $fpath\n"
      "_contactbench() {{\n"
      "  local -a all\n"
      "  if (( CURRENT == 2 )); then\n"
      "    all=(\n");
  for (const Command& command : commands) fmt::print("      {}\n", described(command.name, command.summary));
  fmt::print(
      "    )\n"
      "    _describe command all\n"
      "    return\n"
      "  fi\n"
      "  case \"$words[2] $words[CURRENT-1]\" in\n");
  for (const Command& command : commands)
    for (const CLI::Option* option : command.flags)
      if (const Words words = values_of(*option); !words.empty())
        fmt::print("    ({}) all=({}) ;;\n", quoted(command.name + " " + flag_name(*option)), fmt::join(words, " "));
  fmt::print(
      "  esac\n"
      "  if (( $#all )); then\n"
      "    compadd -a all\n"
      "    return\n"
      "  fi\n"
      "  case $words[2] in\n");
  for (const Command& command : commands) {
    fmt::print("    ({})\n      all=(\n", command.name);
    for (const CLI::Option* option : command.flags)
      fmt::print("        {}\n", described(flag_name(*option), option->get_description()));
    fmt::print("      )\n");
    if (!command.first.empty()) fmt::print("      [[ $PREFIX == -* ]] || compadd {}\n", fmt::join(command.first, " "));
    fmt::print("      ;;\n");
  }
  fmt::print(
      "  esac\n"
      "  if [[ $PREFIX == -* ]]; then _describe flag all; else _files; fi\n"
      "}}\n"
      "if [ \"$funcstack[1]\" = _contactbench ]; then _contactbench \"$@\"; else compdef _contactbench contactbench; "
      "fi\n");
}

int completion(const CLI::App& program, const std::string& shell) {
  if (shell != "bash" && shell != "zsh") throw UsageError(fmt::format("{}: must be bash or zsh", shell));
  const std::vector<Command> commands = commands_in(program);
  shell == "bash" ? print_bash(commands) : print_zsh(commands);
  return finished;
}

}  // namespace

void add_completion(CLI::App& program, Action& action) {
  CLI::App& command = *program.add_subcommand("completion", "print what a shell needs to complete command lines");
  const auto shell = std::make_shared<std::string>();
  command.add_option("shell", *shell, "the shell to print it for")->required()->type_name("bash|zsh");
  command.callback([shell, &program, &action] { action = [shell, &program] { return completion(program, *shell); }; });
}

}  // namespace cb
