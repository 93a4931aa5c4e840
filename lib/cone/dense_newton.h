#pragma once

#include <vector>

#include "cone/central_path.h"
#include "cone/dense_system.h"

namespace cb {

/// The linear systems of the interior point method in DoubleDouble: dense, in scaled units (dense_newton.cpp), for
/// small programs whose masses or friction coefficients differ by so many decades that the sparse method ends far off.
class DenseNewton {
 public:
  using Real = DoubleDouble;

  explicit DenseNewton(const ConeProgram& program);

  /// Fills cones, scales and a_free of `path`.
  void describe(CentralPath<Real>& path) const;
  /// As SparseNewton's.
  void slacks(const ConePoint<Real>& at, RealVector<Real>& y, RealVector<Real>& a);
  bool factor(const CentralPath<Real>& path);
  void add(const CentralPath<Real>& path);
  bool solve(const CentralPath<Real>& path, ConePoint<Real>& step);

  /// r, eta and s of a point, rounded to doubles, in the program's units.
  void round_off(const ConePoint<Real>& at, ConeSolution& x) const;
  /// J v0 + w, 3 nc, rounded.
  const std::vector<double>& q() const { return rounded_q_; }
  /// U, sqrt(J).
  double size() const { return static_cast<double>(size_); }

 private:
  void form_velocities();
  void velocities(const ConePoint<Real>& at, RealVector<Real>& y, RealVector<Real>& a);
  bool slides(int c) const { return (*p_.mu)[c] > 0; }

  const ConeProgram& p_;
  DenseSystem system_;
  RealVector<Real> q_, scale_, d_;  // q over U; scale: 1 / sqrt(w_i); d as said
  double mean_log_weight_ = 0;      // scale = exp(-half of it), in the geometric mean
  Real size_ = 0, ratio_ = 1;       // U, R / U
  std::vector<double> rounded_q_;
  // Right-hand sides of complementarity, in units of y, a and b.
  RealVector<Real> c_r_, c_eta_, rhs_, z_, u_, load_;
  Real c_s_ = 0;
  DoubleDoubleVector momentum_;
};

}  // namespace cb
