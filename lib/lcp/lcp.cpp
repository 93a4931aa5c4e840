// What all LCP solvers share: the pair scales, the natural residual, names.
//
// The residual of z (dimensionless):
//   max_i | min(z_i sqrt(rho_i), w_i / sqrt(rho_i)) | / max_i ( |q_i| / sqrt(rho_i) )
// with rho_i of scaling.h. The denominator is data, not answer: a huge z, as a ray returns it, cannot hide an error. It
// is common to all rows: an idle pair (q_i = 0) whose w_i is round-off is measured against what the problem is about,
// and is not flagged. Symmetric scaling of the pairs (z_i -> z_i / s_i, w_i -> s_i w_i: a change of units) leaves it
// unchanged. Where q = 0 the denominator is 1.

#include "lcp/lcp.h"

#include <Eigen/SparseLU>
#include <array>
#include <cmath>

#include "lcp/scaling.h"

namespace cb {

namespace {

constexpr std::array<std::string_view, 10> status_names{"solved",       "inaccurate", "ray",        "nonconverged",
                                                        "cycling",      "singular",   "not_finite", "time_limit",
                                                        "memory_limit", "unavailable"};

/// Completes rho where the diagonal is zero; `each_entry(f)` calls f(i, j, M_ij) for every coupling.
template <class EachEntry>
void complete(Eigen::VectorXd& rho, EachEntry&& each_entry) {
  const Eigen::Index n = rho.size();
  bool complete_already = true;
  for (Eigen::Index i = 0; i < n; ++i) complete_already = complete_already && rho[i] > 0;
  if (complete_already) return;
  // Entries of rho below zero mark the incomplete rows and hold minus the largest coupling^2 / rho_j so far.
  for (Eigen::Index i = 0; i < n; ++i)
    if (!(rho[i] > 0)) rho[i] = -0.0;
  each_entry([&](int i, int j, double m) {
    if (std::signbit(rho[i]) && !std::signbit(rho[j]) && rho[j] > 0) rho[i] = std::min(rho[i], -m * m / rho[j]);
    if (std::signbit(rho[j]) && !std::signbit(rho[i]) && rho[i] > 0) rho[j] = std::min(rho[j], -m * m / rho[i]);
  });
  for (Eigen::Index i = 0; i < n; ++i)
    if (std::signbit(rho[i])) rho[i] = rho[i] < 0 ? -rho[i] : 1.0;
}

}  // namespace

std::string_view name(LcpStatus status) { return status_names[static_cast<std::size_t>(status)]; }

void pair_scales(const LcpProblem& problem, Eigen::VectorXd& rho) {
  const int n = problem.n();
  rho.resize(n);
  if (!problem.expanded) {
    const auto& M = problem.M;
    // A diagonal that is tiny beside the row's coupling says nothing about the pair: only then look at row and column.
    const double largest = n > 0 ? M.diagonal().cwiseAbs().maxCoeff() : 0;
    bool whole = n > 0;
    for (int i = 0; i < n; ++i) {
      rho[i] = std::abs(M(i, i));
      whole = whole && rho[i] > zero_diagonal * largest;
    }
    if (whole) return;
    for (int i = 0; i < n; ++i)
      if (rho[i] <= zero_diagonal * largest &&
          rho[i] <= zero_diagonal * std::sqrt(M.row(i).cwiseAbs().maxCoeff() * M.col(i).cwiseAbs().maxCoeff()))
        rho[i] = 0;
    complete(rho, [&](auto&& couple) {
      for (int i = 0; i < n; ++i) {
        if (!std::signbit(rho[i])) continue;
        for (int j = 0; j < n; ++j) {
          if (std::signbit(rho[j])) continue;
          const double m = std::max(std::abs(M(i, j)), std::abs(M(j, i)));
          couple(i, j, m);
        }
      }
    });
    return;
  }
  // Expanded: C B / A_kk row by row through the columns of C and the rows of B.
  rho.setZero();
  static thread_local SparseMatrix transposed;  // B^T: column k holds row k of B
  transposed = problem.B.transpose();
  for (int k = 0; k < problem.nx(); ++k) {
    const double a = problem.A.coeff(k, k);
    if (a == 0) continue;
    SparseMatrix::InnerIterator b(transposed, k);
    for (SparseMatrix::InnerIterator c(problem.C, k); c; ++c) {
      while (b && b.row() < c.row()) ++b;
      if (b && b.row() == c.row()) rho[c.row()] -= c.value() * b.value() / a;
    }
  }
  for (int j = 0; j < n; ++j)
    for (SparseMatrix::InnerIterator d(problem.D, j); d; ++d)
      if (d.row() == j) rho[j] += d.value();
  rho = rho.cwiseAbs();
  complete(rho, [&](auto&& couple) {
    for (int j = 0; j < n; ++j)
      for (SparseMatrix::InnerIterator d(problem.D, j); d; ++d)
        if (d.row() != j) couple(static_cast<int>(d.row()), j, std::abs(d.value()));
  });
}

bool recover_free(const LcpProblem& problem, const Eigen::VectorXd& z, Eigen::VectorXd& x) {
  Eigen::SparseLU<SparseMatrix> lu;
  lu.compute(problem.A);
  if (lu.info() != Eigen::Success) return false;
  const Eigen::VectorXd right = -(problem.B * z + problem.a);
  x = lu.solve(right);
  x += lu.solve(right - problem.A * x);
  return x.allFinite();
}

bool condense(const LcpProblem& problem, LcpProblem& dense) {
  Eigen::SparseLU<SparseMatrix> lu;
  lu.compute(problem.A);
  if (lu.info() != Eigen::Success) return false;
  dense.expanded = false;
  dense.M = problem.D;
  dense.M -= problem.C * lu.solve(Eigen::MatrixXd(problem.B));
  dense.q = problem.q - problem.C * lu.solve(problem.a);
  return true;
}

double natural_residual(const LcpProblem& problem, const Eigen::VectorXd& z) {
  constexpr double refused = std::numeric_limits<double>::infinity();
  if (z.size() != problem.n() || !z.allFinite()) return refused;
  Eigen::VectorXd w, q = problem.q, rho;
  if (problem.expanded) {
    Eigen::VectorXd x, x0;
    if (!recover_free(problem, z, x) || !recover_free(problem, Eigen::VectorXd::Zero(problem.n()), x0)) return refused;
    w = problem.q + problem.C * x + problem.D * z;
    q += problem.C * x0;
  } else {
    w = problem.q + problem.M * z;
  }
  pair_scales(problem, rho);
  double scale = 0, worst = 0;
  for (int i = 0; i < problem.n(); ++i) {
    const double root = std::sqrt(rho[i]);
    scale = std::max(scale, std::abs(q[i]) / root);
    const double e = std::abs(std::min(z[i] * root, w[i] / root));
    if (!(e <= worst)) worst = e;  // a NaN stays
  }
  if (!std::isfinite(worst)) return refused;
  return worst / (scale > 0 ? scale : 1.0);
}

}  // namespace cb
