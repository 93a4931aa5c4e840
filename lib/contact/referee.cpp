// The referee: what is true of an answer.
//
// Everything is recomputed from the problem's own data and the claimed impulses (docs/judging.md). Impulse errors are
// weighted by w_i = trace(W_ii) / 3 (1/kg), so that a residual is a ratio of square roots of energies and the units of
// mass, length and time cancel.
//
// Sizes. An error is a fraction of what the contact it is made at is about,
//   size_c = max(sqrt(w) |r_c|, |u_c+| / sqrt(w), |u_c-| / sqrt(w))                                  sqrt(J)
// so that nothing light or slow hides beside what is heavy or fast, be it joined to it or not. The convex program binds
// an island as a whole: its size is that of the norms over its contacts, its gap is held against its own share.
//
// Terms. Where an answer does not pass by these sizes at 1e-12 (a gap: as it is allowed), it may be that velocities are
// small sums of large terms. By absolute values, entry by entry, impulses change u_c by terms of d_c, and the last bits
// of the data leave rho open, for all contacts of an island, whose impulses determine each other:
//   d_c = |J_c| |M^-1 J^T| |r|,     rho = max_c units eps | |J_c| |v-| + |w_c| + d_c |                m/s
// size_c is at least d_c / sqrt(w) then, and an error of rho counts as `accepted`: size_c >= rho / (sqrt(w) accepted).
// (A limit of a joint, whose velocity may be in rad/s, has a rho of its own.) And a contact of an island is about the
// island's velocities, in both measures: size_c is at least the lesser of the island's size and U / sqrt(w), U the
// fastest |u| of its contacts. What is heavy hides nothing, and another island not even its last bits.

#include "contact/referee.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "linalg/finite.h"

namespace cb {

namespace {

/// Roundings of each term of a velocity that an error may have and still be none, -: a solver's own sums and the
/// check's are made in other orders. Not less than what a method takes for round-off itself (impact_state.h: 90).
constexpr double rounding_units = 128;
/// -: residual from which on terms are looked at: rounding of sums of a few terms stays below it.
constexpr double beyond_rounding = 1e-12;

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
  const auto not_finite = [&] {
    out.finite = false;
    out.model = HUGE_VAL;
    return out;
  };
  if (static_cast<int>(r.size()) != 3 * nc || !all_finite(r) || !factor_.factor(problem.M)) return not_finite();
  momentum_.assign(problem.nv(), 0.0);
  multiply_transposed_add(problem.J, problem.M, r, momentum_);
  v_plus = momentum_;
  factor_.solve_in_place(v_plus);
  for (int i = 0; i < problem.nv(); ++i) v_plus[i] += problem.v_minus[i];
  contact_velocity(problem, v_plus, u_plus_);
  contact_velocity(problem, problem.v_minus, u_minus_);  // = q
  contact_weights(problem, factor_, weight_);
  if (!all_finite(u_plus_) || !all_finite(u_minus_)) return not_finite();

