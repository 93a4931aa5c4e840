#include "flags.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "commands.h"
#include "output/number.h"
#include "scenario/near_name.h"

namespace cb {

namespace {

[[noreturn]] void refuse(std::string_view flag, const std::string& value, std::string_view expected) {
  throw UsageError(fmt::format("--{} {}: must be {}", flag, value.empty() ? "''" : value, expected));
}

/// Reads all of the text as one number; false where that is not what it is.
template <class Number>
bool read(const std::string& value, Number& x) {
  const char* first = value.data() + (value.starts_with('+') ? 1 : 0);
  const char* last = value.data() + value.size();
  const auto [end, error] = std::from_chars(first, last, x);
  return error == std::errc() && end == last;
}

}  // namespace

double number_flag(std::string_view flag, const std::string& value, double low, double high,
                   std::string_view expected) {
  double x = 0;
  if (!read(value, x) || !std::isfinite(x) || x < low || x > high) refuse(flag, value, expected);
  return x;
}

double positive_flag(std::string_view flag, const std::string& value, std::string_view expected) {
  const double x = number_flag(flag, value, 0, HUGE_VAL, expected);
  if (x == 0) refuse(flag, value, expected);
  return x;
}

long whole_flag(std::string_view flag, const std::string& value, long low, long high, std::string_view expected) {
  long x = 0;
  if (!read(value, x) || x < low || x > high) refuse(flag, value, expected);
  return x;
}

bool on_off_flag(std::string_view flag, const std::string& value, std::string_view expected) {
  if (value != "on" && value != "off") refuse(flag, value, expected);
  return value == "on";
}

Overrides set_flags(const std::vector<std::string>& values) {
  Overrides overrides;
  for (const std::string& value : values) {
    const std::size_t equals = value.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == value.size())
      refuse("set", value, "NAME=VALUE, as in --set boxes=8");
    const std::string name = value.substr(0, equals);
    for (const auto& earlier : overrides)
      if (earlier.first == name)
        throw UsageError(fmt::format("--set {}: {} is set twice; leave one of them out", value, name));
    overrides.emplace_back(name, value.substr(equals + 1));
  }
  return overrides;
}

void check_steps(double step, double duration, bool time_limit) {
  constexpr double many = 1e9;   // a quarter of an hour at least, and a trajectory of 100 GB; days as a rule
  constexpr double most = 1e12;  // decades of computing; far below what a step counter holds
  const double steps = duration / step;
  if (steps < 1 - 1e-9)
    throw UsageError(
        fmt::format("--step {}: is longer than the run, which is {:g} s; give a shorter step, or a longer --duration",
                    number_text(step), duration));
  if (steps <= (time_limit ? most : many)) return;
  throw UsageError(fmt::format(
      "--step {}: {:g} s would take {:.3g} steps; give a longer step, or a shorter --duration{}", number_text(step),
      duration, steps, steps <= most ? ", or a --time-limit, until which it goes on" : ""));
}

std::string file_name_part(const std::string& value) {
  constexpr std::size_t enough = 60;  // of a command line
  std::string part;
  bool whole = value.size() <= enough;
  for (const char c : value.substr(0, enough)) {
    const bool kept = std::isalnum(static_cast<unsigned char>(c)) || std::strchr("+-._", c);
    part += kept ? c : '_';
    whole = whole && (kept || c == '=');  // of NAME=VALUE
  }
  if (whole) return part;
  // Two that differ in what is left out are two runs: FNV-1a.
  std::uint32_t all = 2166136261U;
  for (const char c : value) all = (all ^ static_cast<unsigned char>(c)) * 16777619U;
  return part + fmt::format("-{:08x}", all);
}

namespace {

std::vector<std::string> command_names(const CLI::App& program) {
  std::vector<std::string> names;
  for (const CLI::App* command : program.get_subcommands(nullptr)) names.push_back(command->get_name());
  return names;
}

}  // namespace

std::string commands_of(const CLI::App& program) {
  return fmt::format("there are {}; contactbench --help says more", join(command_names(program)));
}

void check_command(const CLI::App& program, const std::string& first) {
  const std::vector<std::string> names = command_names(program);
  if (first.starts_with('-') || std::find(names.begin(), names.end(), first) != names.end()) return;
  throw UsageError(fmt::format("{}: no such command; {}; contactbench --help says more", first.empty() ? "''" : first,
                               suggest(first, names, "there are")));
}

void check_values(const CLI::App& program, const std::string& command, std::span<const char* const> arguments) {
  if (command.empty()) return;
  const CLI::App& owner = *program.get_subcommand(command);
  for (std::size_t i = 1; i < arguments.size(); ++i) {
    const std::string_view name = arguments[i - 1], next = arguments[i];
    if (!name.starts_with("--") || !next.starts_with("--")) continue;
    const CLI::Option* flag = owner.get_option_no_throw(std::string(name));
    if (flag != nullptr && flag->get_items_expected_min() > 0 &&
        owner.get_option_no_throw(std::string(next)) != nullptr)
      throw UsageError(
          fmt::format("{}: its value is missing before {}; contactbench {} --help says more", name, next, command));
  }
}

std::string unknown_flag(CLI::App& program, const std::string& command) {
  const std::vector<std::string> rest = program.remaining(true);
  if (rest.empty()) return {};
  const auto flag_like =
      std::find_if(rest.begin(), rest.end(), [](const std::string& s) { return s.starts_with("--"); });
  if (flag_like == rest.end()) return fmt::format("{}: one argument too many; leave it out", rest.front());
  const std::string& what = *flag_like;

  const std::string flag = what.substr(0, what.find('='));
  std::vector<std::string> names;
  const CLI::App& owner = command.empty() ? program : *program.get_subcommand(command);
  for (const CLI::Option* option : owner.get_options())
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  return fmt::format("{}: no such flag; {}; contactbench{}{} --help says more", flag, suggest(flag, names, "there are"),
                     command.empty() ? "" : " ", command);
}

}  // namespace cb
