#pragma once

#include <span>
#include <vector>

#include "methods/convex_island.h"

namespace cb {

/// How far an answer may miss the bounds: not beyond rounding, or as far as the referee accepts.
enum class Allowed { exact, backward };

/// What answers to an island are worth: (2) of drumwright_shell.cpp. Owns its scratch.
class ConvexJudge {
 public:
  explicit ConvexJudge(const ConvexTolerances& tolerances) : t_(tolerances) {}

  /// Of impulses r and multipliers eta of `program`, which is the island's (1).
  Certificate operator()(const ConvexIsland& island, const ConeProgram& program, std::span<const double> r,
                         std::span<const double> eta);
  /// 3 nc, m/s: u of the last answer that was judged.
  const std::vector<double>& u() const { return velocities_.u; }
  /// (2) with kappa = 1.r_n and eta = 0, for the velocities of the last answer that was judged, J.
  double gap_at_own_sum(const ConvexIsland& island, const ConeProgram& program, std::span<const double> r) const;

  /// Is the gap as small as is asked, and are the bounds kept?
  bool good(const ConvexIsland& island, const Certificate& certificate, Allowed allowed) const;
  /// Is it good for the rounding only that large multipliers make much of?
  bool excused(const ConvexIsland& island, const Certificate& certificate) const;
  /// -: how far bounds may be missed.
  double limit_of(Allowed allowed) const;

 private:
  const ConvexTolerances t_;
  ConeVelocities velocities_;
};

/// Multipliers of (1) from those of the program that was solved: (1) itself, or (3), whose are of either sign.
void unreduce(const ConvexBound& bound, std::span<const double> eta, std::vector<double>& multiplier);

}  // namespace cb
