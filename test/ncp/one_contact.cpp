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

OneContact round_contact(double W_n, double w, const Vector3d& q, double mu) {
  return {Vector3d(W_n, w, w).asDiagonal(), q, mu};
}

double error(const OneContact& c, const Vector3d& r) {
  const Vector3d u = c.W * r + c.q;
  Vector3d e;
  natural_map(r.data(), u.data(), c.mu, c.W.trace() / 3, e.data());
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
  CHECK(solve_one_contact(round_contact(2, 5, {1, 3, 4}, 0.5)) == Vector3d::Zero());
  const Vector3d sticks = solve_one_contact(round_contact(2, 5, {-4, 0.3, -0.4}, 0.5));
  CHECK((sticks - Vector3d(2, -0.06, 0.08)).norm() < 1e-15);
  const Vector3d slips = solve_one_contact(round_contact(2, 5, {-4, 30, -40}, 0.5));
  CHECK((slips - Vector3d(2, -0.6, 0.8)).norm() < 1e-14);  // mu r_n = 1 against (0.6, -0.8)
  CHECK(solve_one_contact(round_contact(2, 5, {-4, 30, -40}, 0)) == Vector3d(2, 0, 0));
}

TEST_CASE("a slipping impulse from which the velocity was made is found again, however W couples") {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int k = 0; k < 1000; ++k) {
    OneContact c;
    c.W = random_matrix(random);
    c.mu = 0.05 + 0.5 * unit(random);
    const double turn = 2 * M_PI * unit(random), r_n = 0.1 + unit(random);
    const Vector3d r(r_n, c.mu * r_n * std::cos(turn), c.mu * r_n * std::sin(turn));
    const double slip = unit(random);
    c.q = Vector3d(0, -slip * r[1], -slip * r[2]) - c.W * r;
    const Vector3d answer = solve_one_contact(c);
    INFO(k);
    CHECK(error(c, answer) < 1e-12);
    if (c.q[0] < 0) CHECK((c.W * answer + c.q)[0] == Approx(0).margin(1e-12));
  }
}

TEST_CASE(
    "bisection leaves the least energy on the cone with u_n = 0, and is Coulomb's answer only where W does not "
    "couple") {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(-1, 1);
  int different = 0;
  for (int k = 0; k < 200; ++k) {
    OneContact c{random_matrix(random), {-1 - unit(random), 3 * unit(random), 3 * unit(random)}, 0.3};
    const Vector3d r = bisect_one_contact(c);
    if (r.tail<2>().norm() < 0.3 * r[0] - 1e-12) continue;  // it sticks
    INFO(k);
    const auto energy = [&](const Vector3d& x) { return 0.5 * x.dot(c.W * x) + x.dot(c.q); };
    CHECK((c.W * r + c.q)[0] == Approx(0).margin(1e-12 * (1 + c.q.norm())));
    for (int a = 0; a < 720; ++a) {
      const Vector3d d(1, 0.3 * std::cos(a * M_PI / 360), 0.3 * std::sin(a * M_PI / 360));
      const double along = c.W.row(0).dot(d);
      if (along > 0) CHECK(energy(r) <= energy(d * (-c.q[0] / along)) + 1e-9);
    }
    if (error(c, r) > 1e-3) ++different;
    c.W = Vector3d(2, 5, 5).asDiagonal();
    CHECK(error(c, bisect_one_contact(c)) < 1e-12);
  }
  CHECK(different > 20);
}
