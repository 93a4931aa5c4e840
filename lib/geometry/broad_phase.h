#pragma once

#include <utility>
#include <vector>

#include "geometry/shapes.h"

namespace cb {

/// Finds the pairs of shapes that may meet in a step, by sweep and prune over boxes swept along the motion.
/// Near-linear in the number of shapes for scenes whose shapes are spread out; does not allocate after its first calls.
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

  /// Bounding box of a shape (no half-space) over the horizon, widened by half the margin.
  struct Interval {
    Vec3 low, high;
    int shape;
    bool fixed;
  };
  std::vector<Interval> intervals_;  ///< in last call's order along axis_
  int axis_ = 0;
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
