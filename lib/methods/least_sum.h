#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "contact/problem.h"

namespace cb {

/// Frictionless impulses of least sum by an interior point method, dense and in long double. Where rows depend on each
/// other up to 1e-10 (bricks in a wall, tilted by what they sank) W is singular to rounding and methods that look for
/// an active set find none; this one needs none.
class LeastSum {
 public:
  /// Rows N of (M, J), scaled by `weight` (1/kg, nc); `q` (3 nc, m/s): contact velocities without impulses. `share`
  /// (nc): coefficients of the sum. `touching` (sqrt(J)): u_n / sqrt(w) up to which a contact touches. Fills f (nc, N
  /// s) and z (nv): N z <= share where f touches, = share where f > 0, both up to a complementarity of `rounding`.
  /// False where it comes to none; f and z are then not to be used.
  bool solve(const BlockDiagonalMatrix& M, const BandMatrix& J, const BlockCholesky& factor,
             std::span<const double> weight, std::span<const double> q, std::span<const double> share, double touching,
             std::span<double> f, std::span<double> z);

  /// Contacts up to which this is tried: the cost is that of dense matrices.
  static constexpr int dense_limit = 96;

 private:
  using Real = long double;
  using Vector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;

  // Of 1, the scaled problem's size: complementarity and residuals at which an iteration ends, and up to which its
  // answer counts.
  static constexpr Real rounding = 1e-19L, accepted = 1e-9L;
  // sigma of the linear program: its f leaves momenta of sigma |z| open, and is of least sum up to rounding / sigma.
  static constexpr Real shift = 1e-13L;
  // Of a step in x, which is not unique: keeps it from drifting.
  static constexpr Real proximal = 1e-17L;
  static constexpr int iteration_limit = 100, patience = 10;

  void assemble(const BlockDiagonalMatrix& M, const BandMatrix& J, const BlockCholesky& factor,
                std::span<const double> weight);
  bool minimise(Real sigma, const Vector& b, const Vector& c);
  Real residuals(Real sigma, const Vector& b, const Vector& c);
  Real longest() const;

  Matrix A_, K_;  // nv x nc: columns of those that take part; nv x nv
  Matrix columns_;
  Eigen::MatrixXd rows_;
  Vector x_, a_, nu_, dx_, da_, dnu_, off_nu_, off_a_;
};

}  // namespace cb
