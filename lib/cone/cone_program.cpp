#include "cone/cone_program.h"

namespace cb {

std::string_view name(ConeStatus status) {
  switch (status) {
    case ConeStatus::solved:
      return "solved";
    case ConeStatus::nonconverged:
      return "nonconverged";
    case ConeStatus::singular:
      return "singular";
    case ConeStatus::not_finite:
      return "not_finite";
  }
  return "";
}

}  // namespace cb
