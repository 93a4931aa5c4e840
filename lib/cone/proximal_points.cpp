// Proximal points of a cone program, each about the one before: the last word where many contacts of a heap hardly
// slip, so that the cones are too curved for the interior point method, and Newton's method finds no way from where
// that ends.
//
// Problem: as in interior_point.cpp, with terms t w (r - r0) in y and t w (eta - eta0) in u_n, (r0, eta0) the point
// before. The larger t, the better conditioned, and the nearer its answer: Newton's method (polish.h) finds it in some
// steps. t falls as fast as it goes on finding them, and each point is tried as the start of the program's own answer.
// Both may go as far as t allows along what the program leaves next to undetermined: a proximal term of polish.h larger
// than t would bound their steps in its place.
//
// Source: R. T. Rockafellar, Monotone operators and the proximal point algorithm, SIAM J. Control Optim. 14 (1976): the
// points come to an answer whatever t, where there is one; the smaller t, the faster. Difference: s has no such term.
// Fails where points come no nearer, the limit of steps is reached, or no t lets Newton's method find the next.

#include "cone/proximal_points.h"

#include <algorithm>
#include <cmath>

#include "cone/polish.h"
#include "linalg/proximal_term.h"

namespace cb {

namespace {

constexpr double least = 1e-12;          // -: t
constexpr int steps = 60, patience = 6;  // of Newton's method to a point
constexpr int without = 30;              // points in a row that do not halve the least gap

}  // namespace

bool go_by_points(const ConeProgram& p, const ConeOptions& options, ConeWorkspace& workspace, ConeSolution& x) {
  if (!p.has_eta()) x.eta.assign(p.nc(), 0.0);
  const int until = x.iterations + options.points_limit;
  double least_gap = HUGE_VAL;
  PolishRules to_point{steps, patience}, to_answer = PolishRules::bold(options, options.iterate_patience);
  ConeSolution last = x, trial, answer;
  int since = 0;
  for (ProximalTerm t(least); !t.over() && since < without && last.iterations < until;) {
    to_point.anchor = to_point.proximal = t();
    to_answer.proximal = std::min(options.proximal, t());
    trial = last;
    const bool found = polish(p, options, to_point, workspace, trial);
    last.iterations = trial.iterations;
    if (!found) {
      t.missed();
      continue;
    }
    last = answer = trial;
    const bool solved = polish(p, options, to_answer, workspace, answer);
    last.iterations = answer.iterations;
    const bool feasible = answer.infeasibility <= options.feasibility;
    const double gap = std::abs(answer.gap);
    if (solved || (feasible && gap < least_gap)) x = answer;
    if (solved) return true;
    since = feasible && !(gap < 0.5 * least_gap) ? since + 1 : 0;
    if (feasible) least_gap = std::min(least_gap, gap);
    t.found();
  }
  x.iterations = last.iterations;
  return false;
}

}  // namespace cb
