// Projected Newton from which PATH's path starts.
//
// Problem: z >= 0, F = M z + q >= 0, z.F = 0, scaled. Merit: |Fischer-Burmeister residual|. With the active set a =
// {i: z_i > F_i} Newton's point solves F_a = 0, z = 0 elsewhere; the step is projected on z >= 0 and shortened until
// the merit falls below (1 - decrease alpha) times its largest value of the last `memory` steps.
//
// Source: S. P. Dirkse, M. C. Ferris, Crash techniques for large-scale complementarity problems (1997).
//
// Differences from the source: pairs whose exchange has no usable pivot stay on their slack (z_i = 0) until the crash
// ends, and those that z_i and F_i leave undecided: where bodies rest, rounding of friction's F_i would have half of it
// enter. The projection comes first: max(0, z_N) and max(0, z + alpha (z_N - z)) agree at alpha = 1, and the segment to
// a point of the orthant needs no projection of its own.
//
// Ends where the active set stays, the merit is `converged` or no shortened step lowers it; it cannot fail.

#include "lcp/path_crash.h"

#include <algorithm>
#include <climits>
#include <cmath>

namespace cb {

void PathCrash::run(Basis& basis, NormalMap& map, const Eigen::VectorXd& q, PivotCount& pivots, int tries) {
  merits_.assign(1, map.evaluate(basis, q, map.z));
  before_.assign(basis.n(), 2);
  refused_.assign(basis.n(), 0);
  map.tried = 0;
  map.tries = tries;
  for (int k = 0; k < steps && merits_.back() > converged; ++k)
    if (!step(basis, map, q, pivots)) break;
  map.tries = INT_MAX;
}

// One step of Newton's method. False where it leads nowhere.
bool PathCrash::step(Basis& basis, NormalMap& map, const Eigen::VectorXd& q, PivotCount& pivots) {
  const int n = basis.n();
  map.want.resize(n);
  for (int i = 0; i < n; ++i) map.want[i] = map.z[i] > map.F[i] + tie && !refused_[i];
  if (map.want == before_) return false;
  before_ = map.want;
  map.reach(basis, pivots);
  for (const int i : map.waiting) refused_[i] = map.want[i];
  basis.set_load(q);
  read_point(basis, target_);
  return shorten(basis, map, q);
}

// From map.z towards target_, as far as the merit falls enough. False where it does not.
bool PathCrash::shorten(Basis& basis, NormalMap& map, const Eigen::VectorXd& q) {
  const double reference = *std::max_element(merits_.begin(), merits_.end());
  double alpha = 1, found = HUGE_VAL;
  for (int k = 0; k <= halvings; ++k, alpha /= 2) {
    trial_ = map.z + alpha * (target_ - map.z);
    found = map.evaluate(basis, q, trial_);
    if (found <= (1 - decrease * alpha) * reference) break;
  }
  if (!(found <= (1 - decrease * alpha) * reference)) return false;
  map.z = trial_;
  merits_.push_back(found);
  if (static_cast<int>(merits_.size()) > memory) merits_.erase(merits_.begin());
  return true;
}

}  // namespace cb
