// Newton's method on the natural map of a cone program: the finish of the interior point method, and a first try from a
// guess.
//
// Problem: as in interior_point.cpp. The natural map, contact by contact, with P the projection on the cone:
//   e = r - P(r - y / w),   eta - (eta - u_n / w)+,   s - (s + (d.r - kappa) w)+
// Source: semismooth Newton method (L. Qi, J. Sun, A nonsmooth version of Newton's method, Mathematical Programming 58,
// 1993). P' has eigenvectors along the ray a = (1, mu d) (eigenvalue 1), p (across the slip; mu n / t) and a's normal
// (0). Differences: 1. along a the linearised equation fixes y, not r, which is not unique: the proximal term dr_a =
// -(y_a + dy_a) / (proximal w) takes its place, which picks the answer next to the iterate and does not move it;
// 2. careful steps (PolishRules::goes_back) in place of a line search: a wrong guess of the active constraints asks for
// the impossible; 3. terms of a proximal point (PolishRules::anchor).
// Fails where no iterate is at rounding: the active constraints were named wrongly, or the system could not be
// factored.

#include "cone/polish.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "cone/rows.h"
#include "linalg/stop.h"

namespace cb {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

class Polish {
 public:
  Polish(const ConeProgram& program, const ConeOptions& options, const PolishRules& rules, ConeWorkspace& workspace,
         ConeSolution& x)
      : p_(program),
        options_(options),
        rules_(rules),
        w_(workspace),
        x_(x),
        proximal_(std::max(rules.proximal, rules.anchor)),
        least_proximal_(std::max(std::min(options.proximal, rules.proximal), rules.anchor)) {
    if (!anchored()) return;
    r0_ = x.r;
    eta0_ = x.eta;
  }

  bool operator()() {
    for (int k = 0; k <= rules_.limit; ++k) {
      poll_stop();
      const double residual = linearise();
      const bool over = gives_up(residual);
      if (!over || residual < best_) keep_or_go_back(residual);
      if (over || cannot_be_better() || k == rules_.limit || !step()) break;
    }
    return anchored() ? take_point() : accept();
  }

 private:
  struct Sums {
    double square = 0;    // J, squared natural map
    double products = 0;  // J, sum of |r.y|, |eta u_n|, and kappa times what y is short of the dual cone
    double missing = 0;   // m/s, the latter
    double impulses = 0;  // J, squares of r by the weights of the natural map; velocities have nothing of eta
  };

  bool anchored() const { return rules_.anchor > 0; }
  double linearise();
  void linearise_contact(int c, Sums& sums);
  double linearise_slip(int c, const Vector3d& y, const Vector3d& z, double t);
  void linearise_multiplier(int c, Sums& sums);
  void linearise_bound();
  bool gives_up(double residual);
  void keep_or_go_back(double residual);
  bool cannot_be_better() const;
  bool step();
  bool accept();
  bool take_point();
  double last_bits();

