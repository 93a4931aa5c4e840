#pragma once

#include <Eigen/Core>
#include <vector>

#include "cone/cone_program.h"
#include "linalg/double_double_lu.h"

namespace cb {

/// The contacts of a cone program as columns A = L^-1 J^T d of a matrix, M = L L^T, so that A^T A is their mobility,
/// in DoubleDouble: 3 columns a contact, with entries in the rows of the one or two blocks of M that it joins.
class ContactColumns {
 public:
  using Vector = Eigen::Matrix<DoubleDouble, Eigen::Dynamic, 1>;

  /// `d`: a factor a contact (nc).
  void form(const ConeProgram& program, const Vector& d);
  int rows() const { return rows_; }
  int contacts() const { return static_cast<int>(ranges_.size()); }
  /// p = A x, nv.
  void momentum(const Vector& x, DoubleDoubleVector& p) const;
  /// u = A^T p, 3 nc.
  void velocities(const DoubleDoubleVector& p, Vector& u) const;
  /// Adds to a matrix of at least nv x nv from its place (row, column): sum over contacts of A_c B_c A_c^T.
  void add_congruence(const Eigen::Matrix<DoubleDouble, 3, 3>& B, int contact, int row, int column,
                      DoubleDoubleLu& matrix) const;

 private:
  struct Range {
    int first, rows;  // of A
    std::size_t at;   // in high_, low_: three columns of `rows` numbers; in transposed: `rows` times three and a zero
    std::size_t transposed_at;
  };
  int rows_ = 0;
  std::vector<std::vector<Range>> ranges_;  // per contact
  std::vector<double> high_, low_, transposed_high_, transposed_low_;
};

}  // namespace cb
