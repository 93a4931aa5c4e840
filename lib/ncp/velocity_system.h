#pragma once

#include <span>
#include <vector>

#include "linalg/block_lu.h"
#include "linalg/block_matrix.h"

namespace cb {

/// The linear systems of Newton's method in velocities, (M + J^T G J) dv = h, G any 3 x 3 matrix a contact, factored by
/// blocks of bodies. Banded along a stack: the cost grows linearly with its boxes, whatever the rank of W.
class VelocitySystem {
 public:
  /// Sets the structure; the symbolic factorisation is kept while it stays the same. Views must stay alive.
  void prepare(const BlockDiagonalMatrix& M, const BandMatrix& J);
  /// G: 9 a contact, column-major, kg. False where a pivot fails. The same G as before is not factored again.
  bool factor(std::span<const double> G);
  /// Of the determinant of what was factored: 1 or -1.
  int sign() const { return lu_.sign(); }
  /// h <- dv
  void solve_in_place(std::span<double> h);

 private:
  void analyse();

  const BlockDiagonalMatrix* M_ = nullptr;
  const BandMatrix* J_ = nullptr;
  BlockLu lu_;
  std::vector<BlockPattern::Place> diagonal_;  // per block
  std::vector<BlockPattern::Place> pair_;      // per pair of entries of a band
  std::vector<double> transposed_;             // J^T by entries, three padded columns each
  std::vector<int> transposed_at_;
  std::vector<double> G_;                  // what is factored; empty: nothing
  std::vector<int> first_, band_, block_;  // the structure that lu_ was made for
};

}  // namespace cb
