#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "contact/problem.h"

namespace cb {

/// Frictionless impulses of least sum by vertices: contacts that carry have independent rows, each kept by an
/// orthogonal factorisation of L^-1 N^T (M = L L^T), whose condition is the root of W's. Where rows depend on each
/// other up to 1e-10 (bricks in a wall, tilted by what they sank) W is singular to rounding, and methods in W f find no
/// active set.
class LeastSum {
 public:
  /// Rows N of (M, J), scaled by `weight` (1/kg, nc); `q` (3 nc, m/s): contact velocities without impulses. `share`
  /// (nc): coefficients of the sum. Fills f (nc, N s) and z (nv): N z <= share where f touches, = share where f > 0.
  /// False where it comes to none within its limits; f and z are then not to be used.
  bool solve(const BlockDiagonalMatrix& M, const BandMatrix& J, const BlockCholesky& factor,
             std::span<const double> weight, std::span<const double> q, std::span<const double> share,
             std::span<double> f, std::span<double> z);

  /// Contacts up to which this is tried: the cost is that of dense matrices.
  static constexpr int dense_limit = 96;
  /// -: |u_n| over sqrt(w) and the size of q, and N z - share over sqrt(w), up to which a row counts as kept.
  static constexpr double kept = 1e-11;
  /// -: part of a row outside the span of those that carry, over the row, up to which it counts as dependent on them.
  static constexpr double dependent = 1e-7;

 private:
  bool carry();
  bool descend();
  void enter(int contact);
  void factorise();
  Eigen::VectorXd shares(const Eigen::VectorXd& row) const;
  Eigen::VectorXd stop(const Eigen::VectorXd& velocity) const;
  bool drop_first(const Eigen::VectorXd& direction, double longest, double& step);

  int rounds_ = 0;
  Eigen::MatrixXd A_, Q_, R_;  // nv x nc: columns over sqrt(w); of the columns that carry
  Eigen::VectorXd q_, x_, share_;
  std::vector<int> carry_;  // contacts
  Eigen::VectorXd f_;       // of carry_
  double size_ = 0;
};

}  // namespace cb
