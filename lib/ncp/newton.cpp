// Exact Coulomb friction by Newton's method: proximal point outside, semismooth Newton inside, finished on Alart and
// Curnier's map, and believed only by a certificate.
//
// Problem: (1) of ncp.h, nc contacts, nv velocities. Attempts, the cheap ones first; each is a start (impulses and
// velocities), and whoever reaches the tolerance ends the rest:
//   guess    Newton's method on Alart and Curnier's map from the event before, or from no impulses (finish.h): what
//   rests
//            or slides steadily takes one or two factorisations
//   interior steps of an interior point method with the slip in their linearisation (interior.h), then the finish: many
//            contacts change between sticking, slipping and open at once
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
#include "ncp/interior.h"
#include "ncp/ncp.h"
#include "ncp/proximal_newton.h"
#include "ncp/velocity_system.h"

namespace cb {

namespace {

struct NewtonOptions : NcpOptions {
  ProximalNewton::Options proximal;
  AlartCurnierNewton::Options finish;
  /// -: compliances of a path: first, fall a step, growth where a step fails, least.
  struct Path {
    double first, shrink, grow, least;
    int limit;      ///< proximal steps
    int quick = 6;  ///< Newton steps of one up to which alpha falls by all of it; three times as many: by the root
  };
  Path path{1, 0.1, 4, 1e-8, 40}, slow{10, 0.3, 2, 1e-8, 120};
  double ahead = 1e-2;          ///< -: proximal term of the finish, over alpha or the interior steps' error
  double near_rounding = 1e-6;  ///< -: natural residual after the finish from which rounding is looked at
  double finish_from = 1e-1;    ///< -: natural residual below which the finish is tried
  /// -: of the fastest velocity before: contacts that part more slowly carry in the first guess.
  double touching = 1e-10;
  InteriorSteps::Options interior;
  int interior_limit = 60;     ///< of its steps,
  int interior_patience = 15;  ///< and of those in a row that do not take a fifth off its error
  /// -: its error at which the finish is tried, and again at this fraction of that; what is rounding.
  double interior_from = 1e-3, interior_again = 1e-1, interior_rounding = 1e-10;
  double hand_over = 0.1;  ///< -: first compliance of the path after it, over its error
  int sweeps = 100;        ///< of Gauss and Seidel before the last attempt
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
  bool guess(std::string_view who, NcpSolution& solution);
  bool interior(std::string_view who, NcpSolution& solution);
  bool path(const NewtonOptions::Path& path, std::string_view who, NcpSolution& solution);
  bool finish(double proximal, int returns, std::string_view who, NcpSolution& solution);
  bool offer(double residual, std::string_view who, NcpSolution& solution);
  void start_from(std::span<const double> r);

