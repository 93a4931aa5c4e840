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
