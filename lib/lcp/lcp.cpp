// What all LCP solvers share: the natural residual, the two forms of a problem, names.
//
// The residual of z (dimensionless):
//   max_i | min(z_i sqrt(rho_i), w_i / sqrt(rho_i)) | / max ( size, max_i |q_i| / sqrt(rho_i) )
// with rho_i of scaling.h. The denominator is data, not answer: a huge z, as a ray returns it, cannot hide an error. It
// is common to all rows: an idle pair (q_i = 0) whose w_i is round-off is measured against what the problem is about,
// and is not flagged. Symmetric scaling of the pairs (z_i -> z_i / s_i, w_i -> s_i w_i: a change of units) leaves it
// unchanged. Where q = 0 the denominator is 1.

#include "lcp/lcp.h"

#include <Eigen/SparseLU>
#include <algorithm>
#include <array>
#include <cmath>

#include "lcp/scaling.h"

namespace cb {

namespace {

constexpr std::array<std::string_view, 9> status_names{
    "solved", "inaccurate", "ray", "nonconverged", "cycling", "singular", "not_finite", "memory_limit", "unavailable"};

/// x = A^-1 right, refined once; false where it is not finite.
bool solve_refined(const Eigen::SparseLU<SparseMatrix>& lu, const SparseMatrix& A, const Eigen::VectorXd& right,
                   Eigen::VectorXd& x) {
  x = lu.solve(right);
  x += lu.solve(right - A * x);
  return x.allFinite();
}

}  // namespace

std::string_view name(LcpStatus status) { return status_names[static_cast<std::size_t>(status)]; }

bool recover_free(const LcpProblem& problem, const Eigen::VectorXd& z, Eigen::VectorXd& x) {
  Eigen::SparseLU<SparseMatrix> lu;
  lu.compute(problem.A);
  return lu.info() == Eigen::Success && solve_refined(lu, problem.A, -(problem.B * z + problem.a), x);
}

bool condense(const LcpProblem& problem, LcpProblem& dense) {
  Eigen::SparseLU<SparseMatrix> lu;
  lu.compute(problem.A);
  if (lu.info() != Eigen::Success) return false;
  dense.expanded = false;
  dense.size = problem.size;
  dense.M = problem.D;
  // Eigen points at the first of no columns.
  if (problem.B.cols() > 0) dense.M -= problem.C * lu.solve(Eigen::MatrixXd(problem.B));
  dense.q = problem.q - problem.C * lu.solve(problem.a);
  return true;
}

double natural_residual(const LcpProblem& problem, const Eigen::VectorXd& z) {
  constexpr double refused = std::numeric_limits<double>::infinity();
  if (z.size() != problem.n() || !z.allFinite()) return refused;
  Eigen::VectorXd w, q = problem.q;
  PairScales scales;
  if (problem.expanded) {
    // What z adds is kept apart from A^-1 a: beside a large x of which q sees little, w would be its rounding.
    Eigen::SparseLU<SparseMatrix> lu;
    lu.compute(problem.A);
    if (lu.info() != Eigen::Success) return refused;
    Eigen::VectorXd x;
    if (!solve_refined(lu, problem.A, -problem.a, x)) return refused;
    q += problem.C * x;
    if (!solve_refined(lu, problem.A, -(problem.B * z), x)) return refused;
    w = q + (problem.C * x + problem.D * z);
  } else {
    w = q + problem.M * z;
  }
  pair_scales(problem, scales);
  double scale = problem.size, worst = 0;
  for (int i = 0; i < problem.n(); ++i) {
    const double root = std::sqrt(scales.rho[i]);
    scale = std::max(scale, std::abs(q[i]) / root);
    const double e = std::abs(std::min(w[i] / root, z[i] * root));
    if (std::isnan(e)) return refused;
    worst = std::max(worst, e);
  }
  if (!std::isfinite(worst)) return refused;
  return worst / (scale > 0 ? scale : 1.0);
}

}  // namespace cb
