#pragma once

#include <string>
#include <vector>

#include "scenario/scenario.h"

namespace cb {

/// What in a scene the compression bound of `convex` can forbid, as far as the scene says it before it runs: one line
/// each (docs/methods/convex.md, "What the bound forbids").
std::vector<std::string> bound_notes(const Scenario& scenario);

}  // namespace cb
