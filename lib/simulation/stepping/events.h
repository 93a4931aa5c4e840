#pragma once

#include "simulation/base_step.h"

namespace cb {

/// One step of h seconds, split at each time of contact: one event and one solve at its start and at each of them.
/// False where a time of contact did.
bool step_by_events(BaseStep& base, double h);

}  // namespace cb
