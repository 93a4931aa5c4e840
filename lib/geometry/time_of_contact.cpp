// First time at which a feature that is open now closes, by conservative advancement.
//
// Problem: two shapes in steady motion (m, m/s, rad/s), a horizon (s) and a tolerance (m). Find the first time at which
// the gap of a feature, larger than the tolerance now, is between 0 and the tolerance.
// Source: conservative advancement, Mirtich, "Impulse-based dynamic simulation" (1996), section 2.3.
// Differences from the source:
//   1. The bound on the gap is of third order: gap(t + s) >= gap + gap' s + (gap'' - K S / 3) s^2 / 2 for s <= S, with
//   K a
//      bound on the third derivative. Steps then shrink like Newton's, not geometrically, and a corner about which a
//      body turns, whose gap has neither size nor speed, costs no small steps. Where nothing turns one step is exact.
//   2. Steps aim at a thousandth of the tolerance, or 2 ulp of the coordinates where that is more: round-off still
//   lands
//      between 0 and the tolerance, and an impact's lever arm (to the middle of the gap) is as exact as can be.
//   3. Which features are followed:
//      sphere on half-space, sphere on sphere: closed form;
//      box on half-space: each of the eight corners that is open now, on its own (gap as a function of time in closed
//      form, a sine plus a line);
//      cylinder on half-space: the lowest point of each end, where it is open; of an end whose lowest point touches the
//      half of the rim across from it, so that it finds when it stands flat;
//      sphere on box, sphere on cylinder, box on box while the pair is open: the best separating plane, which turns
//      with the box whose face it is (corners over a face), or with two edges (edge line over edge line); box on box
//      while the pair is closed: the corners of the patch that the two touching faces share and that are open (vertex
//      over face both ways, edge over edge), so that a box on its edge finds when it lies flat; for a corner of the
//      patch that moves along an edge the bound K is an estimate (doubled), not proved. Whatever else of a closed pair
//      of boxes arrives is found as the time at which they get deeper than what touches explains (time_to_depth).
// Does not fail: after `max_advancements` it returns the safe time reached.
// Tolerances are raised to 4 ulp of the largest coordinate (resolved_tolerance).
#include <cmath>
#include <cstdint>
#include <vector>

#include "geometry/box_box.h"
#include "geometry/shapes.h"

