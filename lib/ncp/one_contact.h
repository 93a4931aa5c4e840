#pragma once

#include <Eigen/Core>

namespace cb {

/// One contact alone: u = W r + q with W symmetric, W_nn > 0 (rows n, t1, t2; one_contact.cpp). What W and mu say by
/// themselves is found once, for as many q as come.
class OneContact {
 public:
  /// W: 1/kg; mu: 0: r_t = 0.
  OneContact(const Eigen::Matrix3d& W, double mu);
  /// The exact answer of Coulomb's and Signorini's law: r, N s. q: m/s, velocity without this contact's impulse.
  Eigen::Vector3d solve(const Eigen::Vector3d& q) const;
  /// The same where it opens or sticks; where it slips the impulse on the cone with u_n = 0 that leaves the least
  /// kinetic energy, found by bisection over its direction. Not maximum dissipation: friction is not against the slip
  /// where the normal impulse depends on its direction.
  Eigen::Vector3d bisect(const Eigen::Vector3d& q) const;
  const Eigen::Matrix3d& W() const { return W_; }
  double mu() const { return mu_; }

 private:
  struct Tangential;
  bool sticks(const Tangential& at, Eigen::Vector3d& r) const;
  bool stops_where_it_moves(const Tangential& at, Eigen::Vector2d& r_t) const;
  Eigen::Vector3d slips(const Tangential& at) const;

  Eigen::Matrix3d W_;
  double mu_ = 0;
  Eigen::Matrix2d A_, to_stick_;  // 1/kg; -A^-1, kg
  Eigen::Vector2d slope_;         // -: of r_n over r_t where u_n = 0
  bool can_stick_ = false;        // is A regular?
  Eigen::Vector2d first_, second_;
  double a_[2], s_[2];  // A and slope in these principal axes; a: 0 along an axis in which nothing moves the contact
};

}  // namespace cb