  const ConeProgram& p_;
  const ConeOptions& options_;
  const PolishRules& rules_;
  ConeWorkspace& w_;
  ConeSolution& x_;
  double proximal_, least_proximal_;
  std::vector<double> r0_, eta0_;  // 3 nc, N s, and nc; of a proximal point
  double best_ = HUGE_VAL;         // sqrt(J), least natural map
  double best_impulses_ = 0;       // sqrt(J), size of r there
  int stalled_ = 0;
  Sums sums_;
  bool s_active_ = false;
};

// Sets the terms of a Newton step at x (what a contact adds is inlined, so that sums stay in registers); returns the
// norm of the natural map, sqrt(J).
double Polish::linearise() {
  w_.velocities.evaluate(p_, x_.r, eta_of(p_, x_));
  Sums sums;
  for (int c = 0; c < p_.nc(); ++c) {
    linearise_contact(c, sums);
    if (p_.has_eta()) linearise_multiplier(c, sums);
  }
  sums_ = sums;
  linearise_bound();
  return std::sqrt(sums_.square);
}

// Returns its square of the natural map.
[[gnu::always_inline]] inline double Polish::linearise_slip(int c, const Vector3d& y, const Vector3d& z, double t) {
  const double w = w_.scales.w_r[c], mu = (*p_.mu)[c], stiff = 1 / (proximal_ * w);
  const auto r = vec3(&x_.r[3 * c]);
  const double root = std::sqrt(1 + mu * mu), c1 = z[1] / t, c2 = z[2] / t;
  const Vector3d a(1 / root, mu * c1 / root, mu * c2 / root);
  const Vector3d b(mu / root, -c1 / root, -c2 / root);
  const Vector3d across(0, -c2, c1);
  const double n = (z[0] + mu * t) / (1 + mu * mu), k = mu * n / t, s = 1 - k * (1 - rules_.anchor);
  const double y_a = a.dot(y), r_b = b.dot(r), r_p = across.dot(r);
  mat3(&w_.newton.G[9 * c]).noalias() = stiff * a * a.transpose() + (k / (s * w)) * across * across.transpose();
  vec3(&w_.newton.c_r[3 * c]) = -stiff * y_a * a - r_b * b - (r_p / s) * across;
  return y_a * y_a / w + w * (r_b * r_b + r_p * r_p);
}

[[gnu::always_inline]] inline void Polish::linearise_contact(int c, Sums& sums) {
  const double w = w_.scales.w_r[c], mu = (*p_.mu)[c], stiff = 1 / (proximal_ * w);
  const auto r = vec3(&x_.r[3 * c]);
  Vector3d y = vec3(&w_.velocities.u_hat[3 * c]) + x_.s * vec3(&w_.newton.d[3 * c]);
  if (anchored()) y += rules_.anchor * w * (r - vec3(&r0_[3 * c]));
  auto G = mat3(&w_.newton.G[9 * c]);
  auto step = vec3(&w_.newton.c_r[3 * c]);
  const Vector3d z = r - y / w;
  const double t = std::sqrt(z[1] * z[1] + z[2] * z[2]);
  sums.products += std::abs(r.dot(y));
  sums.impulses += w * r.squaredNorm();
  if (p_.has_bound()) sums.missing = std::max(sums.missing, mu * tangential(y.data()) - y[0]);
  if (mu == 0) {  // a half-line: r_t = 0
    G.setZero();
    step = -r;
    if (z[0] > 0) {
      G(0, 0) = stiff;
      step[0] = -stiff * y[0];
      sums.square += y[0] * y[0] / w;
    } else {
      sums.square += w * r[0] * r[0];
    }
    sums.square += w * (r[1] * r[1] + r[2] * r[2]);
  } else if (t <= mu * z[0]) {  // sticks: y = 0
    G.setIdentity();
    G *= stiff;
    step = -stiff * y;
    sums.square += y.squaredNorm() / w;
  } else if (mu * t <= -z[0]) {  // open: r = 0
    G.setZero();
    step = -r;
    sums.square += w * r.squaredNorm();
  } else {
    sums.square += linearise_slip(c, y, z, t);
  }
}

[[gnu::always_inline]] inline void Polish::linearise_multiplier(int c, Sums& sums) {
  const double w_eta = w_.scales.w_eta[c], eta = x_.eta[c];
  double u_n = w_.velocities.u[3 * c] + p_.slack_of(c);
  if (anchored()) u_n += rules_.anchor * w_eta * (eta - eta0_[c]);
  sums.products += std::abs(eta * u_n);
  if (p_.is_fixed(c) || eta - u_n / w_eta > 0) {
    w_.newton.D[c] = 1 / (proximal_ * w_eta);
    w_.newton.c_eta[c] = -w_.newton.D[c] * u_n;
    sums.square += u_n * u_n / w_eta;
  } else {
    w_.newton.D[c] = 0;
    w_.newton.c_eta[c] = -eta;
    sums.square += w_eta * eta * eta;
  }
}

void Polish::linearise_bound() {
  s_active_ = false;
  if (!p_.has_bound()) return;
  const double excess = sum_of_shares(p_, x_.r) - p_.kappa, w = w_.scales.mean_weight;
  sums_.products += sums_.missing * p_.kappa;
  s_active_ = x_.s + excess * w > 0;
  sums_.square += s_active_ ? excess * excess * w : x_.s * x_.s / w;
}

// Without progress, or at rounding and not halved again: that of the problem's scale, or what the last bits of r leave
// in the velocities.
bool Polish::gives_up(double residual) {
  if (!std::isfinite(residual) && (!rules_.goes_back || best_ == HUGE_VAL)) return true;  // nothing to go back to
  if (residual < 0.5 * best_) {
    stalled_ = 0;
    return false;
  }
  constexpr double units = 4 * std::numeric_limits<double>::epsilon();
  return best_ < std::max(options_.rounding * w_.scales.size, units * best_impulses_) || ++stalled_ > rules_.patience;
}

void Polish::keep_or_go_back(double residual) {
  if (residual < best_) {
    best_ = residual;
    best_impulses_ = std::sqrt(sums_.impulses);
    w_.best = x_;
    proximal_ = std::max(least_proximal_, 0.1 * proximal_);
  } else if (rules_.goes_back) {
    w_.best.iterations = x_.iterations;
    x_ = w_.best;
    proximal_ = std::min(1.0, 30 * proximal_);
    linearise();  // at x again
  }
}

// Far below rounding, and so are the products of large impulses with velocities that should be zero.
bool Polish::cannot_be_better() const {
  const double size = w_.scales.size;
  return best_ <= 1e-2 * options_.rounding * size && sums_.products <= exact_gap * size * size;
}

bool Polish::step() {
  if (!w_.newton.factor()) return false;
  if (s_active_) {
    const double excess = sum_of_shares(p_, x_.r) - p_.kappa;
    if (!w_.newton.solve_bordered(proximal_ / w_.scales.mean_weight, -excess)) return false;
  } else {
    w_.newton.solve(-x_.s);
  }
  ++x_.iterations;
  for (std::size_t i = 0; i < x_.r.size(); ++i) x_.r[i] += w_.newton.dr[i];
  if (p_.has_eta())
    for (int c = 0; c < p_.nc(); ++c) x_.eta[c] += w_.newton.deta[c];
  x_.s += w_.newton.ds;
  return true;
}

// Where the natural map is at rounding there is nothing better, even if the certificate multiplies that rounding (by
// mu, or by large impulses) beyond what was asked for.
bool Polish::accept() {
  x_.status = ConeStatus::nonconverged;
  if (!(best_ < HUGE_VAL)) return false;
  w_.best.iterations = x_.iterations;
  x_ = w_.best;
  const double size = w_.scales.size;
  bool at_rounding = best_ <= options_.rounding * size;
  const Certificate certificate = check(p_, options_, w_, x_, at_rounding);
  // Large impulses raise rounding itself; that is the excuse of the last attempt, and of programs without eta.
  const double large = rules_.goes_back || !p_.has_eta() ? options_.rounding * certificate.size : 0;
  at_rounding = at_rounding || best_ <= large || best_ <= last_bits();
  const bool accepted =
      x_.infeasibility <= options_.feasibility &&
      (at_rounding || std::abs(x_.gap) <= std::max(exact_gap * size * size, certificate.gap_rounding));
  x_.status = accepted ? ConeStatus::solved : ConeStatus::nonconverged;
  return accepted;
}

bool Polish::take_point() {
  if (!(best_ < HUGE_VAL)) return false;
  w_.best.iterations = x_.iterations;
  x_ = w_.best;
  return best_ <= PolishRules::point_found * w_.scales.size;
}

// Of the natural map: what the last bits of velocities without impulses leave of it, sqrt(J).
double Polish::last_bits() {
  w_.no_impulse.assign(3 * p_.nc(), 0.0);
  w_.velocities.bound_rounding(p_, w_.no_impulse, {});
  double least = 0;
  for (const double rho : w_.velocities.rounding) least += rho * rho;
  return std::sqrt(least / w_.scales.ratio);
}

}  // namespace

bool polish(const ConeProgram& p, const ConeOptions& options, const PolishRules& rules, ConeWorkspace& workspace,
            ConeSolution& x) {
  if (!p.has_eta()) x.eta.assign(p.nc(), 0.0);
  return Polish(p, options, rules, workspace, x)();
}

}  // namespace cb
