#pragma once

// Conservative advancement, as time_of_contact.cpp uses it: the loop, the bounds on a gap of third order, and how the
// points and directions of moving bodies come into them.

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/shapes.h"

namespace cb {

/// What is a contact: open beyond `closed`, sought at `target` (both gaps in m), up to `horizon` (s).
struct Goal {
  double closed, target, horizon;
};

/// A look at a feature: has it arrived? If not: a step (s) over which it surely does not.
struct Look {
  bool arrived;
  double step;
};
inline constexpr Look has_arrived{true, 0};
inline constexpr Look never_arrives{false, std::numeric_limits<double>::infinity()};

/// Advancements of one feature or pair before the safe time reached is returned.
inline constexpr int max_advancements = 100;

/// The time at which look(t, rest, first) finds that the feature has arrived; `horizon` where it does not by then.
/// rest: from t to the horizon, s; first: nothing has moved yet.
template <class LookAt>
double advance_until(double horizon, const LookAt& look) {
  double t = 0;
  for (int i = 0; i < max_advancements; ++i) {
    const double rest = horizon - t;
    const Look now = look(t, rest, i == 0);
    if (now.arrived) return t;
    if (!(now.step < rest)) return horizon;  // of what is not finite nobody knows where it goes
    t += now.step;
  }
  return t;
}

/// First positive root of c + b s + k s^2 / 2 for c > 0; infinite where there is none.
inline double first_root(double c, double b, double k) {
  constexpr double never = std::numeric_limits<double>::infinity();
  const double square = b * b - 2 * k * c;
  if (square < 0 || (b >= 0 && k >= 0)) return never;
  const double root = std::sqrt(square);
  return b < 0 ? 2 * c / (root - b) : (b + root) / -k;
}

/// A vector with its first two derivatives in time, and bounds on the sizes of all up to the third over the horizon.
struct Moving {
  Vec3 x, x1, x2;
  double size[4];
};

/// A direction fixed to a body that turns with w.
inline Moving turning_direction(const Vec3& e, const Vec3& w) {
  const double spin = w.norm();
  const Vec3 e1 = w.cross(e);
  return {e, e1, w.cross(e1), {1, spin, spin * spin, spin * spin * spin}};
}

/// From a point of body r (arm x_r, velocity 0 of its origin) to a point of body o (arm x_o, velocity v of its origin).
inline Moving between(const Vec3& distance, const Vec3& v, const Vec3& w_o, const Vec3& x_o, const Vec3& w_r,
                      const Vec3& x_r, double horizon) {
  const Vec3 o1 = w_o.cross(x_o), r1 = w_r.cross(x_r);
  const double o = w_o.norm(), r = w_r.norm(), arm_o = x_o.norm(), arm_r = x_r.norm();
  const double speed = v.norm() + o * arm_o + r * arm_r;
  return {
      distance,
      v + o1 - r1,
      w_o.cross(o1) - w_r.cross(r1),
      {distance.norm() + speed * horizon, speed, o * o * arm_o + r * r * arm_r, o * o * o * arm_o + r * r * r * arm_r}};
}

/// A gap that must stay positive: value, rate, second derivative now, bound on the third over the horizon.
struct Approach {
  double value, rate, curvature, K;
};

/// e x f: the common normal of two edges, times the sine of their angle.
inline Moving crossed(const Moving& e, const Moving& f) {
  return {e.x.cross(f.x),
          e.x1.cross(f.x) + e.x.cross(f.x1),
          e.x2.cross(f.x) + 2 * e.x1.cross(f.x1) + e.x.cross(f.x2),
          {1, e.size[1] + f.size[1], e.size[2] + 2 * e.size[1] * f.size[1] + f.size[2],
           e.size[3] + 3 * e.size[2] * f.size[1] + 3 * e.size[1] * f.size[2] + f.size[3]}};
}

/// n.d: the height of d's end above the plane with normal n through its beginning.
inline Approach along_normal(const Moving& n, const Moving& d) {
  return {n.x.dot(d.x), n.x1.dot(d.x) + n.x.dot(d.x1), n.x2.dot(d.x) + 2 * n.x1.dot(d.x1) + n.x.dot(d.x2),
          n.size[3] * d.size[0] + 3 * n.size[2] * d.size[1] + 3 * n.size[1] * d.size[2] + n.size[0] * d.size[3]};
}

/// Of two edges of a patch whose gap is open: q = e x f, not of unit length, and their distance along it less the goal,
/// both times |q|. 0 where they come to that goal while the gap along the patch's normal stays open: they are in line,
/// or pass each other sideways where the faces lean. Vertices stand for them then.
inline Approach edge_over_edge(const Moving& q, const Moving& distance, const Goal& goal) {
  constexpr double there = 0.01;  // -: of the way from closed to target that is left
  Approach gap = along_normal(q, distance);
  const double sine = q.x.norm();
  gap.value -= goal.target * sine;
  if (gap.value <= there * (goal.closed - goal.target) * sine) gap.value = 0;
  return gap;
}

/// A step within `rest` over which the gap surely stays above `target`. A shorter interval has a tighter bound, so the
/// root is improved a few times.
inline double safe_step(const Approach& gap, double target, double rest) {
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

/// The same of two lines with a radius (the sum of both), across which q = e x f stands, not of unit length: the gap
/// times |q| is `apart` = q.d less radius |q|, and |q| is at most what its chord and its second derivative say.
inline double safe_step_across(const Moving& q, const Approach& apart, double radius, double target, double rest) {
  const double sine = q.x.norm();
  if (radius == 0) return safe_step(apart, target * sine, rest);
  constexpr int improvements = 4;
  double step = 0, part = rest;
  for (int i = 0; i < improvements && part > step; ++i) {
    const double longer = ((q.x + part * q.x1).norm() - sine) / part;
    const Approach gap{apart.value - radius * sine, apart.rate - radius * longer, apart.curvature - radius * q.size[2],
                       apart.K};
    const double root = safe_step(gap, target * sine, part);
    step = std::max(step, root);
    if (root >= part / 2) break;
    part = 2 * step;
  }
  return step;
}

}  // namespace cb
