// The referee: what is true of an answer.
//
// Everything is recomputed from the problem's own data and the claimed impulses (docs/judging.md). Impulse errors are
// weighted by w_i = trace(W_ii) / 3 (1/kg), so that a residual is a ratio of square roots of energies and the units of
// mass, length and time cancel.
//
// Sizes. An error is a fraction of what the contact it is made at is about,
//   size_c = max(sqrt(w) |r_c|, |u_c+| / sqrt(w), |u_c-| / sqrt(w))                                  sqrt(J)
// so that nothing light or slow hides beside what is heavy or fast, be it joined to it or not. The convex program binds
// an island as a whole: its size is that of the norms over its contacts, its gap is held against what the others leave.
//
// Islands. Where an answer does not pass by these sizes at 1e-12 (a gap: as it is allowed, and at 1e-9), a contact is
// about its island's velocities, in both measures: size_c is at least the lesser of the island's size and U / sqrt(w),
// U the fastest |u| of its contacts. A corner that carries nothing beside others that rest has velocities of rounding
// alone.
//
// Terms. Where it does not pass by these either, it may be that velocities are small sums of large terms. By absolute
// values, entry by entry, impulses change u_c by terms of d_c, and the last bits of the data leave rho open, for all
// contacts of an island, whose impulses determine each other:
//   d_c = |J_c| |M^-1 J^T| |r|
//   m_c = sum over blocks b of max(|J_cb M_b^-1| max(|M_b| |v+ - v-|, |J^T| |r|), sqrt(E_b diag J_cb M_b^-1 J_cb^T))
//   rho = max_c units eps max(| |J_c| |v-| + |w_c| + d_c |, |m_c|)                                    m/s
// with E_b = |v+ - v-|^2 in M_b's norm: a block's last bits are those of its largest entries.
// size_c is at least d_c / sqrt(w) then, and an error of rho counts as `accepted`: size_c >= rho / (sqrt(w) accepted).
// A limit of a joint, whose velocity may be in rad/s, has a rho of its own and no part in U; its own U is what stopping
// all the others would make of its velocity,
//   U_c = |J_c| |M^-1 J^T| max(|u+|, |u-|) / w
// What is heavy hides nothing, and another island not even its last bits.

#include "contact/referee.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

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

bool same_bits(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}

}  // namespace

Residuals Referee::check(const ContactProblem& problem, const ContactSolution& solution, const Law& law,
                         std::vector<double>& v_plus) {
  Residuals out;
  v_plus = problem.v_minus;
  const auto not_finite = [&] {
    out = {};
    out.finite = false;
    out.model = HUGE_VAL;
    return out;
  };
  if (!weigh(problem) || !recompute(problem, solution.impulse, v_plus)) return not_finite();
  if (law.check != made_by_) {
    law_check_ = law.check();
    made_by_ = law.check;
  }
  observe(problem, solution.impulse, out);
  if (!all_finite(at_.island_size)) return not_finite();  // numbers that have no square
  balance(problem, v_plus, out);
  at_.rounding.clear();
  law_check_(problem, solution, at_, out);
  // A gap within epsilon may be more than its island has: is it the last bits' of what rests?
  const auto passes = [&] {
    return holds(out, out.gap ? accepted : beyond_rounding) && !(out.gap && out.model > accepted);
  };
  if (!passes()) {
    look_at_islands(problem);
    law_check_(problem, solution, at_, out);
  }
  if (!passes()) {
    look_at_terms(problem, solution, law);
    law_check_(problem, solution, at_, out);
  }
  return out;
}

// Factor of M, weights and islands; false where there are none. What rests is asked about again and again: of the same
// numbers, bit by bit, the same comes.
bool Referee::weigh(const ContactProblem& problem) {
  const BandMatrix& J = problem.J;
  const bool joined = J.band == weighed_.band && J.block == weighed_.block && problem.M.first == weighed_.first;
  if (joined && same_bits(J.values, weighed_.J) && same_bits(problem.M.values, weighed_.M)) return weighs_;
  if (!joined) {
    find_islands(problem, at_.islands);
    weighed_.band = J.band;
    weighed_.block = J.block;
    weighed_.first = problem.M.first;
  }
  weighed_.J = J.values;
  weighed_.M = problem.M.values;
  weighs_ = at_.factor.factor(problem.M);
  if (!weighs_) return false;
  contact_weights(problem, at_.factor, at_.weight);
  weighs_ = std::all_of(at_.weight.begin(), at_.weight.end(), [](double w) { return w > 0 && w < HUGE_VAL; });
  return weighs_;
}

