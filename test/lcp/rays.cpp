#include <catch2/catch.hpp>

#include "lcp/dense_basis.h"
#include "lcp/judge.h"

using namespace cb;

namespace {

/// One pair, w = m z + q + c z_0, at the basis of w: the entering z changes w by `claimed`, and truly by m.
struct Misled : DenseBasis {
  double claimed = 0;
  const double* column(int) override { return &claimed; }
};

bool holds(double m, double claimed) {
  ScaledLoad load;
  load.q = load.scales.rows = load.scales.columns = Eigen::VectorXd::Ones(1);
  LcpProblem problem;
  problem.M = Eigen::MatrixXd::Constant(1, 1, m);
  problem.q = load.q;
  Misled basis;
  basis.claimed = claimed;
  basis.start(problem, load.scales);
  basis.restart();
  return PathJudge().ray_holds(basis, load, Eigen::VectorXd::Ones(1), 1);
}

}  // namespace

TEST_CASE("a direction is a ray where nothing falls along it and its equations hold, each to 1e-9") {
  CHECK(holds(0.5, 0.5));
  CHECK(holds(0, 0));
  CHECK_FALSE(holds(-0.5, -0.5));  // w falls
  for (const double off : {-1e-8, 1e-8}) CHECK_FALSE(holds(0.5, 0.5 + off));
  for (const double off : {-1e-10, 1e-10}) CHECK(holds(0.5, 0.5 + off));
  CHECK(holds(-1e-10, -1e-10));
  CHECK_FALSE(holds(-1e-8, -1e-8));
}

// The basis of w, where a velocity of q < 0 is left: an error of all that the pair is about, or the rounding of the
// terms that made q.
TEST_CASE("what a load is the rounding of is no error of an answer") {
  for (const char shares : {char(0), char(1)}) {
    const auto residual = [&](double q, double terms, double size = 0) {
      LcpProblem problem;
      problem.size = size;
      problem.M = Eigen::MatrixXd::Identity(1, 1);
      problem.q = Eigen::VectorXd::Constant(1, q);
      const Eigen::VectorXd one = Eigen::VectorXd::Ones(1);
      problem.groups = {
          {0}, 1e-12 * one, one, {shares}, {0}, {0}, 1, {}, [&](Eigen::VectorXd& of_q) { of_q = terms * one; }};
      ScaledLoad load;
      load.scales.rho = load.scales.rows = load.scales.columns = one;
      load.original = problem.q;
      REQUIRE(load.set(problem));
      DenseBasis basis;
      basis.start(problem, load.scales);
      basis.restart();
      Eigen::VectorXd z;
      return PathJudge().vertex(basis, load, z).residual;
    };
    INFO((shares ? "m/s" : "of its own unit"));
    CHECK(residual(-2e-14, 0) > 1e-3);
    CHECK(residual(-2e-14, 1) <= 1e-12);
    CHECK(residual(-2e-13, 1) > 1e-3);
    CHECK(residual(-2e-11, 1, 1) > 1e-3);  // the terms excuse: they are not what the contact is about
  }
}

namespace {

// At the basis of w: z = 0 and w = q, where what is negative of q is all error.
Judgement judged(const LcpProblem& problem, const Eigen::VectorXd& rho) {
  ScaledLoad load;
  load.scales.rho = rho;
  load.scales.rows = load.scales.columns = Eigen::VectorXd::Ones(problem.n());
  load.original = problem.q;
  REQUIRE(load.set(problem));
  DenseBasis basis;
  basis.start(problem, load.scales);
  basis.restart();
  Eigen::VectorXd z;
  return PathJudge().vertex(basis, load, z);
}

}  // namespace

TEST_CASE("without groups an error is one of all that the problem is about") {
  LcpProblem problem;
  problem.M = Eigen::Matrix3d::Identity();
  problem.q = Eigen::Vector3d(-6e-6, -2.5e-6, 3);
  const Eigen::Vector3d rho(4, 1, 0.25);  // sqrt(rho) divides: 3e-6, 2.5e-6, and a size of 6
  CHECK(judged(problem, rho).residual == Approx(3e-6 / 6));
  CHECK(judged(problem, rho).beyond_rounding == Approx(3e-6 / 6));
  problem.size = 30;
  CHECK(judged(problem, rho).residual == Approx(3e-6 / 30));
  problem.size = 2;
  CHECK(judged(problem, rho).residual == Approx(3e-6 / 6));
}

