// What stands in front of every solver (front.h).

#include "lcp/front.h"

#include <cmath>

#include "linalg/finite.h"

namespace cb {

namespace {

bool finite(const LcpProblem& problem) {
  const auto whole = [](const double* x, Eigen::Index size) { return all_finite({x, static_cast<std::size_t>(size)}); };
  if (!whole(problem.q.data(), problem.q.size())) return false;
  if (!problem.expanded) return whole(problem.M.data(), problem.M.size());
  for (const SparseMatrix* matrix : {&problem.A, &problem.B, &problem.C, &problem.D})
    if (!whole(matrix->valuePtr(), matrix->nonZeros())) return false;
  return whole(problem.a.data(), problem.a.size());
}

/// Ends what is not solved, with a reason: always false.
bool refuse(LcpSolution& solution, LcpStatus status, const char* reason) {
  solution.status = status;
  solution.reason = reason;
  solution.x.resize(0);
  return false;
}

constexpr const char* no_numbers = "the data are not finite";
constexpr const char* no_free_unknowns = "the block of the free unknowns is singular";

}  // namespace

bool Front::open(const LcpProblem& problem, LcpSolution& solution) {
  const int n = problem.n();
  problem_ = form_ = &problem;
  pivot_limit_ = o_.pivot_limit > 0 ? o_.pivot_limit : 50 * (n + problem.nx()) + 1000;
  solution.reason.clear();
  solution.pivots = solution.factorisations = 0;
  solution.peak_memory_mb = 0;
  solution.residual = HUGE_VAL;
  solution.z.setZero(n);
  if (!problem.expanded) solution.x.resize(0);

  if (!finite(problem)) return refuse(solution, LcpStatus::not_finite, no_numbers);
  if (problem.expanded && (wants_ == Wants::dense_matrix || n <= o_.dense_limit)) {
    if (!condense(problem, condensed_)) return refuse(solution, LcpStatus::singular, no_free_unknowns);
    if (!finite(condensed_)) return refuse(solution, LcpStatus::not_finite, no_numbers);
    form_ = &condensed_;
  }
  if (n == 0) {
    solution.status = LcpStatus::solved;
    solution.residual = 0;
    if (problem.expanded) recover_free(problem, solution.z, solution.x);
    return false;
  }
  return wants_ == Wants::dense_matrix || start_basis(solution);
}

bool Front::start_basis(LcpSolution& solution) {
  pair_scales(*form_, load_.scales);
  basis_ = &kernels_.of(*form_);
  basis_->start(*form_, load_.scales);
  if (!basis_->eliminate()) return refuse(solution, LcpStatus::singular, no_free_unknowns);
  load_.original = basis_->eliminated_load();
  return load_.set(*problem_) || refuse(solution, LcpStatus::not_finite, no_numbers);
}

void Front::close(LcpSolution& solution) {
  if (wants_ == Wants::basis) solution.factorisations += basis_->factorisations();
  if (!problem_->expanded) return;
  if (form_->expanded)
    kernels_.sparse.free_unknowns(solution.z, solution.x);
  else
    recover_free(*problem_, solution.z, solution.x);
}

}  // namespace cb
