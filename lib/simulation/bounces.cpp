#include "simulation/bounces.h"

#include <algorithm>
#include <cmath>

namespace cb {

int Bounces::arrive(const Pair& pair) {
  const auto at = std::find_if(seen_.begin(), seen_.end(), [&](const Seen& seen) { return seen.pair == pair; });
  last_ = static_cast<std::size_t>(at - seen_.begin());
  if (at == seen_.end()) seen_.push_back({pair});
  return ++seen_[last_].arrivals;
}

bool Bounces::over(const Pair& pair, double e) const {
  for (const Seen& seen : seen_)
    if (seen.pair == pair) return e > 0 && seen.impacts > 0 && std::pow(e, seen.impacts) < spent;
  return false;
}

}  // namespace cb
