#pragma once

#include "methods/impact_state.h"
#include "methods/registry.h"
#include "methods/stronge_impact.h"

namespace cb {

struct MirtichOptions {
  /// Micro-impacts of one event, per contact; smaller: more events end in nonconverged.
  int impact_limit = 20000;
  ImpactState::Tolerances tolerances;  ///< when a contact counts as approaching
  ImpactOptions impact;
};

/// The method with every parameter; mirtich_row() offers it with defaults.
ContactMethod make_mirtich(const MirtichOptions& options);

}  // namespace cb
