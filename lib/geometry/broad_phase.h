#pragma once

#include <utility>
#include <vector>

#include "geometry/box_grid.h"
#include "geometry/shapes.h"

namespace cb {

/// Finds the pairs of shapes that may meet in a step, over boxes swept along the motion: by sweep and prune, or by
/// grids where many shapes are beside each other as seen along the axis of the sweep (the pairs are the same). Linear
/// in the number of shapes but for sorting; does not allocate after its first calls.
class BroadPhase {
 public:
  /// `allowed(i, j)` (i < j) says whether a pair of shapes is declared to collide; fixed with fixed is never asked.
  /// Returns pairs (i, j), i < j, in ascending order, whose swept bounding boxes, widened by `margin` (m), overlap
  /// within `horizon` seconds. Pairs with a half-space use the distance to its plane.
  template <class Allowed>
  const std::vector<std::pair<int, int>>& pairs(const std::vector<Shape>& shapes, const std::vector<Motion>& motions,
                                                double margin, double horizon, const Allowed& allowed);

 private:
  void sweep(const std::vector<Shape>& shapes, const std::vector<Motion>& motions, double margin, double horizon);
  void sweep_finite(const std::vector<Shape>& shapes, const std::vector<Motion>& motions, double margin, double horizon,
                    int swept);
  bool sweep_sorted(std::size_t limit);

  std::vector<SweptBox> intervals_;  ///< in last call's order along axis_
  BoxGrid grid_;
  int axis_ = 0;
  int by_grid_ = 0;       ///< calls to come that do without a sweep
  int shape_count_ = -1;  ///< of the call that filled intervals_
  std::vector<std::pair<int, int>> candidates_, pairs_;
};

template <class Allowed>
const std::vector<std::pair<int, int>>& BroadPhase::pairs(const std::vector<Shape>& shapes,
                                                          const std::vector<Motion>& motions, double margin,
                                                          double horizon, const Allowed& allowed) {
  sweep(shapes, motions, margin, horizon);
  pairs_.clear();
  for (const auto& pair : candidates_)
    if (allowed(pair.first, pair.second)) pairs_.push_back(pair);
  return pairs_;
}

}  // namespace cb
