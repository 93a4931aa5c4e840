// Newton's restitution with Coulomb friction, contact by contact.
//
// Problem (nc contacts, nv velocities; contact/problem.h). The contacts are visited in the order of the problem, again
// and again, until a whole sweep meets none with u_n < -tolerance. One that approaches is an impact of its own: with
// u (m/s) the contact's velocity at that moment, K = W_cc (3 x 3, 1/kg) and r (N s, rows n, t1, t2),
//     u+ = u + K r,        u_n+ = -e u_n.                                                                    (1)
// u_n is the velocity at that moment and not the one before the event: each impact is one of Newton's, and the normal
// impulse alone changes the kinetic energy by -(1 - e^2) u_n^2 / (2 K_nn) <= 0, however many sweeps there are.
//
// `uncapped`: friction mu r_n against the slip before the impact, d = u_t / |u_t|, whatever becomes of the slip:
//     r = j (1, -mu d),    j = -(1 + e) u_n / (K_nn - mu K_nt.d).                                            (2)
//   (1) holds with friction acting, as in the source, which solves for all impulses at once; for a sphere K_nt = 0 and
//   j is the frictionless one. May gain energy: solid sphere, e = 0, no spin, rho = |u_t| / |u_n|:
//     KE+/KE- = 1 + (3.5 mu^2 - 1 - 2 mu rho) / (1 + rho^2).
//   Where the denominator of (2) is not positive (jamming) no impulse fulfils (1) and (2); the contact then gets the
//   frictionless impulse.
// `stick-tested`: the impulse that stops the slip, r = -K^-1 (u + e u_n e_n), if it lies in the cone; else sliding
//   friction against the slip d that the frictionless impulse leaves,
//     r = r_0 + tau (K_nt.d / K_nn, -d),   r_0 = -(1 + e) u_n / K_nn e_n,                                    (3)
//   with the largest tau for which |r_t| <= mu r_n, the slip along d does not reverse, and (4) holds.
//   Both are r_0 + s p with (K p)_n = 0: (1) holds for every s, and s = 0 never gains energy. With e > 0 and K_nt != 0
//   the full s may (Kane and Levinson 1985); s is then cut back to where the energy is that before the impact,
//     s^2 p.K p / 2 + s p.u_0 <= (1 - e^2) u_n^2 / (2 K_nn),   u_0 = u + K r_0,                              (4)
//   a quadratic with one root s >= 0. So no impact of this variant gains energy, hence no event does.
//
// Source: J. K. Hahn, Realistic animation of rigid bodies, SIGGRAPH 1988, section 3 (equations not numbered there; his
// code is lost, see docs/methods/newton.md).
// Differences: 1. contacts one after another rather than a tree of collisions; 2. the test for sticking can be left
// out (`uncapped`); 3. the bound (4).
//
// Fails: sweep_limit reached with a contact still approaching -> nonconverged with the impulses so far; NaN or infinity
// in the data or on the way -> not_finite, no impulse; M not positive definite -> singular, no impulse.

#include "methods/newton.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "linalg/stop.h"

namespace cb {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// The largest s >= 0 with a s^2 / 2 + b s <= c, for a > 0 and c >= 0.
double energy_bound(double a, double b, double c) {
  const double root = std::sqrt(b * b + 2 * a * c);
  return b > 0 ? 2 * c / (b + root) : (root - b) / a;
}

Vector3d uncapped_impulse(const Matrix3d& K, const Vector3d& u, double mu, double e, double no_slip, double jam) {
  const double slip = u.tail<2>().norm();
  if (mu > 0 && slip > no_slip) {
    const Vector3d direction(1, -mu * u[1] / slip, -mu * u[2] / slip);
    const double k = K.row(0).dot(direction);
    if (k > jam * K(0, 0)) return -(1 + e) * u[0] / k * direction;
  }
  return {-(1 + e) * u[0] / K(0, 0), 0, 0};
}

Vector3d stick_tested_impulse(const Matrix3d& K, const Vector3d& u, double mu, double e, double no_slip) {
  const Vector3d r0(-(1 + e) * u[0] / K(0, 0), 0, 0);
  if (!(mu > 0)) return r0;
  const Vector3d u0 = u + K * r0;
  const double slip = u0.tail<2>().norm();
  if (!(slip > no_slip)) return r0;
  const double allowed = (1 - e * e) * u[0] * u[0] / (2 * K(0, 0));

  // Friction at fixed u_n+ moves the slip through the Schur complement of K_nn.
  const Vector2d k_nt = K.col(0).tail<2>();
  const Eigen::Matrix2d S = K.bottomRightCorner<2, 2>() - k_nt * k_nt.transpose() / K(0, 0);
  const double determinant = S(0, 0) * S(1, 1) - S(0, 1) * S(1, 0);
  Vector3d p;
  if (determinant > 1e-14 * S.trace() * S.trace()) {
    p.tail<2>() = -Vector2d(S(1, 1) * u0[1] - S(0, 1) * u0[2], S(0, 0) * u0[2] - S(1, 0) * u0[1]) / determinant;
    p[0] = -k_nt.dot(p.tail<2>()) / K(0, 0);
    if (p.tail<2>().norm() <= mu * (r0[0] + p[0])) {
      const double s = std::min(1.0, energy_bound(p.dot(K * p), p.dot(u0), allowed));
      return r0 + s * p;
    }
  }

  const Vector2d d = u0.tail<2>() / slip;
  const double coupling = k_nt.dot(d) / K(0, 0);
  p << coupling, -d;
  const double stiffness = d.dot(S * d);
  if (!(stiffness > 0)) return r0;  // friction along d moves nothing: no work, no slip to stop
  double tau = std::min(slip / stiffness, energy_bound(stiffness, p.dot(u0), allowed));
  if (mu * coupling < 1) tau = std::min(tau, mu * r0[0] / (1 - mu * coupling));
  return r0 + tau * p;
}

class Newton {
 public:
  explicit Newton(const NewtonOptions& options) : options_(options) {}

