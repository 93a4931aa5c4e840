// Contact problems of three unknowns.
//
//   u = W r + q,   r in K = { |r_t| <= mu r_n },   K* contains u + mu |u_t| e_n,   orthogonal to r
//
// Case by case. Opens: r = 0 where q_n >= 0. Sticks: u = 0 where that r is in K. Slips, u_n = 0 and u_t = -lambda r_t:
// with r_n = -(q_n + W_nt r_t) / W_nn eliminated
//   (A + lambda I) r_t = -b,     A = W_tt - W_tn W_nt / W_nn,   b = q_t - W_tn q_n / W_nn
//   f(lambda) = |r_t| - mu r_n = 0,   lambda > 0                                                         (1)
// f(0) > 0 where it does not stick, and f -> mu q_n / W_nn < 0 as lambda grows, so that there is a root. In the
// principal axes of A it takes a Newton step on mu r_n / |r_t| - 1, which is straight where A is round and nothing
// couples, or a halving where that leaves the bracket.
//
// Source: O. Bonnefon, G. Daviet, Quartic formulation of Coulomb 3D frictional contact, INRIA RT-400 (2011), for (1);
// J. Hwangbo, J. Lee, M. Hutter, Per-contact iteration method for solving contact dynamics, IEEE RA-L 3 (2018), sec.
// III for bisect. Differences: 1. a bracketed Newton step in place of the roots of the quartic. 2. In the
// second the bracket is found by steps of an eighth of a turn from the direction against the slip without friction.
// Where A is singular (a joint's contact) nothing changes the slip along an axis of it: there it sticks where it is at
// rest by itself, else it slips. Cannot fail on finite data with W_nn > 0.

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

/// -: principal values of A below this fraction of trace(W_tt) are zero, and slips below this one of their terms.
constexpr double singular = 1e-14;
constexpr int most_steps = 200;
/// -: step of lambda that is rounding; and whose square is, so that after it a Newton step would be.
constexpr double rounding = 4e-16, last = 1e-9;

Vector3d together(double n, const Vector2d& t) { return {n, t[0], t[1]}; }

}  // namespace

/// The tangential problem when u_n = 0: u_t = A r_t + b, r_n = normal + slope.r_t.
struct OneContact::Tangential {
  Vector2d b;
  double normal;

  Tangential(const Matrix3d& W, const Vector3d& q)
      : b(q.tail<2>() - W.bottomLeftCorner<2, 1>() * (q[0] / W(0, 0))), normal(-q[0] / W(0, 0)) {}
  double normal_at(const Vector2d& slope, const Vector2d& r_t) const { return normal + slope.dot(r_t); }
};

OneContact::OneContact(const Matrix3d& W, double mu)
    : W_(W),
      mu_(mu),
      A_(W.bottomRightCorner<2, 2>() - W.bottomLeftCorner<2, 1>() * W.topRightCorner<1, 2>() / W(0, 0)),
      slope_(-W.topRightCorner<1, 2>().transpose() / W(0, 0)) {
  // Of two expressions for the first axis that in which nothing cancels.
  const double mean = (A_(0, 0) + A_(1, 1)) / 2, half = (A_(0, 0) - A_(1, 1)) / 2, off = A_(0, 1);
  const double radius = std::sqrt(half * half + off * off);
  a_[0] = mean + radius;
  a_[1] = mean - radius;
  can_stick_ = a_[1] > singular * (W(1, 1) + W(2, 2));
  if (can_stick_)
    to_stick_ = -A_.inverse();
  else
    for (double& a : a_)
      if (!(a > singular * (W(1, 1) + W(2, 2)))) a = 0;
  const Vector2d along = half >= 0 ? Vector2d(half + radius, off) : Vector2d(off, radius - half);
  first_ = radius > 0 ? Vector2d(along / along.norm()) : Vector2d(Vector2d::UnitX());
  second_ = Vector2d(-first_[1], first_[0]);
  s_[0] = first_.dot(slope_);
  s_[1] = second_.dot(slope_);
}

/// Does it stick? r is the answer then.
bool OneContact::sticks(const Tangential& at, Vector3d& r) const {
  Vector2d r_t;
  if (can_stick_)
    r_t = to_stick_ * at.b;
  else if (!stops_where_it_moves(at, r_t))
    return false;
  r = together(at.normal_at(slope_, r_t), r_t);
  return r_t.norm() <= mu_ * r[0];
}

