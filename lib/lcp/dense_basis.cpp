// Dense dictionary with principal exchange steps (Cottle, Pang, Stone 1992, sec. 2.3), columns contiguous.
//
// Exchange of basic row r with nonbasic column s, p = T_rs:
//   T_rs <- 1 / p;  T_rj <- -T_rj / p;  T_is <- T_is / p;  T_ij <- T_ij - T_is T_rj / p     (i != r, j != s)
// Columns with T_rj = 0 are left alone: at the start of a sparse problem that is most of them.
// Fails (returns false) on a pivot that is zero or not finite; the table is then unchanged.

#include "lcp/dense_basis.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "linalg/pack.h"

namespace cb {

namespace {

/// Numbers that a column is padded to a multiple of.
constexpr int granule = 8;
static_assert(granule % pack_size == 0);

/// All columns but s, in which the pivot column stands, of a table of L times `granule` numbers a column. The pivot
/// column stays in registers while the others stream by.
template <int L>
void eliminate(double* table, int columns, int r, int s, const double* pivot_column, double inverse) {
  constexpr int V = L * granule / pack_size;
  Pack c[V];
  for (int v = 0; v < V; ++v) load_aligned(pivot_column + pack_size * v, c[v]);
  for (int j = 0; j < columns; ++j) {
    if (j == s) continue;
    double* column = table + std::size_t(j) * (V * pack_size);
    const double f = column[r] * inverse;
    if (f == 0) continue;
    for (int v = 0; v < V; ++v) {
      Pack x;
      load_aligned(column + pack_size * v, x);
      x -= c[v] * f;
      store_aligned(x, column + pack_size * v);
    }
    column[r] = -f;
  }
}

constexpr std::array eliminate_in_registers{eliminate<1>, eliminate<2>, eliminate<3>, eliminate<4>,
                                            eliminate<5>, eliminate<6>, eliminate<7>, eliminate<8>};

/// The same for columns of any length.
void eliminate_any(double* table, int columns, int r, int s, const double* pivot_column, double inverse, int padded) {
  for (int j = 0; j < columns; ++j) {
    if (j == s) continue;
    double* column = table + std::size_t(j) * padded;
    const double f = column[r] * inverse;
    if (f == 0) continue;
    for (int i = 0; i < padded; i += granule)
      for (int k = i; k < i + granule; k += pack_size) {
        Pack x, c;
        load_aligned(column + k, x);
        load_aligned(pivot_column + k, c);
        x -= c * f;
        store_aligned(x, column + k);
      }
    column[r] = -f;
  }
}

/// out += f column
void add(const double* column, double f, double* out, int padded) {
  for (int k = 0; k < padded; k += pack_size) {
    Pack x, c;
    load_aligned(out + k, x);
    load_aligned(column + k, c);
    x += c * f;
    store_aligned(x, out + k);
  }
}

}  // namespace

void DenseBasis::start(const LcpProblem& problem, const PairScales& scales) {
  problem_ = &problem;
  scales_ = &scales;
  n_ = problem.n();
  padded_ = (n_ + granule - 1) / granule * granule;
  factorisations_ = 0;
  rhs_.resize(padded_);
  basic_.resize(n_);
  place_.resize(2 * n_ + 1);
}

// T = R M C; place_ has the column of a nonbasic variable.
void DenseBasis::restart() {
  const auto& M = problem_->M;
  table_.resize(Eigen::Index(padded_) * (n_ + 1));
  rhs_.setZero();
  for (int j = 0; j < n_; ++j) {
    double* column = table_.data() + std::size_t(j) * padded_;
    Eigen::Map<Eigen::VectorXd>(column, n_) = M.col(j).cwiseProduct(scales_->rows) * scales_->columns[j];
    std::fill(column + n_, column + padded_, 0.0);
    basic_[j] = j;
    place_[j] = -1 - j;
    place_[n_ + j] = j;
  }
  place_[2 * n_] = n_;
  std::fill_n(table_.data() + std::size_t(n_) * padded_, padded_, 0.0);
}

// The basic z (and z_0) enter for the nonbasic w by the largest pivots left, whatever pair they are of.
bool DenseBasis::renew(const std::vector<int>& active, int out, const Eigen::VectorXd& q,
                       const Eigen::VectorXd& cover) {
  ++factorisations_;
  entering_.clear();
  leaving_ = active;
  for (const int i : active) entering_.push_back(n_ + i);
  if (out >= 0) {
    entering_.push_back(2 * n_);
    leaving_.push_back(out);
  }
  restart();
  set_cover(cover);
  set_load(q);
  while (!entering_.empty()) {
    double largest = 0;
    std::size_t best_column = 0, best_row = 0;
    for (std::size_t j = 0; j < entering_.size(); ++j) {
      const double* change = column_of(entering_[j]);
      for (std::size_t i = 0; i < leaving_.size(); ++i) {
        const double size = std::abs(change[row_of(leaving_[i])]);
        if (!(size > largest)) continue;
        largest = size;
        best_column = j;
        best_row = i;
      }
    }
    if (largest == 0 || !pivot(row_of(leaving_[best_row]), entering_[best_column])) return false;
    entering_.erase(entering_.begin() + static_cast<std::ptrdiff_t>(best_column));
    leaving_.erase(leaving_.begin() + static_cast<std::ptrdiff_t>(best_row));
  }
  return true;
}

bool DenseBasis::pivot(int row, int entering) {
  const int s = place_[entering];
  double* column = table_.data() + std::size_t(s) * padded_;
  const double p = column[row], inverse = 1 / p;
  if (p == 0 || !std::isfinite(inverse)) return false;

  const auto granules = static_cast<std::size_t>(padded_ / granule);
  if (granules <= eliminate_in_registers.size())
    eliminate_in_registers[granules - 1](table_.data(), n_ + 1, row, s, column, inverse);
  else
    eliminate_any(table_.data(), n_ + 1, row, s, column, inverse, padded_);
  // The right-hand side as one more column: the entering variable moves to -rhs_r / p.
  const double step = -rhs_[row] * inverse;
  for (int i = 0; i < padded_; i += pack_size) {
    Pack x, c;
    load_aligned(rhs_.data() + i, x);
    load_aligned(column + i, c);
    x += c * step;
    store_aligned(x, rhs_.data() + i);
    c *= inverse;
    store_aligned(c, column + i);
  }
  rhs_[row] = step;
  column[row] = inverse;

  const int leaving = basic_[row];
  basic_[row] = entering;
  place_[entering] = -1 - row;
  place_[leaving] = s;
  return true;
}

void DenseBasis::set_load(const Eigen::VectorXd& q) { transform(q.data(), rhs_.data()); }

void DenseBasis::set_cover(const Eigen::VectorXd& cover) {
  transform(cover.data(), table_.data() + std::size_t(place_[2 * n_]) * padded_);
}

// Values of the basic variables where all nonbasic ones are zero and q is `q`.
void DenseBasis::transform(const double* q, double* out) const {
  std::fill(out, out + padded_, 0.0);
  for (int i = 0; i < n_; ++i)
    if (is_basic(i)) out[row_of(i)] += q[i];
  // A nonbasic w_i appears in the dictionary as w_i - q_i.
  for (int i = 0; i < n_; ++i)
    if (!is_basic(i) && q[i] != 0) add(column_of(i), -q[i], out, padded_);
}

void DenseBasis::solve_active(const std::vector<int>& active, double* x, double* scratch) {
  std::fill(scratch, scratch + padded_, 0.0);
  for (const int i : active) add(column_of(i), x[i], scratch, padded_);
  for (const int i : active) x[i] = scratch[row_of(n_ + i)];
}

void DenseBasis::multiply(const Eigen::VectorXd& z, Eigen::VectorXd& w) {
  w.setZero(n_);
  for (int j = 0; j < n_; ++j)
    if (z[j] != 0) w.noalias() += problem_->M.col(j) * z[j];
}

void DenseBasis::magnitudes(const Eigen::VectorXd& z, Eigen::VectorXd& terms) {
  terms.setZero(n_);
  for (int j = 0; j < n_; ++j)
    if (z[j] != 0) terms += problem_->M.col(j).cwiseAbs() * z[j];
}

// A singular set shows in w.
double DenseBasis::solve_at(const std::vector<int>& active, Eigen::VectorXd& z, Eigen::VectorXd& w) {
  const auto& M = problem_->M;
  const auto m = static_cast<int>(active.size());
  active_matrix_.resize(m, m);
  active_error_.resize(m);
  for (int j = 0; j < m; ++j) {
    for (int i = 0; i < m; ++i) active_matrix_(i, j) = M(active[i], active[j]);
    active_error_[j] = -problem_->q[active[j]];
  }
  if (m > 0) {
    active_factor_.compute(active_matrix_);
    active_z_ = active_factor_.solve(active_error_);
    active_error_.noalias() -= active_matrix_ * active_z_;
    active_correction_ = active_factor_.solve(active_error_);
    active_z_ += active_correction_;
  }
  z.setZero(n_);
  w = problem_->q;
  for (int j = 0; j < m; ++j) {
    z[active[j]] = active_z_[j];
    w.noalias() += M.col(active[j]) * active_z_[j];
  }
  return 0;
}

}  // namespace cb
