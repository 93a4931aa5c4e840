#pragma once

#include <vector>

#include "contact/problem.h"

namespace cb {

/// Checks the data of an event, factors M and finds the weights (nc, 1/kg): what methods begin with. False where there
/// is nothing to solve, `solution` then says why: `not_finite`, `singular` (M), `input_error` (a contact).
bool weigh(const ContactProblem& problem, BlockCholesky& factor, std::vector<double>& weight,
           ContactSolution& solution);

}  // namespace cb
