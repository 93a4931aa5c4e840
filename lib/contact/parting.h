#pragma once

#include <vector>

#include "contact/islands.h"
#include "contact/problem.h"

namespace cb {

/// -: a contact parts clearly if it does so faster than this fraction of its island's fastest velocity,
inline constexpr double clearly_parting = 1e-6;
/// and than this fraction of the terms that its velocity is the sum of: rounding parts nothing.
inline constexpr double parting_beyond_rounding = 1e-12;

/// Does any contact part before the event (or is not a number)? At little cost.
bool any_parts(const ContactProblem& problem);
/// |J_n| |v-| + |w_n| of contact c, m/s: the terms of its normal velocity.
double normal_terms(const ContactProblem& problem, int c);
/// Per island, m/s: the largest entry of `u` (3 nc).
void island_speeds(const Islands& islands, const std::vector<double>& u, std::vector<double>& speed);

}  // namespace cb
