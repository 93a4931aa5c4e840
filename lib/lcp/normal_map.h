#pragma once

#include <Eigen/Core>
#include <array>
#include <climits>
#include <vector>

#include "lcp/basis.h"
#include "lcp/complementary_path.h"

namespace cb {

/// A point of the normal map F_+(x) = M x_+ + q + x - x_+ (path.cpp), scaled, and the active set that a basis is
/// brought to: what crash and path share.
struct NormalMap {
  /// An exchange needs a pivot above these, pass by pass, -; smaller: near-singular bases are entered.
  std::array<double, 2> smallest_pivots{1e-2, 1e-7};
  int block_exchanges = 4;  ///< exchanges of two pairs at once between fresh factorisations

  const PairScales* scales = nullptr;
  Eigen::VectorXd z;         ///< n: the point at hand
  Eigen::VectorXd F;         ///< n: M z + q of the z that was evaluated last
  std::vector<char> want;    ///< n: z_i is to be basic
  std::vector<int> waiting;  ///< pairs that reach() has left where they were
  int tried = 0;             ///< solves for columns by reach()
  int tries = INT_MAX;       ///< beyond which it leaves off

  /// F at `point` for load q; returns the merit there, the norm of the Fischer-Burmeister residual.
  double evaluate(Basis& basis, const Eigen::VectorXd& q, const Eigen::VectorXd& point);
  /// Principal exchanges to the basis of `want`, as far as there are pivots for it.
  void reach(Basis& basis, PivotCount& pivots);

 private:
  bool out_of_budget(const Basis& basis, const PivotCount& pivots);
  int exchange_one(Basis& basis, int i, double smallest);
  int exchange_two(Basis& basis, int i, double smallest);

  Eigen::VectorXd product_;  // n
  int blocks_ = 0;
};

/// `form` with eps added to the diagonal of its scaled matrix: every basis of a monotone one is then regular.
void perturb_diagonal(const LcpProblem& form, const PairScales& scales, double eps, LcpProblem& perturbed);

/// Clipped values of the z that are basic; the others are zero.
void read_point(const Basis& basis, Eigen::VectorXd& z);

}  // namespace cb
