// The frictionless impulses of least sum.
//
// Problem: with a_c = L^-1 N_c^T / sqrt(w_c) the columns of A (M = L L^T), x_c = sqrt(w_c) f_c and q_c over sqrt(w_c):
//   1. frictionless  min 1/2 |A x|^2 + q.x,  x >= 0;      momentum p = A x is unique, x is not
//   2. least sum     min share.x,  A x = p,  x >= 0,      over the contacts that touch: (A' p + q)_c <= touching
// proved by y with A' y <= share, = share where x > 0 (z = L^-T y). Both are
//   min 1/(2 sigma) |A x - b|^2 + c.x,  x >= 0:    sigma nu = A x - b,   a = A' nu + c >= 0,   x a = 0
// with (sigma, b, c) = (1, 0, q), and (`shift`, p, share), where y = -nu.
// Source: primal-dual interior point method with predictor and corrector: S. Mehrotra, On the implementation of a
// primal-dual interior point method, SIAM Journal on Optimization 2, 1992. The Newton step is one system in nu,
//   (sigma + A X a^-1 A') dnu = -(sigma nu - A x + b) + A a^-1 (r + x (a - A' nu - c)),   r: what x a should change by
// Differences: in long double, and sigma > 0 in the linear program, so that rows may depend on each other: a guess of
// an active set (a vertex) fails exactly there.
// Fails: where rounding ends it before `accepted`.

#include "methods/least_sum.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "linalg/stop.h"

