#pragma once

#include <memory>
#include <span>
#include <vector>

namespace cb {

/// Lower triangle of a sparse symmetric matrix in compressed columns; rows ascend within a column. Entries above the
/// diagonal may be present and are ignored.
struct SymmetricPattern {
  std::vector<int> column{0};  ///< order + 1: first entry of each column
  std::vector<int> row;        ///< per entry
  int order() const { return static_cast<int>(column.size()) - 1; }
};

/// L D L^T of a sparse symmetric matrix by CHOLMOD's simplicial code. D may have either sign, so that quasi-definite
/// matrices (and others whose leading blocks are safe in the order given) are factored without pivoting. The symbolic
/// part is kept until the pattern changes. The order of elimination is the order of the rows: see block_order().
class SparseCholesky {
 public:
  SparseCholesky();
  ~SparseCholesky();
  SparseCholesky(SparseCholesky&&) noexcept;
  SparseCholesky& operator=(SparseCholesky&&) noexcept;

  /// Symbolic factorisation; the pattern must outlive the object's use. Returns false where memory is out.
  bool analyse(const SymmetricPattern& pattern);
  /// Numerical factorisation of the analysed pattern; false on a zero or non-finite pivot.
  bool factor(std::span<double> values);
  /// x <- A^-1 x
  void solve_in_place(std::span<double> x);
  /// Entries of L, for reports on memory.
  long factor_entries() const;

 private:
  struct Workspace;
  std::unique_ptr<Workspace> workspace_;
};

/// Fill-reducing order (approximate minimum degree) of an undirected graph: `column`, `row` list the neighbours of
/// each node (diagonal entries are ignored, either triangle or both may be given). order[k] = node eliminated k-th.
void block_order(const SymmetricPattern& graph, std::vector<int>& order);

}  // namespace cb
