#include "contact/laws.h"

#include <array>

namespace cb {

std::span<const LawRow> laws() {
  static constexpr std::array rows{
      LawRow{"newton", Law::newton, Corners::differ},
      LawRow{"mirtich", Law::mirtich, Corners::differ},
      LawRow{"anitescu_potra", Law::anitescu_potra, Corners::suffice_unless_spin},
      LawRow{"convex", Law::convex, Corners::suffice},
  };
  return rows;
}

const LawRow& row_of(Law law) { return laws()[static_cast<std::size_t>(law)]; }

}  // namespace cb
