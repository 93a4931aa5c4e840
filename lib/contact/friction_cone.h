#pragma once

#include <Eigen/Core>
#include <cmath>

namespace cb {

/// Projection on the cone |x_t| <= mu x_n, rows n, t1, t2.
inline Eigen::Vector3d project_on_cone(const Eigen::Vector3d& x, double mu) {
  const double t = std::sqrt(x[1] * x[1] + x[2] * x[2]);
  if (mu * t <= -x[0]) return Eigen::Vector3d::Zero();  // first: with mu = 0 what pulls is not within
  if (t <= mu * x[0]) return x;
  const double n = (x[0] + mu * t) / (1 + mu * mu);
  const double scale = t > 0 ? mu * n / t : 0;
  return {n, scale * x[1], scale * x[2]};
}

}  // namespace cb
