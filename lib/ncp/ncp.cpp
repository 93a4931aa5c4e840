#include "ncp/ncp.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cb {

namespace {

using Eigen::Vector3d;
using ConstVec3 = Eigen::Map<const Vector3d>;

/// As the referee has them (contact/referee.cpp): roundings of each term of a velocity that an error may have and still
/// be none, and what such an error then counts as.
constexpr double rounding_units = 128, accepted = 1e-9, at_rounding = 1e-12;

/// Without size nothing can be wrong but in a claim of it; what has overflowed is wrong.
double over(double error, double size) {
  if (error == 0 && size < HUGE_VAL) return 0;
  return size > 0 && error < HUGE_VAL && size < HUGE_VAL ? error / size : HUGE_VAL;
}

}  // namespace

std::string_view name(NcpStatus status) {
  switch (status) {
    case NcpStatus::solved:
      return "solved";
    case NcpStatus::inaccurate:
      return "inaccurate";
    case NcpStatus::nonconverged:
      return "nonconverged";
    case NcpStatus::singular:
      return "singular";
    case NcpStatus::not_finite:
      return "not_finite";
  }
  return "";
}

void NcpSolution::clear() {
  status = NcpStatus::nonconverged;
  reason.clear();
  r.clear();
  u.clear();
  iterations = 0;
  residual = 0;
  who = {};
}

void project_on_friction_cone(const double* x, double mu, double* out) {
  const double n = x[0], t = std::sqrt(x[1] * x[1] + x[2] * x[2]);
  double normal = n, scale = 1;
  if (mu * t <= -n) {  // first: with mu = 0 what pulls is not within
    normal = scale = 0;
  } else if (t > mu * n) {
    normal = (n + mu * t) / (1 + mu * mu);
    scale = mu * normal / t;
  }
  out[0] = normal;
  out[1] = scale * x[1];
  out[2] = scale * x[2];
}

void natural_map(const double* r, const double* u, double mu, double weight, double* out) {
  const double slip = std::sqrt(u[1] * u[1] + u[2] * u[2]);
  const double x[] = {r[0] - (u[0] + mu * slip) / weight, r[1] - u[1] / weight, r[2] - u[2] / weight};
  project_on_friction_cone(x, mu, out);
  for (int i = 0; i < 3; ++i) out[i] = r[i] - out[i];
}

void NcpMeasure::begin(const NcpProblem& problem) {
  problem_ = &problem;
  floor2_.clear();
  q_.resize(3 * static_cast<std::size_t>(problem.nc()));
  multiply(*problem.J, *problem.M, problem.v0, q_);
  q2_ = 0;
  for (std::size_t i = 0; i < q_.size(); ++i) {
    q_[i] += problem.offset[i];
    q2_ += q_[i] * q_[i] / problem.weight[i / 3];
  }
}

void NcpMeasure::velocities(std::span<const double> r, std::vector<double>& v, std::vector<double>& u) {
  const NcpProblem& p = *problem_;
  if (std::all_of(r.begin(), r.end(), [](double x) { return x == 0; })) {
    v.assign(p.v0.begin(), p.v0.end());
    u = q_;
    return;
  }
  v.assign(p.nv(), 0.0);
  multiply_transposed_add(*p.J, *p.M, r, v);
  p.factor->solve_in_place(v);
  for (int i = 0; i < p.nv(); ++i) v[i] += p.v0[i];
  u.resize(q_.size());
  multiply(*p.J, *p.M, v, u);
  for (std::size_t i = 0; i < u.size(); ++i) u[i] += p.offset[i];
}

// What rests beside what moves has velocities of rounding alone, whose error would be all of them: looked at where
// without it the answer is not at rounding.
double NcpMeasure::residual(std::span<const double> r, std::span<const double> u) {
  double worst = worst_of(r, u);
  if (floor2_.empty() && !(worst <= at_rounding * at_rounding)) {
    find_floors();
    worst = worst_of(r, u);
  }
  return std::sqrt(worst);
}

void NcpMeasure::find_floors() {
  constexpr double unit = rounding_units * std::numeric_limits<double>::epsilon();
  const NcpProblem& p = *problem_;
  open_.resize(p.nc());
  sizes_of_terms(*p.J, *p.M, p.v0, p.offset, open_);
  floor2_.resize(p.nc());
  for (int c = 0; c < p.nc(); ++c) {
    const double floor = unit * open_[c] / accepted;
    floor2_[c] = floor * floor / p.weight[c];
  }
}

