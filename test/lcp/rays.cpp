#include <catch2/catch.hpp>

#include "lcp/complementary_path.h"

using namespace cb;

namespace {

/// One pair, w = m z + q + c z_0, at the basis of w: the entering z changes w by `claimed`, and truly by m.
struct OnePair {
  double m, claimed;
  const double* column(int) const { return &claimed; }
  int basic(int) const { return 0; }  // w; 1 is z, 2 is z_0
  void multiply(const Eigen::VectorXd& z, Eigen::VectorXd& w) const { w = m * z; }
};

bool holds(double m, double claimed) {
  ScaledLoad load;
  load.q = load.scales.rows = load.scales.columns = Eigen::VectorXd::Ones(1);
  OnePair table{m, claimed};
  return PathJudge().ray_holds(table, load, Eigen::VectorXd::Ones(1), 1);
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
