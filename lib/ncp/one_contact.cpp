// Contact problems of three unknowns.
//
//   u = W r + q,   r in K = { |r_t| <= mu r_n },   K* contains u + mu |u_t| e_n,   orthogonal to r
//
// Case by case. Opens: r = 0 where q_n >= 0. Sticks: u = 0 where that r is in K. Slips, u_n = 0 and u_t = -lambda r_t:
// with r_n = -(q_n + W_nt r_t) / W_nn eliminated
//   (A + lambda I) r_t = -b,     A = W_tt - W_tn W_nt / W_nn,   b = q_t - W_tn q_n / W_nn
//   f(lambda) = |r_t| - mu r_n = 0,   lambda > 0                                                         (1)
// f(0) > 0 where it does not stick, and f -> mu q_n / W_nn < 0 as lambda grows, so that there is a root. In the
// principal axes of A it takes a Newton step on f, or a halving where that leaves the bracket.
//
// Source: O. Bonnefon, G. Daviet, Quartic formulation of Coulomb 3D frictional contact, INRIA RT-400 (2011), for (1);
// J. Hwangbo, J. Lee, M. Hutter, Per-contact iteration method for solving contact dynamics, IEEE RA-L 3 (2018), sec.
// III for bisect_one_contact. Differences: 1. a bracketed Newton step in place of the roots of the quartic. 2. In the
// second the bracket is found by steps of an eighth of a turn from the direction against the slip without friction.
// Where W_tt is singular (a joint's contact) what cannot stick slips. Cannot fail on finite data with W_nn > 0.

#include "ncp/one_contact.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace cb {

namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// -: pivots of A below this fraction of trace(W) are zero.
constexpr double singular = 1e-14;
constexpr int most_steps = 200;
/// -: step of lambda that is rounding; and whose square is, so that after it a Newton step would be.
constexpr double rounding = 4e-16, last = 1e-9;

/// The tangential problem when u_n = 0: u_t = A r_t + b, r_n = normal + slope.r_t.
struct Tangential {
  Matrix2d A;
  Vector2d b, slope;
  double normal;

  explicit Tangential(const OneContact& c)
      : A(c.W.bottomRightCorner<2, 2>() - c.W.bottomLeftCorner<2, 1>() * c.W.topRightCorner<1, 2>() / c.W(0, 0)),
        b(c.q.tail<2>() - c.W.bottomLeftCorner<2, 1>() * (c.q[0] / c.W(0, 0))),
        slope(-c.W.topRightCorner<1, 2>().transpose() / c.W(0, 0)),
        normal(-c.q[0] / c.W(0, 0)) {}
  double normal_at(const Vector2d& r_t) const { return normal + slope.dot(r_t); }
};

Vector3d together(double n, const Vector2d& t) { return {n, t[0], t[1]}; }

/// Does it stick? r is the answer then.
bool sticks(const OneContact& c, const Tangential& at, Vector3d& r) {
  const double trace = c.W.trace(), determinant = at.A.determinant();
  if (!(determinant > singular * singular * trace * trace)) return false;
  const Vector2d r_t = -at.A.inverse() * at.b;
  r = together(at.normal_at(r_t), r_t);
  return r_t.norm() <= c.mu * r[0];
}

}  // namespace

