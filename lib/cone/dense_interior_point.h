#pragma once

#include "cone/cone_program.h"

namespace cb {

/// Solves a small cone program whose masses or friction coefficients differ by so many decades that the sparse method
/// (interior_point.h) ends far off: the same iteration, dense and in DoubleDouble. Cost: (2 nv)^3 / 3 an iteration;
/// allocates. Uses iteration_limit, step_fraction and feasibility of the options. Fills `solution` with the best
/// iterate in every ending, its gap and infeasibility as certify() finds them. Status: `solved` where the iteration
/// ended at rounding.
void solve_dense(const ConeProgram& program, const ConeOptions& options, ConeSolution& solution);

}  // namespace cb
