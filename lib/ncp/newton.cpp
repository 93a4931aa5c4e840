// Exact Coulomb friction by Newton's method: proximal point outside, semismooth Newton inside, finished on Alart and
// Curnier's map, and believed only by a certificate.
//
// Problem: (1) of ncp.h, nc contacts, nv velocities. Attempts, the cheap ones first; each is a start (impulses and
// velocities), and whoever reaches the tolerance ends the rest:
//   guess    Newton's method on Alart and Curnier's map from the event before, or from no impulses (finish.h): what
//   rests
//            or slides steadily takes one or two factorisations
//   path     proximal steps around the impulses of the step before (proximal_newton.h) with compliances alpha w_c that
//            fall by `shrink` a step; where one does not come to its end alpha grows again. From alpha = 1, where
//            contacts are as soft as bodies are light, to the finish
//   slow     the same, from softer contacts, by smaller falls
//   swept    the same after some sweeps of Gauss and Seidel (nsgs.cpp), which rub out what Newton's method turns around
// Every impulse that is met is measured on fresh velocities (NcpMeasure); the best is returned, whatever its ending.
//
// Source: V. Acary, M. Bremond, O. Huber, On solving contact problems with Coulomb friction: formulations and numerical
// comparisons (2018), sec. 5: the most robust of their solvers is this pair.
// Differences: 1. in velocities, banded (proximal_newton.cpp); 2. alpha goes by the endings, not by a power of the
// error; 3. the finish; 4. several starts.
//
// Returns: solved; nonconverged, where no attempt came to the tolerance; singular, where none could factor its first
// system; not_finite.

#include <algorithm>
#include <cmath>

#include "linalg/finite.h"
#include "linalg/stop.h"
#include "ncp/finish.h"
#include "ncp/ncp.h"
#include "ncp/proximal_newton.h"

namespace cb {

namespace {

struct NewtonOptions : NcpOptions {
  ProximalNewton::Options proximal;
  AlartCurnierNewton::Options finish;
  int guess_patience = 2;  ///< of the finish from a guess
  /// -: compliances of a path: first, fall a step, growth where a step fails, least.
  struct Path {
    double first, shrink, grow, least;
    int limit;  ///< proximal steps
  };
  Path path{1, 0.1, 4, 1e-8, 40}, slow{10, 0.3, 2, 1e-8, 120};
  double finish_from = 1e-1;  ///< -: natural residual below which the finish is tried
  int sweeps = 100;           ///< of Gauss and Seidel before the last attempt
};

class NcpNewton {
 public:
  explicit NcpNewton(const NcpOptions& options) {
    static_cast<NcpOptions&>(o_) = options;
    o_.finish.tolerance = options.tolerance;
    NcpOptions sweeps;
    sweeps.sweeps = o_.sweeps;
    sweeps_ = nsgs_row().make(sweeps);
  }
  void operator()(const NcpProblem& problem, NcpSolution& solution);

 private:
  bool attempt(std::string_view who, NcpSolution& solution);
  bool guess(NcpSolution& solution);
  bool path(const NewtonOptions::Path& path, std::string_view who, NcpSolution& solution);
  bool finish(int patience, std::string_view who, NcpSolution& solution);
  bool offer(double residual, std::string_view who, NcpSolution& solution);
  void start_from(std::span<const double> r);

