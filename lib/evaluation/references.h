#pragma once

#include <memory>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "evaluation/measure.h"

namespace cb {

/// A closed form that scenes can name as their reference, as `contactbench list references` prints it.
struct ReferenceRow {
  using Errors = std::vector<std::pair<std::string_view, std::string_view>>;
  std::string_view name;     ///< "sliding_box", ...
  std::string_view summary;  ///< what is exact, with its source
  Errors errors;  ///< name, unit and meaning; fixed once published. Names end in their unit; `relative` has none
  /// What gathers them in a run. `k`: edges of the friction polygon, 0 for a method with a cone. Null where the scene
  /// does not have the reference's shape.
  std::unique_ptr<Measure> (*make)(const Scenario& scenario, const SimulationOptions& options, int k);
};
std::span<const ReferenceRow> references();
/// Throws InputError where the scene names a reference that there is none of.
void check_reference(const Scenario& scenario);

ReferenceRow impacting_sphere_row();
ReferenceRow sliding_box_row();
ReferenceRow sticking_box_row();
ReferenceRow circular_sliding_row();
ReferenceRow stack_row();
ReferenceRow mobile_robot_row();
ReferenceRow grasp_row();

}  // namespace cb
