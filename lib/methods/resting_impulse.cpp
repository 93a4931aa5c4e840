#include "methods/resting_impulse.h"

#include <algorithm>
#include <cmath>

namespace cb {

namespace {

/// -: the proximal term of a correction, as a fraction of W_ii, and the mean number of rows of a block from which on
/// systems are factored by blocks: as the cone solver has them (ConeOptions::proximal, least_block).
constexpr double proximal = 1e-8, least_block = 3;
constexpr int corrections = 3;

}  // namespace

// Velocities after r, into u_; the largest that should be zero. What rounding leaves goes by the motion before the
// event, of which only a part may be contact velocity: a falling stack touches the ground with its lowest box.
double RestingImpulse::slip(const ContactView& event, std::span<const double> r, double size) {
  const int nc = event.J.bands(), nv = event.M.order();
  v_.assign(nv, 0.0);
  multiply_transposed_add(event.J, event.M, r, v_);
  event.factor.solve_in_place(v_);
  for (int i = 0; i < nv; ++i) v_[i] += event.v0[i];
  u_.resize(3 * nc);
  multiply(event.J, event.M, v_, u_);
  double worst = 0;
  for (int c = 0; c < nc; ++c) {
    const int rows = event.mu[c] > 0 ? rows_ : 1;
    double* u = &u_[3 * c];
    for (int i = 0; i < 3; ++i) u[i] += event.offset[3 * c + i];
    double square = 0;
    for (int i = 0; i < rows; ++i) square += u[i] * u[i];
    worst = std::max(worst, square / event.weight[c]);
  }
  return std::sqrt(worst) / std::max(size, std::sqrt(quadratic_form(event.M, event.v0)));
}

void RestingImpulse::remember(const ContactView& event, std::span<const double> r, double size, bool least_norm) {
  forget();
  if (!(size > 0 && slip(event, r, size) <= resting)) return;
  r_.assign(r.begin(), r.end());
  share_.assign(event.J.bands(), 1.0);
  if (rows_ == 3) share_friction(event.J.bands());
  from_zero_ = least_norm;
  if (least_norm) std::fill(r_.begin(), r_.end(), 0.0);
}

// Friction in the ratio of the normal impulses.
void RestingImpulse::share_friction(int nc) {
  constexpr double least = 1e-3;  // of the mean: a contact without load has little friction, not none
  double mean = 0;
  for (int c = 0; c < nc; ++c) mean += r_[3 * c] / nc;
  for (int c = 0; c < nc; ++c) share_[c] = mean > 0 ? std::max(least, r_[3 * c] / mean) : 1;
}

// Proximal steps from r_ until its velocities are rounding.
bool RestingImpulse::correct(const ContactView& event, double size) {
  const int nc = event.J.bands();
  system_.prepare(event.M, event.J, least_block);
  G_.assign(9 * nc, 0.0);
  for (int c = 0; c < nc; ++c) {
    const double stiff = 1 / (proximal * event.weight[c]);
    G_[9 * c] = stiff;
    for (int i = 1; i < rows_ && event.mu[c] > 0; ++i) G_[9 * c + 4 * i] = stiff * share_[c];
  }
  if (!system_.factor(G_, {})) return false;
  step_.resize(3 * nc);
  u_step_.resize(3 * nc);
  for (int k = 0; residual_ > rounding && k < corrections; ++k) {
    h_.assign(event.M.order(), 0.0);
    for (int i = 0; i < 3 * nc; ++i) step_[i] = -G_[9 * (i / 3) + 4 * (i % 3)] * u_[i];
    multiply_transposed_add(event.J, event.M, step_, h_);
    system_.solve_in_place(h_);
    multiply(event.J, event.M, h_, u_step_);
    for (int i = 0; i < 3 * nc; ++i) r_[i] += step_[i] - G_[9 * (i / 3) + 4 * (i % 3)] * u_step_[i];
    residual_ = slip(event, r_, size);
  }
  return residual_ <= corrected;
}

bool RestingImpulse::find(const ContactView& event, double size) {
  const int nc = event.J.bands();
  if (r_.empty() || static_cast<int>(r_.size()) != 3 * nc || !(size > 0)) return false;
  residual_ = slip(event, r_, size);
  if (from_zero_) {
    from_zero_ = false;
    share_.assign(nc, 1.0);
    if (!correct(event, size)) return false;
    if (rows_ == 1) return true;
    share_friction(nc);
    std::fill(r_.begin(), r_.end(), 0.0);
    residual_ = slip(event, r_, size);
    return correct(event, size);
  }
  if (residual_ <= rounding) return true;
  return residual_ <= resting && correct(event, size);  // beyond `resting` it does not rest any more
}

}  // namespace cb
