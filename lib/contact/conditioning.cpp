#include "contact/conditioning.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

namespace cb {

bool ConditioningEstimate::measure(const ContactProblem& problem, Conditioning& out, int limit) {
  const int nc = problem.nc(), nv = problem.nv();
  if (nc == 0 || 3 * nc > limit || nv > limit || !factor_.factor(problem.M)) return false;
  contact_weights(problem, factor_, weight_);

  // M = L L^T block by block, so that J L^-T has the singular values of J M^-1/2. Scaled per contact.
  A_.setZero(3 * nc, nv);
  for (int c = 0; c < nc; ++c) {
    const double weight = weight_[c];
    if (!(weight > 0) || !std::isfinite(weight)) return false;
    for (int e = problem.J.band[c]; e < problem.J.band[c + 1]; ++e) {
      const int b = problem.J.block[e], size = problem.M.block_size(b);
      const Eigen::LLT<Eigen::MatrixXd> llt(problem.M.block(b));
      A_.block(3 * c, problem.M.first[b], 3, size) +=
          llt.matrixL().solve(problem.J.entry(e).transpose()).transpose() / std::sqrt(weight);
    }
  }
  out = Conditioning{};
  out.freedoms = nv;
  for (int row = 0; row < 3 * nc; ++row)
    if (!A_.row(row).isZero(0)) ++out.rows;

  // Eigenvalues of the smaller of A A^T (W itself) and A^T A.
  if (nv > 3 * nc)
    gram_.noalias() = A_ * A_.transpose();
  else
    gram_.noalias() = A_.transpose() * A_;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(gram_, Eigen::EigenvaluesOnly);
  const Eigen::VectorXd values = solver.eigenvalues().reverse();
  const double least = values[0] * std::max(out.rows, nv) * std::numeric_limits<double>::epsilon();
  for (const double value : values) {
    if (!(value > least)) break;
    ++out.rank;
    out.condition = values[0] / value;
  }
  return true;
}

}  // namespace cb
