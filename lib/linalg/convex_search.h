#pragma once

#include <algorithm>
#include <cmath>

namespace cb {

/// Slope and curvature of a convex function along a line.
struct Along {
  double slope = 0, curvature = 0;
};

struct ConvexSearchOptions {
  double slope = 0.3;  ///< -: of the start's, at which it ends
  int limit = 100;     ///< evaluations
};

/// How far along a line a convex function is near its least: where its slope is at most a part of the start's. 1 where
/// that is good; 0 where the line does not go down. Newton on the slope, kept by bisection.
/// `along`: alpha to Along.
template <class Function>
double convex_search(const ConvexSearchOptions& options, const Function& along) {
  const double at_start = along(0.0).slope;
  if (!(at_start < 0)) return 0;
  double low = 0, high = 0, alpha = 1;
  for (int i = 0; i < options.limit; ++i) {
    const Along at = along(alpha);
    if (std::abs(at.slope) <= options.slope * -at_start) break;
    (at.slope < 0 ? low : high) = alpha;
    const double newton = alpha - at.slope / at.curvature;
    if (high == 0)
      alpha = std::min(2 * alpha, std::max(newton, 1.1 * alpha));
    else
      alpha = newton > low && newton < high ? newton : 0.5 * (low + high);
    if (high > 0 && high - low <= 1e-15 * high) break;
  }
  return alpha;
}

}  // namespace cb
