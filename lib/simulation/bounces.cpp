#include "simulation/bounces.h"

#include <algorithm>
#include <cmath>

namespace cb {

namespace {

/// The least n >= 0 with e^n < spent.
double impacts_until_over(double e) {
  if (e == 0) return 0;
  return e < 1 ? std::ceil(std::log(Bounces::spent) / std::log(e)) : HUGE_VAL;
}

}  // namespace

const Bounces::Seen* Bounces::find(const Pair& pair) const {
  const auto at = std::find_if(seen_.begin(), seen_.end(), [&](const Seen& seen) { return seen.pair == pair; });
  return at == seen_.end() ? nullptr : &*at;
}

int Bounces::arrive(const Pair& pair) {
  const Seen* seen = find(pair);
  last_ = seen ? static_cast<std::size_t>(seen - seen_.data()) : seen_.size();
  if (!seen) seen_.push_back({pair});
  return ++seen_[last_].arrivals;
}

void Bounces::impact(double t) {
  ++seen_[last_].impacts;
  seen_[last_].last_impact = t;
}

bool Bounces::over(const Pair& pair, double e) const {
  const Seen* seen = e > 0 ? find(pair) : nullptr;
  return seen && seen->impacts >= impacts_until_over(e);
}

double Bounces::wait(const Pair& pair, double e, double t, double h, double size, double speed) const {
  const Seen* seen = find(pair);
  if (!seen || seen->impacts < resolved + impacts_until_over(e)) return 0;
  return std::max(0.0, seen->last_impact + std::min(h / resolved, shallow * size / speed) - t);
}

}  // namespace cb
