// First time at which a feature that is open now closes, by conservative advancement.
//
// Problem: two shapes in steady motion (m, m/s, rad/s), a horizon (s) and a tolerance (m). Find the first time at which
// the gap of a feature, larger than the tolerance now, is between 0 and the tolerance.
// Source: conservative advancement, Mirtich, "Impulse-based dynamic simulation" (1996), section 2.3.
// Differences from the source:
//   1. The bound on the gap is of second order: gap(t + s) >= gap + gap' s - K s^2 / 2, with K a bound on the
//      acceleration of the gap. Steps then shrink like Newton's, not geometrically. Where nothing turns K = 0 and
//      one step is exact.
//   2. Steps aim at half the tolerance, so that round-off on either side still lands between 0 and the tolerance.
//   3. Which features are followed:
//      sphere on half-space, sphere on sphere: closed form;
//      box on half-space: each of the eight corners that is open now, on its own (gap as a function of time in closed
//      form, a sine plus a line);
//      sphere on box, box on box while the pair is open: the plane halfway along the best separating direction;
//      box on box while the pair is closed: the corners of the patch that the two touching faces share and that are
//      open (vertex over face both ways, edge over edge), so that a box on its edge finds when it lies flat. Features
//      of other pairs of faces of a pair that touches are not followed, and for a corner of the patch that moves along
//      an edge the bound K is an estimate (doubled), not proved.
// Does not fail: after `max_advancements` it returns the safe time reached.
// Tolerances are raised to 4 ulp of the largest coordinate (resolved_tolerance).
#include <cmath>
#include <cstdint>

#include "geometry/box_box.h"
#include "geometry/shapes.h"

namespace cb {

namespace {

/// Advancements of one feature or pair before the safe time reached is returned.
constexpr int max_advancements = 100;
/// Evaluations of the bound within one advancement of a pair of boxes.
constexpr int max_refinements = 40;
/// Fraction of the tolerance that steps aim at.
constexpr double aim = 0.5;

Vec3 plane_normal(const Pose& pose) {
  const Quat& q = pose.q;
  return {2 * (q.x() * q.y() - q.w() * q.z()), 1 - 2 * (q.x() * q.x() + q.z() * q.z()),
          2 * (q.y() * q.z() + q.w() * q.x())};
}

// First positive root of c + b s - K s^2 / 2 for c > 0, K >= 0; infinite where there is none.
double first_root(double c, double b, double K) {
  if (K == 0) return b < 0 ? -c / b : std::numeric_limits<double>::infinity();
  const double root = std::sqrt(b * b + 2 * K * c);
  return b < 0 ? 2 * c / (root - b) : (b + root) / K;
}

double sphere_to_plane(const Shape& sphere, const Motion& motion, const Pose& plane, double tol, double horizon) {
  const Vec3 n = plane_normal(plane);
  const double speed = n.dot(motion.v);
  if (speed >= 0) return horizon;
  const double gap = n.dot(motion.pose.p - plane.p) - sphere.radius;
  if (gap <= tol) return horizon;
  return std::min(horizon, (gap - aim * tol) / -speed);
}

double sphere_to_sphere(const Shape& a, const Motion& motion_a, const Shape& b, const Motion& motion_b, double tol,
                        double horizon) {
  const Vec3 d = motion_a.pose.p - motion_b.pose.p, v = motion_a.v - motion_b.v;
  const double approach = d.dot(v), v2 = v.squaredNorm();
  if (approach >= 0 || v2 == 0) return horizon;
  const double distance = d.norm();
  if (distance - a.radius - b.radius <= tol) return horizon;
  // |d + v t| = R with the distance at the closest approach formed first, without cancellation.
  const double R = a.radius + b.radius + aim * tol;
  const double miss2 = (d - (approach / v2) * v).squaredNorm();
  if (miss2 >= R * R) return horizon;
  return std::min(horizon, (distance - R) * (distance + R) / (std::sqrt(v2 * (R * R - miss2)) - approach));
}

double box_to_plane(const Shape& box, const Motion& motion, const Pose& plane, double tol, double horizon) {
  const Vec3 n = plane_normal(plane);
  const double speed = n.dot(motion.v);
  const Vec3 n_x_w = n.cross(motion.w);
  const double turning = n_x_w.norm();
  const Vec3& h = box.half_extents;
  // An open corner is more than (1 - aim) tol above its goal; slower than that within the horizon is no contact.
  const double fastest = turning * h.norm() - speed;
  if (fastest * horizon <= (1 - aim) * tol) return horizon;
  const double centre = n.dot(motion.pose.p - plane.p);
  if (centre - h.norm() - tol > fastest * horizon) return horizon;

  const Mat3 R = motion.pose.q.toRotationMatrix();
  const Vec3 lift = h.cwiseProduct(R.transpose() * n);
  const double target = aim * tol;
  if (turning == 0) {
    // Only translation (or a spin about the normal): all corners come down at the same speed.
    double lowest = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 8; ++k) {
      const double gap =
          centre + ((k & 1 ? lift.x() : -lift.x()) + (k & 2 ? lift.y() : -lift.y()) + (k & 4 ? lift.z() : -lift.z()));
      if (gap > tol) lowest = std::min(lowest, gap);
    }
    return speed < 0 ? std::min(horizon, (lowest - target) / -speed) : horizon;
  }

