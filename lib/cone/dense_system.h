#pragma once

#include <Eigen/Core>
#include <vector>

#include "cone/contact_columns.h"

namespace cb {

/// The Newton systems of dense_newton.cpp, which says what its letters mean:
///   [ c W + G^-1 + P   -W_n       d  ] [dx]
///   [ W_n'             D^-1 + P   0  ] [de]
///   [ -d'              0        b / s] [ds]
/// solved in velocities: with W = A' A, H = (G^-1 + P)^-1, E = (D^-1 + P)^-1, v = A dx and w = c v - A_n de (how the
/// velocities of u and of y change, over U / R),
///   (c + A_n E A_n') v - w = A_n E rhs_e,   v + A H A' w = A H (rhs_x - d ds)
/// which has the size of two velocities and not of all impulses, and whose pivots do not grow with G D.
class DenseSystem {
 public:
  using Real = DoubleDouble;
  using Vector = ContactColumns::Vector;
  using Matrix3 = Eigen::Matrix<Real, 3, 3>;

  /// `scale`: 1 / sqrt(w_i) (nc); `d`: the same where the bound counts the contact, else 0; `ratio`: c. `below`: are
  /// there multipliers e? `bound`: is there a multiplier s?
  void form(const ConeProgram& program, const Vector& scale, const Vector& d, Real ratio, bool below, bool bound);
  const ContactColumns& columns() const { return columns_; }
  /// Of a contact: G and its inverse (contacts without friction: their first entries alone), D^-1.
  void set(int contact, const Matrix3& G, const Matrix3& G_inverse, Real D_inverse);
  /// `diagonal`: b / s. False where a pivot fails.
  bool factor(Real diagonal);
  /// `rhs`, `z`: 3 nc, then nc where there are e, then 1 where there is s. With one refinement.
  void solve(const Vector& rhs, Vector& z);
  int unknowns() const { return at_s() + (bound_ ? 1 : 0); }
  int at_e() const { return 3 * columns_.contacts(); }
  int at_s() const { return at_e() + (below_ ? columns_.contacts() : 0); }

 private:
  // P, of 1, the contacts' mobility. It does not move the answer; larger: slower at the end.
  static constexpr double proximal = 1e-28;

  void multiply(const Vector& z, Vector& out);
  void solve_once(const Vector& rhs, Vector& z);
  void solve_unbounded(const Vector& rhs, Vector& z);

  ContactColumns columns_;
  bool below_ = false, bound_ = false;
  Real ratio_ = 1, diagonal_ = 0;
  Vector d_, D_inverse_, E_, response_;
  std::vector<Matrix3> G_inverse_, H_;
  DoubleDoubleLu lu_;
  // Scratch.
  DoubleDoubleVector first_, second_, both_;
  Vector off_, more_, x_, e_, u_, y_;
};

}  // namespace cb
