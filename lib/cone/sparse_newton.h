#pragma once

#include <vector>

#include "cone/central_path.h"
#include "cone/cone_workspace.h"

namespace cb {

/// Scratch of SparseNewton.
struct SparseNewtonScratch {
  std::vector<double> damping;  ///< 9 nc
  ConeVelocities velocities;    ///< of the point
};

/// The linear systems of the interior point method in double: sparse, in the program's own units (newton_system.h).
/// The proximal terms of ConeOptions are in them.
class SparseNewton {
 public:
  SparseNewton(const ConeProgram& program, const ConeOptions& options, ConeWorkspace& workspace,
               SparseNewtonScratch& scratch)
      : p_(program), options_(options), w_(workspace), damping_(scratch.damping), velocities_(scratch.velocities) {}

  /// Fills cones, scales and a_free of `path`. The workspace is prepared.
  void describe(CentralPath<double>& path) const;
  /// What the slacks of a point should be for its impulses and multipliers, but for s d: u_hat and u_n.
  void slacks(const ConePoint<double>& at, RealVector<double>& y, RealVector<double>& a);
  /// Linearises at path.at and factors. False where a pivot fails.
  bool factor(const CentralPath<double>& path);
  /// Adds path.second_order to what the next step aims at.
  void add(const CentralPath<double>& path);
  /// The step, all but its b. False where a pivot fails.
  bool solve(const CentralPath<double>& path, ConePoint<double>& step);

 private:
  void linearise_contact(const CentralPath<double>& path, int c);
  void linearise_multiplier(const CentralPath<double>& path, int c);

  const ConeProgram& p_;
  const ConeOptions& options_;
  ConeWorkspace& w_;
  std::vector<double>& damping_;
  ConeVelocities& velocities_;
  double border_rhs_ = 0;
};

}  // namespace cb
