#include "methods/registry.h"

#include <array>

namespace cb {

std::span<const MethodRow> methods() {
  static const std::array rows{newton_row(), mirtich_row(), anitescu_potra_row(), drumwright_shell_row()};
  return rows;
}

const MethodRow* find_method(std::string_view name) {
  for (const MethodRow& row : methods())
    if (row.name == name) return &row;
  return nullptr;
}

}  // namespace cb
