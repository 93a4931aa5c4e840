#pragma once

#include <span>
#include <vector>

#include "contact/islands.h"
#include "contact/problem.h"
#include "contact/softness.h"
#include "linalg/convex_search.h"

namespace cb {

/// The contacts of a regularised convex program: impulses r = P_R(-R^-1 u), P_R the projection on the friction cone K
/// in the norm of R, and the cost l(u) = 1/2 r.R r that they are the negative gradient of (soft.cpp). With slip s =
/// |u_t|, t = u_t / s, D = R_n + mu^2 R_t:
///   parts, u_n >= mu s:              r = 0
///   sticks, s / R_t <= -mu u_n / R_n: r = -R^-1 u
///   slides:                          r = (mu s - u_n) / D (1, -mu t)
class SoftContacts {
 public:
  /// Finds R, and islands. `weight`: nc, 1/kg, all > 0.
  void describe(const ContactProblem& problem, const BlockCholesky& factor, const std::vector<double>& weight,
                const Softness& softness);
  /// Velocities before are `u_minus` (3 nc, m/s). `touching`, -: of the fastest of its island, up to which a contact
  /// counts as sticking where it is linearised.
  void begin(const std::vector<double>& u_minus, double touching);
  /// r (3 nc, N s) at velocities u (3 nc, m/s); returns the sum of l, J.
  double impulses(const std::vector<double>& u, std::vector<double>& r) const;
  /// The same law as r = P_K(r - (u + R r) / w), at any u and r, linearised: r = a - G (change of u), P_K the
  /// projection on K. a: 3 nc, N s; G: 9 nc, kg, symmetric, positive semidefinite. Where r is that of u, so is a, and G
  /// is -dr/du. Where |u + R r| is no more than touching the contact counts as sticking: G jumps where u = 0, and a
  /// stack at rest would wake up one box a step.
  void linearise(const std::vector<double>& u, const std::vector<double>& r, std::vector<double>& G,
                 std::vector<double>& a) const;
  /// Slope and curvature of the sum of l at u + alpha du along du, J.
  Along along(const std::vector<double>& u, const std::vector<double>& du, double alpha) const;
  /// r <- P_K(r)
  void project(std::vector<double>& r) const;
  /// -: the worst natural map of the law at impulses r after which contacts move with u_plus, contact by contact over
  /// its size: what the contact itself is about; where `open` says what rounding leaves of velocities (m/s, nc), no
  /// less than its island moves, and than `open` is the accepted 1e-9 of.
  double residual(const std::vector<double>& r, const std::vector<double>& u_plus, const std::vector<double>& u_minus,
                  std::span<const double> open = {}) const;
  const Islands& islands() const { return islands_; }

 private:
  struct Contact {
    Regularisation R;
    double mu, w;  // -, 1/kg
  };
  static Eigen::Vector3d impulse(const Contact& c, const Eigen::Vector3d& u);
  static double curvature(const Contact& c, const Eigen::Vector3d& u, const Eigen::Vector3d& du);

  std::vector<Contact> contacts_;
  Islands islands_;
  std::vector<double> touching_;  // per island, m/s
  std::vector<Eigen::Matrix3d> W_;
};

}  // namespace cb
