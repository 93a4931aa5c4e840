#pragma once

#include "cone/cone_program.h"

namespace cb {

/// Solves a small cone program whose masses or friction coefficients differ by so many decades that the sparse method
/// (interior_point.h) ends far off: the same iteration, but with the multipliers' matrix formed in the impulses,
/// factored with pivoting, and in long double. Cost: (4 nc)^3 / 3 an iteration; allocates. Bounds on anything
/// but the sum of normal impulses are not for it. Uses iteration_limit, step_fraction, patience and
/// feasibility of the options. Fills `solution` with the best iterate in every ending, its gap and infeasibility as
/// certify() finds them. Status: `solved` where the iteration ended at rounding.
void solve_dense(const ConeProgram& program, const ConeOptions& options, ConeSolution& solution);

}  // namespace cb
