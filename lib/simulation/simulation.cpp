#include "simulation/simulation.h"

#include "simulation/stepping/events.h"

namespace cb {

Simulation::Simulation(const Scenario& scenario, const SimulationOptions& options, ContactMethod method, const Law& law)
    : options_(options),
      steps_total_(step_at(options.duration, options.step)),
      base_(scenario, options, std::move(method), law) {}

const StepRecord& Simulation::step() {
  const double h = options_.step;
  base_.begin(step_index_ + 1);
  base_.choose_forces(step_index_, h);
  step_by_events(base_, h);
  base_.finish(static_cast<double>(++step_index_) * h);
  return base_.record();
}

}  // namespace cb