  find_same_islands(problem);
  const bool elastic =
      std::any_of(problem.restitution.begin(), problem.restitution.end(), [](double e) { return e != 0; });
  observe(problem, r, elastic, out);
  balance(problem, v_plus, out);
  rounding_.clear();
  judge(problem, solution, law, elastic, out);
  if (!holds(out, solution, law, out.gap ? accepted : beyond_rounding)) {
    look_at_terms(problem, solution);
    judge(problem, solution, law, elastic, out);
  }
  return out;
}

bool Referee::holds(const Residuals& residuals, const ContactSolution&, Law law, double tolerance) {
  if (!residuals.finite) return false;
  // With restitution `convex` has no gap: its answer is feasible, or it is not.
  if (law != Law::convex || !residuals.gap) return residuals.model <= tolerance;
  return residuals.infeasibility.value_or(HUGE_VAL) <= accepted &&
         std::abs(residuals.island_gap) <= residuals.allowed_gap;
}

std::string Referee::refusal(const Residuals& residuals, double tolerance) {
  if (!residuals.finite) return "the impulses are not finite";
  const std::string where = residuals.worst_contact < 0 ? ""
                                                        : fmt::format(", at contact {} of island {}",
                                                                      residuals.worst_contact, residuals.worst_island);
  if (!residuals.gap) return fmt::format("checked residual {:.3g}, beyond {:g}{}", residuals.model, tolerance, where);
  if (!std::isfinite(residuals.island_gap) || !std::isfinite(residuals.allowed_gap))
    return "energies beyond the largest number: nothing can be said of the gap";
  return fmt::format("checked gap {:.3g} J (allowed: {:.3g}), infeasibility {:.3g} (allowed: {:g}){}",
                     residuals.island_gap, residuals.allowed_gap, residuals.infeasibility.value_or(HUGE_VAL), accepted,
                     where);
}

// The same bodies touch as in the event before, as a rule.
void Referee::find_same_islands(const ContactProblem& problem) {
  if (problem.J.band == joined_band_ && problem.J.block == joined_block_ &&
      problem.M.blocks() == static_cast<int>(islands_.of_block.size()))
    return;
  find_islands(problem, islands_);
  joined_band_ = problem.J.band;
  joined_block_ = problem.J.block;
}

// Sizes, and what is true of any answer.
void Referee::observe(const ContactProblem& problem, std::span<const double> r, bool elastic, Residuals& out) {
  const int nc = problem.nc();
  size2_.resize(nc);
  island_size_q_.resize(islands_.count);
  island_size_.resize(islands_.count);
  sum_.assign(4 * static_cast<std::size_t>(islands_.count), 0.0);  // squares: r, u+, u-, error in Coulomb's law
  double outside = 0;
  for (int c = 0; c < nc; ++c) {
    const ConstVec3 rc(&r[3 * c]), u(&u_plus_[3 * c]), q(&u_minus_[3 * c]);
    const double w = weight_[c], mu = problem.mu[c], slip = tangential(u_plus_, c);
    const double size_r = w * rc.squaredNorm(), size_u = u.squaredNorm() / w, size_q = q.squaredNorm() / w;
    size2_[c] = std::max({size_r, size_u, size_q});
    double* island = &sum_[4 * static_cast<std::size_t>(islands_.of_contact[c])];
    island[0] += size_r;
    island[1] += size_u;
    island[2] += size_q;
    if (!elastic) {
      const Vector3d changed(u[0] + mu * slip, u[1], u[2]);
      island[3] += w * (rc - project_on_cone(rc - changed / w, mu)).squaredNorm();
    }
    out.approach = std::max(out.approach, -u[0]);
    outside = std::max(outside, (rc - project_on_cone(rc, mu)).squaredNorm());
    out.dissipation_gap = std::max(out.dissipation_gap, mu * rc[0] * slip + rc.tail<2>().dot(u.tail<2>()));
    // r.u- + 1/2 r.W r, without the cancellation of a difference of two energies.
    out.energy_gain += 0.5 * rc.dot(u + q - 2 * ConstVec3(&problem.offset[3 * c]));
  }
  out.cone_violation = std::sqrt(outside);
  out.energy_before = 0.5 * quadratic_form(problem.M, problem.v_minus);
  double law2 = 0;
  for (int g = 0; g < islands_.count; ++g) {
    const double* island = &sum_[4 * static_cast<std::size_t>(g)];
    const double size2 = std::max({island[0], island[1], island[2]});
    if (size2 > 0) law2 = std::max(law2, island[3] / size2);
    island_size_q_[g] = std::sqrt(island[2]);
    island_size_[g] = std::sqrt(size2);
  }
  if (!elastic) out.law = std::sqrt(law2);
}

// Sizes grow to those of the terms and of the island's velocities, and to what rounding of the terms makes of errors.
void Referee::look_at_terms(const ContactProblem& problem, const ContactSolution& solution) {
  constexpr double unit = rounding_units * std::numeric_limits<double>::epsilon();
  const BandMatrix& J = problem.J;
  add_changes(problem, solution);
  rounding_.resize(problem.nc());
  // Of each island: square of the fastest |u|; rho, m/s; sum of squares of rounding, J.
  constexpr std::size_t fields = 3;
  sum_.assign(fields * static_cast<std::size_t>(islands_.count), 0.0);
  const auto of_island = [&](int c) { return &sum_[fields * static_cast<std::size_t>(islands_.of_contact[c])]; };
  for (int c = 0; c < problem.nc(); ++c) {
    Vector3d changes = Vector3d::Zero(), before = ConstVec3(&problem.offset[3 * c]).cwiseAbs();
    for (int e = J.band[c]; e < J.band[c + 1]; ++e) {
      const auto entry = J.entry(e);
      const int at = problem.M.first[J.block[e]];
      for (int j = 0; j < entry.cols(); ++j) {
        changes += entry.col(j).cwiseAbs() * changes_[at + j];
        before += entry.col(j).cwiseAbs() * std::abs(problem.v_minus[at + j]);
      }
    }
    rounding_[c] = unit * (changes + before).norm();
    size2_[c] = std::max(size2_[c], changes.squaredNorm() / weight_[c]);
    double* island = of_island(c);
    island[0] =
        std::max({island[0], ConstVec3(&u_plus_[3 * c]).squaredNorm(), ConstVec3(&u_minus_[3 * c]).squaredNorm()});
    if (!is_limit(problem, c)) island[1] = std::max(island[1], rounding_[c]);
  }
  for (int c = 0; c < problem.nc(); ++c) {
    double* island = of_island(c);
    const double size = island_size_[islands_.of_contact[c]], w = weight_[c];
    if (!is_limit(problem, c)) rounding_[c] = island[1];
    const double floor = rounding_[c] / std::sqrt(w) / accepted;
    size2_[c] = std::max({size2_[c], std::min(size * size, island[0] / w), floor * floor});
    island[2] += floor * floor;
  }
  for (int g = 0; g < islands_.count; ++g) {
    const double floor = std::sqrt(sum_[fields * static_cast<std::size_t>(g) + 2]);
    island_size_[g] = std::max(island_size_[g], floor);
    island_size_q_[g] = std::max(island_size_q_[g], floor);
  }
}

// |M^-1 J^T| |r|, m/s and rad/s; the convex program's frictionless impulses count as well. Its multipliers do not: they
// change no velocity.
void Referee::add_changes(const ContactProblem& problem, const ContactSolution& solution) {
  const BandMatrix& J = problem.J;
  const int nc = problem.nc();
  changes_.assign(problem.nv(), 0.0);
  for (int c = 0; c < nc; ++c) {
    Vector3d load = ConstVec3(&solution.impulse[3 * c]).cwiseAbs();
    if (static_cast<int>(solution.frictionless.size()) == nc && std::isfinite(solution.frictionless[c]))
      load[0] += std::abs(solution.frictionless[c]);
    for (int e = J.band[c]; e < J.band[c + 1]; ++e) {
      const int b = J.block[e], n = problem.M.block_size(b);
      columns_.resize(3 * static_cast<std::size_t>(n));
      Eigen::Map<Eigen::MatrixX3d> columns(columns_.data(), n, 3);
      columns = J.entry(e).transpose();
      factor_.solve_block_in_place(b, columns_.data(), 3);
      for (int i = 0; i < n; ++i) changes_[problem.M.first[b] + i] += columns.row(i).cwiseAbs().dot(load);
    }
  }
}

// M (v+ - v-) - J^T r, scaled as sqrt(J) through the diagonal entries of M.
void Referee::balance(const ContactProblem& problem, std::span<const double> v_plus, Residuals& out) {
  scratch_v_.resize(problem.nv());
  difference_.resize(problem.nv());
  for (int i = 0; i < problem.nv(); ++i) difference_[i] = v_plus[i] - problem.v_minus[i];
  multiply(problem.M, difference_, scratch_v_);
  for (int i = 0; i < problem.nv(); ++i) scratch_v_[i] -= momentum_[i];
  double largest = 0;
  for (int b = 0; b < problem.M.blocks(); ++b)
    for (int i = 0; i < problem.M.block_size(b); ++i) {
      const double missing = scratch_v_[problem.M.first[b] + i];
      largest = std::max(largest, missing * missing / problem.M.block(b)(i, i));
    }
  out.momentum = std::sqrt(largest);
}

void Referee::judge(const ContactProblem& problem, const ContactSolution& solution, Law law, bool elastic,
                    Residuals& out) {
  Worst worst;
  switch (law) {
    case Law::anitescu_potra:
      worst = anitescu_potra(problem, solution, elastic);
      if (elastic) gains(problem, solution, worst);
      break;
    case Law::convex:
      if (!elastic) return convex(problem, solution, out);
      // Poisson's second phase moves the answer off the optimum of the first: what is left is feasibility, and that no
      // energy comes from nowhere.
      worst = feasible(problem, solution, [&](int c) { return island_size_[islands_.of_contact[c]]; });
      gains(problem, solution, worst);
      break;
    case Law::newton:
      worst = newton(problem, solution);
      break;
    case Law::mirtich:
      worst = mirtich(problem, solution);
      break;
  }
  out.model = worst.ratio;
  out.worst_contact = worst.contact;
  out.worst_island = worst.island;
}

// No law of restitution with e <= 1 gains energy. What contacts do to an island as seen from the stops, driven ones
// too, is gain = sum r.(u+ + u-)/2, held against a fourth of |sum r.u-|: where an answer gains no more than that that
// is at most the island's kinetic energy, in every frame in which its stops rest.
void Referee::gains(const ContactProblem& problem, const ContactSolution& solution, Worst& worst) {
  const std::vector<double>& r = solution.impulse;
  constexpr std::size_t fields = 3;  // gain, sum r.u-, what rounding leaves open of the gain, all J
  sum_.assign(fields * static_cast<std::size_t>(islands_.count), 0.0);
  for (int c = 0; c < problem.nc(); ++c) {
    const ConstVec3 rc(&r[3 * c]), u(&u_plus_[3 * c]), q(&u_minus_[3 * c]);
    double* island = &sum_[fields * static_cast<std::size_t>(islands_.of_contact[c])];
    island[0] += 0.5 * rc.dot(u + q);
    island[1] += rc.dot(q);
    island[2] += open_work(rc, u, q, c);
  }
  for (int g = 0; g < islands_.count; ++g) {
    const double* island = &sum_[fields * static_cast<std::size_t>(g)];
    // Suboptimality that the solver was allowed (convex) may be a gain, where it is little beside the island.
    const double allowed = std::min(solution.epsilon / accepted, island_size_[g] * island_size_[g]);
    see_island(worst, island[0], std::max({std::abs(island[1]) / 4, island[2] / accepted, allowed}), g);
  }
}

// Takes note of an error. Without size there is nothing an error could be made of, but in a claim of it.
void Referee::see(Worst& worst, double error, double size, int contact) const {
  if (!(error > worst.ratio * size)) return;
  worst.ratio = size > 0 ? error / size : HUGE_VAL;
  worst.contact = contact;
  worst.island = islands_.of_contact[contact];
}

// What rounding leaves open of r.(u + q)/2, J: of the velocities, and by them of the impulses.
double Referee::open_work(const Vector3d& r, const Vector3d& u, const Vector3d& q, int contact) const {
  const double rho = open(contact);
  return rho > 0 ? rho * (r.norm() + (u.norm() + q.norm() + rho) / weight_[contact]) : 0;
}

void Referee::see_island(Worst& worst, double error, double size, int island) {
  if (error > worst.ratio * size) worst = {size > 0 ? error / size : HUGE_VAL, -1, island};
}

// Natural map of the LCP, in impulses: rows of c_n and c_t divided by w_i; lam (m/s) divided by w_i too. What the
// polygon's impulses do not add up to is an error of the answer as well. With restitution z holds two phases (Poisson):
// compression from v-, then theta e c_n is given back and decompression keeps contacts from approaching, its friction
// bounded by mu (theta e c_n + c_n').
Referee::Worst Referee::anitescu_potra(const ContactProblem& problem, const ContactSolution& solution, bool elastic) {
  const int nc = problem.nc(), k = solution.k, unknowns = (k + 2) * nc;
  if (static_cast<int>(solution.z.size()) != (elastic ? 2 : 1) * unknowns || !all_finite(solution.z))
    return {.ratio = HUGE_VAL};

  if (static_cast<int>(cosine_.size()) != k) {
    cosine_.resize(k);
    sine_.resize(k);
    for (int i = 0; i < k; ++i) {
      cosine_[i] = std::cos(2 * M_PI * i / k);
      sine_[i] = std::sin(2 * M_PI * i / k);
    }
  }
  Worst shares;
  given_back_.assign(nc, 0.0);
  phase_.assign(3 * nc, 0.0);
  error_.assign(nc, 0.0);  // squares
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
      error_[c] += w * error;
    }
    if (!last) restitution(problem, solution, shares);
  }
  Worst worst;
  for (int c = 0; c < nc; ++c) see(worst, error_[c], size2_[c], c);
  worst.ratio = std::sqrt(worst.ratio);
  return shares.ratio > worst.ratio ? shares : worst;
}

