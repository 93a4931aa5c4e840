#pragma once

#include <memory>
#include <span>
#include <vector>

#include "linalg/sparse_cholesky.h"

namespace cb {

/// L D L^T of a symmetric matrix of dense blocks, without pivoting: D may have either sign, and the order of the rows
/// within a block is kept. Blocks are eliminated by minimum degree on their graph. What a general sparse code spends on
/// indices is most of its time where blocks are those of bodies (6 or 12 rows); here indices are of blocks.
/// Values are stored column by column with rows padded to `lanes`; the padding stays zero. `lanes` more numbers follow
/// the last, so that whole registers may be written anywhere.
class BlockLdl {
 public:
  static constexpr int lanes = 4;
  static constexpr int padded(int size) { return (size + lanes - 1) / lanes * lanes; }

  /// Sizes of the diagonal blocks and the graph of the blocks off it (each edge in both columns, or in one).
  void analyse(std::span<const int> sizes, const SymmetricPattern& graph);
  /// Where the block A(row, column) of the matrix is: its first value, and the distance of its columns. Transposed
  /// where the order of elimination keeps A(column, row) instead. The two must be neighbours or the same.
  struct Place {
    int at, stride;
    bool transposed;
  };
  Place place(int row, int column) const;
  /// The matrix before factor(), its factors after; of the diagonal blocks only the lower triangle is read.
  std::span<double> values() { return values_; }
  /// Factors what is in values(). False on a pivot that is zero or not finite.
  bool factor();
  /// Right-hand side of a block before solve(), the answer after; padded(size) numbers, the padding zero.
  double* part(int block) { return x_.data() + x_at_[block]; }
  void solve();

  int blocks() const { return static_cast<int>(x_at_.size()); }
  long entries() const { return static_cast<long>(values_.size()); }

 private:
  struct Lower {
    int row;  // place in the order
    int at;   // of its values
  };
  std::vector<int> place_;     // per block: place in the order of elimination
  std::vector<int> size_;      // per place
  std::vector<int> x_at_;      // per block: first row in x_
  std::vector<int> first_;     // per place: first row in x_ and pivots_
  std::vector<int> diagonal_;  // per place: first value of its diagonal block
  std::vector<int> column_;    // per place (+ 1): first of its blocks in lower_
  std::vector<Lower> lower_;   // blocks below the diagonal, rows ascending in a column
  std::vector<int> target_;    // of each update in the order in which factor() makes them
  std::vector<double> values_, pivots_, inverse_pivots_, x_, scaled_, upper_;
  std::vector<int> upper_at_;  // per place: the transposed factor of the diagonal block in upper_
};

}  // namespace cb