namespace cb {

namespace {

/// Advancements of one feature or pair before the safe time reached is returned.
constexpr int max_advancements = 100;
/// Fraction of the tolerance that steps aim at, and its floor in ulp of the coordinates (half of resolved_tolerance's).
constexpr double aim = 1e-3;
constexpr double aim_ulps = 2;

/// What is a contact: open beyond `closed`, sought at `target` (both gaps in m), up to `horizon` (s).
struct Goal {
  double closed, target, horizon;
};

Vec3 plane_normal(const Pose& pose) {
  const Quat& q = pose.q;
  return {2 * (q.x() * q.y() - q.w() * q.z()), 1 - 2 * (q.x() * q.x() + q.z() * q.z()),
          2 * (q.y() * q.z() + q.w() * q.x())};
}

// First positive root of c + b s + k s^2 / 2 for c > 0; infinite where there is none.
double first_root(double c, double b, double k) {
  constexpr double never = std::numeric_limits<double>::infinity();
  const double square = b * b - 2 * k * c;
  if (square < 0 || (b >= 0 && k >= 0)) return never;
  const double root = std::sqrt(square);
  return b < 0 ? 2 * c / (root - b) : (b + root) / -k;
}

double sphere_to_plane(const Shape& sphere, const Motion& motion, const Pose& plane, const Goal& goal) {
  const Vec3 n = plane_normal(plane);
  const double speed = n.dot(motion.v);
  if (speed >= 0) return goal.horizon;
  const double gap = n.dot(motion.pose.p - plane.p) - sphere.radius;
  if (gap <= goal.closed) return goal.horizon;
  return std::min(goal.horizon, (gap - goal.target) / -speed);
}

double sphere_to_sphere(const Shape& a, const Motion& motion_a, const Shape& b, const Motion& motion_b,
                        const Goal& goal) {
  const Vec3 d = motion_a.pose.p - motion_b.pose.p, v = motion_a.v - motion_b.v;
  const double approach = d.dot(v), v2 = v.squaredNorm();
  if (approach >= 0 || v2 == 0) return goal.horizon;
  const double distance = d.norm();
  if (distance - a.radius - b.radius <= goal.closed) return goal.horizon;
  // |d + v t| = R with the distance at the closest approach formed first, without cancellation.
  const double R = a.radius + b.radius + goal.target;
  const double miss2 = (d - (approach / v2) * v).squaredNorm();
  if (miss2 >= R * R) return goal.horizon;
  return std::min(goal.horizon, (distance - R) * (distance + R) / (std::sqrt(v2 * (R * R - miss2)) - approach));
}

double box_to_plane(const Shape& box, const Motion& motion, const Pose& plane, const Goal& goal) {
  const Vec3 n = plane_normal(plane);
  const double speed = n.dot(motion.v);
  const Vec3 n_x_w = n.cross(motion.w);
  const double turning = n_x_w.norm();
  const Vec3& h = box.half_extents;
  // An open corner is more than closed - target above its goal; slower than that within the horizon is no contact.
  const double fastest = turning * h.norm() - speed;
  if (fastest * goal.horizon <= goal.closed - goal.target) return goal.horizon;
  const double centre = n.dot(motion.pose.p - plane.p);
  if (centre - h.norm() - goal.closed > fastest * goal.horizon) return goal.horizon;

  const Mat3 R = motion.pose.q.toRotationMatrix();
  const Vec3 lift = h.cwiseProduct(R.transpose() * n);
  const double target = goal.target;
  if (turning == 0) {
    // Only translation (or a spin about the normal): all corners come down at the same speed.
    double lowest = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 8; ++k) {
      const double gap =
          centre + ((k & 1 ? lift.x() : -lift.x()) + (k & 2 ? lift.y() : -lift.y()) + (k & 4 ? lift.z() : -lift.z()));
      if (gap > goal.closed) lowest = std::min(lowest, gap);
    }
    return speed < 0 ? std::min(goal.horizon, (lowest - target) / -speed) : goal.horizon;
  }