  // Corner x turns about w: n.x(t) = n.x + A (cos wt - 1) + B sin wt, A = n.x_perp, B = x.(n x w) / |w|.
  const double omega = motion.w.norm();
  const Vec3 axis = motion.w / omega;
  const Vec3 across = h.cwiseProduct(R.transpose() * (n - n.dot(axis) * axis));
  const Vec3 ahead = h.cwiseProduct(R.transpose() * n_x_w) / omega;
  double first = horizon;
  for (int k = 0; k < 8; ++k) {
    const double sx = k & 1 ? 1 : -1, sy = k & 2 ? 1 : -1, sz = k & 4 ? 1 : -1;
    const double gap_now = centre + (sx * lift.x() + sy * lift.y() + sz * lift.z());
    if (gap_now <= tol) continue;
    const double A = sx * across.x() + sy * across.y() + sz * across.z();
    const double B = sx * ahead.x() + sy * ahead.y() + sz * ahead.z();
    const double K = omega * omega * std::sqrt(A * A + B * B);
    double t = 0, gap = gap_now, rate = speed + omega * B;
    for (int i = 0; i < max_advancements; ++i) {
      // The bound is concave in s: above the target at both ends, it is so between them.
      const double rest = first - t;
      if (gap - target + rest * (rate - K * rest / 2) >= 0) {
        t = first;
        break;
      }
      t += first_root(gap - target, rate, K);
      if (t >= first) break;
      const double half_sine = std::sin(omega * t / 2), sine = std::sin(omega * t);
      gap = gap_now + speed * t - 2 * A * half_sine * half_sine + B * sine;
      rate = speed + omega * (B * (1 - 2 * half_sine * half_sine) - A * sine);
      if (gap <= tol) break;
    }
    first = std::min(first, t);
  }
  return first;
}

// What the extent of a box along a fixed direction n does while the box turns: at most sum h_k |alpha_k + s beta_k|
// plus K s^2 / 2, because x(s).n = x.n + s x.(n x w) + O(s^2) for each of its points.
struct TurningExtent {
  Vec3 h, alpha, beta;
  double K;
  TurningExtent(const PlacedBox& box, const Vec3& n, const Vec3& w) : h(box.h), alpha(box.R.transpose() * n) {
    const Vec3 n_x_w = n.cross(w);
    beta = box.R.transpose() * n_x_w;
    K = n_x_w.norm() * w.norm() * h.norm();
  }
  double at(double s) const { return h.dot((alpha + s * beta).cwiseAbs()); }
};

// Longest step for which a concave function, above zero at 0 and below it at `rest`, surely stays above -`enough`: the
// chord lies below the function, so its root is safe; halving the other end keeps the chord short.
template <class Concave>
double safe_step(const Concave& f, double f_low, double rest, double f_high, double enough) {
  double low = 0, high = rest;
  for (int i = 0; i < max_refinements && f_low > enough; ++i) {
    const double s = low + (high - low) * f_low / (f_low - f_high);
    const double f_s = f(s);
    if (f_s < -enough) break;  // only by round-off
    low = s;
    f_low = f_s;
    const double middle = 0.5 * (low + high), f_middle = f(middle);
    if (f_middle >= 0) {
      low = middle;
      f_low = f_middle;
    } else {
      high = middle;
      f_high = f_middle;
    }
  }
  return low;
}

double sphere_to_box(const Shape& sphere, const Motion& motion, const Shape& box, const Motion& motion_box, double tol,
                     double horizon) {
  const Vec3 v = motion.v - motion_box.v;
  const double reach = box.half_extents.norm();
  const double fastest = v.norm() + motion_box.w.norm() * reach;
  if (fastest * horizon <= (1 - aim) * tol) return horizon;
  const double apart = (motion.pose.p - motion_box.pose.p).norm() - reach - sphere.radius;
  if (apart - tol > fastest * horizon) return horizon;

  double t = 0;
  for (int i = 0; i < max_advancements; ++i) {
    const PlacedBox placed(box, advance(motion_box, t));
    const Vec3 d = motion.pose.p + t * motion.v - placed.c;
    const Vec3 p = placed.R.transpose() * d;
    const Vec3 away = p - p.cwiseMax(-placed.h).cwiseMin(placed.h);
    const double distance = away.norm();
    if (distance - sphere.radius <= tol) return i == 0 ? horizon : t;
    const Vec3 n = placed.R * (away / distance);
    // Gap along the fixed direction n: the sphere's does not turn, the box's extent does.
    const TurningExtent extent(placed, n, motion_box.w);
    const double offset = n.dot(d) - sphere.radius - aim * tol, speed = n.dot(v);
    const auto f = [&](double s) { return offset + s * (speed - extent.K * s / 2) - extent.at(s); };
    const double f_rest = f(horizon - t);
    if (f_rest >= 0) return horizon;
    t += safe_step(f, distance - sphere.radius - aim * tol, horizon - t, f_rest, 0.25 * aim * tol);
  }
  return t;
}

// Box on box, closed: follows the corners of the common patch that are open.
double patch_to_flat(const Shape& shape_a, const Motion& motion_a, const Shape& shape_b, const Motion& motion_b,
                     int axis, double tol, double margin, double horizon) {
  const double target = aim * tol;
  const Vec3 v = motion_b.v - motion_a.v;
  const double w_a = motion_a.w.norm(), w_b = motion_b.w.norm();
  const double r_a = shape_a.half_extents.norm(), r_b = shape_b.half_extents.norm();
  // |d^2/dt^2| of a relative position seen from either turning frame, over the horizon.
  const double spin = std::max(w_a, w_b), reach = r_a + r_b + v.norm() * horizon;
  const double acceleration = 4 * spin * spin * reach + 4 * spin * v.norm();
  double t = 0;
  std::uint32_t open = 0;  // features seen open, a bit each
  for (int i = 0; i < max_advancements; ++i) {
    const PlacedBox a(shape_a, advance(motion_a, t)), b(shape_b, advance(motion_b, t));
    FacePatch patch;
    face_patch(a, b, RelativeBox(a, b), axis, margin, patch);
    const PlacedBox& reference = patch.reference_is_a ? a : b;
    const PlacedBox& other = patch.reference_is_a ? b : a;
    const Vec3& w_reference = patch.reference_is_a ? motion_a.w : motion_b.w;
    const Vec3& w_other = patch.reference_is_a ? motion_b.w : motion_a.w;
    const Vec3 v_other = patch.reference_is_a ? v : Vec3(-v);
    const Vec3 u = reference.R.col((patch.axis + 1) % 3), side_v = reference.R.col((patch.axis + 2) % 3);
    // Normal of the incident face against the reference normal; slopes above 60 degrees are no faces coming together.
    const Vec3 m = reference.R * patch.incident;
    const double facing = -m.dot(patch.n);
    if (facing < 0.5) return horizon;

    double step = horizon - t;
    std::uint32_t now = 0;
    for (int k = 0; k < patch.count; ++k) {
      const PatchPoint& point = patch.point[k];
      const std::uint32_t bit = std::uint32_t{1} << point.id;
      if (point.gap <= tol) {
        if (open & bit) return t;
        continue;
      }
      now |= bit;
      // Velocity of the incident face's point relative to the reference box.
      const Vec3 x = point.u * u + point.v * side_v + (reference.h[patch.axis] + point.gap) * patch.n;
      const Vec3 relative = v_other + w_other.cross(x + reference.c - other.c) - w_reference.cross(x);
      // Rate of the gap: of a vertex its normal velocity; over a vertex of the reference face that of the incident
      // plane on the fixed line along n; of an edge over an edge that of the edge in the plane of the side.
      double rate = relative.dot(patch.n), K = acceleration;
      if (point.id >= 8) {
        const int e = (point.id - 8) / 4, p = (point.id - 8) % 4;
        int j = 0;
        for (int q = 1; q < 3; ++q)
          if (std::abs(m.dot(other.R.col(q))) > std::abs(m.dot(other.R.col(j)))) j = q;
        const Vec3 direction = other.R.col(e % 2 == 0 ? (j + 1) % 3 : (j + 2) % 3);
        const Vec3& side = p < 2 ? u : side_v;
        const double across = side.dot(direction);
        const double slope = std::abs(across) > 1e-3 ? patch.n.dot(direction) / across : 0;
        rate -= slope * side.dot(relative);
        K *= 2 * (1 + slope * slope);
      } else if (point.id >= 4) {
        rate = -m.dot(relative) / facing;
        K *= 2 / (facing * facing);
      }
      const double rest = step;
      if (point.gap - target + rest * (rate - K * rest / 2) >= 0) continue;
      step = std::min(step, first_root(point.gap - target, rate, K));
    }
    if (step >= horizon - t) return horizon;
    open |= now;
    t += step;
  }
  return t;
}

double box_to_box(const Shape& shape_a, const Motion& motion_a, const Shape& shape_b, const Motion& motion_b,
                  double tol, double horizon) {
  const Vec3 v = motion_b.v - motion_a.v;
  const double r_a = shape_a.half_extents.norm(), r_b = shape_b.half_extents.norm();
  const double fastest = v.norm() + motion_a.w.norm() * r_a + motion_b.w.norm() * r_b;
  if (fastest * horizon <= (1 - aim) * tol) return horizon;
  const double apart = (motion_b.pose.p - motion_a.pose.p).norm() - r_a - r_b;
  if (apart - tol > fastest * horizon) return horizon;

  const double margin = axis_margin(tol, shape_a.half_extents, shape_b.half_extents);
  double t = 0;
  for (int i = 0; i < max_advancements; ++i) {
    const PlacedBox a(shape_a, advance(motion_a, t)), b(shape_b, advance(motion_b, t));
    const RelativeBox ab(a, b);
    const SeparatingAxis axis = separating_axis(a, b, ab, margin);
    if (axis.gap <= tol) {
      if (i > 0) return t;
      int face = axis.index;
      if (face >= 6) {  // edge on edge: the face of a that looks most along the normal
        face = 0;
        for (int k = 1; k < 3; ++k)
          if (std::abs(axis.normal_A[k]) > std::abs(axis.normal_A[face])) face = k;
      }
      return patch_to_flat(shape_a, motion_a, shape_b, motion_b, face, tol, margin, horizon);
    }
    const Vec3 n = a.R * axis.normal_A;
    const TurningExtent extent_a(a, n, motion_a.w), extent_b(b, n, motion_b.w);
    const double offset = n.dot(b.c - a.c) - aim * tol, speed = n.dot(v), K = extent_a.K + extent_b.K;
    const auto f = [&](double s) { return offset + s * (speed - K * s / 2) - extent_a.at(s) - extent_b.at(s); };
    const double f_rest = f(horizon - t);
    if (f_rest >= 0) return horizon;
    t += safe_step(f, axis.gap - aim * tol, horizon - t, f_rest, 0.25 * aim * tol);
  }
  return t;
}

}  // namespace

