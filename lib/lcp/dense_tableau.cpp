// Dense dictionary with principal exchange steps (Cottle, Pang, Stone 1992, sec. 2.3), columns contiguous.
//
// Exchange of basic row r with nonbasic column s, p = T_rs:
//   T_rs <- 1 / p;  T_rj <- -T_rj / p;  T_is <- T_is / p;  T_ij <- T_ij - T_is T_rj / p     (i != r, j != s)
// Columns with T_rj = 0 are left alone: at the start of a sparse problem that is most of them.
// Fails (returns false) on a pivot that is zero or not finite; the table is then unchanged.

#include "lcp/dense_tableau.h"

#include <algorithm>
#include <cmath>

#include "lcp/vector_lanes.h"

namespace cb {

namespace {

/// The pivot column stays in registers while the others stream by; for tables of up to 8 `lanes` a column.
template <int L>
void eliminate(double* table, int columns, int r, int s, const double* pivot_column, double inverse) {
  constexpr int V = L * DenseTableau::lanes / lane_count;
  Lanes c[V];
  for (int v = 0; v < V; ++v) load(pivot_column + lane_count * v, c[v]);
  for (int j = 0; j < columns; ++j) {
    if (j == s) continue;
    double* column = table + std::size_t(j) * (V * lane_count);
    const double f = column[r] * inverse;
    if (f == 0) continue;
    for (int v = 0; v < V; ++v) {
      Lanes x;
      load(column + lane_count * v, x);
      x -= c[v] * f;
      store(x, column + lane_count * v);
    }
    column[r] = -f;
  }
}

void eliminate_any(double* table, int columns, int r, int s, const double* pivot_column, double inverse, int padded) {
  for (int j = 0; j < columns; ++j) {
    if (j == s) continue;
    double* column = table + std::size_t(j) * padded;
    const double f = column[r] * inverse;
    if (f == 0) continue;
    for (int i = 0; i < padded; i += lane_count) {
      Lanes x, c;
      load(column + i, x);
      load(pivot_column + i, c);
      x -= c * f;
      store(x, column + i);
    }
    column[r] = -f;
  }
}

}  // namespace

static_assert(DenseTableau::lanes % lane_count == 0);

void DenseTableau::start(const Eigen::MatrixXd& M, const Eigen::VectorXd& rows, const Eigen::VectorXd& columns) {
  M_ = &M;
  row_scale_ = &rows;
  column_scale_ = &columns;
  n_ = static_cast<int>(M.rows());
  padded_ = (n_ + lanes - 1) / lanes * lanes;
  table_.resize(Eigen::Index(padded_) * (n_ + 1));
  rhs_.resize(padded_);
  basic_.resize(n_);
  nonbasic_.resize(n_ + 1);
  slot_.resize(2 * n_ + 1);
}

void DenseTableau::restart() {
  const auto& M = *M_;
  rhs_.setZero();
  for (int j = 0; j < n_; ++j) {
    double* column = table_.data() + std::size_t(j) * padded_;
    Eigen::Map<Eigen::VectorXd>(column, n_) = M.col(j).cwiseProduct(*row_scale_) * (*column_scale_)[j];
    std::fill(column + n_, column + padded_, 0.0);
    basic_[j] = j;
    nonbasic_[j] = n_ + j;
    slot_[j] = -1 - j;
    slot_[n_ + j] = j;
  }
  nonbasic_[n_] = 2 * n_;
  slot_[2 * n_] = n_;
  std::fill_n(table_.data() + std::size_t(n_) * padded_, padded_, 0.0);
}

// The basic z (and z_0) enter for the nonbasic w by the largest pivots left, whatever pair they are of.
bool DenseTableau::renew(const std::vector<int>& active, int out, const Eigen::VectorXd& q,
                         const Eigen::VectorXd& cover) {
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
      const double* change = column(entering_[j]);
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

void DenseTableau::multiply(const Eigen::VectorXd& z, Eigen::VectorXd& w) const {
  w.setZero(n_);
  for (int j = 0; j < n_; ++j)
    if (z[j] != 0) w.noalias() += M_->col(j) * z[j];
}

void DenseTableau::magnitudes(const Eigen::VectorXd& z, Eigen::VectorXd& terms) const {
  terms.setZero(n_);
  for (int j = 0; j < n_; ++j)
    if (z[j] != 0) terms += M_->col(j).cwiseAbs() * z[j];
}

void DenseTableau::set_cover(const Eigen::VectorXd& cover) {
  transform(cover.data(), table_.data() + std::size_t(slot_[2 * n_]) * padded_);
}

bool DenseTableau::pivot(int row, int entering) {
  const int s = slot_[entering];
  double* column = table_.data() + std::size_t(s) * padded_;
  const double p = column[row], inverse = 1 / p;
  if (p == 0 || !std::isfinite(inverse)) return false;

  switch (padded_ / lanes) {
    case 1:
      eliminate<1>(table_.data(), n_ + 1, row, s, column, inverse);
      break;
    case 2:
      eliminate<2>(table_.data(), n_ + 1, row, s, column, inverse);
      break;
    case 3:
      eliminate<3>(table_.data(), n_ + 1, row, s, column, inverse);
      break;
    case 4:
      eliminate<4>(table_.data(), n_ + 1, row, s, column, inverse);
      break;
    case 5:
      eliminate<5>(table_.data(), n_ + 1, row, s, column, inverse);
      break;
    case 6:
      eliminate<6>(table_.data(), n_ + 1, row, s, column, inverse);
      break;
    case 7:
      eliminate<7>(table_.data(), n_ + 1, row, s, column, inverse);
      break;
    case 8:
      eliminate<8>(table_.data(), n_ + 1, row, s, column, inverse);
      break;
    default:
      eliminate_any(table_.data(), n_ + 1, row, s, column, inverse, padded_);
  }
  // The right-hand side as one more column: the entering variable moves to -rhs_r / p.
  const double step = -rhs_[row] * inverse;
  for (int i = 0; i < padded_; i += lane_count) {
    Lanes x, c;
    load(rhs_.data() + i, x);
    load(column + i, c);
    x += c * step;
    store(x, rhs_.data() + i);
    c *= inverse;
    store(c, column + i);
  }
  rhs_[row] = step;
  column[row] = inverse;

  const int leaving = basic_[row];
  basic_[row] = entering;
  nonbasic_[s] = leaving;
  slot_[entering] = -1 - row;
  slot_[leaving] = s;
  return true;
}

void DenseTableau::transform(const double* q, double* out) const {
  std::fill(out, out + padded_, 0.0);
  for (int i = 0; i < n_; ++i)
    if (is_basic(i)) out[row_of(i)] += q[i];
  // A nonbasic w_i appears in the dictionary as w_i - q_i.
  for (int i = 0; i < n_; ++i) {
    if (is_basic(i) || q[i] == 0) continue;
    const double* column = table_.data() + std::size_t(slot_[i]) * padded_;
    const double f = q[i];
    for (int k = 0; k < padded_; k += lane_count) {
      Lanes x, c;
      load(out + k, x);
      load(column + k, c);
      x -= c * f;
      store(x, out + k);
    }
  }
}

void DenseTableau::solve_active(const std::vector<int>& active, double* x, double* scratch) const {
  std::fill(scratch, scratch + padded_, 0.0);
  for (const int i : active) {
    const double* column = table_.data() + std::size_t(slot_[i]) * padded_;
    const double f = x[i];
    for (int k = 0; k < padded_; k += lane_count) {
      Lanes y, c;
      load(scratch + k, y);
      load(column + k, c);
      y += c * f;
      store(y, scratch + k);
    }
  }
  for (const int i : active) x[i] = scratch[row_of(n_ + i)];
}

}  // namespace cb
