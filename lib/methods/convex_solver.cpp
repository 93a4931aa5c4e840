#include "methods/convex_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cb {

ConvexSolver::ConvexSolver(const ConvexTolerances& tolerances)
    : tolerances_(tolerances), bound_finder_(tolerances), scratch_(tolerances), judge_(tolerances) {}

// From rest, if the island stays there; else the bound first, then the frictionless answer, if it is good enough, then
// the proposers.
ConvexEnding ConvexSolver::operator()(double epsilon, ConvexPhase phase, ConvexPrevious* previous,
                                      ConvexIsland& island) {
  island_ = &island;
  phase_ = phase;
  begin(epsilon);
  bool proven = true;
  ConeStatus status = ConeStatus::solved;
  if (previous == nullptr || !stays_at_rest(*previous)) {
    proven = bound_finder_.find(island, bound_, ending_.iterations);
    if (tolerances_.bounded) set_bound();
    if (!slides_freely()) {
      status = propose(previous);
      if (phase != ConvexPhase::only && tolerances_.bounded) prefer_frictionless();
    }
    if (previous != nullptr) remember(island, tolerances_, best_.r, bound_, *previous);
  }
  end(proven, status);
  return ending_;
}

void ConvexSolver::begin(double epsilon) {
  const int nc = island_->nc();
  island_->epsilon = epsilon;
  // What the first phase gave back is all that the event had: a gap here would be a gain of energy.
  if (phase_ == ConvexPhase::second)
    island_->epsilon = std::min(epsilon, tolerances_.gain * island_->size * island_->size);
  program_ = island_->program(tolerances_.bounded);
  program_.gap = island_->epsilon;
  best_.certificate = {};
  best_.r.assign(3 * nc, 0.0);
  best_.eta.assign(nc, 0.0);
  ending_ = {};
  ending_.size = 3 * nc + (tolerances_.bounded ? nc + 1 : 0);
}

void ConvexSolver::end(bool proven, ConeStatus status) {
  const Certificate& certificate = best_.certificate;
  ending_.who = best_.who;
  ending_.gap = std::abs(certificate.gap);
  ending_.excess = std::max(0.0, std::abs(certificate.gap) - certificate.gap_rounding);
  ending_.status = status;
  if (!proven) {
    ending_.unproven = true;
    ending_.status = std::max(status, ConeStatus::nonconverged);
    return;
  }
  // An answer at rounding whose certificate is not: friction coefficients or masses of many orders of magnitude.
  ending_.inaccurate = status != ConeStatus::solved && certificate.infeasibility <= tolerances_.backward &&
                       std::abs(certificate.gap) <= tolerances_.inaccurate * certificate.size * certificate.size;
  if (ending_.inaccurate) ending_.status = ConeStatus::solved;
}

// The loop over the island's proposers, cheapest first. Each answer counts for what its certificate says: the best is
// kept, and where it is good nobody else is asked, unless it is good only beside rounding of large impulses (excused).
ConeStatus ConvexSolver::propose(ConvexPrevious* previous) {
  const ConvexEvent event{tolerances_, *island_, bound_, program_, start_of(previous)};
  if (previous != nullptr) previous->by_newton = false;
  ConeStatus ending = ConeStatus::nonconverged;
  const auto good = [this] { return judge_.good(*island_, best_.certificate, Allowed::backward); };
  for (const ConvexProposer& proposer : convex_proposers()) {
    if (proposer.last_word && good()) break;
    answer_.iterations = 0;
    answer_.s = 0;
    const bool proposes = proposer.propose(event, scratch_, answer_);
    ending_.iterations += answer_.iterations;
    if (!proposes) continue;
    // Large multipliers excuse much; with the bounds relaxed they are small, as a rule.
    if (offer(proposer) && !judge_.excused(*island_, best_.certificate)) {
      keep_start(proposer, previous);
      return ConeStatus::solved;
    }
    if (answer_.status != ConeStatus::solved) ending = answer_.status;
  }
  return good() ? ConeStatus::solved : ending;
}

