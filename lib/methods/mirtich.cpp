// Stronge's energetic restitution, integrated in impulse space (Mirtich).
//
// Problem (nc contacts, nv velocities; contact/problem.h). While a contact approaches, the fastest one suffers an
// impact of its own (a resting contact is a sequence of such micro-impacts), until none has u_n < -tolerance.
//
// One impact, with K = W_cc (3 x 3, 1/kg), r the impulse so far (N s; rows n, t1, t2), p = r_n, u = u- + K r (m/s):
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
// where K_tt makes (3) stiff (a wheel gives way by its spin one way, with all of its robot the other), RODAS3; u_n = 0
// and the end of the stored work are met by Newton's method on the length of the last step. The slip stops only as
// sigma -> infinity, along a direction that no longer turns: that last stretch is the closed form again.
//
// Energy: the kinetic energy changes by W + F (an identity of (1)), W = -(1 - e^2) stored <= 0 and F <= 0, so no
// impact gains any for e <= 1.
//
// Source: B. Mirtich, Impulse-based Dynamic Simulation of Rigid Body Systems, PhD thesis, Berkeley 1996, ch. 3;
// W. J. Stronge, Rigid body collisions with friction, Proc. R. Soc. A 431 (1990). Equations after spec methods.md.
// RODAS3: A. Sandu et al., Benchmarking stiff ODE solvers for atmospheric chemistry problems II, Atmos. Environ. 31
// (1997).
// Differences: 1. the variable sigma in place of u_n (compression) and W (restitution); 2. the diverging ray from (2)
// rather than from a quartic; 3. repeated compression stores again.
//
// Fails: impact_limit or step_limit reached -> nonconverged with the impulses so far; NaN or infinity in the data or on
// the way -> not_finite, no impulse; M not positive definite -> singular, no impulse.

#include "methods/mirtich.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "linalg/finite.h"
#include "linalg/stop.h"

