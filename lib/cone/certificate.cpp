#include "cone/certificate.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "cone/rows.h"

namespace cb {

using Eigen::Vector3d;

void ConeVelocities::evaluate(const ConeProgram& p, std::span<const double> r, std::span<const double> eta) {
  const int nv = p.nv(), nc = p.nc();
  v.assign(nv, 0.0);
  multiply_transposed_add(*p.J, *p.M, r, v);
  p.factor->solve_in_place(v);
  for (int i = 0; i < nv; ++i) v[i] += (*p.v0)[i];
  u.resize(3 * nc);
  multiply(*p.J, *p.M, v, u);
  for (int i = 0; i < 3 * nc; ++i) u[i] += (*p.offset)[i];
  v_hat = v;
  u_hat = u;
  rounding.clear();
  bool any = false;
  for (double x : eta) any = any || x != 0;
  if (!any) return;
  scratch_.assign(nv, 0.0);
  add_normals(p, eta, scratch_);
  p.factor->solve_in_place(scratch_);
  for (int i = 0; i < nv; ++i) v_hat[i] -= scratch_[i];
  multiply(*p.J, *p.M, scratch_, u_hat);
  for (int i = 0; i < 3 * nc; ++i) u_hat[i] = u[i] - u_hat[i];
}

void ConeVelocities::bound_rounding(const ConeProgram& p, std::span<const double> r, std::span<const double> eta) {
  const BandMatrix& J = *p.J;
  constexpr double unit = std::numeric_limits<double>::epsilon();
  std::vector<double>& terms = scratch_;  // nv, m/s
  terms.resize(p.nv());
  for (int i = 0; i < p.nv(); ++i) terms[i] = std::abs((*p.v0)[i]);
  for (int c = 0; c < J.bands(); ++c) {
    Vector3d load = vec3(&r[3 * c]).cwiseAbs();
    if (!eta.empty()) load[0] += std::abs(eta[c]);
    if (load.isZero(0)) continue;
    for (int e = J.band[c]; e < J.band[c + 1]; ++e) {
      const int b = J.block[e], n = p.M->block_size(b);
      columns_.resize(3 * static_cast<std::size_t>(n));
      Eigen::Map<Eigen::MatrixX3d> columns(columns_.data(), n, 3);
      columns = J.entry(e).transpose();
      p.factor->solve_block_in_place(b, columns_.data(), 3);
      Eigen::Map<Eigen::VectorXd>(&terms[p.M->first[b]], n).noalias() += columns.cwiseAbs() * load;
    }
  }
  rounding.resize(J.bands());
  for (int c = 0; c < J.bands(); ++c) {
    Vector3d sum = vec3(&(*p.offset)[3 * c]).cwiseAbs();
    for (int e = J.band[c]; e < J.band[c + 1]; ++e) {
      const double* values = J.values.data() + J.offset[e];
      const double* term = &terms[p.M->first[J.block[e]]];
      const int cols = (J.offset[e + 1] - J.offset[e]) / 3;
      for (int j = 0; j < cols; ++j) sum += term[j] * vec3(values + 3 * j).cwiseAbs();
    }
    rounding[c] = unit * sum.norm() / std::sqrt((*p.weight)[c]);
  }
}

namespace {

// Squares of the sizes of impulses, velocities, and velocities without impulses: J.
struct Sizes {
  double r = 0, u = 0, q = 0;
  double largest() const { return std::sqrt(std::max({r, u, q})); }
};

Sizes sizes_of(const ConeProgram& p, std::span<const double> r, std::span<const double> u, std::span<const double> q) {
  Sizes size;
  for (int c = 0; c < p.nc(); ++c) {
    const double w = (*p.weight)[c];
    size.r += w * vec3(&r[3 * c]).squaredNorm();
    size.u += vec3(&u[3 * c]).squaredNorm() / w;
    size.q += vec3(&q[3 * c]).squaredNorm() / w;
  }
  return size;
}

// What rounding excuses: the velocity of a contact, sqrt(J); what s may be wrong by; a sum of impulses.
struct Excuse {
  const ConeVelocities& velocities;
  double units;
  double s = 0, sum = 0;
  double operator()(int c) const { return velocities.rounding.empty() ? 0 : units * velocities.rounding[c]; }
};

// Least s that puts y into the dual cone where the bound counts a contact; elsewhere what is missing is a violation,
// whose worst is returned, sqrt(J).
double put_into_dual(const ConeProgram& p, Excuse& excuse, double& s) {
  double worst = 0;
  for (int c = 0; c < p.nc(); ++c) {
    const double root_w = std::sqrt((*p.weight)[c]), excused = (1 + (*p.mu)[c]) * excuse(c);
    const double* y = &excuse.velocities.u_hat[3 * c];
    const double short_of = (*p.mu)[c] * tangential(y) - y[0];
    excuse.sum += excuse(c) / root_w;
    if (p.has_bound() && p.share_of(c) > 0) {
      s = std::max(s, short_of);
      excuse.s = std::max(excuse.s, excused * root_w);
    } else {
      worst = std::max(worst, short_of / root_w - excused);
    }
  }
  return worst;
}

// Velocities are wrong by what rounding excuses, and the impulses that they determine: what that makes of the gap, J.
double rounding_of_gap(const ConeProgram& p, const Excuse& excuse, std::span<const double> r,
                       std::span<const double> eta, double s) {
  if (excuse.velocities.rounding.empty()) return 0;
  double sum = 0;
  for (int c = 0; c < p.nc(); ++c) {
    const double root_w = std::sqrt((*p.weight)[c]), multiplier = eta.empty() ? 0 : std::abs(eta[c]);
    const double y = vec3(&excuse.velocities.u_hat[3 * c]).norm() + 2 * std::abs(s);
    sum += excuse(c) * (root_w * (vec3(&r[3 * c]).norm() + multiplier) + y / root_w);
  }
  return sum;
}

}  // namespace

Certificate certify(const ConeProgram& p, std::span<const double> r, std::span<const double> eta,
                    const ConeVelocities& velocities, std::span<const double> q, double rounding_units) {
  Certificate out;
  const Sizes sizes = sizes_of(p, r, velocities.u, q);
  out.size = sizes.largest();
  const double size = out.size > 0 ? out.size : 1;
  Excuse excuse{velocities, rounding_units};
  double worst = put_into_dual(p, excuse, out.s), approach = 0, gap = 0, sum = 0, approaching = 0;  // worst: of `size`
  const auto violated = [&](double x) { worst = std::max(worst, x); };
  for (int c = 0; c < p.nc(); ++c) {
    const double root_w = std::sqrt((*p.weight)[c]), along_bound = p.share_of(c) * r[3 * c];
    const double u_n = velocities.u[3 * c];
    gap += (eta.empty() ? 0 : eta[c] * (p.is_fixed(c) ? u_n : std::max(u_n + p.slack_of(c), 0.0))) +
           vec3(&r[3 * c]).dot(vec3(&velocities.u_hat[3 * c])) + out.s * along_bound;
    sum += along_bound;
    violated(-r[3 * c] * root_w);
    violated((tangential(&r[3 * c]) - (*p.mu)[c] * r[3 * c]) * root_w);
    if (p.bounded_below || !p.has_bound()) approach = std::max(approach, (-u_n - p.slack_of(c)) / root_w - excuse(c));
    if (p.is_fixed(c)) violated(std::abs(u_n) / root_w - excuse(c));
    if (!eta.empty() && !p.is_fixed(c)) violated(-eta[c] * root_w);
  }
  // Beside what approached, too: large impulses make no approach small (docs/judging.md).
  double before = std::min(std::sqrt(sizes.q), p.before);
  if (before == 0) before = size;
  worst = std::max(worst / size, approach / before);
  out.gap_rounding = rounding_of_gap(p, excuse, r, eta, out.s);
  if (p.has_bound()) {
    gap += out.s * std::max(p.kappa - sum, 0.0);
    for (int c = 0; c < p.nc(); ++c) approaching += std::abs(q[3 * c]) / (*p.weight)[c];
    const double kappa_size = std::max(approaching, std::abs(p.kappa));
    if (const double beyond = sum - p.kappa - excuse.sum; beyond > 0) worst = std::max(worst, beyond / kappa_size);
    const double sum_rounding = rounding_units * std::numeric_limits<double>::epsilon() * kappa_size;
    out.gap_rounding += std::abs(out.s) * (excuse.sum + sum_rounding) + excuse.s * std::abs(p.kappa);
  }
  out.gap_rounding = std::min(out.gap_rounding, most_excused * size * size);
  // Comparisons with NaN are false: say so here, once.
  out.gap = std::isfinite(gap) ? gap : HUGE_VAL;
  out.infeasibility = std::isfinite(gap) ? worst : HUGE_VAL;
  return out;
}

}  // namespace cb