TEST_CASE("with groups the errors of each add up in squares, and count beside what it is about alone") {
  LcpProblem problem;
  problem.size = 100;
  problem.M = Eigen::Matrix4d::Identity();
  problem.q = Eigen::Vector4d(-3e-6, -4e-6, -8e-6, -8e-7);
  LcpGroups& groups = problem.groups;
  groups.of_pair = {0, 0, 1, 1};
  groups.size = Eigen::Vector2d(10, 0.5);
  groups.root = Eigen::Vector4d(1, 1, 4, 1);
  groups.shares = {1, 1, 0, 1};
  groups.own = {0, 0, 0, 0};
  groups.island = {0, 1};
  groups.islands = 2;
  const Eigen::Vector4d rho = Eigen::Vector4d::Ones();
  const double first = 5e-6 / 10, second = std::hypot(2e-6, 8e-7) / 0.5;
  Judgement found = judged(problem, rho);
  CHECK(found.residual == Approx(second));
  CHECK(found.beyond_rounding == Approx(second));
  groups.size[1] = 50;
  CHECK(judged(problem, rho).residual == Approx(first));
  CHECK(judged(problem, rho).beyond_rounding == Approx(first));
  groups.size[1] = 0.5;

  // What q is made of leaves open 128 roundings of it: of rows in one unit those of the largest in their island.
  groups.terms = [](Eigen::VectorXd& terms) { terms = Eigen::Vector4d(1e7, 1e8, 2e7, 1e6); };
  const double u = 128 * std::numeric_limits<double>::epsilon();
  found = judged(problem, rho);
  CHECK(found.residual == Approx((std::hypot(2e-6 - u * 2e7 / 4, 8e-7) - u * 1e6) / 0.5));
  CHECK(found.beyond_rounding == Approx(second));
  groups.size[1] = 50;
  CHECK(judged(problem, rho).residual == Approx((5e-6 - u * 1e8) / 10));
  groups.size[1] = 0.5;
  groups.island = {0, 0};
  groups.islands = 1;
  CHECK(judged(problem, rho).residual == Approx((5e-6 - u * 1e8) / 10));
  groups.terms = {};

  // A rate of a distance below zero is an error by itself, beside what was before; the first two pairs are such.
  groups.before = Eigen::Vector2d(0.1, 0.05);
  CHECK(judged(problem, rho).residual == Approx(4e-6 / 0.05));
  groups.before[0] = 0.01;
  CHECK(judged(problem, rho).residual == Approx(3e-6 / 0.01));
  groups.root[0] = 3;
  CHECK(judged(problem, rho).residual == Approx(1e-6 / 0.01));
  groups.terms = [](Eigen::VectorXd& terms) { terms = Eigen::Vector4d(0, 1e8, 0, 0); };
  groups.shares = {0, 1, 0, 1};
  CHECK(judged(problem, rho).residual == Approx(1e-6 / 0.01));
  groups.terms = {};
  groups.before[1] = 0;
  CHECK(judged(problem, rho).residual == HUGE_VAL);
}

TEST_CASE("of two answers the one that could be improved least is better, else the nearer one") {
  const Judgement exact{1e-13, 1e-14}, rough{0, 1e-11}, miss{1e-9, 1e-16}, none;
  CHECK(better(exact, rough, 1e-10));
  CHECK_FALSE(better(rough, exact, 1e-10));
  CHECK(better(rough, miss, 1e-10));
  CHECK_FALSE(better(miss, rough, 1e-10));
  CHECK(better(miss, none, 1e-10));
  CHECK_FALSE(better(none, none, 1e-10));
}

TEST_CASE("a vertex whose w is no number is none") {
  for (const int at : {0, 1}) {
    LcpProblem problem;
    problem.M = Eigen::MatrixXd::Identity(2, 2);
    problem.q = Eigen::VectorXd::Ones(2);
    ScaledLoad load;
    load.scales.rho = load.scales.rows = load.scales.columns = Eigen::VectorXd::Ones(2);
    load.original = problem.q;
    REQUIRE(load.set(problem));
    load.original[at] = NAN;
    DenseBasis basis;
    basis.start(problem, load.scales);
    basis.restart();
    Eigen::VectorXd z;
    CHECK(PathJudge().vertex(basis, load, z).residual == HUGE_VAL);
  }
}
