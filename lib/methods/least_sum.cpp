// The frictionless impulses of least sum.
//
// Problem: with x = L^T (v - v-), a_c = L^-1 N_c^T / sqrt(w_c) and q_c over sqrt(w_c),
//   min 1/2 |x|^2,  a_c.x + q_c >= 0;   x = sum f_c a_c, f >= 0;   of all such f that of least share.f,
// proved by y with a_c.y <= share_c where a_c.x + q_c = 0, and = share_c where f_c > 0 (z = L^-T y).
// Source: 1. x and one f: D. Goldfarb, A. Idnani, A numerically stable dual method for solving strictly convex
// quadratic programs, Mathematical Programming 27, 1983. 2. from that vertex the simplex method on sum f_c a_c = x.
// Differences: a row that depends on those that carry up to `dependent` never joins them, it takes the place of one.
// Fails: where the rounds are used up (cycles of rounding).

#include "methods/least_sum.h"

#include <Eigen/QR>
#include <cmath>
#include <limits>

namespace cb {

bool LeastSum::solve(const BlockDiagonalMatrix& M, const BandMatrix& J, const BlockCholesky& factor,
                     std::span<const double> weight, std::span<const double> q, std::span<const double> share,
                     std::span<double> f, std::span<double> z) {
  const int nc = J.bands(), nv = M.order();
  if (nc == 0 || nc > dense_limit) return false;
  A_.setZero(nv, nc);
  q_.resize(nc);
  share_.resize(nc);
  for (int c = 0; c < nc; ++c) {
    const double scale = 1 / std::sqrt(weight[c]);
    for (int e = J.band[c]; e < J.band[c + 1]; ++e)
      A_.block(M.first[J.block[e]], c, J.entry(e).cols(), 1) = scale * J.entry(e).topRows(1).transpose();
    q_[c] = scale * q[3 * c];
    share_[c] = scale * share[c];
  }
  for (int b = 0; b < M.blocks(); ++b) factor.solve_lower_in_place(b, A_, M.first[b]);
  size_ = q_.norm();
  x_.setZero(nv);
  carry_.clear();
  f_.resize(0);
  rounds_ = 20 * nc;
  if (!carry() || !descend()) return false;
  const Eigen::VectorXd y = stop(share_);
  std::fill(f.begin(), f.end(), 0.0);
  for (std::size_t k = 0; k < carry_.size(); ++k)
    f[carry_[k]] = std::max(0.0, f_[static_cast<Eigen::Index>(k)]) / std::sqrt(weight[carry_[k]]);
  std::copy(y.begin(), y.end(), z.begin());
  factor.solve_upper_in_place(z);
  return true;
}

void LeastSum::factorise() {
  const auto n = static_cast<Eigen::Index>(carry_.size());
  if (n == 0) {
    Q_.resize(A_.rows(), 0);
    R_.resize(0, 0);
    return;
  }
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(A_(Eigen::all, carry_));
  Q_ = qr.householderQ() * Eigen::MatrixXd::Identity(A_.rows(), n);
  R_ = qr.matrixQR().topRows(n).triangularView<Eigen::Upper>();
}

// d with A d the part of a vector in the span of the rows that carry.
Eigen::VectorXd LeastSum::shares(const Eigen::VectorXd& row) const {
  return R_.triangularView<Eigen::Upper>().solve(Q_.transpose() * row);
}

// The least y with a_c.y = target_c where contacts carry.
Eigen::VectorXd LeastSum::stop(const Eigen::VectorXd& target) const {
  const Eigen::VectorXd part = target(carry_);
  return Q_ * R_.transpose().triangularView<Eigen::Lower>().solve(part);
}

void LeastSum::enter(int contact) {
  carry_.push_back(contact);
  f_.conservativeResize(f_.size() + 1);
  f_[f_.size() - 1] = 0;
  factorise();
}

// Takes f -= step direction with the longest step <= `longest` that leaves f >= 0. Did one reach zero first? It goes.
bool LeastSum::drop_first(const Eigen::VectorXd& direction, double longest, double& step) {
  Eigen::Index first = -1;
  step = longest;
  for (Eigen::Index k = 0; k < direction.size(); ++k)
    if (direction[k] > dependent * 1e-3 && std::max(f_[k], 0.0) / direction[k] < step) {
      step = std::max(f_[k], 0.0) / direction[k];
      first = k;
    }
  if (!std::isfinite(step)) return false;
  f_ -= step * direction;
  if (first < 0) return false;
  carry_.erase(carry_.begin() + first);
  Eigen::VectorXd rest(f_.size() - 1);
  rest << f_.head(first), f_.tail(f_.size() - 1 - first);
  f_ = rest;
  factorise();
  return true;
}

// Goldfarb and Idnani: the contact that sinks most gets an impulse until it does not; what would pull meanwhile goes.
bool LeastSum::carry() {
  factorise();
  while (rounds_-- > 0) {
    const Eigen::VectorXd u = A_.transpose() * x_ + q_;
    Eigen::Index sinks;
    if (u.minCoeff(&sinks) >= -kept * size_) return true;
    const Eigen::VectorXd row = A_.col(sinks);
    for (bool dropped = true; dropped && rounds_-- > 0;) {
      const Eigen::VectorXd direction = shares(row);
      const Eigen::VectorXd outside = row - Q_ * (Q_.transpose() * row);
      const double square = outside.squaredNorm();
      const bool independent = square > dependent * dependent * row.squaredNorm();
      const double needed = -(row.dot(x_) + q_[sinks]) / square;
      double step;
      dropped = drop_first(direction, independent ? needed : std::numeric_limits<double>::infinity(), step);
      if (!std::isfinite(step)) return false;
      if (independent) x_ += step * outside;
    }
    enter(static_cast<int>(sinks));
    // Afresh: rounding of the steps does not add up.
    x_ = stop(-q_);
    f_ = shares(x_);
  }
  return false;
}

// The simplex method: a contact that touches and has a_c.y > share_c makes the sum smaller by its impulse.
bool LeastSum::descend() {
  while (rounds_-- > 0) {
    const Eigen::VectorXd u = A_.transpose() * x_ + q_;
    Eigen::VectorXd excess = A_.transpose() * stop(share_) - share_;
    for (Eigen::Index c = 0; c < excess.size(); ++c)
      if (u[c] > kept * size_) excess[c] = 0;
    for (const int c : carry_) excess[c] = 0;
    Eigen::Index best;
    if (excess.maxCoeff(&best) <= kept * share_.lpNorm<Eigen::Infinity>()) return true;
    const Eigen::VectorXd row = A_.col(best);
    const Eigen::VectorXd direction = shares(row);
    if ((row - Q_ * (Q_.transpose() * row)).norm() > dependent * row.norm()) {
      enter(static_cast<int>(best));  // without impulse: y changes, f does not
      continue;
    }
    double step;
    if (!drop_first(direction, std::numeric_limits<double>::infinity(), step)) return false;
    enter(static_cast<int>(best));
    f_[f_.size() - 1] = step;
  }
  return false;
}

}  // namespace cb
