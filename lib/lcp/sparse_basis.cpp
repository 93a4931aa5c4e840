// Revised form of the dictionary of an expanded problem (lcp.h).
//
// Equations, scaled by pairs (R, C) and by the diagonal of A (X), all powers of two:
//   A x + B z = 0,   C x + D z + c z_0 - w = -q        (x shifted by A^-1 a, q condensed accordingly)
// A column of the dictionary needs one solve with the factorised basis and the exchanges since (product form): pivoting
// methods never ask for a row. Cost of a pivot: the triangular solves, C x, and one axpy of n for each exchange kept;
// linear along a stack.
//
// Cost of factorising a basis on m bodies with n contacts (the expanded form of a contact problem; nx ~ m): reading off
// the slacks takes O(nx n) at worst and one pass over C, O(n), where a contact touches two bodies. What is factorised
// has order nx + |a|. Of a, the pairs that D couples (friction and its bound) are eliminated among themselves at a
// fixed cost each; the rest cannot be more than nx without making the basis singular, since they meet through A^-1,
// whose order is nx. That is Lloyd's saving, got from the ordering of a sparse factorisation: O(n + m^3), and less
// along a chain of bodies.

#include "lcp/sparse_basis.h"

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

void SparseBasis::start(const LcpProblem& problem, const PairScales& scales) {
  problem_ = &problem;
  scales_ = &scales;
  n_ = problem.n();
  nx_ = problem.nx();
  padded_ = (n_ + 7) / 8 * 8;
  factorisations_ = 0;
  refactor_every_ = refactor_every;
  x_scale_.resize(nx_);
  for (int k = 0; k < nx_; ++k) x_scale_[k] = power_of_two_below_inverse_root(std::abs(problem.A.coeff(k, k)));
  A_ = problem.A;
  B_ = problem.B;
  C_ = problem.C;
  D_ = problem.D;
  rescale(A_, x_scale_, x_scale_);
  rescale(B_, x_scale_, scales.columns);
  rescale(C_, scales.rows, x_scale_);
  rescale(D_, scales.rows, scales.columns);
  for (Eigen::VectorXd* x : {&rhs_, &change_, &pair_}) x->setZero(padded_);
  for (Eigen::VectorXd* x : {&cover_, &load_}) x->setZero(n_);
  basic_.resize(n_);
  updates_.resize(padded_);
  // Answers depend on the problem alone, not on those that were solved before.
  for (SparseLu* lu : {&free_, &slack_basis_, &other_basis_}) lu->forget_pivots();
}

bool SparseBasis::eliminate() {
  const auto& A = problem_->A;
  if (!free_.factor({A.outerIndexPtr(), std::size_t(nx_) + 1}, {A.innerIndexPtr(), std::size_t(A.nonZeros())},
                    {A.valuePtr(), std::size_t(A.nonZeros())}))
    return false;
  product_x_ = -problem_->a;
  solve_free(product_x_);
  eliminated_load_ = problem_->q;
  eliminated_load_.noalias() += problem_->C * product_x_;
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
  product_x_.resize(nx_);
  product_x_.noalias() = p.B * z;
  solve_free(product_x_);
  w.noalias() = p.D * z;
  w.noalias() -= p.C * product_x_;
}

// |D| z + |C| |A^-1 |B| z|, z >= 0: what A^-1 cancels is not seen.
void SparseBasis::magnitudes(const Eigen::VectorXd& z, Eigen::VectorXd& terms) {
  const auto& p = *problem_;
  product_x_.noalias() = p.B.cwiseAbs() * z;
  solve_free(product_x_);
  product_x_ = product_x_.cwiseAbs();
  terms.noalias() = p.D.cwiseAbs() * z;
  terms.noalias() += p.C.cwiseAbs() * product_x_;
}

void SparseBasis::restart() {
  for (Eigen::VectorXd* x : {&rhs_, &change_, &pair_, &cover_, &load_}) x->setZero();
  refactor_every_ = refactor_every;
  take_up({}, -1);
  factorise();
}

bool SparseBasis::renew(const std::vector<int>& active, int out, const Eigen::VectorXd& q,
                        const Eigen::VectorXd& cover) {
  take_up(active, out);
  cover_ = cover;
  if (!factorise()) return false;
  set_load(q);
  return true;
}