// theta of each island as the answer's impulses have it (least squares of r_n - c_n - c_n' = theta e c_n), into
// given_back_ as theta e c_n. It is 1, or leaves E = 0, E the energy gained by then. 1 - theta counts as the impulse
// that is missing, of the island's size; E as a fraction of what compression took, E_0, and restitution changed. phase_
// and scratch_u_ are those of compression.
void Referee::restitution(const ContactProblem& problem, const ContactSolution& solution, Worst& worst) {
  const int nc = problem.nc();
  const double *first = solution.z.data(), *second = first + (solution.k + 2) * nc;
  constexpr std::size_t fields = 5;  // of least squares, theta^2 and theta; E_0, E, what rounding leaves open; all J
  sum_.assign(fields * static_cast<std::size_t>(islands_.count), 0.0);
  const auto of_island = [&](int c) { return &sum_[fields * static_cast<std::size_t>(islands_.of_contact[c])]; };
  for (int c = 0; c < nc; ++c) {
    double* island = of_island(c);
    const double asked = problem.restitution[c] * first[c];
    given_back_[c] = asked;
    island[0] += weight_[c] * asked * asked;
    island[1] += weight_[c] * asked * (solution.impulse[3 * c] - first[c] - second[c]);
    island[2] += 0.5 * ConstVec3(&phase_[3 * c]).dot(ConstVec3(&scratch_u_[3 * c]) + ConstVec3(&u_minus_[3 * c]));
  }
  const auto theta = [&](const double* island) { return island[0] > 0 ? island[1] / island[0] : 1; };
  between_ = phase_;
  for (int c = 0; c < nc; ++c) between_[3 * c] += given_back_[c] *= theta(of_island(c));
  apply_impulse(problem, factor_, between_, scratch_v_);
  contact_velocity(problem, scratch_v_, scratch_u_);
  for (int c = 0; c < nc; ++c) {
    double* island = of_island(c);
    const ConstVec3 rc(&between_[3 * c]), u(&scratch_u_[3 * c]), q(&u_minus_[3 * c]);
    island[3] += 0.5 * rc.dot(u + q);
    island[4] += open_work(rc, u, q, c);
  }
  for (int g = 0; g < islands_.count; ++g) {
    const double* island = &sum_[fields * static_cast<std::size_t>(g)];
    const double size = std::max(std::abs(island[2]) + std::abs(island[3] - island[2]), island[4] / accepted);
    const double left = size > 0 ? std::abs(island[3]) / size : 0;
    const double missing = island_size_[g] > 0 ? (1 - theta(island)) * std::sqrt(island[0]) / island_size_[g] : 0;
    see_island(worst, std::min(std::abs(missing), left), 1, g);
  }
}

