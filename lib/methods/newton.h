#pragma once

#include "methods/impact_state.h"
#include "methods/registry.h"

namespace cb {

struct NewtonOptions {
  enum class Variant { uncapped, stick_tested };
  Variant variant = Variant::uncapped;
  int sweep_limit = 20000;             ///< sweeps of one event; smaller: more events end in nonconverged
  ImpactState::Tolerances tolerances;  ///< when a contact counts as approaching
  /// K_nn - mu |K_nt . d| below jam x K_nn counts as jammed (uncapped: no impulse of the law exists), -.
  double jam = 1e-9;
};

/// The method with every parameter; newton_row() offers the variants with defaults.
ContactMethod make_newton(const NewtonOptions& options);

}  // namespace cb
