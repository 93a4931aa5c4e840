#include "cone/iterates.h"

#include <algorithm>
#include <cmath>

#include "cone/polish.h"

namespace cb {

namespace {

/// -: complementarity, as a fraction of the energy, that no iteration takes further down.
constexpr double least_complementarity = 1e-16;
/// -: infeasibility up to which the best iterate counts as solved where Newton's method did not end it.
constexpr double accepted_infeasibility = 1e-9;

void take(const Path<double>& path, ConeSolution& x) {
  x.r.assign(path.at.r.begin(), path.at.r.end());
  x.eta.assign(path.at.eta.begin(), path.at.eta.end());
  x.s = path.at.s;
  x.iterations = path.iterations;
}

}  // namespace

Next PolishedIterates::look(Path<double>& path) {
  if (!std::isfinite(path.off.complementarity) || !std::isfinite(path.off.worst)) return Next::stop;
  if (!keep(path)) return Next::stop;
  if (try_polish(path)) return Next::solved;
  return path.off.relative < least_complementarity ? Next::stop : Next::step;
}

// False where there has been no better iterate for too long.
bool PolishedIterates::keep(const Path<double>& path) {
  if (!(path.off.merit() < best_merit_)) return ++since_best_ <= options_.patience;
  best_merit_ = path.off.merit();
  since_best_ = 0;
  take(path, scratch_.best);
  return true;
}

bool PolishedIterates::try_polish(Path<double>& path) {
  if (!(path.off.relative < next_polish_ && path.off.worst < std::sqrt(next_polish_))) return false;
  next_polish_ = path.off.relative * 1e-2;
  take(path, scratch_.trial);
  const bool polished =
      polish(p_, options_, PolishRules::bold(options_, options_.iterate_patience), w_, scratch_.trial);
  path.iterations = scratch_.trial.iterations;
  return polished;
}

void PolishedIterates::finish(Path<double>& path, Next next, ConeStatus ending) {
  if (next == Next::solved) {
    x_ = scratch_.trial;
    return;
  }
  // The best iterate is what there is.
  if (best_merit_ < HUGE_VAL)
    x_ = scratch_.best;
  else
    take(path, x_);
  x_.iterations = path.iterations;
  last_word(ending);
}

void PolishedIterates::last_word(ConeStatus ending) {
  scratch_.trial = x_;
  if (polish(p_, options_, PolishRules::careful(options_), w_, scratch_.trial)) {
    x_ = scratch_.trial;
    return;
  }
  x_.iterations = scratch_.trial.iterations;
  x_.status = ending;
  const Certificate certificate = check(p_, options_, w_, x_);
  if (std::abs(x_.gap) <= std::max(p_.gap, certificate.gap_rounding) && x_.infeasibility <= accepted_infeasibility)
    x_.status = ConeStatus::solved;
}

}  // namespace cb