void Referee::convex(const ContactProblem& problem, const ContactSolution& solution, Residuals& out) {
  const int nc = problem.nc();
  const auto& r = solution.impulse;
  const auto& eta = solution.eta;
  if (static_cast<int>(eta.size()) != nc || !all_finite(eta)) {
    out.gap = out.infeasibility = out.model = out.island_gap = HUGE_VAL;
    return;
  }
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

  Worst worst;
  kappa_.assign(islands_.count, 0.0);
  kappa_scale_.assign(islands_.count, 0.0);
  if (solution.bounded) least_sum(problem, solution, worst);

  // The least s that puts every y of an island into the dual cone mu |y_t| <= y_n.
  slack_.assign(islands_.count, 0.0);
  slack_rounding_.assign(islands_.count, 0.0);
  sum_.assign(islands_.count, 0.0);
  for (int c = 0; c < nc; ++c) {
    const int g = islands_.of_contact[c];
    const double root_w = std::sqrt(weight_[c]), size = island_size_[g], mu = problem.mu[c];
    const double short_of = mu * tangential(y_, c) - y_[3 * c];
    const bool limit = is_limit(problem, c);  // does not count in the bound
    slack_rounding_[g] = std::max(slack_rounding_[g], (1 + mu) * open(c));
    if (solution.bounded && !limit)
      slack_[g] = std::max(slack_[g], short_of);
    else
      see(worst, short_of / root_w, std::max(size, (1 + mu) * open(c) / root_w / accepted), c);
    see(worst, -u_plus_[3 * c] / root_w, size, c);
    see(worst, -r[3 * c] * root_w, size, c);
    see(worst, (tangential(r, c) - mu * r[3 * c]) * root_w, size, c);
    see(worst, -eta[c] * root_w, size, c);
    if (!limit) sum_[g] += r[3 * c];
  }
  if (solution.bounded)
    for (int g = 0; g < islands_.count; ++g)
      if (sum_[g] - kappa_[g] > worst.ratio * kappa_scale_[g]) worst = {(sum_[g] - kappa_[g]) / kappa_scale_[g], -1, g};
  out.infeasibility = worst.ratio;
  out.worst_contact = worst.contact;
  out.worst_island = worst.island;
  out.model = worst.ratio;
  gaps(problem, solution, out);
}