namespace cb {

bool LeastSum::solve(const BlockDiagonalMatrix& M, const BandMatrix& J, const BlockCholesky& factor,
                     std::span<const double> weight, std::span<const double> q, std::span<const double> share,
                     double touching, std::span<double> f, std::span<double> z) {
  const int nc = J.bands();
  if (nc == 0 || nc > dense_limit) return false;
  assemble(M, J, factor, weight);
  Vector c(nc);
  Real mean_root = 0;
  for (int i = 0; i < nc; ++i) {
    c[i] = Real(q[3 * i]) / std::sqrt(Real(weight[i]));
    mean_root += std::sqrt(Real(weight[i])) / nc;
  }
  const Real size = c.norm();
  if (size == 0) return false;
  c /= size;
  A_ = columns_;
  if (!minimise(1, Vector::Zero(A_.rows()), c)) return false;

  std::vector<int> touch;
  const Vector u = A_.transpose() * (A_ * x_) + c;
  for (int i = 0; i < nc; ++i)
    if (size * u[i] <= touching) touch.push_back(i);
  std::fill(f.begin(), f.end(), 0.0);
  std::fill(z.begin(), z.end(), 0.0);
  if (touch.empty()) return true;
  A_ = columns_(Eigen::all, touch);
  // In units of the largest impulse: light bodies between heavy ones take far more than their velocities say.
  const Real unit = std::max<Real>(1, x_.maxCoeff());
  const Vector p = A_ * Vector(x_(touch)) / unit;
  c.resize(static_cast<Eigen::Index>(touch.size()));
  for (std::size_t k = 0; k < touch.size(); ++k)
    c[static_cast<Eigen::Index>(k)] = mean_root * share[touch[k]] / std::sqrt(Real(weight[touch[k]]));
  if (!minimise(shift / unit, p, c)) return false;
  for (std::size_t k = 0; k < touch.size(); ++k)
    f[touch[k]] =
        static_cast<double>(size * unit * x_[static_cast<Eigen::Index>(k)] / std::sqrt(Real(weight[touch[k]])));
  for (Eigen::Index i = 0; i < nu_.size(); ++i)
    z[static_cast<std::size_t>(i)] = static_cast<double>(-nu_[i] / mean_root);
  factor.solve_upper_in_place(z);
  return true;
}

void LeastSum::assemble(const BlockDiagonalMatrix& M, const BandMatrix& J, const BlockCholesky& factor,
                        std::span<const double> weight) {
  rows_.setZero(M.order(), J.bands());
  for (int c = 0; c < J.bands(); ++c)
    for (int e = J.band[c]; e < J.band[c + 1]; ++e)
      rows_.block(M.first[J.block[e]], c, J.entry(e).cols(), 1) =
          J.entry(e).topRows(1).transpose() / std::sqrt(weight[c]);
  for (int b = 0; b < M.blocks(); ++b) factor.solve_lower_in_place(b, rows_, M.first[b]);
  columns_ = rows_.cast<Real>();
}

bool LeastSum::minimise(Real sigma, const Vector& b, const Vector& c) {
  const Eigen::Index n = A_.cols(), rows = A_.rows();
  x_ = Vector::Ones(n);
  a_ = c.cwiseMax(Real(1));
  nu_ = Vector::Zero(A_.rows());
  Vector best_x, best_nu;
  Real best = HUGE_VALL;
  int since_best = 0;
  for (int k = 0; k < iteration_limit; ++k) {
    poll_stop();
    const Real merit = residuals(sigma, b, c);
    if (!std::isfinite(merit)) break;
    since_best = merit < best ? 0 : since_best + 1;
    if (merit < best) {
      best = merit;
      best_x = x_;
      best_nu = nu_;
    }
    if (merit <= rounding || (best <= accepted && since_best > patience)) break;
    K_.resize(n + rows, n + rows);
    const Vector larger = x_.cwiseMax(a_);
    K_.topLeftCorner(n, n) = ((a_ + proximal * x_).cwiseQuotient(larger)).asDiagonal();
    K_.topRightCorner(n, rows) = x_.cwiseQuotient(larger).asDiagonal() * A_.transpose();
    K_.bottomLeftCorner(rows, n) = -A_;
    K_.bottomRightCorner(rows, rows) = sigma * Matrix::Identity(rows, rows);
    const Eigen::PartialPivLU<Matrix> factor(K_);
    const Vector products = x_.cwiseProduct(a_);
    const auto step = [&](const Vector& change) {
      Vector rhs(n + rows);
      rhs << (change + x_.cwiseProduct(off_a_)).cwiseQuotient(larger), -off_nu_;
      Vector y = factor.solve(rhs);
      y += factor.solve(rhs - K_ * y);
      dx_ = y.head(n);
      dnu_ = y.tail(rows);
      da_ = A_.transpose() * dnu_ - off_a_;
    };
    step(-products);
    const Real affine = std::min<Real>(1, longest());
    const Real centre = (1 - affine) * (1 - affine) * (1 - affine) * products.sum() / Real(n);
    step((-products - dx_.cwiseProduct(da_)).array() + centre);
    const Real alpha = std::min<Real>(1, Real(0.98) * longest());
    x_ += alpha * dx_;
    a_ += alpha * da_;
    nu_ += alpha * dnu_;
  }
  if (!(best <= accepted)) return false;
  x_ = best_x;
  nu_ = best_nu;
  return true;
}

// Of the equations, into off_nu_ and off_a_; returns the largest, or the complementarity.
LeastSum::Real LeastSum::residuals(Real sigma, const Vector& b, const Vector& c) {
  off_nu_ = sigma * nu_ - A_ * x_ + b;
  off_a_ = a_ - A_.transpose() * nu_ - c;
  return std::max({x_.dot(a_), off_nu_.lpNorm<Eigen::Infinity>(), off_a_.lpNorm<Eigen::Infinity>()});
}

// Largest step that keeps x and a >= 0.
LeastSum::Real LeastSum::longest() const {
  Real alpha = HUGE_VALL;
  for (Eigen::Index i = 0; i < x_.size(); ++i) {
    if (dx_[i] < 0) alpha = std::min(alpha, -x_[i] / dx_[i]);
    if (da_[i] < 0) alpha = std::min(alpha, -a_[i] / da_[i]);
  }
  return alpha;
}

}  // namespace cb
