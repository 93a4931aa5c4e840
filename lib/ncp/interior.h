#pragma once

#include <Eigen/Core>
#include <vector>

#include "ncp/interior_system.h"

namespace cb {

/// Two ways from the start of an InteriorSystem to small products (interior.cpp). One step is one factorisation; false
/// where a system could not be factored, or numbers overflow, or steps vanish. Own their scratch.

/// Straight on by the longest step. Few steps, where it gets there.
class LongSteps {
 public:
  struct Options {
    double fraction = 0.98;        ///< -: of the longest step inside the cones
    double least_centring = 1e-3;  ///< -: share of the mean product that a step aims at, at least
  };
  bool step(const Options& options, InteriorSystem& at);

 private:
  InteriorPoints step_;
};

/// Along the central path itself, wherever it leads: also back to larger products.
class PathSteps {
 public:
  struct Options {
    double first_reach = 0.5, longest_reach = 3;  ///< -: local length of a step along the path
    double near = 0.5;                            ///< -: local distance from the path within which steps go along it
    double wanted = 0.1;                          ///< -: distance after a step that its length aims at
    double bend = 0.5;                            ///< -: local length of a step's part of second order, at most
    double fraction = 0.9;                        ///< -: of the longest step inside the cones
    double shorten = 0.25, least_part = 1e-6;     ///< -: of a step that leads astray, and at which it is given up
  };
  /// At the start of `at`.
  void begin(const Options& options, InteriorSystem& at);
  bool step();

 private:
  bool go_back();
  double find_directions();
  double go_along();

  Options o_;
  InteriorSystem* at_ = nullptr;
  double t_ = 0, reach_ = 0;                     // J, products; -, length of the next step
  double before_ = 0;                            // -, distance from the path before the last step
  double part_ = 1, t_before_ = 0, change_ = 0;  // of the last step
  double along_size_ = 0;
  std::vector<Eigen::Vector3d> rate_, off_;  // nc: misses over products; misses that a step takes away
  InteriorPoints step_, along_, bend_;       // nc: step; tangent and its change
  InteriorPoints last_, from_;               // nc: the step before, and where it began
};

}  // namespace cb