// Gaps island by island: eta.u_n + r.y + s 1.r_n, all three complementary, + s (kappa - 1.r_n), with the bounds that
// the answer meets: u_n below 0 counts as 0, and a sum beyond kappa as kappa (how far they are from the problem's is
// the infeasibility). What is more than rounding of velocities and of the impulses that they determine adds up to
// epsilon at most.
void Referee::gaps(const ContactProblem& problem, const ContactSolution& solution, Residuals& out) {
  const auto& r = solution.impulse;
  gap_.assign(islands_.count, 0.0);
  gap_rounding_.assign(islands_.count, 0.0);
  for (int c = 0; c < problem.nc(); ++c) {
    const int g = islands_.of_contact[c];
    const ConstVec3 rc(&r[3 * c]), yc(&y_[3 * c]);
    const double eta = solution.eta[c], s = is_limit(problem, c) ? 0 : slack_[g];
    gap_[g] += eta * std::max(u_plus_[3 * c], 0.0) + rc.dot(yc) + s * rc[0];
    gap_rounding_[g] += open(c) * (rc.norm() + std::abs(eta) + (yc.norm() + s) / weight_[c]);
  }
  double total = 0, excess = 0, worst = -1;
  int worst_island = -1;
  const auto rounding = [&](int g) {  // large multipliers excuse no more than `accepted` of what the island is about
    return std::min(gap_rounding_[g] + slack_rounding_[g] * std::abs(kappa_[g]),
                    accepted * island_size_[g] * island_size_[g]);
  };
  for (int g = 0; g < islands_.count; ++g) {
    if (solution.bounded) gap_[g] += slack_[g] * std::max(kappa_[g] - sum_[g], 0.0);
    total += gap_[g];
    const double size = island_size_[g] * island_size_[g];
    // One number for the law: the gap as a fraction of the energy that the island is about.
    if (gap_[g] != 0) out.model = std::max(out.model, size > 0 ? std::abs(gap_[g]) / size : HUGE_VAL);
    const double beyond = std::abs(gap_[g]) - rounding(g);
    excess += std::max(beyond, 0.0);
    if (worst_island >= 0 && !(beyond > worst)) continue;
    worst = beyond;
    worst_island = g;
  }
  if (worst_island >= 0) {
    // What the others leave of epsilon.
    const double others = excess - std::max(worst, 0.0);
    out.island_gap = gap_[worst_island];
    out.allowed_gap = rounding(worst_island) + std::max(solution.epsilon - others, 0.0);
    if (std::abs(out.island_gap) > out.allowed_gap && out.infeasibility <= accepted) {
      out.worst_island = worst_island;
      out.worst_contact = -1;
    }
  }
  out.gap = total;
}