  NewtonOptions o_;
  NcpMeasure measure_;
  ProximalNewton proximal_;
  AlartCurnierNewton finish_;
  NcpSolver sweeps_;
  NcpSolution swept_;
  const NcpProblem* problem_ = nullptr;
  double size_ = 0;                                  // sqrt(J), of q
  std::vector<double> r_, u_, v_, tried_, tried_u_;  // iterate; the finish's
};

// Keeps (tried_, tried_u_) where it is the best so far. Is it good?
bool NcpNewton::offer(double residual, std::string_view who, NcpSolution& solution) {
  if (residual < solution.residual) {
    solution.residual = residual;
    solution.r = tried_;
    solution.u = tried_u_;
    solution.who = who;
  }
  return solution.residual <= o_.tolerance;
}

bool NcpNewton::finish(int patience, std::string_view who, NcpSolution& solution) {
  tried_ = r_;
  AlartCurnierNewton::Options o = o_.finish;
  o.patience = patience;
  return offer(finish_.solve(o, tried_, tried_u_, solution.iterations), who, solution);
}

void NcpNewton::start_from(std::span<const double> r) {
  r_.assign(r.begin(), r.end());
  measure_.velocities(r_, v_, u_);
}

// The loop over proximal steps.
bool NcpNewton::path(const NewtonOptions::Path& path, std::string_view who, NcpSolution& solution) {
  double alpha = path.first;
  for (int k = 0; k < path.limit; ++k) {
    const auto ending = proximal_.solve(o_.proximal, alpha, r_, v_, solution.iterations);
    if (!all_finite(r_) || !all_finite(v_)) return false;
    tried_ = r_;
    measure_.velocities(tried_, v_, tried_u_);
    const double residual = measure_.residual(tried_, tried_u_);
    if (offer(residual, who, solution)) return true;
    if (residual < o_.finish_from && ending == ProximalNewton::Ending::solved &&
        finish(o_.finish.patience, who, solution))
      return true;
    alpha = ending == ProximalNewton::Ending::solved ? std::max(path.least, alpha * path.shrink) : alpha * path.grow;
  }
  return false;
}

bool NcpNewton::attempt(std::string_view who, NcpSolution& solution) {
  const std::vector<double> zero(3 * static_cast<std::size_t>(problem_->nc()), 0.0);
  if (who == "guess") {
    start_from(problem_->start.size() == zero.size() ? problem_->start : std::span<const double>(zero));
    return finish(o_.guess_patience, who, solution);
  }
  if (who == "path") {
    start_from(zero);
    return path(o_.path, who, solution);
  }
  if (who == "slow") {
    start_from(zero);
    return path(o_.slow, who, solution);
  }
  sweeps_(*problem_, swept_);
  solution.iterations += swept_.iterations;
  start_from(swept_.r);
  return finish(o_.finish.patience, who, solution) || path(o_.slow, who, solution);
}

void NcpNewton::operator()(const NcpProblem& p, NcpSolution& solution) {
  const int nc = p.nc();
  problem_ = &p;
  solution.clear();
  solution.r.assign(3 * nc, 0.0);
  solution.residual = HUGE_VAL;
  measure_.begin(p);
  solution.u = measure_.q();
  if (!all_finite(solution.u) || !all_finite(p.v0)) {
    solution.status = NcpStatus::not_finite;
    solution.reason = "NaN or infinity in the problem";
    return;
  }
  size_ = 0;
  for (int c = 0; c < nc; ++c)
    for (int i = 3 * c; i < 3 * c + 3; ++i) size_ += solution.u[i] * solution.u[i] / p.weight[c];
  size_ = std::sqrt(size_);
  proximal_.begin(p, size_);
  finish_.begin(p, measure_);
  for (const std::string_view who : {"guess", "path", "slow", "swept"}) {
    poll_stop();
    const bool done = attempt(who, solution);
    if (!done && std::isfinite(solution.residual) && solution.residual > o_.tolerance && solution.residual < 1e-6)
      solution.residual = std::min(solution.residual, measure_.residual_beside_rounding(solution.r, solution.u));
    if (done || solution.residual <= o_.accepted) {
      solution.status = NcpStatus::solved;
      return;
    }
  }
  solution.reason = "no start came to the tolerance";
}

}  // namespace

NcpSolverRow newton_ncp_row() {
  return {"newton", "proximal point around a semismooth Newton method in velocities, several starts",
          "Acary, Bremond and Huber 2018, sec. 5", "", [](const NcpOptions& options) -> NcpSolver {
            return [solver = NcpNewton(options)](const NcpProblem& problem, NcpSolution& solution) mutable {
              solver(problem, solution);
            };
          }};
}

}  // namespace cb
