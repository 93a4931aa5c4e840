#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

namespace cb {

/// Algebra of one second-order cone x_0 >= |(x_1, x_2)|, for the interior point methods; Real: double, or DoubleDouble
/// where a small program needs more digits.
/// Source: L. Vandenberghe, The CVXOPT linear and quadratic cone program solvers, 2010, sec. 4.
template <class Real>
using ConeVector = Eigen::Matrix<Real, 3, 1>;

/// x_0^2 - |x_t|^2 without cancellation of squares.
template <class Real>
Real cone_product(const ConeVector<Real>& x) {
  using std::sqrt;
  const Real t = sqrt(x[1] * x[1] + x[2] * x[2]);
  return (x[0] - t) * (x[0] + t);
}

/// Largest step that keeps x + alpha dx in the cone; x is inside.
template <class Real>
Real cone_step(const ConeVector<Real>& x, const ConeVector<Real>& dx) {
  using std::sqrt;
  const Real c = cone_product(x);
  const Real b = x[0] * dx[0] - x[1] * dx[1] - x[2] * dx[2];
  const Real a = cone_product(dx);
  // First positive root of a t^2 + 2 b t + c; c > 0.
  Real t = std::numeric_limits<Real>::infinity();
  const Real discriminant = b * b - a * c;
  if (discriminant >= 0) {
    const Real root = sqrt(discriminant);
    if (b < 0)
      t = c / (-b + root);
    else if (a < 0)
      t = (b + root) / -a;
  }
  if (dx[0] < 0) t = std::min<Real>(t, -x[0] / dx[0]);
  return t;
}

/// The same for a half-line x >= 0.
template <class Real>
Real ray_step(Real x, Real dx) {
  return dx < 0 ? Real(-x / dx) : std::numeric_limits<Real>::infinity();
}

/// Nesterov-Todd scaling of one cone: W z = W^-1 x = lambda; W = eta [w0, w1'; w1, I + w1 w1'/(1 + w0)].
template <class Real>
struct ConeScaling {
  Real eta;
  ConeVector<Real> w;

  static ConeScaling of(const ConeVector<Real>& x, const ConeVector<Real>& z) {
    using std::sqrt;
    const Real x_size = sqrt(cone_product(x)), z_size = sqrt(cone_product(z));
    const ConeVector<Real> xb = x / x_size, zb = z / z_size;
    const Real gamma = sqrt((1 + xb.dot(zb)) / 2);
    ConeScaling s;
    s.eta = sqrt(x_size / z_size);
    s.w = ConeVector<Real>(xb[0] + zb[0], xb[1] - zb[1], xb[2] - zb[2]) / (2 * gamma);
    return s;
  }
  ConeVector<Real> apply(const ConeVector<Real>& z) const {
    const Real d = w[1] * z[1] + w[2] * z[2], f = z[0] + d / (1 + w[0]);
    return eta * ConeVector<Real>(w[0] * z[0] + d, z[1] + f * w[1], z[2] + f * w[2]);
  }
  ConeVector<Real> apply_inverse(const ConeVector<Real>& x) const {
    const Real d = w[1] * x[1] + w[2] * x[2], f = -x[0] + d / (1 + w[0]);
    return ConeVector<Real>(w[0] * x[0] - d, x[1] + f * w[1], x[2] + f * w[2]) / eta;
  }
  /// W W.
  Eigen::Matrix<Real, 3, 3> squared() const { return eta * eta * reflection(w); }
  /// W^-1 W^-1.
  Eigen::Matrix<Real, 3, 3> inverse_squared() const { return reflection({w[0], -w[1], -w[2]}) / (eta * eta); }

 private:
  static Eigen::Matrix<Real, 3, 3> reflection(const ConeVector<Real>& a) {
    Eigen::Matrix<Real, 3, 3> S = 2 * a * a.transpose();
    S(0, 0) -= 1;
    S(1, 1) += 1;
    S(2, 2) += 1;
    return S;
  }
};

/// Jordan product of second-order cones and its inverse: solves lambda o u = d.
template <class Real>
ConeVector<Real> jordan(const ConeVector<Real>& a, const ConeVector<Real>& b) {
  return {a.dot(b), a[0] * b[1] + b[0] * a[1], a[0] * b[2] + b[0] * a[2]};
}
template <class Real>
ConeVector<Real> jordan_divide(const ConeVector<Real>& lambda, const ConeVector<Real>& d) {
  const Real dot = lambda[1] * d[1] + lambda[2] * d[2];
  const Real u0 = (lambda[0] * d[0] - dot) / cone_product(lambda);
  return {u0, (d[1] - u0 * lambda[1]) / lambda[0], (d[2] - u0 * lambda[2]) / lambda[0]};
}

/// Three numbers of a contact (n, t1, t2) in these coordinates: impulses in |r_t| <= mu r_n, velocities in its dual.
template <class Real>
ConeVector<Real> in_primal(const Real* r, Real mu) {
  return {mu * r[0], r[1], r[2]};
}
template <class Real>
ConeVector<Real> in_dual(const Real* y, Real mu) {
  return {y[0] / mu, y[1], y[2]};
}

}  // namespace cb