  // Corner x turns about w: n.x(t) = n.x + A (cos wt - 1) + B sin wt, A = n.x_perp, B = x.(n x w) / |w|.
  const double omega = motion.w.norm();
  const Vec3 axis = motion.w / omega;
  const Vec3 across = h.cwiseProduct(R.transpose() * (n - n.dot(axis) * axis));
  const Vec3 ahead = h.cwiseProduct(R.transpose() * n_x_w) / omega;
  double first = goal.horizon;
  for (int k = 0; k < 8; ++k) {
    const double sx = k & 1 ? 1 : -1, sy = k & 2 ? 1 : -1, sz = k & 4 ? 1 : -1;
    const double gap_now = centre + (sx * lift.x() + sy * lift.y() + sz * lift.z());
    if (gap_now <= goal.closed) continue;
    const double A = sx * across.x() + sy * across.y() + sz * across.z();
    const double B = sx * ahead.x() + sy * ahead.y() + sz * ahead.z();
    const double K = omega * omega * omega * std::sqrt(A * A + B * B);
    double t = 0, gap = gap_now, rate = speed + omega * B, curvature = -omega * omega * A;
    for (int i = 0; i < max_advancements; ++i) {
      const double rest = first - t;
      t += first_root(gap - target, rate, std::max(curvature - K * rest / 3, -K / omega));
      if (t >= first) break;
      const double half_sine = std::sin(omega * t / 2), sine = std::sin(omega * t);
      const double cosine = 1 - 2 * half_sine * half_sine;
      gap = gap_now + speed * t - 2 * A * half_sine * half_sine + B * sine;
      rate = speed + omega * (B * cosine - A * sine);
      curvature = -omega * omega * (A * cosine + B * sine);
      // Steps converge like Newton's: one more than is needed to be closed makes the landing exact.
      if (gap <= 2 * target) break;
    }
    first = std::min(first, t);
  }
  return first;
}

// The rim of an end is m + r (x cos + z sin) high, with m the height of its middle and (x, z) the components of n along
// two directions that are fixed to the body, s = |(x, z)|, c = n.a along its axis a. Followed are
//   the lowest point, m - r s, where it is open;
//   else the half of the rim that lies across from the lowest point, with x, z along and across the slope now: its
//   lowest point is at m - r |z|, or while x < 0 at m - r s.
// Bounds: |m''| <= l k and |(x, z)''| <= k with k = |n x w| |w|; (r s)'' <= r |c| |n x w| |a x w| / s, since its other
// part -r c'^2 / s^3 is negative; the angle between a and n changes by at most |n x w| a second.
double cylinder_to_plane(const Shape& cylinder, const Motion& motion, const Pose& plane, const Goal& goal) {
  const Vec3 n = plane_normal(plane), n_x_w = n.cross(motion.w);
  const double r = cylinder.radius, l = cylinder.half_extents.y(), reach = cylinder.bounding_radius();
  const double turning = n_x_w.norm(), speed = n.dot(motion.v), k = turning * motion.w.norm();
  const double fastest = turning * reach - speed;
  if (fastest * goal.horizon <= goal.closed - goal.target) return goal.horizon;
  if (n.dot(motion.pose.p - plane.p) - reach - goal.closed > fastest * goal.horizon) return goal.horizon;

  // An end after t seconds; x, z along directions that are at an angle to the local ones.
  struct Now {
    double m, m1, x, x1, z, z1, s, c, axis_turning;
  };
  const auto at = [&](double t, int end, double cosine, double sine) {
    const Pose pose = advance(motion, t);
    const Mat3 R = pose.q.toRotationMatrix();
    const Vec3 u = cosine * R.col(0) + sine * R.col(2), v = cosine * R.col(2) - sine * R.col(0);
    const double c = n.dot(R.col(1));
    Now now{};
    now.m = n.dot(pose.p - plane.p) + end * l * c;
    now.m1 = speed + end * l * n_x_w.dot(R.col(1));
    now.x = n.dot(u);
    now.x1 = n_x_w.dot(u);
    now.z = n.dot(v);
    now.z1 = n_x_w.dot(v);
    now.s = std::hypot(now.x, now.z);
    now.c = std::abs(c);
    now.axis_turning = motion.w.cross(R.col(1)).norm();
    return now;
  };

  const auto lowest_step = [&](const Now& now, double rest) {
    const double room = now.m - r * now.s - goal.target;
    double step = room / fastest;
    // By the curvature of s, while s has not halved.
    const double interval = turning > 0 ? std::min(rest, now.s / (2 * turning)) : rest;
    if (now.s > 0) {
      const double c = std::min(1.0, now.c + turning * interval);
      const double curvature = -(l + 2 * r * c / now.s) * turning * now.axis_turning;
      const double rate = now.m1 - r * (now.x * now.x1 + now.z * now.z1) / now.s;
      step = std::max(step, std::min(interval, first_root(room, rate, curvature)));
    }
    // |(x, z) + (x', z') t| is convex: below its chord. A shorter interval has a flatter one.
    constexpr int improvements = 4;
    double part = rest;
    for (int i = 0; i < improvements && part > step; ++i) {
      const double s_end = std::hypot(now.x + now.x1 * part, now.z + now.z1 * part);
      const double root = first_root(room, now.m1 - r * (s_end - now.s) / part, -(l + r) * k);
      step = std::max(step, std::min(root, part));
      if (root >= part / 2) break;
      part = 2 * step;
    }
    return step;
  };
  const auto far_step = [&](const Now& now) {
    const double room = now.m - r * std::abs(now.z) - goal.target, rate = now.m1 - r * std::abs(now.z1);
    const double K = -(l + 2 * r) * k;
    return std::min(first_root(room, rate, K), first_root(room + r * now.x, rate + r * now.x1, K));
  };
  const auto far_gap = [&](const Now& now) { return now.m - r * (now.x < 0 ? now.s : std::abs(now.z)); };

  double first = goal.horizon;
  for (int end = l > 0 ? -1 : 1; end <= 1; end += 2) {
    const Now start = at(0, end, 1, 0);
    const bool lowest = start.m - r * start.s > goal.closed;
    if (!lowest && start.m <= goal.closed) continue;
    const double cosine = lowest ? 1 : start.x / start.s, sine = lowest ? 0 : start.z / start.s;
    double t = 0;
    for (int i = 0; i < max_advancements; ++i) {
      const Now now = at(t, end, cosine, sine);
      // As for a box's corner: one step more than is needed to be closed.
      if (i > 0 && (lowest ? now.m - r * now.s : far_gap(now)) <= 2 * goal.target) break;
      t += lowest || now.x <= 0 ? lowest_step(now, first - t) : far_step(now);
      if (t >= first) break;
    }
    first = std::min(first, t);
  }
  return first;
}

// A vector with its first two derivatives in time, and bounds on the sizes of all up to the third over the horizon.
struct Moving {
  Vec3 x, x1, x2;
  double size[4];
};

// A direction fixed to a body that turns with w.
Moving turning_direction(const Vec3& e, const Vec3& w) {
  const double spin = w.norm();
  const Vec3 e1 = w.cross(e);
  return {e, e1, w.cross(e1), {1, spin, spin * spin, spin * spin * spin}};
}

// From a point of body r (arm x_r, velocity 0 of its origin) to a point of body o (arm x_o, velocity v of its origin).
Moving between(const Vec3& distance, const Vec3& v, const Vec3& w_o, const Vec3& x_o, const Vec3& w_r, const Vec3& x_r,
               double horizon) {
  const Vec3 o1 = w_o.cross(x_o), r1 = w_r.cross(x_r);
  const double o = w_o.norm(), r = w_r.norm(), arm_o = x_o.norm(), arm_r = x_r.norm();
  const double speed = v.norm() + o * arm_o + r * arm_r;
  return {
      distance,
      v + o1 - r1,
      w_o.cross(o1) - w_r.cross(r1),
      {distance.norm() + speed * horizon, speed, o * o * arm_o + r * r * arm_r, o * o * o * arm_o + r * r * r * arm_r}};
}

// A gap that must stay positive: value, rate, second derivative now, bound on the third over the horizon.
struct Approach {
  double value, rate, curvature, K;
};

// e x f: the common normal of two edges, times the sine of their angle.
Moving crossed(const Moving& e, const Moving& f) {
  return {e.x.cross(f.x),
          e.x1.cross(f.x) + e.x.cross(f.x1),
          e.x2.cross(f.x) + 2 * e.x1.cross(f.x1) + e.x.cross(f.x2),
          {1, e.size[1] + f.size[1], e.size[2] + 2 * e.size[1] * f.size[1] + f.size[2],
           e.size[3] + 3 * e.size[2] * f.size[1] + 3 * e.size[1] * f.size[2] + f.size[3]}};
}

// n.d: the height of d's end above the plane with normal n through its beginning.
Approach along_normal(const Moving& n, const Moving& d) {
  return {n.x.dot(d.x), n.x1.dot(d.x) + n.x.dot(d.x1), n.x2.dot(d.x) + 2 * n.x1.dot(d.x1) + n.x.dot(d.x2),
          n.size[3] * d.size[0] + 3 * n.size[2] * d.size[1] + 3 * n.size[1] * d.size[2] + n.size[0] * d.size[3]};
}

// A step within `rest` over which the gap surely stays above `target`. A shorter interval has a tighter bound, so the
// root is improved a few times.
double safe_step(const Approach& gap, double target, double rest) {
  constexpr int improvements = 4;
  const double room = gap.value - target;
  double step = 0, interval = rest;
  for (int i = 0; i < improvements; ++i) {
    const double root = first_root(room, gap.rate, gap.curvature - gap.K * interval / 3);
    step = std::max(step, std::min(root, interval));
    if (root >= interval / 2) break;
    interval = 2 * step;
  }
  return step;
}

// From the nearest point of a box or a cylinder to p, in its own frame.
Vec3 away_from(const Shape& solid, const Vec3& p) {
  const Vec3& h = solid.half_extents;
  if (solid.kind == ShapeKind::box) return p - p.cwiseMax(-h).cwiseMin(h);
  const double across = std::hypot(p.x(), p.z()), beyond = across > h.x() ? 1 - h.x() / across : 0;
  return {beyond * p.x(), p.y() - std::clamp(p.y(), -h.y(), h.y()), beyond * p.z()};
}

// Sphere on box or cylinder, open: the plane through the nearest point of the solid, turning with it. The solid stays
// behind that plane.
double sphere_to_solid(const Shape& sphere, const Motion& motion, const Shape& box, const Motion& motion_box,
                       const Goal& goal) {
  const Vec3 v = motion.v - motion_box.v;
  const double reach = box.bounding_radius();
  const double fastest = v.norm() + motion_box.w.norm() * reach;
  if (fastest * goal.horizon <= goal.closed - goal.target) return goal.horizon;
  const double apart = (motion.pose.p - motion_box.pose.p).norm() - reach - sphere.radius;
  if (apart - goal.closed > fastest * goal.horizon) return goal.horizon;

  double t = 0;
  for (int i = 0; i < max_advancements; ++i) {
    const PlacedBox placed(box, advance(motion_box, t));
    const Vec3 d = motion.pose.p + t * motion.v - placed.c;
    const Vec3 p = placed.R.transpose() * d;
    const Vec3 away = away_from(box, p);
    const double distance = away.norm(), gap = distance - sphere.radius;
    if (gap <= goal.closed) return i == 0 ? goal.horizon : t;
    const Vec3 n = placed.R * (away / distance);
    const double rest = goal.horizon - t;
    Approach approach = along_normal(turning_direction(n, motion_box.w),
                                     between(d, v, Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), rest));
    approach.value = gap;
    const double step = safe_step(approach, goal.target, rest);
    if (step >= rest) return goal.horizon;
    t += step;
  }
  return t;
}

