#pragma once

#include "cone/cone_workspace.h"

namespace cb {

/// How Newton's method goes on and when it gives up.
struct PolishRules {
  int limit = 12;          ///< Newton steps
  int patience = 2;        ///< of them in a row that do not halve the natural map
  double proximal = 1e-8;  ///< -: first proximal term, as a fraction of W_ii (ConeOptions::proximal)
  bool goes_back = false;  ///< from a step that made matters worse, with a stronger proximal term?
  /// -: t of terms t w (r - r0) in y and t w (eta - eta0) in u_n, r0 and eta0 where it begins: a proximal point, which
  /// is met where the natural map is below point_found of the problem's size, and proves nothing of the program itself.
  double anchor = 0;
  static constexpr double point_found = 1e-12;

  /// Takes every step: from a point whose active constraints are named rightly, or not at all.
  static PolishRules bold(const ConeOptions& o, int patience) { return {o.polish_limit, patience, o.proximal, false}; }
  /// The last word, where the interior point method stalls.
  static PolishRules careful(const ConeOptions& o) {
    return {o.careful_limit, o.careful_limit, o.careful_proximal, true};
  }
};

/// Newton's method (polish.cpp) from the r, eta and s in `x`, which is overwritten by the best iterate met. Returns
/// false where it came to no point whose gap and infeasibility are at rounding (or to no proximal point); `x` is then
/// not to be used. `workspace` is prepared for `program`.
bool polish(const ConeProgram& program, const ConeOptions& options, const PolishRules& rules, ConeWorkspace& workspace,
            ConeSolution& x);

}  // namespace cb
