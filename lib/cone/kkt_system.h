#pragma once

#include <span>
#include <vector>

#include "linalg/block_ldl.h"
#include "linalg/block_matrix.h"
#include "linalg/sparse_cholesky.h"

namespace cb {

/// The linear systems of the cone programs, in velocities:
///   (M + N^T D N) dv -         M dw = h1
///          M dv + J^T G J dw        = h2      (two velocities)
/// or, where N v >= 0 has no multipliers (dv = dw):
///   (M + J^T G J) dw = h2                     (one velocity)
/// G: a positive semidefinite 3 x 3 matrix a band; D >= 0: a number a band; N: first rows of the bands of J.
/// With x = -dw the first is symmetric and can be factored without pivoting in any order that takes dv of a block
/// before dw of the same block: what is left of M after the elimination of dv makes the pivot of dw definite.
/// Blocks of bodies go to L D L^T by blocks (linalg/block_ldl.h), systems of many tiny blocks to CHOLMOD.
class KktSystem {
 public:
  /// Sets the structure; the symbolic factorisation is kept while it stays the same. Views must stay alive until the
  /// last solve.
  /// `least_block`: mean number of rows of a block of M from which on the kernel by blocks serves.
  void prepare(const BlockDiagonalMatrix& M, const BandMatrix& J, double least_block);
  /// G: 9 per band, column-major. D: per band; empty for one velocity. False where a pivot fails.
  bool factor(std::span<const double> G, std::span<const double> D);
  /// Two velocities: h1 -> dv, h2 -> dw.
  void solve_in_place(std::span<double> h1, std::span<double> h2);
  /// One velocity: h2 -> dw.
  void solve_in_place(std::span<double> h2);

  /// Entries of the factors, for reports on memory.
  long factor_entries() const;

 private:
  struct Sparse {
    SymmetricPattern pattern;
    SparseCholesky factor;
    std::vector<double> values;
    std::vector<int> at_v, at_w;   // per block: first row of its dv, dw in the order of elimination
    std::vector<int> column_rows;  // per block: entries in each column of its dv, then of its dw
    std::vector<int> diagonal_v, coupling, diagonal_w;  // per block: where those values start
    std::vector<int> pair_v, pair_w;  // per pair of entries of a band: where its values start, negative: transposed
    std::vector<double> x;
    bool ready = false;
  };

  struct Blocks {
    BlockLdl factor;
    std::vector<BlockLdl::Place> diagonal;  // per block
    std::vector<BlockLdl::Place> pair;      // per pair of entries of a band
    bool ready = false;
  };

  bool factor_blocks(std::span<const double> G, std::span<const double> D);
  void analyse(Blocks& blocks, bool two);
  bool factor_sparse(std::span<const double> G, std::span<const double> D);
  void analyse(Sparse& sparse, bool two);
  /// Per block: the later neighbours, and where their rows start within a column of dw.
  using Starts = std::vector<std::vector<std::pair<int, int>>>;
  void place_unknowns(Sparse& s, bool two, const std::vector<int>& order) const;
  Starts lay_out_columns(Sparse& s, bool two, const SymmetricPattern& neighbours, const std::vector<int>& order,
                         const std::vector<int>& place) const;
  void lay_out_pairs(Sparse& s, bool two, const Starts& start, const std::vector<int>& place) const;
  SymmetricPattern graph() const;
  bool same_structure() const;

  const BlockDiagonalMatrix* M_ = nullptr;
  const BandMatrix* J_ = nullptr;
  bool by_blocks_ = true, two_ = false;
  // Kernels, and the structure that they were made for.
  Blocks one_velocity_blocks_, two_velocities_blocks_;
  Sparse one_velocity_, two_velocities_;
  // J^T by entries: three padded columns each.
  std::vector<double> transposed_;
  std::vector<int> transposed_at_;
  std::vector<int> first_, band_, block_;
};

}  // namespace cb
