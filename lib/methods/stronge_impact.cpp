// One impact at one contact with Stronge's energetic restitution, integrated in impulse space.
//
// Problem: with K = W_cc (3 x 3, 1/kg), r the impulse so far (N s; rows n, t1, t2), p = r_n, u = u- + K r (m/s):
//     dr/dp = xi,   du/dp = K xi,   dW/dp = u_n,                                                             (1)
//     sliding  (s = |u_t| > 0)   xi = (1, -mu u_t / s)
//     sticking (s = 0)           xi = K^-1 e_n / (K^-1)_nn = (1, -x),  x = K_tt^-1 K_tn,  stable iff |x| <= mu
//     else the diverging ray     xi = (1, -mu t),  |t| = 1,  K_tn = mu K_tt t + f t,  f > 0                  (2)
// Compression stores the work -W done while u_n < 0; restitution (u_n > 0) takes e^2 times the stored work back and
// the impact ends when none is left. Should u_n fall below zero again on the way, it stores again.
//
// (2) has exactly one root when sticking is not stable: |(mu K_tt + f I)^-1 K_tn| falls from |x| / mu > 1 at f = 0 to
// below 1 at f = |K_tn|, and strictly. On that ray, and where sticking is stable, xi stays what it is to the end.
//
// Wherever xi is constant u is linear and W quadratic in p: these stretches (mu = 0, sticking, diverging, and sliding
// along a direction that K does not turn: spheres, motion in a plane) are taken in closed form. The others are
// integrated over sigma, dp = s dsigma, in which
//     dr_n = s,   dr_t = -mu u_t,   dW = s u_n,   dF = -mu s^2      (F: work of friction, J)                 (3)
// is smooth although the direction of sliding turns infinitely fast in p as s -> 0, and which does not care whether
// u_n is monotone (self-locking: friction drives u_n further down until the slip has stopped). Dormand-Prince 5(4);
// where K_tt makes (3) stiff (a wheel gives way by its spin one way, with all of its robot the other), RODAS3
// (sliding_step.h); u_n = 0
// and the end of the stored work are met by Newton's method on the length of the last step. The slip stops only as
// sigma -> infinity, along a direction that no longer turns: that last stretch is the closed form again.
//
// Energy: the kinetic energy changes by W + F (an identity of (1)), W = -(1 - e^2) stored <= 0 and F <= 0, so no
// impact gains any for e <= 1.
//
// Source: B. Mirtich, Impulse-based Dynamic Simulation of Rigid Body Systems, PhD thesis, Berkeley 1996, ch. 3;
// W. J. Stronge, Rigid body collisions with friction, Proc. R. Soc. A 431 (1990).
// RODAS3: A. Sandu et al., Benchmarking stiff ODE solvers for atmospheric chemistry problems II, Atmos. Environ. 31
// (1997).
// Differences: 1. the variable sigma in place of u_n (compression) and W (restitution); 2. the diverging ray from (2)
// rather than from a quartic; 3. repeated compression stores again.
//
// Fails: step_limit reached, a K that holds the impact for ever, or an end beyond the largest number -> nonconverged,
// singular or not_finite with the impulse so far.

#include "methods/stronge_impact.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "linalg/stop.h"
#include "methods/sliding_step.h"

namespace cb {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double infinite = std::numeric_limits<double>::infinity();
/// Dormand-Prince is stable for h |lambda| < 3.3: accurate steps are far shorter, so this many that are longer than
/// 2 / |lambda| mean that stability keeps them short, not accuracy.
constexpr double long_step = 2;
constexpr int long_steps_of_stiff = 20;
/// Sliding that K turns by less than this (relative, per unit of impulse) does not turn: round-off of K.
constexpr double round_off = 1e-14;

/// xi once the slip has stopped: sticking where that is stable, else the diverging ray.
Vector3d direction_from_rest(const Matrix3d& K, double mu, bool& sticks) {
  // Principal axes of K_tt, lambda_0 >= lambda_1 >= 0, and K_tn in them.
  const double half = 0.5 * (K(1, 1) - K(2, 2)), mean = 0.5 * (K(1, 1) + K(2, 2));
  const double radius = std::hypot(half, K(1, 2));
  const double angle = 0.5 * std::atan2(K(1, 2), half);
  const double c = std::cos(angle), s = std::sin(angle);
  const double lambda[2] = {mean + radius, std::max(mean - radius, 0.0)};
  const double q[2] = {c * K(1, 0) + s * K(2, 0), -s * K(1, 0) + c * K(2, 0)};
  const auto in_world = [&](double a, double b) { return Vector3d(1, -(c * a - s * b), -(s * a + c * b)); };

  // A direction that impulses cannot move (lambda_1 = 0) has K_tn = 0 too, K being positive semidefinite.
  double x[2];
  for (int i = 0; i < 2; ++i) x[i] = lambda[i] > round_off * lambda[0] ? q[i] / lambda[i] : 0;
  sticks = std::hypot(x[0], x[1]) <= mu;
  if (sticks) return in_world(x[0], x[1]);

  // (2) by Newton's method on 1 - 1/|x(f)| between bounds.
  double low = 0, high = std::hypot(q[0], q[1]), f = 0;
  for (int i = 0; i < 100 && high - low > 1e-16 * high; ++i) {
    double size2 = 0, slope = 0;
    for (int k = 0; k < 2; ++k) {
      const double d = mu * lambda[k] + f;
      x[k] = d > 0 ? q[k] / d : 0;
      size2 += x[k] * x[k];
      slope += d > 0 ? x[k] * x[k] / d : 0;
    }
    (size2 > 1 ? low : high) = f;
    const double size = std::sqrt(size2);
    const double next = slope > 0 ? f + size2 * (size - 1) / slope : low;
    if (next == f) break;
    f = next > low && next < high ? next : 0.5 * (low + high);
  }
  const double size = std::hypot(x[0], x[1]);
  return in_world(mu * x[0] / size, mu * x[1] / size);
}

class Path {
 public:
  Path(const Matrix3d& K, const Vector3d& u, double mu, double e, double event_approach, const ImpactOptions& options,
       Impact& impact)
      : K_(K),
        u0_(u),
        mu_(mu),
        e2_(e * e),
        approach_(-u[0]),
        allowed_(errors(K, u, event_approach, options)),
        step_of_(K, mu, allowed_),
        step_limit_(options.step_limit),
        impact_(impact) {}

