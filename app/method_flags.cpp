#include "method_flags.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "commands.h"
#include "contact/problem_files.h"
#include "methods/outside.h"
#include "output/number.h"
#include "scenario/near_name.h"

namespace cb {

namespace {

/// A choice among the names that a method has, the first where nothing was asked for.
std::string pick(const char* flag, const Text& asked, std::string_view method, const std::vector<std::string>& names) {
  if (!asked) return names.empty() ? std::string() : names.front();
  if (names.empty())
    throw UsageError(fmt::format("--{0} {1}: {2} has no {0} to choose; leave --{0} out", flag, *asked, method));
  if (std::find(names.begin(), names.end(), *asked) == names.end())
    throw UsageError(
        fmt::format("--{} {}: {} has no such {}; {}", flag, *asked, method, flag, suggest(*asked, names, "there are")));
  return *asked;
}

bool understands(const MethodRow& method, std::string_view flag) {
  return std::any_of(method.options.begin(), method.options.end(), [&](const auto& o) { return o.flag == flag; });
}

/// All methods, with what comes from outside.
const std::vector<MethodRow>& all_methods() {
  static const std::vector<MethodRow> rows = [] {
    std::vector<MethodRow> all(methods().begin(), methods().end());
    all.push_back(external_row(laws().front()));
    return all;
  }();
  return rows;
}

/// Asking for a flag that the method has no use for is an error.
void refuse_foreign(const MethodRow& method, std::string_view flag, const std::string& value) {
  if (understands(method, flag)) return;
  std::vector<std::string> others;
  for (const MethodRow& row : all_methods())
    if (understands(row, flag)) others.emplace_back(row.name);
  // A law's row is named by its flag: external --law coulomb.
  const std::size_t law = method.name.find("--law ");
  const std::string whose =
      law == std::string_view::npos ? fmt::format("--method {}", method.name) : std::string(method.name.substr(law));
  throw UsageError(
      fmt::format("--{} {}: {} has no use for it, only {} has; leave it out", flag, value, whose, join(others)));
}

double number(const OptionRow& row, const std::string& value) {
  if (row.positive) positive_flag(row.flag, value, row.expected);
  return number_flag(row.flag, value, row.least, row.most, row.expected);
}

void parse(const OptionRow& row, const std::string& value, MethodOptions& options) {
  if (const auto* field = std::get_if<int MethodOptions::*>(&row.field)) {
    constexpr long most = 1 << 20;
    const long asked = whole_flag(row.flag, value, std::lround(row.least), most, row.expected);
    if (asked % row.multiple_of != 0)
      throw UsageError(fmt::format("--{} {}: must be {}", row.flag, asked, row.expected));
    options.** field = static_cast<int>(asked);
  } else if (const auto* real = std::get_if<double MethodOptions::*>(&row.field)) {
    options.** real = number(row, value);
  } else if (const auto* optional = std::get_if<std::optional<double> MethodOptions::*>(&row.field)) {
    options.** optional = number(row, value);
  } else if (const auto* text = std::get_if<std::string MethodOptions::*>(&row.field)) {
    options.** text = value;
  } else {
    options.*std::get<bool MethodOptions::*>(row.field) = on_off_flag(row.flag, value);
  }
}

}  // namespace

MethodOptions method_options(const MethodFlags& flags, const MethodRow& method, std::optional<int> k,
                             std::optional<bool> compression_bound) {
  MethodOptions options;
  std::vector<std::string> solvers, variants;
  for (const SolverRow& row : method.solvers) solvers.emplace_back(row.name);
  for (const std::string_view variant : method.variants) variants.emplace_back(variant);
  options.solver = pick("solver", flags.solver, method.name, solvers);
  options.variant = pick("variant", flags.variant, method.name, variants);

  options.k = k.value_or(options.k);
  options.compression_bound = compression_bound.value_or(options.compression_bound);
  for (const auto& [flag, value] : flags.own)
    if (value) refuse_foreign(method, flag, *value);
  for (const OptionRow& row : method.options) {
    if (!flags.asked(row.flag)) continue;
    if (flags.asked(row.replaces))
      throw UsageError(fmt::format("--{} and --{} exclude each other: give one of them", row.replaces, row.flag));
    if (!row.variant.empty() && row.variant != options.variant)
      throw UsageError(fmt::format("--{}: of {}, only --variant {} has a use for it; leave it out", row.flag,
                                   method.name, row.variant));
    parse(row, *flags.own.find(row.flag)->second, options);
  }
  return options;
}

std::string unavailable_reason(const MethodRow& method, const MethodOptions& options) {
  for (const SolverRow& row : method.solvers)
    if (row.name == options.solver) return std::string(row.unavailable);
  return "";
}

std::string text_of(const OptionValue& value) {
  if (const int* whole = std::get_if<int>(&value)) return std::to_string(*whole);
  if (const double* real = std::get_if<double>(&value)) return number_text(*real);
  if (const bool* on = std::get_if<bool>(&value)) return *on ? "on" : "off";
  if (const std::string* words = std::get_if<std::string>(&value)) return *words;
  return "";
}

namespace {

std::vector<std::string> law_names() {
  std::vector<std::string> names;
  for (const Law& law : laws()) names.emplace_back(law.name);
  return names;
}

/// A flag of `rows`, with what each of them that has it says of it.
void add_flag(CLI::App& command, MethodFlags& flags, const OptionRow& option, const std::vector<MethodRow>& rows) {
  std::string summary;
  for (const MethodRow& row : rows)
    for (const OptionRow& same : row.options)
      if (same.flag == option.flag) summary += fmt::format("{}: {}; ", row.name, same.summary);
  const auto at = flags.own.try_emplace(std::string(option.flag)).first;
  command
      .add_option("--" + at->first, at->second,
                  fmt::format("{} [{}{}]", summary.substr(0, summary.size() - 2),
                              option.of_scenario ? "scenario, else " : "", option.default_value))
      ->type_name(std::string(option.type));
}

/// A command names its files by {problem} or {text}, and {answer}, or none of them.
void check_command_text(const std::string& command) {
  const auto names = [&](const char* what) { return command.find(what) != std::string::npos; };
  const bool in = names("{problem}") || names("{text}");
  if (in != names("{answer}"))
    throw UsageError(
        fmt::format("--command '{}': names {}; give both, as in --command './mine {{problem}} {{answer}}', "
                    "or neither, for a program that is talked to (docs/external.md)",
                    command, in ? "no {answer}" : "an {answer} but no {problem} or {text}"));
  if (names("{problem}") && !fclib_available())
    throw UsageError(
        fmt::format("--command '{}': {}; or give {{text}} for {{problem}}", command, fclib_unavailable_reason()));
}

}  // namespace

std::shared_ptr<const MethodRow> method_flag(const std::string& value, const MethodFlags& flags) {
  if (value == "external") {
    if (!flags.asked("command") || flags.own.find("command")->second->empty())
      throw UsageError("--command is missing: --method external asks another program, as in --command './mine'");
    check_command_text(*flags.own.find("command")->second);
    return std::make_shared<MethodRow>(external_row(law_flag(flags)));
  }
  if (const MethodRow* row = find_method(value)) return {std::shared_ptr<void>(), row};
  std::vector<std::string> known;
  for (const MethodRow& row : all_methods()) known.emplace_back(row.name);
  throw UsageError(fmt::format("--method {}: no such method; {}", value, suggest(value, known, "there are")));
}

const Law& law_flag(const MethodFlags& flags) {
  const std::string expected = fmt::format("what the answer claims to solve, one of {}", join(law_names()));
  if (!flags.asked("law")) throw UsageError("--law is missing: " + expected);
  const std::string& value = *flags.own.find("law")->second;
  if (const Law* law = find_law(value)) return *law;
  throw UsageError(
      fmt::format("--law {}: no such law; {}", value.empty() ? "''" : value, suggest(value, law_names(), "there are")));
}

MethodOptions law_options(const MethodFlags& flags, const Law& law) {
  MethodRow row = external_row(law);
  const std::string name = fmt::format("external --law {}", law.name);
  row.name = name;
  return method_options(flags, row, {}, {});
}

void add_law_flags(CLI::App& command, MethodFlags& flags) {
  flags.own.try_emplace("law");
  command
      .add_option("--law", flags.own["law"],
                  fmt::format("what the answer claims to solve: {}, or a method whose law it is", join(law_names())))
      ->type_name("LAW");
  command.add_option("--variant", flags.variant, "of the law that has several (soft: sap, mujoco) [the first]")
      ->type_name("NAME");
  for (const MethodRow& row : all_methods())
    for (const OptionRow& option : row.options)
      if (option.of_law && !flags.own.contains(option.flag)) add_flag(command, flags, option, all_methods());
}

void add_method_flags(CLI::App& command, MethodFlags& flags, bool single_event) {
  const auto add = [&](const std::string& flag, Text& value, std::string_view type, const std::string& summary) {
    command.add_option(flag, value, summary)->type_name(std::string(type));
  };
  add("--variant", flags.variant, "NAME", "named reading of a model (newton: uncapped, stick-tested) [the first]");
  add("--solver", flags.solver, "NAME", "see contactbench list solvers [the method's first]");
  for (const MethodRow& method : all_methods())
    for (const OptionRow& option : method.options) {
      const bool known = flags.own.contains(option.flag);
      if (known) continue;
      if (single_event && option.between_events)
        flags.own.try_emplace(std::string(option.flag));
      else
        add_flag(command, flags, option, all_methods());
    }
}

}  // namespace cb