// Square of the worst contact's residual.
double NcpMeasure::worst_of(std::span<const double> r, std::span<const double> u) const {
  double worst = 0, e[3];
  for (int c = 0; c < problem_->nc(); ++c) {
    const double w = problem_->weight[c];
    natural_map(&r[3 * c], &u[3 * c], problem_->mu[c], w, e);
    const double size2 = std::max({w * ConstVec3(&r[3 * c]).squaredNorm(), ConstVec3(&u[3 * c]).squaredNorm() / w,
                                   ConstVec3(&q_[3 * c]).squaredNorm() / w});
    const double approach = std::max(0.0, -u[3 * c]), floor2 = floor2_.empty() ? 0 : floor2_[c];
    worst = std::max({worst, over(approach * approach / w, std::max(q2_, floor2)),
                      over(w * ConstVec3(e).squaredNorm(), std::max(size2, floor2))});
  }
  return worst;
}

// |M^-1 J^T| |r|, entry by entry, and the same of impulses max(|u|, |q|) / w, which would stop all contacts.
void NcpMeasure::find_changes(std::span<const double> r, std::span<const double> u) {
  const NcpProblem& p = *problem_;
  changes_.assign(p.nv(), 0.0);
  stops_.assign(p.nv(), 0.0);
  for (int c = 0; c < p.nc(); ++c) {
    const Vector3d load = ConstVec3(&r[3 * c]).cwiseAbs();
    const Vector3d stop = ConstVec3(&u[3 * c]).cwiseAbs().cwiseMax(ConstVec3(&q_[3 * c]).cwiseAbs()) / p.weight[c];
    for (int e = p.J->band[c]; e < p.J->band[c + 1]; ++e) {
      const int b = p.J->block[e], n = p.M->block_size(b);
      columns_.resize(3 * static_cast<std::size_t>(n));
      Eigen::Map<Eigen::MatrixX3d> columns(columns_.data(), n, 3);
      columns = p.J->entry(e).transpose();
      p.factor->solve_block_in_place(b, columns_.data(), 3);
      for (int i = 0; i < n; ++i) {
        changes_[p.M->first[b] + i] += columns.row(i).cwiseAbs().dot(load);
        stops_[p.M->first[b] + i] += columns.row(i).cwiseAbs().dot(stop);
      }
    }
  }
}

double NcpMeasure::residual_beside_rounding(std::span<const double> r, std::span<const double> u) {
  constexpr double unit = rounding_units * std::numeric_limits<double>::epsilon();
  const NcpProblem& p = *problem_;
  find_changes(r, u);
  open_.resize(p.nc());
  terms_.resize(p.nc());
  limit2_.resize(p.nc());
  double open = 0, fastest = 0, island_r = 0, island_u = 0;
  for (int c = 0; c < p.nc(); ++c) {
    Vector3d changes = Vector3d::Zero(), before = ConstVec3(&p.offset[3 * c]).cwiseAbs(), stops = changes;
    bool limit = p.mu[c] == 0;
    for (int e = p.J->band[c]; e < p.J->band[c + 1]; ++e) {
      const auto entry = p.J->entry(e);
      const int at = p.M->first[p.J->block[e]];
      limit = limit && entry.bottomRows<2>().isZero(0);
      for (int j = 0; j < entry.cols(); ++j) {
        changes += entry.col(j).cwiseAbs() * changes_[at + j];
        stops += entry.col(j).cwiseAbs() * stops_[at + j];
        before += entry.col(j).cwiseAbs() * std::abs(p.v0[at + j]);
      }
    }
    open_[c] = unit * (changes + before).norm();
    terms_[c] = changes.squaredNorm() / p.weight[c];
    const double u2 = ConstVec3(&u[3 * c]).squaredNorm(), q2 = ConstVec3(&q_[3 * c]).squaredNorm();
    limit2_[c] = limit ? stops.squaredNorm() : -1;
    if (!limit) {
      open = std::max(open, open_[c]);
      fastest = std::max({fastest, u2, q2});
    }
    island_r += p.weight[c] * ConstVec3(&r[3 * c]).squaredNorm();
    island_u += u2 / p.weight[c];
  }
  const double island = std::max({island_r, island_u, q2_});
  double worst = 0, e[3];
  for (int c = 0; c < p.nc(); ++c) {
    const bool limit = limit2_[c] >= 0;
    const double w = p.weight[c], rho = limit ? open_[c] : open, moving2 = limit ? limit2_[c] : fastest;
    const double floor = (1 + p.mu[c]) * rho / accepted;
    natural_map(&r[3 * c], &u[3 * c], p.mu[c], w, e);
    const double size2 =
        std::max({w * ConstVec3(&r[3 * c]).squaredNorm(), terms_[c], std::min(island, moving2 / w), floor * floor / w});
    const double approach = std::max(0.0, -u[3 * c]);
    worst = std::max({worst, over(approach * approach / w, std::max(q2_, rho * rho / (accepted * accepted * w))),
                      over(w * ConstVec3(e).squaredNorm(), size2)});
  }
  return std::sqrt(worst);
}

}  // namespace cb
