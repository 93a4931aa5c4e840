#include "methods/soft_contacts.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "contact/friction_cone.h"
#include "contact/referee.h"

namespace cb {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using ConstVec3 = Eigen::Map<const Vector3d>;

ConstVec3 at(const std::vector<double>& x, int c) { return ConstVec3(&x[3 * static_cast<std::size_t>(c)]); }

/// What an island is about: its fastest contact, (m/s)^2; squares of impulses and velocities, J.
struct Moving {
  double speed = 0, impulse2 = 0, plus2 = 0, minus2 = 0;
};

bool sticks(double mu, const Regularisation& R, double u_n, double slip) { return slip * R.n <= -mu * u_n * R.t; }

// Of P_K.
Matrix3d derivative_of_projection(const Vector3d& z, double mu) {
  const double t = std::hypot(z[1], z[2]);
  if (mu * t <= -z[0]) return Matrix3d::Zero();
  if (mu == 0) return Vector3d(1, 0, 0).asDiagonal();
  if (t <= mu * z[0]) return Matrix3d::Identity();
  const double t1 = z[1] / t, t2 = z[2] / t;
  const Vector3d d(1, mu * t1, mu * t2), across(0, -t2, t1);
  return (d * d.transpose() + mu * (z[0] + mu * t) / t * across * across.transpose()) / (1 + mu * mu);
}

}  // namespace

void SoftContacts::describe(const ContactProblem& problem, const BlockCholesky& factor,
                            const std::vector<double>& weight, const Softness& softness) {
  diagonal_blocks(problem, factor, W_);
  find_islands(problem, islands_);
  contacts_.resize(problem.nc());
  for (int c = 0; c < problem.nc(); ++c)
    contacts_[c] = {regularisation(W_[c], is_limit(problem, c), softness), problem.mu[c], weight[c]};
}

void SoftContacts::begin(const std::vector<double>& u_minus, double touching) {
  touching_.assign(islands_.count, 0.0);
  for (std::size_t i = 0; i < u_minus.size(); ++i) {
    double& fastest = touching_[islands_.of_contact[i / 3]];
    fastest = std::max(fastest, std::abs(u_minus[i]));
  }
  for (double& x : touching_) x *= touching;
}

Vector3d SoftContacts::impulse(const Contact& c, const Vector3d& u) {
  const double mu = c.mu, slip = std::hypot(u[1], u[2]);
  if (u[0] >= mu * slip) return Vector3d::Zero();
  if (mu == 0) return {-u[0] / c.R.n, 0, 0};
  if (sticks(mu, c.R, u[0], slip)) return {-u[0] / c.R.n, -u[1] / c.R.t, -u[2] / c.R.t};
  const double r_n = (mu * slip - u[0]) / (c.R.n + mu * mu * c.R.t), f = -mu * r_n / slip;
  return {r_n, f * u[1], f * u[2]};
}

// -du.dr along du.
double SoftContacts::curvature(const Contact& c, const Vector3d& u, const Vector3d& du) {
  const double mu = c.mu, slip = std::hypot(u[1], u[2]);
  if (u[0] >= mu * slip) return 0;
  if (mu == 0) return du[0] * du[0] / c.R.n;
  if (sticks(mu, c.R, u[0], slip)) return du[0] * du[0] / c.R.n + (du[1] * du[1] + du[2] * du[2]) / c.R.t;
  const double t1 = u[1] / slip, t2 = u[2] / slip, D = c.R.n + mu * mu * c.R.t;
  const double ahead = du[0] - mu * (t1 * du[1] + t2 * du[2]), across = t1 * du[2] - t2 * du[1];
  return (ahead * ahead + mu * (mu * slip - u[0]) / slip * across * across) / D;
}

double SoftContacts::impulses(const std::vector<double>& u, std::vector<double>& r) const {
  double cost = 0;
  r.resize(u.size());
  for (int c = 0; c < static_cast<int>(contacts_.size()); ++c) {
    const Vector3d one = impulse(contacts_[c], at(u, c));
    Eigen::Map<Vector3d>(r.data() + 3 * c) = one;
    const Regularisation& R = contacts_[c].R;
    cost += 0.5 * (R.n * one[0] * one[0] + R.t * one.tail<2>().squaredNorm());
  }
  return cost;
}