// kappa: the frictionless impulses must solve min 1/2 v.M v, N v + w_n >= 0, and z must prove that no other solution of
// it has a smaller sum: N z <= 1 where contacts touch, f.(1 - N z) = 0 (duality of the linear program). Limits of
// joints do not count in the sum: there 0 stands for 1.
void Referee::least_sum(const ContactProblem& problem, const ContactSolution& solution, Worst& worst) {
  const int nc = problem.nc();
  const auto& f = solution.frictionless;
  const auto& z = solution.kappa_dual;
  if (static_cast<int>(f.size()) != nc || static_cast<int>(z.size()) != problem.nv() || !all_finite(f) ||
      !all_finite(z)) {
    worst.ratio = HUGE_VAL;
    kappa_scale_.assign(islands_.count, 1.0);
    return;
  }
  // Scaled u_n up to which the frictionless solution touches, -: the bound on it below. A contact that opens faster
  // than rounding and f itself explain is open, however slowly, and carries nothing in any solution.
  constexpr double touching = 1e-9;

  scratch_u_.assign(3 * nc, 0.0);
  for (int c = 0; c < nc; ++c) scratch_u_[3 * c] = f[c];
  scratch_v_.assign(problem.nv(), 0.0);
  multiply_transposed_add(problem.J, problem.M, scratch_u_, scratch_v_);
  factor_.solve_in_place(scratch_v_);
  for (int i = 0; i < problem.nv(); ++i) scratch_v_[i] += problem.v_minus[i];
  contact_velocity(problem, scratch_v_, scratch_u_);  // u of the frictionless solution
  u_dual_.resize(3 * nc);
  multiply(problem.J, problem.M, z, u_dual_);

  // f solves exactly the problem whose velocities differ by what it leaves of f_i u_n,i = 0: there a contact touches.
  kappa_miss_.assign(islands_.count, 0.0);
  for (int c = 0; c < nc; ++c) {
    const double root_w = std::sqrt(weight_[c]), u_n = scratch_u_[3 * c] / root_w;
    double& miss = kappa_miss_[islands_.of_contact[c]];
    miss = std::max({miss, -u_n, std::min(f[c] * root_w, u_n)});
  }
  for (int c = 0; c < nc; ++c) {
    const int g = islands_.of_contact[c];
    const double size = island_size_q_[g];  // impulses with friction, however large, are no matter here
    const double root_w = std::sqrt(weight_[c]), u_n = scratch_u_[3 * c];
    const double share = is_limit(problem, c) ? 0 : 1, excess = u_dual_[3 * c] - share;
    see(worst, -f[c] * root_w, size, c);
    see(worst, -u_n / root_w, size, c);
    see(worst, std::min(f[c] * root_w, u_n / root_w), size, c);  // f_i u_n,i = 0
    double touches = touching * size;
    if (!rounding_.empty()) touches = std::min(touches, open(c) / root_w + kappa_miss_[g]);

    if (u_n / root_w <= touches) see(worst, excess, 1, c);         // N z <= 1 where it touches
    see(worst, std::min(-excess * size, f[c] * root_w), size, c);  // f_i (1 - N z)_i = 0
    kappa_[g] += share * f[c];
    kappa_scale_[g] += (std::abs(u_minus_[3 * c]) + open(c) / accepted) / weight_[c];
  }
  for (int g = 0; g < islands_.count; ++g) {
    kappa_scale_[g] = std::max(kappa_scale_[g], std::abs(kappa_[g]));
    if (kappa_scale_[g] == 0) kappa_scale_[g] = 1;
  }
}