void SparseBasis::take_up(const std::vector<int>& active, int out) {
  place_.assign(2 * n_ + 1, 0);
  for (int i = 0; i < n_; ++i) basic_[i] = i;
  for (const int i : active) basic_[i] = n_ + i;
  if (out >= 0) basic_[out] = 2 * n_;
  for (int i = 0; i < n_; ++i) place_[basic_[i]] = -1 - i;
}

// Rows whose slack is not basic, and the variables beyond the free ones: z_i meets row i, and z_0 the row of the pair
// that is out altogether. Returns where among those variables z_0 stands, or -1.
int SparseBasis::list_reduced() {
  int unmatched = -1;
  reduced_row_.resize(n_);
  reduced_variable_.clear();
  for (int i = 0; i < n_; ++i) {
    reduced_row_[i] = -1;
    if (is_basic(i)) continue;
    reduced_row_[i] = nx_ + static_cast<int>(reduced_variable_.size());
    if (!is_basic(n_ + i)) unmatched = static_cast<int>(reduced_variable_.size());
    reduced_variable_.push_back(n_ + i);
  }
  if (unmatched >= 0) reduced_variable_[unmatched] = 2 * n_;
  return unmatched;
}

bool SparseBasis::factorise() {
  updates_.clear();
  column_of_ = -1;
  const int unmatched = list_reduced();
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
  read_basic(pair_rows, out);
  updates_.apply(out);
}

// Basic variables from the solution in reduced_, slacks from their own rows.
void SparseBasis::read_basic(const double* pair_rows, double* out) {
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
  place_[basic_[row]] = 0;
  basic_[row] = entering;
  place_[entering] = -1 - row;
  column_of_ = -1;
  if (updates_.exchanges() < refactor_every_) return true;

  // The fresh factors also say how much the exchanges have lost.
  if (!factorise()) return false;
  pair_ = rhs_;
  solve_basis(load_.data(), -1, rhs_.data());
  if ((pair_ - rhs_).lpNorm<Eigen::Infinity>() > drift_allowed) refactor_every_ = std::max(10, refactor_every_ / 2);
  return true;
}

void SparseBasis::set_load(const Eigen::VectorXd& q) {
  load_ = q;
  solve_basis(q.data(), -1, rhs_.data());
}

void SparseBasis::solve_active(const std::vector<int>& active, double* x, double* scratch) {
  pair_.setZero();
  for (const int i : active) pair_[i] = -x[i];
  solve_basis(pair_.data(), -1, scratch);
  for (const int i : active) x[i] = scratch[row_of(n_ + i)];
}

// errors <- right - G reduced_, of the matrix G that is factorised.
void SparseBasis::equation_errors(const std::vector<double>& right, std::vector<double>& errors) const {
  errors = right;
  for (std::size_t j = 0; j < reduced_.size(); ++j)
    for (int e = matrix_.starts[j]; e < matrix_.starts[j + 1]; ++e)
      errors[matrix_.rows[e]] -= matrix_.values[e] * reduced_[j];
}

// The basic z of an exact answer would leave no error in the rows of the reduced system; w is zero there.
double SparseBasis::solve_at(const std::vector<int>& active, Eigen::VectorXd& z, Eigen::VectorXd& w) {
  take_up(active, -1);
  if (!factorise()) return HUGE_VAL;
  pair_.head(n_) = problem_->q.cwiseProduct(scales_->rows);
  right_.resize(matrix_.order());
  for (int k = 0; k < nx_; ++k) right_[k] = -(problem_->a[k] * x_scale_[k]);
  for (int i = 0; i < n_; ++i)
    if (reduced_row_[i] >= 0) right_[reduced_row_[i]] = -pair_[i];
  reduced_ = right_;
  basis_->solve(reduced_);
  equation_errors(right_, errors_);
  basis_->solve(errors_);
  for (std::size_t j = 0; j < reduced_.size(); ++j) reduced_[j] += errors_[j];
  equation_errors(right_, errors_);
  double left = 0;
  for (const double e : errors_) left = std::max(left, std::abs(e));

  read_basic(pair_.data(), change_.data());
  z.setZero(n_);
  w.setZero(n_);
  for (int i = 0; i < n_; ++i) {
    if (is_basic(i))
      w[i] = change_[i] / scales_->rows[i];
    else
      z[i] = change_[i] * scales_->columns[i];
  }
  return left;
}

}  // namespace cb