// With Pi the derivative of P_K at z = r - (u + R r) / w:
//   (I - Pi + Pi R / w) dr = P_K(z) - r - Pi du / w
void SoftContacts::linearise(const std::vector<double>& u, const std::vector<double>& r, std::vector<double>& G,
                             std::vector<double>& a) const {
  G.resize(3 * u.size());
  a.resize(u.size());
  for (int c = 0; c < static_cast<int>(contacts_.size()); ++c) {
    const Contact& contact = contacts_[c];
    const Vector3d R(contact.R.n, contact.R.t, contact.R.t), y = at(u, c) + R.cwiseProduct(at(r, c));
    Eigen::Map<Matrix3d> G_c(G.data() + 9 * c);
    Eigen::Map<Vector3d> a_c(a.data() + 3 * c);
    if (y.norm() <= touching_[islands_.of_contact[c]]) {
      G_c = Vector3d(1 / R[0], contact.mu > 0 ? 1 / R[1] : 0, contact.mu > 0 ? 1 / R[2] : 0).asDiagonal();
      a_c = impulse(contact, at(u, c));
      continue;
    }
    const Vector3d z = at(r, c) - y / contact.w;
    const Matrix3d Pi = derivative_of_projection(z, contact.mu);
    const Matrix3d A = (Matrix3d::Identity() - Pi + Pi * R.asDiagonal() / contact.w).inverse();
    const Matrix3d G_w = A * Pi / contact.w;
    G_c = 0.5 * (G_w + G_w.transpose());
    a_c = at(r, c) + A * (project_on_cone(z, contact.mu) - at(r, c));
  }
}

Along SoftContacts::along(const std::vector<double>& u, const std::vector<double>& du, double alpha) const {
  Along out;
  for (int c = 0; c < static_cast<int>(contacts_.size()); ++c) {
    const Vector3d direction = at(du, c), there = at(u, c) + alpha * direction;
    out.slope -= impulse(contacts_[c], there).dot(direction);
    out.curvature += curvature(contacts_[c], there, direction);
  }
  return out;
}

void SoftContacts::project(std::vector<double>& r) const {
  for (int c = 0; c < static_cast<int>(contacts_.size()); ++c)
    Eigen::Map<Vector3d>(r.data() + 3 * c) = project_on_cone(at(r, c), contacts_[c].mu);
}

double SoftContacts::residual(const std::vector<double>& r, const std::vector<double>& u_plus,
                              const std::vector<double>& u_minus, std::span<const double> open) const {
  const int nc = static_cast<int>(contacts_.size());
  std::vector<Moving> moving(open.empty() ? 0 : islands_.count);
  for (int c = 0; c < nc && !open.empty(); ++c) {
    const double w = contacts_[c].w;
    const double plus = at(u_plus, c).squaredNorm(), minus = at(u_minus, c).squaredNorm();
    Moving& island = moving[islands_.of_contact[c]];
    island.speed = std::max({island.speed, plus, minus});
    island.impulse2 += w * at(r, c).squaredNorm();
    island.plus2 += plus / w;
    island.minus2 += minus / w;
  }
  double worst = 0;
  for (int c = 0; c < nc; ++c) {
    const Contact& contact = contacts_[c];
    const double w = contact.w;
    const ConstVec3 rc = at(r, c), u = at(u_plus, c), q = at(u_minus, c);
    const Vector3d y = u + Vector3d(contact.R.n, contact.R.t, contact.R.t).cwiseProduct(rc);
    const double error2 = w * (rc - project_on_cone(rc - y / w, contact.mu)).squaredNorm();
    double size2 = std::max({w * rc.squaredNorm(), u.squaredNorm() / w, q.squaredNorm() / w});
    if (!open.empty()) {
      const double floor = open[c] / Referee::accepted;
      const Moving& of = moving[islands_.of_contact[c]];
      const double island = std::max({of.impulse2, of.plus2, of.minus2});
      size2 = std::max({size2, std::min(island, of.speed / w), floor * floor / w});
    }
    if (!(error2 < HUGE_VAL && size2 < HUGE_VAL)) return HUGE_VAL;  // what has overflowed is wrong
    if (!(error2 <= worst * size2)) worst = size2 > 0 ? error2 / size2 : HUGE_VAL;
  }
  return std::sqrt(worst);
}

}  // namespace cb