  void follow(double no_slip) {
    double slip = std::hypot(u0_[1], u0_[2]);
    bool resting = !(slip > no_slip);
    if (mu_ == 0) {
      follow_ray(Vector3d(1, 0, 0));
      return;
    }
    while (!resting && !ended_) {
      poll_stop();
      if (impact_.steps++ >= step_limit_) {
        fail(Status::nonconverged);
        return;
      }
      const Vector3d u = velocity(y_);
      slip = std::sqrt(u[1] * u[1] + u[2] * u[2]);
      if (!(slip > no_slip)) break;
      impact_.slid = true;
      const double t1 = u[1] / slip, t2 = u[2] / slip;
      const Vector3d xi(1, -mu_ * t1, -mu_ * t2);
      const Vector3d a = K_ * xi;
      const double along = t1 * a[1] + t2 * a[2], turn = std::abs(t1 * a[2] - t2 * a[1]);
      if (loading_ && a[0] < 0) impact_.locked = true;
      const double stop = along < 0 ? -slip / along : infinite;
      const bool straight = turn <= round_off * std::hypot(a[1], a[2]) || turn * stop <= 1e-2 * allowed_.velocity;
      if (straight)
        resting = straight_stretch(u, xi, a, stop);
      else
        curved_step(u, slip, a);
    }
    if (ended_) return;
    bool sticks = false;
    const Vector3d xi = direction_from_rest(K_, mu_, sticks);
    (sticks ? impact_.stuck : impact_.diverged) = true;
    follow_ray(xi);
  }

 private:
  static StepErrors errors(const Matrix3d& K, const Vector3d& u, double event_approach, const ImpactOptions& options) {
    const double approach = -u[0], own = options.integration_own * approach;
    return {.velocity = std::min(options.integration * std::max(event_approach, approach), own),
            .work = 0.5 / K(0, 0) *
                    std::min(options.integration * std::max(event_approach * event_approach, approach * approach),
                             own * approach),
            .friction_relative = options.integration,
            .turn = options.turn};
  }

  Vector3d velocity(const ImpactPoint& y) const { return u0_ + K_ * y.r; }

  void follow_ray(const Vector3d& xi) {
    const Vector3d a = K_ * xi;
    while (!ended_ && impact_.steps++ < step_limit_) {
      poll_stop();
      straight_stretch(velocity(y_), xi, a, infinite);
    }
    if (!ended_) fail(Status::nonconverged);
  }

  /// Goes on along a constant xi to the end of the phase, or over the normal impulse `stop`; true where `stop` came
  /// first.
  bool straight_stretch(const Vector3d& u, const Vector3d& xi, const Vector3d& a, double stop) {
    double p = infinite;
    bool end = false;
    if (loading_) {
      if (u[0] >= 0)
        p = 0;
      else if (a[0] > 0)
        p = -u[0] / a[0];
    } else {
      // u_n p + a_n p^2 / 2 = what is left; without a root u_n returns to zero first.
      const double left = e2_ * stored_ - y_.work, un = std::max(u[0], 0.0);
      const double d = un * un + 2 * a[0] * left;
      end = d >= 0 && un + std::sqrt(d) > 0;
      if (end)
        p = d < infinite ? 2 * left / (un + std::sqrt(d)) : infinite;
      else
        p = -un / a[0];
    }
    const bool stops = stop < p;
    if (stops) p = stop;
    if (!std::isfinite(p)) {
      // It has no end, or one beyond the largest number.
      const bool endless = !end && a[0] <= 0 && std::isfinite(u[0]);
      fail(endless ? Status::singular : Status::not_finite);
      return true;
    }
    y_.r += p * xi;
    y_.work += p * (u[0] + 0.5 * p * a[0]);
    y_.friction += p * (xi[1] * (u[1] + 0.5 * p * a[1]) + xi[2] * (u[2] + 0.5 * p * a[2]));
    if (!stops) end_phase(end);
    return stops;
  }

