#pragma once

#include <span>

#include "dynamics/kinematics.h"

namespace cb {

/// Inverse dynamics: the generalised forces that give a tree the accelerations qdd.
class NewtonEuler {
 public:
  /// `qdd`, `tau`: of this tree, tree.nv (m/s^2, rad/s^2; N, N m; of a free joint the acceleration of the centre of
  /// mass and the angular one, world). `force`: on each body of the model at its centre of mass, N, world; empty: none.
  /// Poses and twists of the links must be those of q and qd. Overwrites tau.
  void inverse_dynamics(const Model& model, const Tree& tree, const State& state, std::span<const Vec3> force,
                        std::span<const double> qdd, std::span<double> tau);

 private:
  std::vector<LinkFrame> frames_;
  std::vector<Vec3> linear_, angular_;     // accelerations of the links
  std::vector<Vec3> wrench_f_, wrench_n_;  // of joint on link, about its centre of mass
};

/// The accelerations of a joint's link beyond those of its parent carried along: those quadratic in the velocities.
/// (linear of the centre of mass, angular)
Vec6 bias_acceleration(const Joint& joint, const LinkFrame& frame, const State& state);

}  // namespace cb
