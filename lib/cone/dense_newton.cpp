// The program scaled by the contacts' mobilities w_i and the sizes of velocities and impulses, U and R <= U (sqrt J),
// c = R / U:
//   x_i = sqrt(w_i) r_i / R,  e_i = sqrt(w_i) eta_i / U,  W with rows and columns, q with rows over sqrt(w_i),
//   d_i = 1 / sqrt(w_i) where the bound counts the contact, else 0;
//   y = c W x + q / U - W_n e + d s,  a = (W x + q / R)_n,  b = kappa / R - d.x_n     (all three >= 0 in their cones)
// Newton step, G^-1 the inverse of the squared scaling of a contact, c_x.. the right-hand sides of complementarity:
//   [ c W + G^-1 + P   -W_n       d  ] [dx]   [ c_x + y - (c W x + q / U - W_n e + d s) ]
//   [ W_n'             a / e      0  ] [de] = [ c_e + a - (W x + q / R)_n               ]
//   [ -d'              0        b / s] [ds]   [ c_s + b - kappa / R + d.x_n             ]
// Where light bodies lie between heavy ones, or contacts tilt by the last bits of the data, multipliers are 1e6 to 1e9
// of what there is to solve, and 16 digits do not know the rest; 32 do. P is there because impulses are not unique, and
// where friction is strong the middle of the cones is far out.

#include "cone/dense_newton.h"

#include <algorithm>
#include <cmath>