// Box on box, closed: follows the corners of the common patch that are open.
double patch_to_flat(const Shape& shape_a, const Motion& motion_a, const Shape& shape_b, const Motion& motion_b,
                     int axis, double margin, const Goal& goal) {
  constexpr double steepest = 0.5;  // cosine between the two normals; steeper faces do not come together in a step
  double t = 0;
  std::uint32_t open = 0;  // features seen open, a bit each
  for (int i = 0; i < max_advancements; ++i) {
    const PlacedBox a(shape_a, advance(motion_a, t)), b(shape_b, advance(motion_b, t));
    FacePatch patch;
    face_patch(a, b, RelativeBox(a, b), axis, margin, patch);
    const PlacedBox& reference = patch.reference_is_a ? a : b;
    const PlacedBox& other = patch.reference_is_a ? b : a;
    const Motion& motion_r = patch.reference_is_a ? motion_a : motion_b;
    const Motion& motion_o = patch.reference_is_a ? motion_b : motion_a;
    const Vec3 v = motion_o.v - motion_r.v;
    const Vec3 u_axis = reference.R.col((patch.axis + 1) % 3), v_axis = reference.R.col((patch.axis + 2) % 3);
    const Vec3 m = reference.R * patch.incident;  // normal of the incident face, out of the other box
    if (-m.dot(patch.n) < steepest) return goal.horizon;

    const double rest = goal.horizon - t;
    double step = rest;
    std::uint32_t now = 0;
    for (int k = 0; k < patch.count; ++k) {
      const PatchPoint& point = patch.point[k];
      const std::uint32_t bit = std::uint32_t{1} << point.id;
      if (point.gap <= goal.closed) {
        if (open & bit) return t;
        continue;
      }
      now |= bit;
      // Foot on the reference face and point of the incident face above it, as arms from the two centres.
      const Vec3 x_r = point.u * u_axis + point.v * v_axis + reference.h[patch.axis] * patch.n;
      const Vec3 d = point.gap * patch.n, x_o = reference.c + x_r + d - other.c;
      const Moving distance = between(d, v, motion_o.w, x_o, motion_r.w, x_r, rest);
      Approach approach{};
      double target = goal.target;
      if (point.id < 4) {
        approach = along_normal(turning_direction(patch.n, motion_r.w), distance);
      } else if (point.id < 8) {
        approach = along_normal(turning_direction(-m, motion_o.w), distance);
      } else {
        // Edge e of the incident face over the edge of the reference face along side p, whichever way makes d.(e x f)
        // positive.
        const int e = (point.id - 8) / 4, p = (point.id - 8) % 4;
        const Vec3 edge_o = other.R.col(e % 2 == 0 ? patch.incident_u : patch.incident_v);
        const Vec3 edge_r = p < 2 ? v_axis : u_axis;
        const double sign = d.dot(edge_o.cross(edge_r)) < 0 ? -1 : 1;
        const Moving q = crossed(turning_direction(sign * edge_o, motion_o.w), turning_direction(edge_r, motion_r.w));
        approach = along_normal(q, distance);
        target *= q.x.norm();  // the value is the gap times the sine between the edges
      }
      if (approach.value <= target) continue;  // edges in line with each other: vertices stand for them
      step = std::min(step,
                      first_root(approach.value - target, approach.rate, approach.curvature - approach.K * rest / 3));
    }
    if (step >= rest) return goal.horizon;
    open |= now;
    t += step;
  }
  return t;
}

