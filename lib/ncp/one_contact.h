#pragma once

#include <Eigen/Core>

namespace cb {

/// One contact alone: u = W r + q with W symmetric, W_nn > 0 (rows n, t1, t2; one_contact.cpp).
struct OneContact {
  Eigen::Matrix3d W;  ///< 1/kg
  Eigen::Vector3d q;  ///< m/s, velocity without this contact's impulse
  double mu = 0;      ///< 0: r_t = 0
};

/// The exact answer of Coulomb's and Signorini's law: r, N s.
Eigen::Vector3d solve_one_contact(const OneContact& contact);
/// The same where it opens or sticks; where it slips the impulse on the cone with u_n = 0 that leaves the least kinetic
/// energy, found by bisection over its direction. Not maximum dissipation: friction is not against the slip where the
/// normal impulse depends on its direction.
Eigen::Vector3d bisect_one_contact(const OneContact& contact);

}  // namespace cb
