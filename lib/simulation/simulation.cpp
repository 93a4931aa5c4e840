#include "simulation/simulation.h"

#include "simulation/stepping/accuracy.h"
#include "simulation/stepping/events.h"
#include "simulation/stepping/steps.h"

namespace cb {

SimulationOptions with_closed_gap(SimulationOptions options, const Scenario& scenario) {
  if (options.stepping != Stepping::accuracy) return options;
  double largest = 0;
  for (const Shape& shape : scenario.shapes)
    if (std::isfinite(shape.size())) largest = std::max(largest, shape.size());
  if (largest > 0) options.closed_gap = std::min(options.closed_gap, 0.1 * options.accuracy / largest);
  return options;
}

void take_from(const Scenario& scenario, SimulationOptions& options) {
  options.step = scenario.step;
  options.duration = scenario.duration;
  options.joint_forces = scenario.implicit_joints ? JointForces::implicit : JointForces::explicit_euler;
}

Simulation::Simulation(const Scenario& scenario, const SimulationOptions& options, ContactMethod method, const Law& law)
    : options_(options),
      steps_total_(step_at(options.duration, options.step)),
      base_(scenario, with_closed_gap(options, scenario), std::move(method), law) {
  if (options.stepping == Stepping::accuracy) accuracy_ = std::make_unique<AccuracyStepping>(scenario, options);
}

Simulation::~Simulation() = default;

bool Simulation::done() const { return accuracy_ ? base_.state().t >= options_.duration : step_index_ >= steps_total_; }

const AccuracyTally* Simulation::accuracy() const { return accuracy_ ? &accuracy_->tally() : nullptr; }

const StepRecord& Simulation::step() {
  const double h = options_.step;
  base_.begin(step_index_ + 1);
  if (accuracy_) {
    accuracy_->step(base_);
    ++step_index_;
    base_.finish(base_.state().t);
    return base_.record();
  }
  base_.choose_forces(step_index_, h);
  if (options_.stepping == Stepping::steps)
    step_by_steps(base_, h);
  else
    step_by_events(base_, h);
  base_.finish(static_cast<double>(++step_index_) * h);
  return base_.record();
}

}  // namespace cb