// Velocities after and before; false where something is not finite, or not of the right size.
bool Referee::recompute(const ContactProblem& problem, std::span<const double> r, std::vector<double>& v_plus) {
  if (static_cast<int>(r.size()) != 3 * problem.nc() || !all_finite(r)) return false;
  momentum_.assign(problem.nv(), 0.0);
  multiply_transposed_add(problem.J, problem.M, r, momentum_);
  v_plus = momentum_;
  at_.factor.solve_in_place(v_plus);
  for (int i = 0; i < problem.nv(); ++i) v_plus[i] += problem.v_minus[i];
  contact_velocity(problem, v_plus, at_.u_plus);
  contact_velocity(problem, problem.v_minus, at_.u_minus);  // = q
  return all_finite(at_.u_plus) && all_finite(at_.u_minus);
}

bool Referee::holds(const Residuals& residuals, double tolerance) {
  if (!residuals.finite) return false;
  if (!residuals.gap) return residuals.model <= tolerance;
  return residuals.infeasibility.value_or(HUGE_VAL) <= accepted &&
         std::abs(residuals.island_gap) <= residuals.allowed_gap;
}

std::string Referee::refusal(const Residuals& residuals, double tolerance) {
  if (!residuals.finite) return "impulses, or what comes of them, are not finite, or their squares are not";
  std::string where;
  if (residuals.worst_contact >= 0)
    where = fmt::format(", at contact {} of island {}", residuals.worst_contact, residuals.worst_island);
  else if (residuals.worst_island >= 0)
    where = fmt::format(", on island {}", residuals.worst_island);
  if (!residuals.gap) return fmt::format("checked residual {:.3g}, beyond {:g}{}", residuals.model, tolerance, where);
  if (!std::isfinite(residuals.island_gap) || !std::isfinite(residuals.allowed_gap))
    return "energies beyond the largest number: nothing can be said of the gap";
  return fmt::format("checked gap {:.3g} J (allowed: {:.3g}), infeasibility {:.3g} (allowed: {:g}){}",
                     residuals.island_gap, residuals.allowed_gap, residuals.infeasibility.value_or(HUGE_VAL), accepted,
                     where);
}

// Sizes, and what is true of any answer.
void Referee::observe(const ContactProblem& problem, std::span<const double> r, Residuals& out) {
  const int nc = problem.nc();
  at_.size2.resize(nc);
  at_.island_size_q.resize(at_.islands.count);
  at_.island_size.resize(at_.islands.count);
  at_.elastic = find_elastic(problem, at_.islands, at_.elastic_island);
  sum_.assign(4 * static_cast<std::size_t>(at_.islands.count), 0.0);  // squares: r, u+, u-, error in Coulomb's law
  double outside = 0;
  for (int c = 0; c < nc; ++c) {
    const ConstVec3 rc(&r[3 * c]), u(&at_.u_plus[3 * c]), q(&at_.u_minus[3 * c]);
    const double w = at_.weight[c], mu = problem.mu[c], slip = tangential(at_.u_plus, c);
    const double size_r = w * rc.squaredNorm(), size_u = u.squaredNorm() / w, size_q = q.squaredNorm() / w;
    at_.size2[c] = std::max({size_r, size_u, size_q});
    double* island = &sum_[4 * static_cast<std::size_t>(at_.islands.of_contact[c])];
    island[0] += size_r;
    island[1] += size_u;
    island[2] += size_q;
    if (!at_.elastic) island[3] += w * coulomb_error(rc, u, mu, w).squaredNorm();
    out.approach = std::max(out.approach, -u[0]);
    outside = std::max(outside, (rc - project_on_cone(rc, mu)).squaredNorm());
    out.dissipation_gap = std::max(out.dissipation_gap, mu * rc[0] * slip + rc.tail<2>().dot(u.tail<2>()));
    // r.u- + 1/2 r.W r, without the cancellation of a difference of two energies.
    out.energy_gain += 0.5 * rc.dot(u + q - 2 * ConstVec3(&problem.offset[3 * c]));
  }
  out.cone_violation = std::sqrt(outside);
  out.energy_before = 0.5 * quadratic_form(problem.M, problem.v_minus);
  double law2 = 0;
  for (int g = 0; g < at_.islands.count; ++g) {
    const double* island = &sum_[4 * static_cast<std::size_t>(g)];
    const double size2 = std::max({island[0], island[1], island[2]});
    if (size2 > 0) law2 = std::max(law2, island[3] / size2);
    at_.island_size_q[g] = std::sqrt(island[2]);
    at_.island_size[g] = std::sqrt(size2);
  }
  if (!at_.elastic) out.law = std::sqrt(law2);
}

