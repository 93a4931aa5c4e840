#pragma once

#include <Eigen/Core>
#include <cmath>
#include <string>

#include "lcp/complementary_path.h"
#include "lcp/lcp.h"

namespace cb {

/// What the ways to start of a solver came to, where none of them reached an answer.
struct Climb {
  int rungs = 0, rays = 0, singular = 0;  ///< tried; of them ended by PathEnd::ray, by PathEnd::bad_pivot
  PathEnd end = PathEnd::bad_pivot;       ///< of the last
};

/// Tries each rung (`name`) by `attempt(rung)`, which leaves z and residual in `solution`, until one solves the problem
/// within `tolerance` or `spent()` holds; solution.reason tells how each ended. True where there is an answer:
/// `solved`, or the best vertex as `inaccurate`, kept meanwhile in `best` (n). Without one, z is zero and status is
/// left alone.
template <class Ladder, class Attempt, class Spent>
bool climb(const Ladder& ladder, double tolerance, LcpSolution& solution, Eigen::VectorXd& best, Climb& tried,
           const Attempt& attempt, const Spent& spent) {
  double least = HUGE_VAL;
  for (const auto& rung : ladder) {
    tried.end = attempt(rung);
    if (tried.end == PathEnd::solution && solution.residual <= tolerance) {
      solution.status = LcpStatus::solved;
      if (tried.rungs > 0) solution.reason += "; solved by: " + std::string(rung.name);
      return true;
    }
    if (tried.end == PathEnd::solution && solution.residual < least) {
      least = solution.residual;
      best = solution.z;
    }
    tried.rays += tried.end == PathEnd::ray;
    tried.singular += tried.end == PathEnd::bad_pivot;
    solution.reason += (tried.rungs++ > 0 ? "; " : "") + std::string(rung.name) + ": " + std::string(text(tried.end));
    if (spent()) break;
  }
  solution.residual = least;
  if (least == HUGE_VAL) {
    solution.z.setZero(solution.z.size());
    return false;
  }
  solution.z = best;
  solution.status = LcpStatus::inaccurate;
  return true;
}

}  // namespace cb
