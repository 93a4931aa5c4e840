// Assembly and factorisation of the linear systems of the cone programs (kkt_system.h says which, and why no pivoting
// is needed). By blocks, dv and dw of a body are one block; their zeros cost less than their indices would.

#include "cone/kkt_system.h"

#include <Eigen/Core>
#include <algorithm>
#include <numeric>

#include "linalg/pack.h"

namespace cb {

namespace {

using Band6 = Eigen::Matrix<double, 3, 6>;
using Strided = Eigen::Map<Eigen::MatrixXd, 0, Eigen::OuterStride<>>;

constexpr int lanes = pack_size;

// C += E^T (A F): E^T as three padded columns of `rows`, F 3 x columns, A 3 x 3, all column-major.
void add_congruence(double* C, int stride, const double* Et, int rows, const double* A, const double* F, int columns) {
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

// C += d e f^T, f every third of F: the first row of a band.
void add_outer(double* C, int stride, const double* e, int rows, double d, const double* F, int columns) {
  for (int j = 0; j < columns; ++j, C += stride, F += 3) {
    const double f = d * F[0];
    for (int i = 0; i < rows; i += lanes) {
      Pack x, y;
      load(C + i, x);
      load(e + i, y);
      add_fused(y, f, x);
      store(x, C + i);
    }
  }
}

}  // namespace

void KktSystem::prepare(const BlockDiagonalMatrix& M, const BandMatrix& J, double least_block) {
  M_ = &M;
  J_ = &J;
  by_blocks_ = M.order() >= least_block * M.blocks();
  if (!same_structure()) {
    first_ = M.first;
    band_ = J.band;
    block_ = J.block;
    one_velocity_blocks_.ready = two_velocities_blocks_.ready = false;
    one_velocity_.ready = two_velocities_.ready = false;
    transposed_at_.assign(1, 0);
    for (const int b : block_) transposed_at_.push_back(transposed_at_.back() + 3 * BlockLdl::padded(M.block_size(b)));
    transposed_.assign(transposed_at_.back(), 0.0);
  }
  if (!by_blocks_) return;
  for (std::size_t e = 0; e < block_.size(); ++e) {
    const int size = M.block_size(block_[e]), rows = BlockLdl::padded(size);
    const double* in = J.values.data() + J.offset[e];
    double* out = transposed_.data() + transposed_at_[e];
    for (int j = 0; j < size; ++j)
      for (int i = 0; i < 3; ++i) out[i * rows + j] = in[3 * j + i];
  }
}

bool KktSystem::same_structure() const { return first_ == M_->first && band_ == J_->band && block_ == J_->block; }

bool KktSystem::factor(std::span<const double> G, std::span<const double> D) {
  two_ = !D.empty();
  return by_blocks_ ? factor_blocks(G, D) : factor_sparse(G, D);
}

void KktSystem::solve_in_place(std::span<double> h1, std::span<double> h2) {
  if (by_blocks_) {
    BlockLdl& f = two_velocities_blocks_.factor;
    for (int b = 0; b < M_->blocks(); ++b) {
      const int at = M_->first[b], size = M_->block_size(b);
      std::copy_n(h1.data() + at, size, f.part(b));
      std::copy_n(h2.data() + at, size, f.part(b) + size);
    }
    f.solve();
    for (int b = 0; b < M_->blocks(); ++b) {
      const int at = M_->first[b], size = M_->block_size(b);
      const double* x = f.part(b);
      std::copy_n(x, size, h1.data() + at);
      for (int i = 0; i < size; ++i) h2[at + i] = -x[size + i];
    }
    return;
  }
  Sparse& s = two_velocities_;
  for (int b = 0; b < M_->blocks(); ++b) {
    std::copy_n(h1.data() + M_->first[b], M_->block_size(b), s.x.data() + s.at_v[b]);
    std::copy_n(h2.data() + M_->first[b], M_->block_size(b), s.x.data() + s.at_w[b]);
  }
  s.factor.solve_in_place(s.x);
  for (int b = 0; b < M_->blocks(); ++b) {
    std::copy_n(s.x.data() + s.at_v[b], M_->block_size(b), h1.data() + M_->first[b]);
    for (int i = 0; i < M_->block_size(b); ++i) h2[M_->first[b] + i] = -s.x[s.at_w[b] + i];
  }
}

void KktSystem::solve_in_place(std::span<double> h2) {
  if (by_blocks_) {
    BlockLdl& f = one_velocity_blocks_.factor;
    for (int b = 0; b < M_->blocks(); ++b) std::copy_n(h2.data() + M_->first[b], M_->block_size(b), f.part(b));
    f.solve();
    for (int b = 0; b < M_->blocks(); ++b) std::copy_n(f.part(b), M_->block_size(b), h2.data() + M_->first[b]);
    return;
  }
  Sparse& s = one_velocity_;
  for (int b = 0; b < M_->blocks(); ++b)
    std::copy_n(h2.data() + M_->first[b], M_->block_size(b), s.x.data() + s.at_w[b]);
  s.factor.solve_in_place(s.x);
  for (int b = 0; b < M_->blocks(); ++b)
    std::copy_n(s.x.data() + s.at_w[b], M_->block_size(b), h2.data() + M_->first[b]);
}

long KktSystem::factor_entries() const {
  if (by_blocks_)
    return (one_velocity_blocks_.ready ? one_velocity_blocks_.factor.entries() : 0) +
           (two_velocities_blocks_.ready ? two_velocities_blocks_.factor.entries() : 0);
  return (one_velocity_.ready ? one_velocity_.factor.factor_entries() : 0) +
         (two_velocities_.ready ? two_velocities_.factor.factor_entries() : 0);
}

SymmetricPattern KktSystem::graph() const {
  std::vector<std::vector<int>> neighbours(M_->blocks());
  for (int c = 0; c < J_->bands(); ++c)
    for (int e = J_->band[c]; e < J_->band[c + 1]; ++e)
      for (int f = J_->band[c]; f < J_->band[c + 1]; ++f)
        if (J_->block[e] != J_->block[f]) neighbours[J_->block[e]].push_back(J_->block[f]);
  SymmetricPattern out;
  for (auto& list : neighbours) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
    out.row.insert(out.row.end(), list.begin(), list.end());
    out.column.push_back(static_cast<int>(out.row.size()));
  }
  return out;
}

void KktSystem::analyse(Blocks& s, bool two) {
  std::vector<int> sizes(M_->blocks());
  for (int b = 0; b < M_->blocks(); ++b) sizes[b] = (two ? 2 : 1) * M_->block_size(b);
  s.factor.analyse(sizes, graph());
  s.diagonal.clear();
  for (int b = 0; b < M_->blocks(); ++b) s.diagonal.push_back(s.factor.place(b, b));
  s.pair.clear();
  for (int c = 0; c < J_->bands(); ++c)
    for (int e = J_->band[c]; e < J_->band[c + 1]; ++e)
      for (int f = J_->band[c]; f <= e; ++f) s.pair.push_back(s.factor.place(J_->block[e], J_->block[f]));
  s.ready = true;
}

// The padding of J^T reaches into rows that are not meant, and adds zeros to them.
bool KktSystem::factor_blocks(std::span<const double> G, std::span<const double> D) {
  Blocks& s = two_ ? two_velocities_blocks_ : one_velocity_blocks_;
  if (!s.ready) analyse(s, two_);
  const std::span<double> values = s.factor.values();
  std::fill(values.begin(), values.end(), 0.0);
  for (int b = 0; b < M_->blocks(); ++b) {
    const int size = M_->block_size(b), stride = s.diagonal[b].stride;
    const double* Mb = M_->values.data() + M_->offset[b];
    double* to = values.data() + s.diagonal[b].at;
    for (int j = 0; j < size; ++j) {
      std::copy_n(Mb + j * size, size, to + j * stride);
      if (two_) std::copy_n(Mb + j * size, size, to + j * stride + size);
    }
  }
  const double sign = two_ ? -1 : 1;  // the unknown is -dw
  std::size_t pair = 0;
  for (int c = 0; c < J_->bands(); ++c) {
    double A[9];
    for (int i = 0; i < 9; ++i) A[i] = sign * G[9 * c + i];
    const double d = two_ ? D[c] : 0;
    for (int e = J_->band[c]; e < J_->band[c + 1]; ++e)
      for (int f = J_->band[c]; f <= e; ++f, ++pair) {
        const auto [at, stride, swap] = s.pair[pair];
        const int high = swap ? f : e, low = swap ? e : f;
        const int high_size = M_->block_size(J_->block[high]), low_size = M_->block_size(J_->block[low]);
        const int rows = BlockLdl::padded(high_size);
        const double* Et = transposed_.data() + transposed_at_[high];
        const double* F = J_->values.data() + J_->offset[low];
        double* v = values.data() + at;
        double* w = two_ ? v + low_size * stride + high_size : v;
        add_congruence(w, stride, Et, rows, A, F, low_size);
        if (d != 0) add_outer(v, stride, Et, rows, d, F, low_size);
      }
  }
  return s.factor.factor();
}

// Pattern in the order of elimination. Columns of dv_b: dv_b, dw_b, dv of later neighbours. Columns of dw_b: dw_b, dw
// of later neighbours. All columns of a node have the same rows, so that a block of values has a constant stride.
void KktSystem::analyse(Sparse& s, bool two) {
  const int blocks = M_->blocks();
  const SymmetricPattern neighbours = graph();
  std::vector<int> order, place(blocks);
  block_order(neighbours, order);
  for (int k = 0; k < blocks; ++k) place[order[k]] = k;
  place_unknowns(s, two, order);
  const Starts start = lay_out_columns(s, two, neighbours, order, place);
  lay_out_pairs(s, two, start, place);
  s.ready = s.factor.analyse(s.pattern);
}

void KktSystem::place_unknowns(Sparse& s, bool two, const std::vector<int>& order) const {
  const int blocks = M_->blocks();
  s.at_v.assign(blocks, 0);
  s.at_w.assign(blocks, 0);
  int row = 0;
  for (int k = 0; k < blocks; ++k) {
    const int b = order[k], size = M_->block_size(b);
    s.at_v[b] = row;
    s.at_w[b] = two ? row + size : row;
    row += two ? 2 * size : size;
  }
  s.x.assign(row, 0.0);
}

KktSystem::Starts KktSystem::lay_out_columns(Sparse& s, bool two, const SymmetricPattern& neighbours,
                                             const std::vector<int>& order, const std::vector<int>& place) const {
  const int blocks = M_->blocks();
  s.pattern.column.assign(1, 0);
  s.pattern.row.clear();
  s.column_rows.assign(2 * blocks, 0);
  s.diagonal_v.assign(blocks, 0);
  s.coupling.assign(blocks, 0);
  s.diagonal_w.assign(blocks, 0);
  Starts start(blocks);
  std::vector<int> rows;
  const auto run = [&](int at, int size) {
    for (int i = 0; i < size; ++i) rows.push_back(at + i);
  };
  const auto columns = [&](int count) {
    for (int j = 0; j < count; ++j) {
      s.pattern.row.insert(s.pattern.row.end(), rows.begin(), rows.end());
      s.pattern.column.push_back(static_cast<int>(s.pattern.row.size()));
    }
  };
  for (int k = 0; k < blocks; ++k) {
    const int b = order[k], size = M_->block_size(b);
    std::vector<int> later;
    for (int e = neighbours.column[b]; e < neighbours.column[b + 1]; ++e)
      if (place[neighbours.row[e]] > k) later.push_back(neighbours.row[e]);
    std::sort(later.begin(), later.end(), [&](int i, int j) { return place[i] < place[j]; });
    if (two) {
      s.diagonal_v[b] = static_cast<int>(s.pattern.row.size());
      s.coupling[b] = s.diagonal_v[b] + size;
      rows.clear();
      run(s.at_v[b], 2 * size);
      for (int j : later) run(s.at_v[j], M_->block_size(j));
      s.column_rows[2 * b] = static_cast<int>(rows.size());
      columns(size);
    }
    s.diagonal_w[b] = static_cast<int>(s.pattern.row.size());
    rows.clear();
    run(s.at_w[b], size);
    for (int j : later) {
      start[b].emplace_back(j, static_cast<int>(rows.size()));
      run(s.at_w[j], M_->block_size(j));
    }
    s.column_rows[2 * b + 1] = static_cast<int>(rows.size());
    columns(size);
  }
  s.values.assign(s.pattern.row.size(), 0.0);
  return start;
}

// Each pair of entries of a band adds to one block; the earlier block of the order owns the columns.
void KktSystem::lay_out_pairs(Sparse& s, bool two, const Starts& start, const std::vector<int>& place) const {
  s.pair_v.clear();
  s.pair_w.clear();
  for (int c = 0; c < J_->bands(); ++c)
    for (int e = J_->band[c]; e < J_->band[c + 1]; ++e)
      for (int f = J_->band[c]; f <= e; ++f) {
        int high = J_->block[e], low = J_->block[f];
        const bool swap = place[high] < place[low];
        if (swap) std::swap(high, low);
        int offset = 0;
        for (const auto& [j, at] : start[low])
          if (j == high) offset = at;
        const int w = s.diagonal_w[low] + offset;
        const int v = two ? s.diagonal_v[low] + offset + (high == low ? 0 : M_->block_size(low)) : 0;
        s.pair_v.push_back(swap ? ~v : v);
        s.pair_w.push_back(swap ? ~w : w);
      }
}

bool KktSystem::factor_sparse(std::span<const double> G, std::span<const double> D) {
  Sparse& s = two_ ? two_velocities_ : one_velocity_;
  if (!s.ready) analyse(s, two_);
  if (!s.ready) return false;
  std::fill(s.values.begin(), s.values.end(), 0.0);
  const double sign = two_ ? -1 : 1;  // the unknown is -dw
  for (int b = 0; b < M_->blocks(); ++b) {
    const auto Mb = M_->block(b);
    const int size = M_->block_size(b);
    if (two_) {
      Strided(s.values.data() + s.diagonal_v[b], size, size, Eigen::OuterStride<>(s.column_rows[2 * b])) = Mb;
      Strided(s.values.data() + s.coupling[b], size, size, Eigen::OuterStride<>(s.column_rows[2 * b])) = Mb;
    } else {
      Strided(s.values.data() + s.diagonal_w[b], size, size, Eigen::OuterStride<>(s.column_rows[2 * b + 1])) = Mb;
    }
  }
  std::size_t pair = 0;
  for (int c = 0; c < J_->bands(); ++c) {
    const Eigen::Matrix3d Gc = sign * Eigen::Map<const Eigen::Matrix3d>(G.data() + 9 * c);
    for (int e = J_->band[c]; e < J_->band[c + 1]; ++e)
      for (int f = J_->band[c]; f <= e; ++f, ++pair) {
        const bool swap = s.pair_w[pair] < 0;
        const int high = swap ? f : e, low = swap ? e : f;
        const int block = J_->block[low];
        const auto E = J_->entry(high), F = J_->entry(low);
        double* w = s.values.data() + (swap ? ~s.pair_w[pair] : s.pair_w[pair]);
        if (E.cols() == 6 && F.cols() == 6) {
          const Eigen::Map<const Band6> E6(E.data()), F6(F.data());
          const Band6 GF = Gc * F6;
          Eigen::Map<Eigen::Matrix<double, 6, 6>, 0, Eigen::OuterStride<>>(
              w, Eigen::OuterStride<>(s.column_rows[2 * block + 1]))
              .noalias() += E6.transpose() * GF;
        } else {
          Strided(w, E.cols(), F.cols(), Eigen::OuterStride<>(s.column_rows[2 * block + 1])).noalias() +=
              E.transpose() * (Gc * F).eval();
        }
        if (two_ && D[c] != 0) {
          double* v = s.values.data() + (swap ? ~s.pair_v[pair] : s.pair_v[pair]);
          Strided(v, E.cols(), F.cols(), Eigen::OuterStride<>(s.column_rows[2 * block])).noalias() +=
              (D[c] * E.row(0).transpose()) * F.row(0);
        }
      }
  }
  return s.factor.factor(s.values);
}

}  // namespace cb
