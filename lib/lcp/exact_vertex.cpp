// From a vertex that is not exact on to one that is (exact_vertex.h).

#include "lcp/exact_vertex.h"

#include <cmath>

#include "lcp/draw.h"

namespace cb {

double ExactVertex::find(Basis& basis, const ScaledLoad& load, ComplementaryPath& path, PathJudge& judge, unsigned seed,
                         Eigen::VectorXd& z, const std::function<PathEnd()>& first) {
  const int n = basis.n();
  const double harris = path.ratio.harris, vanishing = path.ratio.vanishing, retreat = path.retreat;
  path.ratio.vanishing = 0;
  Judgement found = judge.vertex(basis, load, z), best;
  for (int count = 1; found.beyond_rounding > vertex_tolerance || found.residual > tolerance; ++count) {
    if (better(found, best, tolerance)) {
      best = found;
      best_ = z;
      active_.clear();
      for (int i = 0; i < n; ++i)
        if (basis.is_basic(n + i)) active_.push_back(i);
    }
    if (best.residual == HUGE_VAL || count > repairs) break;  // HUGE_VAL: it cannot be factorised
    PathEnd end = PathEnd::bad_pivot;
    const int pivots = path.pivots.done;
    if (count == 1 && first) {
      end = first();
    } else {
      path.ratio.harris = 0;
      path.retreat = HUGE_VAL;
      if (cover(basis, load, seed + 1000 * static_cast<unsigned>(count))) end = path.follow(basis);
    }
    found = end == PathEnd::solution ? judge.vertex(basis, load, z) : Judgement{};
    // Without a pivot a cover of its own parts nothing there, and no other will.
    const bool own = count > 1 || !first;
    if (end == PathEnd::pivot_limit || (own && path.pivots.done == pivots)) break;
  }
  path.ratio.harris = harris;
  path.ratio.vanishing = vanishing;
  path.retreat = retreat;
  if (!better(best, found, tolerance)) return found.residual;
  z = best_;
  return best.residual;
}

// Takes up the best vertex so far with a covering vector of its own. False where its basis is singular.
bool ExactVertex::cover(Basis& basis, const ScaledLoad& load, unsigned seed) {
  noise_.resize(basis.n());
  for (int i = 0; i < basis.n(); ++i) noise_[i] = 1 + draw(seed, static_cast<unsigned>(i));
  set_own_cover(basis, load, active_, noise_, scratch_, cover_);
  return basis.renew(active_, -1, load.q, cover_);
}

}  // namespace cb