  void solve(const ContactProblem& problem, ContactSolution& solution) {
    solution.clear();
    const int nc = problem.nc();
    solution.size = 3 * nc;
    solution.impulse.assign(3 * nc, 0.0);
    solution.status = state_.start(problem, options_.tolerances, solution.reason);
    if (solution.status != Status::ok) return;

    // A sweep that meets no approach ends the event, once round-off is out of v.
    bool settled = nc == 0, fresh = true;
    while (!settled && solution.iterations < options_.sweep_limit) {
      poll_stop();
      ++solution.iterations;
      settled = !sweep(problem, solution.impulse);
      if (settled && !fresh) {
        state_.restart(solution.impulse);
        fresh = true;
        settled = !any_approach();
      } else {
        fresh = false;
      }
    }
    if (!settled) {
      state_.restart(solution.impulse);
      settled = !any_approach();
    }

    if (!state_.finite()) {
      solution.impulse.assign(3 * nc, 0.0);
      solution.status = Status::not_finite;
      solution.reason = "the impulses grew beyond all bounds";
    } else if (!settled) {
      solution.status = Status::nonconverged;
      solution.reason = "contacts still approach after " + std::to_string(solution.iterations) + " sweeps";
    }
    solution.claimed_residual = state_.approach_left();
  }

 private:
  /// One visit to every contact; true where one approached.
  bool sweep(const ContactProblem& problem, std::vector<double>& impulse) {
    bool approached = false;
    for (int c = 0; c < problem.nc(); ++c) {
      if (!(state_.normal_velocity(c) < -state_.approach_tolerance(c))) continue;
      approached = true;
      const Vector3d u = state_.velocity(c);
      const double mu = problem.mu[c], e = problem.restitution[c], no_slip = state_.slip_rounding(c);
      const Vector3d r = options_.variant == NewtonOptions::Variant::uncapped
                             ? uncapped_impulse(state_.K(c), u, mu, e, no_slip, options_.jam)
                             : stick_tested_impulse(state_.K(c), u, mu, e, no_slip);
      state_.apply(c, r);
      for (int i = 0; i < 3; ++i) impulse[3 * c + i] += r[i];
    }
    return approached;
  }

  bool any_approach() const {
    for (int c = 0; c < state_.nc(); ++c)
      if (!(state_.normal_velocity(c) >= -state_.approach_tolerance(c))) return true;
    return false;
  }

  NewtonOptions options_;
  ImpactState state_;
};

ContactMethod make(const MethodOptions& options) {
  NewtonOptions newton;
  if (options.variant == "stick-tested") newton.variant = NewtonOptions::Variant::stick_tested;
  return make_newton(newton);
}

}  // namespace

ContactMethod make_newton(const NewtonOptions& options) {
  return [newton = std::make_shared<Newton>(options)](const ContactProblem& problem, ContactSolution& solution) {
    newton->solve(problem, solution);
  };
}

MethodRow newton_row() {
  return {.name = "newton",
          .summary = "Newton's restitution with Coulomb friction, one contact after another until none approaches",
          .source = "Hahn 1988, Realistic animation of rigid bodies",
          .law = newton_law(),
          .solvers = {},
          .variants = {"uncapped", "stick-tested"},
          .options = {},
          .make = make};
}

}  // namespace cb
