#include "contact/softness.h"

#include <algorithm>
#include <cmath>

namespace cb {

Regularisation regularisation(const Eigen::Matrix3d& W, bool limit, const Softness& softness) {
  if (softness.rule == Softness::Rule::mujoco) {
    const double R_n = (1 - softness.impedance) / softness.impedance * W(0, 0);
    return {R_n, R_n / softness.impratio};
  }
  const double w = limit ? W(0, 0) : W.norm() / 3, beta = softness.beta;
  return {std::max(beta * beta * w / (4 * M_PI * M_PI), softness.compliance), softness.sigma * w};
}

}  // namespace cb