namespace cb {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
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
  Path(const Matrix3d& K, const Vector3d& u, double mu, double e, double event_approach, const MirtichOptions& options,
       Impact& impact)
      : K_(K),
        u0_(u),
        column_n_(K.col(0)),
        column_1_(-mu * K.col(1)),
        column_2_(-mu * K.col(2)),
        mu_(mu),
        e2_(e * e),
        approach_(-u[0]),
        error_(std::min(options.integration * std::max(event_approach, -u[0]), options.integration_own * -u[0])),
        error_work_(0.5 / K(0, 0) *
                    std::min(options.integration * std::max(event_approach * event_approach, u[0] * u[0]),
                             options.integration_own * u[0] * u[0])),
        options_(options),
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
      if (impact_.steps++ >= options_.step_limit) {
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
      const bool straight = turn <= round_off * std::hypot(a[1], a[2]) || turn * stop <= 1e-2 * error_;
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
  /// r, the normal work since the phase began, the work of friction.
  struct Point {
    Vector3d r = Vector3d::Zero();
    double work = 0, friction = 0;
  };

  Vector3d velocity(const Point& y) const { return u0_ + K_ * y.r; }

  void follow_ray(const Vector3d& xi) {
    const Vector3d a = K_ * xi;
    while (!ended_ && impact_.steps++ < options_.step_limit) {
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
        p = 2 * left / (un + std::sqrt(d));
      else
        p = -un / a[0];
    }
    const bool stops = stop < p;
    if (stops) p = stop;
    if (!std::isfinite(p)) {
      fail(Status::singular);
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
    Point y;
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
  void land(const Vector3d& start, const Point& last, bool by_work) {
    const double sign = by_work || loading_ ? 1 : -1;
    double low = 0, high = step_, h = step_, last_move = step_;
    Point y = last;
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
  double advance(const Vector3d& start, double h, Point& y) const {
    return stiff_ ? rodas3(start, h, y) : dormand_prince(start, h, y);
  }

  /// Local errors of the velocity, the works and the direction of sliding at the end of a step, where the slip is
  /// `slip`, over what is allowed.
  double over_allowed(const Vector3d& du, double work, double friction, double slip, const Point& y) const {
    // The direction of sliding must be known too, to the end: without that bound the step outgrows what is stable.
    const double turn2 = (du[1] * du[1] + du[2] * du[2]) / (slip * slip * options_.turn * options_.turn);
    const double works = std::max(std::abs(work) / error_work_,
                                  std::abs(friction) / (error_work_ + options_.integration * std::abs(y.friction)));
    return std::max({du.cwiseAbs().maxCoeff() / error_, works, std::sqrt(turn2)});
  }

  /// RODAS3, order 3(2), L-stable: four solves with one 3 x 3 matrix; the works follow from r.
  double rodas3(const Vector3d& start, double h, Point& y) const {
    const auto slopes = [&](const Vector3d& r) {
      const Vector3d u = start + K_ * r;
      const double s = std::hypot(u[1], u[2]);
      return Point{Vector3d(s, -mu_ * u[1], -mu_ * u[2]), s * u[0], -mu_ * s * s};
    };
    const double s0 = std::hypot(start[1], start[2]);
    const Eigen::RowVector3d slip_slope = (start[1] * K_.row(1) + start[2] * K_.row(2)) / s0;
    const Eigen::RowVector3d work_slope = start[0] * slip_slope + s0 * K_.row(0);
    const Eigen::RowVector3d friction_slope = -2 * mu_ * s0 * slip_slope;
    Matrix3d matrix = 2 / h * Matrix3d::Identity();
    matrix.row(0) -= slip_slope;
    matrix.bottomRows<2>() += mu_ * K_.bottomRows<2>();
    const Matrix3d inverse = matrix.inverse();
    // (2 / h - J) U = f(y + sum a U_j) + sum (c / h) U_j
    const auto stage = [&](const Point& f, const Point& c) {
      Point U;
      U.r = inverse * (f.r + c.r / h);
      U.work = h / 2 * (f.work + c.work / h + work_slope * U.r);
      U.friction = h / 2 * (f.friction + c.friction / h + friction_slope * U.r);
      return U;
    };
    const auto sum = [](double a, const Point& x, double b, const Point& z) {
      return Point{a * x.r + b * z.r, a * x.work + b * z.work, a * x.friction + b * z.friction};
    };
    const Point f1 = slopes(Vector3d::Zero());
    const Point U1 = stage(f1, {});
    const Point U2 = stage(f1, sum(4, U1, 0, U1));
    const Point U3 = stage(slopes(2 * U1.r), sum(1, U1, -1, U2));
    const Point U4 = stage(slopes(2 * U1.r + U3.r), sum(1, sum(1, U1, -1, U2), -8.0 / 3, U3));
    const Point move = sum(1, sum(2, U1, 1, U3), 1, U4);
    y = sum(1, y_, 1, move);
    const Vector3d u = start + K_ * move.r;
    return over_allowed(K_ * U4.r, U4.work, U4.friction, std::hypot(u[1], u[2]), y);
  }

  /// Written out in the slopes s, u_t1, u_t2 of each stage, of which all else is a combination.
  double dormand_prince(const Vector3d& start, double h, Point& y) const {
    struct Stage {
      double n, t1, t2, s;  // u and |u_t|
    };
    const auto at = [&](double s, double t1, double t2) {
      Stage k{start[0] + h * (column_n_[0] * s + column_1_[0] * t1 + column_2_[0] * t2),
              start[1] + h * (column_n_[1] * s + column_1_[1] * t1 + column_2_[1] * t2),
              start[2] + h * (column_n_[2] * s + column_1_[2] * t1 + column_2_[2] * t2), 0};
      k.s = std::sqrt(k.t1 * k.t1 + k.t2 * k.t2);
      return k;
    };
    const auto stage = [&](const auto& sum) { return at(sum(&Stage::s), sum(&Stage::t1), sum(&Stage::t2)); };
    const Stage k1{start[0], start[1], start[2], std::sqrt(start[1] * start[1] + start[2] * start[2])};
    const Stage k2 = stage([&](auto f) { return 1.0 / 5 * k1.*f; });
    const Stage k3 = stage([&](auto f) { return 3.0 / 40 * k1.*f + 9.0 / 40 * k2.*f; });
    const Stage k4 = stage([&](auto f) { return 44.0 / 45 * k1.*f - 56.0 / 15 * k2.*f + 32.0 / 9 * k3.*f; });
    const Stage k5 = stage([&](auto f) {
      return 19372.0 / 6561 * k1.*f - 25360.0 / 2187 * k2.*f + 64448.0 / 6561 * k3.*f - 212.0 / 729 * k4.*f;
    });
    const Stage k6 = stage([&](auto f) {
      return 9017.0 / 3168 * k1.*f - 355.0 / 33 * k2.*f + 46732.0 / 5247 * k3.*f + 49.0 / 176 * k4.*f -
             5103.0 / 18656 * k5.*f;
    });
    const auto fifth = [&](const auto& f) {
      return 35.0 / 384 * f(k1) + 500.0 / 1113 * f(k3) + 125.0 / 192 * f(k4) - 2187.0 / 6784 * f(k5) +
             11.0 / 84 * f(k6);
    };
    const auto s = [](const Stage& k) { return k.s; };
    const auto t1 = [](const Stage& k) { return k.t1; };
    const auto t2 = [](const Stage& k) { return k.t2; };
    const auto work = [](const Stage& k) { return k.s * k.n; };
    const auto friction = [](const Stage& k) { return k.s * k.s; };
    const double p = fifth(s), q1 = fifth(t1), q2 = fifth(t2);
    const Stage k7 = at(p, q1, q2);
    y.r = y_.r + h * Vector3d(p, -mu_ * q1, -mu_ * q2);
    y.work = y_.work + h * fifth(work);
    y.friction = y_.friction - mu_ * h * fifth(friction);

    const auto error = [&](const auto& f) {
      return h * (71.0 / 57600 * f(k1) - 71.0 / 16695 * f(k3) + 71.0 / 1920 * f(k4) - 17253.0 / 339200 * f(k5) +
                  22.0 / 525 * f(k6) - 1.0 / 40 * f(k7));
    };
    const Vector3d du = error(s) * column_n_ + error(t1) * column_1_ + error(t2) * column_2_;
    return over_allowed(du, error(work), mu_ * error(friction), k7.s, y);
  }

  const Matrix3d& K_;
  const Vector3d u0_;
  const Vector3d column_n_, column_1_, column_2_;  // of K, what s, u_t1, u_t2 of (3) do to u: 1, -mu, -mu
  const double mu_, e2_, approach_;                // -, -, m/s
  const double error_, error_work_;                // allowed in a step: m/s, J
  const MirtichOptions& options_;
  Impact& impact_;
  Point y_;
  double stored_ = 0;   // J
  double step_ = 0;     // of sigma, kg m/s per m/s
  int long_steps_ = 0;  // accepted one after the other
  bool stiff_ = false, loading_ = true, ended_ = false;
};

class Mirtich {
 public:
  explicit Mirtich(const MirtichOptions& options) : options_(options) {}

  void solve(const ContactProblem& problem, ContactSolution& solution) {
    solution.clear();
    const int nc = problem.nc();
    solution.size = 3 * nc;
    solution.impulse.assign(3 * nc, 0.0);
    WorkWitness& work = solution.as<WorkWitness>();
    const auto clear_work = [&] {
      for (auto* of : {&work.compression, &work.restitution, &work.friction}) of->assign(nc, 0.0);
    };
    clear_work();
    solution.status = state_.start(problem, options_.tolerances, solution.reason);
    if (solution.status != Status::ok) return;

    refresh_normal_velocities();
    const long limit = static_cast<long>(options_.impact_limit) * nc;
    bool fresh = true;
    int c = fastest_approach();
    while (c >= 0 && solution.iterations < limit) {
      poll_stop();
      ++solution.iterations;
      fresh = false;
      if (!impact(problem, c, solution)) break;
      c = fastest_approach();
      if (c < 0) {  // take round-off out of v before believing it
        state_.restart(solution.impulse);
        refresh_normal_velocities();
        fresh = true;
        c = fastest_approach();
      }
    }
    if (!fresh) state_.restart(solution.impulse);

    if (!state_.finite() || !finite(work)) {
      solution.status = Status::not_finite;
      solution.reason = "the impulses grew beyond all bounds";
      solution.impulse.assign(3 * nc, 0.0);
      clear_work();
    } else if (solution.status == Status::ok && c >= 0) {
      solution.status = Status::nonconverged;
      solution.reason = "contacts still approach after " + std::to_string(solution.iterations) + " micro-impacts";
    }
    solution.claimed_residual = residual(problem, solution);
  }

 private:
  bool impact(const ContactProblem& problem, int c, ContactSolution& solution) {
    integrate_impact(state_.K(c), state_.velocity(c), problem.mu[c], problem.restitution[c], state_.slip_rounding(c),
                     state_.approach_before(), options_, impact_);
    if (impact_.status != Status::ok) {
      solution.status = impact_.status;
      solution.reason = impact_.status == Status::singular ? "an impact without end: the contact's inertia is singular"
                                                           : "one impact took more steps than the limit";
      return false;
    }
    state_.apply(c, impact_.r);
    for (int i = 0; i < 3; ++i) solution.impulse[3 * c + i] += impact_.r[i];
    WorkWitness& work = solution.as<WorkWitness>();
    work.compression[c] += impact_.compression_work;
    work.restitution[c] += impact_.restitution_work;
    work.friction[c] += impact_.friction_work;
    for (int i : state_.neighbours(c)) normal_velocity_[i] = state_.normal_velocity(i);
    return true;
  }

  /// Works go as the square of velocities and overflow before them.
  static bool finite(const WorkWitness& work) {
    return all_finite(work.compression) && all_finite(work.restitution) && all_finite(work.friction);
  }

  void refresh_normal_velocities() {
    normal_velocity_.resize(state_.nc());
    for (int c = 0; c < state_.nc(); ++c) normal_velocity_[c] = state_.normal_velocity(c);
  }

  /// The contact with the least u_n of those that approach, or -1. The first of equals, up to round-off, so that the
  /// choice does not hang on the last bit.
  int fastest_approach() const {
    int fastest = -1;
    double least = 0;
    for (int c = 0; c < state_.nc(); ++c)
      if (normal_velocity_[c] < -state_.approach_tolerance(c) && normal_velocity_[c] < least) {
        fastest = c;
        least = normal_velocity_[c] * (1 + 1e-12);
      }
    return fastest;
  }

  /// The fastest remaining approach as a fraction of the fastest before the event, or the worst work returned in
  /// excess or want of e^2 times the work stored as a fraction of the latter, -.
  double residual(const ContactProblem& problem, const ContactSolution& solution) const {
    double worst = 0;
    const WorkWitness& work = solution.as<WorkWitness>();
    for (int c = 0; c < problem.nc(); ++c) {
      if (state_.approach_before() > 0) worst = std::max(worst, -state_.normal_velocity(c) / state_.approach_before());
      const double stored = -work.compression[c], e = problem.restitution[c];
      if (stored > 0) worst = std::max(worst, std::abs(work.restitution[c] - e * e * stored) / stored);
    }
    return worst;
  }

  MirtichOptions options_;
  ImpactState state_;
  Impact impact_;
  std::vector<double> normal_velocity_;  // nc, m/s
};

ContactMethod make(const MethodOptions&) { return make_mirtich({}); }

}  // namespace

void integrate_impact(const Matrix3d& K, const Vector3d& u, double mu, double e, double no_slip, double event_approach,
                      const MirtichOptions& options, Impact& impact) {
  impact = {};
  if (!(K(0, 0) > 0)) {
    impact.status = Status::singular;
    return;
  }
  if (u[0] < 0) Path(K, u, mu, e, event_approach, options, impact).follow(no_slip);
}

ContactMethod make_mirtich(const MirtichOptions& options) {
  return [mirtich = std::make_shared<Mirtich>(options)](const ContactProblem& problem, ContactSolution& solution) {
    mirtich->solve(problem, solution);
  };
}

MethodRow mirtich_row() {
  return {.name = "mirtich",
          .summary = "Stronge's energetic restitution integrated in impulse space, the fastest approach first",
          .source = "Mirtich 1996, Impulse-based Dynamic Simulation, ch. 3",
          .law = mirtich_law(),
          .solvers = {},
          .variants = {},
          .options = {},
          .make = make};
}

}  // namespace cb
