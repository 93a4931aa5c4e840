#include <array>

#include "lcp/lcp.h"

namespace cb {

std::span<const LcpSolverRow> lcp_solvers() {
  static const std::array rows{lemke_row(), path_row(), path_library_row(), ynl_row(), pgs_row()};
  return rows;
}

const LcpSolverRow* find_lcp_solver(std::string_view name) {
  for (const LcpSolverRow& row : lcp_solvers())
    if (row.name == name) return &row;
  return nullptr;
}

}  // namespace cb
