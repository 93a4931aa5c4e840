// First time at which a feature of two boxes closes: what time_of_contact.cpp follows for box on box.

#include "geometry/box_box_time.h"

#include <cstdint>
#include <optional>

#include "geometry/box_box.h"
#include "geometry/core_time.h"

namespace cb {

namespace {

/// A box as it moves: placed at a time, with its velocities.
struct MovingBox : PlacedBox {
  Vec3 v, w;  ///< m/s, rad/s
  MovingBox(const Shape& shape, const Motion& motion, double t)
      : PlacedBox(shape, cb::advance(motion, t)), v(motion.v), w(motion.w) {}
};

/// Two shapes that are boxes, and how they move.
struct BoxPair {
  const Shape& shape_a;
  const Motion& motion_a;
  const Shape& shape_b;
  const Motion& motion_b;
  double fastest;  ///< m/s: no two points approach faster
  double margin;   ///< m, of separating_axis
};

/// The two at a time.
struct Boxes {
  MovingBox a, b;
  RelativeBox ab;
  Boxes(const BoxPair& pair, double t)
      : a(pair.shape_a, pair.motion_a, t), b(pair.shape_b, pair.motion_b, t), ab(a, b) {}
};

// How an open corner of the patch and what it is over come together, the goal's target apart: vertex over face both
// ways, edge over edge.
Approach of_corner(const FacePatch& patch, const PatchPoint& point, const MovingBox& reference, const MovingBox& other,
                   const Goal& goal, double rest) {
  const Vec3 u_axis = reference.R.col((patch.axis + 1) % 3), v_axis = reference.R.col((patch.axis + 2) % 3);
  // Foot on the reference face and point of the incident face above it, as arms from the two centres.
  const Vec3 x_r = point.u * u_axis + point.v * v_axis + reference.h[patch.axis] * patch.n;
  const Vec3 d = point.gap * patch.n, x_o = reference.c + x_r + d - other.c;
  const Moving distance = between(d, other.v - reference.v, other.w, x_o, reference.w, x_r, rest);
  const Vec3 m = reference.R * patch.incident;  // normal of the incident face, out of the other box
  if (point.id < 8) {
    Approach gap =
        along_normal(point.id < 4 ? turning_direction(patch.n, reference.w) : turning_direction(-m, other.w), distance);
    gap.value -= goal.target;
    return gap;
  }
  // Edge e of the incident face over the edge of the reference face along side p, whichever way makes d.(e x f)
  // positive.
  const int e = (point.id - 8) / 4, p = (point.id - 8) % 4;
  const Vec3 edge_o = other.R.col(e % 2 == 0 ? patch.incident_u : patch.incident_v);
  const Vec3 edge_r = p < 2 ? v_axis : u_axis;
  const double sign = d.dot(edge_o.cross(edge_r)) < 0 ? -1 : 1;
  const Moving q = crossed(turning_direction(sign * edge_o, other.w), turning_direction(edge_r, reference.w));
  return edge_over_edge(q, distance, goal);
}

// Closed: follows the corners of the common patch that are open; axis and side of the face as face_patch's.
double patch_to_flat(const BoxPair& pair, int axis, double side, const Goal& goal) {
  constexpr double steepest = 0.5;  // cosine between the two normals; steeper faces do not come together in a step
  std::uint32_t open = 0;           // features seen open, a bit each
  return advance_until(goal.horizon, [&](double t, double rest, bool) {
    const Boxes now(pair, t);
    FacePatch patch;
    face_patch(now.a, now.b, now.ab, axis, pair.margin, patch, side);
    const MovingBox& reference = patch.reference_is_a ? now.a : now.b;
    const MovingBox& other = patch.reference_is_a ? now.b : now.a;
    const Vec3 m = reference.R * patch.incident;  // normal of the incident face, out of the other box
    if (-m.dot(patch.n) < steepest) return never_arrives;

    double step = rest;
    std::uint32_t open_now = 0;
    for (int k = 0; k < patch.count; ++k) {
      const PatchPoint& point = patch.point[k];
      const std::uint32_t bit = std::uint32_t{1} << point.id;
      if (point.gap <= goal.closed) {
        if (open & bit) return has_arrived;
        continue;
      }
      open_now |= bit;
      const Approach gap = of_corner(patch, point, reference, other, goal, rest);
      if (gap.value <= 0) continue;  // vertices stand for these edges
      step = std::min(step, first_root(gap.value, gap.rate, gap.curvature - gap.K * rest / 3));
    }
    open |= open_now;
    return Look{false, step};
  });
}

// Open: a step over which every corner of `other` surely stays above the face of `plane` with normal n, at `extent`
// from its centre.
double step_over_face(const MovingBox& plane, const MovingBox& other, const Vec3& n, double extent, double target,
                      double rest) {
  const Moving normal = turning_direction(n, plane.w);
  const Vec3 centre = other.c - plane.c, v = other.v - plane.v;
  double step = rest;
  for (int k = 0; k < 8; ++k) {
    const Vec3 sign(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1);
    const Vec3 x = other.R * sign.cwiseProduct(other.h);
    const Moving distance = between(centre + x, v, other.w, x, Vec3::Zero(), Vec3::Zero(), step);
    const double value = n.dot(centre + x) - extent;
    if (value - target > (normal.size[1] * distance.size[0] + distance.size[1]) * step) continue;
    Approach approach = along_normal(normal, distance);
    approach.value = value;
    if (value <= target) return 0;
    step = std::min(step, safe_step(approach, target, step));
  }
  return step;
}

double step_over(const Boxes& now, int face, double target, double rest) {
  const auto& [a, b, ab] = now;
  if (face < 3) {
    const Vec3 n = (ab.t[face] < 0 ? -1 : 1) * a.R.col(face);
    return step_over_face(a, b, n, a.h[face], target, rest);
  }
  const int k = face - 3;
  const Vec3 n = (ab.C.col(k).dot(ab.t) > 0 ? -1 : 1) * b.R.col(k);
  return step_over_face(b, a, n, b.h[k], target, rest);
}

// The same for two edges that separate the boxes, e of a and f of b: as long as both stay the outermost along their
// common normal q = e x f, that is while q.R_k keeps its sign for the other axes R_k of both boxes.
double step_over_edges(const Boxes& now, const SeparatingAxis& axis, double target, double rest) {
  const auto& [a, b, ab] = now;
  const int i = (axis.index - 6) / 3, j = (axis.index - 6) % 3;
  const Vec3 n = a.R * axis.normal_A;
  const double sign = a.R.col(i).cross(b.R.col(j)).dot(n) < 0 ? -1 : 1;
  const Moving q = crossed(turning_direction(a.R.col(i), a.w), turning_direction(sign * b.R.col(j), b.w));
  const double sine = q.x.norm();
  Vec3 x_a = Vec3::Zero(), x_b = Vec3::Zero();
  double interval = rest;
  for (int k = 0; k < 3; ++k) {
    if (k != i) {
      const Vec3 outward = q.x.dot(a.R.col(k)) < 0 ? Vec3(-a.R.col(k)) : Vec3(a.R.col(k));
      x_a += a.h[k] * outward;
      interval = std::min(interval, safe_step(along_normal(q, turning_direction(outward, a.w)), 0, interval));
    }
    if (k != j) {
      const Vec3 outward = q.x.dot(b.R.col(k)) < 0 ? Vec3(b.R.col(k)) : Vec3(-b.R.col(k));
      x_b += b.h[k] * outward;
      interval = std::min(interval, safe_step(along_normal(q, turning_direction(-outward, b.w)), 0, interval));
    }
  }
  const Approach approach = along_normal(q, between(b.c + x_b - a.c - x_a, b.v - a.v, b.w, x_b, a.w, x_a, interval));
  return safe_step(approach, target * sine, interval);
}

// A step over which the boxes surely stay further apart than `target`, by the planes that separate them best now.
double apart_step(const Boxes& now, const SeparatingAxis& axis, double target, double rest) {
  if (axis.index < 6) return step_over(now, axis.index, target, rest);
  double step = step_over_edges(now, axis, target, rest);
  // Nearly a face axis: the face lasts longer.
  for (int face = 0; face < 6 && step < rest; ++face) step = std::max(step, step_over(now, face, target, rest));
  return step;
}

// The first time at which the gap of the two is at most `closed`, in steps towards `target` (m). at_arrival(axis,
// first): told of the axis then, and whether anything has moved.
template <class AtArrival>
double time_to_gap(const BoxPair& pair, double target, double closed, double horizon, const AtArrival& at_arrival) {
  return advance_until(horizon, [&](double t, double rest, bool first) {
    const Boxes now(pair, t);
    const SeparatingAxis axis = separating_axis(now.a, now.b, now.ab, pair.margin);
    if (axis.gap <= closed) {
      at_arrival(axis, first);
      return has_arrived;
    }
    // The first holds for any plane: there is always progress.
    return Look{false, std::max((axis.gap - target) / pair.fastest, apart_step(now, axis, target, rest))};
  });
}

// Gives up, as where nothing arrives, after `max_advancements`.
double time_to_depth(const BoxPair& pair, double gap_now, const Goal& goal) {
  const auto depth =
      depth_of_arrival(pair.shape_a, pair.motion_a, pair.shape_b, pair.motion_b, pair.fastest, gap_now, goal);
  if (!depth) return goal.horizon;
  bool arrived = false;
  const double t = time_to_gap(pair, *depth, *depth + goal.closed, goal.horizon,
                               [&](const SeparatingAxis&, bool) { arrived = true; });
  return arrived ? t : goal.horizon;
}

// What arrives at two boxes that touch now, their gap along `axis`.
double time_while_closed(const BoxPair& pair, const SeparatingAxis& axis, const Goal& goal) {
  // The face that separates best, of both boxes; for edges the face of a that looks most along their normal.
  int face = axis.index;
  double side = 0;
  if (face >= 6) {
    axis.normal_A.cwiseAbs().maxCoeff(&face);
    side = axis.normal_A[face] < 0 ? -1 : 1;
  }
  return time_to_depth(pair, axis.gap, {goal.closed, goal.target, patch_to_flat(pair, face, side, goal)});
}

}  // namespace

double box_to_box(const Shape& shape_a, const Motion& motion_a, const Shape& shape_b, const Motion& motion_b,
                  const Goal& goal) {
  const Vec3 v = motion_b.v - motion_a.v;
  const double r_a = shape_a.half_extents.norm(), r_b = shape_b.half_extents.norm();
  const double fastest = v.norm() + motion_a.w.norm() * r_a + motion_b.w.norm() * r_b;
  if (fastest * goal.horizon <= goal.closed - goal.target) return goal.horizon;
  const double apart = (motion_b.pose.p - motion_a.pose.p).norm() - r_a - r_b;
  if (apart - goal.closed > fastest * goal.horizon) return goal.horizon;

  const BoxPair pair{shape_a,  motion_a, shape_b,
                     motion_b, fastest,  axis_margin(goal.closed, shape_a.half_extents, shape_b.half_extents)};
  std::optional<SeparatingAxis> touching;
  const double t =
      time_to_gap(pair, goal.target, goal.closed, goal.horizon, [&](const SeparatingAxis& axis, bool first) {
        if (first) touching = axis;
      });
  return touching ? time_while_closed(pair, *touching, goal) : t;
}

}  // namespace cb
