#pragma once

#include "linalg/pack.h"

/// Kernels of factorisations by blocks: dense column-major blocks whose rows are padded to whole vector registers, so
/// that every kernel runs over registers and any size will do.
namespace cb::block_kernels {

inline constexpr int lanes = pack_size;

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
      for (int r = 0; r < R; ++r) subtract_fused(a[r], b, sum[q][r]);
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
inline void subtract_product(double* C, const double* A, int rows, const double* B, int rows_b, int columns, int depth,
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
        subtract_fused(x, a, even[r]);
        subtract_fused(y, b, odd[r]);
      }
    }
    if (k < j) {
      const double a = L[k * rows + j];
      for (int r = 0; r < R; ++r) {
        Pack x;
        load(B + k * rows_b + lanes * r, x);
        subtract_fused(x, a, even[r]);
      }
    }
    for (int r = 0; r < R; ++r) {
      even[r] += odd[r];
      store(even[r], B + j * rows_b + lanes * r);
    }
  }
}

inline void divide_by_transposed(double* B, int rows_b, const double* L, int n, int rows) {
  int i = 0;
  for (; i + 3 * lanes <= rows_b; i += 3 * lanes) divide_by_transposed<3>(B + i, rows_b, L, n, rows);
  if (rows_b - i == 2 * lanes) divide_by_transposed<2>(B + i, rows_b, L, n, rows);
  if (rows_b - i == lanes) divide_by_transposed<1>(B + i, rows_b, L, n, rows);
}

// y -= A x, A rows x columns.
inline void subtract(double* y, const double* A, int rows, int columns, const double* x) {
  for (int i = 0; i < rows; i += lanes) {
    Pack even, odd = {};
    load(y + i, even);
    int k = 0;
    for (; k + 2 <= columns; k += 2) {
      Pack a, b;
      load(A + k * rows + i, a);
      load(A + (k + 1) * rows + i, b);
      subtract_fused(a, x[k], even);
      subtract_fused(b, x[k + 1], odd);
    }
    if (k < columns) {
      Pack a;
      load(A + k * rows + i, a);
      subtract_fused(a, x[k], even);
    }
    even += odd;
    store(even, y + i);
  }
}

// y -= A^T x, A rows x columns.
inline void subtract_transposed(double* y, const double* A, int rows, int columns, const double* x) {
  for (int k = 0; k < columns; ++k) {
    Pack sum = {};
    for (int i = 0; i < rows; i += lanes) {
      Pack a, b;
      load(A + k * rows + i, a);
      load(x + i, b);
      add_fused(a, b, sum);
    }
    y[k] -= (sum[0] + sum[1]) + (sum[2] + sum[3]);
  }
}

}  // namespace cb::block_kernels
