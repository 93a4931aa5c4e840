#include "simulation/left_out.h"

namespace cb {

namespace {

SimulationOptions with_pruning(SimulationOptions simulation, const MethodRow& row, const MethodOptions& options,
                               bool prune) {
  const Corners corners = row.law.leave_out(row.terms(options)).corners;
  simulation.prune = {prune ? corners : Corners::differ, prune, prune, simulation.prune.repeats};
  return simulation;
}

ContactMethod make_method(const MethodRow& row, MethodOptions options, const PrunedRun& run, bool prune, bool rest) {
  options.warm_starts = run.warm_starts;
  options.answered_by = run.answered_by;
  // In any case: islands are problems of their own, none may set the scale that another is solved to; and unknowns of
  // friction that is none are not there, they make the bases of an LCP singular.
  const PruneOptions always{.islands = true, .closed_forms = false, .idle_friction = true};
  return pruned(row, options, run.left_out, prune ? PruneOptions{.repeats = rest} : always);
}

}  // namespace

PrunedRun::PrunedRun(const Scenario& scenario, SimulationOptions options, const MethodRow& row, MethodOptions method,
                     bool prune)
    : left_out(std::make_shared<LeftOut>()),
      warm_starts(std::make_shared<Counter>(0)),
      answered_by(std::make_shared<AnsweredBy>()),
      simulation(scenario, with_pruning(options, row, method, prune),
                 make_method(row, method, *this, prune, options.prune.repeats), row.law) {}

std::vector<LeftOutItem> PrunedRun::items() const {
  std::vector<LeftOutItem> all = cb::items(*left_out);
  const StepLeftOut& steps = simulation.left_out();
  all.push_back({"coplanar contacts", "the corners of their hull carry whatever they can", steps.coplanar_points});
  all.push_back({"searches for times of contact", "the pair hardly moves before the step ends", steps.contact_times});
  all.push_back({"searches for pairs that can meet", "nothing has moved by more than the last one allowed for",
                 steps.pair_searches});
  all.push_back({"events of what rests", "they begin as the last one did, to the last bit", steps.repeats});
  all.push_back({"cold solves: warm starts accepted", "the previous event's answer led to one that passes the check",
                 *warm_starts});
  return all;
}

}  // namespace cb
