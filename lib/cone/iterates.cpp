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

void take(const CentralPath<double>& path, ConeSolution& x) {
  x.r.assign(path.at.r.begin(), path.at.r.end());
  x.eta.assign(path.at.eta.begin(), path.at.eta.end());
  x.s = path.at.s;
  x.iterations = path.iterations;
}

}  // namespace

ConeNext PolishedIterates::look(CentralPath<double>& path) {
  if (!std::isfinite(path.off.complementarity) || !std::isfinite(path.off.worst)) return ConeNext::stop;
  if (!keep(path)) return ConeNext::stop;
  if (try_polish(path)) return ConeNext::solved;
  return path.off.relative < least_complementarity ? ConeNext::stop : ConeNext::step;
}

// False where there has been no better iterate for too long.
bool PolishedIterates::keep(const CentralPath<double>& path) {
  if (!(path.off.merit() < best_merit_)) return ++since_best_ <= options_.patience;
  best_merit_ = path.off.merit();
  since_best_ = 0;
  take(path, scratch_.best);
  return true;
}

bool PolishedIterates::try_polish(CentralPath<double>& path) {
  if (!(path.off.relative < next_polish_ && path.off.worst < std::sqrt(next_polish_))) return false;
  next_polish_ = path.off.relative * 1e-2;
  take(path, scratch_.trial);
  const bool polished =
      polish(p_, options_, PolishRules::bold(options_, options_.iterate_patience), w_, scratch_.trial);
  path.iterations = scratch_.trial.iterations;
  return polished;
}

void PolishedIterates::finish(CentralPath<double>& path, ConeNext next, ConeStatus ending) {
  if (next == ConeNext::solved) {
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

namespace {

// Of the dense method, as a fraction of the problem's size. Where the iteration ends: looser leaves less to the
// certificate, which multiplies by mu. What counts as solved where rounding ends it before that. From where on it is
// given up without progress: before that it may well come back from iterates that are worse.
constexpr double dense_rounding = 1e-18, dense_accepted = 1e-12, dense_near = 1e-9;
/// Iterations in a row that do not halve the merit.
constexpr int dense_patience = 6;
/// -: of the gap that is asked for: the share of an answer that another iteration need not improve.
constexpr double enough = 1e-2;

}  // namespace

ConeNext RoundedIterates::look(CentralPath<DoubleDouble>& path) {
  const DoubleDouble merit = path.off.merit();
  finite_ = isfinite(merit);
  if (!finite_) return ConeNext::stop;
  round_off(path);
  if (worth(rounded_) < worth(x_) || (worth(x_) == HUGE_VAL && merit < best_merit_)) x_ = rounded_;
  since_best_ = merit < 0.5 * best_merit_ ? 0 : since_best_ + 1;
  best_merit_ = std::min(best_merit_, merit);
  const bool stalls = best_merit_ < dense_near && since_best_ > dense_patience;
  const bool serves = merit < dense_accepted && worth(x_) <= enough * p_.gap;
  return merit < dense_rounding || stalls || serves ? ConeNext::stop : ConeNext::step;
}

// The point as doubles in the program's units, and what a stranger would say of it.
void RoundedIterates::round_off(const CentralPath<DoubleDouble>& path) {
  newton_.round_off(path.at, rounded_);
  velocities_.evaluate(p_, rounded_.r, rounded_.eta);
  velocities_.bound_rounding(p_, rounded_.r, {});
  const Certificate certificate =
      certify(p_, rounded_.r, rounded_.eta, velocities_, newton_.q(), options_.rounding_units);
  rounded_.gap = certificate.gap;
  rounded_.infeasibility = certificate.infeasibility;
}

double RoundedIterates::worth(const ConeSolution& x) const {
  return x.infeasibility <= options_.feasibility ? std::abs(x.gap) : HUGE_VAL;
}

void RoundedIterates::finish(CentralPath<DoubleDouble>& path, ConeNext, ConeStatus ending) {
  x_.iterations = path.iterations;
  x_.status = finite_ ? ending : ConeStatus::not_finite;
  if (best_merit_ < dense_accepted) x_.status = ConeStatus::solved;
}

}  // namespace cb