  /// One step of (3), shortened to the end of the phase where that comes first.
  void curved_step(const Vector3d& u, double slip, const Vector3d& a) {
    if (step_ == 0) step_ = 1.1 * std::min(0.3, approach_ / slip) / std::max(std::abs(a[0]), std::hypot(a[1], a[2]));
    ImpactPoint y;
    const double error = advance(u, step_, y);
    const double next = step_ * std::clamp(0.9 * std::pow(error + 1e-30, stiff_ ? -1.0 / 3 : -0.2), 0.2, 5.0);
    if (!(error <= 1)) {
      step_ = std::isfinite(next) ? next : 0.1 * step_;
      return;
    }
    const double un = velocity(y)[0];
    if (loading_ && un >= 0) {
      land(u, y, false);
      end_phase(false);
    } else if (!loading_ && y.work >= e2_ * stored_) {
      land(u, y, true);
      end_phase(true);
    } else if (!loading_ && un < 0) {
      if (u[0] <= 1e-12 * approach_) {  // rose and fell within the step: take it apart
        step_ *= 0.5;
        return;
      }
      land(u, y, false);
      end_phase(false);
    } else {
      y_ = y;
      long_steps_ = step_ * mu_ * (K_(1, 1) + K_(2, 2)) > long_step ? long_steps_ + 1 : 0;
      stiff_ = stiff_ || long_steps_ >= long_steps_of_stiff;
      step_ = next;
    }
  }

  /// Where u_n passes zero (`by_work` false) or the stored work is spent, within the step that led to y.
  void land(const Vector3d& start, const ImpactPoint& last, bool by_work) {
    const double sign = by_work || loading_ ? 1 : -1;
    double low = 0, high = step_, h = step_, last_move = step_;
    ImpactPoint y = last;
    for (int i = 0; i < 60; ++i) {
      const Vector3d u = velocity(y);
      const double slip = std::sqrt(u[1] * u[1] + u[2] * u[2]);
      double miss = 0, rate = 0;
      if (by_work) {
        miss = y.work - e2_ * stored_;
        rate = slip * u[0];
      } else {
        miss = u[0];
        rate = slip * K_(0, 0) - mu_ * (K_(0, 1) * u[1] + K_(0, 2) * u[2]);
      }
      // Newton's method, within bounds; it ends where a move is round-off, or (u_n far below the slip) shrinks no more.
      (sign * miss > 0 ? high : low) = h;
      double move = sign * rate > 0 ? -miss / rate : infinite;
      if (std::abs(move) <= 1e-14 * h || (std::abs(move) <= 1e-8 * h && std::abs(move) >= 0.5 * last_move)) break;
      last_move = std::abs(move);
      if (!(h + move > low && h + move < high)) move = 0.5 * (low + high) - h;
      h += move;
      advance(start, h, y);
    }
    y_ = y;
  }

  /// Compression to restitution, restitution to the end, or (u_n back at zero before) to compression again.
  void end_phase(bool spent) {
    if (loading_) {
      impact_.compression_work += y_.work;
      stored_ -= y_.work;
      loading_ = false;
      ended_ = !(e2_ * stored_ > 0);
    } else {
      impact_.restitution_work += y_.work;
      stored_ -= y_.work / e2_;
      loading_ = true;
      ended_ = spent;
    }
    y_.work = 0;
    impact_.r = y_.r;
    impact_.friction_work = y_.friction;
  }

  void fail(Status status) {
    impact_.status = status;
    impact_.r = y_.r;
    ended_ = true;
  }

  /// One step of (3) of length h from y_, where the velocity is `start`, into y; returns the local error over what is
  /// allowed.
  double advance(const Vector3d& start, double h, ImpactPoint& y) const {
    return stiff_ ? step_of_.stiff_step(start, h, y_, y) : step_of_.explicit_step(start, h, y_, y);
  }

  const Matrix3d& K_;
  const Vector3d u0_;
  const double mu_, e2_, approach_;  // -, -, m/s
  const StepErrors allowed_;
  const SlidingStep step_of_;
  const int step_limit_;
  Impact& impact_;
  ImpactPoint y_;
  double stored_ = 0;   // J
  double step_ = 0;     // of sigma, kg m/s per m/s
  int long_steps_ = 0;  // accepted one after the other
  bool stiff_ = false, loading_ = true, ended_ = false;
};

}  // namespace

void integrate_impact(const Matrix3d& K, const Vector3d& u, double mu, double e, double no_slip, double event_approach,
                      const ImpactOptions& options, Impact& impact) {
  impact = {};
  if (!(K(0, 0) > 0)) {
    impact.status = Status::singular;
    return;
  }
  if (u[0] < 0) Path(K, u, mu, e, event_approach, options, impact).follow(no_slip);
}

}  // namespace cb