// Sizes grow to those of the island's velocities, but for limits, whose own may be in rad/s.
void Referee::look_at_islands(const ContactProblem& problem) {
  sum_.assign(at_.islands.count, 0.0);  // square of the fastest |u|
  for (int c = 0; c < problem.nc(); ++c) {
    double& fastest = sum_[at_.islands.of_contact[c]];
    if (!is_limit(problem, c))
      fastest = std::max(
          {fastest, ConstVec3(&at_.u_plus[3 * c]).squaredNorm(), ConstVec3(&at_.u_minus[3 * c]).squaredNorm()});
  }
  for (int c = 0; c < problem.nc(); ++c) {
    if (is_limit(problem, c)) continue;
    const int g = at_.islands.of_contact[c];
    const double size = at_.island_size[g];
    at_.size2[c] = std::max(at_.size2[c], std::min(size * size, sum_[g] / at_.weight[c]));
  }
}

// Sizes grow to those of the terms, and to what rounding of the terms makes of errors.
void Referee::look_at_terms(const ContactProblem& problem, const ContactSolution& solution, const Law& law) {
  constexpr double unit = rounding_units * std::numeric_limits<double>::epsilon();
  const BandMatrix& J = problem.J;
  find_changes(problem, solution, law);
  at_.rounding.resize(problem.nc());
  // Of each island: rho, m/s; sum of squares of rounding, J.
  constexpr std::size_t fields = 2;
  sum_.assign(fields * static_cast<std::size_t>(at_.islands.count), 0.0);
  const auto of_island = [&](int c) { return &sum_[fields * static_cast<std::size_t>(at_.islands.of_contact[c])]; };
  for (int c = 0; c < problem.nc(); ++c) {
    Vector3d changes = Vector3d::Zero(), before = ConstVec3(&problem.offset[3 * c]).cwiseAbs(), stops = changes;
    for (int e = J.band[c]; e < J.band[c + 1]; ++e) {
      const auto entry = J.entry(e);
      const int at = problem.M.first[J.block[e]];
      for (int j = 0; j < entry.cols(); ++j) {
        changes += entry.col(j).cwiseAbs() * changes_[at + j];
        stops += entry.col(j).cwiseAbs() * stops_[at + j];
        before += entry.col(j).cwiseAbs() * std::abs(problem.v_minus[at + j]);
      }
    }
    at_.rounding[c] = unit * std::max((changes + before).norm(), ConstVec3(&mass_changes_[3 * c]).norm());
    at_.size2[c] = std::max(at_.size2[c], changes.squaredNorm() / at_.weight[c]);
    const double size = at_.island_size[at_.islands.of_contact[c]];
    if (is_limit(problem, c)) {
      at_.size2[c] = std::max(at_.size2[c], std::min(size * size, stops.squaredNorm() / at_.weight[c]));
      continue;
    }
    double* island = of_island(c);
    island[0] = std::max(island[0], at_.rounding[c]);
  }
  for (int c = 0; c < problem.nc(); ++c) {
    double* island = of_island(c);
    if (!is_limit(problem, c)) at_.rounding[c] = island[0];
    const double floor = at_.rounding[c] / std::sqrt(at_.weight[c]) / accepted;
    at_.size2[c] = std::max(at_.size2[c], floor * floor);
    island[1] += floor * floor;
  }
  for (int g = 0; g < at_.islands.count; ++g) {
    const double floor = std::sqrt(sum_[fields * static_cast<std::size_t>(g) + 1]);
    at_.island_size[g] = std::max(at_.island_size[g], floor);
    at_.island_size_q[g] = std::max(at_.island_size_q[g], floor);
  }
}