double time_of_contact(const Shape& a, const Motion& motion_a, const Shape& b, const Motion& motion_b, double tolerance,
                       double horizon) {
  // Two shapes that stand still never meet.
  if (motion_a.v == motion_b.v && motion_a.w.isZero(0) && motion_b.w.isZero(0)) return horizon;
  const double tol = resolved_tolerance(tolerance, motion_a.pose.p, motion_b.pose.p);
  switch (a.kind) {
    case ShapeKind::box:
      if (b.kind == ShapeKind::half_space) return box_to_plane(a, motion_a, motion_b.pose, tol, horizon);
      if (b.kind == ShapeKind::box) return box_to_box(a, motion_a, b, motion_b, tol, horizon);
      return sphere_to_box(b, motion_b, a, motion_a, tol, horizon);
    case ShapeKind::sphere:
      if (b.kind == ShapeKind::half_space) return sphere_to_plane(a, motion_a, motion_b.pose, tol, horizon);
      if (b.kind == ShapeKind::box) return sphere_to_box(a, motion_a, b, motion_b, tol, horizon);
      return sphere_to_sphere(a, motion_a, b, motion_b, tol, horizon);
    case ShapeKind::half_space:
      if (b.kind == ShapeKind::box) return box_to_plane(b, motion_b, motion_a.pose, tol, horizon);
      if (b.kind == ShapeKind::sphere) return sphere_to_plane(b, motion_b, motion_a.pose, tol, horizon);
      break;
  }
  return horizon;
}

}  // namespace cb
