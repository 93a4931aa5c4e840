#pragma once

#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "linalg/block_matrix.h"

namespace cb {

/// Convex program over second-order cones, in sparse variables (v and r):
///   minimise    1/2 v.M v        with v = v0 + M^-1 J^T r   (v0 = v_minus)
///   subject to  N v + w_n >= 0                      (where `bounded_below`; N: first row of each band)
///               r_i in K_i = { |r_t| <= mu_i r_n }   (band i of J; mu_i = 0 leaves r_n >= 0, r_t = 0)
///               sum of r_n over group g <= kappa_g  (where kappa is given)
/// In terms of r alone the objective is 1/2 r.W r + r.(J v0 + w) up to a constant, W = J M^-1 J^T.
/// Views only: the caller keeps the data alive.
struct ConeProgram {
  const BlockDiagonalMatrix* M = nullptr;
  const BandMatrix* J = nullptr;
  const std::vector<double>* v0 = nullptr;      ///< nv
  const std::vector<double>* offset = nullptr;  ///< 3 nc, w
  const std::vector<double>* mu = nullptr;      ///< nc
  bool bounded_below = false;                   ///< N v + w_n >= 0 enforced?
  const std::vector<int>* group = nullptr;      ///< nc, group of each band; nullptr: no bound
  const std::vector<double>* kappa = nullptr;   ///< per group, >= 0
};

enum class ConeStatus { solved, nonconverged, singular, not_finite, infeasible };
std::string_view name(ConeStatus status);

struct ConeOptions {
  double gap_tolerance = 1e-12;  ///< J, absolute duality gap at which the iteration may stop
  double feasibility = 1e-10;    ///< scaled primal infeasibility at which the iteration may stop
  int iteration_limit = 100;
  /// Largest nv at which the dense kernel serves (measured: bench/cone).
  int dense_limit = 48;
};

struct ConeSolution {
  ConeStatus status = ConeStatus::nonconverged;
  std::string reason;
  std::vector<double> r;    ///< 3 nc
  std::vector<double> v;    ///< nv
  std::vector<double> eta;  ///< nc, multipliers of N v + w_n >= 0
  std::vector<double> s;    ///< per group, multipliers of the bound
  int iterations = 0;
  double gap = std::numeric_limits<double>::infinity();  ///< J, as the solver finds it
  double infeasibility = std::numeric_limits<double>::infinity();
};

}  // namespace cb
