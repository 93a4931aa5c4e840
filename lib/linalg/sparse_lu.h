#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <span>
#include <vector>

namespace cb {

/// LU factors of a square sparse matrix with partial pivoting (KLU). The pattern may change from call to call.
class SparseLu {
 public:
  SparseLu();
  ~SparseLu();
  SparseLu(const SparseLu&) = delete;
  SparseLu& operator=(const SparseLu&) = delete;

  /// Compressed columns: starts (n + 1), row indices and values; entries of a column in any order, no duplicates.
  /// The ordering and the pivots of the last call serve again where the pattern is the same and the factors do not
  /// grow; nothing is allocated then. False where the matrix is singular to working precision.
  bool factor(std::span<const int> starts, std::span<const int> rows, std::span<const double> values);
  /// The next call seeks its pivots afresh: what comes of it does not depend on matrices of before. The ordering stays.
  void forget_pivots();
  /// x <- A^-1 x
  void solve(std::span<double> x);
  int order() const { return order_; }
  double entries() const;  ///< nonzeros of both factors
  double flops();          ///< of the factorisation

  /// Reciprocal condition estimate (smallest over largest pivot) below which a matrix counts as singular, -.
  static constexpr double singular_below = 1e-14;
  /// Reciprocal growth of the factors below which pivots are sought afresh, -. Smaller: digits are lost unseen.
  static constexpr double growth_below = 1e-3;

 private:
  struct Data;
  std::unique_ptr<Data> data_;
  int order_ = 0;
  std::vector<int> starts_, rows_;  // pattern of the factors at hand
};

/// Product form of a basis inverse: a basis that differs from the factorised one by column exchanges.
/// Each exchange is kept as the entering column in terms of the basis it enters. Columns are padded to whole vector
/// registers; memory is kept when cleared.
class ProductForm {
 public:
  void resize(int n);  ///< padded length of the vectors; forgets all exchanges
  void clear() { rows_.clear(); }
  int exchanges() const { return static_cast<int>(rows_.size()); }
  /// Records that the basic variable of `row` was replaced; `change`[i] is the change of basic variable i per unit of
  /// the entering one (the negative of B^-1 a).
  void push(const double* change, int row);
  /// Values of the basic variables: from those of the factorised basis to those of the present one.
  void apply(double* y) const;

 private:
  /// Exchanges that wait to be carried out in one pass over y.
  struct Block {
    static constexpr int most = 4;
    int count = 0;
    std::array<const Eigen::VectorXd*, most> columns;
    std::array<double, most> steps;
    std::array<int, most> rows;

    void put(const Eigen::VectorXd& column, double step, int row) {
      columns[count] = &column;
      steps[count] = step;
      rows[count++] = row;
    }
    double value(const double* y, int row) const;
    void carry_out(double* y, int padded);
  };

  int padded_ = 0;
  std::vector<int> rows_;
  std::vector<Eigen::VectorXd> columns_;
};

}  // namespace cb
