#pragma once

#include <vector>

#include "dynamics/model.h"

namespace cb {

/// 1/2 v.M v over all bodies, J.
double kinetic_energy(const Model& model, const State& state);
/// -sum of m g.p, J, for gravity g in m/s^2; zero at the world's origin.
double potential_energy(const Model& model, const State& state, const Vec3& g);

/// One explicit Euler step of the velocities of the bodies that are no links, under forces at the centres of mass and
/// Euler's equations:
///   v += h F / m,   w += h I^-1 (I w x w)   (axes of the body)
/// `force`: per body, N, world. Positions are not touched. Returns the sum of |F.v| h + |dv|^2 m / 2, an upper bound
/// on the energy that the forces put in, J.
double accelerate(const Model& model, const std::vector<Vec3>& force, double h, State& state);

}  // namespace cb
