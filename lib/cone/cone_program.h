#pragma once

#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "linalg/block_matrix.h"

namespace cb {

/// Convex program over second-order cones, in sparse variables (v and r):
///   minimise    1/2 v.M v + w.r  with v = v0 + M^-1 J^T r   (v0 = v_minus)
///   subject to  N v + w_n + slack >= 0              (where `bounded_below`; N: first row of each band)
///               N v + w_n = 0                       (where `fixed` says so, in place of >= 0)
///               r_i in K_i = { |r_t| <= mu_i r_n }   (band i of J; mu_i = 0 leaves r_n >= 0, r_t = 0)
///               d . r <= kappa                      (where kappa is finite; d . r is the sum of share_i r_n,i)
/// In terms of r alone the objective is 1/2 r.W r + r.(J v0 + w) up to a constant, W = J M^-1 J^T.
/// One program is one island: what does not touch is solved apart. Views only: the caller keeps the data alive.
struct ConeProgram {
  const BlockDiagonalMatrix* M = nullptr;
  const BlockCholesky* factor = nullptr;  ///< of M
  const BandMatrix* J = nullptr;
  const std::vector<double>* v0 = nullptr;      ///< nv
  const std::vector<double>* offset = nullptr;  ///< 3 nc, w
  const std::vector<double>* mu = nullptr;      ///< nc
  const std::vector<double>* weight = nullptr;  ///< nc, a typical diagonal entry of W_ii, 1/kg, > 0: scales tolerances
  bool bounded_below = false;                   ///< N v + w_n >= 0 enforced?
  const std::vector<double>* slack = nullptr;   ///< nc, m/s, >= 0: how far N v + w_n may fall below 0; null: 0
  const std::vector<char>* fixed = nullptr;     ///< nc, with bounded_below: N v + w_n = 0 enforced? null: nowhere
  double kappa = std::numeric_limits<double>::infinity();  ///< N s, >= 0
  const std::vector<double>* share = nullptr;  ///< nc, d: 1 where r_n counts in the sum, else 0; null: all do
  /// N s: impulses beside which an answer's are not large; infinite: the velocities' scale is theirs. Where bodies
  /// slide at 1 m/s and hardly approach, impulses are 1e-8 of what their velocities could make of them.
  double impulse_size = std::numeric_limits<double>::infinity();
  /// sqrt(J): what approached before; beside more an approach is not small. Infinite: the velocities' scale, J v0 + w.
  double before = std::numeric_limits<double>::infinity();
  double gap = 1e-12;  ///< J, that an answer may have. Looser: fewer iterations of the dense method, rougher answers

  int nc() const { return J->bands(); }
  int nv() const { return M->order(); }
  bool has_eta() const { return bounded_below; }
  bool is_fixed(int c) const { return fixed != nullptr && (*fixed)[c]; }
  double slack_of(int c) const { return slack == nullptr ? 0 : (*slack)[c]; }
  double share_of(int c) const { return share == nullptr ? 1 : (*share)[c]; }
  bool has_bound() const { return kappa < std::numeric_limits<double>::infinity(); }
};

/// From best to worst.
enum class ConeStatus { solved, nonconverged, singular, not_finite };

struct ConeOptions {
  /// -: scaled infeasibility at which the iteration may stop.
  double feasibility = 1e-11;
  /// Interior-point iterations before `nonconverged`.
  int iteration_limit = 100;
  /// -: fraction of the longest step inside the cones that is taken. Nearer to 1: fewer iterations until the iterates
  /// leave the central path.
  double step_fraction = 0.98;
  /// -: proximal term of an interior point step, as a fraction of W_ii: bounds the scaling matrices. It does not
  /// perturb the answer; larger: slower at the end.
  double regularisation = 1e-9;
  /// -: along the tangents that term falls with mu > 1 by this power. Smaller: strong friction ends inaccurate; larger:
  /// the scaling matrices lose their bound. (Measured: bench/random_problems.)
  double tangent_exponent = 0.75;
  /// Interior point iterations without a better iterate before the best is returned.
  int patience = 15;
  /// Newton steps of one polish (or of one first try) before it is given up.
  int polish_limit = 12;
  /// Newton steps in a row without progress (a halved natural map) before it is given up: from a guess, and from an
  /// interior point iterate, where either the active constraints are named rightly or another iteration is cheaper.
  int guess_patience = 3;
  int iterate_patience = 2;
  /// Steps of the careful polish that has the last word where the interior point method stalls, and its first proximal
  /// term (it falls by tens while that goes well).
  int careful_limit = 40;
  double careful_proximal = 1e-3;
  /// Newton steps from proximal point to proximal point (proximal_points.h).
  int points_limit = 1500;
  /// -: complementarity over energy at which the first polish is tried; each later one at a hundredth.
  double polish_from = 1e-5;
  /// -: regularisation of the equalities of Newton's method, as a fraction of W_ii; r is not unique, and this picks the
  /// answer next to the iterate. It does not perturb the answer (it is proximal); larger: more steps, better pivots.
  double proximal = 1e-8;
  /// -: norm of the natural map over sqrt(energy) that counts as rounding: Newton's method then ends.
  double rounding = 1e-13;
  /// Roundings, of everything that a contact's velocity is the sum of, that an error may have and still be none.
  double rounding_units = 8;
  /// Mean number of rows of a block of M from which on systems are factored by blocks, not entry by entry.
  double least_block = 3;
};

struct ConeSolution {
  ConeStatus status = ConeStatus::nonconverged;
  std::vector<double> r;    ///< 3 nc
  std::vector<double> eta;  ///< nc, multipliers of N v + w_n >= 0 (of either sign where fixed); zero without
  double s = 0;             ///< multiplier of the bound
  int iterations = 0;
  double gap = std::numeric_limits<double>::infinity();  ///< J, checked: see Certificate
  double infeasibility = std::numeric_limits<double>::infinity();
};

}  // namespace cb
