#pragma once

#include <span>
#include <vector>

#include "linalg/block_pattern.h"

namespace cb {

/// L D L^T of a symmetric matrix of dense blocks, without pivoting: D may have either sign, and the order of the rows
/// within a block is kept. Blocks are eliminated by minimum degree on their graph. What a general sparse code spends on
/// indices is most of its time where blocks are those of bodies (6 or 12 rows); here indices are of blocks.
/// Values are stored column by column with rows padded to `lanes`; the padding stays zero. `lanes` more numbers follow
/// the last, so that whole registers may be written anywhere.
class BlockLdl {
 public:
  static constexpr int lanes = BlockPattern::lanes;
  static constexpr int padded(int size) { return BlockPattern::padded(size); }

  /// Sizes of the diagonal blocks and the graph of the blocks off it (each edge in both columns, or in one).
  void analyse(std::span<const int> sizes, const SymmetricPattern& graph);
  using Place = BlockPattern::Place;
  Place place(int row, int column) const { return s_.place(row, column); }
  /// The matrix before factor(), its factors after; of the diagonal blocks only the lower triangle is read.
  std::span<double> values() { return values_; }
  /// Factors what is in values(). False on a pivot that is zero or not finite.
  bool factor();
  /// Right-hand side of a block before solve(), the answer after; padded(size) numbers, the padding zero.
  double* part(int block) { return x_.data() + s_.x_at[block]; }
  void solve();

  int blocks() const { return s_.blocks(); }
  long entries() const { return static_cast<long>(values_.size()); }

 private:
  BlockPattern s_;
  std::vector<double> values_, pivots_, inverse_pivots_, x_, scaled_, upper_;
  std::vector<int> upper_at_;  // per place: the transposed factor of the diagonal block in upper_
};

}  // namespace cb
