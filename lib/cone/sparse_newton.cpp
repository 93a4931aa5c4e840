// The Newton steps of the interior point method: with G the squared Nesterov-Todd scaling of a contact (G y = r),
//   dr = -r - G dy + W t,   dy = J dw + d ds - off_y,    t: second order, lambda \ (centre - dr o dy)
//   deta = -eta - D da,     da = N dv - off_a,           D = eta / a
//   ds = -s - (s / b) db,   db = -off_b - d.dr           <=>   d.dr = b - off_b + (b / s) ds
// and a proximal term on dr and deta: (G^-1 + P)^-1 = (1 + G P)^-1 G for G, which bounds its largest eigenvalue.

#include "cone/sparse_newton.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "cone/rows.h"

namespace cb {

using Eigen::Matrix3d;
using Eigen::Vector3d;

void SparseNewton::describe(CentralPath<double>& path) const {
  const int nc = p_.nc();
  Cones<double>& cones = path.cones;
  cones.mu.assign(p_.mu->begin(), p_.mu->end());
  cones.d.resize(nc);
  cones.inequality.resize(nc);
  cones.eta = p_.has_eta();
  cones.bound = p_.has_bound();
  cones.kappa = cones.bound ? p_.kappa : 0;
  cones.count = nc + (cones.bound ? 1 : 0);
  path.scales = w_.scales;
  path.a_free.resize(nc);
  for (int c = 0; c < nc; ++c) {
    cones.d[c] = p_.share_of(c);
    cones.inequality[c] = p_.bounded_below && !p_.is_fixed(c) ? 1 : 0;
    cones.count += cones.inequality[c];
    path.a_free[c] = w_.q[3 * c] + p_.slack_of(c);
  }
  damping_.resize(9 * nc);
}

void SparseNewton::slacks(const ConePoint<double>& at, RealVector<double>& y, RealVector<double>& a) {
  const std::span<const double> r(at.r.data(), at.r.size()), eta(at.eta.data(), at.eta.size());
  velocities_.evaluate(p_, r, p_.has_eta() ? eta : std::span<const double>());
  y = Eigen::Map<const Eigen::VectorXd>(velocities_.u_hat.data(), 3 * p_.nc());
  for (int c = 0; c < p_.nc(); ++c) a[c] = velocities_.u[3 * c] + p_.slack_of(c);
}

bool SparseNewton::factor(const CentralPath<double>& path) {
  for (int c = 0; c < p_.nc(); ++c) {
    linearise_contact(path, c);
    if (p_.has_eta()) linearise_multiplier(path, c);
  }
  border_rhs_ = path.at.b - path.off.b;
  return w_.newton.factor();
}

void SparseNewton::linearise_contact(const CentralPath<double>& path, int c) {
  const double mu = path.cones.mu[c], delta = options_.regularisation;
  const double *r = &path.at.r[3 * c], *y = &path.at.y[3 * c];
  auto G = mat3(&w_.newton.G[9 * c]);
  if (mu == 0) {
    G.setZero();
    G(0, 0) = r[0] / y[0];
  } else {
    G = path.scaling[c].squared();
    G.row(0) /= mu;
    G.col(0) /= mu;
  }
  // Where friction is strong y_t is multiplied by mu in the certificate, so that P is smaller along the tangents.
  const double along = mu > 1 ? std::pow(mu, -options_.tangent_exponent) : 1;
  Matrix3d damping = delta * path.scales.w_r[c] * G;
  damping.rightCols<2>() *= along;
  damping.diagonal().array() += 1;
  damping = damping.inverse().eval();
  const Vector3d off = vec3(&path.off.y[3 * c]);
  vec3(&w_.newton.c_r[3 * c]) = damping * (-vec3(r) + G * off);
  mat3(&damping_[9 * c]) = damping;
  G = (damping * G).eval();
}

void SparseNewton::linearise_multiplier(const CentralPath<double>& path, int c) {
  const double eta = path.at.eta[c];
  if (p_.is_fixed(c)) {
    w_.newton.D[c] = 1 / (options_.proximal * path.scales.w_eta[c]);
    w_.newton.c_eta[c] = -w_.newton.D[c] * -path.off.a[c];
  } else {
    const double D = eta / path.at.a[c], damp = 1 / (1 + options_.regularisation * path.scales.w_eta[c] * D);
    w_.newton.D[c] = D * damp;
    w_.newton.c_eta[c] = (-eta + D * path.off.a[c]) * damp;
  }
}

void SparseNewton::add(const CentralPath<double>& path) {
  for (int c = 0; c < p_.nc(); ++c) {
    const double mu = path.cones.mu[c];
    auto aim = vec3(&w_.newton.c_r[3 * c]);
    if (mu == 0) {
      aim[0] += damping_[9 * c] * path.second_order.contact[3 * c] / path.at.y[3 * c];
    } else {
      const Vector3d correction = path.scaling[c].apply(vec3(&path.second_order.contact[3 * c]));
      aim += mat3(&damping_[9 * c]) * Vector3d(correction[0] / mu, correction[1], correction[2]);
    }
    if (!path.cones.inequality[c]) continue;
    const double a = path.at.a[c], damp = 1 + options_.regularisation * path.scales.w_eta[c] * path.at.eta[c] / a;
    w_.newton.c_eta[c] += path.second_order.eta[c] / a / damp;
  }
  border_rhs_ -= path.second_order.b;
}

bool SparseNewton::solve(const CentralPath<double>& path, ConePoint<double>& step) {
  const NewtonSystem& newton = w_.newton;
  const int nc = p_.nc();
  if (!p_.has_bound())
    w_.newton.solve(0);
  else if (!w_.newton.solve_bordered(path.at.b / path.at.s, border_rhs_))
    return false;
  step.r = Eigen::Map<const Eigen::VectorXd>(newton.dr.data(), 3 * nc);
  step.eta = Eigen::Map<const Eigen::VectorXd>(newton.deta.data(), nc);
  step.s = newton.ds;
  // Term by term: the slacks may be far smaller than the velocities that they are the difference of.
  for (int c = 0; c < nc; ++c) {
    vec3(&step.y[3 * c]) = vec3(&newton.J_dw[3 * c]) - vec3(&path.at.y[3 * c]) + vec3(&velocities_.u_hat[3 * c]) +
                           (step.s + path.at.s) * vec3(&newton.d[3 * c]);
    step.a[c] = path.cones.inequality[c] ? newton.N_dv[c] - (path.at.a[c] - velocities_.u[3 * c] - p_.slack_of(c)) : 0;
  }
  return true;
}

}  // namespace cb
