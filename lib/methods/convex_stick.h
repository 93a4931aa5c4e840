#pragma once

#include "cone/interior_point.h"
#include "methods/convex_island.h"

namespace cb {

/// Scratch of stick_contacts().
struct StickScratch {
  KktSystem system;
  ConeVelocities velocities;
  std::vector<double> share;               // nc, -, of friction
  std::vector<double> G, step, h, u_step;  // 9 nc, 3 nc, nv, 3 nc
  std::vector<double> r, best;             // 3 nc, N s
};

/// Impulses inside the cones that stop all contacts, into x; `program`: the island's. False where those tried are not
/// inside, or do not come to rounding.
bool stick_contacts(const ConvexIsland& island, const ConeProgram& program, const ConeOptions& options,
                    StickScratch& scratch, ConeSolution& x);

}  // namespace cb
