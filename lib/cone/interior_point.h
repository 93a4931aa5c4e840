#pragma once

#include <span>
#include <vector>

#include "cone/cone_program.h"
#include "cone/kkt_system.h"

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
Certificate certify(const ConeProgram& program, std::span<const double> r, std::span<const double> eta,
                    const ConeVelocities& velocities, std::span<const double> q, double rounding_units = 0);

/// -: what rounding may excuse of a gap, as a fraction of the program's energy: multipliers that grow without bound
/// would excuse anything.
inline constexpr double most_excused = 1e-9;

/// Solves cone programs (cone_program.h) by a primal-dual interior point method that names the active constraints,
/// and a semismooth Newton method that then solves the equalities of that guess to rounding. Owns its scratch.
class InteriorPoint {
 public:
  explicit InteriorPoint(const ConeOptions& options = {}) : options_(options) {}

  /// From a cold start. Fills `solution` with the best iterate in every ending; status tells which.
  void solve(const ConeProgram& program, ConeSolution& solution);
  /// Newton's method from the r, eta and s in `solution`, which is overwritten by the best iterate met. Returns false
  /// where it came to no point whose gap and infeasibility are at rounding; `solution` is then not to be used.
  /// Gives up after more than `patience` steps in a row that do not halve the natural map.
  /// bold: takes every Newton step; careful: goes back from one that made matters worse and strengthens the proximal
  /// term.
  enum class Steps { bold, careful };
  bool polish(const ConeProgram& program, ConeSolution& solution, int patience, Steps steps);

  ConeOptions& options() { return options_; }
  KktSystem& system() { return kkt_; }

 private:
  void prepare(const ConeProgram& program);
  void scale(const ConeProgram& program);
  double last_bits(const ConeProgram& program);
  Certificate checked(const ConeProgram& program, ConeSolution& x);
  double newton_terms(const ConeProgram& program, const ConeSolution& x);
  bool factor();
  void factor_border(const ConeProgram& program);
  bool newton_step(const ConeProgram& program, double border_diagonal, double border_rhs, bool border, double ds_known);

  ConeOptions options_;
  KktSystem kkt_;
  ConeVelocities velocities_;
  std::vector<double> q_;  // J v0 + w
  // Impulses are of the size R / sqrt(w), multipliers eta U / sqrt(w), velocities y U sqrt(w), u_n R sqrt(w): with
  // w U / R where impulses meet velocities, and w R / U where eta does, all are of the size of sqrt(R U).
  double size_ = 0;   // sqrt(J), sqrt(R U)
  double ratio_ = 1;  // R / U
  std::vector<double> w_r_, w_eta_, r_zero_;
  double mean_weight_ = 0;  // of w_r
  double proximal_ = 0;
  double products_ = 0;    // J, sum of |r.y|, |eta u_n|, and kappa times what y is short of the dual cone
  std::vector<double> d_;  // row of the bound
  // Terms of a Newton step: dr = c_r - G (J dw + d ds), deta = c_eta - D N dv.
  std::vector<double> G_, D_, c_r_, c_eta_;
  std::vector<double> h1_, h2_, g1_, g2_, t_, Mg_, Jdw_, Jdv_, dr_, deta_;
  double ds_ = 0;
  double border_pivot_ = 0;    // of the bound's row but for its diagonal, and
  bool border_ready_ = false;  // are it, g1_, g2_ and t_ those of the present factors?
  bool s_active_ = false;
  // Interior point iterate beyond r, eta, s.
  std::vector<double> y_, a_, dy_, da_, scaling_, damping_;
  ConeSolution best_, trial_, iterate_;
};

}  // namespace cb
