#pragma once

#include <Eigen/Core>
#include <vector>

#include "lcp/lcp.h"

namespace cb {

/// rho_i > 0 (unit of w_i / z_i): the size of w_i that one unit of z_i makes. It makes the two halves of a pair
/// comparable: z_i sqrt(rho_i) and w_i / sqrt(rho_i) have the unit sqrt(z w) for all pairs.
///   rho_i = |M_ii|                                      where that is more than zero_diagonal of the row's coupling
///   rho_i = max_j |M_ij M_ji| / rho_j                    elsewhere, over the pairs j of the first kind
///   rho_i = max_j max(|M_ij|, |M_ji|)^2 / rho_j          where all those products are zero
///   rho_i = 1                                            where nothing couples
/// In the expanded form M_ii is estimated as D_ii - sum_k C_ik B_ki / A_kk: it is a scale, nothing more.
/// For A-P's LCP this gives W_ii for impulses, and 1 / W_ii for the slip bounds, whose diagonal is zero, whatever mu.
/// Rows R and columns C for pivoting, powers of two (no rounding): 1 / sqrt(rho_i) for pairs of the first kind, else
/// what makes the largest coupling in the row, or in the column, about one. They differ where M_ij and M_ji do (mu and
/// 0).
struct PairScales {
  Eigen::VectorXd rho, rows, columns;             ///< n
  Eigen::VectorXd loop, along_row, along_column;  ///< n, scratch
  std::vector<int> cursor;                        ///< nx, scratch
};
void pair_scales(const LcpProblem& problem, PairScales& scales);

/// |M_ii| below this fraction of sqrt of (row maximum x column maximum) counts as zero, -.
inline constexpr double zero_diagonal = 1e-12;

/// Scales of a problem and its load, the free unknowns eliminated.
struct ScaledLoad {
  PairScales scales;
  Eigen::VectorXd root;            ///< n: sqrt(rho_i)
  Eigen::VectorXd original;        ///< n, in the problem's units
  Eigen::VectorXd q;               ///< n: original_i rows_i / size
  double size = 1;                 ///< max_i |original_i| / root_i, or 1
  double judged = 1;               ///< what residuals are fractions of: `size`, or LcpProblem::size where that is more
  const LcpProblem* of = nullptr;  ///< whose size and groups count
  /// From scales and original, for `problem`, which is referred to. False where they are not finite.
  bool set(const LcpProblem& problem);
};

}  // namespace cb
