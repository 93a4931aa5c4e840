// First time at which a feature that is open now closes, by conservative advancement.
//
// Problem: two shapes in steady motion (m, m/s, rad/s), a horizon (s) and a tolerance (m). Find the first time at which
// the gap of a feature, larger than the tolerance now, is between 0 and the tolerance.
// Source: conservative advancement, Mirtich, "Impulse-based dynamic simulation" (1996), section 2.3.
// Differences from the source:
//   1. The bound on the gap is of third order: gap(t + s) >= gap + gap' s + (gap'' - K S / 3) s^2 / 2 for s <= S, K a
//      bound on the third derivative. Steps then shrink like Newton's, not geometrically, and a corner about which a
//      body turns, whose gap has neither size nor speed, costs no small steps. Where nothing turns one step is exact.
//   2. Steps aim at a thousandth of the tolerance, or 2 ulp of the coordinates where that is more: round-off still ends
//      between 0 and the tolerance, and an impact's lever arm (to the middle of the gap) is as exact as can be.
//   3. Which features are followed:
//      sphere on half-space, sphere on sphere: closed form;
//      box on half-space: each of the eight corners that is open now, on its own (gap as a function of time in closed
//      form, a sine plus a line);
//      capsule or hull on half-space: each open vertex of the core, likewise;
//      cylinder on half-space: the lowest point of each end, where it is open; of an end whose lowest point touches the
//      half of the rim across from it, so that it finds when it stands flat;
//      sphere on box, sphere on cylinder, box on box while the pair is open: the best separating plane, which turns
//      with the box whose face it is (corners over a face), or with two edges (edge line over edge line); box on box
//      while the pair is closed: the corners of the patch that the two touching faces share and that are open (vertex
//      over face both ways, edge over edge), so that a box on its edge finds when it lies flat; for a corner of the
//      patch that moves along an edge the bound K is an estimate (doubled), not proved. Whatever else of a closed pair
//      of boxes arrives is found as the time at which they get deeper than what touches explains (box_box_time.cpp);
//      capsule or hull on anything else: core_time.cpp; cylinder on anything but a half-space or a sphere:
//      cylinder_time.cpp.
// Does not fail: after `max_advancements` it returns the safe time reached.
// Tolerances are raised to 4 ulp of the largest coordinate (resolved_tolerance).
#include <cmath>

#include "geometry/advancement.h"
#include "geometry/box_box.h"
#include "geometry/box_box_time.h"
#include "geometry/core.h"
#include "geometry/core_time.h"
#include "geometry/cylinder_time.h"
#include "geometry/shapes.h"

