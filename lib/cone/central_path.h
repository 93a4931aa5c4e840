#pragma once

#include <Eigen/Core>
#include <vector>

#include "cone/cone_program.h"
#include "cone/cone_scales.h"
#include "cone/second_order_cone.h"

namespace cb {

template <class Real>
using RealVector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;

/// The cones of a program: nc of second order (half-lines where mu = 0), a half-line for each inequality of a normal
/// velocity, one for the bound.
template <class Real>
struct Cones {
  std::vector<Real> mu;          ///< nc
  std::vector<Real> d;           ///< nc: what a normal impulse counts in the bound
  std::vector<char> inequality;  ///< nc, is there a slack a (and eta >= 0)?
  bool eta = false;              ///< are there multipliers eta?
  bool bound = false;            ///< are there s and b?
  Real kappa = 0;                ///< 0 where there is no bound
  int count = 0;                 ///< cones

  int nc() const { return static_cast<int>(mu.size()); }
};

/// A point, or a step: impulses r in K with y in K*, multipliers eta >= 0 with slacks a >= 0, s >= 0 with b >= 0.
template <class Real>
struct ConePoint {
  RealVector<Real> r, y;    ///< 3 nc
  RealVector<Real> eta, a;  ///< nc; a is zero where there is no inequality
  Real s = 0, b = 0;

  void set_zero(int nc) {
    r.setZero(3 * nc);
    y.setZero(3 * nc);
    eta.setZero(nc);
    a.setZero(nc);
    s = b = 0;
  }
};

/// What a point is off by: y - u_hat - s d, a - u_n, b - kappa + d.r; and how far from the end of the path it is.
template <class Real>
struct ConeResiduals {
  RealVector<Real> y, a;  ///< 3 nc, nc
  Real b = 0;
  Real complementarity = 0;  ///< J, r.y + eta.a + s b
  Real relative = 0;         ///< -, the same as a fraction of the program's energy
  Real worst = 0;            ///< -, of y, a, b, each scaled

  Real merit() const { return std::max(relative, worst); }
};

/// The second order of the complementarity that a corrector aims at; contacts in their scaled coordinates, lambda \ d.
template <class Real>
struct SecondOrder {
  RealVector<Real> contact, eta;  ///< 3 nc, nc
  Real b = 0;
};

/// An interior point method at work: the point, its step, and what belongs to them. Plain data, scratch kept.
template <class Real>
struct CentralPath {
  Cones<Real> cones;
  ConeScales<Real> scales;
  RealVector<Real> a_free;  ///< nc, a without impulses: where a contact parts, its slack
  ConePoint<Real> at, step;
  ConeResiduals<Real> off;
  std::vector<ConeScaling<Real>> scaling;  ///< nc, where mu > 0
  SecondOrder<Real> second_order;
  int iterations = 0;
};

}  // namespace cb
