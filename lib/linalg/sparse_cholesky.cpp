// L D L^T of sparse symmetric matrices: a thin wall around CHOLMOD (simplicial, natural order, symbolic part kept).
// Simplicial, because contact problems have small blocks: supernodal code is slower on all of them.

#include "linalg/sparse_cholesky.h"

#include <amd.h>
#include <cholmod.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace cb {

struct SparseCholesky::Workspace {
  cholmod_common common;
  cholmod_sparse matrix{};
  cholmod_factor* factor = nullptr;
  // Kept by cholmod_solve2 between calls.
  cholmod_dense *x = nullptr, *y = nullptr, *e = nullptr;
  cholmod_dense rhs{};

  Workspace() {
    cholmod_start(&common);
    common.print = 0;
    common.supernodal = CHOLMOD_SIMPLICIAL;
    common.final_ll = 0;
    common.final_asis = 1;
    common.nmethods = 1;
    common.method[0].ordering = CHOLMOD_NATURAL;
    common.postorder = 0;
    common.try_catch = 1;
    common.quick_return_if_not_posdef = 0;
  }
  ~Workspace() {
    release();
    cholmod_free_dense(&x, &common);
    cholmod_free_dense(&y, &common);
    cholmod_free_dense(&e, &common);
    cholmod_finish(&common);
  }
  Workspace(const Workspace&) = delete;
  Workspace& operator=(const Workspace&) = delete;
  void release() {
    if (factor) cholmod_free_factor(&factor, &common);
  }
};

SparseCholesky::SparseCholesky() : workspace_(std::make_unique<Workspace>()) {}
SparseCholesky::~SparseCholesky() = default;
SparseCholesky::SparseCholesky(SparseCholesky&&) noexcept = default;
SparseCholesky& SparseCholesky::operator=(SparseCholesky&&) noexcept = default;

bool SparseCholesky::analyse(const SymmetricPattern& pattern) {
  Workspace& w = *workspace_;
  w.release();
  cholmod_sparse& A = w.matrix;
  A.nrow = A.ncol = static_cast<std::size_t>(pattern.order());
  A.nzmax = pattern.row.size();
  A.p = const_cast<int*>(pattern.column.data());
  A.i = const_cast<int*>(pattern.row.data());
  A.nz = nullptr;
  A.x = A.z = nullptr;
  A.stype = -1;
  A.itype = CHOLMOD_INT;
  A.xtype = CHOLMOD_PATTERN;
  A.dtype = CHOLMOD_DOUBLE;
  A.sorted = 1;
  A.packed = 1;
  w.factor = cholmod_analyze(&A, &w.common);
  return w.factor != nullptr && w.common.status >= CHOLMOD_OK;
}

bool SparseCholesky::factor(std::span<double> values) {
  Workspace& w = *workspace_;
  if (!w.factor) return false;
  w.matrix.x = values.data();
  w.matrix.xtype = CHOLMOD_REAL;
  double sum = 0;
  for (double value : values) sum += value * 0.0;
  if (sum != 0 || std::isnan(sum)) return false;  // NaN or infinity in the matrix
  if (!cholmod_factorize(&w.matrix, w.factor, &w.common)) return false;
  return w.common.status == CHOLMOD_OK && w.factor->minor == w.factor->n;
}

void SparseCholesky::solve_in_place(std::span<double> x) {
  Workspace& w = *workspace_;
  w.rhs.nrow = w.rhs.nzmax = w.rhs.d = x.size();
  w.rhs.ncol = 1;
  w.rhs.x = x.data();
  w.rhs.z = nullptr;
  w.rhs.xtype = CHOLMOD_REAL;
  w.rhs.dtype = CHOLMOD_DOUBLE;
  if (!cholmod_solve2(CHOLMOD_A, w.factor, &w.rhs, nullptr, &w.x, nullptr, &w.y, &w.e, &w.common)) {
    std::fill(x.begin(), x.end(), std::nan(""));
    return;
  }
  std::copy_n(static_cast<const double*>(w.x->x), x.size(), x.data());
}

long SparseCholesky::factor_entries() const {
  const Workspace& w = *workspace_;
  return w.factor ? static_cast<long>(w.factor->nzmax) : 0;
}

void block_order(const SymmetricPattern& graph, std::vector<int>& order) {
  const int n = graph.order();
  order.resize(n);
  std::iota(order.begin(), order.end(), 0);
  if (n < 3) return;
  // amd_order wants sorted columns without repeats or accepts any with AMD_OK_BUT_JUMBLED: both are answers.
  if (amd_order(n, graph.column.data(), graph.row.data(), order.data(), nullptr, nullptr) < AMD_OK)
    std::iota(order.begin(), order.end(), 0);
}

}  // namespace cb
