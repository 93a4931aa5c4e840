// P L U by blocks, right-looking (linalg/block_ldl.cpp has the symmetric case): a diagonal block is factored with
// exchange of its rows, A_kk = P L U; then  L_jk = A_jk U^-1,  U_kj^T = A_kj^T P^-T L^-T,  A_ij -= L_ik U_kj.
// U is kept transposed, block by block beside L, so that both halves go through the same kernels.
// Fails (returns false) on a pivot that is zero or not finite: what rows of other blocks could do is not tried.

#include "linalg/block_lu.h"

#include <algorithm>
#include <cmath>

#include "linalg/block_kernels.h"
#include "linalg/stop.h"

namespace cb {

using namespace block_kernels;

void BlockLu::analyse(std::span<const int> sizes, const SymmetricPattern& graph) {
  s_.analyse(sizes, graph);
  lower_.assign(s_.entries, 0.0);
  upper_.assign(s_.entries, 0.0);
  inverse_pivots_.assign(s_.first.back(), 0.0);
  x_.assign(s_.first.back(), 0.0);
  pivot_.assign(s_.first.back(), 0);
  int most = 0;
  for (const int size : s_.size) most = std::max(most, padded(size) * padded(size));
  transposed_.assign(most, 0.0);
}

int BlockLu::sign() const {
  int sign = 1;
  for (std::size_t k = 0; k < s_.size.size(); ++k)
    for (int j = 0; j < s_.size[k]; ++j)
      if ((pivot_[s_.first[k] + j] != j) != (inverse_pivots_[s_.first[k] + j] < 0)) sign = -sign;
  return sign;
}

// L below the diagonal, U on and above it; and U^T in transposed_.
bool BlockLu::factor_diagonal(int k) {
  const int n = s_.size[k], rows = padded(n);
  double* A = lower_.data() + s_.diagonal[k];
  double* inverse_pivots = inverse_pivots_.data() + s_.first[k];
  int* pivot = pivot_.data() + s_.first[k];
  for (int j = 0; j < n; ++j) {
    double* column = A + j * rows;
    int best = j;
    for (int i = j + 1; i < n; ++i)
      if (std::abs(column[i]) > std::abs(column[best])) best = i;
    pivot[j] = best;
    if (best != j)
      for (int l = 0; l < n; ++l) std::swap(A[l * rows + j], A[l * rows + best]);
    const double inverse = 1 / column[j];
    if (column[j] == 0 || !std::isfinite(column[j]) || !std::isfinite(inverse)) return false;
    inverse_pivots[j] = inverse;
    for (int i = j + 1; i < n; ++i) column[i] *= inverse;
    for (int l = j + 1; l < n; ++l) {
      double* other = A + l * rows;
      const double f = other[j];
      for (int i = j + 1; i < n; ++i) other[i] -= column[i] * f;
    }
  }
  // X U = B, column j: (B_j - sum_l X_l U_lj) / U_jj.
  for (int l = 0; l < n; ++l)
    for (int j = l + 1; j < n; ++j) transposed_[l * rows + j] = A[j * rows + l];
  return true;
}

void BlockLu::divide_column(int k) {
  const int n = s_.size[k], rows = padded(n);
  const double* A = lower_.data() + s_.diagonal[k];
  const double* inverse_pivots = inverse_pivots_.data() + s_.first[k];
  const int* pivot = pivot_.data() + s_.first[k];
  for (int e = s_.column[k]; e < s_.column[k + 1]; ++e) {
    const int rows_e = padded(s_.size[s_.lower[e].row]);
    // L_jk = A_jk U^-1, a column at a time.
    double* B = lower_.data() + s_.lower[e].at;
    for (int j = 0; j < n; ++j) {
      for (int l = 0; l < j; ++l) {
        const double f = transposed_[l * rows + j];
        for (int i = 0; i < rows_e; i += lanes) {
          Pack x, y;
          load(B + j * rows_e + i, x);
          load(B + l * rows_e + i, y);
          subtract_fused(y, f, x);
          store(x, B + j * rows_e + i);
        }
      }
      for (int i = 0; i < rows_e; i += lanes) {
        Pack x;
        load(B + j * rows_e + i, x);
        x *= inverse_pivots[j];
        store(x, B + j * rows_e + i);
      }
    }
    // U_kj^T = A_kj^T P^-T L^-T.
    double* C = upper_.data() + s_.lower[e].at;
    for (int j = 0; j < n; ++j)
      if (pivot[j] != j) std::swap_ranges(C + j * rows_e, C + (j + 1) * rows_e, C + pivot[j] * rows_e);
    divide_by_transposed(C, rows_e, A, n, rows);
  }
}

void BlockLu::update(int k, const int*& target) {
  const int n = s_.size[k];
  for (int e = s_.column[k]; e < s_.column[k + 1]; ++e) {
    const int size_e = s_.size[s_.lower[e].row], rows_e = padded(size_e), at_e = s_.lower[e].at;
    for (int f = e; f < s_.column[k + 1]; ++f, ++target) {
      const int rows_f = padded(s_.size[s_.lower[f].row]), at_f = s_.lower[f].at;
      subtract_product(lower_.data() + *target, lower_.data() + at_f, rows_f, upper_.data() + at_e, rows_e, size_e, n,
                       false);
      if (f != e)
        subtract_product(upper_.data() + *target, upper_.data() + at_f, rows_f, lower_.data() + at_e, rows_e, size_e, n,
                         false);
    }
  }
}

bool BlockLu::factor() {
  const int* target = s_.target.data();
  for (int k = 0; k < s_.blocks(); ++k) {
    poll_stop();
    if (!factor_diagonal(k)) return false;
    divide_column(k);
    update(k, target);
  }
  return true;
}

void BlockLu::solve() {
  const int n = s_.blocks();
  s_.clear_padding(x_);
  for (int k = 0; k < n; ++k) {
    const int size = s_.size[k], rows = padded(size);
    double* x = x_.data() + s_.first[k];
    const double* L = lower_.data() + s_.diagonal[k];
    const int* pivot = pivot_.data() + s_.first[k];
    for (int j = 0; j < size; ++j)
      if (pivot[j] != j) std::swap(x[j], x[pivot[j]]);
    for (int j = 0; j + 1 < size; ++j)
      for (int i = j + 1; i < size; ++i) x[i] -= L[j * rows + i] * x[j];
    for (int e = s_.column[k]; e < s_.column[k + 1]; ++e)
      subtract(x_.data() + s_.first[s_.lower[e].row], lower_.data() + s_.lower[e].at, padded(s_.size[s_.lower[e].row]),
               size, x);
  }
  for (int k = n - 1; k >= 0; --k) {
    const int size = s_.size[k], rows = padded(size);
    double* x = x_.data() + s_.first[k];
    const double* U = lower_.data() + s_.diagonal[k];
    const double* inverse_pivots = inverse_pivots_.data() + s_.first[k];
    for (int e = s_.column[k]; e < s_.column[k + 1]; ++e)
      subtract_transposed(x, upper_.data() + s_.lower[e].at, padded(s_.size[s_.lower[e].row]), size,
                          x_.data() + s_.first[s_.lower[e].row]);
    for (int j = size - 1; j >= 0; --j) {
      x[j] *= inverse_pivots[j];
      for (int i = 0; i < j; ++i) x[i] -= U[j * rows + i] * x[j];
    }
  }
}

}  // namespace cb
