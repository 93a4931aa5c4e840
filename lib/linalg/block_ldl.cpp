// L D L^T by blocks, right-looking: a diagonal block is factored, the blocks below it are divided by its factor, and
// their products are taken off the rest (G. H. Golub, C. F. Van Loan, Matrix Computations, sec. 4.2 for the scheme).
// Rows are padded to whole vector registers, so that every kernel runs over registers and any size will do.
// Fails (returns false) on a pivot that is zero or not finite; nothing is perturbed.

#include "linalg/block_ldl.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "linalg/pack.h"
#include "linalg/stop.h"

namespace cb {

namespace {

constexpr int lanes = BlockLdl::lanes;
static_assert(lanes == pack_size);

// C -= A B^T on R registers of rows and Q columns of C; depth columns of A and B.
template <int R, int Q>
void subtract_product(double* C, int rows_c, const double* A, int rows_a, const double* B, int rows_b, int depth) {
  Pack sum[Q][R];
  for (int q = 0; q < Q; ++q)
    for (int r = 0; r < R; ++r) load(C + q * rows_c + lanes * r, sum[q][r]);
  for (int k = 0; k < depth; ++k) {
    Pack a[R];
    for (int r = 0; r < R; ++r) load(A + k * rows_a + lanes * r, a[r]);
    for (int q = 0; q < Q; ++q) {
      const double b = B[k * rows_b + q];
      for (int r = 0; r < R; ++r) sum[q][r] -= a[r] * b;
    }
  }
  for (int q = 0; q < Q; ++q)
    for (int r = 0; r < R; ++r) store(sum[q][r], C + q * rows_c + lanes * r);
}

template <int Q>
void subtract_product(double* C, int rows_c, const double* A, int rows_a, const double* B, int rows_b, int depth,
                      int from, int to) {
  int i = from;
  for (; i + 3 * lanes <= to; i += 3 * lanes) subtract_product<3, Q>(C + i, rows_c, A + i, rows_a, B, rows_b, depth);
  if (to - i == 2 * lanes) subtract_product<2, Q>(C + i, rows_c, A + i, rows_a, B, rows_b, depth);
  if (to - i == lanes) subtract_product<1, Q>(C + i, rows_c, A + i, rows_a, B, rows_b, depth);
}

// C -= A B^T; C is rows x columns, the rows padded. lower: only what is on or below the diagonal is needed.
void subtract_product(double* C, const double* A, int rows, const double* B, int rows_b, int columns, int depth,
                      bool lower) {
  int j = 0;
  for (; j + 4 <= columns; j += 4)
    subtract_product<4>(C + j * rows, rows, A, rows, B + j, rows_b, depth, lower ? j / lanes * lanes : 0, rows);
  if (j + 2 <= columns) {
    subtract_product<2>(C + j * rows, rows, A, rows, B + j, rows_b, depth, lower ? j / lanes * lanes : 0, rows);
    j += 2;
  }
  if (j < columns)
    subtract_product<1>(C + j * rows, rows, A, rows, B + j, rows_b, depth, lower ? j / lanes * lanes : 0, rows);
}

// S = L D L^T of one diagonal block: L strictly below the diagonal takes its place, upper gets L^T.
bool factor_block(double* S, int n, int rows, double* pivots, double* inverse_pivots, double* upper) {
  for (int k = 0; k < n; ++k) {
    double* column = S + k * rows;
    const double d = column[k], inverse = 1 / d;
    if (d == 0 || !std::isfinite(d) || !std::isfinite(inverse)) return false;
    for (int j = k + 1; j < n; ++j) {
      const double f = column[j] * inverse;
      double* other = S + j * rows;
      for (int i = j / lanes * lanes; i < rows; i += lanes) {
        Pack x, y;
        load(other + i, x);
        load(column + i, y);
        x -= y * f;
        store(x, other + i);
      }
    }
    pivots[k] = d;
    inverse_pivots[k] = inverse;
    for (int i = 0; i <= k; ++i) column[i] = 0;
    for (int i = k + 1; i < n; ++i) column[i] *= inverse;
  }
  for (int k = 0; k < n; ++k)
    for (int i = 0; i < n; ++i) upper[i * rows + k] = S[k * rows + i];
  return true;
}

// B <- B L^-T on R registers of rows: column by column, each less its part of those before it.
template <int R>
void divide_by_transposed(double* B, int rows_b, const double* L, int n, int rows) {
  for (int j = 1; j < n; ++j) {
    Pack even[R], odd[R];
    for (int r = 0; r < R; ++r) {
      load(B + j * rows_b + lanes * r, even[r]);
      odd[r] = Pack{};
    }
    int k = 0;
    for (; k + 2 <= j; k += 2) {
      const double a = L[k * rows + j], b = L[(k + 1) * rows + j];
      for (int r = 0; r < R; ++r) {
        Pack x, y;
        load(B + k * rows_b + lanes * r, x);
        load(B + (k + 1) * rows_b + lanes * r, y);
        even[r] -= x * a;
        odd[r] -= y * b;
      }
    }
    if (k < j) {
      const double a = L[k * rows + j];
      for (int r = 0; r < R; ++r) {
        Pack x;
        load(B + k * rows_b + lanes * r, x);
        even[r] -= x * a;
      }
    }
    for (int r = 0; r < R; ++r) {
      even[r] += odd[r];
      store(even[r], B + j * rows_b + lanes * r);
    }
  }
}

void divide_by_transposed(double* B, int rows_b, const double* L, int n, int rows) {
  int i = 0;
  for (; i + 3 * lanes <= rows_b; i += 3 * lanes) divide_by_transposed<3>(B + i, rows_b, L, n, rows);
  if (rows_b - i == 2 * lanes) divide_by_transposed<2>(B + i, rows_b, L, n, rows);
  if (rows_b - i == lanes) divide_by_transposed<1>(B + i, rows_b, L, n, rows);
}

// y -= A x, A rows x columns.
void subtract(double* y, const double* A, int rows, int columns, const double* x) {
  for (int i = 0; i < rows; i += lanes) {
    Pack even, odd = {};
    load(y + i, even);
    int k = 0;
    for (; k + 2 <= columns; k += 2) {
      Pack a, b;
      load(A + k * rows + i, a);
      load(A + (k + 1) * rows + i, b);
      even -= a * x[k];
      odd -= b * x[k + 1];
    }
    if (k < columns) {
      Pack a;
      load(A + k * rows + i, a);
      even -= a * x[k];
    }
    even += odd;
    store(even, y + i);
  }
}

// y -= A^T x, A rows x columns.
void subtract_transposed(double* y, const double* A, int rows, int columns, const double* x) {
  for (int k = 0; k < columns; ++k) {
    Pack sum = {};
    for (int i = 0; i < rows; i += lanes) {
      Pack a, b;
      load(A + k * rows + i, a);
      load(x + i, b);
      sum += a * b;
    }
    y[k] -= (sum[0] + sum[1]) + (sum[2] + sum[3]);
  }
}

}  // namespace

void BlockLdl::analyse(std::span<const int> sizes, const SymmetricPattern& graph) {
  const int n = static_cast<int>(sizes.size());
  std::vector<int> order;
  block_order(graph, order);
  place_.resize(n);
  for (int k = 0; k < n; ++k) place_[order[k]] = k;

  // Rows of each column: its later neighbours, and what the columns hand on whose first row it is.
  std::vector<std::vector<int>> rows(n);
  for (int j = 0; j < n; ++j)
    for (int e = graph.column[j]; e < graph.column[j + 1]; ++e) {
      const auto [low, high] = std::minmax(place_[j], place_[graph.row[e]]);
      if (low != high) rows[low].push_back(high);
    }
  for (auto& list : rows) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  std::vector<int> merged;
  for (int k = 0; k < n; ++k) {
    if (rows[k].empty()) continue;
    auto& parent = rows[rows[k].front()];
    merged.clear();
    std::set_union(rows[k].begin() + 1, rows[k].end(), parent.begin(), parent.end(), std::back_inserter(merged));
    parent = merged;
  }

  size_.resize(n);
  first_.assign(1, 0);
  diagonal_.resize(n);
  column_.assign(1, 0);
  lower_.clear();
  upper_at_.resize(n);
  int at = 0, upper = 0, tall = 0;
  for (int k = 0; k < n; ++k) size_[k] = sizes[order[k]];
  for (int k = 0; k < n; ++k) {
    diagonal_[k] = at;
    upper_at_[k] = upper;
    upper += padded(size_[k]) * size_[k];
    at += padded(size_[k]) * size_[k];
    int column_rows = 0;
    for (const int j : rows[k]) {
      lower_.push_back({j, at});
      at += padded(size_[j]) * size_[k];
      column_rows += padded(size_[j]);
    }
    tall = std::max(tall, column_rows * size_[k]);
    column_.push_back(static_cast<int>(lower_.size()));
    first_.push_back(first_.back() + padded(size_[k]));
  }
  x_at_.resize(n);
  for (int b = 0; b < n; ++b) x_at_[b] = first_[place_[b]];
  values_.assign(at + lanes, 0.0);
  upper_.assign(upper, 0.0);
  scaled_.assign(tall, 0.0);
  x_.assign(first_.back(), 0.0);
  pivots_.assign(first_.back(), 0.0);
  inverse_pivots_.assign(first_.back(), 0.0);

  target_.clear();
  for (int k = 0; k < n; ++k)
    for (int e = column_[k]; e < column_[k + 1]; ++e)
      for (int f = e; f < column_[k + 1]; ++f) {
        const int column = lower_[e].row, row = lower_[f].row;
        if (row == column) {
          target_.push_back(diagonal_[column]);
        } else {
          const auto begin = lower_.begin() + column_[column], end = lower_.begin() + column_[column + 1];
          target_.push_back(
              std::lower_bound(begin, end, row, [](const Lower& block, int r) { return block.row < r; })->at);
        }
      }
}

BlockLdl::Place BlockLdl::place(int row, int column) const {
  const int low = std::min(place_[row], place_[column]), high = std::max(place_[row], place_[column]);
  const int stride = padded(size_[high]);
  if (low == high) return {diagonal_[low], stride, false};
  const auto begin = lower_.begin() + column_[low], end = lower_.begin() + column_[low + 1];
  return {std::lower_bound(begin, end, high, [](const Lower& block, int r) { return block.row < r; })->at, stride,
          place_[row] < place_[column]};
}

bool BlockLdl::factor() {
  const int n = blocks();
  const int* target = target_.data();
  for (int k = 0; k < n; ++k) {
    poll_stop();
    const int size = size_[k], rows = padded(size);
    double* L = values_.data() + diagonal_[k];
    double* inverse = inverse_pivots_.data() + first_[k];
    if (!factor_block(L, size, rows, pivots_.data() + first_[k], inverse, upper_.data() + upper_at_[k])) return false;
    double* scaled = scaled_.data();
    for (int e = column_[k]; e < column_[k + 1]; ++e) {
      const int rows_e = padded(size_[lower_[e].row]);
      double* B = values_.data() + lower_[e].at;
      divide_by_transposed(B, rows_e, L, size, rows);
      for (int j = 0; j < size; ++j)
        for (int i = 0; i < rows_e; i += lanes) {
          Pack x;
          load(B + j * rows_e + i, x);
          x *= inverse[j];
          store(x, scaled + j * rows_e + i);
        }
      scaled += rows_e * size;
    }
    scaled = scaled_.data();
    for (int e = column_[k]; e < column_[k + 1]; ++e) {
      const int size_e = size_[lower_[e].row], rows_e = padded(size_e);
      for (int f = e; f < column_[k + 1]; ++f)
        subtract_product(values_.data() + *target++, values_.data() + lower_[f].at, padded(size_[lower_[f].row]),
                         scaled, rows_e, size_e, size, f == e);
      scaled += rows_e * size;
    }
    scaled = scaled_.data();
    for (int e = column_[k]; e < column_[k + 1]; ++e) {
      const int count = padded(size_[lower_[e].row]) * size;
      std::copy_n(scaled, count, values_.data() + lower_[e].at);
      scaled += count;
    }
  }
  return true;
}

void BlockLdl::solve() {
  const int n = blocks();
  for (int k = 0; k < n; ++k) {
    const int size = size_[k], rows = padded(size);
    double* x = x_.data() + first_[k];
    const double* L = values_.data() + diagonal_[k];
    for (int j = 0; j + 1 < size; ++j) {
      const double f = x[j];
      for (int i = (j + 1) / lanes * lanes; i < rows; i += lanes) {
        Pack y, l;
        load(x + i, y);
        load(L + j * rows + i, l);
        y -= l * f;
        store(y, x + i);
      }
    }
    for (int e = column_[k]; e < column_[k + 1]; ++e)
      subtract(x_.data() + first_[lower_[e].row], values_.data() + lower_[e].at, padded(size_[lower_[e].row]), size, x);
  }
  for (int k = n - 1; k >= 0; --k) {
    const int size = size_[k], rows = padded(size);
    double* x = x_.data() + first_[k];
    const double* inverse = inverse_pivots_.data() + first_[k];
    for (int i = 0; i < size; ++i) x[i] *= inverse[i];
    for (int e = column_[k]; e < column_[k + 1]; ++e)
      subtract_transposed(x, values_.data() + lower_[e].at, padded(size_[lower_[e].row]), size,
                          x_.data() + first_[lower_[e].row]);
    const double* U = upper_.data() + upper_at_[k];
    for (int j = size - 1; j > 0; --j) {
      const double f = x[j];
      for (int i = 0; i < j; i += lanes) {
        Pack y, u;
        load(x + i, y);
        load(U + j * rows + i, u);
        y -= u * f;
        store(y, x + i);
      }
    }
  }
}

}  // namespace cb
