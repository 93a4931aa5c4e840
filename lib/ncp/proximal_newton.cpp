// A step of the proximal point method: contacts get compliances a = alpha w_c (a_n = a max(1, mu) along
// the normal) around impulses m,
//   r = S(J v + w - a m),      S(y): the law for a contact of its own, u = y + a r,
//     r_n = max(0, -y_n) / a_n,   r_t = -y_t / a, or mu r_n against y_t where that is longer                    (1)
//   F(v) = M (v - v0) - J^T S(J v + w - a m) = 0                                                          (2)
// nv unknowns, nc contacts. S is explicit since the compliance is diagonal: normal and friction do
// not couple in it, and (1) is exact Coulomb friction, no regularisation of its kind: where r = m the answer is one of
// the problem itself. It is piecewise smooth, and Newton's method is semismooth:
//   (M + J^T G J) dv = -F,   G = -dS/dy,
//     open: 0;   sticks: diag(1/a_n, 1/a, 1/a);
//     slips: [1/a_n, 0; -mu d / a_n, mu r_n / |y_t| (I - d d^T)],  d = y_t / |y_t|
// with steps halved until |F| in the norm of M^-1 falls. The larger alpha, the nearer the system is to M.
//
// Source: V. Acary, M. Bremond, O. Huber, On solving contact problems with Coulomb friction: formulations and numerical
// comparisons (2018), sec. 5.3 (proximal point algorithm around a semismooth Newton method).
// Differences: 1. unknown are velocities, not impulses and velocities of contacts: systems are banded where bodies are,
// and W may have any rank; 2. each contact's proximal term goes by its own w_c, so that units cancel; 3. the merit is
// |F|, an energy.
// Fails: stalled (no halved step takes |F| down, or the limit of steps), singular (a system could not be factored);
// r and v are then the best that was met.

#include "ncp/proximal_newton.h"

#include <algorithm>
#include <cmath>

#include "linalg/stop.h"

namespace cb {

void ProximalNewton::begin(const NcpProblem& problem, VelocitySystem& system, double size) {
  problem_ = &problem;
  size_ = size;
  system_ = &system;
  const std::size_t nc = problem.nc(), nv = problem.nv();
  y_.resize(3 * nc);
  r_.resize(3 * nc);
  G_.resize(9 * nc);
  for (auto* x : {&F_, &h_, &way_, &next_}) x->resize(nv);
}

// |F| in the norm of M^-1, sqrt(J), at v; y_, r_ and F_ with it.
double ProximalNewton::evaluate(double alpha, const std::vector<double>& v) {
  const NcpProblem& p = *problem_;
  multiply(*p.J, *p.M, v, y_);
  for (int c = 0; c < p.nc(); ++c) {
    const double a = alpha * p.weight[c], mu = p.mu[c];
    double *y = &y_[3 * c], *r = &r_[3 * c];
    const double a_n = a * std::max(1.0, mu);
    for (int i = 0; i < 3; ++i) y[i] += p.offset[3 * c + i] - (i == 0 ? a_n : a) * middle_[3 * c + i];
    const double slip = std::sqrt(y[1] * y[1] + y[2] * y[2]);
    r[0] = std::max(0.0, -y[0]) / a_n;
    const double scale = slip <= mu * r[0] * a ? 1 / a : slip > 0 ? mu * r[0] / slip : 0;
    r[1] = -scale * y[1];
    r[2] = -scale * y[2];
  }
  for (int i = 0; i < p.nv(); ++i) h_[i] = v[i] - p.v0[i];
  multiply(*p.M, h_, F_);
  std::fill(h_.begin(), h_.end(), 0.0);
  multiply_transposed_add(*p.J, *p.M, r_, h_);
  for (int i = 0; i < p.nv(); ++i) h_[i] = F_[i] -= h_[i];
  p.factor->solve_in_place(h_);
  double square = 0;
  for (int i = 0; i < p.nv(); ++i) square += h_[i] * F_[i];
  return std::sqrt(std::max(0.0, square));
}

void ProximalNewton::linearise(double alpha) {
  const NcpProblem& p = *problem_;
  std::fill(G_.begin(), G_.end(), 0.0);
  for (int c = 0; c < p.nc(); ++c) {
    const double inverse = 1 / (alpha * p.weight[c]), mu = p.mu[c], *y = &y_[3 * c];
    double* G = &G_[9 * c];
    if (!(y[0] < 0)) continue;
    const double normal = inverse / std::max(1.0, mu), radius = mu * normal * -y[0];
    G[0] = normal;
    const double slip = std::sqrt(y[1] * y[1] + y[2] * y[2]);
    if (slip * inverse <= radius) {
      if (mu > 0) G[4] = G[8] = inverse;
      continue;
    }
    const double d[] = {y[1] / slip, y[2] / slip}, k = radius / slip;
    G[1] = -mu * normal * d[0];
    G[2] = -mu * normal * d[1];
    G[4] = k * (1 - d[0] * d[0]);
    G[8] = k * (1 - d[1] * d[1]);
    G[5] = G[7] = -k * d[0] * d[1];
  }
}

// a (r - m) over sqrt(w), as a norm: what the answer misses the problem itself by, sqrt(J).
double ProximalNewton::proximal_terms(double alpha) const {
  double square = 0;
  for (std::size_t i = 0; i < r_.size(); ++i) {
    const double missing = r_[i] - middle_[i];
    square += problem_->weight[i / 3] * missing * missing;
  }
  return alpha * std::sqrt(square);
}

ProximalNewton::Ending ProximalNewton::solve(const Options& o, double alpha, std::vector<double>& r,
                                             std::vector<double>& v, int& steps) {
  middle_ = r;
  double error = evaluate(alpha, v);
  const auto end = [&](Ending ending) {
    r = r_;
    return ending;
  };
  for (int k = 0; k < o.limit; ++k) {
    poll_stop();
    if (error <= std::max(o.tolerance * proximal_terms(alpha), o.rounding * size_)) return end(Ending::solved);
    linearise(alpha);
    ++steps;
    if (!system_->factor(G_)) return end(Ending::singular);
    for (std::size_t i = 0; i < way_.size(); ++i) way_[i] = -F_[i];
    system_->solve_in_place(way_);
    double part = 1, after = HUGE_VAL;
    for (int h = 0; h < o.halvings; ++h, part /= 2) {
      for (std::size_t i = 0; i < v.size(); ++i) next_[i] = v[i] + part * way_[i];
      after = evaluate(alpha, next_);
      if (after <= (1 - 1e-4 * part) * error) break;
    }
    if (!(after < error)) {
      evaluate(alpha, v);
      return end(Ending::stalled);
    }
    v.swap(next_);
    error = after;
  }
  return end(Ending::stalled);
}

}  // namespace cb
