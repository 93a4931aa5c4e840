#include "dynamics/free_bodies.h"

#include <cmath>

namespace cb {

namespace {

/// Turning a sphere or a cube changes neither its inertia nor its spin.
bool round(const Vec3& inertia) { return inertia[0] == inertia[1] && inertia[1] == inertia[2]; }

/// Solves I (w_1 - w_0) = h I w_m x w_m for w_1 by Newton's method from w_0. Where the body turns by too much to tell
/// which way, w_0: its energy and momentum are then still those it had.
Vec3 midpoint_spin(const Vec3& inertia, const Vec3& w_0, double h) {
  constexpr int newton_steps = 12;     // five or six do
  constexpr double converged = 4e-16;  // -: |last change of w_m| <= converged |w_m|
  constexpr double settled = 1e-12;    // -: the same after the last step; rounding keeps it from less
  const auto skew = [](const Vec3& x) {
    Mat3 S;
    S << 0, -x.z(), x.y(), x.z(), 0, -x.x(), -x.y(), x.x(), 0;
    return S;
  };
  const Mat3 I = inertia.asDiagonal();
  Vec3 w_m = w_0;
  double change = HUGE_VAL;
  for (int i = 0; i < newton_steps && change > converged * w_m.norm(); ++i) {
    const Vec3 spin = inertia.cwiseProduct(w_m);
    const Vec3 residual = inertia.cwiseProduct(w_m - w_0) - (h / 2) * spin.cross(w_m);
    const Vec3 step = (I - (h / 2) * (skew(spin) - skew(w_m) * I)).partialPivLu().solve(residual);
    w_m -= step;
    change = step.norm();
  }
  return change <= settled * w_m.norm() ? Vec3(2 * w_m - w_0) : w_0;
}

/// Change of the spin in h seconds, in the axes of the body; in steps of at most half a radian.
Vec3 spin_change(const Vec3& inertia, const Vec3& w_0, double h, Gyroscopic gyroscopic) {
  constexpr double angle = 0.5;  // rad a step
  constexpr double most = 100;   // steps; a body that turns further in h keeps the spin it has
  if (gyroscopic == Gyroscopic::explicit_euler) return h * inertia.cwiseProduct(w_0).cross(w_0).cwiseQuotient(inertia);
  const double steps = std::ceil(h * w_0.norm() / angle);
  if (!(steps <= most)) return Vec3::Zero();
  Vec3 w = w_0;
  for (int i = 0; i < steps; ++i) w = midpoint_spin(inertia, w, h / steps);
  return w - w_0;
}

}  // namespace

double kinetic_energy(const Model& model, const State& state) {
  double energy = 0;
  for (std::size_t b = 0; b < model.bodies.size(); ++b) {
    const Body& body = model.bodies[b];
    const Eigen::Map<const Vec3> v(&state.v[6 * b]), w(&state.v[6 * b + 3]);
    energy += 0.5 * body.mass * v.squaredNorm();
    if (round(body.inertia))
      energy += 0.5 * body.inertia[0] * w.squaredNorm();
    else
      energy += 0.5 * body.inertia.dot((state.pose[b].q.conjugate() * w).cwiseAbs2());
  }
  return energy;
}

double potential_energy(const Model& model, const State& state, const Vec3& g) {
  double energy = 0;
  for (std::size_t b = 0; b < model.bodies.size(); ++b) energy -= model.bodies[b].mass * g.dot(state.pose[b].p);
  for (const Tree& tree : model.trees)
    for (const Joint& joint : tree.joints)
      if (joint.stiffness != 0) energy += 0.5 * joint.stiffness * std::pow(state.q[joint.q] - joint.rest, 2);
  return energy;
}

double accelerate(const Model& model, const std::vector<Vec3>& force, double h, State& state, Gyroscopic gyroscopic) {
  constexpr double unresolved = 1e-17;  // rad
  double energy = 0;
  for (std::size_t b = 0; b < model.bodies.size(); ++b) {
    const Body& body = model.bodies[b];
    if (body.tree >= 0) continue;
    Eigen::Map<Vec3> v(&state.v[6 * b]), w(&state.v[6 * b + 3]);
    const Vec3 dv = h / body.mass * force[b];
    energy += std::abs(force[b].dot(v)) * h + 0.5 * body.mass * dv.squaredNorm();
    v += dv;
    // A spin that turns the body by less than rounding does not change.
    if (!round(body.inertia) && h * w.lpNorm<1>() > unresolved) {
      const Quat& q = state.pose[b].q;
      // The change alone is turned back: q is unit to rounding, and w would take up its error at each step.
      w += q * spin_change(body.inertia, q.conjugate() * w, h, gyroscopic);
    }
  }
  return energy;
}

}  // namespace cb
