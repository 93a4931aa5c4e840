// A cascade of convex programs: De Saxce's term is taken from the round before, so that each round is a cone program.
//
// Problem: (1) of ncp.h, nc contacts. With s_c = mu |u_t,c| of the last round (m/s) the rest of (1),
//   u + s e_n in K*,   r in K,   r.(u + s e_n) = 0
// is the optimality of   min over r in K of 1/2 r.W r + r.(q + s e_n),   which lib/cone solves to rounding; its slip
// gives the next s. Where s comes again it is an answer of (1). The first round, s = 0, is `convex` without its bound.
//   s <- s + theta (mu |u_t| - s),   theta halved where the change of s does not fall
// since the plain iteration (theta = 1) goes round in circles on some problems.
//
// Source: V. Acary, F. Cadoux, Applications of an existence result for the Coulomb friction problem, in Recent Advances
// in Contact Mechanics (2013), and V. Acary, F. Cadoux, C. Lemarechal, J. Malick, ZAMM 91 (2011), sec. 5: the same
// fixed point. Genesis latches s over one time step in place of a round. Differences: 1. rounds after the first begin
// with Newton's method from the last answer; 2. theta; 3. it ends by the natural residual of (1).
//
// Returns: solved; nonconverged (limit of rounds, or s no longer comes nearer; the best round's impulses); singular (a
// round's program had no answer); not_finite.

#include <algorithm>
#include <cmath>
#include <memory>

#include "cone/interior_point.h"
#include "linalg/finite.h"
#include "linalg/stop.h"
#include "ncp/ncp.h"

namespace cb {

namespace {

struct CascadeOptions : NcpOptions {
  int limit = 400;              ///< rounds
  int patience = 60;            ///< rounds in a row without a residual that is a tenth less than the best
  double slower = 0.9;          ///< -: change of s over the last, beyond which theta is halved
  double regain = 1.2;          ///< -: by which theta grows where the change falls
  double least_damping = 0.05;  ///< -: of theta
};

class Cascade {
 public:
  explicit Cascade(const NcpOptions& options) { static_cast<NcpOptions&>(o_) = options; }
  void operator()(const NcpProblem& problem, NcpSolution& solution);

 private:
  void begin(const NcpProblem& problem);
  bool solve_round(const NcpProblem& problem, NcpSolution& solution);
  bool keep(NcpSolution& solution);
  void latch(const NcpProblem& problem);
  void end(NcpSolution& solution);

