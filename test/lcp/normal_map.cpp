// Points of the normal map, the bases that are reached from them, and the crash before a path.
#include "lcp/normal_map.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "lcp/dense_basis.h"
#include "lcp/front.h"
#include "lcp/path_crash.h"

using namespace cb;

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

LcpProblem dense(const MatrixXd& M) {
  LcpProblem p;
  p.M = M;
  p.q = VectorXd::Ones(M.rows());
  return p;
}

/// The same matrix as D of an expanded problem whose free unknowns do nothing.
LcpProblem expanded(const MatrixXd& M) {
  LcpProblem p;
  const auto n = M.rows();
  p.expanded = true;
  p.A = MatrixXd::Identity(1, 1).sparseView();
  p.B.resize(1, n);
  p.C.resize(n, 1);
  p.D = M.sparseView();
  p.a = VectorXd::Zero(1);
  p.q = VectorXd::Ones(n);
  return p;
}

/// A map at the basis of its w, with unit scales unless others are given.
struct At {
  LcpProblem problem;
  PairScales scales;
  Kernels kernels;
  Basis& basis;
  NormalMap map;
  PivotCount pivots;

  explicit At(LcpProblem p, VectorXd rows = {}, VectorXd columns = {})
      : problem(std::move(p)), basis(kernels.of(problem)) {
    const VectorXd ones = VectorXd::Ones(problem.n());
    scales.rho = ones;
    scales.rows = rows.size() > 0 ? rows : ones;
    scales.columns = columns.size() > 0 ? columns : ones;
    basis.start(problem, scales);
    REQUIRE(basis.eliminate());
    basis.restart();
    map.scales = &scales;
    map.z.setZero(problem.n());
    pivots.limit = 1000;
  }
};

}  // namespace

TEST_CASE("the merit of a point is the norm of its Fischer-Burmeister residual, and F that of the scaled map") {
  const MatrixXd M{{2, 1, 0}, {-1, 3, 0.5}, {0.25, 0, 4}};
  const VectorXd rows{{0.5, 2, 1}}, columns{{4, 0.25, 2}}, q{{-1, 0.5, -3}}, z{{0.5, 2, 0}};
  for (const LcpProblem& p : {dense(M), expanded(M)}) {
    At at(p, rows, columns);
    const double merit = at.map.evaluate(at.basis, q, z);
    const VectorXd F = rows.asDiagonal() * M * columns.asDiagonal() * z + q;
    CHECK((at.map.F - F).norm() < 1e-14);
    double square = 0;
    for (int i = 0; i < 3; ++i) square += std::pow(std::hypot(z[i], F[i]) - z[i] - F[i], 2);
    CHECK(merit == Approx(std::sqrt(square)).epsilon(1e-13));
  }
  // z F is 1e-4 beside 1e8: hypot alone would have cancelled it. -z F / (z + F) to the first order.
  At apart(dense(MatrixXd::Zero(1, 1)));
  for (const auto& [a, b] : {std::pair{1e8, 1e-12}, std::pair{1e-12, 1e8}})
    CHECK(apart.map.evaluate(apart.basis, VectorXd::Constant(1, b), VectorXd::Constant(1, a)) ==
          Approx(a * b / (a + b)).epsilon(1e-12).margin(0));
  CHECK(apart.map.evaluate(apart.basis, VectorXd::Zero(1), VectorXd::Zero(1)) == 0);
  CHECK(apart.map.evaluate(apart.basis, VectorXd::Constant(1, -3), VectorXd::Zero(1)) == Approx(6));
  CHECK(apart.map.evaluate(apart.basis, VectorXd::Constant(1, -3), VectorXd::Constant(1, 4)) == Approx(4));
}

