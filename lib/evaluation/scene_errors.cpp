// The errors of a run against its scene's closed form, gathered step by step.
//
// What each reference needs is checked when the run is set up: a scene that names a reference but does not have its
// shape (another number of bodies, a gravity that varies along the normal, a box that would tip over) leaves out what
// has no closed form. Nothing is kept of the trajectory.
#include "evaluation/scene_errors.h"

#include "evaluation/references.h"

namespace cb {

SceneErrors::SceneErrors(const Scenario& scenario, const SimulationOptions& options, int k) {
  if (scenario.reference.kind != ReferenceKind::analytic) return;
  for (const ReferenceRow& row : references())
    if (row.name == scenario.reference.name) measure_ = row.make(scenario, options, k);
}

void SceneErrors::observe_start(const State& state) {
  if (measure_) measure_->observe_start(state);
}

void SceneErrors::observe_event(const EventRecord& event) {
  if (measure_) measure_->observe_event(event);
}

void SceneErrors::observe_step(const State& state, const StepRecord& record) {
  observed_ = true;
  if (measure_) measure_->observe_step(state, record);
}

Values SceneErrors::finish() const {
  Values out;
  if (observed_ && measure_) measure_->report(out);
  return out;
}

}  // namespace cb
