#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "contact/problem.h"
#include "ncp/interior.h"

namespace cb {

/// The least displacement of a large island by interior point steps (least_displacement.cpp). Owns its scratch.
class LeastDisplacement {
 public:
  /// Writes d (nv of `problem`, m and rad) at the island's `blocks`: least in d.M d with N d >= wanted (per point of
  /// `problem`, m) at its `points`, N the normal rows of J. `scale`: per point, 1 / sqrt(N M^-1 N^T), sqrt(kg); points
  /// with 0 are left out. False, and d as it was, where no such displacement came out: bodies that are wedged in.
  bool solve(const ContactProblem& problem, std::span<const int> points, std::span<const int> blocks,
             std::span<const double> wanted, std::span<const double> scale, Eigen::VectorXd& d);

 private:
  void extract(const ContactProblem& problem, std::span<const int> points, std::span<const int> blocks,
               std::span<const double> wanted, std::span<const double> scale);

  BlockDiagonalMatrix M_;
  BandMatrix J_;
  BlockCholesky factor_;
  std::vector<double> v0_, offset_, mu_, weight_, v_, u_, best_;
  std::vector<int> place_;  // per block of the problem: its block in M_
  NcpMeasure measure_;
  VelocitySystem system_;
  InteriorSystem interior_;
  LongSteps steps_;
};

}  // namespace cb
