#pragma once

#include <span>
#include <vector>

#include "contact/problem.h"
#include "contact/softness.h"

namespace cb {

/// The contacts of a regularised convex program: impulses r = P(-R^-1 u), P the projection on the friction cone
/// in the norm of R, and the cost l(u) = 1/2 r.R r that they are the negative gradient of (soft.cpp). With slip s =
/// |u_t|, t = u_t / s, D = R_n + mu^2 R_t and d = (1, -mu t):
///   parts, u_n >= mu s:              r = 0
///   sticks, s / R_t <= -mu u_n / R_n: r = -R^-1 u                          G = R^-1
///   slides:                          r = (mu s - u_n) / D d                G = d d^T / D + mu r_n / s (I - t t^T)
/// G = -dr/du, positive semidefinite.
class SoftContacts {
 public:
  /// Finds R. `weight`: nc, 1/kg, all > 0.
  void describe(const ContactProblem& problem, const BlockCholesky& factor, const std::vector<double>& weight,
                const Softness& softness);
  /// r (3 nc, N s) at velocities u (3 nc, m/s); returns the sum of l, J.
  double impulses(const std::vector<double>& u, std::vector<double>& r) const;
  /// G (9 nc, kg) at u. `touching`: what is at most this far from parting (m/s) counts as sticking. G jumps where u =
  /// 0, and a stack at rest would wake up one box a step.
  void curvatures(const std::vector<double>& u, double touching, std::vector<double>& G) const;
  /// Slope and curvature of the sum of l at u + alpha du along du, J.
  struct Along {
    double slope = 0, curvature = 0;
  };
  Along along(const std::vector<double>& u, const std::vector<double>& du, double alpha) const;
  /// -: the worst natural map of the law at impulses r after which contacts move with u_plus, contact by contact over
  /// its size: what the contact itself is about; where `open` says what rounding leaves of velocities (m/s, nc), no
  /// less than the island moves, and than `open` is the accepted 1e-9 of.
  double residual(const std::vector<double>& r, const std::vector<double>& u_plus, const std::vector<double>& u_minus,
                  std::span<const double> open = {}) const;

 private:
  struct Contact {
    Regularisation R;
    double mu, w;  // -, 1/kg
  };
  static Eigen::Vector3d impulse(const Contact& c, const Eigen::Vector3d& u);
  static Eigen::Matrix3d curvature(const Contact& c, const Eigen::Vector3d& u);
  static Eigen::Matrix3d stiffness(const Contact& c);

  std::vector<Contact> contacts_;
  std::vector<Eigen::Matrix3d> W_;
};

}  // namespace cb
