#pragma once

#include <vector>

#include "cone/cone_program.h"

namespace cb {

/// What the unknowns of a cone program are of the size of. Impulses r: R / sqrt(w), multipliers eta: U / sqrt(w),
/// velocities y: U sqrt(w), u_n: R sqrt(w). With w U / R where impulses meet velocities and w R / U where eta does, all
/// are of the size of sqrt(R U).
template <class Real>
struct ConeScales {
  Real size = 0;         ///< sqrt(J): sqrt(R U)
  Real ratio = 1;        ///< R / U
  Real mean_weight = 1;  ///< of w_r, geometric
  std::vector<Real> w_r, w_eta;
};

}  // namespace cb