// changes_ = |M^-1 J^T| |r|, m/s and rad/s; stops_, the same of impulses max(|u+|, |u-|) / w; and mass_changes_ = m_c,
// m/s, which is more where M is ill-conditioned. Normal impulses of a witness count as well. Multipliers do not: they
// change no velocity.
void Referee::find_changes(const ContactProblem& problem, const ContactSolution& solution, const Law& law) {
  const BandMatrix& J = problem.J;
  const int nc = problem.nc();
  const std::span<const double> more = law.witness_normals ? law.witness_normals(solution) : std::span<const double>();
  const auto load_of = [&](int c) -> Vector3d {
    Vector3d load = ConstVec3(&solution.impulse[3 * c]).cwiseAbs();
    if (static_cast<int>(more.size()) == nc && !at_.is_elastic(c) && std::isfinite(more[c]))
      load[0] += std::abs(more[c]);
    return load;
  };
  find_loads(problem, load_of);
  changes_.assign(problem.nv(), 0.0);
  stops_.assign(problem.nv(), 0.0);
  mass_changes_.assign(3 * static_cast<std::size_t>(nc), 0.0);
  for (int c = 0; c < nc; ++c) {
    const Vector3d load = load_of(c);
    const Vector3d stop =
        ConstVec3(&at_.u_plus[3 * c]).cwiseAbs().cwiseMax(ConstVec3(&at_.u_minus[3 * c]).cwiseAbs()) / at_.weight[c];
    for (int e = J.band[c]; e < J.band[c + 1]; ++e) {
      const int b = J.block[e], n = problem.M.block_size(b), first = problem.M.first[b];
      columns_.resize(3 * static_cast<std::size_t>(n));
      Eigen::Map<Eigen::MatrixX3d> columns(columns_.data(), n, 3);
      columns = J.entry(e).transpose();
      at_.factor.solve_block_in_place(b, columns_.data(), 3);
      Vector3d entries = Vector3d::Zero(), norms = entries;
      for (int i = 0; i < n; ++i) {
        changes_[first + i] += columns.row(i).cwiseAbs().dot(load);
        stops_[first + i] += columns.row(i).cwiseAbs().dot(stop);
        entries += columns.row(i).cwiseAbs().transpose() * loads_[first + i];
        norms += columns.row(i).transpose().cwiseProduct(J.entry(e).col(i));
      }
      norms = (norms.cwiseMax(0) * energy_[b]).cwiseSqrt();
      Eigen::Map<Vector3d>(&mass_changes_[3 * c]) += entries.cwiseMax(norms);
    }
  }
}

// loads_ = max(|M| |v+ - v-|, |J^T| |r|), N s and N m s: what momenta are sums of; energy_ of v+ - v-, by blocks.
template <class LoadOf>
void Referee::find_loads(const ContactProblem& problem, const LoadOf& load_of) {
  const BandMatrix& J = problem.J;
  loads_.assign(problem.nv(), 0.0);
  for (int c = 0; c < problem.nc(); ++c)
    for (int e = J.band[c]; e < J.band[c + 1]; ++e) {
      const auto entry = J.entry(e);
      for (int j = 0; j < entry.cols(); ++j)
        loads_[problem.M.first[J.block[e]] + j] += entry.col(j).cwiseAbs().dot(load_of(c));
    }
  energy_.assign(problem.M.blocks(), 0.0);
  for (int b = 0; b < problem.M.blocks(); ++b) {
    const auto M = problem.M.block(b);
    const Eigen::Map<const Eigen::VectorXd> moved(&difference_[problem.M.first[b]], problem.M.block_size(b));
    for (int i = 0; i < moved.size(); ++i) {
      double momentum = 0;
      for (int j = 0; j < moved.size(); ++j) {
        momentum += std::abs(M(i, j) * moved[j]);
        energy_[b] += moved[i] * M(i, j) * moved[j];
      }
      double& load = loads_[problem.M.first[b] + i];
      load = std::max(load, momentum);
    }
    energy_[b] = std::max(energy_[b], 0.0);
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

}  // namespace cb
