// First time at which a feature of a cylinder and a core, or another cylinder, closes: what time_of_contact.cpp follows
// for them.
//
// While the pair is open: the normal that separates them best now, for as long as a plane across it surely does that
// turns with the one or with the other (what is above it: vertices, or the ends of a cylinder); and the lines along two
// sides, or a side and an edge, along their common normal.
//   A cylinder is the same however far it has turned about its axis d. Planes that go with it do not take part in that
//   turning, so that one which rolls costs no small steps: they turn with w - (w.d) d, of the size a = |w x d|.
//   Above a plane with normal n, c = n.d: an end at h along the axis is n.(x - p) + h c - r s high, s = sqrt(1 - c^2).
//   As a function of c, s is below its tangent; and s = |n x d| is below the chord of its first order and what its
//   second derivative adds. The better of the two.
// While it is closed, parts of both, each on its own where it is open: the ends of a cylinder as discs, of an end that
// is closed the points of its rim across from where it is nearest; vertices and edges of the core. Whatever else
// arrives is found as the time at which the two get deeper than what touches explains (as box_box_time.cpp's). Seams:
// as core_time.cpp.
#include "geometry/cylinder_time.h"

#include <array>

#include "geometry/box_box.h"
#include "geometry/core_time.h"
#include "geometry/cylinder.h"

namespace cb {

namespace {

/// A shape in motion, or a part of it that goes with it.
struct Part {
  enum What { whole, end, rim_point, vertex, edge };
  const Shape& shape;
  const Motion& motion;
  What what = whole;
  int index = 0;          // the end, 1 or -1; the vertex, the edge
  Vec3 x = Vec3::Zero();  // the point of the rim, in the shape's frame
};

/// It as it is placed at a time.
struct Solid {
  bool round = false;  // a cylinder, an end, or a point of its rim?
  bool axial = false;  // is it the same however far it has turned about its axis?
  PlacedCylinder cylinder;
  PlacedCore core;
  Vec3 pivot, v, w;  // m, m/s, rad/s