// Nothing approaches any more, and impulses lie in their cones.
template <class Size>
Referee::Worst Referee::feasible(const ContactProblem& problem, const ContactSolution& solution, Size size_of) const {
  Worst worst;
  const auto& r = solution.impulse;
  for (int c = 0; c < problem.nc(); ++c) {
    const double root_w = std::sqrt(weight_[c]), r_n = r[3 * c], size = size_of(c);
    see(worst, -u_plus_[3 * c] / root_w, size, c);
    see(worst, -r_n * root_w, size, c);
    see(worst, (tangential(r, c) - problem.mu[c] * r_n) * root_w, size, c);
  }
  return worst;
}

Referee::Worst Referee::impact(const ContactProblem& problem, const ContactSolution& solution) const {
  return feasible(problem, solution, [&](int c) { return std::sqrt(size2_[c]); });
}

// Where a single contact was solved Newton's law holds to the letter: u_n+ = -e u_n-. (With several, impacts are a
// sequence, and each has its own u_n-.)
Referee::Worst Referee::newton(const ContactProblem& problem, const ContactSolution& solution) const {
  Worst worst = impact(problem, solution);
  if (problem.nc() == 1 && u_minus_[0] < 0)
    see(worst, std::abs(u_plus_[0] + problem.restitution[0] * u_minus_[0]) / std::sqrt(weight_[0]),
        std::sqrt(size2_[0]), 0);
  return worst;
}