  NewtonOptions o_;
  NcpMeasure measure_;
  VelocitySystem system_;
  ProximalNewton proximal_;
  InteriorSteps interior_;
  AlartCurnierNewton finish_;
  NcpSolver sweeps_;
  NcpSolution swept_;
  const NcpProblem* problem_ = nullptr;
  double size_ = 0;                                  // sqrt(J), of q
  std::vector<double> r_, u_, v_, tried_, tried_u_;  // iterate; the finish's
  std::vector<double> kept_, kept_v_, zero_;         // the iterate before a proximal step; no impulses
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

bool NcpNewton::finish(double proximal, int returns, std::string_view who, NcpSolution& solution) {
  tried_ = r_;
  AlartCurnierNewton::Options o = o_.finish;
  o.proximal = proximal;
  o.returns = returns;
  const double residual = finish_.solve(o, tried_, tried_u_, solution.iterations);
  if (offer(residual, who, solution)) return true;
  if (!(residual < o_.near_rounding)) return false;
  // What is left may be rounding.
  return offer(std::min(residual, measure_.residual_beside_rounding(tried_, tried_u_)), who, solution) ||
         solution.residual <= o_.accepted;
}

void NcpNewton::start_from(std::span<const double> r) {
  r_.assign(r.begin(), r.end());
  measure_.velocities(r_, v_, u_);
}

// Its best iterate is where a path begins, where the finish never comes home.
bool NcpNewton::interior(std::string_view who, NcpSolution& solution) {
  interior_.begin(*problem_, system_, measure_, size_);
  double next = o_.interior_from, best = HUGE_VAL;
  for (int k = 0, without = 0; k < o_.interior_limit && without < o_.interior_patience; ++k) {
    ++solution.iterations;
    if (!interior_.step(o_.interior)) break;
    const double error = interior_.error();
    without = error < 0.8 * best ? 0 : without + 1;
    if (error < best) {
      best = error;
      r_ = interior_.r();
    }
    if (error > next) continue;
    if (finish(std::max(o_.finish.proximal, o_.ahead * error), 1, who, solution)) return true;
    next = error * o_.interior_again;
    if (error < o_.interior_rounding) return false;
  }
  if (!(best < HUGE_VAL)) return false;
  NewtonOptions::Path on = o_.path;
  proximal_.begin(*problem_, system_, size_);
  on.first = o_.hand_over * std::min(1.0, best);
  measure_.velocities(r_, v_, u_);
  return path(on, who, solution);
}

// The loop over proximal steps.
bool NcpNewton::path(const NewtonOptions::Path& path, std::string_view who, NcpSolution& solution) {
  double alpha = path.first;
  for (int k = 0; k < path.limit; ++k) {
    const int before = solution.iterations;
    kept_ = r_;
    kept_v_ = v_;
    const auto ending = proximal_.solve(o_.proximal, alpha, r_, v_, solution.iterations);
    const int steps = solution.iterations - before;
    const bool solved = ending == ProximalNewton::Ending::solved && all_finite(r_) && all_finite(v_);
    if (!solved) {
      r_ = kept_;
      v_ = kept_v_;
      alpha *= path.grow;
      continue;
    }
    tried_ = r_;
    measure_.velocities(tried_, v_, tried_u_);
    const double residual = measure_.residual(tried_, tried_u_);
    if (offer(residual, who, solution)) return true;
    if (residual < o_.finish_from &&
        finish(std::max(o_.finish.proximal, o_.ahead * alpha), o_.finish.returns, who, solution))
      return true;
    if (steps <= path.quick)
      alpha = std::max(path.least, alpha * path.shrink);
    else if (steps <= 3 * path.quick)
      alpha = std::max(path.least, alpha * std::sqrt(path.shrink));
  }
  return false;
}

// Newton's method from the event before, else with all contacts closed that do not part: what rests takes one step.
bool NcpNewton::guess(std::string_view who, NcpSolution& solution) {
  const bool known = problem_->start.size() == zero_.size();
  const std::span<const double> from = known ? problem_->start : std::span<const double>(zero_);
  tried_.assign(from.begin(), from.end());
  AlartCurnierNewton::Options o = o_.finish;
  o.returns = 0;
  if (!known)
    for (const double u : measure_.q()) o.touching = std::max(o.touching, o_.touching * std::abs(u));
  return offer(finish_.solve(o, tried_, tried_u_, solution.iterations), who, solution);
}

bool NcpNewton::attempt(std::string_view who, NcpSolution& solution) {
  if (who == "guess") return guess(who, solution);
  if (who == "interior") return interior(who, solution);
  proximal_.begin(*problem_, system_, size_);
  if (who != "swept") {
    start_from(zero_);
    return path(who == "path" ? o_.path : o_.slow, who, solution);
  }
  sweeps_(*problem_, swept_);
  solution.iterations += swept_.iterations;
  start_from(swept_.r);
  return finish(o_.finish.proximal, 0, who, solution) || path(o_.slow, who, solution);
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
  zero_.assign(3 * nc, 0.0);
  system_.prepare(*p.M, *p.J);
  finish_.begin(p, system_, measure_);
  for (const std::string_view who : {"guess", "interior", "path", "slow", "swept"}) {
    poll_stop();
    const bool done = attempt(who, solution);
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
