#pragma once

#include "cone/central_path.h"
#include "cone/certificate.h"
#include "cone/cone_workspace.h"
#include "cone/iterates.h"
#include "cone/polish.h"
#include "cone/proximal_points.h"
#include "cone/sparse_newton.h"

namespace cb {

/// Solves cone programs (cone_program.h) by a primal-dual interior point method that names the active constraints,
/// and a semismooth Newton method that then solves the equalities of that guess to rounding. Owns its scratch.
class InteriorPoint {
 public:
  explicit InteriorPoint(const ConeOptions& options = {}) : options_(options) {}

  /// From a cold start. Fills `solution` with the best iterate in every ending; status tells which.
  void solve(const ConeProgram& program, ConeSolution& solution);
  /// Newton's method alone, from what is in `solution` (polish.h).
  bool polish(const ConeProgram& program, ConeSolution& solution, const PolishRules& rules);

  /// By proximal points, from what is in `solution` (proximal_points.h).
  bool go_by_points(const ConeProgram& program, ConeSolution& solution);

  const ConeOptions& options() const { return options_; }
  const KktSystem& system() const { return workspace_.newton.kkt(); }

 private:
  const ConeOptions options_;
  ConeWorkspace workspace_;
  SparseNewtonScratch newton_;
  IteratesScratch iterates_;
  CentralPath<double> path_;
};

/// Solves a small cone program whose masses or friction coefficients differ by so many decades that the sparse method
/// ends far off: the same iteration, dense and in DoubleDouble. Cost: (2 nv)^3 / 3 an iteration; allocates. Uses
/// iteration_limit, step_fraction and feasibility of the options. Fills `solution` with the best iterate in every
/// ending, its gap and infeasibility as certify() finds them. Status: `solved` where the iteration ended at rounding.
void solve_dense(const ConeProgram& program, const ConeOptions& options, ConeSolution& solution);

}  // namespace cb
