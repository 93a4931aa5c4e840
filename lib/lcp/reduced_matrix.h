#pragma once

#include <vector>

#include "lcp/lcp.h"

namespace cb {

/// A square matrix put together column by column from rows of others, in the form that SparseLu takes.
struct ReducedMatrix {
  std::vector<int> starts, rows;  ///< order + 1; entries
  std::vector<double> values;     ///< entries

  int order() const { return static_cast<int>(starts.size()) - 1; }
  void clear() {
    starts.assign(1, 0);
    rows.clear();
    values.clear();
  }
  /// Zeros are left out, and so is what stands in row -1.
  void put(int row, double value) {
    if (row < 0 || value == 0) return;
    rows.push_back(row);
    values.push_back(value);
  }
  /// Column j of A.
  void put(const SparseMatrix& A, int j) {
    for (SparseMatrix::InnerIterator it(A, j); it; ++it) put(static_cast<int>(it.row()), it.value());
  }
  /// Column j of A, its row i put into row `row_of[i]`.
  void put(const SparseMatrix& A, int j, const std::vector<int>& row_of) {
    for (SparseMatrix::InnerIterator it(A, j); it; ++it) put(row_of[it.row()], it.value());
  }
  void end_column() { starts.push_back(static_cast<int>(rows.size())); }
};

}  // namespace cb
