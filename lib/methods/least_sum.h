#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "cone/contact_columns.h"
#include "contact/problem.h"

namespace cb {

/// Frictionless impulses of least sum by an interior point method, dense and in DoubleDouble. Where rows depend on each
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
  static constexpr int dense_limit = 200;

 private:
  using Real = DoubleDouble;
  using Vector = ContactColumns::Vector;

  // Of 1, the scaled problem's size: complementarity and residuals at which an iteration ends, and up to which its
  // answer counts.
  static constexpr double rounding = 1e-23, accepted = 1e-9;
  // sigma of the linear program: its f leaves momenta of sigma |z| open, and is of least sum up to rounding / sigma.
  static constexpr double shift = 1e-13;
  // What the equations may be off by and be met: impulses of contacts that hardly touch are left out, and leave that.
  static constexpr double negligible = 1e-14;
  // Of a step in x, which is not unique: keeps it from drifting, and the condition of the system, 1 / (sigma proximal),
  // to what DoubleDouble can solve. Larger where impulses are large: products of x and a end at proximal x^2.
  static Real proximal(Real sigma) { return std::max<Real>(1e-25, 1e-33 / sigma); }
  // -: complementarity aimed at, of the present, at least: fast first; then, where products fell so far behind the
  // others that they leave no room for a turn of the path, never to the edge itself. From where on it is good enough.
  static constexpr std::array<double, 2> centres = {0, 1e-2};
  static constexpr double enough = 1e-21;
  static constexpr int iteration_limit = 100, patience = 10;

  bool minimise(Real sigma, const DoubleDoubleVector& b, const Vector& c);
  void follow(Real sigma, const DoubleDoubleVector& b, const Vector& c, double least_centre, Real& best);
  Real residuals(Real sigma, const DoubleDoubleVector& b, const Vector& c);
  bool factor(Real sigma);
  void step(Real sigma, const Vector& change);
  void momentum(const Vector& x, DoubleDoubleVector& p);
  void normals(const DoubleDoubleVector& p, Vector& u);
  Real longest() const;

  ContactColumns columns_;
  std::vector<int> part_;  // contacts that take part: x, a are theirs
  DoubleDoubleLu lu_;
  Vector x_, a_, dx_, da_, off_a_, D_, best_x_, all_, u_;
  DoubleDoubleVector nu_, dnu_, off_nu_, best_nu_, p_;
};

}  // namespace cb
