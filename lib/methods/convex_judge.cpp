#include "methods/convex_judge.h"

#include <algorithm>
#include <cmath>

namespace cb {

namespace {

/// -: of the terms of velocities, an infeasibility that no rounding explains.
constexpr double beyond_rounding = 1e-10;

}  // namespace

// Rounding is looked at only where without it the answer would not do, and with it might.
Certificate ConvexJudge::operator()(const ConvexIsland& island, const ConeProgram& program, std::span<const double> r,
                                    std::span<const double> eta) {
  velocities_.evaluate(program, r, eta);
  const Certificate plain = certify(program, r, eta, velocities_, island.q);
  if (good(island, plain, Allowed::exact) ||
      std::abs(plain.gap) > island.epsilon + most_excused * plain.size * plain.size)
    return plain;
  const double terms = plain.size + std::sqrt(quadratic_form(island.M, island.v0));
  if (plain.infeasibility > t_.backward && plain.infeasibility * plain.size > beyond_rounding * terms) return plain;
  velocities_.bound_rounding(program, r, {});
  return certify(program, r, eta, velocities_, island.q, t_.cone.rounding_units);
}

double ConvexJudge::gap_at_own_sum(const ConvexIsland& island, const ConeProgram& program,
                                   std::span<const double> r) const {
  ConeProgram summed = program;
  summed.kappa = 0;
  for (int c = 0; c < summed.nc(); ++c) summed.kappa += r[3 * c];
  return certify(summed, r, {}, velocities_, island.q).gap;
}

bool ConvexJudge::good(const ConvexIsland& island, const Certificate& c, Allowed allowed) const {
  return std::abs(c.gap) <= std::max(island.epsilon, c.gap_rounding) && c.infeasibility <= limit_of(allowed);
}

bool ConvexJudge::excused(const ConvexIsland& island, const Certificate& c) const {
  return std::abs(c.gap) > island.epsilon && c.gap_rounding >= most_excused * c.size * c.size;
}

double ConvexJudge::limit_of(Allowed allowed) const {
  return allowed == Allowed::exact ? t_.infeasibility : t_.backward;
}

// eta + t lambda, with the least t that makes them >= 0.
void unreduce(const ConvexBound& bound, std::span<const double> eta, std::vector<double>& multiplier) {
  multiplier.assign(eta.begin(), eta.end());
  const std::vector<double>& lambda = bound.lambda;
  double t = 0;
  for (std::size_t c = 0; c < multiplier.size() && bound.shape == ConvexShape::flat; ++c)
    if (lambda[c] > 0) t = std::max(t, -multiplier[c] / lambda[c]);
  for (std::size_t c = 0; c < multiplier.size(); ++c)
    multiplier[c] = std::max(0.0, t > 0 ? multiplier[c] + t * lambda[c] : multiplier[c]);
}

}  // namespace cb
