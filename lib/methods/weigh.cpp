#include "methods/weigh.h"

#include <cmath>
#include <string>

#include "linalg/finite.h"

namespace cb {

bool weigh(const ContactProblem& problem, BlockCholesky& factor, std::vector<double>& weight,
           ContactSolution& solution) {
  const auto fail = [&](Status status, std::string reason) {
    solution.status = status;
    solution.reason = std::move(reason);
    return false;
  };
  if (!all_finite(problem.M.values) || !all_finite(problem.J.values) || !all_finite(problem.v_minus) ||
      !all_finite(problem.offset) || !all_finite(problem.mu) || !all_finite(problem.restitution))
    return fail(Status::not_finite, "NaN or infinity in the contact problem");
  if (!factor.factor(problem.M)) return fail(Status::singular, "the mass matrix is not positive definite");
  contact_weights(problem, factor, weight);
  for (int c = 0; c < problem.nc(); ++c) {
    if (!(weight[c] > 0) || !std::isfinite(weight[c]))
      return fail(Status::input_error, "contact " + std::to_string(c) + " joins two fixed bodies (W_ii = 0)");
    if (problem.mu[c] < 0)
      return fail(Status::input_error, "contact " + std::to_string(c) + " has a negative coefficient of friction");
  }
  return true;
}

}  // namespace cb
