#pragma once

#include <cstdint>

#include "scenario/scenario.h"

namespace cb {

/// Moves every free body by `size` m in a direction of its own, and turns it about another by the angle that moves the
/// farthest point of its shapes by `size`; links of robots stay. The same seed gives the same start on every machine.
/// Bodies that touched may overlap by about twice `size` afterwards.
void perturb(Scenario& scenario, double size, std::uint64_t seed);

}  // namespace cb
