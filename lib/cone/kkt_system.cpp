// Assembly and factorisation of the linear systems of the cone programs (kkt_system.h says which, and why no pivoting
// is needed). Dense: A = M + N^T D N = L L^T, X = L^-1 M, then J^T G J + X^T X = M A^-1 M + J^T G J is positive
// definite.

#include "cone/kkt_system.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <numeric>

namespace cb {

namespace {

template <int N>
using Square = Eigen::Map<Eigen::Matrix<double, N, N>>;
template <int N>
using Vector = Eigen::Map<Eigen::Matrix<double, N, 1>>;
using Band6 = Eigen::Matrix<double, 3, 6>;
using Strided = Eigen::Map<Eigen::MatrixXd, 0, Eigen::OuterStride<>>;

}  // namespace

void KktSystem::prepare(const BlockDiagonalMatrix& M, const BandMatrix& J, int dense_limit) {
  M_ = &M;
  J_ = &J;
  dense_ = M.order() <= dense_limit || (M.blocks() == 1 && dense_limit > 0);  // one block is dense anyway
  if (dense_) {
    const std::size_t n = static_cast<std::size_t>(M.order());
    A_.resize(n * n);
    X_.resize(n * n);
    C_.resize(n * n);
  } else if (!same_structure()) {
    first_ = M.first;
    band_ = J.band;
    block_ = J.block;
    one_velocity_.ready = two_velocities_.ready = false;
  }
}

bool KktSystem::same_structure() const { return first_ == M_->first && band_ == J_->band && block_ == J_->block; }

bool KktSystem::factor(std::span<const double> G, std::span<const double> D) {
  two_ = !D.empty();
  if (!dense_) return factor_sparse(G, D);
  return M_->order() == 6 ? factor_dense<6>(G, D) : factor_dense<Eigen::Dynamic>(G, D);
}

void KktSystem::solve_in_place(std::span<double> h1, std::span<double> h2) {
  if (dense_) {
    if (M_->order() == 6)
      solve_dense<6>(h1.data(), h2.data());
    else
      solve_dense<Eigen::Dynamic>(h1.data(), h2.data());
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
  if (dense_) {
    if (M_->order() == 6)
      solve_dense<6>(nullptr, h2.data());
    else
      solve_dense<Eigen::Dynamic>(nullptr, h2.data());
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
  if (dense_) return static_cast<long>(A_.size() + C_.size());
  return (one_velocity_.ready ? one_velocity_.factor.factor_entries() : 0) +
         (two_velocities_.ready ? two_velocities_.factor.factor_entries() : 0);
}

template <int N>
bool KktSystem::factor_dense(std::span<const double> G, std::span<const double> D) {
  const int n = M_->order();
  Square<N> A(A_.data(), n, n), X(X_.data(), n, n), C(C_.data(), n, n);
  X.setZero();
  for (int b = 0; b < M_->blocks(); ++b)
    X.block(M_->first[b], M_->first[b], M_->block_size(b), M_->block_size(b)) = M_->block(b);
  if (two_) {
    A = X;
    for (int c = 0; c < J_->bands(); ++c) {
      if (D[c] == 0) continue;
      for (int e = J_->band[c]; e < J_->band[c + 1]; ++e)
        for (int f = J_->band[c]; f <= e; ++f) {
          const auto E = J_->entry(e), F = J_->entry(f);
          const int row = M_->first[J_->block[e]], col = M_->first[J_->block[f]];
          A.block(row, col, E.cols(), F.cols()).noalias() += (D[c] * E.row(0).transpose()) * F.row(0);
        }
    }
    Eigen::Ref<Eigen::Matrix<double, N, N>> in_place(A);
    const Eigen::LLT<Eigen::Ref<Eigen::Matrix<double, N, N>>> cholesky(in_place);
    if (cholesky.info() != Eigen::Success) return false;
    A.template triangularView<Eigen::Lower>().solveInPlace(X);
    C.noalias() = X.transpose() * X;
  } else {
    C = X;
  }
  for (int c = 0; c < J_->bands(); ++c) {
    const Eigen::Map<const Eigen::Matrix3d> Gc(G.data() + 9 * c);
    for (int e = J_->band[c]; e < J_->band[c + 1]; ++e)
      for (int f = J_->band[c]; f <= e; ++f) {
        const int row = M_->first[J_->block[e]], col = M_->first[J_->block[f]];
        const int rows = M_->block_size(J_->block[e]), cols = M_->block_size(J_->block[f]);
        if (rows == 6 && cols == 6) {
          const Eigen::Map<const Band6> E(J_->values.data() + J_->offset[e]), F(J_->values.data() + J_->offset[f]);
          const Band6 GF = Gc * F;
          C.template block<6, 6>(row, col).noalias() += E.transpose() * GF;
        } else {
          C.block(row, col, rows, cols).noalias() += J_->entry(e).transpose() * (Gc * J_->entry(f)).eval();
        }
      }
  }
  Eigen::Ref<Eigen::Matrix<double, N, N>> in_place(C);
  const Eigen::LLT<Eigen::Ref<Eigen::Matrix<double, N, N>>> cholesky(in_place);
  return cholesky.info() == Eigen::Success;
}

// dv = A^-1 (h1 + M dw), (M A^-1 M + J^T G J) dw = h2 - M A^-1 h1.
template <int N>
void KktSystem::solve_dense(double* h1, double* h2) {
  const int n = M_->order();
  const Square<N> A(A_.data(), n, n), X(X_.data(), n, n), C(C_.data(), n, n);
  Vector<N> w(h2, n);
  if (h1) {
    Vector<N> v(h1, n);
    A.template triangularView<Eigen::Lower>().solveInPlace(v);
    w.noalias() -= X.transpose() * v;
  }
  C.template triangularView<Eigen::Lower>().solveInPlace(w);
  C.template triangularView<Eigen::Lower>().transpose().solveInPlace(w);
  if (h1) {
    Vector<N> v(h1, n);
    v.noalias() += X * w;
    A.template triangularView<Eigen::Lower>().transpose().solveInPlace(v);
  }
}

// Pattern in the order of elimination. Columns of dv_b: dv_b, dw_b, dv of later neighbours. Columns of dw_b: dw_b, dw
// of later neighbours. All columns of a node have the same rows, so that a block of values has a constant stride.
void KktSystem::analyse(Sparse& s, bool two) {
  const int blocks = M_->blocks();
  // Graph of the blocks.
  std::vector<std::vector<int>> neighbours(blocks);
  for (int c = 0; c < J_->bands(); ++c)
    for (int e = J_->band[c]; e < J_->band[c + 1]; ++e)
      for (int f = J_->band[c]; f < J_->band[c + 1]; ++f)
        if (e != f) neighbours[J_->block[e]].push_back(J_->block[f]);
  SymmetricPattern graph;
  graph.column.assign(1, 0);
  for (auto& list : neighbours) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
    graph.row.insert(graph.row.end(), list.begin(), list.end());
    graph.column.push_back(static_cast<int>(graph.row.size()));
  }
  std::vector<int> order, place(blocks);
  block_order(graph, order);
  for (int k = 0; k < blocks; ++k) place[order[k]] = k;

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

  s.pattern.column.assign(1, 0);
  s.pattern.row.clear();
  s.column_rows.assign(2 * blocks, 0);
  s.diagonal_v.assign(blocks, 0);
  s.coupling.assign(blocks, 0);
  s.diagonal_w.assign(blocks, 0);
  // Where the block of a later neighbour starts within a column: found by place.
  std::vector<std::vector<std::pair<int, int>>> start(blocks);
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
    for (int j : neighbours[b])
      if (place[j] > k) later.push_back(j);
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

  // Each pair of entries of a band adds to one block; the earlier block of the order owns the columns.
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
  s.ready = s.factor.analyse(s.pattern);
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
