// Interior point methods for exact Coulomb friction, in the variables of interior_system.cpp.
//
// LongSteps: Mehrotra's predictor and corrector. The problem is not monotone, and no theorem says that steps stay long.
//
// PathSteps: products t and misses t p0 / t0 belong to one point of the central path, F(y, t) = 0. It starts where t is
// large and the answer is the only one; where y stays bounded it is, for almost every start, a curve that ends at t =
// 0, an answer of the problem. On the way t may grow again, as often as it likes: how many steps the path takes goes by
// its length, not by t. A step, from a point near the path:
//   corrector  F' a = -F,  less its part along b
//   tangent    F' b = t dF/dt,  forward where det F' > 0, and backward where it is not: between two turns of t it has
//              one sign
//   bend       F' c = -(products of b with itself), F's second order
//   y <- y + a + k b + k^2 c,   t <- (1 - k') t, k' = k less the part of a along b
// in the metric of the cones at y: lengths are the largest contact's, parts are by the sum over contacts. k goes by the
// distance from the path after the step before it, |a|; where that is too much the step is taken back and made shorter.
//
// Source: L. Vandenberghe, The CVXOPT linear and quadratic cone program solvers (2010), for LongSteps. E. Allgower, K.
// Georg, Introduction to Numerical Continuation Methods (2003), ch. 2 (orientation by the determinant) and 6.
// Differences: 1. the metric; 2. second order; 3. the path is that of the cone's complementarity, where C. Lemke's
// method follows the edges of a polygon's.
// Fails: LongSteps where steps become short; PathSteps in its limit of steps, and where rounding blurs the path.

#include "ncp/interior.h"

#include <algorithm>
#include <cmath>

#include "linalg/stop.h"

namespace cb {

namespace {

void add(InteriorPoints& to, double part, const InteriorPoints& x) {
  for (std::size_t c = 0; c < to.size(); ++c) {
    to[c].x += part * x[c].x;
    to[c].z += part * x[c].z;
    to[c].s += part * x[c].s;
  }
}

}  // namespace

bool LongSteps::step(const Options& o, InteriorSystem& at) {
  poll_stop();
  if (!at.factor()) return false;
  at.solve(0, 1, nullptr, at.misses(), step_);
  const double predicted = std::min(1.0, o.fraction * at.longest(step_));
  at.solve(std::max(o.least_centring, std::pow(1 - predicted, 3)) * at.mean(), 1, &step_, at.misses(), step_);
  return at.move(std::min(1.0, o.fraction * at.longest(step_)), step_);
}

void PathSteps::begin(const Options& options, InteriorSystem& at) {
  o_ = options;
  at_ = &at;
  t_ = at.mean();
  reach_ = o_.first_reach;
  before_ = HUGE_VAL;
  part_ = 0;  // no step to take back
  rate_ = at.misses();
  for (auto& rate : rate_) rate /= t_;
}

// Takes the last step back but for a part.
bool PathSteps::go_back() {
  part_ *= o_.shorten;
  reach_ *= 0.5;
  t_ = t_before_ * (1 - part_ * change_);
  return part_ > o_.least_part && at_->move_to(from_, part_, step_);
}

// Corrector across the path, and tangent. Returns the corrector's part along the tangent, which is left out of it.
double PathSteps::find_directions() {
  off_.resize(rate_.size());
  for (std::size_t c = 0; c < rate_.size(); ++c) off_[c] = at_->misses()[c] - t_ * rate_[c];
  at_->solve(t_, 1, nullptr, off_, step_);
  for (std::size_t c = 0; c < rate_.size(); ++c) off_[c] = t_ * rate_[c];
  at_->solve(-t_, 0, nullptr, off_, along_);
  double unused = 0;
  const double square = at_->inner(along_, along_, along_size_), part = at_->inner(step_, along_, unused) / square;
  along_size_ = std::sqrt(along_size_);
  add(step_, -part, along_);
  return part;
}

// Adds what goes along the path, by `reach_`; returns k.
double PathSteps::go_along() {
  for (auto& off : off_) off.setZero();
  at_->solve(0, 0, &along_, off_, bend_);
  double largest = 0;
  at_->inner(bend_, bend_, largest);
  double k = std::min(reach_ / along_size_, std::sqrt(o_.bend / std::sqrt(largest)));
  if (at_->sign() > 0)
    k = std::min(k, o_.fraction);
  else
    k = -k;
  add(step_, k, along_);
  add(step_, k * k, bend_);
  return k;
}

bool PathSteps::step() {
  poll_stop();
  if (!at_->factor()) return false;
  last_.swap(step_);
  const double part_along = find_directions();
  double off = 0;
  at_->inner(step_, step_, off);
  off = std::sqrt(off);
  if (!(off <= std::max(o_.near, 0.95 * before_))) {
    step_.swap(last_);
    return go_back();
  }
  before_ = off;
  double k = 0;
  if (off <= o_.near) {
    reach_ *= std::clamp(std::cbrt(o_.wanted / std::max(1e-3 * o_.wanted, off)), 0.5, 2.0);
    reach_ = std::min(reach_, o_.longest_reach);
    k = go_along();
  }
  from_ = at_->at();
  t_before_ = t_;
  change_ = std::min(0.95, k - part_along);
  part_ = std::min(1.0, o_.fraction * at_->longest(step_));
  t_ *= 1 - part_ * change_;
  return at_->move(part_, step_);
}

}  // namespace cb
