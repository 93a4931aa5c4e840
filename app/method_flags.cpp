#include "method_flags.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "commands.h"
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

/// Asking for a flag that the method has no use for is an error.
void refuse_foreign(const MethodRow& method, std::string_view flag, const std::string& value) {
  if (understands(method, flag)) return;
  std::vector<std::string> others;
  for (const MethodRow& row : methods())
    if (understands(row, flag)) others.emplace_back(row.name);
  throw UsageError(fmt::format("--{} {}: --method {} has no use for it, only {} has; leave it out", flag, value,
                               method.name, join(others)));
}

double number(const OptionRow& row, const std::string& value) {
  return row.positive ? positive_flag(row.flag, value, row.expected)
                      : number_flag(row.flag, value, row.least, row.most, row.expected);
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
  return "";
}

void add_method_flags(CLI::App& command, MethodFlags& flags, bool single_event) {
  const auto add = [&](const std::string& flag, Text& value, std::string_view type, const std::string& summary) {
    command.add_option(flag, value, summary)->type_name(std::string(type));
  };
  add("--variant", flags.variant, "NAME", "named reading of a model (newton: uncapped, stick-tested) [the first]");
  add("--solver", flags.solver, "NAME", "see contactbench list solvers [the method's first]");
  for (const MethodRow& method : methods())
    for (const OptionRow& option : method.options) {
      const auto [at, fresh] = flags.own.try_emplace(std::string(option.flag));
      if (!fresh || (single_event && option.between_events)) continue;
      std::string summary;  // of all methods that understand it
      for (const MethodRow& row : methods())
        for (const OptionRow& same : row.options)
          if (same.flag == option.flag) summary += fmt::format("{}: {}; ", row.name, same.summary);
      add("--" + at->first, at->second, option.type,
          fmt::format("{} [{}{}]", summary.substr(0, summary.size() - 2), option.of_scenario ? "scenario, else " : "",
                      option.default_value));
    }
}

}  // namespace cb