  Opposite opposite() const { return round ? Opposite{nullptr, &cylinder} : Opposite{&core, nullptr}; }
  Vec3 d() const { return cylinder.d(); }
  void place(const Part& part, double t, const Vec3& origin);
};

void Solid::place(const Part& part, double t, const Vec3& origin) {
  const Shape& shape = part.shape;
  const Pose pose = advance(part.motion, t);
  pivot = pose.p - origin;
  v = part.motion.v;
  w = part.motion.w;
  round = shape.kind == ShapeKind::cylinder;
  axial = round && part.what != Part::rim_point;
  if (!round) {
    core.place(shape, pose, origin, part.what == Part::vertex ? part.index : -1);
    if (part.what != Part::edge) return;
    const Polytope::Edge of = core.form->edges[static_cast<std::size_t>(part.index)];
    const std::array<Vec3, 2> ends{core.x[of.from], core.x[of.to]};
    core.form = &unit_segment();
    core.x.assign(ends.begin(), ends.end());
    core.n.clear();
    core.offset.clear();
    return;
  }
  cylinder.place(shape, pose, origin);
  if (part.what == Part::whole) return;
  cylinder.c = part.what == Part::end ? cylinder.middle(part.index) : Vec3(pivot + cylinder.R * part.x);
  cylinder.l = 0;
  if (part.what == Part::rim_point) cylinder.r = 0;
}

/// A cylinder, or a part of it, and what it meets.
struct Pair {
  Part c, x;
  double fastest;  ///< m/s: no two points approach faster, turning about axes aside
  double margin;   ///< m, of contact points
  bool seams;      ///< has the other any?
};

struct Placed {
  Solid c, x;
  void place(const Pair& pair, double t) {
    const Vec3 origin = advance(pair.c.motion, t).p;
    c.place(pair.c, t, origin);
    x.place(pair.x, t, origin);
  }
};

// A place for each depth of call: a pair, a part of it, a pair again.
Placed& scratch(int depth) {
  thread_local std::array<Placed, 3> placed;  // does not allocate after its first calls
  return placed[static_cast<std::size_t>(depth)];
}

// The axis of a cylinder: it goes round w.
Moving moving_axis(const Solid& s) {
  const Vec3 d = s.d(), d1 = s.w.cross(d);
  const double spin = s.w.norm(), a = d1.norm();
  return {d, d1, s.w.cross(d1), {1, a, spin * a, spin * spin * a}};
}

// A direction that goes with a solid, less the turning of a cylinder about its axis: n' = u x n with u = w - k d, k =
// w.d constant, u' = -k w x d, |u''| = |k w| a.
Moving moving_with(const Solid& s, const Vec3& n) {
  if (!s.axial) return turning_direction(n, s.w);
  const double k = s.w.dot(s.d()), spin = s.w.norm(), about = std::abs(k);
  const Vec3 d1 = s.w.cross(s.d()), u = s.w - k * s.d(), n1 = u.cross(n);
  const double a = d1.norm();
  return {n,
          n1,
          -k * d1.cross(n) + u.cross(n1),
          {1, a, about * a + a * a, about * spin * a + 3 * about * a * a + a * a * a}};
}

// k f + g.
Approach combined(double k, const Approach& f, const Approach& g) {
  return {k * f.value + g.value, k * f.rate + g.rate, k * f.curvature + g.curvature, std::abs(k) * f.K + g.K};
}

// A step over which a cylinder surely stays more than `clearance` above the plane { n.(x - p) = level } that n and p,
// the pivot of another solid, move with.
double step_of_cylinder(const Moving& n, const Solid& below, const Solid& s, double level, double clearance,
                        double rest) {
  const Vec3 D = s.pivot - below.pivot, V = s.v - below.v;
  const double speed = V.norm();
  const Approach height = along_normal(n, {D, V, Vec3::Zero(), {D.norm() + speed * rest, speed, 0, 0}});
  const Moving d = moving_axis(s), q = crossed(n, d);
  const Approach c = along_normal(n, d);
  const double r = s.cylinder.r, sine = q.x.norm(), middle = (s.cylinder.c - s.pivot).dot(s.d());
  double step = rest;
  for (int k = 0; k < s.cylinder.ends(); ++k) {
    const double h = middle + s.cylinder.end(k) * s.cylinder.l;
    Approach end = combined(h, c, height);
    end.value -= level + r * sine;
    if (end.value <= clearance) return 0;
    double best = 0;
    if (sine > 0) {  // by the tangent
      Approach tangent = combined(h + r * c.value / sine, c, height);
      tangent.value = end.value;
      best = safe_step(tangent, clearance, step);
    }
    constexpr int improvements = 4;
    double part = step;
    for (int i = 0; i < improvements && part > best; ++i) {  // by the chord
      const double longer = ((q.x + part * q.x1).norm() - sine) / part;
      const Approach chord{end.value, end.rate - r * longer, end.curvature - r * q.size[2], end.K};
      const double root = safe_step(chord, clearance, part);
      best = std::max(best, root);
      if (root >= part / 2) break;
      part = 2 * best;
    }
    step = std::min(step, best);
  }
  return step;
}

// The same of points: vertices of a core, a point of a rim.
double step_of_point(const Moving& n, const Solid& below, const Solid& s, const Vec3& x, double level, double clearance,
                     double rest) {
  Approach height =
      along_normal(n, between(x - below.pivot, s.v - below.v, s.w, x - s.pivot, Vec3::Zero(), Vec3::Zero(), rest));
  height.value -= level;
  return height.value <= clearance ? 0 : safe_step(height, clearance, rest);
}

// A step over which `s` surely stays more than `target` above the plane across n, out of `below`, that goes with it and
// has it below.
double step_over_plane(const Solid& below, const Solid& s, const Vec3& n, double target, double rest) {
  const double level = -below.opposite().lowest(-n) - n.dot(below.pivot);
  const Moving normal = moving_with(below, n);
  if (s.axial) return step_of_cylinder(normal, below, s, level, target, rest);
  if (s.round) return step_of_point(normal, below, s, s.cylinder.c, level, target, rest);
  double step = rest;
  for (const Vec3& x : s.core.x)
    if (step > 0) step = std::min(step, step_of_point(normal, below, s, x, level, target + s.core.radius, step));
  return step;
}

/// A line that goes with a solid, and what falls away from it (EdgeOf).
struct Line {
  EdgeOf of;
  Moving e;
  double radius;
};
Line side_line(const Solid& s) { return {{s.cylinder.c, s.d(), {}, 0}, moving_axis(s), s.cylinder.r}; }
Line edge_line(const Solid& s, int edge) {
  const EdgeOf of = edge_of(s.core, edge);
  return {of, turning_direction(of.e, s.w), s.core.radius};
}

// As core_time.cpp's, for lines of a and b, n from a to b.
double step_over_lines(const Solid& a, const Line& on_a, const Solid& b, const Line& on_b, const Vec3& n, double target,
                       double rest) {
  const double sign = on_a.of.e.cross(on_b.of.e).dot(n) < 0 ? -1 : 1;
  Moving q = crossed(on_a.e, on_b.e);
  q.x *= sign;
  q.x1 *= sign;
  q.x2 *= sign;
  double interval = rest;
  for (int k = 0; k < on_b.of.sides; ++k)
    interval = std::min(interval, safe_step(along_normal(q, turning_direction(-on_b.of.away[k], b.w)), 0, interval));
  // The middle of a side is its own pivot, or along the axis from it.
  const Vec3 x_a = a.axial ? Vec3(Vec3::Zero()) : Vec3(on_a.of.x - a.pivot);
  const Vec3 x_b = b.axial ? Vec3(Vec3::Zero()) : Vec3(on_b.of.x - b.pivot);
  const Moving d = between(b.pivot + x_b - a.pivot - x_a, b.v - a.v, b.w, x_b, a.w, x_a, interval);
  return safe_step_across(q, along_normal(q, d), on_a.radius + on_b.radius, target, interval);
}

/// How the two are apart now: the axis, and a step over which the gap surely stays above a target (m).
struct Apart {
  CylinderAxis axis;
  double step;
};

bool across_side(const Solid& s, const Vec3& n) {
  constexpr double upright = 1e-9;  // cosine
  return s.axial && s.cylinder.l > 0 && std::abs(n.dot(s.d())) <= upright;
}

Apart apart(const Placed& now, const Pair& pair, double target, double rest) {
  constexpr double nearly = 0.99;  // cosine of a flat face that lasts longer
  const auto& [c, x] = now;
  const CylinderAxis axis = separating_axis(c.cylinder, x.opposite(), 0);
  if (axis.gap <= target) return {axis, 0};
  double step = (axis.gap - target) / pair.fastest;
  const auto look = [&](const Vec3& n) {
    if (step < rest) step = std::max(step, step_over_plane(x, c, -n, target, rest));
    if (step < rest) step = std::max(step, step_over_plane(c, x, n, target, rest));
  };
  look(axis.n);
  if (step >= rest || axis.kind != CylinderAxis::Kind::curved) return {axis, step};
  if (across_side(c, axis.n) && (axis.edge >= 0 || (x.round && across_side(x, axis.n)))) {
    const Line other = x.round ? side_line(x) : edge_line(x, axis.edge);
    if (c.d().cross(other.of.e).squaredNorm() > 1e-16)
      step = std::max(step, step_over_lines(c, side_line(c), x, other, axis.n, target, rest));
  }
  if (!x.round) {
    int face = -1;
    double most = nearly;
    for (int f = 0; f < static_cast<int>(x.core.n.size()); ++f) {
      if (-x.core.n[f].dot(axis.n) <= most) continue;
      most = -x.core.n[f].dot(axis.n);
      face = f;
    }
    if (face >= 0) look(-x.core.n[face]);
  }
  for (const Solid* s : {&c, &x})
    if (s->axial && std::abs(s->d().dot(axis.n)) > nearly) look(std::copysign(1.0, s->d().dot(axis.n)) * s->d());
  return {axis, step};
}

// The first time at which the gap of the two is at most `closed`, in steps towards `target` (m). at_arrival(axis, t):
// told of the axis then, and the time.
template <class AtArrival>
double time_to_gap(const Pair& pair, double target, double closed, double horizon, const AtArrival& at_arrival) {
  return advance_until(horizon, [&](double t, double rest, bool) {
    Placed& now = scratch(1);
    now.place(pair, t);
    const Apart is = apart(now, pair, target, rest);
    if (is.axis.gap > closed) return Look{false, is.step};
    at_arrival(is.axis, t);
    return has_arrived;
  });
}

// Does the other, which has seams, carry what arrives at the time t, and do the two come nearer there within the rest?
// A rim that slides on to the next triangle of a ground arrives at it from beside.
bool carried(const Pair& whole, const Part& c, const Part& x, const CylinderAxis& axis, double t, const Goal& goal) {
  Placed& then = scratch(2);
  then.place({c, whole.x, 0, 0, true}, t);
  if (x.what == Part::vertex) return vertex_carries(then.x.core, x.index, -axis.n);
  if (x.what == Part::edge) return edge_carries(then.x.core, x.index, -axis.n);
  thread_local std::vector<ContactPoint> points;  // does not allocate after its first calls
  points.clear();
  cylinder_points(then.c.cylinder, then.x.opposite(), Vec3::Zero(), goal.closed, goal.closed, whole.margin,
                  {points, 1, 0, 1});
  double speed = 0;
  for (const ContactPoint& p : points) {
    const Vec3 v_c = then.c.v + then.c.w.cross(p.position - then.c.pivot),
               v_x = then.x.v + then.x.w.cross(p.position - then.x.pivot);
    speed = std::max(speed, -p.normal.dot(v_c - v_x));
  }
  return speed * (goal.horizon - t) > goal.closed;
}

// The time at which parts of the two close, where they are open.
double part_time(const Pair& whole, const Part& c, const Part& x, const Goal& goal) {
  const double spin = c.what == Part::rim_point ? c.motion.w.norm() * c.shape.bounding_radius() : 0;
  const Pair pair{c, x, whole.fastest + spin, whole.margin, whole.seams};
  bool counts = true;
  const double t = time_to_gap(pair, goal.target, goal.closed, goal.horizon, [&](const CylinderAxis& axis, double at) {
    counts = at > 0 && (!whole.seams || carried(whole, c, x, axis, at, goal));
  });
  return counts ? t : goal.horizon;
}

// The ends of a cylinder, and of one that is closed the points of its rim a quarter and half a turn from where it is
// nearest. n: along which the other is; what is further from it along n than `reach` does not get there.
template <class TimeOf>
double ends_time(const Part& whole, const Solid& at_start, const Opposite& other, const Vec3& n, double reach,
                 double closed, double horizon, const TimeOf& time_of) {
  const PlacedCylinder& cylinder = at_start.cylinder;
  const double near = other.lowest(n) - reach, spun = at_start.w.norm() * whole.shape.bounding_radius() * horizon;
  for (int k = 0; k < cylinder.ends(); ++k) {
    const int end = cylinder.end(k);
    PlacedCylinder disc = cylinder;
    disc.c = cylinder.middle(end);
    disc.l = 0;
    if (n.dot(disc.c) + disc.reach(n) < near) continue;
    if (separating_axis(disc, other, 0).gap > closed) {
      horizon = time_of(Part{whole.shape, whole.motion, Part::end, end}, horizon);
      continue;
    }
    const Vec3 u = cylinder.outward(n), across = cylinder.d().cross(u);
    for (const Vec3& away : {Vec3(-u), across, Vec3(-across)}) {
      if (n.dot(disc.c + cylinder.r * away) < near - spun) continue;
      const Vec3 x = cylinder.R.transpose() * (end * cylinder.l * cylinder.d() + cylinder.r * away);
      horizon = time_of(Part{whole.shape, whole.motion, Part::rim_point, 0, x}, horizon);
    }
  }
  return horizon;
}

// Vertices and edges of the core that are near enough.
double core_parts_time(const Pair& pair, const Solid& c, const Solid& x, const Vec3& n, Goal goal) {
  const double reach = pair.fastest * goal.horizon + goal.closed + x.core.radius;
  const double radius = length(c.cylinder.r, c.cylinder.l);
  const Vec3 middle = c.cylinder.c;
  const double near = n.dot(middle) + c.cylinder.reach(n) + reach;  // along n
  for (int i = 0; i < static_cast<int>(x.core.x.size()); ++i) {
    if (pair.seams && x.core.seams()->sharp_vertex[static_cast<std::size_t>(i)] == 0) continue;
    if (n.dot(x.core.x[i]) > near || (x.core.x[i] - middle).norm() > radius + reach) continue;
    goal.horizon = part_time(pair, pair.c, {pair.x.shape, pair.x.motion, Part::vertex, i}, goal);
  }
  for (int e = 0; e < x.core.edges(); ++e) {
    if (pair.seams && x.core.seams()->sharp_edge[static_cast<std::size_t>(e)] == 0) continue;
    const Polytope::Edge& of = x.core.form->edges[e];
    if (std::min(n.dot(x.core.x[of.from]), n.dot(x.core.x[of.to])) > near) continue;
    const SegmentPair at = closest(middle, Vec3::Zero(), x.core.x[of.from], x.core.along(e));
    if (at.distance2 > (radius + reach) * (radius + reach)) continue;
    goal.horizon = part_time(pair, pair.c, {pair.x.shape, pair.x.motion, Part::edge, e}, goal);
  }
  return goal.horizon;
}

double parts_time(const Pair& pair, const CylinderAxis& axis, Goal goal) {
  Placed& now = scratch(0);
  now.place(pair, 0);
  const auto of_c = [&](const Part& part, double horizon) {
    return part_time(pair, part, pair.x, {goal.closed, goal.target, horizon});
  };
  const double reach = pair.fastest * goal.horizon + goal.closed;
  goal.horizon = ends_time(pair.c, now.c, now.x.opposite(), axis.n, reach, goal.closed, goal.horizon, of_c);
  if (!now.x.round) return core_parts_time(pair, now.c, now.x, axis.n, goal);
  const auto of_x = [&](const Part& part, double horizon) {
    return part_time(pair, pair.c, part, {goal.closed, goal.target, horizon});
  };
  return ends_time(pair.x, now.x, now.c.opposite(), -axis.n, reach, goal.closed, goal.horizon, of_x);
}

// Where nothing that carries approaches then, a neighbour beyond the seam is in between.
double time_to_depth(const Pair& pair, double gap_now, const Goal& goal) {
  const auto depth =
      depth_of_arrival(pair.c.shape, pair.c.motion, pair.x.shape, pair.x.motion, pair.fastest, gap_now, goal);
  if (!depth) return goal.horizon;
  bool arrived = false;
  const double t =
      time_to_gap(pair, *depth, *depth + goal.closed, goal.horizon, [&](const CylinderAxis& axis, double at) {
        arrived = !pair.seams || carried(pair, pair.c, pair.x, axis, at, goal);
      });
  return arrived ? t : goal.horizon;
}

double time_while_closed(const Pair& pair, const CylinderAxis& axis, const Goal& goal) {
  return time_to_depth(pair, axis.gap, {goal.closed, goal.target, parts_time(pair, axis, goal)});
}

}  // namespace

double cylinder_to_solid(const Shape& shape_a, const Motion& motion_a, const Shape& shape_b, const Motion& motion_b,
                         const Goal& goal) {
  const auto turning = [](const Shape& shape, const Motion& motion) {
    const bool axial = shape.kind == ShapeKind::cylinder;
    return (axial ? motion.w.cross(motion.pose.q * Vec3::UnitY()).norm() : motion.w.norm()) * core_reach(shape);
  };
  const double fastest = (motion_b.v - motion_a.v).norm() + turning(shape_a, motion_a) + turning(shape_b, motion_b);
  if (fastest * goal.horizon <= goal.closed - goal.target) return goal.horizon;
  const double reach = shape_a.bounding_radius() + shape_b.bounding_radius();
  if ((motion_b.pose.p - motion_a.pose.p).norm() - reach - goal.closed > fastest * goal.horizon) return goal.horizon;

  const bool seams = shape_b.kind == ShapeKind::hull && shape_b.hull->polytope.seams != nullptr;
  const double margin = axis_margin(goal.closed, shape_a.half_extents, shape_b.half_extents);
  const Pair pair{{shape_a, motion_a}, {shape_b, motion_b}, fastest, margin, seams};
  bool arrived = false, touching = false;
  CylinderAxis axis{};
  const double t = time_to_gap(pair, goal.target, goal.closed, goal.horizon, [&](const CylinderAxis& then, double at) {
    arrived = true;
    touching = at == 0;
    axis = then;
  });
  if (touching) return time_while_closed(pair, axis, goal);
  if (!arrived || !seams) return t;
  // Comes what carries nearer there?
  const Motion then_a{advance(motion_a, t), motion_a.v, motion_a.w},
      then_b{advance(motion_b, t), motion_b.v, motion_b.w};
  const double rest = goal.horizon - t;
  if (closing_speed(shape_a, then_a, shape_b, then_b, goal.closed) * rest > goal.closed) return t;
  const Pair then{{shape_a, then_a}, {shape_b, then_b}, fastest, margin, true};
  return t + time_while_closed(then, axis, {goal.closed, goal.target, rest});
}

}  // namespace cb
