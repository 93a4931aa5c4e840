#pragma once

#include <vector>

#include "dynamics/model.h"

namespace cb {

/// 1/2 v.M v over all bodies, J.
double kinetic_energy(const Model& model, const State& state);
/// -sum of m g.p, J, for gravity g in m/s^2; zero at the world's origin.
double potential_energy(const Model& model, const State& state, const Vec3& g);

/// How Euler's equations of a turning body are stepped.
enum class Gyroscopic {
  implicit,       ///< midpoint rule in the body's axes: kinetic energy and the size of I w stay, to rounding
  explicit_euler  ///< as the paper: energy grows by about (h |w|)^2 a step where the body tumbles
};

/// One step of the velocities of the bodies that are no links: explicit Euler under forces at the centres of mass,
///   v += h F / m,
/// and Euler's equations in the axes of the body,
///   I (w_1 - w_0) = h I w_m x w_m,   w_m = (w_0 + w_1) / 2   (implicit)   or   w_0 (explicit_euler).
/// With w_m both w.I w and |I w|^2 are kept exactly; the direction of I w in the world is right to first order in h.
/// `force`: per body, N, world. Positions are not touched. Returns the sum of |F.v| h + |dv|^2 m / 2, an upper bound
/// on the energy that the forces put in, J.
double accelerate(const Model& model, const std::vector<Vec3>& force, double h, State& state,
                  Gyroscopic gyroscopic = Gyroscopic::implicit);

}  // namespace cb
