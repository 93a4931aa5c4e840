#pragma once

#include "simulation/base_step.h"

namespace cb {

/// One step of h seconds as one problem with every contact that can close within it.
void step_by_steps(BaseStep& base, double h);

}  // namespace cb