// Box on box, open: a step over which every corner of `other` surely stays above the face of `plane` with normal n, at
// `extent` from its centre.
double step_over_face(const PlacedBox& plane, const Motion& motion_plane, const PlacedBox& other,
                      const Motion& motion_other, const Vec3& n, double extent, double target, double rest) {
  const Moving normal = turning_direction(n, motion_plane.w);
  const Vec3 centre = other.c - plane.c, v = motion_other.v - motion_plane.v;
  double step = rest;
  for (int k = 0; k < 8; ++k) {
    const Vec3 sign(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1);
    const Vec3 x = other.R * sign.cwiseProduct(other.h);
    const Moving distance = between(centre + x, v, motion_other.w, x, Vec3::Zero(), Vec3::Zero(), step);
    const double value = n.dot(centre + x) - extent;
    if (value - target > (normal.size[1] * distance.size[0] + distance.size[1]) * step) continue;
    Approach approach = along_normal(normal, distance);
    approach.value = value;
    if (value <= target) return 0;
    step = std::min(step, safe_step(approach, target, step));
  }
  return step;
}

double step_over(const PlacedBox& a, const Motion& motion_a, const PlacedBox& b, const Motion& motion_b,
                 const RelativeBox& ab, int face, double target, double rest) {
  if (face < 3) {
    const Vec3 n = (ab.t[face] < 0 ? -1 : 1) * a.R.col(face);
    return step_over_face(a, motion_a, b, motion_b, n, a.h[face], target, rest);
  }
  const int k = face - 3;
  const Vec3 n = (ab.C.col(k).dot(ab.t) > 0 ? -1 : 1) * b.R.col(k);
  return step_over_face(b, motion_b, a, motion_a, n, b.h[k], target, rest);
}

