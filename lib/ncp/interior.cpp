// Interior point steps for exact Coulomb friction.
//
// With cone vectors of each contact, x = (mu r_n, r_t), z = (u_n / mu + |u_t|, u_t) (mu > 0), the law is x, z in the
// second-order cone, x.z = 0. Products x o z = t e are taken to zero along the central path, from x = z = e in the
// event's own scale; z is an iterate of its own and misses its velocities by p = z - z(u). A step, Mehrotra's predictor
// and corrector in Nesterov and Todd's scaling (H = W^2, W z = W^-1 x):
//   dx = c - H dz,   dz = Z du - p,   Z = dz/du,      M dv = J^T dr,  du = J dv
// one system (M + J^T G J) dv = J^T c_r, G = D H Z, D = diag(1/mu, 1, 1): not symmetric, for the slip is in u_n's row.
// |u_t| is smoothed by what goes to zero with the products. Scalar rows (mu = 0) are the half-line.
//
// Source: L. Vandenberghe, The CVXOPT linear and quadratic cone program solvers (2010), for the scaling and the steps;
// De Saxce's term makes it a complementarity problem that is not monotone, and no theorem says that it ends.
// Fails: a system that could not be factored; the caller looks at what error() does.

#include "ncp/interior.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "cone/rows.h"
#include "cone/second_order_cone.h"
#include "linalg/finite.h"
#include "linalg/stop.h"

namespace cb {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

}  // namespace

void InteriorSteps::begin(const NcpProblem& p, VelocitySystem& system, NcpMeasure& measure, double size) {
  problem_ = &p;
  measure_ = &measure;
  system_ = &system;
  const int nc = p.nc();
  size_ = size / std::sqrt(std::max(1, nc));
  for (auto* list : {&x_, &z_, &p_, &dx_, &dz_}) list->assign(nc, Vector3d::Zero());
  for (auto* list : {&H_, &Z_, &first_, &G3_}) list->assign(nc, Matrix3d::Zero());
  r_.assign(3 * nc, 0.0);
  G_.resize(9 * nc);
  c_.resize(3 * nc);
  du_.resize(3 * nc);
  h_.resize(p.nv());
  for (int c = 0; c < nc; ++c) {
    const double root = std::sqrt(p.weight[c]), mu = p.mu[c] > 0 ? p.mu[c] : 1, middle = std::min(1.0, mu);
    x_[c][0] = size_ / root * middle;
    z_[c][0] = size_ * root / middle;
    r_[3 * c] = x_[c][0] / mu;
  }
  theta_ = 1;
  measure_->velocities(r_, v_, u_);
  look(0);
}

// Products, misses and slopes where the iterate is.
void InteriorSteps::look(double smoothing) {
  const NcpProblem& p = *problem_;
  mean_ = miss_ = 0;
  for (int c = 0; c < p.nc(); ++c) mean_ += x_[c].dot(z_[c]) / p.nc();
  for (int c = 0; c < p.nc(); ++c) {
    const double mu = p.mu[c], *u = &u_[3 * c];
    Matrix3d& Z = Z_[c];
    Z.setZero();
    if (mu == 0) {
      Z(0, 0) = 1;
      p_[c] = {z_[c][0] - u[0], 0, 0};
    } else {
      const double soft = smoothing * std::sqrt(p.weight[c] * mean_);
      const double slip = std::sqrt(u[1] * u[1] + u[2] * u[2] + soft * soft);
      Z(0, 0) = 1 / mu;
      Z(1, 1) = Z(2, 2) = 1;
      if (slip > 0) Z(0, 1) = theta_ * u[1] / slip, Z(0, 2) = theta_ * u[2] / slip;
      p_[c] = z_[c] - Vector3d(u[0] / mu + slip - soft, u[1], u[2]);
    }
    miss_ = std::max(miss_, p_[c].norm() * std::min(1.0, mu == 0 ? 1.0 : mu) / std::sqrt(p.weight[c]));
  }
}

double InteriorSteps::error() const {
  return size_ > 0 ? std::max(std::sqrt(mean_ / (size_ * size_)), miss_ / size_) : 0;
}

