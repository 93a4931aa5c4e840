#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>

#include "lcp/lcp.h"

using namespace cb;

namespace {

LcpSolution solve(const LcpProblem& problem, const LcpOptions& options = {}) {
  LcpSolution solution;
  find_lcp_solver("pgs")->make(options)(problem, solution);
  return solution;
}

Eigen::VectorXd two(double a, double b) {
  Eigen::VectorXd x(2);
  x << a, b;
  return x;
}

Eigen::MatrixXd square(double a, double b, double c, double d) {
  Eigen::MatrixXd M(2, 2);
  M << a, b, c, d;
  return M;
}

}  // namespace

TEST_CASE("Gauss-Seidel finds the answer that a positive definite problem was built from") {
  for (const unsigned seed : {1u, 2u, 3u}) {
    std::mt19937 generator(seed);
    std::uniform_real_distribution<double> uniform(-1, 1);
    const int n = 12;
    const Eigen::MatrixXd S = Eigen::MatrixXd::NullaryExpr(n, n, [&] { return uniform(generator); });
    LcpProblem p;
    p.M = S * S.transpose() + Eigen::MatrixXd::Identity(n, n);
    Eigen::VectorXd z(n), w(n);
    for (int i = 0; i < n; ++i) {
      const double x = uniform(generator);
      z[i] = std::max(x, 0.0);
      w[i] = std::max(-x, 0.0);
    }
    p.q = w - p.M * z;
    const LcpSolution found = solve(p);
    CAPTURE(seed, found.reason);
    REQUIRE(found.status == LcpStatus::solved);
    CHECK((found.z - z).lpNorm<Eigen::Infinity>() < 1e-8);
    CHECK(found.residual == natural_residual(p, found.z));
    CHECK(found.residual <= LcpOptions().tolerance);
  }
}

// Row by row of a lower triangular matrix nothing is left to a second sweep, and checks come after ten.
TEST_CASE("Gauss-Seidel answers a matrix that is not symmetric, a triangular one in one sweep") {
  LcpProblem p;
  p.M = (Eigen::MatrixXd(3, 3) << 2, 0, 0, -1, 2, 0, 3, -5, 4).finished();
  p.q = Eigen::Vector3d(-2, -1, 1);
  const LcpSolution found = solve(p);
  CAPTURE(found.reason);
  REQUIRE(found.status == LcpStatus::solved);
  // 2 z_1 = 2; 2 z_2 = 1 + z_1; 4 z_3 = -1 - 3 z_1 + 5 z_2.
  CHECK((found.z - Eigen::Vector3d(1, 1, 0.25)).norm() < 1e-15);
  CHECK(found.pivots <= 10);
}

TEST_CASE("Two coupled rows count as solved by Gauss-Seidel only once both rows hold together") {
  // M = [2 1; 1 2], q = (-3, -3): z = (1, 1). Errors shrink by 1/4 a sweep: from z = 0, z_2 - 1 = -1/4, ... so that
  // 1e-10 takes 16 or more sweeps; a residual taken row by row within the sweep is zero after the first.
  LcpProblem p;
  p.M = square(2, 1, 1, 2);
  p.q = two(-3, -3);
  const LcpSolution found = solve(p);
  REQUIRE(found.status == LcpStatus::solved);
  CHECK(found.pivots >= 16);
  CHECK((found.z - two(1, 1)).norm() < 1e-9);

  LcpOptions few;
  few.pivot_limit = 1;
  const LcpSolution early = solve(p, few);
  CHECK(early.status == LcpStatus::nonconverged);
  CHECK(early.reason == "sweep limit");
  // After one sweep z = (3/2, 3/4): w = (3/4, 0); scaled by s_i = sqrt 2: min(z s, w / s) / (|q| / s) = 1/4.
  CHECK(early.residual == Approx(0.25).epsilon(1e-12));
}

TEST_CASE("What Gauss-Seidel cannot solve ends typed and with a finite answer") {
  LcpProblem p;
  p.q = two(-1, 1);
  SECTION("a row without diagonal, as a friction bound has, even where the answer exists") {
    p.M = square(1, 1, -1, 0);
    CHECK(solve(p).status == LcpStatus::singular);
    CHECK(solve(p).reason.find("row 2") != std::string::npos);
  }
  SECTION("a negative diagonal") {
    p.M = square(-1, 0, 0, 1);
    CHECK(solve(p).status == LcpStatus::singular);
    CHECK(solve(p).reason.find("row 1") != std::string::npos);
  }
  SECTION("a problem without a solution: z_1 = 1 + 3 z_2, z_2 = 1 + 3 z_1") {
    p.M = square(1, -3, -3, 1);
    p.q = two(-1, -1);
    CHECK(solve(p).status == LcpStatus::nonconverged);
    CHECK(solve(p).reason == "the iterates grow without bound");
    CHECK(solve(p).z.isZero(0));  // the best that was seen, before they grew
    CHECK(solve(p).residual == natural_residual(p, two(0, 0)));
  }
  SECTION("z_1 + 2 z_2 = 5, z_2 = 2 z_1 - 1 has z = (7, 9) / 5; the sweeps go (5, 9), (0, 0), (5, 9) for ever") {
    p.M = square(1, 2, -2, 1);
    p.q = two(-5, 1);
    CHECK(natural_residual(p, two(1.4, 1.8)) < 1e-15);
    CHECK(solve(p).status == LcpStatus::nonconverged);
    CHECK(solve(p).reason == "sweep limit");
  }
  SECTION("no finite data") {
    p.M = square(1, 0, 0, 1);
    p.q[0] = std::numeric_limits<double>::quiet_NaN();
    CHECK(solve(p).status == LcpStatus::not_finite);
  }
  CHECK(solve(p).z.size() == 2);
  CHECK(solve(p).z.allFinite());
}

TEST_CASE("Gauss-Seidel gives the expanded form and its condensed form the same answer") {
  // A = 2 I, B = -I, C = I, D = I: M = D - C A^-1 B = 3/2 I, q - C A^-1 a = (-3/2, 2) for a = (1, -2), q = (-1, 1).
  const int n = 2;
  LcpProblem p;
  p.expanded = true;
  for (SparseMatrix* matrix : {&p.A, &p.B, &p.C, &p.D}) {
    matrix->resize(n, n);
    matrix->setIdentity();
  }
  p.A *= 2;
  p.B *= -1;
  p.a = two(1, -2);
  p.q = two(-1, 1);
  const LcpSolution found = solve(p);
  REQUIRE(found.status == LcpStatus::solved);
  CHECK((found.z - two(1, 0)).norm() < 1e-12);
  CHECK((found.x - two(0, 1)).norm() < 1e-12);
}