// The same for two edges that separate the boxes, e of a and f of b: as long as both stay the outermost along their
// common normal q = e x f, that is while q.R_k keeps its sign for the other axes R_k of both boxes.
double step_over_edges(const PlacedBox& a, const Motion& motion_a, const PlacedBox& b, const Motion& motion_b,
                       const SeparatingAxis& axis, double target, double rest) {
  const int i = (axis.index - 6) / 3, j = (axis.index - 6) % 3;
  const Vec3 n = a.R * axis.normal_A;
  const double sign = a.R.col(i).cross(b.R.col(j)).dot(n) < 0 ? -1 : 1;
  const Moving q = crossed(turning_direction(a.R.col(i), motion_a.w), turning_direction(sign * b.R.col(j), motion_b.w));
  const double sine = q.x.norm();
  Vec3 x_a = Vec3::Zero(), x_b = Vec3::Zero();
  double interval = rest;
  for (int k = 0; k < 3; ++k) {
    if (k != i) {
      const Vec3 outward = q.x.dot(a.R.col(k)) < 0 ? Vec3(-a.R.col(k)) : Vec3(a.R.col(k));
      x_a += a.h[k] * outward;
      interval = std::min(interval, safe_step(along_normal(q, turning_direction(outward, motion_a.w)), 0, interval));
    }
    if (k != j) {
      const Vec3 outward = q.x.dot(b.R.col(k)) < 0 ? Vec3(b.R.col(k)) : Vec3(-b.R.col(k));
      x_b += b.h[k] * outward;
      interval = std::min(interval, safe_step(along_normal(q, turning_direction(-outward, motion_b.w)), 0, interval));
    }
  }
  const Approach approach = along_normal(
      q, between(b.c + x_b - a.c - x_a, motion_b.v - motion_a.v, motion_b.w, x_b, motion_a.w, x_a, interval));
  return safe_step(approach, target * sine, interval);
}

