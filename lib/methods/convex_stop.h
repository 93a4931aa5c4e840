#pragma once

#include "cone/interior_point.h"
#include "linalg/stopping_impulse.h"
#include "methods/convex_island.h"

namespace cb {

/// Scratch of the direct ways (convex_stop.cpp).
struct StopScratch {
  StoppingImpulse stopping;
  ConeVelocities velocities;
  std::vector<char> set;       // nc, contacts that are stopped
  std::vector<double> weight;  // nc, 1/kg
  std::vector<double> r;       // 3 nc, N s
};

/// The frictionless answer by active sets, into x.r; `normal`: the island's program without friction. False where there
/// is none that is good to rounding.
bool stop_normals(const ConvexIsland& island, const ConeProgram& normal, StopScratch& scratch, ConeSolution& x);

/// Impulses inside the cones that stop all contacts that carry, into x; `program`: the island's. False where those
/// tried are not inside. For robots: other islands have cheaper ways.
bool stop_contacts(const ConvexIsland& island, const ConeProgram& program, StopScratch& scratch, ConeSolution& x);

}  // namespace cb
