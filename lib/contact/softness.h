#pragma once

#include <Eigen/Core>

#include "contact/witness.h"

namespace cb {

/// How a contact gives way: R = diag(n, t, t), 1/kg.
struct Regularisation {
  double n, t;
};
/// R of a contact with W_ii = `W`, 1/kg.
///   sap:     R_n = max(beta^2 w / (4 pi^2), compliance),   R_t = sigma w
///   mujoco:  R_n = (1 - d) / d W_nn,                       R_t = R_n / impratio
/// w = |W_ii| / 3 (Frobenius); of a limit W_nn.
Regularisation regularisation(const Eigen::Matrix3d& W, bool limit, const Softness& softness);

}  // namespace cb
