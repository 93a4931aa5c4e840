#pragma once

#include <Eigen/Cholesky>
#include <span>
#include <vector>

#include "dynamics/kinematics.h"

namespace cb {

/// Forward dynamics: the accelerations that forces give a tree.
class ArticulatedBody {
 public:
  /// The articulated inertias, of the pose alone. Poses of the links must be those of q. `added`: of each rate, kg m^2
  /// or kg, to the diagonal of M, but for a free joint; empty: none. With h d there a damper's torque -d qd counts as
  /// that of the rates at the end of a step h.
  void factor(const Model& model, const Tree& tree, const State& state, std::span<const double> added = {});
  /// With the inertias of factor(), of the same tree in the same pose. `tau`: generalised forces at the joints, `qdd`:
  /// result; both of this tree, tree.nv (units and meaning as in NewtonEuler). `force`: on each body of the model at
  /// its centre of mass, N, world; empty: none. Twists of the links must be those of qd. `turning`: with centrifugal,
  /// Coriolis and gyroscopic forces?
  void accelerations(const Tree& tree, const State& state, std::span<const Vec3> force, std::span<const double> tau,
                     std::span<double> qdd, bool turning = true);
  /// Both.
  void forward_dynamics(const Model& model, const Tree& tree, const State& state, std::span<const Vec3> force,
                        std::span<const double> tau, std::span<double> qdd);

 private:
  struct Link {
    Mat6 I;                   // articulated inertia
    Vec6 p;                   // wrench that it needs at rest: bias and forces
    Vec6 bias;                // acceleration quadratic in the velocities
    Vec6 U;                   // I S
    double D;                 // S . I S, and what is added
    double u;                 // tau - S . p
    Vec6 a;                   // acceleration
    Eigen::LLT<Mat6> factor;  // of a free joint: of I
  };
  std::vector<LinkFrame> frames_;
  std::vector<Link> links_;
};

}  // namespace cb