bool InteriorSteps::factor(const Options& o) {
  const NcpProblem& p = *problem_;
  for (int c = 0; c < p.nc(); ++c) {
    const double mu = p.mu[c], a = o.proximal * p.weight[c];
    Matrix3d G = Matrix3d::Zero();
    if (mu == 0) {
      H_[c].setZero();
      H_[c](0, 0) = x_[c][0] / z_[c][0];
      G = H_[c];
    } else {
      H_[c] = ConeScaling<double>::of(x_[c], z_[c]).squared();
      G = H_[c] * Z_[c];
      G.row(0) /= mu;
    }
    first_[c] = (Matrix3d::Identity() + a * G).inverse();
    G3_[c].noalias() = first_[c] * G;
    mat3(&G_[9 * c]) = G3_[c];
  }
  return all_finite(G_) && system_->factor(G_);
}

// The step towards products of `target`; corrected by the products of the step before it, which is in dx_ and dz_.
void InteriorSteps::solve(double target, bool corrected) {
  const NcpProblem& p = *problem_;
  for (int c = 0; c < p.nc(); ++c) {
    const double mu = p.mu[c];
    Vector3d cx = Vector3d::Zero();
    if (mu == 0) {
      cx[0] = (target - (corrected ? dx_[c][0] * dz_[c][0] : 0)) / z_[c][0] - x_[c][0];
    } else {
      const auto W = ConeScaling<double>::of(x_[c], z_[c]);
      const Vector3d lambda = W.apply(z_[c]);
      Vector3d rhs = -jordan<double>(lambda, lambda);
      rhs[0] += target;
      if (corrected) rhs -= jordan<double>(W.apply_inverse(dx_[c]), W.apply(dz_[c]));
      cx = W.apply(jordan_divide<double>(lambda, rhs));
    }
    Vector3d cr = cx + H_[c] * p_[c];
    if (mu > 0) cr[0] /= mu;
    vec3(&c_[3 * c]) = first_[c] * cr;
    dx_[c] = cx;
  }
  std::fill(h_.begin(), h_.end(), 0.0);
  multiply_transposed_add(*p.J, *p.M, c_, h_);
  system_->solve_in_place(h_);
  multiply(*p.J, *p.M, h_, du_);
  for (int c = 0; c < p.nc(); ++c) {
    const double mu = p.mu[c];
    const Vector3d du = vec3(&du_[3 * c]);
    Vector3d dr = vec3(&c_[3 * c]) - G3_[c] * du;
    dz_[c] = Z_[c] * du - p_[c];
    if (mu == 0) dr.tail<2>().setZero();
    dx_[c] = Vector3d((mu > 0 ? mu : 1) * dr[0], dr[1], dr[2]);
    if (mu == 0) dz_[c].tail<2>().setZero();
  }
}

double InteriorSteps::longest() const {
  double part = HUGE_VAL;
  for (int c = 0; c < problem_->nc(); ++c) {
    if (problem_->mu[c] == 0)
      part = std::min({part, ray_step(x_[c][0], dx_[c][0]), ray_step(z_[c][0], dz_[c][0])});
    else
      part = std::min({part, cone_step<double>(x_[c], dx_[c]), cone_step<double>(z_[c], dz_[c])});
  }
  return part;
}

bool InteriorSteps::step(const Options& o) {
  poll_stop();
  const NcpProblem& p = *problem_;
  if (!factor(o)) return false;
  solve(0, false);
  const double predicted = std::min(1.0, o.fraction * longest());
  const double centring = std::max(o.least_centring, std::pow(1 - predicted, 3));
  solve(centring * mean_, true);
  const double part = std::min(1.0, o.fraction * longest());
  for (int c = 0; c < p.nc(); ++c) {
    x_[c] += part * dx_[c];
    z_[c] += part * dz_[c];
    const double mu = p.mu[c] > 0 ? p.mu[c] : 1;
    vec3(&r_[3 * c]) = Vector3d(x_[c][0] / mu, x_[c][1], x_[c][2]);
  }
  if (!all_finite(r_)) return false;
  measure_->velocities(r_, v_, u_);
  theta_ = part < o.least_part ? 0 : 1;
  look(o.smoothing);
  return std::isfinite(mean_) && std::isfinite(miss_);
}

}  // namespace cb
