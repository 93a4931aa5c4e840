#include <array>

#include "control/controller.h"

namespace cb {

std::span<const ControllerRow> controllers() {
  static const std::array rows{figure_eight_row(), computed_torque_row()};
  return rows;
}

const ControllerRow* find_controller(std::string_view name) {
  for (const ControllerRow& row : controllers())
    if (row.name == name) return &row;
  return nullptr;
}

}  // namespace cb
