// The ways in which convex looks for an answer. Each proposes; only the certificate (2) of drumwright_shell.cpp counts.
// Wins of each, and what is lost without it: docs/methods/convex.md.

#include "methods/convex_proposers.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "cone/rows.h"
#include "linalg/finite.h"

namespace cb {

namespace {

/// Of what is accepted, the share by which the relaxed program misses the bounds.
constexpr double relaxed_share = 0.5;

ConeOptions finishing(const ConvexTolerances& t) {
  ConeOptions options = t.cone;
  options.proximal = t.finish_proximal;
  options.careful_proximal = t.finish_first_proximal;
  return options;
}

// (3) where it is the same as (1).
ConeProgram reduced(const ConvexEvent& event) {
  ConeProgram program = event.program;
  if (event.bound.shape == ConvexShape::flat) {
    program.fixed = &event.bound.fixed;
    program.kappa = std::numeric_limits<double>::infinity();
  }
  return program;
}

// (1) with bounds that may be missed by half of what is allowed, so that it has a strictly feasible point.
ConeProgram relaxed(const ConvexEvent& event, std::vector<double>& slacks) {
  const ConvexIsland& island = event.island;
  const double slack = relaxed_share * event.tolerances.backward;
  double approaching = 0;
  slacks.resize(island.nc());
  for (int c = 0; c < island.nc(); ++c) {
    slacks[c] = slack * std::min(island.size, island.before) * std::sqrt(island.weight[c]);
    approaching += std::abs(island.q[3 * c]) / island.weight[c];
  }
  ConeProgram program = event.program;
  program.slack = &slacks;
  program.kappa = event.bound.kappa + slack * std::max(event.bound.kappa, approaching);
  return program;
}

// Newton's method from the previous answer, an iterate like any other.
bool from_previous(const ConvexEvent& event, ConvexScratch& scratch, ConeSolution& answer) {
  if (event.previous == nullptr) return false;
  answer = *event.previous;
  answer.iterations = 0;
  const ConeProgram program = reduced(event);
  if (!program.has_bound()) answer.s = 0;
  const ConeOptions& options = event.tolerances.cone;
  return scratch.solver.polish(program, answer, PolishRules::bold(options, options.iterate_patience));
}

// All contacts stop.
bool stopping(const ConvexEvent& event, ConvexScratch& scratch, ConeSolution& answer) {
  return event.island.has_robot() && stop_contacts(event.island, event.program, scratch.stop, answer);
}
bool sticking(const ConvexEvent& event, ConvexScratch& scratch, ConeSolution& answer) {
  return stick_contacts(event.island, event.program, event.tolerances.cone, scratch.stick, answer);
}

// Newton's method from the frictionless answer, with friction against its slip.
bool from_guess(const ConvexEvent& event, ConvexScratch& scratch, ConeSolution& answer) {
  const ConvexIsland& island = event.island;
  answer.r.assign(3 * island.nc(), 0.0);
  answer.eta.assign(island.nc(), 0.0);
  for (int c = 0; c < island.nc(); ++c) {
    const double *u = &event.bound.u_f[3 * c], f = event.bound.f[c], mu = island.mu[c], t = tangential(u);
    answer.r[3 * c] = f;
    for (int i = 1; i < 3 && t > 0; ++i) answer.r[3 * c + i] = -mu * f * u[i] / t;
    answer.s = std::max(answer.s, mu * t - u[0]);
  }
  const ConeProgram program = reduced(event);
  if (!program.has_bound()) answer.s = 0;
  const ConeOptions& options = event.tolerances.cone;
  return scratch.solver.polish(program, answer, PolishRules::bold(options, options.guess_patience));
}

bool interior_point(const ConvexEvent& event, ConvexScratch& scratch, ConeSolution& answer) {
  scratch.solver.solve(reduced(event), answer);
  scratch.interior = answer;
  return true;
}

// Where slips differ by an angle a, how contacts share their load is worth a^2 of the energy: the cones are too curved
// for the interior point method to follow that far. Newton's method is not bound to their inside.
bool solve_densely(const ConvexEvent& event, const ConeProgram& program, const ConeOptions& options,
                   ConvexScratch& scratch, ConeSolution& answer) {
  if (event.island.nc() > event.tolerances.dense_limit) return false;
  solve_dense(program, options, answer);
  if (answer.r.empty() || std::abs(answer.gap) <= program.gap) return true;
  ConeSolution& finished = scratch.finished;
  finished = answer;
  scratch.finisher.polish(program, finished, PolishRules::careful(scratch.finisher.options()));
  answer.iterations = finished.iterations;
  if (finished.infeasibility <= event.tolerances.infeasibility && std::abs(finished.gap) < std::abs(answer.gap))
    answer = finished;
  return true;
}

// Rarely fails, but its time grows with the cube.
bool dense(const ConvexEvent& event, ConvexScratch& scratch, ConeSolution& answer) {
  return solve_densely(event, reduced(event), event.tolerances.cone, scratch, answer);
}
bool dense_relaxed(const ConvexEvent& event, ConvexScratch& scratch, ConeSolution& answer) {
  return event.tolerances.bounded &&
         solve_densely(event, relaxed(event, scratch.slack), event.tolerances.cone, scratch, answer);
}
// Short steps stay in the middle of mixed scales.
bool dense_short(const ConvexEvent& event, ConvexScratch& scratch, ConeSolution& answer) {
  ConeOptions options = event.tolerances.cone;
  options.step_fraction = event.tolerances.short_step;
  return solve_densely(event, reduced(event), options, scratch, answer);
}

// Heaps of more contacts than the dense method takes; some hundreds of Newton steps.
bool points(const ConvexEvent& event, ConvexScratch& scratch, ConeSolution& answer) {
  answer = scratch.interior;
  answer.iterations = 0;  // the interior point's are counted
  if (!all_finite(answer.r) || !all_finite(answer.eta)) return false;
  const ConeProgram program = reduced(event);
  if (!program.has_bound()) answer.s = 0;
  scratch.solver.go_by_points(program, answer);
  return true;
}

constexpr std::array<ConvexProposer, 9> proposers = {{
    {"previous answer", from_previous, Allowed::exact, true, true},
    {"stopping", stopping, Allowed::exact, false, false},
    {"sticking", sticking, Allowed::exact, false, false},
    {"guess", from_guess, Allowed::exact, true, false},
    {"interior point", interior_point, Allowed::exact, true, false},
    {"dense", dense, Allowed::exact, true, false},
    {"dense, relaxed", dense_relaxed, Allowed::backward, true, false},
    {"dense, short steps", dense_short, Allowed::exact, true, false},
    {"points", points, Allowed::exact, true, false, true},
}};

}  // namespace

ConvexScratch::ConvexScratch(const ConvexTolerances& t) : solver(t.cone), finisher(finishing(t)) {}

std::span<const ConvexProposer> convex_proposers() { return proposers; }

}  // namespace cb
