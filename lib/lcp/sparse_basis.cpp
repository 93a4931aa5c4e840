// Revised form of Lemke's dictionary for an expanded problem (lcp.h).
//
// Equations, scaled by pairs (R, C) and by the diagonal of A (X), all powers of two:
//   A x + B z = 0,   C x + D z + c z_0 - w = -q        (x shifted by A^-1 a, q condensed accordingly)
// A column of the dictionary needs one solve with the factorised basis and the exchanges since (product form): Lemke's
// method never asks for a row. Cost of a pivot: the triangular solves, C x, and one axpy of n for each exchange kept;
// linear along a stack.

#include "lcp/sparse_basis.h"

#include <algorithm>
#include <cmath>

namespace cb {

namespace {

double power_of_two_below_inverse_root(double x) { return x > 0 ? std::exp2(-std::round(0.5 * std::log2(x))) : 1.0; }

}  // namespace

bool SparseBasis::start(const LcpProblem& problem) {
  problem_ = &problem;
  n_ = problem.n();
  nx_ = problem.nx();
  padded_ = (n_ + 7) / 8 * 8;
  factorisations_ = 0;
  const auto& A = problem.A;
  if (!free_.factor({A.outerIndexPtr(), std::size_t(nx_) + 1}, {A.innerIndexPtr(), std::size_t(A.nonZeros())},
                    {A.valuePtr(), std::size_t(A.nonZeros())}))
    return false;
  residual_x_ = -problem.a;
  solve_free(residual_x_);
  condensed_load_ = problem.q;
  condensed_load_.noalias() += problem.C * residual_x_;
  return true;
}

// x <- A^-1 x, refined once.
void SparseBasis::solve_free(Eigen::VectorXd& x) {
  work_x_ = x;
  free_.solve({x.data(), std::size_t(nx_)});
  work_x_.noalias() -= problem_->A * x;
  free_.solve({work_x_.data(), std::size_t(nx_)});
  x += work_x_;
}

void SparseBasis::free_unknowns(const Eigen::VectorXd& z, Eigen::VectorXd& x) {
  x = -problem_->a;
  x.noalias() -= problem_->B * z;
  solve_free(x);
}

void SparseBasis::multiply(const Eigen::VectorXd& z, Eigen::VectorXd& w) {
  const auto& p = *problem_;
  residual_x_.resize(nx_);
  residual_x_.noalias() = p.B * z;
  solve_free(residual_x_);
  w.noalias() = p.D * z;
  w.noalias() -= p.C * residual_x_;
}

// |D| z + |C| |A^-1 |B| z|, z >= 0: what A^-1 cancels is not seen.
void SparseBasis::magnitudes(const Eigen::VectorXd& z, Eigen::VectorXd& terms) {
  const auto& p = *problem_;
  residual_x_.noalias() = p.B.cwiseAbs() * z;
  solve_free(residual_x_);
  residual_x_ = residual_x_.cwiseAbs();
  terms.noalias() = p.D.cwiseAbs() * z;
  terms.noalias() += p.C.cwiseAbs() * residual_x_;
}

void SparseBasis::set_scales(const Eigen::VectorXd& pair_rows, const Eigen::VectorXd& pair_columns) {
  const auto& p = *problem_;
  x_scale_.resize(nx_);
  for (int k = 0; k < nx_; ++k) x_scale_[k] = power_of_two_below_inverse_root(std::abs(p.A.coeff(k, k)));
  A_ = p.A;
  B_ = p.B;
  C_ = p.C;
  D_ = p.D;
  const auto rescale = [](SparseMatrix& matrix, const Eigen::VectorXd& rows, const Eigen::VectorXd& columns) {
    for (int j = 0; j < matrix.outerSize(); ++j)
      for (SparseMatrix::InnerIterator it(matrix, j); it; ++it) it.valueRef() *= rows[it.row()] * columns[j];
  };
  rescale(A_, x_scale_, x_scale_);
  rescale(B_, x_scale_, pair_columns);
  rescale(C_, pair_rows, x_scale_);
  rescale(D_, pair_rows, pair_columns);
}

void SparseBasis::restart() {
  basic_.resize(n_);
  row_.assign(2 * n_ + 1, -1);
  for (int i = 0; i < n_; ++i) row_[basic_[i] = i] = i;
  rhs_.setZero(padded_);
  change_.setZero(padded_);
  pair_.setZero(padded_);
  cover_.setZero(n_);
  load_.setZero(n_);
  updates_.resize(padded_);
  refactor_every_ = refactor_every;
  refactor();
}

bool SparseBasis::renew(const std::vector<int>& active, int out, const Eigen::VectorXd& q,
                        const Eigen::VectorXd& cover) {
  row_.assign(2 * n_ + 1, -1);
  for (int i = 0; i < n_; ++i) basic_[i] = i;
  for (const int i : active) basic_[i] = n_ + i;
  if (out >= 0) basic_[out] = 2 * n_;
  for (int i = 0; i < n_; ++i) row_[basic_[i]] = i;
  cover_ = cover;
  if (!refactor()) return false;
  set_load(q);
  return true;
}

bool SparseBasis::refactor() {
  updates_.clear();
  column_of_ = -1;
  reduced_row_.resize(n_);
  reduced_variable_.clear();
  // Rows whose slack is not basic; z_i meets row i, and z_0 the row of the pair that is out altogether.
  int unmatched = -1;
  for (int i = 0; i < n_; ++i) {
    reduced_row_[i] = -1;
    if (is_basic(i)) continue;
    reduced_row_[i] = nx_ + static_cast<int>(reduced_variable_.size());
    if (!is_basic(n_ + i)) unmatched = static_cast<int>(reduced_variable_.size());
    reduced_variable_.push_back(n_ + i);
  }
  if (unmatched >= 0) reduced_variable_[unmatched] = 2 * n_;

  matrix_.clear();
  for (int k = 0; k < nx_; ++k) {
    matrix_.put(A_, k);
    matrix_.put(C_, k, reduced_row_);
    matrix_.end_column();
  }
  for (const int variable : reduced_variable_) {
    if (variable == 2 * n_) {
      for (int i = 0; i < n_; ++i) matrix_.put(reduced_row_[i], cover_[i]);
    } else {
      matrix_.put(B_, variable - n_);
      matrix_.put(D_, variable - n_, reduced_row_);
    }
    matrix_.end_column();
  }
  reduced_.resize(matrix_.order());
  // Where the value of each basic variable is found.
  source_.resize(n_);
  for (int i = 0; i < n_; ++i) {
    const int variable = basic_[i];
    if (variable < n_)
      source_[i] = variable;
    else if (variable < 2 * n_)
      source_[i] = -1 - reduced_row_[variable - n_];
    else
      source_[i] = -1 - nx_ - unmatched;
  }
  ++factorisations_;
  basis_ = reduced_variable_.empty() ? &slack_basis_ : &other_basis_;
  return basis_->factor(matrix_.starts, matrix_.rows, matrix_.values);
}

// Basic variables y of  A x + B y_z = -b,  C x + D y_z + c y_0 - y_w = -p   for p = pair_rows and b = column
// `free_column` of B (none: -1), in the factorised basis, then brought to the present one.
void SparseBasis::solve_basis(const double* pair_rows, int free_column, double* out) {
  std::fill(reduced_.begin(), reduced_.end(), 0.0);
  if (free_column >= 0)
    for (SparseMatrix::InnerIterator it(B_, free_column); it; ++it) reduced_[it.row()] = -it.value();
  for (int i = 0; i < n_; ++i)
    if (reduced_row_[i] >= 0) reduced_[reduced_row_[i]] = -pair_rows[i];
  basis_->solve(reduced_);

  // Slacks from their own rows.
  slack_ = Eigen::Map<const Eigen::VectorXd>(pair_rows, n_);
  double* slack = slack_.data();
  for (int k = 0; k < nx_; ++k) {
    const double x = reduced_[k];
    if (x == 0) continue;
    for (SparseMatrix::InnerIterator it(C_, k); it; ++it) slack[it.row()] += it.value() * x;
  }
  for (std::size_t a = 0; a < reduced_variable_.size(); ++a) {
    const double y = reduced_[nx_ + a];
    if (y == 0) continue;
    if (reduced_variable_[a] == 2 * n_) {
      for (int i = 0; i < n_; ++i) slack[i] += cover_[i] * y;
    } else {
      for (SparseMatrix::InnerIterator it(D_, reduced_variable_[a] - n_); it; ++it) slack[it.row()] += it.value() * y;
    }
  }
  for (int i = 0; i < n_; ++i) out[i] = source_[i] >= 0 ? slack[source_[i]] : reduced_[-1 - source_[i]];
  std::fill(out + n_, out + padded_, 0.0);
  updates_.apply(out);
}

const double* SparseBasis::column(int variable) {
  if (variable == column_of_) return change_.data();
  if (variable == 2 * n_) {
    pair_.head(n_) = cover_;
  } else {
    pair_.setZero();
    if (variable < n_)
      pair_[variable] = -1;
    else
      for (SparseMatrix::InnerIterator it(D_, variable - n_); it; ++it) pair_[it.row()] = it.value();
  }
  solve_basis(pair_.data(), variable >= n_ && variable < 2 * n_ ? variable - n_ : -1, change_.data());
  column_of_ = variable;
  return change_.data();
}

bool SparseBasis::pivot(int row, int entering) {
  const double p = column(entering)[row], step = -rhs_[row] / p;
  if (p == 0 || !std::isfinite(step)) return false;
  rhs_ += change_ * step;
  rhs_[row] = step;
  updates_.push(change_.data(), row);
  row_[basic_[row]] = -1;
  basic_[row] = entering;
  row_[entering] = row;
  column_of_ = -1;
  if (updates_.exchanges() < refactor_every_) return true;

  // The fresh factors also say how much the exchanges have lost.
  if (!refactor()) return false;
  pair_ = rhs_;
  transform(load_.data(), rhs_.data());
  if ((pair_ - rhs_).lpNorm<Eigen::Infinity>() > drift_allowed) refactor_every_ = std::max(10, refactor_every_ / 2);
  return true;
}

void SparseBasis::set_load(const Eigen::VectorXd& q) {
  load_ = q;
  transform(q.data(), rhs_.data());
}

void SparseBasis::transform(const double* q, double* out) { solve_basis(q, -1, out); }

void SparseBasis::solve_active(const std::vector<int>& active, double* x, double* scratch) {
  pair_.setZero();
  for (const int i : active) pair_[i] = -x[i];
  transform(pair_.data(), scratch);
  for (const int i : active) x[i] = scratch[row_of(n_ + i)];
}

}  // namespace cb
