// The table of closed forms that a scenario can name as its reference.
#include "evaluation/references.h"

#include <array>

namespace cb {

std::span<const ReferenceRow> references() {
  static const std::array<ReferenceRow, 7> rows = {
      impacting_sphere_row(), sliding_box_row(), sticking_box_row(), circular_sliding_row(), stack_row(),
      mobile_robot_row(),     grasp_row(),
  };
  return rows;
}

}  // namespace cb
