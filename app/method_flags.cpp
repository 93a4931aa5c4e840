#include "method_flags.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "commands.h"
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

/// Does the method understand the flag? Asking for one that it has no use for is an error.
bool understands(const MethodRow& method, std::string_view flag, const Text& asked) {
  const auto has = [&](const MethodRow& row) {
    return std::any_of(row.options.begin(), row.options.end(), [&](const auto& o) { return o.flag == flag; });
  };
  if (has(method)) return true;
  if (!asked) return false;
  std::vector<std::string> others;
  for (const MethodRow& row : methods())
    if (has(row)) others.emplace_back(row.name);
  throw UsageError(fmt::format("--{} {}: --method {} has no use for it, only {} has; leave it out", flag, *asked,
                               method.name, join(others)));
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

  if (understands(method, "k", flags.k)) {
    constexpr const char* expected = "an even number of edges, at least 4, as in --k 8";
    options.k = k.value_or(options.k);
    if (flags.k) options.k = static_cast<int>(whole_flag("k", *flags.k, 4, 1 << 20, expected));
    if (options.k % 2 != 0) throw UsageError(fmt::format("--k {}: must be {}", options.k, expected));
  }
  const bool absolute = understands(method, "epsilon", flags.epsilon);
  const bool relative = understands(method, "epsilon-relative", flags.epsilon_relative);
  if (flags.epsilon && flags.epsilon_relative)
    throw UsageError("--epsilon and --epsilon-relative exclude each other: give one of them");
  if (absolute && flags.epsilon)
    options.epsilon = positive_flag("epsilon", *flags.epsilon, "a positive number of joules, as in --epsilon 1e-12");
  if (relative && flags.epsilon_relative)
    options.epsilon_relative =
        positive_flag("epsilon-relative", *flags.epsilon_relative,
                      "a positive fraction of the kinetic energy, as in --epsilon-relative 1e-12");
  if (understands(method, "compression-bound", flags.compression_bound)) {
    options.compression_bound = compression_bound.value_or(options.compression_bound);
    if (flags.compression_bound) options.compression_bound = on_off_flag("compression-bound", *flags.compression_bound);
  }
  if (understands(method, "regularise", flags.regularise) && flags.regularise)
    options.regularise = number_flag("regularise", *flags.regularise, 0, HUGE_VAL, "a number of at least 0");
  if (understands(method, "warm-start", flags.warm_start) && flags.warm_start)
    options.warm_start = on_off_flag("warm-start", *flags.warm_start);
  return options;
}

std::string unavailable_reason(const MethodRow& method, const MethodOptions& options) {
  for (const SolverRow& row : method.solvers)
    if (row.name == options.solver) return std::string(row.unavailable);
  return "";
}

void add_method_flags(CLI::App& command, MethodFlags& flags) {
  const auto add = [&](const char* flag, Text& value, const char* type, const char* summary) {
    command.add_option(flag, value, summary)->type_name(type);
  };
  add("--variant", flags.variant, "NAME", "named reading of a model (newton: uncapped, stick-tested) [the first]");
  add("--solver", flags.solver, "NAME", "see contactbench list solvers [the method's first]");
  add("--k", flags.k, "EDGES", "ap: edges of the friction polygon, even, at least 4 [scenario, else 4]");
  add("--epsilon", flags.epsilon, "J", "convex: suboptimality at which the solver may stop [1e-12]");
  add("--epsilon-relative", flags.epsilon_relative, "FRACTION",
      "convex: the same as a fraction of the kinetic energy before the event");
  add("--compression-bound", flags.compression_bound, "on|off",
      "convex: bound the sum of normal impulses of each island [scenario, else on]");
  add("--regularise", flags.regularise, "E", "ap: add E to the diagonal, stated in every output [0]");
}

}  // namespace cb
