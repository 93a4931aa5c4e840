// L D L^T by blocks, right-looking: a diagonal block is factored, the blocks below it are divided by its factor, and
// their products are taken off the rest (G. H. Golub, C. F. Van Loan, Matrix Computations, sec. 4.2 for the scheme).
// Rows are padded to whole vector registers, so that every kernel runs over registers and any size will do.
// Fails (returns false) on a pivot that is zero or not finite; nothing is perturbed.

#include "linalg/block_ldl.h"

#include <algorithm>
#include <cmath>

#include "linalg/block_kernels.h"
#include "linalg/stop.h"

namespace cb {

namespace {

using namespace block_kernels;
static_assert(BlockLdl::lanes == lanes);

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
        subtract_fused(y, f, x);
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

}  // namespace

void BlockLdl::analyse(std::span<const int> sizes, const SymmetricPattern& graph) {
  s_.analyse(sizes, graph);
  const int n = s_.blocks();
  upper_at_.resize(n);
  int upper = 0;
  for (int k = 0; k < n; ++k) {
    upper_at_[k] = upper;
    upper += padded(s_.size[k]) * s_.size[k];
  }
  values_.assign(s_.entries, 0.0);
  upper_.assign(upper, 0.0);
  scaled_.assign(s_.tall, 0.0);
  x_.assign(s_.first.back(), 0.0);
  pivots_.assign(s_.first.back(), 0.0);
  inverse_pivots_.assign(s_.first.back(), 0.0);
}

bool BlockLdl::factor() {
  const int n = blocks();
  const int* target = s_.target.data();
  for (int k = 0; k < n; ++k) {
    poll_stop();
    const int size = s_.size[k], rows = padded(size);
    double* L = values_.data() + s_.diagonal[k];
    double* inverse = inverse_pivots_.data() + s_.first[k];
    if (!factor_block(L, size, rows, pivots_.data() + s_.first[k], inverse, upper_.data() + upper_at_[k])) return false;
    double* scaled = scaled_.data();
    for (int e = s_.column[k]; e < s_.column[k + 1]; ++e) {
      const int rows_e = padded(s_.size[s_.lower[e].row]);
      double* B = values_.data() + s_.lower[e].at;
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
    for (int e = s_.column[k]; e < s_.column[k + 1]; ++e) {
      const int size_e = s_.size[s_.lower[e].row], rows_e = padded(size_e);
      for (int f = e; f < s_.column[k + 1]; ++f)
        subtract_product(values_.data() + *target++, values_.data() + s_.lower[f].at, padded(s_.size[s_.lower[f].row]),
                         scaled, rows_e, size_e, size, f == e);
      scaled += rows_e * size;
    }
    scaled = scaled_.data();
    for (int e = s_.column[k]; e < s_.column[k + 1]; ++e) {
      const int count = padded(s_.size[s_.lower[e].row]) * size;
      std::copy_n(scaled, count, values_.data() + s_.lower[e].at);
      scaled += count;
    }
  }
  return true;
}

void BlockLdl::solve() {
  const int n = blocks();
  s_.clear_padding(x_);
  for (int k = 0; k < n; ++k) {
    const int size = s_.size[k], rows = padded(size);
    double* x = x_.data() + s_.first[k];
    const double* L = values_.data() + s_.diagonal[k];
    for (int j = 0; j + 1 < size; ++j) {
      const double f = x[j];
      for (int i = (j + 1) / lanes * lanes; i < rows; i += lanes) {
        Pack y, l;
        load(x + i, y);
        load(L + j * rows + i, l);
        subtract_fused(l, f, y);
        store(y, x + i);
      }
    }
    for (int e = s_.column[k]; e < s_.column[k + 1]; ++e)
      subtract(x_.data() + s_.first[s_.lower[e].row], values_.data() + s_.lower[e].at, padded(s_.size[s_.lower[e].row]),
               size, x);
  }
  for (int k = n - 1; k >= 0; --k) {
    const int size = s_.size[k], rows = padded(size);
    double* x = x_.data() + s_.first[k];
    const double* inverse = inverse_pivots_.data() + s_.first[k];
    for (int i = 0; i < size; ++i) x[i] *= inverse[i];
    for (int e = s_.column[k]; e < s_.column[k + 1]; ++e)
      subtract_transposed(x, values_.data() + s_.lower[e].at, padded(s_.size[s_.lower[e].row]), size,
                          x_.data() + s_.first[s_.lower[e].row]);
    const double* U = upper_.data() + upper_at_[k];
    for (int j = size - 1; j > 0; --j) {
      const double f = x[j];
      for (int i = 0; i < j; i += lanes) {
        Pack y, u;
        load(x + i, y);
        load(U + j * rows + i, u);
        subtract_fused(u, f, y);
        store(y, x + i);
      }
    }
  }
}

}  // namespace cb
