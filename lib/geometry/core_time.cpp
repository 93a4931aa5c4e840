// First time at which a feature of a capsule or a hull and another shape closes: what time_of_contact.cpp follows for
// them (not on half-spaces).
//
// While the pair is open: the best of the planes and edges that separate it now, for as long as they surely do: a plane
// through the nearest point that turns with either of the two (vertices of the other over it), and the two edges that
// come closest, along their common normal.
// While it is closed:
//   two solid cores: as box_box_time.cpp does it, the corners of the patch that two faces share and that are open; of a
//   core with seams also vertices beside the patch, which have no corner on a seam that stands for them;
//   a point or a segment with a radius: each end of the segment that is open, as a ball of its own; each vertex of the
//   other that is open, over the segment; each edge of the other that it crosses.
// Whatever else arrives is found as the time at which the two get deeper than what touches explains.
// Of a core with seams (polytope.h) all axes keep the two apart. Where they come together and nothing that carries
// approaches (a body slides on to the next triangle of a ground), nothing arrives: from then on they are closed, and
// only what carries is followed.
#include "geometry/core_time.h"

#include <vector>

#include "geometry/box_box.h"
#include "geometry/core.h"

namespace cb {

double closing_speed(const Shape& shape_a, const Motion& motion_a, const Shape& shape_b, const Motion& motion_b,
                     double tolerance) {
  thread_local std::vector<ContactPoint> points;  // does not allocate after its first calls
  points.clear();
  contact_points(shape_a, motion_a.pose, 0, shape_b, motion_b.pose, 1, tolerance, points);
  double speed = 0;
  for (const ContactPoint& point : points) {
    const Vec3 v_a = motion_a.v + motion_a.w.cross(point.position - motion_a.pose.p);
    const Vec3 v_b = motion_b.v + motion_b.w.cross(point.position - motion_b.pose.p);
    speed = std::max(speed, -point.normal.dot(v_a - v_b));
  }
  return speed;
}

std::optional<double> depth_of_arrival(const Shape& shape_a, const Motion& motion_a, const Shape& shape_b,
                                       const Motion& motion_b, double fastest, double gap_now, const Goal& goal) {
  const double w_a = motion_a.w.norm(), w_b = motion_b.w.norm(), S = goal.horizon;
  const double second = 2 * (w_a + w_b) * fastest + w_a * w_a * core_reach(shape_a) + w_b * w_b * core_reach(shape_b);
  const double explained = std::min(0.0, gap_now) - 2 * goal.closed - second * S * S / 2;
  if (gap_now - fastest * S > explained) return std::nullopt;
  return explained - closing_speed(shape_a, motion_a, shape_b, motion_b, goal.closed) * S;
}

EdgeOf edge_of(const PlacedCore& core, int edge) {
  const Polytope::Edge& of = core.form->edges[edge];
  EdgeOf out{core.x[of.from], core.along(edge).normalized(), {}, core.solid() ? 2 : 0};
  if (out.sides > 0) out.away = {out.e.cross(core.n[of.left]), core.n[of.right].cross(out.e)};
  return out;
}

namespace {

/// A shape in motion, or one vertex of its core that goes with it.
struct Moved {
  const Shape& shape;
  const Motion& motion;
  int vertex = -1;
};

/// As it is placed at a time.
struct MovingCore : PlacedCore {
  Vec3 v, w;  ///< m/s, rad/s
};

struct Pair {
  Moved a, b;
  double fastest;      ///< m/s: no two points of the cores approach faster
  double radius;       ///< sum of both, m
  double margin;       ///< m, of separating_axis
  bool seams = false;  ///< has one of them any?
};

struct Cores {
  MovingCore a, b;
  void place(const Pair& pair, double t) {
    const Pose pose_a = advance(pair.a.motion, t), pose_b = advance(pair.b.motion, t);
    a.place(pair.a.shape, pose_a, pose_a.p, pair.a.vertex);
    b.place(pair.b.shape, pose_b, pose_a.p, pair.b.vertex);
    a.v = pair.a.motion.v;
    a.w = pair.a.motion.w;
    b.v = pair.b.motion.v;
    b.w = pair.b.motion.w;
  }
};

// A step over which every vertex of `other` surely stays more than `clearance` (m) above the plane { n.x = level } that
// turns with `plane`.
double step_over_plane(const MovingCore& plane, const MovingCore& other, const Vec3& n, double level, double clearance,
                       double rest) {
  const Moving normal = turning_direction(n, plane.w);
  const Vec3 v = other.v - plane.v;
  double step = rest;
  for (const Vec3& x : other.x) {
    const double value = n.dot(x) - level;
    const Moving distance = between(x - plane.c, v, other.w, x - other.c, Vec3::Zero(), Vec3::Zero(), step);
    if (value - clearance > (normal.size[1] * distance.size[0] + distance.size[1]) * step) continue;
    if (value <= clearance) return 0;
    Approach approach = along_normal(normal, distance);
    approach.value = value;
    step = std::min(step, safe_step(approach, clearance, step));
  }
  return step;
}

// The same for an edge of a and one of b, n from a to b: along q = e x f, for as long as both stay the outermost along
// it.
double step_over_edges(const MovingCore& a, const EdgeOf& on_a, const MovingCore& b, const EdgeOf& on_b, const Vec3& n,
                       double radius, double target, double rest) {
  const double sign = on_a.e.cross(on_b.e).dot(n) < 0 ? -1 : 1;
  const Moving q = crossed(turning_direction(on_a.e, a.w), turning_direction(sign * on_b.e, b.w));
  double interval = rest;
  for (int k = 0; k < on_a.sides; ++k)
    interval = std::min(interval, safe_step(along_normal(q, turning_direction(on_a.away[k], a.w)), 0, interval));
  for (int k = 0; k < on_b.sides; ++k)
    interval = std::min(interval, safe_step(along_normal(q, turning_direction(-on_b.away[k], b.w)), 0, interval));
  const Moving d = between(on_b.x - on_a.x, b.v - a.v, b.w, on_b.x - b.c, a.w, on_a.x - a.c, interval);
  return safe_step_across(q, along_normal(q, d), radius, target, interval);
}

/// How the two are apart now: their gap, and a step over which it surely stays above a target (m).
struct Apart {
  double gap;
  double step;
};

// Two solid cores.
Apart solids_apart(const Cores& now, const Pair& pair, double target, double rest) {
  const auto& [a, b] = now;
  const CoreAxis axis = separating_axis(a, b, pair.margin);
  const auto over_a = [&](int f) { return step_over_plane(a, b, a.n[f], a.offset[f], target, rest); };
  const auto over_b = [&](int f) { return step_over_plane(b, a, b.n[f], b.offset[f], target, rest); };
  double step = (axis.gap - target) / pair.fastest;
  if (axis.gap <= target) return {axis.gap, 0};
  if (axis.kind == CoreAxis::Kind::face_a) return {axis.gap, std::max(step, over_a(axis.a))};
  if (axis.kind == CoreAxis::Kind::face_b) return {axis.gap, std::max(step, over_b(axis.b))};
  step = std::max(step, step_over_edges(a, edge_of(a, axis.a), b, edge_of(b, axis.b), axis.n, 0, target, rest));
  // Nearly a face axis: the face lasts longer.
  const Polytope::Edge &edge_a = a.form->edges[axis.a], &edge_b = b.form->edges[axis.b];
  for (const int f : {edge_a.left, edge_a.right})
    if (step < rest) step = std::max(step, over_a(f));
  for (const int f : {edge_b.left, edge_b.right})
    if (step < rest) step = std::max(step, over_b(f));
  return {axis.gap, step};
}

// A point or a segment s and another core x.
Apart thin_apart(const MovingCore& s, const MovingCore& x, const Pair& pair, double target, double rest) {
  const NearestCore near = nearest(s, x);
  const double gap = near.distance - pair.radius, clearance = target + pair.radius;
  if (gap <= target) return {gap, 0};
  double step = (gap - target) / pair.fastest;
  if (near.distance <= 0) return {gap, step};
  if (step < rest) step = std::max(step, step_over_plane(x, s, near.n, near.n.dot(near.on_x), clearance, rest));
  if (step < rest) step = std::max(step, step_over_plane(s, x, -near.n, -near.n.dot(near.on_s), clearance, rest));
  if (step < rest && near.edge >= 0)
    step =
        std::max(step, step_over_edges(x, edge_of(x, near.edge), s, edge_of(s, 0), near.n, pair.radius, target, rest));
  return {gap, step};
}

bool thin(const PlacedCore& core) { return core.x.size() <= 2; }

Apart apart(const Cores& now, const Pair& pair, double target, double rest) {
  if (!thin(now.a) && !thin(now.b)) return solids_apart(now, pair, target, rest);
  return now.a.x.size() <= now.b.x.size() ? thin_apart(now.a, now.b, pair, target, rest)
                                          : thin_apart(now.b, now.a, pair, target, rest);
}

// A place for each depth of call: a pair, a feature of it.
Cores& scratch(int depth) {
  thread_local std::array<Cores, 2> cores;  // does not allocate after its first calls
  return cores[static_cast<std::size_t>(depth)];
}

// The first time at which the gap of the two is at most `closed`, in steps towards `target` (m). at_arrival(gap,
// first): told of the gap then, and whether anything has moved.
template <class AtArrival>
double time_to_gap(const Pair& pair, double target, double closed, double horizon, const AtArrival& at_arrival) {
  return advance_until(horizon, [&](double t, double rest, bool first) {
    Cores& now = scratch(1);
    now.place(pair, t);
    const Apart is = apart(now, pair, target, rest);
    if (is.gap <= closed) {
      at_arrival(is.gap, first);
      return has_arrived;
    }
    return Look{false, is.step};
  });
}

// How an open corner of the patch and what it is over come together, the goal's target apart.
Approach of_corner(const CorePatch& patch, const CorePatchPoint& point, const MovingCore& reference,
                   const MovingCore& other, const Goal& goal, double rest) {
  const Vec3 d = point.gap * patch.n, x_r = point.foot - reference.c, x_o = point.foot + d - other.c;
  const Moving distance = between(d, other.v - reference.v, other.w, x_o, reference.w, x_r, rest);
  if (point.kind != CorePatchPoint::edges) {
    const bool over_reference = point.kind == CorePatchPoint::vertex_over_face;
    const Moving normal =
        over_reference ? turning_direction(patch.n, reference.w) : turning_direction(-other.n[patch.incident], other.w);
    Approach gap = along_normal(normal, distance);
    gap.value -= goal.target;
    return gap;
  }
  const auto side = [](const MovingCore& core, int face, int k) -> Vec3 {
    const Polytope::Face& f = core.form->faces[face];
    return (core.x[core.form->corner(f, k + 1)] - core.x[core.form->corner(f, k)]).normalized();
  };
  const Vec3 edge_o = side(other, patch.incident, point.incident),
             edge_r = side(reference, patch.face, point.reference);
  const double sign = d.dot(edge_o.cross(edge_r)) < 0 ? -1 : 1;
  const Moving q = crossed(turning_direction(sign * edge_o, other.w), turning_direction(edge_r, reference.w));
  return edge_over_edge(q, distance, goal);
}

// Two solid cores, closed: follows the corners of the common patch that are open, and what slides into it over a seam.
double patch_to_flat(const Pair& pair, bool reference_is_a, int face, const Goal& goal) {
  constexpr double steepest = 0.5;  // cosine between the two normals; steeper faces do not come together in a step
  thread_local CorePatch patch;     // do not allocate after their first calls
  thread_local std::vector<CorePatchPoint> beside;
  thread_local std::vector<std::uint64_t> open;
  open.clear();
  patch.reference_is_a = reference_is_a;
  return advance_until(goal.horizon, [&](double t, double rest, bool) {
    Cores& now = scratch(0);
    now.place(pair, t);
    const MovingCore& reference = reference_is_a ? now.a : now.b;
    const MovingCore& other = reference_is_a ? now.b : now.a;
    face_patch(reference, other, face, pair.margin, patch);
    if (-other.n[patch.incident].dot(patch.n) < steepest) return never_arrives;
    double step = rest;
    const auto follow = [&](const CorePatchPoint& point) {
      open.push_back(point.id);
      const Approach gap = of_corner(patch, point, reference, other, goal, rest);
      if (gap.value <= 0) return;  // vertices stand for these edges
      step = std::min(step, first_root(gap.value, gap.rate, gap.curvature - gap.K * rest / 3));
    };
    const std::size_t seen = open.size();
    for (const CorePatchPoint& point : patch.point) {
      if (point.gap <= goal.closed) {
        if (std::find(open.begin(), open.begin() + static_cast<std::ptrdiff_t>(seen), point.id) !=
            open.begin() + static_cast<std::ptrdiff_t>(seen))
          return has_arrived;
        continue;
      }
      follow(point);
    }
    if (pair.seams) {
      beside_patch(reference, other, patch, beside);
      for (const CorePatchPoint& point : beside)
        if (point.gap > goal.closed) follow(point);
    }
    return Look{false, step};
  });
}

// `axis`: along which they touch.
double flat_time(const Pair& pair, const CoreAxis& axis, const Goal& goal) {
  if (axis.kind == CoreAxis::Kind::face_b) return patch_to_flat(pair, false, axis.b, goal);
  int face = axis.a;
  if (axis.kind == CoreAxis::Kind::edges) {  // the face of a that looks most along their normal
    Cores& now = scratch(0);
    now.place(pair, 0);
    face = 0;
    for (int f = 1; f < static_cast<int>(now.a.n.size()); ++f)
      if (now.a.n[f].dot(axis.n) > now.a.n[face].dot(axis.n)) face = f;
  }
  return patch_to_flat(pair, true, face, goal);
}

// The time at which one vertex of a shape's core, with its radius, closes on the other, where it is open.
double vertex_time(const Pair& pair, bool of_a, int vertex, const Goal& goal) {
  const Pair one{{pair.a.shape, pair.a.motion, of_a ? vertex : -1},
                 {pair.b.shape, pair.b.motion, of_a ? -1 : vertex},
                 pair.fastest,
                 pair.radius,
                 pair.margin};
  bool closed = false;
  const double t = time_to_gap(one, goal.target, goal.closed, goal.horizon, [&](double, bool first) {
    const Cores& now = scratch(1);
    const auto left_out = [&] {
      return of_a ? !carries(now.b, nearest(now.a, now.b)) : !carries(now.a, nearest(now.b, now.a));
    };
    closed = first || (pair.seams && left_out());
  });
  return closed ? goal.horizon : t;
}

// The same of the segment of s and an edge of x, while inner points of both are the nearest.
double crossing_time(const Pair& pair, bool s_is_a, int edge, const Goal& goal) {
  return advance_until(goal.horizon, [&](double t, double rest, bool first) {
    Cores& now = scratch(1);
    now.place(pair, t);
    const MovingCore &s = s_is_a ? now.a : now.b, &x = s_is_a ? now.b : now.a;
    const SegmentPair at = closest(s.x[0], s.along(0), x.x[x.form->edges[edge].from], x.along(edge));
    const double distance = std::sqrt(at.distance2), gap = distance - pair.radius;
    if (!(at.s > 0 && at.s < 1 && at.t > 0 && at.t < 1)) return never_arrives;
    if (gap <= goal.closed) return first ? never_arrives : has_arrived;
    EdgeOf of_x = edge_of(x, edge);
    of_x.sides = 0;
    const double step =
        step_over_edges(x, of_x, s, edge_of(s, 0), (at.a - at.b) / distance, pair.radius, goal.target, rest);
    return Look{false, std::max((gap - goal.target) / pair.fastest, step)};
  });
}

// A point or a segment on another core, closed: its ends, and the vertices and edges of the other, that are open.
double features_time(const Pair& pair, Goal goal) {
  Cores& now = scratch(0);
  now.place(pair, 0);
  const bool s_is_a = now.a.x.size() <= now.b.x.size();
  const MovingCore &s = s_is_a ? now.a : now.b, &x = s_is_a ? now.b : now.a;
  const double reach = pair.fastest * goal.horizon + goal.closed + pair.radius;
  if (s.x.size() < 2) return goal.horizon;
  for (int end = 0; end < 2; ++end) goal.horizon = vertex_time(pair, s_is_a, end, goal);
  const Vec3 u = s.along(0);
  for (int i = 0; i < static_cast<int>(x.x.size()); ++i) {
    const SegmentPair at = closest(s.x[0], u, x.x[i], Vec3::Zero());
    if (pair.seams && x.seams()->sharp_vertex[i] == 0) continue;
    if (at.s > 0 && at.s < 1 && at.distance2 <= reach * reach) goal.horizon = vertex_time(pair, !s_is_a, i, goal);
  }
  for (int e = 0; e < x.edges(); ++e) {
    const SegmentPair at = closest(s.x[0], u, x.x[x.form->edges[e].from], x.along(e));
    if (pair.seams && x.seams()->sharp_edge[e] == 0) continue;
    if (at.s > 0 && at.s < 1 && at.t > 0 && at.t < 1 && at.distance2 <= reach * reach)
      goal.horizon = crossing_time(pair, s_is_a, e, goal);
  }
  return goal.horizon;
}

/// The gap of the deepest point that carries at the time t, m; infinite where none does.
double carried_gap(const Pair& pair, double t, double tolerance) {
  thread_local std::vector<ContactPoint> points;  // does not allocate after its first calls
  points.clear();
  contact_points(pair.a.shape, advance(pair.a.motion, t), 0, pair.b.shape, advance(pair.b.motion, t), 1, tolerance,
                 points);
  double gap = HUGE_VAL;
  for (const ContactPoint& point : points) gap = std::min(gap, point.gap);
  return gap;
}

// Of a core with seams the gap may be that of an inner side, which a body sinks into that slides on over the next
// prism, or along a ridge beside it. Where something carries it is as deep as that is; where nothing does, depths are
// looked at twice as deep each, until something carries.
double time_to_depth(const Pair& pair, double gap_now, const Goal& goal) {
  const auto depth_from = [&](double gap) {
    return depth_of_arrival(pair.a.shape, pair.a.motion, pair.b.shape, pair.b.motion, pair.fastest, gap, goal);
  };
  const auto time_at = [&](double depth) {
    bool arrived = false;
    const double t = time_to_gap(pair, depth, depth + goal.closed, goal.horizon, [&](double, bool) { arrived = true; });
    return arrived ? t : HUGE_VAL;
  };
  const auto depth = depth_from(gap_now);
  if (!depth) return goal.horizon;
  double t = time_at(*depth);
  if (t == HUGE_VAL || !pair.seams) return std::min(t, goal.horizon);
  if (const double carried = carried_gap(pair, 0, goal.closed); carried < HUGE_VAL) {
    if (carried >= gap_now) return t;
    const auto below = depth_from(carried);
    return below ? std::min(time_at(*below), goal.horizon) : goal.horizon;
  }
  for (double deeper = 2 * *depth; t < HUGE_VAL && carried_gap(pair, t, goal.closed) == HUGE_VAL; deeper *= 2)
    t = time_at(deeper);
  return std::min(t, goal.horizon);
}

// What arrives at two that touch now, with that gap.
double time_while_closed(const Pair& pair, double gap_now, const Goal& goal) {
  if (core_of(pair.a.shape).vertices.size() <= 2 || core_of(pair.b.shape).vertices.size() <= 2)
    return time_to_depth(pair, gap_now, {goal.closed, goal.target, features_time(pair, goal)});
  Cores& now = scratch(0);
  now.place(pair, 0);
  const CoreAxis axis =
      pair.seams ? carrying_axis(now.a, now.b, pair.margin) : separating_axis(now.a, now.b, pair.margin);
  return time_to_depth(pair, gap_now, {goal.closed, goal.target, flat_time(pair, axis, goal)});
}

}  // namespace

double core_to_core(const Shape& shape_a, const Motion& motion_a, const Shape& shape_b, const Motion& motion_b,
                    const Goal& goal) {
  const Vec3 v = motion_b.v - motion_a.v;
  const double r_a = core_reach(shape_a), r_b = core_reach(shape_b);
  const double fastest = v.norm() + motion_a.w.norm() * r_a + motion_b.w.norm() * r_b;
  if (fastest * goal.horizon <= goal.closed - goal.target) return goal.horizon;
  const double reach = shape_a.bounding_radius() + shape_b.bounding_radius();
  if ((motion_b.pose.p - motion_a.pose.p).norm() - reach - goal.closed > fastest * goal.horizon) return goal.horizon;

  const auto radius_of = [](const Shape& shape) {
    return shape.kind == ShapeKind::hull || shape.kind == ShapeKind::box ? 0 : shape.radius;
  };
  const Pair pair{{shape_a, motion_a},
                  {shape_b, motion_b},
                  fastest,
                  radius_of(shape_a) + radius_of(shape_b),
                  axis_margin(goal.closed, shape_a.half_extents, shape_b.half_extents),
                  core_of(shape_a).seams || core_of(shape_b).seams};
  bool arrived = false, touching = false;
  double gap_now = 0;
  const double t = time_to_gap(pair, goal.target, goal.closed, goal.horizon, [&](double gap, bool first) {
    arrived = true;
    touching = first;
    gap_now = gap;
  });
  if (touching) return time_while_closed(pair, gap_now, goal);
  if (!arrived || !pair.seams) return t;
  // Comes what carries nearer there?
  const Motion then_a{advance(motion_a, t), motion_a.v, motion_a.w},
      then_b{advance(motion_b, t), motion_b.v, motion_b.w};
  const double rest = goal.horizon - t;
  if (closing_speed(shape_a, then_a, shape_b, then_b, goal.closed) * rest > goal.closed) return t;
  const Pair then{{shape_a, then_a}, {shape_b, then_b}, fastest, pair.radius, pair.margin, true};
  return t + time_while_closed(then, gap_now, {goal.closed, goal.target, rest});
}

}  // namespace cb
