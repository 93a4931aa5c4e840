#pragma once

#include "methods/convex_island.h"
#include "methods/resting_impulse.h"

namespace cb {

/// What an island of the previous event knows of the next one.
struct ConvexPrevious {
  RestingImpulse impulse{3}, frictionless{1};  ///< of an island at rest
  std::vector<double> z;                       ///< proof of its least sum
  int nv = 0;                                  ///< of the island that `answer` is of
  bool by_newton = false;                      ///< did `answer` come from a solver, and not from a cheaper way?
  ConeSolution answer;
};

/// Keeps what the next event may start from: impulses `r` and the bound with its proof.
void remember(const ConvexIsland& island, const ConvexTolerances& t, std::span<const double> r,
              const ConvexBound& bound, ConvexPrevious& previous);

/// Do the impulses that kept the previous event at rest keep this one, inside the cones, and is their sum bounded as
/// the previous proof says? Into r, and f, z and kappa of `bound`; the certificate has the last word.
bool recall(const ConvexIsland& island, const ConvexTolerances& t, ConvexPrevious& previous, ConvexBound& bound,
            std::vector<double>& r);

}  // namespace cb
