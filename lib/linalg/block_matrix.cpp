#include "linalg/block_matrix.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "linalg/pack.h"

namespace cb {

namespace {

using Eigen::Map;
using Eigen::Matrix;
using ConstVec = Map<const Eigen::VectorXd>;
using Vec = Map<Eigen::VectorXd>;

// A free body's block has six rows: the size known at compile time is worth a factor of three.
template <class F6, class FX>
void by_size(int size, F6&& six, FX&& any) {
  if (size == 6)
    six();
  else
    any();
}

// What is kept beside L of each block: for each of its rows the reciprocal of the diagonal entry, and (six rows) a
// column of L^-1 and a column of L^-T, padded.
constexpr int kept = 1 + 8 + 8;

// x <- L^-1 x by substitution; Number: of one column, or of several side by side, with the same result.
template <class Number>
void substitute_lower(const double* L, const double* inverse, int rows, Number* x) {
  for (int j = 0; j < rows; ++j) {
    x[j] *= inverse[j];
    for (int i = j + 1; i < rows; ++i) x[i] -= L[j * rows + i] * x[j];
  }
}

// x <- L^-T x.
template <class Number>
void substitute_upper(const double* L, const double* inverse, int rows, Number* x) {
  for (int j = rows - 1; j >= 0; --j) {
    Number s = x[j];
    for (int i = j + 1; i < rows; ++i) s -= L[j * rows + i] * x[i];
    x[j] = s * inverse[j];
  }
}

// Of column j the rows from i on, as many as fit into a Number, less what the columns before it explain.
template <class Number>
inline void subtract_earlier(int rows, int j, int i, double* L) {
  Number x;
  std::memcpy(&x, L + j * rows + i, sizeof x);
  for (int k = 0; k < j; ++k) {
    Number y;
    std::memcpy(&y, L + k * rows + i, sizeof y);
    x -= y * L[k * rows + j];
  }
  std::memcpy(L + j * rows + i, &x, sizeof x);
}

// L column by column from the lower half of A, and the reciprocals of its diagonal. False where A is not positive
// definite.
[[gnu::always_inline]] inline bool factor_columns(int rows, double* L, double* inverse) {
  for (int j = 0; j < rows; ++j) {
    int i = j;
    for (; i + pack_size <= rows; i += pack_size) subtract_earlier<Pack>(rows, j, i, L);
    for (; i < rows; ++i) subtract_earlier<double>(rows, j, i, L);
    double* column = L + j * rows;
    const double d = column[j];
    if (!(d > 1e-300) || !std::isfinite(d)) return false;
    column[j] = std::sqrt(d);
    inverse[j] = 1 / column[j];
    for (i = j + 1; i < rows; ++i) column[i] /= column[j];
  }
  return true;
}

// L^-1 and L^-T of six rows: products with them do not wait for one another as the steps of a substitution do.
void invert_six(const double* L, double* inverse) {
  double *lower = inverse + 6, *upper = lower + 48;
  std::fill_n(lower, 96, 0.0);
  for (int j = 0; j < 6; ++j) {
    double* x = lower + 8 * j;
    x[j] = inverse[j];
    for (int i = j + 1; i < 6; ++i) {
      double s = 0;
      for (int k = j; k < i; ++k) s -= L[6 * k + i] * x[k];
      x[i] = s * inverse[i];
    }
    for (int i = j; i < 6; ++i) upper[8 * i + j] = x[i];
  }
}

inline void multiply_six(const double* A, const double* x, double* y) {
  Pack low[2] = {}, high[2] = {};
  for (int j = 0; j < 6; j += 2)
    for (int h = 0; h < 2; ++h) {
      Pack a, b;
      load(A + 8 * (j + h), a);
      load(A + 8 * (j + h) + 4, b);
      low[h] += a * x[j + h];
      high[h] += b * x[j + h];
    }
  low[0] += low[1];
  high[0] += high[1];
  store(low[0], y);
  y[4] = high[0][0];
  y[5] = high[0][1];
}

// Column j of an entry of a band over six columns: n, t1, t2 and a number that means nothing.
template <int j>
inline Pack column_of_six(const double* J) {
  Pack a;
  load(J + 3 * j - (j == 5), a);  // nothing past the end
  return j == 5 ? __builtin_shufflevector(a, a, 1, 2, 3, 3) : a;
}

inline void add_six(const double* J, const double* x, Pack& even, Pack& odd) {
  even += column_of_six<0>(J) * x[0];
  odd += column_of_six<1>(J) * x[1];
  even += column_of_six<2>(J) * x[2];
  odd += column_of_six<3>(J) * x[3];
  even += column_of_six<4>(J) * x[4];
  odd += column_of_six<5>(J) * x[5];
}

inline void add_six_transposed(const double* J, const double* r, double* y) {
  Pack a, b, c, out;
  load(J, a);
  load(J + 4, b);
  load(J + 8, c);
  load(y, out);
  // Rows of the first four columns out of twelve numbers.
  out += __builtin_shufflevector(__builtin_shufflevector(a, b, 0, 3, 6, 7), c, 0, 1, 2, 5) * r[0];
  out += __builtin_shufflevector(__builtin_shufflevector(a, b, 1, 4, 7, 7), c, 0, 1, 2, 6) * r[1];
  out += __builtin_shufflevector(__builtin_shufflevector(a, b, 2, 5, 5, 5), c, 0, 1, 4, 7) * r[2];
  store(out, y);
  for (int j = 4; j < 6; ++j) y[j] += J[3 * j] * r[0] + J[3 * j + 1] * r[1] + J[3 * j + 2] * r[2];
}

}  // namespace

void BlockDiagonalMatrix::clear() {
  first.assign(1, 0);
  offset.assign(1, 0);
  values.clear();
}

int BlockDiagonalMatrix::add_block(int size) {
  first.push_back(first.back() + size);
  offset.push_back(offset.back() + size * size);
  values.resize(offset.back(), 0.0);
  return blocks() - 1;
}

void multiply(const BlockDiagonalMatrix& A, std::span<const double> x, std::span<double> y) {
  for (int b = 0; b < A.blocks(); ++b) {
    const int at = A.first[b], n = A.block_size(b);
    by_size(
        n,
        [&] {
          Map<Matrix<double, 6, 1>>(y.data() + at).noalias() =
              Map<const Matrix<double, 6, 6>>(A.values.data() + A.offset[b]) *
              Map<const Matrix<double, 6, 1>>(x.data() + at);
        },
        [&] { Vec(y.data() + at, n).noalias() = A.block(b) * ConstVec(x.data() + at, n); });
  }
}

double quadratic_form(const BlockDiagonalMatrix& A, std::span<const double> x) {
  double sum = 0;
  for (int b = 0; b < A.blocks(); ++b) {
    const int at = A.first[b], n = A.block_size(b);
    by_size(
        n,
        [&] {
          const Map<const Matrix<double, 6, 1>> xb(x.data() + at);
          sum += xb.dot(Map<const Matrix<double, 6, 6>>(A.values.data() + A.offset[b]) * xb);
        },
        [&] {
          const ConstVec xb(x.data() + at, n);
          for (int j = 0; j < n; ++j) sum += x[at + j] * A.block(b).col(j).dot(xb);
        });
  }
  return sum;
}

bool BlockCholesky::factor(const BlockDiagonalMatrix& A) {
  const bool same_layout = ready_ && factored_.first == A.first;
  if (!same_layout) {
    factored_ = lower_ = A;
    inverse_.resize(static_cast<std::size_t>(kept) * A.order());
  }
  ready_ = false;
  for (int b = 0; b < A.blocks(); ++b) {
    const double* from = A.values.data() + A.offset[b];
    double* known = factored_.values.data() + A.offset[b];
    const auto count = static_cast<std::size_t>(A.offset[b + 1] - A.offset[b]);
    if (same_layout && std::equal(known, known + count, from)) continue;
    std::copy_n(from, count, known);
    std::copy_n(from, count, lower_.values.data() + A.offset[b]);
    if (!factor_block(b)) return false;
  }
  ready_ = true;
  return true;
}

bool BlockCholesky::factor_block(int b) {
  const int n = lower_.block_size(b);
  double *L = lower_.values.data() + lower_.offset[b], *inverse = inverse_.data() + kept * lower_.first[b];
  if (n != 6) return factor_columns(n, L, inverse);
  if (!factor_columns(6, L, inverse)) return false;
  invert_six(L, inverse);
  return true;
}

void BlockCholesky::solve_block_in_place(int b, double* x, int cols) const {
  solve_columns(b, x, cols, lower_.block_size(b));
}

void BlockCholesky::solve_columns(int b, double* x, int cols, Eigen::Index apart) const {
  const int n = lower_.block_size(b);
  const double *L = lower_.values.data() + lower_.offset[b], *inverse = inverse_.data() + kept * lower_.first[b];
  if (n == 6) {
    for (int j = 0; j < cols; ++j, x += apart) {
      double y[6];
      multiply_six(inverse + 6, x, y);
      multiply_six(inverse + 6 + 48, y, x);
    }
    return;
  }
  for (; cols > 1; cols -= pack_size, x += pack_size * apart) {
    const int together = std::min(cols, pack_size);
    rows_.assign(n, Pack{});
    for (int j = 0; j < together; ++j)
      for (int i = 0; i < n; ++i) rows_[i][j] = x[j * apart + i];
    substitute_lower(L, inverse, n, rows_.data());
    substitute_upper(L, inverse, n, rows_.data());
    for (int j = 0; j < together; ++j)
      for (int i = 0; i < n; ++i) x[j * apart + i] = rows_[i][j];
  }
  if (cols == 1) {
    substitute_lower(L, inverse, n, x);
    substitute_upper(L, inverse, n, x);
  }
}

void BlockCholesky::add_row_norms(int b, const double* rows, double* sums) const {
  const int n = lower_.block_size(b);
  const double *L = lower_.values.data() + lower_.offset[b], *inverse = inverse_.data() + kept * lower_.first[b];
  if (n == 6) {
    const double* lower = inverse + 6;
    const Pack columns[] = {column_of_six<0>(rows), column_of_six<1>(rows), column_of_six<2>(rows),
                            column_of_six<3>(rows), column_of_six<4>(rows), column_of_six<5>(rows)};
    Pack sum = {};
    for (int i = 0; i < 6; ++i) {
      Pack x = {};
      for (int j = 0; j <= i; ++j) x += columns[j] * lower[8 * j + i];
      sum += x * x;
    }
    for (int i = 0; i < 3; ++i) sums[i] += sum[i];
    return;
  }
  rows_.resize(n);
  for (int j = 0; j < n; ++j) rows_[j] = Pack{rows[3 * j], rows[3 * j + 1], rows[3 * j + 2], 0};
  substitute_lower(L, inverse, n, rows_.data());
  Pack sum = {sums[0], sums[1], sums[2], 0};
  for (int j = 0; j < n; ++j) sum += rows_[j] * rows_[j];
  for (int i = 0; i < 3; ++i) sums[i] = sum[i];
}

void BlockCholesky::solve_lower_in_place(int b, Eigen::Ref<Eigen::MatrixXd> X, int row) const {
  lower_.block(b).triangularView<Eigen::Lower>().solveInPlace(X.middleRows(row, lower_.block_size(b)));
}

void BlockCholesky::solve_upper_in_place(std::span<double> x) const {
  for (int b = 0; b < lower_.blocks(); ++b)
    lower_.block(b).transpose().triangularView<Eigen::Upper>().solveInPlace(
        Eigen::Map<Eigen::VectorXd>(x.data() + lower_.first[b], lower_.block_size(b)));
}

void BlockCholesky::solve_in_place(std::span<double> x) const {
  for (int b = 0; b < lower_.blocks(); ++b) solve_block_in_place(b, x.data() + lower_.first[b], 1);
}

void BlockCholesky::solve_in_place(Eigen::MatrixXd& X) const {
  for (int b = 0; b < lower_.blocks(); ++b)
    solve_columns(b, X.data() + lower_.first[b], static_cast<int>(X.cols()), X.rows());
}

void BandMatrix::clear() {
  band.assign(1, 0);
  block.clear();
  offset.assign(1, 0);
  values.clear();
}

void BandMatrix::add_band() { band.push_back(band.back()); }

int BandMatrix::add_entry(int block_index, int cols) {
  block.push_back(block_index);
  offset.push_back(offset.back() + 3 * cols);
  values.resize(offset.back(), 0.0);
  return band.back()++;
}

void multiply(const BandMatrix& J, const BlockDiagonalMatrix& columns, std::span<const double> v, std::span<double> u) {
  for (int c = 0; c < J.bands(); ++c) {
    Pack even = {}, odd = {};
    for (int e = J.band[c]; e < J.band[c + 1]; ++e) {
      const double* x = v.data() + columns.first[J.block[e]];
      const double* values = J.values.data() + J.offset[e];
      const int cols = (J.offset[e + 1] - J.offset[e]) / 3;
      if (cols == 6) {
        add_six(values, x, even, odd);
      } else {
        for (int j = 0; j < cols; ++j) even += Pack{values[3 * j], values[3 * j + 1], values[3 * j + 2], 0} * x[j];
      }
    }
    even += odd;
    for (int i = 0; i < 3; ++i) u[3 * c + i] = even[i];
  }
}

void sizes_of_terms(const BandMatrix& J, const BlockDiagonalMatrix& columns, std::span<const double> v,
                    std::span<const double> w, std::span<double> terms) {
  for (int c = 0; c < J.bands(); ++c) {
    double n = std::abs(w[3 * c]), t1 = std::abs(w[3 * c + 1]), t2 = std::abs(w[3 * c + 2]);
    for (int e = J.band[c]; e < J.band[c + 1]; ++e) {
      const double* x = v.data() + columns.first[J.block[e]];
      const double* column = J.values.data() + J.offset[e];
      const double* end = J.values.data() + J.offset[e + 1];
      for (; column != end; column += 3, ++x) {
        n += std::abs(column[0] * *x);
        t1 += std::abs(column[1] * *x);
        t2 += std::abs(column[2] * *x);
      }
    }
    terms[c] = std::sqrt(n * n + t1 * t1 + t2 * t2);
  }
}

void multiply_transposed_add(const BandMatrix& J, const BlockDiagonalMatrix& columns, std::span<const double> r,
                             std::span<double> y) {
  for (int c = 0; c < J.bands(); ++c) {
    const double* rc = r.data() + 3 * c;
    for (int e = J.band[c]; e < J.band[c + 1]; ++e) {
      double* x = y.data() + columns.first[J.block[e]];
      const double* values = J.values.data() + J.offset[e];
      by_size((J.offset[e + 1] - J.offset[e]) / 3, [&] { add_six_transposed(values, rc, x); },
              [&] { Vec(x, J.entry(e).cols()).noalias() += J.entry(e).transpose() * Map<const Eigen::Vector3d>(rc); });
    }
  }
}

}  // namespace cb