// Keeps answer_ where it is better than what there is. Is it as good as is asked?
bool ConvexSolver::offer(const ConvexProposer& proposer) {
  unreduce(bound_, answer_.eta, multiplier_);
  const double limit = judge_.limit_of(proposer.allowed);
  const Certificate certificate = judge_(*island_, program_, answer_.r, multiplier_);
  const bool done = judge_.good(*island_, certificate, proposer.allowed);
  // A gap within the rounding of its own data is better than a smaller one beyond its own; but large multipliers would
  // excuse anything.
  const bool was_done = judge_.good(*island_, best_.certificate, Allowed::backward);
  const bool better = best_.certificate.infeasibility > limit ||
                      (done && !was_done && !judge_.excused(*island_, certificate)) ||
                      std::abs(certificate.gap) < std::abs(best_.certificate.gap);
  if (certificate.infeasibility > limit || !better || (was_done && !done)) return false;
  best_.certificate = certificate;
  best_.who = proposer.name;
  best_.r = answer_.r;
  best_.eta = multiplier_;
  return done;
}

void ConvexSolver::set_bound() {
  program_.bounded_below = true;
  program_.kappa = program_.impulse_size = bound_.kappa;
  // Limits of joints do not count in kappa, and their impulses may be far larger.
  for (int c = 0; c < island_->nc(); ++c)
    if (island_->share[c] == 0) program_.impulse_size += bound_.f[c];
}

void ConvexSolver::clear_bound() {
  program_.bounded_below = false;
  program_.kappa = program_.impulse_size = std::numeric_limits<double>::infinity();
}

// The previous answer at rest, if it is good enough.
bool ConvexSolver::stays_at_rest(ConvexPrevious& previous) {
  if (!recall(*island_, tolerances_, previous, bound_, best_.r)) return false;
  if (tolerances_.bounded) set_bound();
  best_.eta.assign(island_->nc(), 0.0);
  best_.certificate = judge_(*island_, program_, best_.r, {});
  best_.who = "rest, again";
  if (judge_.good(*island_, best_.certificate, Allowed::exact)) {
    ending_.warm_start = true;
    return true;
  }
  clear_bound();
  return false;
}

// The frictionless answer, if it is good enough.
bool ConvexSolver::slides_freely() {
  best_.r = bound_.impulse;
  best_.eta.assign(island_->nc(), 0.0);
  best_.certificate = judge_(*island_, program_, best_.r, {});
  best_.who = "frictionless";
  // A light body may slip below heavy ones: beside their impulses that is no infeasibility, and a slip costs r.y
  // nothing where there is no friction.
  if (!tolerances_.bounded) best_.certificate.gap = judge_.gap_at_own_sum(*island_, program_, best_.r);
  return judge_.good(*island_, best_.certificate, Allowed::exact);
}

// The frictionless impulses keep all bounds. Where multipliers are so large that they excuse an answer of more energy,
// it is not the least one, and restitution would gain what it has more.
void ConvexSolver::prefer_frictionless() {
  judge_(*island_, program_, best_.r, best_.eta);
  double more = 0;  // J
  for (std::size_t i = 0; i < best_.r.size(); ++i)
    more += 0.5 * (best_.r[i] - bound_.impulse[i]) * (judge_.u()[i] + bound_.u_f[i]);
  if (!(more > 0)) return;
  Certificate certificate = judge_(*island_, program_, bound_.impulse, best_.eta);
  if (!judge_.good(*island_, certificate, Allowed::backward)) {
    certificate = judge_(*island_, program_, bound_.impulse, {});
    if (!judge_.good(*island_, certificate, Allowed::backward)) return;
    best_.eta.assign(island_->nc(), 0.0);
  }
  best_.r = bound_.impulse;
  best_.certificate = certificate;
  best_.who = "frictionless";
}

// What the next event's Newton method may start from.
void ConvexSolver::keep_start(const ConvexProposer& proposer, ConvexPrevious* previous) {
  ending_.warm_start = ending_.warm_start || proposer.is_start;
  if (previous == nullptr || !proposer.starts_next) return;
  previous->by_newton = true;
  previous->nv = island_->nv();
  previous->answer = answer_;
}

// The previous event's answer, where Newton's method may start from it.
const ConeSolution* ConvexSolver::start_of(const ConvexPrevious* previous) const {
  const bool same = previous != nullptr && previous->by_newton && previous->nv == island_->nv() &&
                    previous->answer.r.size() == 3 * island_->contacts.size();
  return same ? &previous->answer : nullptr;
}

}  // namespace cb
