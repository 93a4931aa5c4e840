#pragma once

#include <Eigen/Core>

namespace cb {

/// What an impact has come to: r (N s: n, t1, t2), the normal work since its phase began and the work of friction, J.
struct ImpactPoint {
  Eigen::Vector3d r = Eigen::Vector3d::Zero();
  double work = 0, friction = 0;
};

/// Local errors that a step may make.
struct StepErrors {
  double velocity;           ///< m/s
  double work;               ///< J
  double friction_relative;  ///< -: of the work of friction so far, beyond `work`
  double turn;               ///< rad, of the direction of sliding
};

/// Steps of length h along sliding whose direction turns, (3) of stronge_impact.cpp, over sigma (kg m/s per m/s):
///   dr_n = s,   dr_t = -mu u_t,   dW = s u_n,   dF = -mu s^2,   u = start + K (r - from.r),   s = |u_t|.
class SlidingStep {
 public:
  /// K: 3 x 3, 1/kg, which is referred to.
  SlidingStep(const Eigen::Matrix3d& K, double mu, const StepErrors& allowed)
      : K_(K), column_n_(K.col(0)), column_1_(-mu * K.col(1)), column_2_(-mu * K.col(2)), mu_(mu), allowed_(allowed) {}

  /// One step from `from`, where the velocity is `start` (m/s), into y; returns the local error over what is allowed.
  /// By Dormand and Prince's method, order 5(4).
  double explicit_step(const Eigen::Vector3d& start, double h, const ImpactPoint& from, ImpactPoint& y) const;
  /// By RODAS3, order 3(2), L-stable.
  double stiff_step(const Eigen::Vector3d& start, double h, const ImpactPoint& from, ImpactPoint& y) const;

 private:
  double over_allowed(const Eigen::Vector3d& du, double work, double friction, double slip, const ImpactPoint& y) const;

  const Eigen::Matrix3d& K_;
  const Eigen::Vector3d column_n_, column_1_, column_2_;  // what s, u_t1, u_t2 of (3) do to u: K times 1, -mu, -mu
  const double mu_;
  const StepErrors allowed_;
};

}  // namespace cb
