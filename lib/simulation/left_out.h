#pragma once

#include "methods/pruned.h"
#include "simulation/simulation.h"

namespace cb {

/// A simulation with a method that leaves out what the scene does not need, or the plain way, and what it left out.
struct PrunedRun {
  /// `prune`: leave out, or not; `options.warm_starts`, `options.answered_by` and `simulation.prune` are set here.
  PrunedRun(const Scenario& scenario, SimulationOptions simulation, const MethodRow& row, MethodOptions options,
            bool prune);
  /// All items, also those that were not left out; times over all steps so far.
  std::vector<LeftOutItem> items() const;

  std::shared_ptr<LeftOut> left_out;
  std::shared_ptr<Counter> warm_starts;
  std::shared_ptr<AnsweredBy> answered_by;
  Simulation simulation;
};

}  // namespace cb
