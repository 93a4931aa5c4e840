#include "methods/convex_rest.h"

#include <algorithm>
#include <cmath>

#include "cone/rows.h"
#include "methods/convex_lift.h"

namespace cb {

namespace {

/// -: of the island's motion: answers may lie on the edges of the cones, and this is rounding.
constexpr double rounding = 1e-13;

bool recall_bound(const ConvexIsland& island, const ConvexTolerances& t, ConvexPrevious& previous, ConvexBound& b) {
  if (!previous.frictionless.find(island.view(), island.size) || static_cast<int>(previous.z.size()) != island.nv())
    return false;
  b.f.resize(island.nc());
  for (int c = 0; c < island.nc(); ++c) {
    const double f = previous.frictionless.r()[3 * c];
    if (!(f >= -rounding * island.size / std::sqrt(island.weight[c]))) return false;
    b.f[c] = std::max(0.0, f);
  }
  b.u_f = previous.frictionless.u();
  b.z = previous.z;
  b.J_z.resize(3 * island.nc());
  multiply(island.J, island.M, b.z, b.J_z);
  if (!proves_least_sum(island, t, b)) return false;
  b.kappa = island.sum_of_shares(b.f);
  b.shape = ConvexShape::general;
  return true;
}

}  // namespace

void remember(const ConvexIsland& island, const ConvexTolerances& t, std::span<const double> r, const ConvexBound& b,
              ConvexPrevious& previous) {
  previous.impulse.remember(island.view(), r, island.size);
  if (!t.bounded) return;
  previous.frictionless.remember(island.view(), b.impulse, island.size);
  previous.z = b.z;
}

bool recall(const ConvexIsland& island, const ConvexTolerances& t, ConvexPrevious& previous, ConvexBound& b,
            std::vector<double>& r) {
  if (!previous.impulse.find(island.view(), island.size)) return false;
  for (int c = 0; c < island.nc(); ++c) {
    const double* r_c = &previous.impulse.r()[3 * c];
    const double slack = rounding * island.size / std::sqrt(island.weight[c]);
    if (!(tangential(r_c) <= island.mu[c] * r_c[0] + slack)) return false;
  }
  if (t.bounded && !recall_bound(island, t, previous, b)) return false;
  r = previous.impulse.r();
  return true;
}

}  // namespace cb
