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
