#include "contact/evidence.h"

#include <algorithm>
#include <cmath>

#include "contact/referee.h"

namespace cb {

namespace {

using Eigen::Vector3d;
using ConstVec3 = Eigen::Map<const Vector3d>;

// What is wrong by x > 0. Sizes are roots of squares: what has no square is no error of nothing either.
double error_of(double x) { return x <= 0 || x * x == 0 ? 0 : x; }

// What follows of an answer counts as the worst where it is, but where the law is broken says more than what comes of
// it.
void add_consequence(const Worst& consequence, Worst& worst) {
  if (consequence.ratio <= worst.ratio) return;
  if (worst.ratio > Referee::accepted)
    worst.ratio = consequence.ratio;
  else
    worst = consequence;
}

}  // namespace

double Evidence::open_work(const Vector3d& r, const Vector3d& u, const Vector3d& q, int contact) const {
  const double rho = open(contact);
  return rho > 0 ? rho * (r.norm() + (u.norm() + q.norm() + rho) / weight[contact]) : 0;
}

void see_feasible(const ContactProblem& problem, std::span<const double> r, const Evidence& at, double size, int c,
                  Worst& worst) {
  const double root_w = std::sqrt(at.weight[c]), r_n = r[3 * c];
  at.see(worst, error_of(-at.u_plus[3 * c] / root_w), size, c);
  at.see(worst, error_of(-r_n * root_w), size, c);
  at.see(worst, error_of((tangential(r, c) - problem.mu[c] * r_n) * root_w), size, c);
}

Worst feasible(const ContactProblem& problem, std::span<const double> r, const Evidence& at) {
  Worst worst;
  for (int c = 0; c < problem.nc(); ++c) see_feasible(problem, r, at, std::sqrt(at.size2[c]), c, worst);
  see_approach(at, worst);
  return worst;
}

void see_approach(const Evidence& at, Worst& worst) {
  Worst approach;
  for (int c = 0; c < static_cast<int>(at.weight.size()); ++c) {
    if (!(at.u_plus[3 * c] < 0)) continue;
    const double size = at.island_size_q[at.islands.of_contact[c]] * std::sqrt(at.weight[c]);  // m/s, like the error
    at.see(approach, error_of(-at.u_plus[3 * c]), std::max(size, at.open(c) / Referee::accepted), c);
  }
  add_consequence(approach, worst);
}

// What contacts do to an island as seen from the stops, driven ones too, is gain = sum r.(u+ + u-)/2, held against a
// fourth of |sum r.u-|: where an answer gains no more than that that is at most the island's kinetic energy, in every
// frame in which its stops rest.
void see_gains(std::span<const double> r, double epsilon, const Evidence& at, Which islands,
               std::vector<double>& scratch, Worst& worst) {
  constexpr std::size_t fields = 3;  // gain, sum r.u-, what rounding leaves open of the gain, all J
  scratch.assign(fields * static_cast<std::size_t>(at.islands.count), 0.0);
  for (int c = 0; c < static_cast<int>(at.weight.size()); ++c) {
    const ConstVec3 rc(&r[3 * c]), u(&at.u_plus[3 * c]), q(&at.u_minus[3 * c]);
    double* island = &scratch[fields * static_cast<std::size_t>(at.islands.of_contact[c])];
    island[0] += 0.5 * rc.dot(u + q);
    island[1] += rc.dot(q);
    island[2] += at.open_work(rc, u, q, c);
  }
  Worst gain;
  for (int g = 0; g < at.islands.count; ++g) {
    if (islands == Which::elastic && !at.elastic_island[g]) continue;
    const double* island = &scratch[fields * static_cast<std::size_t>(g)];
    // Suboptimality that was allowed may be a gain, where it is little beside the island.
    const double allowed = std::min(epsilon / Referee::accepted, at.island_size[g] * at.island_size[g]);
    Evidence::see_island(gain, island[0], std::max({std::abs(island[1]) / 4, island[2] / Referee::accepted, allowed}),
                         g);
  }
  add_consequence(gain, worst);
}

}  // namespace cb
