#pragma once

#include "cone/cone_program.h"

namespace cb {

/// Solves a small cone program whose masses or friction coefficients differ by so many decades that the sparse method
/// (interior_point.h) ends far off: the same iteration, but with the multipliers' matrix formed in the impulses,
/// factored with pivoting, and in long double. Cost: (4 nc)^3 / 3 an iteration; allocates. `fixed` programs are not for
/// it. Uses iteration_limit and step_fraction of the options. Fills r, eta, s and iterations with the best iterate; gap
/// and infeasibility are left to the caller, who certifies. Status: `solved` where the iteration ended at rounding.
void solve_dense(const ConeProgram& program, const ConeOptions& options, ConeSolution& solution);

}  // namespace cb