namespace cb {

namespace {

/// Fraction of the tolerance that steps aim at, and its floor in ulp of the coordinates (half of resolved_tolerance's).
constexpr double aim = 1e-3;
constexpr double aim_ulps = 2;

Vec3 plane_normal(const Pose& pose) {
  const Quat& q = pose.q;
  return {2 * (q.x() * q.y() - q.w() * q.z()), 1 - 2 * (q.x() * q.x() + q.z() * q.z()),
          2 * (q.y() * q.z() + q.w() * q.x())};
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

// An open corner of a box that turns with omega: gap(t) = gap + speed t + A (cos omega t - 1) + B sin omega t.
double corner_to_plane(double gap_now, double A, double B, double omega, double speed, double target, double horizon) {
  const double K = omega * omega * omega * std::sqrt(A * A + B * B);
  double gap = gap_now, rate = speed + omega * B, curvature = -omega * omega * A;
  return advance_until(horizon, [&](double t, double rest, bool first) {
    if (!first) {
      const double half_sine = std::sin(omega * t / 2), sine = std::sin(omega * t);
      const double cosine = 1 - 2 * half_sine * half_sine;
      gap = gap_now + speed * t - 2 * A * half_sine * half_sine + B * sine;
      rate = speed + omega * (B * cosine - A * sine);
      curvature = -omega * omega * (A * cosine + B * sine);
      // Steps converge like Newton's: one more than is needed to be closed makes the landing exact.
      if (gap <= 2 * target) return has_arrived;
    }
    return Look{false, first_root(gap - target, rate, std::max(curvature - K * rest / 3, -K / omega))};
  });
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
    first = corner_to_plane(gap_now, A, B, omega, speed, target, first);
  }
  return first;
}

double core_to_plane(const Shape& shape, const Motion& motion, const Pose& plane, const Goal& goal) {
  const Vec3 n = plane_normal(plane), n_x_w = n.cross(motion.w);
  const double speed = n.dot(motion.v), turning = n_x_w.norm(), reach = core_reach(shape);
  const double fastest = turning * reach - speed;
  if (fastest * goal.horizon <= goal.closed - goal.target) return goal.horizon;
  thread_local PlacedCore core;  // does not allocate after its first calls
  core.place(shape, motion.pose, motion.pose.p);
  const double centre = n.dot(motion.pose.p - plane.p) - core.radius;
  if (centre - reach - goal.closed > fastest * goal.horizon) return goal.horizon;

  // As a box's corners (above); where nothing turns they come down at the same speed.
  const double omega = motion.w.norm();
  const Vec3 axis = turning > 0 ? Vec3(motion.w / omega) : Vec3(Vec3::Zero());
  const Vec3 across = n - n.dot(axis) * axis, ahead = turning > 0 ? Vec3(n_x_w / omega) : Vec3(Vec3::Zero());
  double first = goal.horizon;
  for (const Vec3& x : core.x) {
    const double gap = centre + n.dot(x);
    if (gap <= goal.closed || gap - goal.closed > fastest * first) continue;
    if (turning > 0)
      first = corner_to_plane(gap, x.dot(across), x.dot(ahead), omega, speed, goal.target, first);
    else if (speed < 0)
      first = std::min(first, (gap - goal.target) / -speed);
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
struct CylinderOverPlane {
  const Motion& motion;
  Vec3 n, n_x_w, p;  ///< normal, its turning against the cylinder, a point of the plane
  double r, l, turning, speed, k, fastest, target;

  /// An end after t seconds; x, z along directions that are at an angle to the local ones.
  struct End {
    double m, m1, x, x1, z, z1, s, c, axis_turning;
  };
  End at(double t, int end, double cosine, double sine) const;
  double lowest_step(const End& now, double rest) const;
  double far_step(const End& now) const;
  double lowest_gap(const End& now) const { return now.m - r * now.s; }
  double far_gap(const End& now) const { return now.m - r * (now.x < 0 ? now.s : std::abs(now.z)); }
  double time_of(int end, double closed, double horizon) const;
};

CylinderOverPlane::End CylinderOverPlane::at(double t, int end, double cosine, double sine) const {
  const Pose pose = advance(motion, t);
  const Mat3 R = pose.q.toRotationMatrix();
  const Vec3 u = cosine * R.col(0) + sine * R.col(2), v = cosine * R.col(2) - sine * R.col(0);
  const double c = n.dot(R.col(1));
  End now{};
  now.m = n.dot(pose.p - p) + end * l * c;
  now.m1 = speed + end * l * n_x_w.dot(R.col(1));
  now.x = n.dot(u);
  now.x1 = n_x_w.dot(u);
  now.z = n.dot(v);
  now.z1 = n_x_w.dot(v);
  now.s = length(now.x, now.z);
  now.c = std::abs(c);
  now.axis_turning = motion.w.cross(R.col(1)).norm();
  return now;
}

double CylinderOverPlane::lowest_step(const End& now, double rest) const {
  const double room = lowest_gap(now) - target;
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
    const double s_end = length(now.x + now.x1 * part, now.z + now.z1 * part);
    const double root = first_root(room, now.m1 - r * (s_end - now.s) / part, -(l + r) * k);
    step = std::max(step, std::min(root, part));
    if (root >= part / 2) break;
    part = 2 * step;
  }
  return step;
}

double CylinderOverPlane::far_step(const End& now) const {
  const double room = now.m - r * std::abs(now.z) - target, rate = now.m1 - r * std::abs(now.z1);
  const double K = -(l + 2 * r) * k;
  return std::min(first_root(room, rate, K), first_root(room + r * now.x, rate + r * now.x1, K));
}

// When the lowest point of an end comes down, or, where it touches, the rest of its rim.
double CylinderOverPlane::time_of(int end, double closed, double horizon) const {
  const End start = at(0, end, 1, 0);
  const bool lowest = lowest_gap(start) > closed;
  if (!lowest && start.m <= closed) return horizon;
  const double cosine = lowest ? 1 : start.x / start.s, sine = lowest ? 0 : start.z / start.s;
  return advance_until(horizon, [&](double t, double rest, bool first) {
    const End now = at(t, end, cosine, sine);
    // As for a box's corner: one step more than is needed to be closed.
    if (!first && (lowest ? lowest_gap(now) : far_gap(now)) <= 2 * target) return has_arrived;
    return Look{false, lowest || now.x <= 0 ? lowest_step(now, rest) : far_step(now)};
  });
}

double cylinder_to_plane(const Shape& cylinder, const Motion& motion, const Pose& plane, const Goal& goal) {
  const Vec3 n = plane_normal(plane), n_x_w = n.cross(motion.w);
  const double r = cylinder.radius, l = cylinder.half_extents.y(), reach = cylinder.bounding_radius();
  const double turning = n_x_w.norm(), speed = n.dot(motion.v);
  const double fastest = turning * reach - speed;
  if (fastest * goal.horizon <= goal.closed - goal.target) return goal.horizon;
  if (n.dot(motion.pose.p - plane.p) - reach - goal.closed > fastest * goal.horizon) return goal.horizon;

  const CylinderOverPlane moving{motion,  n,          n_x_w, plane.p, r, l, turning, speed, turning * motion.w.norm(),
                                 fastest, goal.target};
  double first = goal.horizon;
  for (int end = l > 0 ? -1 : 1; end <= 1; end += 2) first = moving.time_of(end, goal.closed, first);
  return first;
}

// From the nearest point of a box or a cylinder to p, in its own frame.
Vec3 away_from(const Shape& solid, const Vec3& p) {
  const Vec3& h = solid.half_extents;
  if (solid.kind == ShapeKind::box) return p - p.cwiseMax(-h).cwiseMin(h);
  const double across = length(p.x(), p.z()), beyond = across > h.x() ? 1 - h.x() / across : 0;
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

  return advance_until(goal.horizon, [&](double t, double rest, bool first) {
    const PlacedBox placed(box, advance(motion_box, t));
    const Vec3 d = motion.pose.p + t * motion.v - placed.c;
    const Vec3 p = placed.R.transpose() * d;
    const Vec3 away = away_from(box, p);
    const double distance = away.norm(), gap = distance - sphere.radius;
    if (gap <= goal.closed) return first ? never_arrives : has_arrived;
    const Vec3 n = placed.R * (away / distance);
    Approach approach = along_normal(turning_direction(n, motion_box.w),
                                     between(d, v, Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), rest));
    approach.value = gap;
    return Look{false, safe_step(approach, goal.target, rest)};
  });
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
      if (b.kind == ShapeKind::cylinder) return cylinder_to_solid(b, motion_b, a, motion_a, goal);
      return core_to_core(a, motion_a, b, motion_b, goal);
    case ShapeKind::sphere:
      if (b.kind == ShapeKind::half_space) return sphere_to_plane(a, motion_a, motion_b.pose, goal);
      if (b.kind == ShapeKind::sphere) return sphere_to_sphere(a, motion_a, b, motion_b, goal);
      if (b.kind != ShapeKind::box && b.kind != ShapeKind::cylinder)
        return core_to_core(a, motion_a, b, motion_b, goal);
      return sphere_to_solid(a, motion_a, b, motion_b, goal);
    case ShapeKind::cylinder:
      if (b.kind == ShapeKind::half_space) return cylinder_to_plane(a, motion_a, motion_b.pose, goal);
      if (b.kind == ShapeKind::sphere) return sphere_to_solid(b, motion_b, a, motion_a, goal);
      return cylinder_to_solid(a, motion_a, b, motion_b, goal);
    case ShapeKind::capsule:
    case ShapeKind::hull:
      if (b.kind == ShapeKind::half_space) return core_to_plane(a, motion_a, motion_b.pose, goal);
      if (b.kind == ShapeKind::cylinder) return cylinder_to_solid(b, motion_b, a, motion_a, goal);
      return core_to_core(a, motion_a, b, motion_b, goal);
    case ShapeKind::half_space:
      if (b.kind == ShapeKind::box) return box_to_plane(b, motion_b, motion_a.pose, goal);
      if (b.kind == ShapeKind::sphere) return sphere_to_plane(b, motion_b, motion_a.pose, goal);
      if (b.kind == ShapeKind::cylinder) return cylinder_to_plane(b, motion_b, motion_a.pose, goal);
      if (b.kind != ShapeKind::half_space) return core_to_plane(b, motion_b, motion_a.pose, goal);
      break;
  }
  return horizon;
}

}  // namespace cb
