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
// Differences: in DoubleDouble, and sigma > 0 in the linear program, so that rows may depend on each other: a guess of
// an active set (a vertex) fails exactly there.
// Fails: where rounding ends it before `accepted`.

#include "methods/least_sum.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "linalg/stop.h"

namespace cb {

bool LeastSum::solve(const BlockDiagonalMatrix& M, const BandMatrix& J, const BlockCholesky& factor,
                     std::span<const double> weight, std::span<const double> q, std::span<const double> share,
                     double touching, std::span<double> f, std::span<double> z) {
  const int nc = J.bands();
  if (nc == 0 || nc > dense_limit) return false;
  Vector root(nc), c(nc);
  Real mean_root = 0;
  for (int i = 0; i < nc; ++i) {
    root[i] = sqrt(Real(weight[i]));
    c[i] = Real(q[3 * i]) / root[i];
    mean_root += root[i] / nc;
  }
  ConeProgram program;
  program.M = &M;
  program.J = &J;
  columns_.form(program, root.cwiseInverse());
  const Real size = sqrt(c.dot(c));
  if (size == 0) return false;
  c /= size;
  part_.resize(nc);
  std::iota(part_.begin(), part_.end(), 0);
  if (!minimise(1, DoubleDoubleVector(M.order()), c)) return false;

  Vector u;
  momentum(x_, p_);
  normals(p_, u);
  std::vector<int> touch;
  for (int i = 0; i < nc; ++i)
    if (size * (u[i] + c[i]) <= touching) touch.push_back(i);
  std::fill(f.begin(), f.end(), 0.0);
  std::fill(z.begin(), z.end(), 0.0);
  if (touch.empty()) return true;
  // In units of the largest impulse: light bodies between heavy ones take far more than their velocities say.
  const Real unit = std::max<Real>(1, x_.maxCoeff());
  part_ = touch;
  const Vector carried = x_(touch) / unit;
  DoubleDoubleVector p;
  momentum(carried, p);
  c.resize(static_cast<Eigen::Index>(touch.size()));
  for (std::size_t k = 0; k < touch.size(); ++k) c[k] = mean_root * share[touch[k]] / root[touch[k]];
  if (!minimise(shift / unit, p, c)) return false;
  for (std::size_t k = 0; k < touch.size(); ++k)
    f[touch[k]] = static_cast<double>(size * unit * x_[k] / root[touch[k]]);
  for (int i = 0; i < nu_.size(); ++i) z[i] = static_cast<double>(-nu_[i] / mean_root);
  factor.solve_upper_in_place(z);
  return true;
}

bool LeastSum::minimise(Real sigma, const DoubleDoubleVector& b, const Vector& c) {
  Real best = HUGE_VAL;
  for (const double centre : centres) {
    follow(sigma, b, c, centre, best);
    if (best <= enough) break;
  }
  if (!(best <= accepted)) return false;
  x_ = best_x_;
  nu_ = best_nu_;
  return true;
}

// From the middle to the end of the path; the best point met of all is kept, with its merit.
void LeastSum::follow(Real sigma, const DoubleDoubleVector& b, const Vector& c, double least_centre, Real& best) {
  x_ = Vector::Ones(c.size());
  a_ = c.cwiseMax(Real(1));
  nu_.set_zero(columns_.rows());
  Real least = HUGE_VAL;
  int since_least = 0;
  for (int k = 0; k < iteration_limit; ++k) {
    poll_stop();
    const Real merit = residuals(sigma, b, c);
    if (!isfinite(merit)) return;
    if (merit < best) {
      best = merit;
      best_x_ = x_;
      best_nu_ = nu_;
    }
    since_least = merit < least ? 0 : since_least + 1;
    least = std::min(least, merit);
    if (merit <= rounding || (least <= accepted && since_least > patience)) return;
    if (!factor(sigma)) return;
    const Vector products = x_.cwiseProduct(a_);
    step(sigma, -products);
    const Real affine = std::min<Real>(1, longest());
    const Real centre = std::max<Real>(least_centre, (1 - affine) * (1 - affine) * (1 - affine)) * products.sum() /
                        static_cast<double>(c.size());
    step(sigma, (-products - dx_.cwiseProduct(da_)).array() + centre);
    const Real alpha = std::min<Real>(1, 0.98 * longest());
    x_ += alpha * dx_;
    a_ += alpha * da_;
    for (int i = 0; i < nu_.size(); ++i) nu_.set(i, nu_[i] + alpha * dnu_[i]);
  }
}

// Of the equations, into off_nu_ and off_a_; returns the complementarity, or the largest of them where that counts.
LeastSum::Real LeastSum::residuals(Real sigma, const DoubleDoubleVector& b, const Vector& c) {
  momentum(x_, p_);
  off_nu_.set_zero(p_.size());
  Real worst = 0;
  for (int i = 0; i < p_.size(); ++i) {
    off_nu_.set(i, sigma * nu_[i] - p_[i] + b[i]);
    worst = std::max(worst, abs(off_nu_[i]));
  }
  normals(nu_, off_a_);
  off_a_ = a_ - off_a_ - c;
  for (const Real& off : off_a_) worst = std::max(worst, abs(off));
  const Real products = x_.dot(a_);
  return worst > negligible ? std::max(worst, products) : products;
}

bool LeastSum::factor(Real sigma) {
  const int rows = columns_.rows();
  lu_.resize(rows);
  for (int i = 0; i < rows; ++i) lu_.add(i, i, sigma);
  D_ = x_.cwiseQuotient(a_ + proximal(sigma) * x_);
  Eigen::Matrix<Real, 3, 3> normal = Eigen::Matrix<Real, 3, 3>::Zero();
  for (std::size_t k = 0; k < part_.size(); ++k) {
    normal(0, 0) = D_[k];
    columns_.add_congruence(normal, part_[k], 0, 0, lu_);
  }
  return lu_.factor();
}

// dx, da, dnu by which x a changes by `change` and the equations come to hold. With one refinement.
void LeastSum::step(Real sigma, const Vector& change) {
  dx_ = (change + x_.cwiseProduct(off_a_)).cwiseQuotient(a_ + proximal(sigma) * x_);
  dnu_.set_zero(columns_.rows());
  for (int k = 0; k < 2; ++k) {
    momentum(dx_, p_);
    for (int i = 0; i < p_.size(); ++i) p_.set(i, p_[i] - sigma * dnu_[i] - off_nu_[i]);
    lu_.solve_in_place(p_);
    normals(p_, u_);
    dx_ -= D_.cwiseProduct(u_);
    for (int i = 0; i < p_.size(); ++i) dnu_.set(i, dnu_[i] + p_[i]);
  }
  normals(dnu_, da_);
  da_ -= off_a_;
}

// A x and A' p, of the contacts that take part.
void LeastSum::momentum(const Vector& x, DoubleDoubleVector& p) {
  all_ = Vector::Zero(3 * columns_.contacts());
  for (std::size_t k = 0; k < part_.size(); ++k) all_[3 * part_[k]] = x[k];
  columns_.momentum(all_, p);
}
void LeastSum::normals(const DoubleDoubleVector& p, Vector& u) {
  columns_.velocities(p, all_);
  u.resize(static_cast<Eigen::Index>(part_.size()));
  for (std::size_t k = 0; k < part_.size(); ++k) u[k] = all_[3 * part_[k]];
}

// Largest step that keeps x and a >= 0.
LeastSum::Real LeastSum::longest() const {
  Real alpha = HUGE_VAL;
  for (Eigen::Index i = 0; i < x_.size(); ++i) {
    if (dx_[i] < 0) alpha = std::min<Real>(alpha, -x_[i] / dx_[i]);
    if (da_[i] < 0) alpha = std::min<Real>(alpha, -a_[i] / da_[i]);
  }
  return alpha;
}

}  // namespace cb
