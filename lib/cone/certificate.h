#pragma once

#include <limits>
#include <span>
#include <vector>

#include "cone/cone_program.h"

namespace cb {

/// Velocities that belong to impulses r and multipliers eta of a cone program.
class ConeVelocities {
 public:
  /// v = v0 + M^-1 J^T r, u = J v + w, v_hat = v - M^-1 N^T eta, u_hat = J v_hat + w. Without eta (empty span) the
  /// second pair is a copy of the first.
  void evaluate(const ConeProgram& program, std::span<const double> r, std::span<const double> eta);
  /// What one rounding of each of its terms does to the velocity of a contact, over sqrt(w_c): into `rounding`. Entry
  /// by entry, eps (|J_c| (|v0| + sum of |M^-1 J_d^T| |r_d|) + |w_c|), eta like r_n.
  void bound_rounding(const ConeProgram& program, std::span<const double> r, std::span<const double> eta);
  std::vector<double> v, u, v_hat, u_hat;
  std::vector<double> rounding;  ///< nc, sqrt(J); empty until bound_rounding, and again after evaluate

 private:
  std::vector<double> scratch_, columns_;
};

/// What an answer (r, eta) to a cone program is worth; formed as a stranger would who knows only the problem.
/// y = u_hat + s d with the least s >= 0 that puts every y into the dual cone mu |y_t| <= y_n (no bound: s = 0, and
/// what is missing counts as infeasibility); gap = eta.u_n + s (kappa - d.r) + r.y. Where `velocities` bounds its
/// rounding, a velocity that is wrong by no more than `rounding_units` of that is not wrong, and gap_rounding is what
/// those errors can make of the gap, 1e-9 of its energy at most.
struct Certificate {
  double gap = std::numeric_limits<double>::infinity();            ///< J; of either sign by rounding
  double infeasibility = std::numeric_limits<double>::infinity();  ///< worst violation, each scaled by its terms
  double s = 0;                                                    ///< m/s
  double size = 0;                                                 ///< sqrt(J): what the problem is about
  double gap_rounding = 0;                                         ///< J
};
/// `q`: J v0 + w, 3 nc.
Certificate certify(const ConeProgram& program, std::span<const double> r, std::span<const double> eta,
                    const ConeVelocities& velocities, std::span<const double> q, double rounding_units = 0);

/// -: what rounding may excuse of a gap, as a fraction of the program's energy: multipliers that grow without bound
/// would excuse anything.
inline constexpr double most_excused = 1e-9;
/// -: gap as a fraction of the program's energy up to which an answer is as good as any.
inline constexpr double exact_gap = 1e-14;

}  // namespace cb