Vector3d solve_one_contact(const OneContact& c) {
  if (!(c.q[0] < 0)) return Vector3d::Zero();
  const Tangential at(c);
  if (c.mu == 0 || at.b.isZero(0)) return together(at.normal, Vector2d::Zero());
  Vector3d r;
  if (sticks(c, at, r)) return r;

  // Principal axes of A; of two expressions for the first one that in which nothing cancels.
  const double mean = (at.A(0, 0) + at.A(1, 1)) / 2, half = (at.A(0, 0) - at.A(1, 1)) / 2, off = at.A(0, 1);
  const double radius = std::sqrt(half * half + off * off);
  const double a[] = {mean + radius, std::max(0.0, mean - radius)};
  const Vector2d along_1 = half >= 0 ? Vector2d(half + radius, off) : Vector2d(off, radius - half);
  const Vector2d e1 = radius > 0 ? Vector2d(along_1 / along_1.norm()) : Vector2d(Vector2d::UnitX());
  const Vector2d e2(-e1[1], e1[0]);
  const double b[] = {e1.dot(at.b), e2.dot(at.b)}, s[] = {e1.dot(at.slope), e2.dot(at.slope)};
  const auto f = [&](double lambda, double& slope) {
    double square = 0, along = 0, normal = at.normal, falls = 0;
    for (int i = 0; i < 2; ++i) {
      const double x = -b[i] / (a[i] + lambda), dx = -x / (a[i] + lambda);
      square += x * x;
      along += x * dx;
      normal += s[i] * x;
      falls += s[i] * dx;
    }
    const double size = std::sqrt(square);
    slope = (size > 0 ? along / size : 0) - c.mu * falls;
    return size - c.mu * normal;
  };
  double low = 0, high = at.b.norm() / (c.mu * at.normal) + c.W.trace(), slope = 0;
  while (f(high, slope) > 0 && std::isfinite(high)) high *= 4;
  double lambda = at.b.norm() / (c.mu * at.normal);  // the answer where nothing couples and A is round, but for A
  for (int k = 0; k < most_steps; ++k) {
    const double value = f(lambda, slope);
    (value > 0 ? low : high) = lambda;
    const double next = lambda - value / slope, step = std::abs(next - lambda);
    if (value == 0 || step <= rounding * lambda) break;  // before the bracket takes it for a miss
    const bool inside = next > low && next < high;
    lambda = inside ? next : (low + high) / 2;
    if (inside && step <= last * lambda) break;
  }
  const Vector2d r_t = -b[0] / (a[0] + lambda) * e1 - b[1] / (a[1] + lambda) * e2;
  // On the cone to the last bit: the normal impulse follows from the law's, friction from its direction.
  const double normal = std::max(0.0, at.normal_at(r_t)), size = r_t.norm();
  return together(normal, size > 0 ? Vector2d(r_t * (c.mu * normal / size)) : r_t);
}

Vector3d bisect_one_contact(const OneContact& c) {
  if (!(c.q[0] < 0)) return Vector3d::Zero();
  const Tangential at(c);
  if (c.mu == 0 || at.b.isZero(0)) return together(at.normal, Vector2d::Zero());
  Vector3d r;
  if (sticks(c, at, r)) return r;

  // On the curve r_n(angle) (1, mu d(angle)) with u_n = 0: the slope of the energy r.W r / 2 + r.q along it.
  const auto direction = [](double angle) { return Vector2d(std::cos(angle), std::sin(angle)); };
  const auto normal = [&](const Vector2d& d) {
    const double steep = 1 - c.mu * at.slope.dot(d);  // not positive: the curve does not close
    return steep > 0 ? at.normal / steep : HUGE_VAL;
  };
  const auto rises = [&](double angle) {
    const Vector2d d = direction(angle), across(-d[1], d[0]);
    const double n = normal(d);
    if (!std::isfinite(n)) return at.slope.dot(across) > 0;  // back to where the curve is
    const Vector2d u_t = at.A * (c.mu * n * d) + at.b;
    return u_t.dot(across + (c.mu * n / at.normal) * at.slope.dot(across) * d) > 0;
  };
  const Vector2d guess = -at.b;
  double angle = std::atan2(guess[1], guess[0]);
  const double step = rises(angle) ? -M_PI / 4 : M_PI / 4;
  double low = angle, high = angle + step;
  for (int k = 0; k < 8 && rises(high) == rises(low); ++k) low = high, high += step;
  const bool first = rises(low);
  for (int k = 0; k < 60; ++k) {
    angle = (low + high) / 2;
    (rises(angle) == first ? low : high) = angle;
  }
  const Vector2d d = direction((low + high) / 2);
  const double n = normal(d);
  return std::isfinite(n) ? together(n, c.mu * n * d) : Vector3d::Zero();
}

}  // namespace cb
