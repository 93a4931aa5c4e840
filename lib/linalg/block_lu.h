#pragma once

#include <span>
#include <vector>

#include "linalg/block_pattern.h"

namespace cb {

/// P L U of a matrix of dense blocks that lie symmetrically, while their numbers need not. Rows are exchanged within a
/// diagonal block and nowhere else. Blocks are eliminated by minimum degree on their graph (linalg/block_ldl.h is the
/// same for symmetric matrices, at half the work).
class BlockLu {
 public:
  static constexpr int padded(int size) { return BlockPattern::padded(size); }

  /// Sizes of the diagonal blocks and the graph of the blocks off it (each edge in both columns, or in one).
  void analyse(std::span<const int> sizes, const SymmetricPattern& graph);
  /// Where the blocks A(row, column) and A(column, row) are: one of them in lower(), and the transpose of the other at
  /// the same place in upper(). Not transposed: A(row, column) is the one in lower().
  BlockPattern::Place place(int row, int column) const { return s_.place(row, column); }
  /// The matrix before factor(), its factors after: diagonal blocks and those below them in the order of elimination;
  /// and the transposes of those above.
  std::span<double> lower() { return lower_; }
  std::span<double> upper() { return upper_; }
  /// Factors what is in lower() and upper(). False on a pivot that is zero or not finite.
  bool factor();
  /// Of the determinant of what was factored: 1 or -1.
  int sign() const;
  /// Right-hand side of a block before solve(), the answer after; padded(size) numbers, the padding zero.
  double* part(int block) { return x_.data() + s_.x_at[block]; }
  void solve();

 private:
  bool factor_diagonal(int k);
  void divide_column(int k);
  void update(int k, const int*& target);

  BlockPattern s_;
  std::vector<double> lower_, upper_;
  std::vector<double> inverse_pivots_, x_;
  std::vector<int> pivot_;          // per row of x_: the row of its block that took its place
  std::vector<double> transposed_;  // the present diagonal block's U^T
};

}  // namespace cb
