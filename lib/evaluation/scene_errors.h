#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "simulation/simulation.h"

namespace cb {

/// A closed form that scenes can name as their reference, as `contactbench list references` prints it.
struct ReferenceRow {
  std::string_view name;                                              ///< "sliding_box", ...
  std::string_view summary;                                           ///< what is exact, with its source
  std::vector<std::pair<std::string_view, std::string_view>> errors;  ///< name, unit and meaning; fixed once published
};
std::span<const ReferenceRow> references();

/// The errors of one run against the scenario's reference, gathered as the run goes (no trajectory is kept).
class SceneErrors {
 public:
  /// `k`: edges of the friction polygon of the run, 0 for a method with a cone.
  SceneErrors(const Scenario& scenario, const SimulationOptions& options, int k);
  ~SceneErrors();
  SceneErrors(SceneErrors&&) noexcept;

  void observe_start(const State& state);
  void observe_event(const EventRecord& event);
  void observe_step(const State& state, const StepRecord& record);
  /// Names and values in a fixed order; a measure that the run did not reach (t(8) of a run that stopped at 3 s) is
  /// left out. "reference_kind" is not here: it is scenario.reference.kind.
  std::vector<std::pair<std::string, double>> finish() const;

  struct Measure;

 private:
  std::unique_ptr<Measure> measure_;
};

}  // namespace cb
