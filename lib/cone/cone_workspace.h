#pragma once

#include <vector>

#include "cone/certificate.h"
#include "cone/cone_scales.h"
#include "cone/newton_system.h"

namespace cb {

/// What the methods in double know of a program, and their scratch, which is kept between programs.
struct ConeWorkspace {
  std::vector<double> q;  ///< 3 nc, m/s: J v0 + w
  ConeScales<double> scales;
  NewtonSystem newton;
  ConeVelocities velocities;
  ConeSolution best;               ///< of one polish
  std::vector<double> no_impulse;  ///< 3 nc, zeros

  void prepare(const ConeProgram& program, const ConeOptions& options);
};

/// What an answer is worth, rounding considered where it does not do without; into its gap and infeasibility.
/// `at_rounding`: its natural map is, and its gap matters no more.
Certificate check(const ConeProgram& program, const ConeOptions& options, ConeWorkspace& workspace, ConeSolution& x,
                  bool at_rounding = false);

/// eta of `x`, or nothing where the program has none.
inline std::span<const double> eta_of(const ConeProgram& program, const ConeSolution& x) {
  return program.has_eta() ? std::span<const double>(x.eta) : std::span<const double>();
}

}  // namespace cb