TEST_CASE("a perturbed problem is the same with eps more on the diagonal of its scaled matrix") {
  const MatrixXd M{{2, 1, 0}, {-1, 0, 0.5}, {0.25, 0, 4}};
  const VectorXd rows{{0.5, 2, 1}}, columns{{4, 0.25, 8}};
  PairScales scales;
  scales.rows = rows;
  scales.columns = columns;
  for (const LcpProblem& p : {dense(M), expanded(M)}) {
    LcpProblem perturbed;
    perturb_diagonal(p, scales, 0.125, perturbed);
    const MatrixXd result = p.expanded ? MatrixXd(perturbed.D) : perturbed.M;
    const MatrixXd scaled = rows.asDiagonal() * result * columns.asDiagonal();
    const MatrixXd expected = rows.asDiagonal() * M * columns.asDiagonal();
    CHECK((scaled - expected - 0.125 * MatrixXd::Identity(3, 3)).norm() < 1e-15);
    CHECK(perturbed.q == p.q);
  }
}

TEST_CASE("the point of a basis has its basic z, none of them below zero, and no other") {
  At at(dense(MatrixXd::Identity(3, 3)));
  at.map.want = {1, 0, 1};
  at.map.reach(at.basis, at.pivots);
  CHECK(at.pivots.done == 2);
  at.basis.set_load(VectorXd{{-2, -1, 3}});
  VectorXd z;
  read_point(at.basis, z);
  CHECK(z == VectorXd{{2, 0, 0}});
}

TEST_CASE("bases are reached both ways, as far as there are pivots and solves for it") {
  const MatrixXd M{{2, 1, 0, 0}, {1, 2, 1, 0}, {0, 1, 2, 0}, {0, 0, 0, 1e-8}};
  for (const LcpProblem& p : {dense(M), expanded(M)}) {
    const auto active = [](const Basis& basis) {
      std::vector<int> out;
      for (int i = 0; i < 4; ++i)
        if (basis.is_basic(4 + i)) out.push_back(i);
      return out;
    };
    At at(p);
    // The last pair has a pivot of 1e-8 alone, which is none.
    at.map.want = {1, 0, 1, 1};
    at.map.reach(at.basis, at.pivots);
    CHECK(active(at.basis) == std::vector<int>{0, 2});
    CHECK(at.map.waiting == std::vector<int>{3});
    at.map.want = {0, 1, 1, 0};
    at.map.reach(at.basis, at.pivots);
    CHECK(active(at.basis) == std::vector<int>{1, 2});
    CHECK(at.map.waiting.empty());
    CHECK(at.pivots.done == 4);
    // From a path that broke off z_0 goes first.
    at.basis.set_cover(VectorXd::Ones(4));
    at.basis.set_load(p.q);
    REQUIRE(at.basis.pivot(0, 8));
    at.map.reach(at.basis, at.pivots);
    CHECK_FALSE(at.basis.is_basic(8));
    CHECK(active(at.basis) == std::vector<int>{1, 2});

    At few(p);
    few.map.want = {1, 1, 1, 0};
    few.pivots.limit = 2;
    few.map.reach(few.basis, few.pivots);
    CHECK(active(few.basis) == std::vector<int>{0, 1});
    CHECK(few.pivots.done == 2);
    At dear(p);
    dear.map.want = {1, 1, 1, 0};
    dear.map.tries = 1;  // solves, of which the table needs none
    dear.map.reach(dear.basis, dear.pivots);
    CHECK(active(dear.basis) == (p.expanded ? std::vector<int>{0} : std::vector<int>{0, 1, 2}));
  }
}

