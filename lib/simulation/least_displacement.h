#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "cone/kkt_system.h"
#include "contact/problem.h"

namespace cb {

/// The least displacement of a large island by springs that are made ever harder (least_displacement.cpp). Owns its
/// scratch.
class LeastDisplacement {
 public:
  /// Writes d (nv of `problem`, m and rad) at the island's `blocks`: least in d.M d with N d >= wanted (per point of
  /// `problem`, m) at its `points`, N the normal rows of J. `scale`: per point, 1 / sqrt(N M^-1 N^T), sqrt(kg); points
  /// with 0 are left out. Points that contradict each other are missed alike, but for joint limits, which hold. False,
  /// and d as it was, where no displacement came out.
  bool solve(const ContactProblem& problem, std::span<const int> points, std::span<const int> blocks,
             std::span<const double> wanted, std::span<const double> scale, Eigen::VectorXd& d);

 private:
  void extract(const ContactProblem& problem, std::span<const int> points, std::span<const int> blocks,
               std::span<const double> wanted, std::span<const double> scale);
  double relax();
  void take_springs();
  double look();
  bool find_step();
  double length_of_step();
  void take_step(double length);

  BlockDiagonalMatrix M_;
  BandMatrix J_;
  BlockCholesky factor_;
  KktSystem system_;
  std::vector<int> place_;                // per block of the problem: its block in M_
  std::vector<char> is_limit_;            // per point
  std::vector<double> wanted_, w_, R_;    // per point: m; N M^-1 N^T and R, 1/kg
  std::vector<double> r_, dr_, r_was_;    // 3 per point, kg m: with nothing along the surface, as what follows
  std::vector<double> given_, best_;      // that hold nothing back
  std::vector<double> hardest_;           // the best of the hardest springs that came to an answer
  std::vector<double> opened_, opening_;  // 3 per point, m: N d, N dd
  std::vector<double> d_, dd_, d_was_, moved_, moment_;
  std::vector<double> G_;  // 9 per point, kg
};

}  // namespace cb
