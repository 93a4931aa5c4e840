#pragma once

#include <memory>

#include "evaluation/measure.h"

namespace cb {

/// The errors of one run against the scenario's reference (references.h), gathered as the run goes (no trajectory is
/// kept).
class SceneErrors {
 public:
  /// `k`: edges of the friction polygon of the run, 0 for a method with a cone.
  SceneErrors(const Scenario& scenario, const SimulationOptions& options, int k);

  void observe_start(const State& state);
  void observe_event(const EventRecord& event);
  void observe_step(const State& state, const StepRecord& record);
  /// Names and values in a fixed order; a measure that the run did not reach (t(8) of a run that stopped at 3 s) is
  /// left out. "reference_kind" is not here: it is scenario.reference.kind.
  Values finish() const;

 private:
  std::unique_ptr<Measure> measure_;  // null where the scene has no closed form
  bool observed_ = false;
};

}  // namespace cb
