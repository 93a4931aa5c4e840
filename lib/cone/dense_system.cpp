#include "cone/dense_system.h"

#include <Eigen/LU>

namespace cb {

void DenseSystem::form(const ConeProgram& program, const Vector& scale, const Vector& d, Real ratio, bool below,
                       bool bound) {
  columns_.form(program, scale);
  below_ = below;
  bound_ = bound;
  ratio_ = ratio;
  d_ = d;
  const int nc = columns_.contacts();
  G_inverse_.resize(nc);
  H_.resize(nc);
  E_.setZero(nc);
  D_inverse_.setZero(nc);
}

void DenseSystem::set(int contact, const Matrix3& G, const Matrix3& G_inverse, Real D_inverse) {
  G_inverse_[contact] = G_inverse;
  H_[contact] = (Matrix3::Identity() + Real(proximal) * G).inverse() * G;
  D_inverse_[contact] = D_inverse;
  if (below_) E_[contact] = 1 / (D_inverse + proximal);
}

bool DenseSystem::factor(Real diagonal) {
  const int nv = columns_.rows(), nc = columns_.contacts();
  diagonal_ = diagonal;
  lu_.resize(2 * nv);
  for (int i = 0; i < nv; ++i) {
    lu_.add(i, i, ratio_);
    lu_.add(i, nv + i, -1);
    lu_.add(nv + i, i, 1);
  }
  Matrix3 normal = Matrix3::Zero();
  for (int c = 0; c < nc; ++c) {
    columns_.add_congruence(H_[c], c, nv, nv, lu_);
    normal(0, 0) = E_[c];
    if (below_) columns_.add_congruence(normal, c, 0, 0, lu_);
  }
  if (!lu_.factor()) return false;
  if (!bound_) return true;
  Vector along = Vector::Zero(unknowns());
  for (int c = 0; c < nc; ++c) along[3 * c] = d_[c];
  solve_unbounded(along, response_);
  return true;
}

void DenseSystem::solve(const Vector& rhs, Vector& z) {
  solve_once(rhs, z);
  multiply(z, off_);
  off_ = rhs - off_;
  solve_once(off_, more_);
  z += more_;
}

void DenseSystem::multiply(const Vector& z, Vector& out) {
  const int nc = columns_.contacts();
  x_ = z.head(3 * nc);
  columns_.momentum(x_, first_);
  if (below_) columns_.velocities(first_, u_);
  x_ *= ratio_;
  for (int c = 0; c < nc && below_; ++c) x_[3 * c] -= z[at_e() + c];
  columns_.momentum(x_, first_);
  columns_.velocities(first_, y_);
  out.setZero(unknowns());
  for (int c = 0; c < nc; ++c) {
    const Eigen::Matrix<Real, 3, 1> x = z.segment<3>(3 * c);
    out.segment<3>(3 * c) = G_inverse_[c] * x;
    // Rows that have no scaling (r_t = 0 without friction) are no equations.
    for (int i = 0; i < 3; ++i)
      if (G_inverse_[c](i, i).high > 0) out[3 * c + i] += y_[3 * c + i] + Real(proximal) * x[i];
    if (below_) out[at_e() + c] = u_[3 * c] + (D_inverse_[c] + proximal) * z[at_e() + c];
    if (!bound_) continue;
    out[3 * c] += d_[c] * z[at_s()];
    out[at_s()] -= d_[c] * x[0];
  }
  if (bound_) out[at_s()] += diagonal_ * z[at_s()];
}

// Without the bound's row and column.
void DenseSystem::solve_unbounded(const Vector& rhs, Vector& z) {
  const int nv = columns_.rows(), nc = columns_.contacts();
  x_.resize(3 * nc);
  e_.setZero(3 * nc);
  for (int c = 0; c < nc; ++c) {
    x_.segment<3>(3 * c) = H_[c] * rhs.segment<3>(3 * c);
    if (below_) e_[3 * c] = E_[c] * rhs[at_e() + c];
  }
  columns_.momentum(e_, first_);
  columns_.momentum(x_, second_);
  both_.set_zero(2 * nv);
  for (int i = 0; i < nv; ++i) {
    both_.set(i, first_[i]);
    both_.set(nv + i, second_[i]);
  }
  lu_.solve_in_place(both_);
  for (int i = 0; i < nv; ++i) {
    first_.set(i, both_[i]);
    second_.set(i, both_[nv + i]);
  }
  if (below_) columns_.velocities(first_, u_);
  columns_.velocities(second_, y_);
  z.setZero(unknowns());
  for (int c = 0; c < nc; ++c) {
    const Eigen::Matrix<Real, 3, 1> left = rhs.segment<3>(3 * c) - y_.segment<3>(3 * c);
    z.segment<3>(3 * c) = H_[c] * left;
    if (below_) z[at_e() + c] = E_[c] * (rhs[at_e() + c] - u_[3 * c]);
  }
}

void DenseSystem::solve_once(const Vector& rhs, Vector& z) {
  solve_unbounded(rhs, z);
  if (!bound_) return;
  Real pivot = diagonal_, known = rhs[at_s()];
  for (int c = 0; c < columns_.contacts(); ++c) {
    pivot += d_[c] * response_[3 * c];
    known += d_[c] * z[3 * c];
  }
  const Real ds = known / pivot;
  z -= ds * response_;
  z[at_s()] = ds;
}

}  // namespace cb
