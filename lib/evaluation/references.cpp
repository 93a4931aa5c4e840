// The table of closed forms that a scenario can name as its reference.
#include "evaluation/references.h"

#include <array>

#include "scenario/near_name.h"

namespace cb {

std::span<const ReferenceRow> references() {
  static const std::array<ReferenceRow, 7> rows = {
      impacting_sphere_row(), sliding_box_row(), sticking_box_row(), circular_sliding_row(), stack_row(),
      mobile_robot_row(),     grasp_row(),
  };
  return rows;
}

void check_reference(const Scenario& scenario) {
  if (scenario.reference.kind != ReferenceKind::analytic) return;
  std::vector<std::string> names;
  for (const ReferenceRow& row : references()) {
    if (row.name == scenario.reference.name) return;
    names.emplace_back(row.name);
  }
  throw InputError(scenario.reference.where + ": there is no reference \"" + scenario.reference.name + "\"; " +
                   suggest(scenario.reference.name, names, "there are"));
}

}  // namespace cb
