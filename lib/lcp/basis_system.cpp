// Bases of an LCP, each factorised from the original matrices.
//
// Cost of one basis on m bodies with n contacts (the expanded form of a contact problem; nx ~ m): reading off the
// slacks takes O(nx n) at worst and one pass over C, O(n), where a contact touches two bodies. What is factorised has
// order nx + |a|. Of a, the pairs that D couples (friction and its bound) are eliminated among themselves at a fixed
// cost each; the rest cannot be more than nx without making the basis singular, since they meet through A^-1, whose
// order is nx. That is Lloyd's saving, got from the ordering of a sparse factorisation: O(n + m^3), and less along a
// chain of bodies.

#include "lcp/basis_system.h"

#include <algorithm>
#include <cmath>

namespace cb {

namespace {

double power_of_two_below_inverse_root(double x) { return x > 0 ? std::exp2(-std::round(0.5 * std::log2(x))) : 1.0; }

void rescale(SparseMatrix& matrix, const Eigen::VectorXd& rows, const Eigen::VectorXd& columns) {
  for (int j = 0; j < matrix.outerSize(); ++j)
    for (SparseMatrix::InnerIterator it(matrix, j); it; ++it) it.valueRef() *= rows[it.row()] * columns[j];
}

}  // namespace

void BasisSystem::start(const LcpProblem& problem, const PairScales& scales) {
  n_ = problem.n();
  nx_ = problem.nx();
  x_scale_.resize(nx_);
  for (int k = 0; k < nx_; ++k) x_scale_[k] = power_of_two_below_inverse_root(std::abs(problem.A.coeff(k, k)));
  if (problem.expanded) {
    A_ = problem.A;
    B_ = problem.B;
    C_ = problem.C;
    D_ = problem.D;
    a_ = problem.a.cwiseProduct(x_scale_);
  } else {
    A_.resize(0, 0);
    B_.resize(0, n_);
    C_.resize(n_, 0);
    D_ = problem.M.sparseView();
    a_.resize(0);
  }
  q_ = problem.q.cwiseProduct(scales.rows);
  rescale(A_, x_scale_, x_scale_);
  rescale(B_, x_scale_, scales.columns);
  rescale(C_, scales.rows, x_scale_);
  rescale(D_, scales.rows, scales.columns);
  cover_.setOnes(n_);
  reduced_row_.assign(n_, -1);
}

void BasisSystem::column(int i, Eigen::VectorXd& free_load, Eigen::VectorXd& pair_load) const {
  free_load = B_.col(i);
  pair_load = D_.col(i);
}

void BasisSystem::product(const Eigen::VectorXd& z, Eigen::VectorXd& free_load, Eigen::VectorXd& pair_load) const {
  free_load = B_ * z;
  pair_load = D_ * z;
}

bool BasisSystem::factor(const std::vector<int>& active, int out) {
  active_ = active;
  out_ = out;
  std::fill(reduced_row_.begin(), reduced_row_.end(), -1);
  int order = nx_;
  for (const int i : active_) reduced_row_[i] = order++;
  if (out_ >= 0) reduced_row_[out_] = order++;

  matrix_.clear();
  for (int k = 0; k < nx_; ++k) {
    matrix_.put(A_, k);
    matrix_.put(C_, k, reduced_row_);
    matrix_.end_column();
  }
  for (const int j : active_) {
    matrix_.put(B_, j);
    matrix_.put(D_, j, reduced_row_);
    matrix_.end_column();
  }
  if (out_ >= 0) {
    for (const int i : active_) matrix_.put(reduced_row_[i], cover_[i]);
    matrix_.put(reduced_row_[out_], cover_[out_]);
    matrix_.end_column();
  }
  return lu_.factor(matrix_.starts, matrix_.rows, matrix_.values);
}

// change_ <- right_ - G u_
void BasisSystem::residual() {
  change_ = right_;
  for (std::size_t j = 0; j < u_.size(); ++j)
    for (int e = matrix_.starts[j]; e < matrix_.starts[j + 1]; ++e)
      change_[matrix_.rows[e]] -= matrix_.values[e] * u_[j];
}

double BasisSystem::solve(const Eigen::VectorXd& free_load, const Eigen::VectorXd& pair_load) {
  right_.resize(matrix_.order());
  for (int k = 0; k < nx_; ++k) right_[k] = -free_load[k];
  for (int i = 0; i < n_; ++i)
    if (reduced_row_[i] >= 0) right_[reduced_row_[i]] = -pair_load[i];
  u_ = right_;
  lu_.solve(u_);
  residual();
  lu_.solve(change_);
  for (std::size_t j = 0; j < u_.size(); ++j) u_[j] += change_[j];
  residual();
  double left = 0;
  for (const double e : change_) left = std::max(left, std::abs(e));

  // Slacks from their own rows.
  z_.setZero(n_);
  w_ = pair_load;
  for (std::size_t a = 0; a < active_.size(); ++a) z_[active_[a]] = u_[nx_ + a];
  z0_ = out_ >= 0 ? u_.back() : 0;
  for (int k = 0; k < nx_; ++k)
    for (SparseMatrix::InnerIterator it(C_, k); it; ++it) w_[it.row()] += it.value() * u_[k];
  for (const int j : active_)
    for (SparseMatrix::InnerIterator it(D_, j); it; ++it) w_[it.row()] += it.value() * z_[j];
  if (out_ >= 0) w_ += z0_ * cover_;
  for (int i = 0; i < n_; ++i)
    if (reduced_row_[i] >= 0) w_[i] = 0;
  return left;
}

}  // namespace cb