  CascadeOptions o_;
  NcpMeasure measure_;
  InteriorPoint solver_;
  ConeProgram program_;
  ConeSolution answer_;
  bool answered_ = false;  // is answer_ one to begin with?
  std::vector<double> v0_, mu_, weight_, offset_;
  std::vector<double> s_, u_, v_;
  double theta_ = 1, change_ = HUGE_VAL;  // of s, sqrt(J)
  int since_better_ = 0;
};

void Cascade::begin(const NcpProblem& p) {
  v0_.assign(p.v0.begin(), p.v0.end());
  mu_.assign(p.mu.begin(), p.mu.end());
  weight_.assign(p.weight.begin(), p.weight.end());
  offset_.assign(p.offset.begin(), p.offset.end());
  s_.assign(p.nc(), 0.0);
  program_ = {};
  program_.M = p.M;
  program_.factor = p.factor;
  program_.J = p.J;
  program_.v0 = &v0_;
  program_.offset = &offset_;
  program_.mu = &mu_;
  program_.weight = &weight_;
  double energy = 0;
  for (int i = 0; i < 3 * p.nc(); ++i) energy += measure_.q()[i] * measure_.q()[i] / weight_[i / 3];
  program_.gap = exact_gap * energy;
  theta_ = 1;
  change_ = HUGE_VAL;
  since_better_ = 0;
  answered_ = false;
  if (static_cast<int>(p.start.size()) != 3 * p.nc()) return;
  answer_.r.assign(p.start.begin(), p.start.end());
  answer_.eta.assign(p.nc(), 0.0);
  answer_.s = 0;
  answered_ = true;
  measure_.velocities(p.start, v_, u_);
  latch(p);
}

// With the s of now: Newton's method from the last answer, else the interior point method.
bool Cascade::solve_round(const NcpProblem& p, NcpSolution& solution) {
  for (int c = 0; c < p.nc(); ++c) offset_[3 * c] = p.offset[3 * c] + s_[c];
  bool solved = false;
  if (answered_) {
    answer_.iterations = 0;
    solved = solver_.polish(program_, answer_, PolishRules::bold(solver_.options(), solver_.options().guess_patience));
    solution.iterations += answer_.iterations;
  }
  if (!solved) {
    solver_.solve(program_, answer_);
    solution.iterations += answer_.iterations;
    solved = answer_.status == ConeStatus::solved || answer_.status == ConeStatus::nonconverged;
  }
  answered_ = solved && all_finite(answer_.r);
  return answered_;
}

// Is it an answer of (1), or will there be none?
bool Cascade::keep(NcpSolution& solution) {
  measure_.velocities(answer_.r, v_, u_);
  const double residual = measure_.residual(answer_.r, u_);
  since_better_ = residual < 0.9 * solution.residual ? 0 : since_better_ + 1;
  if (residual < solution.residual) {
    solution.residual = residual;
    solution.r = answer_.r;
    solution.u = u_;
  }
  return solution.residual <= o_.tolerance || since_better_ > o_.patience;
}

// The next s, from the slip of now.
void Cascade::latch(const NcpProblem& p) {
  double change = 0;
  for (int c = 0; c < p.nc(); ++c) {
    const double asked = mu_[c] * std::hypot(u_[3 * c + 1], u_[3 * c + 2]);
    change += (asked - s_[c]) * (asked - s_[c]) / weight_[c];
  }
  change = std::sqrt(change);
  theta_ = change > o_.slower * change_ ? std::max(o_.least_damping, 0.5 * theta_) : std::min(1.0, o_.regain * theta_);
  change_ = change;
  for (int c = 0; c < p.nc(); ++c) s_[c] += theta_ * (mu_[c] * std::hypot(u_[3 * c + 1], u_[3 * c + 2]) - s_[c]);
}

void Cascade::end(NcpSolution& solution) {
  if (solution.residual > o_.tolerance)
    solution.residual = std::min(solution.residual, measure_.residual_beside_rounding(solution.r, solution.u));
  if (solution.residual <= o_.accepted)
    solution.status = NcpStatus::solved;
  else if (solution.status == NcpStatus::nonconverged)
    solution.reason =
        since_better_ > o_.patience ? "the slip of one round does not come again in the next" : "limit of rounds";
}

void Cascade::operator()(const NcpProblem& p, NcpSolution& solution) {
  solution.clear();
  solution.r.assign(3 * p.nc(), 0.0);
  measure_.begin(p);
  solution.u = measure_.q();
  if (!all_finite(solution.u)) {
    solution.status = NcpStatus::not_finite;
    solution.reason = "NaN or infinity in the problem";
    return;
  }
  solution.residual = measure_.residual(solution.r, solution.u);
  if (solution.residual <= o_.tolerance) {
    solution.status = NcpStatus::solved;
    return;
  }
  begin(p);
  for (int round = 0; round < o_.limit; ++round) {
    poll_stop();
    if (!solve_round(p, solution)) {
      solution.status = NcpStatus::singular;
      solution.reason = "a round's cone program has no answer";
      break;
    }
    if (keep(solution)) break;
    latch(p);
  }
  end(solution);
}

NcpSolver make(const NcpOptions& options) {
  return [solver = std::make_shared<Cascade>(options)](const NcpProblem& problem, NcpSolution& solution) {
    (*solver)(problem, solution);
  };
}

}  // namespace

NcpSolverRow cascade_row() {
  return {"cascade", "convex programs one after another, each with the slip of the one before",
          "V. Acary, F. Cadoux, C. Lemarechal, J. Malick, ZAMM 91 (2011)", make};
}

}  // namespace cb
