#include "ncp/velocity_system.h"

#include <algorithm>

#include "linalg/pack.h"

namespace cb {

namespace {

constexpr int lanes = pack_size;

// C += E^T A F: E^T as three padded columns of `rows`, F 3 x columns, A 3 x 3, all column-major.
void add_product(double* C, int stride, const double* Et, int rows, const double* A, const double* F, int columns) {
  for (int j = 0; j < columns; ++j, C += stride, F += 3) {
    const double a = A[0] * F[0] + A[3] * F[1] + A[6] * F[2];
    const double b = A[1] * F[0] + A[4] * F[1] + A[7] * F[2];
    const double c = A[2] * F[0] + A[5] * F[1] + A[8] * F[2];
    for (int i = 0; i < rows; i += lanes) {
      Pack x, e, f, g;
      load(C + i, x);
      load(Et + i, e);
      load(Et + rows + i, f);
      load(Et + 2 * rows + i, g);
      add_fused(e, a, x);
      add_fused(f, b, x);
      add_fused(g, c, x);
      store(x, C + i);
    }
  }
}

SymmetricPattern graph(const BandMatrix& J, int blocks) {
  std::vector<std::vector<int>> neighbours(blocks);
  for (int c = 0; c < J.bands(); ++c)
    for (int e = J.band[c]; e < J.band[c + 1]; ++e)
      for (int f = J.band[c]; f < J.band[c + 1]; ++f)
        if (J.block[e] != J.block[f]) neighbours[J.block[e]].push_back(J.block[f]);
  SymmetricPattern out;
  for (auto& list : neighbours) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
    out.row.insert(out.row.end(), list.begin(), list.end());
    out.column.push_back(static_cast<int>(out.row.size()));
  }
  return out;
}

}  // namespace

void VelocitySystem::prepare(const BlockDiagonalMatrix& M, const BandMatrix& J) {
  M_ = &M;
  J_ = &J;
  G_.clear();
  if (first_ != M.first || band_ != J.band || block_ != J.block) analyse();
  for (std::size_t e = 0; e < block_.size(); ++e) {
    const int size = M.block_size(block_[e]), rows = BlockLu::padded(size);
    const double* in = J.values.data() + J.offset[e];
    double* out = transposed_.data() + transposed_at_[e];
    for (int j = 0; j < size; ++j)
      for (int i = 0; i < 3; ++i) out[i * rows + j] = in[3 * j + i];
  }
}

void VelocitySystem::analyse() {
  first_ = M_->first;
  band_ = J_->band;
  block_ = J_->block;
  const int blocks = M_->blocks();
  std::vector<int> sizes(blocks);
  for (int b = 0; b < blocks; ++b) sizes[b] = M_->block_size(b);
  lu_.analyse(sizes, graph(*J_, blocks));
  diagonal_.clear();
  for (int b = 0; b < blocks; ++b) diagonal_.push_back(lu_.place(b, b));
  pair_.clear();
  for (int c = 0; c < J_->bands(); ++c)
    for (int e = band_[c]; e < band_[c + 1]; ++e)
      for (int f = band_[c]; f <= e; ++f) pair_.push_back(lu_.place(block_[e], block_[f]));
  transposed_at_.assign(1, 0);
  for (const int b : block_) transposed_at_.push_back(transposed_at_.back() + 3 * BlockLu::padded(sizes[b]));
  transposed_.assign(transposed_at_.back(), 0.0);
}

// The padding of J^T reaches into rows that are not meant, and adds zeros to them.
bool VelocitySystem::factor(std::span<const double> G) {
  if (std::equal(G.begin(), G.end(), G_.begin(), G_.end())) return true;
  G_.clear();
  const std::span<double> lower = lu_.lower(), upper = lu_.upper();
  std::fill(lower.begin(), lower.end(), 0.0);
  std::fill(upper.begin(), upper.end(), 0.0);
  for (int b = 0; b < M_->blocks(); ++b) {
    const int size = M_->block_size(b);
    const double* in = M_->values.data() + M_->offset[b];
    double* out = lower.data() + diagonal_[b].at;
    for (int j = 0; j < size; ++j, in += size, out += diagonal_[b].stride)
      for (int i = 0; i < size; ++i) out[i] = in[i];  // a call for each column would take longer
  }
  std::size_t pair = 0;
  for (int c = 0; c < J_->bands(); ++c) {
    const double* A = G.data() + 9 * static_cast<std::size_t>(c);
    const double At[] = {A[0], A[3], A[6], A[1], A[4], A[7], A[2], A[5], A[8]};
    const bool none = std::all_of(A, A + 9, [](double x) { return x == 0; });
    for (int e = J_->band[c]; e < J_->band[c + 1]; ++e)
      for (int f = J_->band[c]; f <= e; ++f, ++pair) {
        if (none) continue;
        const auto [at, stride, swap] = pair_[pair];
        const int high = swap ? f : e, low = swap ? e : f;
        const int rows = BlockLu::padded(M_->block_size(J_->block[high])), columns = M_->block_size(J_->block[low]);
        const double* Et = transposed_.data() + transposed_at_[high];
        const double* F = J_->values.data() + J_->offset[low];
        add_product(lower.data() + at, stride, Et, rows, A, F, columns);
        if (f != e) add_product(upper.data() + at, stride, Et, rows, At, F, columns);
      }
  }
  if (!lu_.factor()) return false;
  G_.assign(G.begin(), G.end());
  return true;
}

void VelocitySystem::solve_in_place(std::span<double> h) {
  for (int b = 0; b < M_->blocks(); ++b) std::copy_n(h.data() + M_->first[b], M_->block_size(b), lu_.part(b));
  lu_.solve();
  for (int b = 0; b < M_->blocks(); ++b) std::copy_n(lu_.part(b), M_->block_size(b), h.data() + M_->first[b]);
}

}  // namespace cb
