#pragma once

#include "contact/problem.h"

namespace cb {

/// Does a velocity exist that lets nothing approach, J_n v + w_n >= 0? Only limits that move, and stored problems, have
/// an offset w that can make it impossible; without it v = 0 will do.
/// False is proven, by impulses lambda >= 0 with J_n^T lambda = 0 and lambda.w < 0 (Farkas' lemma), which no velocity
/// can answer; everything else, beyond 1000 contacts too, is true. Dense: of the order of nc nv^2 operations.
bool feasible(const ContactProblem& problem);

}  // namespace cb
