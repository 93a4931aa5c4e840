// Iterate and Newton steps of the interior point methods for exact Coulomb friction.
//
// With the slip lambda as an unknown of its own the law of a contact (mu > 0) is
//   0 <= r_n _|_ s >= 0,    x = (r_n, r_t / mu),  z = (lambda, z_t) in the second-order cone, x.z = 0,
//   s = u_n,  z_t = u_t                                                                         (1)
// in which nothing but products is not linear: there is no |u_t|. Inside the cones products are r_n s = t and x o z =
// t e, from s = lambda = ten times a contact's part of the size of the event; there lambda = (s + sqrt(s^2 + 4
// |u_t|^2)) / 2: the slip of a contact is smoothed by as much as it is open. What (s, z_t) miss u by falls by 1 - a
// with each step of length a, and stays zero. A step, in Nesterov and Todd's scaling (W z = W^-1 x, H = W^2), with a
// proximal term a of u:
//   dr_n = c_n - (r_n / s) ds,   dx = c - H dz,   dx_0 = dr_n,   (ds, dz_t) = du + a dr - misses,
//   M dv = J^T dr,  du = J dv
// With dlambda eliminated, h = H_t0 / H_00 and S = H_tt - h H_0t, dr = c_r - G (du + a dr) and one system is left,
//   (M + J^T (I + G a)^-1 G J) dv = J^T (I + G a)^-1 c_r,    G = [r_n / s, 0; mu h r_n / s, mu S]
// not symmetric, for friction follows r_n and not the other way. Scalar rows (mu = 0) have r_n and s alone.
//
// Source: (1) is the problem of D. Stewart, J. Trinkle, Int. J. Num. Meth. Eng. 39 (1996), with the cone in place of
// its polygon; L. Vandenberghe, The CVXOPT linear and quadratic cone program solvers (2010), for the scaling.

#include "ncp/interior_system.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "cone/rows.h"
#include "linalg/finite.h"

