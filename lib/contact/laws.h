#pragma once

#include <span>
#include <string_view>

#include "contact/problem.h"

namespace cb {

/// Is the motion the same when a patch of contacts keeps the corners of its hull alone (docs/performance.md)?
enum class Corners {
  differ,               ///< no: how often a patch is hit depends on its points
  suffice_unless_spin,  ///< yes, but where the patch spins: there the answer depends on who carries what
  suffice
};

/// What is asked of a law by those that must not ask for its name.
struct LawRow {
  std::string_view name;
  Law law;
  Corners corners;
};

/// All laws: the one table.
std::span<const LawRow> laws();
const LawRow& row_of(Law law);

}  // namespace cb
