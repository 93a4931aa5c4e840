#include <array>

#include "ncp/ncp.h"

namespace cb {

std::span<const NcpSolverRow> ncp_solvers() {
  static const std::array rows{newton_ncp_row(), nsgs_row(), bisection_row(), admm_row(), cascade_row()};
  return rows;
}

const NcpSolverRow* find_ncp_solver(std::string_view name) {
  for (const NcpSolverRow& row : ncp_solvers())
    if (row.name == name) return &row;
  return nullptr;
}

}  // namespace cb
