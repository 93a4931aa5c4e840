#pragma once

#include "cone/interior_point.h"
#include "methods/convex_lift.h"
#include "methods/convex_stop.h"
#include "methods/least_sum.h"

namespace cb {

/// Finds the frictionless answer of an island, its least sum of normal impulses with a proof, and what program the
/// island comes down to (convex_bound.cpp). Owns its scratch.
class ConvexBoundFinder {
 public:
  explicit ConvexBoundFinder(const ConvexTolerances& tolerances) : t_(tolerances), solver_(tolerances.cone) {}

  /// False where the bound is asked for and has no proof; `bound` then holds the best there is. Without the bound f is
  /// a first guess only. Adds to `iterations`.
  bool find(const ConvexIsland& island, ConvexBound& bound, int& iterations);

 private:
  bool frictionless(const ConvexIsland& island, ConvexBound& bound, int& iterations);
  bool complementary(const ConvexIsland& island, const ConvexBound& bound);
  void take(const ConvexIsland& island, ConvexBound& bound);
  bool prove(const ConvexIsland& island, bool solved, ConvexBound& bound);
  // Ways to a frictionless answer, into x_.
  bool stops(const ConvexIsland& island);
  bool closes(const ConvexIsland& island);
  bool minimises(const ConvexIsland& island);
  // Ways to the least sum and its proof.
  bool lifts_all(const ConvexIsland& island, ConvexBound& bound);
  bool lifts_touching(const ConvexIsland& island, ConvexBound& bound);
  double slowest_parted(const ConvexIsland& island, const ConvexBound& bound) const;
  // `open`, sqrt(J): normal velocity up to which a contact may carry.
  bool lifts_densely(const ConvexIsland& island, double open, ConvexBound& bound);
  double own_rounding(const ConvexBound& bound);
  bool lets_go(const ConvexIsland& island, ConvexBound& bound);

  const ConvexTolerances t_;
  InteriorPoint solver_;
  StopScratch stop_;
  LiftScratch lift_;
  LeastSum dense_;
  StoppingImpulse stopping_;
  ConeVelocities velocities_;
  ConeProgram normal_;  // of the island at work
  ConeSolution x_;
  std::vector<char> set_;  // nc, contacts that are lifted
  std::vector<double> first_f_;
};

}  // namespace cb
