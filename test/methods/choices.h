// Every method in each of its ways, for tests that hold for all.
#pragma once

#include <string>
#include <vector>

#include "methods/registry.h"

namespace cb::test {

struct Choice {
  const MethodRow* row;
  MethodOptions options;
  std::string label;
};

/// Each method with each solver and variant that this build has.
inline std::vector<Choice> choices() {
  std::vector<Choice> all;
  for (const MethodRow& row : methods()) {
    std::vector<std::string> solvers, variants;
    for (const SolverRow& solver : row.solvers)
      if (solver.unavailable.empty()) solvers.emplace_back(solver.name);
    for (const std::string_view variant : row.variants) variants.emplace_back(variant);
    if (solvers.empty()) solvers.emplace_back();
    if (variants.empty()) variants.emplace_back();
    for (const std::string& solver : solvers)
      for (const std::string& variant : variants) {
        Choice choice{&row, {}, std::string(row.name) + ' ' + solver + variant};
        choice.options.solver = solver;
        choice.options.variant = variant;
        choice.options.k = 8;
        all.push_back(choice);
      }
  }
  return all;
}

}  // namespace cb::test