// A step over which the boxes surely stay further apart than `target`, by the planes that separate them best now.
double apart_step(const PlacedBox& a, const Motion& motion_a, const PlacedBox& b, const Motion& motion_b,
                  const RelativeBox& ab, const SeparatingAxis& axis, double target, double rest) {
  if (axis.index < 6) return step_over(a, motion_a, b, motion_b, ab, axis.index, target, rest);
  double step = step_over_edges(a, motion_a, b, motion_b, axis, target, rest);
  // Nearly a face axis: the face lasts longer.
  for (int face = 0; face < 6 && step < rest; ++face)
    step = std::max(step, step_over(a, motion_a, b, motion_b, ab, face, target, rest));
  return step;
}

// How fast the points of two boxes that are closed now approach, m/s: they are the caller's, who binds them or not.
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

// Box on box, closed: another feature arrives (a face beside the edge that touches, an edge where a corner has left its
// face) when the boxes get deeper than they are now by more than the arcs of what touches explain,
//   arcs = (2 (w_a + w_b) fastest + w_a^2 r_a + w_b^2 r_b) S^2 / 2   over the horizon S,
// the largest second derivative of a gap, and what of it already approaches. Gives up, as where nothing arrives, after
// `max_advancements`.
double time_to_depth(const Shape& shape_a, const Motion& motion_a, const Shape& shape_b, const Motion& motion_b,
                     double gap_now, double fastest, double margin, const Goal& goal) {
  const double w_a = motion_a.w.norm(), w_b = motion_b.w.norm();
  const double second =
      2 * (w_a + w_b) * fastest + w_a * w_a * shape_a.half_extents.norm() + w_b * w_b * shape_b.half_extents.norm();
  double target = std::min(0.0, gap_now) - 2 * goal.closed - second * goal.horizon * goal.horizon / 2;
  if (gap_now - fastest * goal.horizon > target) return goal.horizon;
  target -= closing_speed(shape_a, motion_a, shape_b, motion_b, goal.closed) * goal.horizon;
  double t = 0;
  for (int i = 0; i < max_advancements; ++i) {
    const PlacedBox a(shape_a, advance(motion_a, t)), b(shape_b, advance(motion_b, t));
    const RelativeBox ab(a, b);
    const SeparatingAxis axis = separating_axis(a, b, ab, margin);
    if (axis.gap <= target + goal.closed) return t;
    const double rest = goal.horizon - t;
    const double step =
        std::max((axis.gap - target) / fastest, apart_step(a, motion_a, b, motion_b, ab, axis, target, rest));
    if (step >= rest) return goal.horizon;
    t += step;
  }
  return goal.horizon;
}

