#include "contact/laws.h"

#include <array>

namespace cb {

namespace {

constexpr std::string_view one_after_another =
    "it answers contact after contact, so that its error has no expansion in the step that could be extrapolated";

}  // namespace

std::span<const LawRow> laws() {
  static constexpr std::array rows{
      LawRow{"newton", Law::newton, Corners::differ, one_after_another},
      LawRow{"mirtich", Law::mirtich, Corners::differ, one_after_another},
      LawRow{"anitescu_potra", Law::anitescu_potra, Corners::suffice_unless_spin, ""},
      LawRow{"convex", Law::convex, Corners::suffice, ""},
  };
  return rows;
}

const LawRow& row_of(Law law) { return laws()[static_cast<std::size_t>(law)]; }

}  // namespace cb
