#include "methods/resting_impulse.h"

#include <algorithm>
#include <cmath>

namespace cb {

namespace {

/// -: the proximal term of a correction, as a fraction of W_ii, and the mean number of rows of a block from which on
/// systems are factored by blocks: as the cone solver has them (ConeOptions::proximal, least_block).
constexpr double proximal = 1e-8, least_block = 3;
constexpr int corrections = 2;

}  // namespace

// Velocities after r, into u_; the largest that should be zero.
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
  return std::sqrt(worst) / size;
}

void RestingImpulse::remember(const ContactView& event, std::span<const double> r, double size) {
  if (size > 0 && slip(event, r, size) <= resting)
    r_.assign(r.begin(), r.end());
  else
    forget();
}

bool RestingImpulse::find(const ContactView& event, double size) {
  const int nc = event.J.bands();
  if (r_.empty() || static_cast<int>(r_.size()) != 3 * nc || !(size > 0)) return false;
  residual_ = slip(event, r_, size);
  for (int k = 0; residual_ > rounding && k < corrections; ++k) {
    if (!(residual_ <= resting)) return false;  // it does not rest any more
    if (k == 0) {
      system_.prepare(event.M, event.J, least_block);
      G_.assign(9 * nc, 0.0);
      for (int c = 0; c < nc; ++c)
        for (int i = 0; i < (event.mu[c] > 0 ? rows_ : 1); ++i) G_[9 * c + 4 * i] = 1 / (proximal * event.weight[c]);
      if (!system_.factor(G_, {})) return false;
    }
    step_.resize(3 * nc);
    u_step_.resize(3 * nc);
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

}  // namespace cb
