// The referee: what is true of an answer.
//
// Everything is recomputed from the problem's own data and the claimed impulses (spec: metrics.md). Impulse errors are
// weighted by w_i = trace(W_ii) / 3 (1/kg), so that a residual is a ratio of square roots of energies and the units of
// mass, length and time cancel. All sums run over the whole event: a contact that is idle, and whose velocity is only
// round-off, is measured against what the event is about.

#include "contact/referee.h"

#include <algorithm>
#include <cmath>

#include "linalg/finite.h"

namespace cb {

namespace {

using Eigen::Vector3d;
using ConstVec3 = Eigen::Map<const Vector3d>;

/// Projection on the cone |x_t| <= mu x_n, rows n, t1, t2.
Vector3d project_on_cone(const Vector3d& x, double mu) {
  const double t = std::sqrt(x[1] * x[1] + x[2] * x[2]);
  if (t <= mu * x[0]) return x;
  if (mu * t <= -x[0]) return Vector3d::Zero();
  const double n = (x[0] + mu * t) / (1 + mu * mu);
  const double scale = t > 0 ? mu * n / t : 0;
  return {n, scale * x[1], scale * x[2]};
}

double tangential(std::span<const double> x, int c) {
  return std::sqrt(x[3 * c + 1] * x[3 * c + 1] + x[3 * c + 2] * x[3 * c + 2]);
}

}  // namespace

Residuals Referee::check(const ContactProblem& problem, const ContactSolution& solution, Law law,
                         std::vector<double>& v_plus) {
  Residuals out;
  const int nc = problem.nc();
  const auto& r = solution.impulse;
  v_plus = problem.v_minus;
  if (static_cast<int>(r.size()) != 3 * nc || !all_finite(r) || !factor_.factor(problem.M)) {
    out.finite = false;
    out.model = HUGE_VAL;
    return out;
  }
  momentum_.assign(problem.nv(), 0.0);
  multiply_transposed_add(problem.J, problem.M, r, momentum_);
  v_plus = momentum_;
  factor_.solve_in_place(v_plus);
  for (int i = 0; i < problem.nv(); ++i) v_plus[i] += problem.v_minus[i];
  contact_velocity(problem, v_plus, u_plus_);
  contact_velocity(problem, problem.v_minus, u_minus_);  // = q
  contact_weights(problem, factor_, weight_);
  if (!all_finite(u_plus_) || !all_finite(u_minus_)) {
    out.finite = false;
    out.model = HUGE_VAL;
    return out;
  }

  // Weights and the size of the event.
  double size_r = 0, size_u = 0, size_q = 0;
  bool elastic = false;
  for (int c = 0; c < nc; ++c) {
    size_r += weight_[c] * ConstVec3(&r[3 * c]).squaredNorm();
    size_u += ConstVec3(&u_plus_[3 * c]).squaredNorm() / weight_[c];
    size_q += ConstVec3(&u_minus_[3 * c]).squaredNorm() / weight_[c];
    elastic = elastic || problem.restitution[c] != 0;
  }
  size_ = std::sqrt(std::max({size_r, size_u, size_q}));
  size_q_ = std::sqrt(size_q);

  for (int c = 0; c < nc; ++c) {
    const ConstVec3 rc(&r[3 * c]);
    const double mu = problem.mu[c];
    out.approach = std::max(out.approach, -u_plus_[3 * c]);
    out.cone_violation = std::max(out.cone_violation, (rc - project_on_cone(rc, mu)).norm());
    out.dissipation_gap = std::max(out.dissipation_gap, mu * rc[0] * tangential(u_plus_, c) +
                                                            rc.tail<2>().dot(ConstVec3(&u_plus_[3 * c]).tail<2>()));
    // r.u- + 1/2 r.W r, without the cancellation of a difference of two energies.
    for (int i = 0; i < 3; ++i)
      out.energy_gain += 0.5 * rc[i] * (u_plus_[3 * c + i] + u_minus_[3 * c + i] - 2 * problem.offset[3 * c + i]);
  }
  out.energy_before = 0.5 * quadratic_form(problem.M, problem.v_minus);

  // M (v+ - v-) - J^T r, scaled as sqrt(J) through the largest diagonal entry of M.
  scratch_v_.resize(problem.nv());
  difference_.resize(problem.nv());
  for (int i = 0; i < problem.nv(); ++i) difference_[i] = v_plus[i] - problem.v_minus[i];
  multiply(problem.M, difference_, scratch_v_);
  for (int i = 0; i < problem.nv(); ++i) scratch_v_[i] -= momentum_[i];
  for (int b = 0; b < problem.M.blocks(); ++b)
    for (int i = 0; i < problem.M.block_size(b); ++i)
      out.momentum =
          std::max(out.momentum, std::abs(scratch_v_[problem.M.first[b] + i]) / std::sqrt(problem.M.block(b)(i, i)));

  if (!elastic) out.law = coulomb(problem, r, u_plus_);
  switch (law) {
    case Law::anitescu_potra:
      out.model = anitescu_potra(problem, solution, elastic);
      break;
    case Law::convex:
      convex(problem, solution, elastic, out);
      break;
    case Law::newton:
      out.model = newton(problem, solution);
      break;
    case Law::mirtich:
      out.model = mirtich(problem, solution, out.energy_gain);
      break;
  }
  return out;
}

bool Referee::holds(const Residuals& residuals, const ContactSolution& solution, Law law, double tolerance) {
  if (!residuals.finite) return false;
  // With restitution `convex` has no gap: its answer is feasible, or it is not.
  if (law != Law::convex || !residuals.gap) return residuals.model <= tolerance;
  return residuals.infeasibility.value_or(HUGE_VAL) <= 1e-9 &&
         std::abs(residuals.gap.value_or(HUGE_VAL)) <= solution.epsilon + 1e-14 * residuals.energy_before;
}

double Referee::coulomb(const ContactProblem& problem, std::span<const double> r, std::span<const double> u) {
  if (size_ == 0) return 0;
  double sum = 0;
  for (int c = 0; c < problem.nc(); ++c) {
    const ConstVec3 rc(&r[3 * c]);
    Vector3d changed = ConstVec3(&u[3 * c]);
    changed[0] += problem.mu[c] * tangential(u, c);
    sum += weight_[c] * (rc - project_on_cone(rc - changed / weight_[c], problem.mu[c])).squaredNorm();
  }
  return std::sqrt(sum) / size_;
}

// Natural map of the LCP, in impulses: rows of c_n and c_t divided by w_i; lam (m/s) divided by w_i too. What the
// polygon's impulses do not add up to is an error of the answer as well. With restitution z holds two phases (Poisson):
// compression from v-, then e c_n is given back and decompression keeps contacts from approaching, its friction bounded
// by mu (e c_n + c_n').
double Referee::anitescu_potra(const ContactProblem& problem, const ContactSolution& solution, bool elastic) {
  const int nc = problem.nc(), k = solution.k, unknowns = (k + 2) * nc;
  if (static_cast<int>(solution.z.size()) != (elastic ? 2 : 1) * unknowns || !all_finite(solution.z)) return HUGE_VAL;
  if (size_ == 0) return 0;

  if (static_cast<int>(cosine_.size()) != k) {
    cosine_.resize(k);
    sine_.resize(k);
    for (int i = 0; i < k; ++i) {
      cosine_[i] = std::cos(2 * M_PI * i / k);
      sine_[i] = std::sin(2 * M_PI * i / k);
    }
  }
  given_back_.assign(nc, 0.0);
  phase_.assign(3 * nc, 0.0);
  double sum = 0;
  for (int at = 0; at < static_cast<int>(solution.z.size()); at += unknowns) {
    const double* z = solution.z.data() + at;
    for (int c = 0; c < nc; ++c) {
      phase_[3 * c] += z[c] + given_back_[c];
      for (int i = 0; i < k; ++i) {
        phase_[3 * c + 1] += cosine_[i] * z[nc + k * c + i];
        phase_[3 * c + 2] += sine_[i] * z[nc + k * c + i];
      }
    }
    const bool last = at + unknowns == static_cast<int>(solution.z.size());
    if (!last) {
      apply_impulse(problem, factor_, phase_, scratch_v_);
      contact_velocity(problem, scratch_v_, scratch_u_);
    }
    const std::vector<double>& u = last ? u_plus_ : scratch_u_;
    for (int c = 0; c < nc; ++c) {
      const double w = weight_[c], lam = z[nc + k * nc + c];
      double error = 0, c_sum = 0;
      const auto add = [&](double e) { error += e * e; };
      add(std::min(z[c], u[3 * c] / w));
      for (int i = 0; i < k; ++i) {
        const double c_t = z[nc + k * c + i];
        add(std::min(c_t, (cosine_[i] * u[3 * c + 1] + sine_[i] * u[3 * c + 2] + lam) / w));
        c_sum += c_t;
      }
      add(std::min(lam / w, problem.mu[c] * (z[c] + given_back_[c]) - c_sum));
      if (last)
        for (int i = 0; i < 3; ++i) add(phase_[3 * c + i] - solution.impulse[3 * c + i]);
      sum += w * error;
      given_back_[c] = problem.restitution[c] * z[c];
    }
  }
  return std::sqrt(sum) / size_;
}

void Referee::convex(const ContactProblem& problem, const ContactSolution& solution, bool elastic, Residuals& out) {
  const int nc = problem.nc();
  const auto& r = solution.impulse;
  const auto& eta = solution.eta;
  if (elastic) {  // Poisson's second phase moves the answer off the optimum of the first: what is left is feasibility
    for (int c = 0; c < nc; ++c) {
      const double root_w = std::sqrt(weight_[c]), r_n = r[3 * c];
      out.model = std::max(
          {out.model, -u_plus_[3 * c] / root_w, -r_n * root_w, (tangential(r, c) - problem.mu[c] * r_n) * root_w});
    }
    if (size_ > 0) out.model /= size_;
    // No law of restitution with e <= 1 gains energy; limits of joints that are driven may.
    const bool driven = std::any_of(problem.offset.begin(), problem.offset.end(), [](double w) { return w != 0; });
    if (!driven && out.energy_gain > 0) out.model = std::max(out.model, out.energy_gain / out.energy_before);
    return;
  }
  if (static_cast<int>(eta.size()) != nc || !all_finite(eta)) {
    out.gap = out.infeasibility = out.model = HUGE_VAL;
    return;
  }
  find_islands(problem, islands_);
  double worst = 0;
  const auto violated = [&](double x) { worst = std::max(worst, x); };
  const double size = size_ > 0 ? size_ : 1;

  // y = u - W_(:,n) eta; as a rule eta = 0.
  y_ = u_plus_;
  if (std::any_of(eta.begin(), eta.end(), [](double x) { return x != 0; })) {
    scratch_u_.assign(3 * nc, 0.0);
    for (int c = 0; c < nc; ++c) scratch_u_[3 * c] = eta[c];
    scratch_v_.assign(problem.nv(), 0.0);
    multiply_transposed_add(problem.J, problem.M, scratch_u_, scratch_v_);
    factor_.solve_in_place(scratch_v_);
    multiply(problem.J, problem.M, scratch_v_, scratch_u_);
    for (int i = 0; i < 3 * nc; ++i) y_[i] -= scratch_u_[i];
  }

  kappa_.assign(islands_.count, 0.0);
  kappa_scale_.assign(islands_.count, 0.0);
  if (solution.bounded) least_sum(problem, solution, worst);

  // The least s that puts every y of an island into the dual cone mu |y_t| <= y_n.
  slack_.assign(islands_.count, 0.0);
  sum_.assign(islands_.count, 0.0);
  for (int c = 0; c < nc; ++c) {
    const int g = islands_.of_contact[c];
    const double short_of = problem.mu[c] * tangential(y_, c) - y_[3 * c];
    const double share = is_limit(problem, c) ? 0 : 1;  // limits of joints do not count in the bound
    if (solution.bounded && share > 0)
      slack_[g] = std::max(slack_[g], short_of);
    else if (short_of > 0)
      violated(short_of / std::sqrt(weight_[c]) / size);
    sum_[g] += share * r[3 * c];
  }

  double gap = 0;
  for (int c = 0; c < nc; ++c) {
    const double s = is_limit(problem, c) ? 0 : slack_[islands_.of_contact[c]];
    const double root_w = std::sqrt(weight_[c]);
    gap += eta[c] * u_plus_[3 * c] + ConstVec3(&r[3 * c]).dot(ConstVec3(&y_[3 * c])) + s * r[3 * c];
    violated(-u_plus_[3 * c] / root_w / size);
    violated(-r[3 * c] * root_w / size);
    violated((tangential(r, c) - problem.mu[c] * r[3 * c]) * root_w / size);
    violated(-eta[c] * root_w / size);
  }
  if (solution.bounded)
    for (int g = 0; g < islands_.count; ++g) {
      gap += slack_[g] * (kappa_[g] - sum_[g]);
      if (sum_[g] > kappa_[g]) violated((sum_[g] - kappa_[g]) / kappa_scale_[g]);
    }
  out.gap = gap;
  out.infeasibility = worst;
  // One number for the law: the gap as a fraction of the energy that the event is about.
  out.model = std::max(worst, std::abs(gap) / (size * size));
}

// kappa: the frictionless impulses must solve min 1/2 v.M v, N v + w_n >= 0, and z must prove that no other solution of
// it has a smaller sum: N z <= 1 where contacts touch, f.(1 - N z) = 0 (duality of the linear program). Limits of
// joints do not count in the sum: there 0 stands for 1.
void Referee::least_sum(const ContactProblem& problem, const ContactSolution& solution, double& worst) {
  const int nc = problem.nc();
  const auto& f = solution.frictionless;
  const auto& z = solution.kappa_dual;
  if (static_cast<int>(f.size()) != nc || static_cast<int>(z.size()) != problem.nv() || !all_finite(f) ||
      !all_finite(z)) {
    worst = HUGE_VAL;
    kappa_scale_.assign(islands_.count, 1.0);
    return;
  }
  const auto violated = [&](double x) { worst = std::max(worst, x); };
  const double size = size_q_ > 0 ? size_q_ : 1;  // impulses with friction, however large, are no matter here
  constexpr double touching = 1e-9;  // scaled u_n up to which the frictionless solution touches: the bound on it below

  scratch_u_.assign(3 * nc, 0.0);
  for (int c = 0; c < nc; ++c) scratch_u_[3 * c] = f[c];
  scratch_v_.assign(problem.nv(), 0.0);
  multiply_transposed_add(problem.J, problem.M, scratch_u_, scratch_v_);
  factor_.solve_in_place(scratch_v_);
  for (int i = 0; i < problem.nv(); ++i) scratch_v_[i] += problem.v_minus[i];
  contact_velocity(problem, scratch_v_, scratch_u_);  // u of the frictionless solution
  u_dual_.resize(3 * nc);
  multiply(problem.J, problem.M, z, u_dual_);

  for (int c = 0; c < nc; ++c) {
    const int g = islands_.of_contact[c];
    const double root_w = std::sqrt(weight_[c]);
    const double share = is_limit(problem, c) ? 0 : 1;
    const double u_n = scratch_u_[3 * c], excess = u_dual_[3 * c] - share;
    violated(-f[c] * root_w / size);
    violated(-u_n / root_w / size);
    violated(std::min(f[c] * root_w, u_n / root_w) / size);  // f_i u_n,i = 0
    if (u_n / root_w <= touching * size) violated(excess);   // N z <= 1 where it touches
    violated(std::min(-excess, f[c] * root_w / size));       // f_i (1 - N z)_i = 0
    kappa_[g] += share * f[c];
    kappa_scale_[g] += std::abs(u_minus_[3 * c]) / weight_[c];
  }
  for (int g = 0; g < islands_.count; ++g) {
    kappa_scale_[g] = std::max(kappa_scale_[g], std::abs(kappa_[g]));
    if (kappa_scale_[g] == 0) kappa_scale_[g] = 1;
  }
}

// Impact laws: nothing approaches any more, impulses lie in their cones, and where a single contact was solved Newton's
// law holds to the letter: u_n+ = -e u_n-. (With several, impacts are a sequence, and each has its own u_n-.)
double Referee::newton(const ContactProblem& problem, const ContactSolution& solution) const {
  double worst = 0;
  for (int c = 0; c < problem.nc(); ++c) {
    const double root_w = std::sqrt(weight_[c]), u_n = u_plus_[3 * c], r_n = solution.impulse[3 * c];
    worst = std::max(
        {worst, -u_n / root_w, -r_n * root_w, (tangential(solution.impulse, c) - problem.mu[c] * r_n) * root_w});
    if (problem.nc() == 1 && u_minus_[0] < 0)
      worst = std::max(worst, std::abs(u_n + problem.restitution[0] * u_minus_[0]) / root_w);
  }
  return size_ > 0 ? worst / size_ : worst;
}

// Stronge's law: the works that the method claims must give back e^2 of what compression stored, take energy by
// friction, and add up to the change of kinetic energy.
double Referee::mirtich(const ContactProblem& problem, const ContactSolution& solution, double energy_gain) const {
  const int nc = problem.nc();
  const auto& stored = solution.compression_work;
  const auto& returned = solution.restitution_work;
  const auto& friction = solution.friction_work;
  for (const auto* work : {&stored, &returned, &friction})
    if (static_cast<int>(work->size()) != nc || !all_finite(*work)) return HUGE_VAL;
  // The work of the impulses is r.(u- + u+) / 2; the kinetic energy of v knows nothing of the offset.
  double worst = 0, balance = -energy_gain;
  for (int i = 0; i < 3 * nc; ++i) balance -= solution.impulse[i] * problem.offset[i];
  for (int c = 0; c < nc; ++c) {
    const double root_w = std::sqrt(weight_[c]), r_n = solution.impulse[3 * c], e = problem.restitution[c];
    worst = std::max({worst, -u_plus_[3 * c] / root_w / size_, -r_n * root_w / size_,
                      (tangential(solution.impulse, c) - problem.mu[c] * r_n) * root_w / size_});
    const double energy = size_ * size_;
    worst = std::max({worst, std::abs(returned[c] + e * e * stored[c]) / energy, friction[c] / energy});
    balance += stored[c] + returned[c] + friction[c];
  }
  return size_ > 0 ? std::max(worst, std::abs(balance) / (size_ * size_)) : 0;
}

}  // namespace cb