// Stronge's law: the works that the method claims must give back e^2 of what compression stored, take energy by
// friction, and on each island add up to the change of kinetic energy.
Referee::Worst Referee::mirtich(const ContactProblem& problem, const ContactSolution& solution) {
  const int nc = problem.nc();
  const auto& stored = solution.compression_work;
  const auto& returned = solution.restitution_work;
  const auto& friction = solution.friction_work;
  for (const auto* work : {&stored, &returned, &friction})
    if (static_cast<int>(work->size()) != nc || !all_finite(*work)) return {.ratio = HUGE_VAL};
  Worst worst = impact(problem, solution);
  sum_.assign(islands_.count, 0.0);
  for (int c = 0; c < nc; ++c) {
    const int g = islands_.of_contact[c];
    const double e = problem.restitution[c], energy = island_size_[g] * island_size_[g];
    see(worst, std::abs(returned[c] + e * e * stored[c]), energy, c);
    see(worst, friction[c], energy, c);
    // The work of the impulses is r.(u- + u+) / 2; the kinetic energy of v knows nothing of the offset.
    sum_[g] += stored[c] + returned[c] + friction[c];
    for (int i = 3 * c; i < 3 * c + 3; ++i) sum_[g] -= solution.impulse[i] * (u_plus_[i] + u_minus_[i]) / 2;
  }
  for (int g = 0; g < islands_.count; ++g) {
    const double energy = island_size_[g] * island_size_[g];
    if (std::abs(sum_[g]) > worst.ratio * energy) worst = {energy > 0 ? std::abs(sum_[g]) / energy : HUGE_VAL, -1, g};
  }
  return worst;
}

}  // namespace cb
