// Minimise phi(v) = 1/2 |max(0, -(N v + w))|^2, rows of N scaled to length 1 in the metric of M. It is convex and
// piecewise quadratic: Newton's method (least squares over the rows that approach) with halved steps ends after
// finitely many. At the minimum lambda = max(0, -(N v + w)) has N^T lambda = 0 and lambda.w = -|lambda|^2: either 0, or
// the certificate.
#include "contact/feasibility.h"

#include <Eigen/QR>
#include <cmath>

#include "linalg/stop.h"

namespace cb {

namespace {

constexpr int most_contacts = 1000, most_steps = 200;
constexpr double certain = 1e-8;  ///< -: |N^T lambda| over |lambda|, and least |lambda| over |w|

}  // namespace

bool feasible(const ContactProblem& problem) {
  const int nc = problem.nc(), nv = problem.nv();
  BlockCholesky factor;
  if (nc > most_contacts || !factor.factor(problem.M)) return true;
  // Columns of A: L^-1 N^T, scaled.
  Eigen::MatrixXd A(nv, nc);
  Eigen::VectorXd w(nc);
  A.setZero();
  for (int c = 0; c < nc; ++c)
    for (int e = problem.J.band[c]; e < problem.J.band[c + 1]; ++e) {
      const auto entry = problem.J.entry(e);
      A.col(c).segment(problem.M.first[problem.J.block[e]], entry.cols()) = entry.row(0).transpose();
    }
  for (int b = 0; b < problem.M.blocks(); ++b) factor.solve_lower_in_place(b, A, problem.M.first[b]);
  for (int c = 0; c < nc; ++c) {
    const double length = A.col(c).norm();
    if (!(length > 0) || !std::isfinite(length)) return true;
    A.col(c) /= length;
    w[c] = problem.offset[3 * c] / length;
  }

  Eigen::VectorXd v = Eigen::VectorXd::Zero(nv), lambda;
  const auto approach = [&](const Eigen::VectorXd& at) -> Eigen::VectorXd {
    return (-(A.transpose() * at + w)).cwiseMax(0.0);
  };
  lambda = approach(v);
  for (int step = 0; step < most_steps; ++step) {
    poll_stop();
    const double size = lambda.norm();
    if (!(size > certain * w.norm())) return true;
    if ((A * lambda).norm() <= certain * size) return !(lambda.dot(w) < 0);
    std::vector<int> rows;
    for (int c = 0; c < nc; ++c)
      if (lambda[c] > 0) rows.push_back(c);
    const Eigen::MatrixXd active = A(Eigen::all, rows).transpose();
    const Eigen::VectorXd way = active.completeOrthogonalDecomposition().solve(lambda(rows));
    double part = 1;
    Eigen::VectorXd next = approach(v + way);
    while (!(next.norm() < size) && part > 1e-12) next = approach(v + (part /= 2) * way);
    if (!(next.norm() < size)) return true;  // rounding: nothing is proven
    v += part * way;
    lambda = next;
  }
  return true;
}

}  // namespace cb
