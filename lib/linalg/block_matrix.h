#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "linalg/pack.h"

namespace cb {

/// Square block-diagonal matrix; each block is dense and column-major. Storage keeps its capacity
/// when refilled, so that a simulation does not allocate after its first events.
struct BlockDiagonalMatrix {
  std::vector<int> first{0};   ///< blocks + 1: first row of each block; the last entry is the order
  std::vector<int> offset{0};  ///< blocks + 1: where the values of each block start
  std::vector<double> values;

  int order() const { return first.back(); }
  int blocks() const { return static_cast<int>(first.size()) - 1; }
  int block_size(int b) const { return first[b + 1] - first[b]; }
  Eigen::Map<Eigen::MatrixXd> block(int b) { return {values.data() + offset[b], block_size(b), block_size(b)}; }
  Eigen::Map<const Eigen::MatrixXd> block(int b) const {
    return {values.data() + offset[b], block_size(b), block_size(b)};
  }
  void clear();
  /// Appends a block of zeros of the given order and returns its index.
  int add_block(int size);
};

/// y = A x (overwrites y). All spans have length A.order().
void multiply(const BlockDiagonalMatrix& A, std::span<const double> x, std::span<double> y);
/// x . A x
double quadratic_form(const BlockDiagonalMatrix& A, std::span<const double> x);

/// Cholesky factor of a symmetric positive definite block-diagonal matrix, kept block by block.
class BlockCholesky {
 public:
  /// Returns false where a block is not positive definite (to working precision) or not finite. Blocks that are those
  /// of the last call, bit for bit, keep their factor.
  bool factor(const BlockDiagonalMatrix& A);
  /// x <- A^-1 x
  void solve_in_place(std::span<double> x) const;
  /// The same of each column of X.
  void solve_in_place(Eigen::MatrixXd& X) const;
  /// X_b <- L_b^-1 X_b for the rows of one block, which begin at `row` of X; A_b = L_b L_b^T.
  void solve_lower_in_place(int b, Eigen::Ref<Eigen::MatrixXd> X, int row) const;
  /// x <- L^-T x, A = L L^T.
  void solve_upper_in_place(std::span<double> x) const;
  /// X_b <- A_b^-1 X_b for the rows of one block; X is block_size(b) x cols, column-major.
  void solve_block_in_place(int b, double* x, int cols) const;
  /// sums_i += row_i A_b^-1 row_i^T of three rows (3 x block_size(b), column-major: an entry of a BandMatrix).
  void add_row_norms(int b, const double* rows, double* sums) const;

 private:
  bool factor_block(int b);
  /// Of columns that begin `apart` numbers apart.
  void solve_columns(int b, double* x, int cols, Eigen::Index apart) const;

  BlockDiagonalMatrix factored_, lower_;
  bool ready_ = false;              // is lower_ the factor of factored_?
  std::vector<double> inverse_;     // what speeds up solves: block_matrix.cpp
  mutable std::vector<Pack> rows_;  // of the block at hand, columns side by side
};

/// Sparse matrix of bands of three rows (one band a contact: n, t1, t2). A band is a short list of
/// dense 3 x block_size blocks, each over one block of columns of a BlockDiagonalMatrix.
struct BandMatrix {
  std::vector<int> band{0};    ///< bands + 1: first entry of each band
  std::vector<int> block;      ///< per entry: the block of columns it covers (ascending within a band)
  std::vector<int> offset{0};  ///< entries + 1: where its values start
  std::vector<double> values;  ///< 3 x block_size, column-major

  int bands() const { return static_cast<int>(band.size()) - 1; }
  Eigen::Map<Eigen::Matrix3Xd> entry(int e) { return {values.data() + offset[e], 3, (offset[e + 1] - offset[e]) / 3}; }
  Eigen::Map<const Eigen::Matrix3Xd> entry(int e) const {
    return {values.data() + offset[e], 3, (offset[e + 1] - offset[e]) / 3};
  }
  void clear();
  /// Starts a new band (a contact) without entries.
  void add_band();
  /// Appends a 3 x cols entry of zeros to the last band and returns its index.
  int add_entry(int block_index, int cols);
};

/// u = J v (overwrites u, length 3 bands). `columns` gives the block layout of v.
void multiply(const BandMatrix& J, const BlockDiagonalMatrix& columns, std::span<const double> v, std::span<double> u);
/// terms <- | |J| |v| + |w| |, of each band (overwrites, length bands): what J v + w is a sum of, entry by entry.
void sizes_of_terms(const BandMatrix& J, const BlockDiagonalMatrix& columns, std::span<const double> v,
                    std::span<const double> w, std::span<double> terms);
/// y += J^T r. `columns` gives the block layout of y.
void multiply_transposed_add(const BandMatrix& J, const BlockDiagonalMatrix& columns, std::span<const double> r,
                             std::span<double> y);

}  // namespace cb