namespace cb {

namespace {

using Real = DoubleDouble;
using Matrix3 = Eigen::Matrix<Real, 3, 3>;

}  // namespace

DenseNewton::DenseNewton(const ConeProgram& program) : p_(program) {
  const int nc = p_.nc();
  form_velocities();
  scale_.resize(nc);
  d_.resize(nc);
  for (int c = 0; c < nc; ++c) {
    scale_[c] = 1 / sqrt(Real((*p_.weight)[c]));
    d_[c] = p_.share_of(c) * scale_[c];
    q_.segment(3 * c, 3) *= scale_[c];
    mean_log_weight_ += std::log((*p_.weight)[c]) / nc;
    if (!slides(c)) q_[3 * c + 1] = q_[3 * c + 2] = 0;  // nothing depends on it
  }
  size_ = q_.norm();
  if (size_ > 0) q_ /= size_;
  const Real impulse = p_.impulse_size * std::exp(mean_log_weight_ / 2);
  if (impulse > 0 && impulse < size_) ratio_ = impulse / size_;
  system_.form(p_, scale_, d_, ratio_, p_.has_eta(), p_.has_bound());
}

// Of the contacts without impulses, m/s; into q_ and rounded_q_.
void DenseNewton::form_velocities() {
  q_.resize(3 * p_.nc());
  rounded_q_.resize(3 * p_.nc());
  for (int c = 0; c < p_.nc(); ++c) {
    Eigen::Matrix<Real, 3, 1> u = Eigen::Map<const Eigen::Vector3d>(&(*p_.offset)[3 * c]).cast<Real>();
    for (int e = p_.J->band[c]; e < p_.J->band[c + 1]; ++e) {
      const int b = p_.J->block[e];
      u += p_.J->entry(e).cast<Real>() *
           Eigen::Map<const Eigen::VectorXd>(&(*p_.v0)[p_.M->first[b]], p_.M->block_size(b)).cast<Real>();
    }
    q_.segment<3>(3 * c) = u;
    for (int i = 0; i < 3; ++i) rounded_q_[3 * c + i] = static_cast<double>(u[i]);
  }
}

void DenseNewton::describe(CentralPath<Real>& path) const {
  const int nc = p_.nc();
  Cones<Real>& cones = path.cones;
  cones.mu.assign(p_.mu->begin(), p_.mu->end());
  cones.d.assign(d_.begin(), d_.end());
  cones.inequality.resize(nc);
  cones.eta = p_.has_eta();
  cones.bound = p_.has_bound();
  cones.kappa = cones.bound ? Real(p_.kappa) / (ratio_ * size_) : Real(0);
  cones.count = nc + (cones.bound ? 1 : 0);
  path.scales.size = 1;
  path.scales.mean_weight = std::exp(mean_log_weight_);
  path.scales.w_r.assign(nc, 1);
  path.scales.w_eta.assign(nc, 1);
  path.a_free.resize(nc);
  for (int c = 0; c < nc; ++c) {
    cones.inequality[c] = p_.bounded_below && !p_.is_fixed(c) ? 1 : 0;
    cones.count += cones.inequality[c];
    path.a_free[c] = q_[3 * c] / ratio_ + p_.slack_of(c) * scale_[c] / (ratio_ * size_);
  }
}

void DenseNewton::slacks(const ConePoint<Real>& at, RealVector<Real>& y, RealVector<Real>& a) {
  velocities(at, y, a);
  y += q_;
  for (int c = 0; c < p_.nc(); ++c) a[c] += q_[3 * c] / ratio_ + p_.slack_of(c) * scale_[c] / (ratio_ * size_);
}

// c W x - W_n e and (W x)_n of a point or a step.
void DenseNewton::velocities(const ConePoint<Real>& at, RealVector<Real>& y, RealVector<Real>& a) {
  const ContactColumns& columns = system_.columns();
  a.setZero(p_.nc());
  load_ = ratio_ * at.r;
  if (p_.has_eta()) {
    columns.momentum(at.r, momentum_);
    columns.velocities(momentum_, u_);
    for (int c = 0; c < p_.nc(); ++c) {
      load_[3 * c] -= at.eta[c];
      a[c] = u_[3 * c];
    }
  }
  columns.momentum(load_, momentum_);
  columns.velocities(momentum_, y);
  for (int c = 0; c < p_.nc(); ++c)
    if (!slides(c)) y[3 * c + 1] = y[3 * c + 2] = 0;
}

bool DenseNewton::factor(const CentralPath<Real>& path) {
  const ConePoint<Real>& x = path.at;
  for (int c = 0; c < p_.nc(); ++c) {
    Matrix3 G = Matrix3::Zero(), G_inverse = Matrix3::Zero();
    if (slides(c)) {
      const Real mu = path.cones.mu[c];
      G_inverse = path.scaling[c].inverse_squared();
      G_inverse.row(0) *= mu;
      G_inverse.col(0) *= mu;
      G = path.scaling[c].squared();
      G.row(0) /= mu;
      G.col(0) /= mu;
    } else {
      G(0, 0) = x.r[3 * c] / x.y[3 * c];
      G_inverse(0, 0) = x.y[3 * c] / x.r[3 * c];
    }
    system_.set(c, G, G_inverse, path.cones.inequality[c] ? x.a[c] / x.eta[c] : Real(0));
  }
  c_r_ = -x.y;
  c_eta_ = -x.a;
  c_s_ = -x.b;
  return system_.factor(path.cones.bound ? x.b / x.s : Real(0));
}

void DenseNewton::add(const CentralPath<Real>& path) {
  for (int c = 0; c < p_.nc(); ++c) {
    const Eigen::Matrix<Real, 3, 1> t = path.second_order.contact.segment<3>(3 * c);
    if (slides(c)) {
      const ConeVector<Real> more = path.scaling[c].apply_inverse(t);
      c_r_.segment<3>(3 * c) += ConeVector<Real>(path.cones.mu[c] * more[0], more[1], more[2]);
    } else {
      c_r_[3 * c] += t[0] / path.at.r[3 * c];
    }
    if (path.cones.inequality[c]) c_eta_[c] += path.second_order.eta[c] / path.at.eta[c];
  }
  c_s_ += path.second_order.b;
}

bool DenseNewton::solve(const CentralPath<Real>& path, ConePoint<Real>& step) {
  const int nc = p_.nc(), at_e = system_.at_e(), at_s = system_.at_s();
  rhs_.resize(system_.unknowns());
  rhs_.head(3 * nc) = c_r_ + path.off.y;
  for (int c = 0; c < nc; ++c)
    if (!slides(c)) rhs_[3 * c + 1] = rhs_[3 * c + 2] = 0;
  if (path.cones.eta) rhs_.segment(at_e, nc) = c_eta_ + path.off.a;
  if (path.cones.bound) rhs_[at_s] = c_s_ + path.off.b;
  system_.solve(rhs_, z_);
  step.r = z_.head(3 * nc);
  if (path.cones.eta) step.eta = z_.segment(at_e, nc);
  step.s = path.cones.bound ? z_[at_s] : Real(0);
  velocities(step, step.y, step.a);
  step.y -= path.off.y;
  step.a -= path.off.a;
  for (int c = 0; c < nc; ++c) {
    step.y[3 * c] += d_[c] * step.s;
    if (!path.cones.inequality[c]) step.a[c] = 0;  // there is no slack
  }
  return true;
}

void DenseNewton::round_off(const ConePoint<Real>& at, ConeSolution& x) const {
  x.r.resize(3 * p_.nc());
  x.eta.resize(p_.nc());
  for (int c = 0; c < p_.nc(); ++c) {
    for (int i = 0; i < 3; ++i) x.r[3 * c + i] = static_cast<double>(at.r[3 * c + i] * scale_[c] * ratio_ * size_);
    x.eta[c] = static_cast<double>(at.eta[c] * scale_[c] * size_);
  }
  x.s = static_cast<double>(at.s * size_);
}

}  // namespace cb
