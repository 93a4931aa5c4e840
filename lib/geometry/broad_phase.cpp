// Pairs of shapes that may meet within the horizon, by sweep and prune.
//
// Problem: n shapes in steady motion; which of their bounding boxes, swept along the motion and widened by a margin
// (m), overlap? Source: Cohen, Lin, Manocha, Ponamgi, "I-COLLIDE" (1995), section 3. Differences from the source: one
// axis is swept, that of the largest spread of the shapes, the other two are compared directly; the order along it is
// kept between calls and mended by insertion, which is linear while shapes move little. The spread must be
// `axis_change` times larger on another axis before that one takes over. Where a sweep compares more than `crowded`
// boxes with each, as in a heap, it is given up, and grids (box_grid.cpp) find the pairs of this call and of the next
// ones. Half-spaces are not swept: each is tested against every other shape by its distance to the plane.
#include "geometry/broad_phase.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "linalg/stop.h"

namespace cb {

namespace {

constexpr double axis_change = 1.5;   // ratio of variances
constexpr std::size_t crowded = 100;  // boxes compared with each, at the mean
constexpr int calls_by_grid = 64;     // before a sweep is tried again

// Half extents of the world-aligned box around a shape in any orientation that it takes within the horizon. What is no
// sphere counts as the box around it.
Vec3 extents(const Shape& shape, const Motion& motion, double horizon) {
  if (shape.kind == ShapeKind::sphere) return Vec3::Constant(shape.radius);
  const Vec3 h = shape.box_around();
  const double radius = h.norm();
  const double turned = radius * motion.w.norm() * horizon;
  return ((motion.pose.q.toRotationMatrix().cwiseAbs() * h).array() + turned).cwiseMin(radius);
}

// Is the shape beyond the plane for the whole horizon?
bool clear_of_plane(const Shape& shape, const Motion& motion, const Pose& plane, double margin, double horizon) {
  const Vec3 n = plane.q * Vec3(0, 1, 0);
  const double fall = std::min(0.0, n.dot(motion.v) * horizon);
  const double centre = n.dot(motion.pose.p - plane.p) + fall;
  double reach = shape.radius;
  if (shape.kind != ShapeKind::sphere) {
    const Vec3 h = shape.box_around();
    reach = h.norm();
    if (centre - reach > margin) return true;
    const double extent = (motion.pose.q.toRotationMatrix().transpose() * n).cwiseAbs().dot(h);
    reach = std::min(reach, extent + reach * n.cross(motion.w).norm() * horizon);
  }
  return centre - reach > margin;
}

}  // namespace

void BroadPhase::sweep(const std::vector<Shape>& shapes, const std::vector<Motion>& motions, double margin,
                       double horizon) {
  const int n = static_cast<int>(shapes.size());
  candidates_.clear();

  // Half-spaces against everything else; what is left is swept.
  int swept = 0;
  for (int i = 0; i < n; ++i) {
    if (shapes[i].kind != ShapeKind::half_space) {
      ++swept;
      continue;
    }
    for (int j = 0; j < n; ++j) {
      if (shapes[j].kind == ShapeKind::half_space || (shapes[i].body < 0 && shapes[j].body < 0)) continue;
      if (!clear_of_plane(shapes[j], motions[j], motions[i].pose, margin, horizon))
        candidates_.emplace_back(std::min(i, j), std::max(i, j));
    }
  }
  if (swept > 1) sweep_finite(shapes, motions, margin, horizon, swept);
  if (!std::is_sorted(candidates_.begin(), candidates_.end())) std::sort(candidates_.begin(), candidates_.end());
}

void BroadPhase::sweep_finite(const std::vector<Shape>& shapes, const std::vector<Motion>& motions, double margin,
                              double horizon, int swept) {
  const int n = static_cast<int>(shapes.size());
  const auto low_end = [this](const SweptBox& a, const SweptBox& b) {
    return a.low[axis_] != b.low[axis_] ? a.low[axis_] < b.low[axis_] : a.shape < b.shape;
  };

  // Another set of shapes than last time: start in their own order.
  bool same = static_cast<int>(intervals_.size()) == swept && shape_count_ == n;
  for (const SweptBox& interval : intervals_) same = same && shapes[interval.shape].kind != ShapeKind::half_space;
  if (!same) {
    intervals_.clear();
    for (int i = 0; i < n; ++i)
      if (shapes[i].kind != ShapeKind::half_space) intervals_.push_back({Vec3::Zero(), Vec3::Zero(), i, false});
    shape_count_ = n;
  }

  // Swept boxes, in last call's order, and the spread of their centres.
  Vec3 sum = Vec3::Zero(), sum2 = Vec3::Zero();
  const Vec3 origin = motions[intervals_.front().shape].pose.p;
  for (SweptBox& interval : intervals_) {
    const Shape& shape = shapes[interval.shape];
    const Motion& motion = motions[interval.shape];
    const Vec3 reach = (extents(shape, motion, horizon).array() + margin / 2).matrix();
    const Vec3 travel = horizon * motion.v;
    interval.low = motion.pose.p + travel.cwiseMin(0) - reach;
    interval.high = motion.pose.p + travel.cwiseMax(0) + reach;
    interval.fixed = shape.body < 0;
    const Vec3 from_origin = motion.pose.p - origin;
    sum += from_origin;
    sum2 += from_origin.cwiseAbs2();
  }
  const bool gridded = by_grid_ > 0;
  if (gridded && --by_grid_ > 0 && grid_.pairs(intervals_, candidates_)) return;
  const auto count = static_cast<double>(intervals_.size());
  const Vec3 spread = sum2 / count - (sum / count).cwiseAbs2();
  int widest = 0;
  spread.maxCoeff(&widest);
  if (!same || gridded || spread[widest] > axis_change * spread[axis_]) {
    axis_ = widest;
    std::sort(intervals_.begin(), intervals_.end(), low_end);
  } else {
    for (std::size_t k = 1; k < intervals_.size(); ++k) {
      if (!low_end(intervals_[k], intervals_[k - 1])) continue;
      const SweptBox moved = intervals_[k];
      std::size_t m = k;
      for (; m > 0 && low_end(moved, intervals_[m - 1]); --m) intervals_[m] = intervals_[m - 1];
      intervals_[m] = moved;
    }
  }
  const std::size_t others = candidates_.size();
  if (sweep_sorted(crowded * intervals_.size())) return;
  candidates_.resize(others);
  if (grid_.pairs(intervals_, candidates_))
    by_grid_ = calls_by_grid;
  else
    sweep_sorted(std::numeric_limits<std::size_t>::max());
}

// False where it took more comparisons than `limit`: the pairs are not complete.
bool BroadPhase::sweep_sorted(std::size_t limit) {
  const int other_1 = (axis_ + 1) % 3, other_2 = (axis_ + 2) % 3;
  std::size_t compared = 0;
  for (std::size_t k = 0; k < intervals_.size(); ++k) {
    poll_stop();
    const SweptBox& a = intervals_[k];
    std::size_t m = k + 1;
    for (; m < intervals_.size() && intervals_[m].low[axis_] <= a.high[axis_]; ++m) {
      const SweptBox& b = intervals_[m];
      if (a.low[other_1] > b.high[other_1] || b.low[other_1] > a.high[other_1] || a.low[other_2] > b.high[other_2] ||
          b.low[other_2] > a.high[other_2] || (a.fixed && b.fixed))
        continue;
      candidates_.emplace_back(std::min(a.shape, b.shape), std::max(a.shape, b.shape));
    }
    compared += m - k - 1;
    if (compared > limit) return false;
  }
  return true;
}

}  // namespace cb
