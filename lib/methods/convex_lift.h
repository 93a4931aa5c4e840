#pragma once

#include "cone/kkt_system.h"
#include "linalg/stopping_impulse.h"
#include "methods/convex_island.h"

namespace cb {

/// What the last bits of the data leave open of the normal velocities after frictionless impulses f (nc, N s), sqrt(J):
/// whether a contact touches, for the referee too, who sees it with friction.
double open_by_rounding(const ConvexIsland& island, const std::vector<double>& f);
/// -: units of rounding of which that is made; the referee's 128, and as much again for friction.
inline constexpr double open_units = 256;

/// Scratch of lift().
struct LiftScratch {
  KktSystem system;
  StoppingImpulse stopping;
  std::vector<double> G, step, h, u_step;  // 9 nc, 3 nc, nv, 3 nc
  std::vector<double> up;                  // 3 nc, share in the normal rows
  std::vector<double> proof;               // nv, a z that may come back
};

/// The velocity z with N z = share on the contacts of `set`, and lambda with M z = N^T lambda; into bound.z, J_z,
/// lambda and miss.
void lift(const ConvexIsland& island, const ConvexTolerances& t, const std::vector<char>& set, LiftScratch& scratch,
          ConvexBound& bound);

/// Duality of linear programming: is the sum of bound.f the least? N z <= 1 where contacts touch, = 1 where they carry.
bool proves_least_sum(const ConvexIsland& island, const ConvexTolerances& t, const ConvexBound& bound);

/// Is (3) the same as (1)? bound.z and lambda are those of the last lift(), on `set`, which is narrowed to the contacts
/// that lambda needs. Fills bound.fixed.
ConvexShape find_shape(const ConvexIsland& island, const ConvexTolerances& t, std::vector<char>& set,
                       LiftScratch& scratch, ConvexBound& bound);

}  // namespace cb
