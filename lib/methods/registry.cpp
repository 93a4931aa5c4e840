#include "methods/registry.h"

#include <array>

namespace cb {

#ifdef CONTACTBENCH_TEST_WRONG_METHODS
// Wrong on purpose (test/wrong_methods/): in the table of one program of the tests, and in no release.
MethodRow strong_friction_row();
MethodRow boastful_row();
#endif

std::span<const MethodRow> methods() {
  static const std::array rows{
      newton_row(),          mirtich_row(),  anitescu_potra_row(), drumwright_shell_row(), coulomb_row(), soft_row(),
#ifdef CONTACTBENCH_TEST_WRONG_METHODS
      strong_friction_row(), boastful_row(),
#endif
  };
  return rows;
}

const MethodRow* find_method(std::string_view name) {
  for (const MethodRow& row : methods())
    if (row.name == name) return &row;
  return nullptr;
}

}  // namespace cb