namespace cb {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

void InteriorSystem::begin(const Options& options, const NcpProblem& p, VelocitySystem& system, NcpMeasure& measure,
                           double size) {
  o_ = options;
  problem_ = &p;
  measure_ = &measure;
  system_ = &system;
  const int nc = p.nc();
  size_ = size / std::sqrt(std::max(1, nc));
  at_.resize(nc);
  share_.resize(nc);
  scaling_.resize(nc);
  for (auto* list : {&misses_, &root_}) list->resize(nc);
  first_.resize(nc);
  for (auto* list : {&r_, &c_, &du_}) list->assign(3 * nc, 0.0);
  G_.resize(9 * nc);
  h_.resize(p.nv());
  for (int c = 0; c < nc; ++c) {
    const double root = std::sqrt(p.weight[c]), first = o_.start * size_;
    share_[c] = std::pow(std::max(1.0, p.mu[c]), -o_.share);
    at_[c] = {{share_[c] * first / root, 0, 0}, {first * root, 0, 0}, first * root};
    r_[3 * c] = at_[c].x[0];
  }
  measure_->velocities(r_, v_, u_);
  look();
}

// Products and misses where the iterate is.
void InteriorSystem::look() {
  const NcpProblem& p = *problem_;
  double sum = 0;
  int count = 0;
  miss_ = 0;
  for (int c = 0; c < p.nc(); ++c) {
    const InteriorPoint3& at = at_[c];
    const bool rough = p.mu[c] > 0;
    sum += (at.x[0] * at.s + (rough ? at.x.dot(at.z) : 0)) / share_[c];
    count += rough ? 2 : 1;
    misses_[c] = {at.s - u_[3 * c], 0, 0};
    if (rough) misses_[c].tail<2>() = at.z.tail<2>() - vec3(&u_[3 * c]).tail<2>();
    miss_ = std::max(miss_, misses_[c].norm() / std::sqrt(p.weight[c]));
  }
  mean_ = sum / std::max(1, count);
}

double InteriorSystem::error() const { return size_ > 0 ? std::max(std::sqrt(mean_), miss_) / size_ : 0; }

// 1/kg: what mu > 1 makes stiffer along the surface gets as much less.
Vector3d InteriorSystem::proximal(int c) const {
  const double a = o_.proximal * problem_->weight[c], a_t = a / std::max(1.0, problem_->mu[c]);
  return {a, a_t, a_t};
}

// Of H = W^2.
InteriorSystem::FirstColumn InteriorSystem::first_column(int c) const {
  const ConeScaling<double>& W = scaling_[c];
  const double top = 2 * W.w[0] * W.w[0] - 1;
  return {W.eta * W.eta * top, 2 * W.w[0] / top * W.w.tail<2>()};
}

bool InteriorSystem::factor() {
  const NcpProblem& p = *problem_;
  for (int c = 0; c < p.nc(); ++c) {
    const InteriorPoint3& at = at_[c];
    const double mu = p.mu[c], g = at.x[0] / at.s;
    Matrix3d G = Matrix3d::Zero();
    G(0, 0) = g;
    if (mu > 0) {
      scaling_[c] = ConeScaling<double>::of(at.x, at.z);
      root_[c] = scaling_[c].apply(at.z);
      const Matrix3d H = scaling_[c].squared();
      const Vector2d h = H.bottomLeftCorner<2, 1>() / H(0, 0);
      G.bottomLeftCorner<2, 1>() = mu * g * h;
      G.bottomRightCorner<2, 2>() = mu * (H.bottomRightCorner<2, 2>() - h * H.topRightCorner<1, 2>());
    }
    first_[c] = (Matrix3d::Identity() + G * proximal(c).asDiagonal()).inverse();
    mat3(&G_[9 * c]).noalias() = first_[c] * G;
  }
  return all_finite(G_) && system_->factor(G_);
}

void InteriorSystem::solve(double target, double products, const InteriorPoints* second,
                           const std::vector<Vector3d>& misses, InteriorPoints& step) {
  const NcpProblem& p = *problem_;
  step.resize(p.nc());
  for (int c = 0; c < p.nc(); ++c) {
    const InteriorPoint3& at = at_[c];
    const double mu = p.mu[c], here = share_[c] * target;
    double c_n = here - products * at.x[0] * at.s;
    if (second) c_n -= (*second)[c].x[0] * (*second)[c].s;
    c_n /= at.s;
    Vector3d cr(c_n, 0, 0);
    if (mu > 0) {
      Vector3d rhs = -products * jordan<double>(root_[c], root_[c]);
      rhs[0] += here;
      if (second) rhs -= jordan<double>(scaling_[c].apply_inverse((*second)[c].x), scaling_[c].apply((*second)[c].z));
      step[c].x = scaling_[c].apply(jordan_divide<double>(root_[c], rhs));
      cr.tail<2>() = mu * (step[c].x.tail<2>() + first_column(c).slope * (c_n - step[c].x[0]));
    }
    vec3(&c_[3 * c]) = first_[c] * cr + mat3(&G_[9 * c]) * misses[c];
  }
  std::fill(h_.begin(), h_.end(), 0.0);
  multiply_transposed_add(*p.J, *p.M, c_, h_);
  system_->solve_in_place(h_);
  multiply(*p.J, *p.M, h_, du_);
  for (int c = 0; c < p.nc(); ++c) {
    InteriorPoint3& to = step[c];
    const double mu = p.mu[c];
    const Vector3d du = vec3(&du_[3 * c]), dr = vec3(&c_[3 * c]) - mat3(&G_[9 * c]) * du;
    const Vector3d moved = du + proximal(c).cwiseProduct(dr) - misses[c];
    to.s = moved[0];
    to.z.setZero();
    if (mu == 0) {
      to.x = {dr[0], 0, 0};
      continue;
    }
    to.z.tail<2>() = moved.tail<2>();
    const FirstColumn H = first_column(c);
    to.z[0] = (to.x[0] - dr[0]) / H.top - H.slope.dot(moved.tail<2>());
    to.x = {dr[0], dr[1] / mu, dr[2] / mu};
  }
}

double InteriorSystem::longest(const InteriorPoints& step) const {
  double part = HUGE_VAL;
  for (int c = 0; c < nc(); ++c) {
    part = std::min({part, ray_step(at_[c].x[0], step[c].x[0]), ray_step(at_[c].s, step[c].s)});
    if (problem_->mu[c] > 0)
      part = std::min({part, cone_step<double>(at_[c].x, step[c].x), cone_step<double>(at_[c].z, step[c].z)});
  }
  return part;
}

double InteriorSystem::inner(const InteriorPoints& a, const InteriorPoints& b, double& largest) const {
  double sum = 0;
  largest = 0;
  for (int c = 0; c < nc(); ++c) {
    const InteriorPoint3& at = at_[c];
    double one = a[c].x[0] * b[c].x[0] / (at.x[0] * at.x[0]) + a[c].s * b[c].s / (at.s * at.s);
    if (problem_->mu[c] > 0) {
      const ConeScaling<double>& W = scaling_[c];
      one += (W.apply_inverse(a[c].x).dot(W.apply_inverse(b[c].x)) + W.apply(a[c].z).dot(W.apply(b[c].z))) /
             at.x.dot(at.z);
    }
    sum += one;
    largest = std::max(largest, one);
  }
  return sum;
}

bool InteriorSystem::move_to(const InteriorPoints& from, double part, const InteriorPoints& step) {
  at_ = from;
  return move(part, step);
}

bool InteriorSystem::move(double part, const InteriorPoints& step) {
  const NcpProblem& p = *problem_;
  for (int c = 0; c < p.nc(); ++c) {
    at_[c].x += part * step[c].x;
    at_[c].z += part * step[c].z;
    at_[c].s += part * step[c].s;
    vec3(&r_[3 * c]) = Vector3d(at_[c].x[0], p.mu[c] * at_[c].x[1], p.mu[c] * at_[c].x[2]);
  }
  if (!all_finite(r_)) return false;
  measure_->velocities(r_, v_, u_);
  look();
  return std::isfinite(mean_) && std::isfinite(miss_);
}

}  // namespace cb