double box_to_box(const Shape& shape_a, const Motion& motion_a, const Shape& shape_b, const Motion& motion_b,
                  const Goal& goal) {
  const Vec3 v = motion_b.v - motion_a.v;
  const double r_a = shape_a.half_extents.norm(), r_b = shape_b.half_extents.norm();
  const double fastest = v.norm() + motion_a.w.norm() * r_a + motion_b.w.norm() * r_b;
  if (fastest * goal.horizon <= goal.closed - goal.target) return goal.horizon;
  const double apart = (motion_b.pose.p - motion_a.pose.p).norm() - r_a - r_b;
  if (apart - goal.closed > fastest * goal.horizon) return goal.horizon;

  const double margin = axis_margin(goal.closed, shape_a.half_extents, shape_b.half_extents);
  double t = 0;
  for (int i = 0; i < max_advancements; ++i) {
    const PlacedBox a(shape_a, advance(motion_a, t)), b(shape_b, advance(motion_b, t));
    const RelativeBox ab(a, b);
    const SeparatingAxis axis = separating_axis(a, b, ab, margin);
    if (axis.gap <= goal.closed) {
      if (i > 0) return t;
      // The face that separates best, of both boxes; for edges the face of a that looks most along their normal.
      int face = axis.index;
      if (face >= 6) axis.normal_A.cwiseAbs().maxCoeff(&face);
      const double flat = patch_to_flat(shape_a, motion_a, shape_b, motion_b, face, margin, goal);
      return time_to_depth(shape_a, motion_a, shape_b, motion_b, axis.gap, fastest, margin,
                           {goal.closed, goal.target, flat});
    }
    const double rest = goal.horizon - t;
    // The first holds for any plane: there is always progress.
    const double step =
        std::max((axis.gap - goal.target) / fastest, apart_step(a, motion_a, b, motion_b, ab, axis, goal.target, rest));
    if (step >= rest) return goal.horizon;
    t += step;
  }
  return t;
}

}  // namespace

double time_of_contact(const Shape& a, const Motion& motion_a, const Shape& b, const Motion& motion_b, double tolerance,
                       double horizon) {
  // Two shapes that stand still never meet.
  if (motion_a.v == motion_b.v && motion_a.w.isZero(0) && motion_b.w.isZero(0)) return horizon;
  const double closed = resolved_tolerance(tolerance, motion_a.pose.p, motion_b.pose.p);
  const double ulp = std::numeric_limits<double>::epsilon() * largest_coordinate(motion_a.pose.p, motion_b.pose.p);
  const Goal goal{closed, std::max(aim * closed, aim_ulps * ulp), horizon};
  switch (a.kind) {
    case ShapeKind::box:
      if (b.kind == ShapeKind::half_space) return box_to_plane(a, motion_a, motion_b.pose, goal);
      if (b.kind == ShapeKind::box) return box_to_box(a, motion_a, b, motion_b, goal);
      if (b.kind == ShapeKind::sphere) return sphere_to_solid(b, motion_b, a, motion_a, goal);
      break;
    case ShapeKind::sphere:
      if (b.kind == ShapeKind::half_space) return sphere_to_plane(a, motion_a, motion_b.pose, goal);
      if (b.kind == ShapeKind::sphere) return sphere_to_sphere(a, motion_a, b, motion_b, goal);
      return sphere_to_solid(a, motion_a, b, motion_b, goal);
    case ShapeKind::cylinder:
      if (b.kind == ShapeKind::half_space) return cylinder_to_plane(a, motion_a, motion_b.pose, goal);
      if (b.kind == ShapeKind::sphere) return sphere_to_solid(b, motion_b, a, motion_a, goal);
      break;
    case ShapeKind::half_space:
      if (b.kind == ShapeKind::box) return box_to_plane(b, motion_b, motion_a.pose, goal);
      if (b.kind == ShapeKind::sphere) return sphere_to_plane(b, motion_b, motion_a.pose, goal);
      if (b.kind == ShapeKind::cylinder) return cylinder_to_plane(b, motion_b, motion_a.pose, goal);
      break;
  }
  return horizon;
}

}  // namespace cb
