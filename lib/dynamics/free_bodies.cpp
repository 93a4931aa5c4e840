#include "dynamics/free_bodies.h"

#include <cmath>

namespace cb {

namespace {

/// Turning a sphere or a cube changes neither its inertia nor its spin.
bool round(const Vec3& inertia) { return inertia[0] == inertia[1] && inertia[1] == inertia[2]; }

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

double accelerate(const Model& model, const std::vector<Vec3>& force, double h, State& state) {
  double energy = 0;
  for (std::size_t b = 0; b < model.bodies.size(); ++b) {
    const Body& body = model.bodies[b];
    if (body.tree >= 0) continue;
    Eigen::Map<Vec3> v(&state.v[6 * b]), w(&state.v[6 * b + 3]);
    const Vec3 dv = h / body.mass * force[b];
    energy += std::abs(force[b].dot(v)) * h + 0.5 * body.mass * dv.squaredNorm();
    v += dv;
    if (!round(body.inertia) && !w.isZero(0)) {
      const Quat& q = state.pose[b].q;
      const Vec3 w_B = q.conjugate() * w;
      const Vec3 torque = body.inertia.cwiseProduct(w_B).cross(w_B);
      w += h * (q * torque.cwiseQuotient(body.inertia));
    }
  }
  return energy;
}

}  // namespace cb