/// Friction that stops the slip where A is singular. False where it slips along an axis that nothing moves it along.
bool OneContact::stops_where_it_moves(const Tangential& at, Vector2d& r_t) const {
  const double still = singular * (at.b.norm() + W_.bottomLeftCorner<2, 1>().norm() * at.normal);
  const Vector2d* const axes[] = {&first_, &second_};
  r_t.setZero();
  for (int i = 0; i < 2; ++i) {
    const double along = axes[i]->dot(at.b);
    if (a_[i] > 0)
      r_t -= along / a_[i] * *axes[i];
    else if (!(std::abs(along) <= still))
      return false;
  }
  return true;
}

Vector3d OneContact::solve(const Vector3d& q) const {
  if (!(q[0] < 0)) return Vector3d::Zero();
  const Tangential at(W_, q);
  if (mu_ == 0 || at.b.isZero(0)) return together(at.normal, Vector2d::Zero());
  Vector3d r;
  return sticks(at, r) ? r : slips(at);
}

Vector3d OneContact::slips(const Tangential& at) const {
  const double b[] = {first_.dot(at.b), second_.dot(at.b)};
  const auto f = [&](double lambda, double& newton) {
    double square = 0, along = 0, normal = at.normal, falls = 0;
    for (int i = 0; i < 2; ++i) {
      const double x = -b[i] / (a_[i] + lambda), dx = -x / (a_[i] + lambda);
      square += x * x;
      along += x * dx;
      normal += s_[i] * x;
      falls += s_[i] * dx;
    }
    const double value = std::sqrt(square) - mu_ * normal;
    newton = value * square / (mu_ * (falls * square - normal * along));
    return value;
  };
  double lambda = at.b.norm() / (mu_ * at.normal);  // the answer where nothing couples and A is round, but for A
  double low = 0, high = lambda + W_.trace(), newton = 0;
  bool bounded = false;  // is f(high) <= 0? Asked where a step goes so far: few do
  for (int k = 0; k < most_steps; ++k) {
    const double value = f(lambda, newton);
    (value > 0 ? low : high) = lambda;
    bounded = bounded || !(value > 0);
    const double next = lambda + newton, step = std::abs(newton);
    if (value == 0 || step <= rounding * lambda) break;  // before the bracket takes it for a miss
    bool inside = next > low && next < high;
    if (!inside && !bounded) {
      for (double unused; f(high, unused) > 0 && std::isfinite(high);) high *= 4;
      bounded = true;
      inside = next > low && next < high;
    }
    lambda = inside ? next : (low + high) / 2;
    if (inside && step <= last * lambda) break;
  }
  const Vector2d r_t = -b[0] / (a_[0] + lambda) * first_ - b[1] / (a_[1] + lambda) * second_;
  // On the cone to the last bit: the normal impulse follows from the law's, friction from its direction.
  const double normal = std::max(0.0, at.normal_at(slope_, r_t)), size = r_t.norm();
  return together(normal, size > 0 ? Vector2d(r_t * (mu_ * normal / size)) : r_t);
}

Vector3d OneContact::bisect(const Vector3d& q) const {
  if (!(q[0] < 0)) return Vector3d::Zero();
  const Tangential at(W_, q);
  if (mu_ == 0 || at.b.isZero(0)) return together(at.normal, Vector2d::Zero());
  Vector3d r;
  if (sticks(at, r)) return r;

  // On the curve r_n(angle) (1, mu d(angle)) with u_n = 0: the slope of the energy r.W r / 2 + r.q along it.
  const auto direction = [](double angle) { return Vector2d(std::cos(angle), std::sin(angle)); };
  const auto normal = [&](const Vector2d& d) {
    const double steep = 1 - mu_ * slope_.dot(d);  // not positive: the curve does not close
    return steep > 0 ? at.normal / steep : HUGE_VAL;
  };
  const auto rises = [&](double angle) {
    const Vector2d d = direction(angle), across(-d[1], d[0]);
    const double n = normal(d);
    if (!std::isfinite(n)) return slope_.dot(across) > 0;  // back to where the curve is
    const Vector2d u_t = A_ * (mu_ * n * d) + at.b;
    return u_t.dot(across + (mu_ * n / at.normal) * slope_.dot(across) * d) > 0;
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
  return std::isfinite(n) ? together(n, mu_ * n * d) : Vector3d::Zero();
}

}  // namespace cb
