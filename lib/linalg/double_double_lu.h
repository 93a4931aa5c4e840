#pragma once

#include <vector>

#include "linalg/double_double.h"

namespace cb {

/// Vector of DoubleDouble, its two halves apart, so that sums of multiples go through vector registers.
struct DoubleDoubleVector {
  std::vector<double> high, low;

  DoubleDoubleVector() = default;
  explicit DoubleDoubleVector(int n) : high(n, 0.0), low(n, 0.0) {}
  int size() const { return static_cast<int>(high.size()); }
  void set_zero(int n) {
    high.assign(n, 0.0);
    low.assign(n, 0.0);
  }
  DoubleDouble operator[](int i) const { return {high[i], low[i]}; }
  void set(int i, const DoubleDouble& x) {
    high[i] = x.high;
    low[i] = x.low;
  }
};

/// y += a x for `count` numbers, given by their halves.
void add_multiple(const DoubleDouble& a, const double* x_high, const double* x_low, double* y_high, double* y_low,
                  int count);
DoubleDouble dot(const double* x_high, const double* x_low, const double* y_high, const double* y_low, int count);

/// Square systems of DoubleDouble by Gaussian elimination with partial pivoting.
class DoubleDoubleLu {
 public:
  /// Zeroes of size n x n, to be added to.
  void resize(int n);
  int size() const { return n_; }
  /// A(row, column + i) += a x_i for i < count.
  void add(int row, int column, const DoubleDouble& a, const double* x_high, const double* x_low, int count) {
    add_multiple(a, x_high, x_low, &high_[at(row, column)], &low_[at(row, column)], count);
  }
  void add(int row, int column, const DoubleDouble& a) {
    constexpr double one = 1, nothing = 0;
    add(row, column, a, &one, &nothing, 1);
  }
  /// False where a pivot is zero or not finite.
  bool factor();
  /// n numbers; after factor().
  void solve_in_place(DoubleDoubleVector& x) const;

 private:
  std::size_t at(int row, int column) const { return static_cast<std::size_t>(row) * n_ + column; }

  int n_ = 0;
  std::vector<double> high_, low_;  // by rows; after factor() L below the diagonal and U, with
  std::vector<int> pivot_;
  std::vector<DoubleDouble> inverse_;  // of its diagonal
};

}  // namespace cb
