#pragma once

#include <Eigen/Core>
#include <vector>

#include "lcp/normal_map.h"

namespace cb {

/// PATH's crash: projected Newton on the active set, before a path (path_crash.cpp).
struct PathCrash {
  int steps = 20;            ///< at most
  double decrease = 1e-4;    ///< part of the linear decrease of the merit that a step must reach, -
  int memory = 5;            ///< merits that the largest is taken of; 1: monotone
  double tie = 1e-12;        ///< z_i and F_i that are closer leave the pair undecided, -
  int halvings = 8;          ///< of a step at most
  double converged = 1e-13;  ///< merit at which the crash ends, -

  /// From map.z, on the map of `basis` and q, as long as the merit falls; map.z stays where nothing can be gained.
  /// At most so many `tries` of exchanges that ask for a solve.
  void run(Basis& basis, NormalMap& map, const Eigen::VectorXd& q, PivotCount& pivots, int tries);

 private:
  bool step(Basis& basis, NormalMap& map, const Eigen::VectorXd& q, PivotCount& pivots);
  bool shorten(Basis& basis, NormalMap& map, const Eigen::VectorXd& q);

  Eigen::VectorXd trial_, target_;  // n
  std::vector<double> merits_;
  std::vector<char> before_;   // n: active set of the last step
  std::vector<char> refused_;  // n: had no usable pivot in this crash
};

}  // namespace cb
