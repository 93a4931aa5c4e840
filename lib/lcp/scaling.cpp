// Scales of the pairs of an LCP (scaling.h).

#include "lcp/scaling.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

namespace cb {

namespace {

/// The power of two next to x > 0, by its exponent bits; scales beyond the range of normal numbers stay as they are.
double power_of_two_near(double x) {
  const double above = x * M_SQRT2;
  if (!(above >= std::numeric_limits<double>::min() && above <= std::numeric_limits<double>::max())) return x;
  return std::bit_cast<double>(std::bit_cast<std::uint64_t>(above) & 0x7ff0000000000000ULL);
}

/// Scales of pairs with a diagonal; false where some have none.
bool scale_known(PairScales& scales) {
  const Eigen::Index n = scales.rho.size();
  scales.rows.resize(n);
  scales.columns.resize(n);
  bool whole = true;
  for (Eigen::Index i = 0; i < n; ++i) {
    const bool known = scales.rho[i] > 0;
    scales.rows[i] = scales.columns[i] = known ? power_of_two_near(1 / std::sqrt(scales.rho[i])) : 0;
    whole = whole && known;
  }
  return whole;
}

/// As in the dense form: a diagonal that is tiny beside the pair's coupling says nothing about the pair.
void drop_tiny_diagonals(const SparseMatrix& D, Eigen::VectorXd& rho) {
  const double largest = rho.size() > 0 ? rho.maxCoeff() : 0;
  const auto tiny = [&](double x) { return x > 0 && x <= zero_diagonal * largest; };
  if (!std::any_of(rho.begin(), rho.end(), tiny)) return;
  Eigen::VectorXd row = rho, column = rho;
  for (int j = 0; j < D.outerSize(); ++j)
    for (SparseMatrix::InnerIterator d(D, j); d; ++d) {
      row[d.row()] = std::max(row[d.row()], std::abs(d.value()));
      column[j] = std::max(column[j], std::abs(d.value()));
    }
  for (Eigen::Index i = 0; i < rho.size(); ++i)
    if (tiny(rho[i]) && rho[i] <= zero_diagonal * std::sqrt(row[i] * column[i])) rho[i] = 0;
}

/// Notes the coupling of a pair i that has no diagonal with a pair j that has one.
void note_coupling(PairScales& scales, Eigen::Index i, Eigen::Index j, double m_ij, double m_ji) {
  const double rho = scales.rho[j];
  if (!(rho > 0)) return;
  scales.loop[i] = std::max(scales.loop[i], std::abs(m_ij * m_ji) / rho);
  scales.along_row[i] = std::max(scales.along_row[i], m_ij * m_ij / rho);
  scales.along_column[i] = std::max(scales.along_column[i], m_ji * m_ji / rho);
}

/// Scales of the pairs without a diagonal, from the couplings noted.
void scale_coupled(PairScales& scales) {
  for (Eigen::Index i = 0; i < scales.rho.size(); ++i) {
    if (scales.rho[i] > 0) continue;
    const double row = scales.along_row[i], column = scales.along_column[i], coupling = std::max(row, column);
    const double rho = scales.loop[i] > 0 ? scales.loop[i] : coupling > 0 ? coupling : 1.0;
    scales.rho[i] = rho;
    scales.rows[i] = power_of_two_near(1 / std::sqrt(row > 0 ? row : rho));
    scales.columns[i] = power_of_two_near(1 / std::sqrt(column > 0 ? column : rho));
  }
}

}  // namespace

void pair_scales(const LcpProblem& problem, PairScales& scales) {
  const int n = problem.n();
  auto& rho = scales.rho;
  rho.resize(n);
  for (Eigen::VectorXd* x : {&scales.loop, &scales.along_row, &scales.along_column}) x->setZero(n);
  if (!problem.expanded) {
    const auto& M = problem.M;
    // A diagonal that is tiny beside the row's coupling says nothing about the pair; look only where it might be.
    const double largest = n > 0 ? M.diagonal().cwiseAbs().maxCoeff() : 0;
    for (int i = 0; i < n; ++i) {
      rho[i] = std::abs(M(i, i));
      if (rho[i] == 0 || rho[i] > zero_diagonal * largest) continue;
      if (rho[i] <= zero_diagonal * std::sqrt(M.row(i).cwiseAbs().maxCoeff() * M.col(i).cwiseAbs().maxCoeff()))
        rho[i] = 0;
    }
    if (scale_known(scales)) return;
    for (int i = 0; i < n; ++i) {
      if (rho[i] != 0) continue;
      for (int j = 0; j < n; ++j)
        if (M(j, i) != 0 || M(i, j) != 0) note_coupling(scales, i, j, M(i, j), M(j, i));
    }
    scale_coupled(scales);
    return;
  }

  // diag(D) - sum_k C_ik B_ki / A_kk, column k of C against row k of B, both by a cursor on the first.
  rho.setZero();
  const SparseMatrix& C = problem.C;
  scales.cursor.assign(C.outerIndexPtr(), C.outerIndexPtr() + problem.nx());
  for (int j = 0; j < n; ++j)
    for (SparseMatrix::InnerIterator b(problem.B, j); b; ++b) {
      const auto k = static_cast<int>(b.row());
      int& c = scales.cursor[k];
      const int end = C.outerIndexPtr()[k + 1];
      while (c < end && C.innerIndexPtr()[c] < j) ++c;
      const double a = problem.A.coeff(k, k);
      if (c < end && C.innerIndexPtr()[c] == j && a != 0) rho[j] -= C.valuePtr()[c] * b.value() / a;
    }
  for (int j = 0; j < n; ++j) rho[j] = std::abs(rho[j] + problem.D.coeff(j, j));
  drop_tiny_diagonals(problem.D, rho);
  if (scale_known(scales)) return;
  for (int j = 0; j < n; ++j)
    for (SparseMatrix::InnerIterator d(problem.D, j); d; ++d) {
      const auto i = static_cast<int>(d.row());
      if (rho[i] == 0) note_coupling(scales, i, j, d.value(), problem.D.coeff(j, i));
      if (rho[j] == 0) note_coupling(scales, j, i, problem.D.coeff(j, i), d.value());
    }
  scale_coupled(scales);
}

bool ScaledLoad::set(const LcpProblem& problem) {
  of = &problem;
  root = scales.rho.cwiseSqrt();
  size = 0;
  for (Eigen::Index i = 0; i < original.size(); ++i) size = std::max(size, std::abs(original[i]) / root[i]);
  if (size == 0) size = 1;
  judged = std::max(size, problem.size);
  q = original.cwiseProduct(scales.rows) / size;
  return std::isfinite(q.sum() + root.sum() + scales.rows.sum() + scales.columns.sum());
}

}  // namespace cb
