#pragma once

#include <span>
#include <vector>

#include "linalg/sparse_cholesky.h"

namespace cb {

/// Where a factorisation by blocks keeps its numbers: of a matrix whose blocks off the diagonal lie symmetrically, what
/// elimination in the order of minimum degree leaves below the diagonal. Values of a block are stored column by column
/// with rows padded to `lanes`; the padding stays zero.
struct BlockPattern {
  static constexpr int lanes = 4;
  static constexpr int padded(int size) { return (size + lanes - 1) / lanes * lanes; }

  struct Lower {
    int row;  ///< place in the order
    int at;   ///< of its values
  };
  /// Where the block A(row, column) of the matrix is: its first value, and the distance of its columns. Transposed
  /// where the order of elimination keeps A(column, row) instead. The two must be neighbours or the same.
  struct Place {
    int at, stride;
    bool transposed;
  };

  std::vector<int> place_of;  ///< per block: place in the order of elimination
  std::vector<int> size;      ///< per place
  std::vector<int> x_at;      ///< per block: first row in vectors
  std::vector<int> first;     ///< per place (+ 1): first row in vectors
  std::vector<int> diagonal;  ///< per place: first value of its diagonal block
  std::vector<int> column;    ///< per place (+ 1): first of its blocks in lower
  std::vector<Lower> lower;   ///< blocks below the diagonal, rows ascending in a column
  std::vector<int> target;    ///< block of each update, column by column, pairs (e, f >= e) of its blocks in order
  int entries = 0;            ///< values, and `lanes` more, so that whole registers may be written anywhere
  int tall = 0;               ///< most values below the diagonal of a column

  /// Sizes of the diagonal blocks and the graph of the blocks off it (each edge in both columns, or in one).
  void analyse(std::span<const int> sizes, const SymmetricPattern& graph);
  Place place(int row, int col) const;
  int blocks() const { return static_cast<int>(x_at.size()); }
  /// Zeros after the numbers of each block: what overflowed in a solve would stay there, and come back in the next.
  void clear_padding(std::vector<double>& x) const;

 private:
  void find_targets();
  const Lower& find(int place, int row) const;
};

}  // namespace cb
