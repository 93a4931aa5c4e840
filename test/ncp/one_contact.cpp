// One contact: three unknowns, answers by hand, and problems built backwards from a known answer.

#include "ncp/one_contact.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "ncp/ncp.h"

using namespace cb;
using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

Matrix3d round_matrix(double W_n, double w) { return Vector3d(W_n, w, w).asDiagonal(); }

double error(const OneContact& c, const Vector3d& q, const Vector3d& r) {
  const Vector3d u = c.W() * r + q;
  Vector3d e;
  natural_map(r.data(), u.data(), c.mu(), c.W().trace() / 3, e.data());
  return e.norm() / (1 + r.norm());
}

/// Random symmetric positive definite W, its principal values between 0.1 and 10.
Matrix3d random_matrix(std::mt19937& random) {
  std::uniform_real_distribution<double> unit(-1, 1);
  Matrix3d A;
  for (int i = 0; i < 9; ++i) A.data()[i] = unit(random);
  return A * A.transpose() + 0.1 * Matrix3d::Identity();
}

}  // namespace

TEST_CASE("a contact that parts carries nothing, one that comes slowly sticks, a fast one slips against its velocity") {
  // W = diag(2, 5, 5): r_n = -q_n / 2, and friction stops q_t where |q_t| / 5 <= mu r_n.
  CHECK(OneContact(round_matrix(2, 5), 0.5).solve({1, 3, 4}) == Vector3d::Zero());
  const Vector3d sticks = OneContact(round_matrix(2, 5), 0.5).solve({-4, 0.3, -0.4});
  CHECK((sticks - Vector3d(2, -0.06, 0.08)).norm() < 1e-15);
  const Vector3d slips = OneContact(round_matrix(2, 5), 0.5).solve({-4, 30, -40});
  CHECK((slips - Vector3d(2, -0.6, 0.8)).norm() < 1e-14);  // mu r_n = 1 against (0.6, -0.8)
  CHECK(OneContact(round_matrix(2, 5), 0).solve({-4, 30, -40}) == Vector3d(2, 0, 0));
}

TEST_CASE("a slipping impulse from which the velocity was made is found again, however W couples") {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int k = 0; k < 1000; ++k) {
    const Matrix3d W = random_matrix(random);
    const OneContact c(W, 0.05 + 0.5 * unit(random));
    const double turn = 2 * M_PI * unit(random), r_n = 0.1 + unit(random);
    const Vector3d r(r_n, c.mu() * r_n * std::cos(turn), c.mu() * r_n * std::sin(turn));
    const double slip = unit(random);
    const Vector3d q = Vector3d(0, -slip * r[1], -slip * r[2]) - W * r, answer = c.solve(q);
    INFO(k);
    CHECK(error(c, q, answer) < 1e-12);
    if (q[0] < 0) CHECK((W * answer + q)[0] == Approx(0).margin(1e-12));
  }
}

TEST_CASE(
    "bisection leaves the least energy on the cone with u_n = 0, and is Coulomb's answer only where W does not "
    "couple") {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(-1, 1);
  int different = 0;
  for (int k = 0; k < 200; ++k) {
    const Matrix3d W = random_matrix(random);
    const Vector3d q(-1 - unit(random), 3 * unit(random), 3 * unit(random));
    const OneContact c(W, 0.3), round(round_matrix(2, 5), 0.3);
    const Vector3d r = c.bisect(q);
    if (r.tail<2>().norm() < 0.3 * r[0] - 1e-12) continue;  // it sticks
    INFO(k);
    const auto energy = [&](const Vector3d& x) { return 0.5 * x.dot(W * x) + x.dot(q); };
    CHECK((W * r + q)[0] == Approx(0).margin(1e-12 * (1 + q.norm())));
    for (int a = 0; a < 720; ++a) {
      const Vector3d d(1, 0.3 * std::cos(a * M_PI / 360), 0.3 * std::sin(a * M_PI / 360));
      const double along = W.row(0).dot(d);
      if (along > 0) CHECK(energy(r) <= energy(d * (-q[0] / along)) + 1e-9);
    }
    if (error(c, q, r) > 1e-3) ++different;
    CHECK(error(round, q, round.bisect(q)) < 1e-12);
  }
  CHECK(different > 20);
}

// The tip of an arm whose joints move it in a plane: W has rank two, and no impulse across the plane does anything.
TEST_CASE("a contact that moves in a plane alone sticks there, slips there, and slips against what drives it across") {
  const OneContact plain(Vector3d(2, 5, 0).asDiagonal(), 0.5);
  for (const Vector3d& r : {plain.solve({-4, 1, 0}), plain.bisect({-4, 1, 0})})
    CHECK((r - Vector3d(2, -0.2, 0)).norm() < 1e-15);  // 0.2 of the 1 that mu r_n is
  CHECK((plain.solve({-4, 10, 0}) - Vector3d(2, -1, 0)).norm() < 1e-14);
  CHECK((plain.solve({-4, 0, 3}) - Vector3d(2, 0, -1)).norm() < 1e-14);
  for (const double angle : {0.0, 0.3, M_PI / 2, 2.0})
    for (const double slip : {-10.0, -1.0, -0.1, 0.1, 1.0, 10.0})
      for (const double across : {0.0, 0.5}) {
        const Vector3d along(0, std::cos(angle), std::sin(angle)), aside(0, -along[2], along[1]);
        const Vector3d one(1, 0.2 * along[1], 0.2 * along[2]), other = 0.3 * Vector3d::UnitX() - along;
        const OneContact c(one * one.transpose() + other * other.transpose(), 0.6);
        const Vector3d q = slip * along + across * aside - Vector3d(1, 0, 0), r = c.solve(q);
        INFO(angle << ", " << slip << ", " << across);
        CHECK(error(c, q, r) < 1e-12);
        CHECK((c.W() * r + q)[0] == Approx(0).margin(1e-12));
      }
}