TEST_CASE("two pairs without a diagonal are exchanged at once for the largest coupling, or not at all") {
  // Pair 0 couples with 1 by 0.1 and with 2 by 1.
  const MatrixXd M{{0, 0.1, 1}, {-0.1, 0, 0}, {-1, 0, 0}};
  for (const LcpProblem& p : {dense(M), expanded(M)}) {
    At at(p);
    at.map.want = {1, 1, 1};
    at.map.reach(at.basis, at.pivots);
    CHECK(at.basis.is_basic(3));
    CHECK(at.basis.is_basic(5));
    CHECK_FALSE(at.basis.is_basic(4));
    CHECK(at.map.waiting == std::vector<int>{1});
    CHECK(at.pivots.done == 2);
    At alone(p);
    alone.map.want = {0, 1, 1};  // they do not couple with each other
    alone.map.reach(alone.basis, alone.pivots);
    CHECK(alone.map.waiting == std::vector<int>{1, 2});
    CHECK(alone.pivots.done == 0);
  }
  // One way alone: z_1 moves w_0, but z_0 does not move w_1: the first exchange is taken back.
  At one_way(dense(MatrixXd{{0, 0}, {1, 0}}));
  one_way.map.want = {1, 1};
  one_way.map.reach(one_way.basis, one_way.pivots);
  CHECK(one_way.pivots.done == 0);
  CHECK(one_way.basis.is_basic(0));
  CHECK(one_way.basis.is_basic(1));
  one_way.basis.set_load(VectorXd{{2, 3}});
  CHECK(one_way.basis.rhs()[one_way.basis.row_of(0)] == 2);
  CHECK(one_way.basis.rhs()[one_way.basis.row_of(1)] == 3);
}

TEST_CASE("the crash comes to the answer where Newton's method does, and to a better point everywhere") {
  std::mt19937 generator(4);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int trial = 0; trial < 20; ++trial) {
    const int n = 12;
    const MatrixXd B = MatrixXd::NullaryExpr(n, n, [&] { return uniform(generator); });
    const MatrixXd M = (B * B.transpose()).eval() / n + MatrixXd::Identity(n, n);
    const VectorXd q = VectorXd::NullaryExpr(n, [&] { return uniform(generator); });
    for (const LcpProblem& p : {dense(M), expanded(M)}) {
      At at(p);
      const double before = at.map.evaluate(at.basis, q, at.map.z);
      PathCrash().run(at.basis, at.map, q, at.pivots, INT_MAX);
      const double after = at.map.evaluate(at.basis, q, at.map.z);
      CHECK(after < 1e-12 * before);
      CHECK(at.map.z.minCoeff() >= 0);
      CHECK(at.map.tries == INT_MAX);
    }
  }
  // No coupling: Newton's first point is the answer, z = max(0, -q).
  At at(dense(MatrixXd{{2, 0, 0}, {0, 1, 0}, {0, 0, 4}}));
  PathCrash().run(at.basis, at.map, VectorXd{{-1, 3, -2}}, at.pivots, INT_MAX);
  CHECK(at.map.z == VectorXd{{0.5, 0, 0.5}});
  CHECK(at.pivots.done == 2);
  // At the answer there is nothing to do.
  PathCrash().run(at.basis, at.map, VectorXd{{-1, 3, -2}}, at.pivots, INT_MAX);
  CHECK(at.pivots.done == 2);
}

TEST_CASE("the crash leaves alone what rounding alone would have enter, what has no pivot, and what it may not try") {
  const auto active = [](At& at, const VectorXd& q, int tries = INT_MAX) {
    PathCrash().run(at.basis, at.map, q, at.pivots, tries);
    std::vector<int> out;
    for (int i = 0; i < at.basis.n(); ++i)
      if (at.basis.is_basic(at.basis.n() + i)) out.push_back(i);
    return out;
  };
  const MatrixXd I = MatrixXd::Identity(3, 3);
  At ties(dense(I));
  CHECK(active(ties, VectorXd{{-1, -1e-13, -1e-11}}) == std::vector<int>{0, 2});
  MatrixXd without = I;
  without(1, 1) = 0;
  At no_pivot(dense(without));
  CHECK(active(no_pivot, VectorXd{{-1, -2, -3}}) == std::vector<int>{0, 2});
  CHECK(no_pivot.map.z == VectorXd{{1, 0, 3}});
  At dear(expanded(I));
  CHECK(active(dear, VectorXd{{-1, -2, -3}}, 2) == std::vector<int>{0, 1});
}
