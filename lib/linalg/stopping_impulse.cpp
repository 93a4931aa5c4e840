// Least impulses that stop contacts.
//
// Problem: r with J_s (M^-1 J_s^T r) = -u on the rows s, scaled to unit mobility: with A = L^-1 J_s^T diag(1/sqrt(w)),
// A^T A x = -u. From the factorisation of A: A^T y = -u, then A x = y, both of least norm. A residual is of the size of
// rounding in A, not in A^T A. Source: Golub, Van Loan, Matrix Computations, section 5.5.
#include "linalg/stopping_impulse.h"

#include <algorithm>
#include <cmath>

namespace cb {

bool StoppingImpulse::prepare(const BlockDiagonalMatrix& M, const BandMatrix& J, const BlockCholesky& factor,
                              std::span<const double> weight, std::span<const char> in_set, int rows) {
  const int nc = J.bands(), nv = M.order();
  if (nc == 0 || rows * nc > dense_limit || nv > dense_limit) return false;
  rows_ = rows;
  scale_.resize(nc);
  A_.setZero(nv, rows * nc);
  for (int c = 0; c < nc; ++c) {
    scale_[c] = in_set[c] ? 1 / std::sqrt(weight[c]) : 0;
    for (int e = J.band[c]; e < J.band[c + 1]; ++e)
      A_.block(M.first[J.block[e]], rows * c, J.entry(e).cols(), rows) =
          scale_[c] * J.entry(e).topRows(rows).transpose();
  }
  for (int b = 0; b < M.blocks(); ++b) factor.solve_lower_in_place(b, A_, M.first[b]);
  decomposition_.setThreshold(rank_threshold);
  decomposition_.compute(A_);
  return true;
}

void StoppingImpulse::load(std::span<const double> u) {
  const auto nc = static_cast<int>(scale_.size());
  u_.resize(rows_ * nc);
  for (int c = 0; c < nc; ++c)
    for (int i = 0; i < rows_; ++i) u_[rows_ * c + i] = scale_[c] * u[3 * c + i];
  y_ = decomposition_.transpose().solve(u_);
}

void StoppingImpulse::correct(std::span<const double> u, std::span<double> r) {
  load(u);
  x_ = decomposition_.solve(y_);
  for (int c = 0; c < static_cast<int>(scale_.size()); ++c)
    for (int i = 0; i < rows_; ++i) r[3 * c + i] -= scale_[c] * x_[rows_ * c + i];
}

void StoppingImpulse::least_velocity(std::span<const double> u, const BlockCholesky& factor, std::span<double> v) {
  load(u);
  std::copy(y_.begin(), y_.end(), v.begin());
  factor.solve_upper_in_place(v);
}

}  // namespace cb
