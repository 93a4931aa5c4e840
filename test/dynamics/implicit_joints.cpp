// What implicit joint forces add to a tree's mass matrix, entry by entry.

#include "dynamics/implicit_joints.h"

#include <catch2/catch.hpp>

#include "dynamics/model.h"

using namespace cb;

namespace {

/// Gains of three rates, of which the tree at hand has the last two.
JointGains gains(std::vector<double> stiffness, std::vector<double> damping, std::vector<double> stiffness_by_mass,
                 std::vector<double> damping_by_mass) {
  JointGains out;
  out.stiffness = std::move(stiffness);
  out.damping = std::move(damping);
  out.stiffness_by_mass = std::move(stiffness_by_mass);
  out.damping_by_mass = std::move(damping_by_mass);
  return out;
}

Eigen::Matrix2d added(ImplicitJoints& joints) {
  Tree tree;
  tree.v = 1;
  tree.nv = 2;
  Eigen::MatrixXd M(2, 2);
  M << 2, 1, 1, 5;
  joints.add_to(tree, M);
  return M;
}

}  // namespace

TEST_CASE("springs, dampers and motors add h D + h^2 K of a tree's own rates, by mass to all of its matrix") {
  const double h = 0.5;
  ImplicitJoints joints(gains({90, 1, 2}, {91, 3, 4}, {0, 0, 0}, {0, 0, 0}),
                        gains({92, 10, 20}, {93, 30, 40}, {94, 9, 16}, {95, 25, 36}));
  Eigen::Matrix2d M;
  M << 2, 1, 1, 5;
  CHECK(added(joints) == M);  // before a step begins
  joints.begin(h);
  // Roots of what goes by mass: stiffness 3 and 4, damping 5 and 6.
  Eigen::Matrix2d expected;
  expected << 2 * (1 + h * 25 + h * h * 9), 1 + h * 30 + h * h * 12, 1 + h * 30 + h * h * 12,
      5 * (1 + h * 36 + h * h * 16);
  expected.diagonal() += Eigen::Vector2d(h * 33 + h * h * 11, h * 44 + h * h * 22);
  CHECK((added(joints) - expected).norm() < 1e-12);
  // A motor at its limit leaves what is passive of its rate, and the other rate's own.
  joints.saturate(2);
  expected << 2 * (1 + h * 25 + h * h * 9), 1, 1, 5;
  expected.diagonal() += Eigen::Vector2d(h * 33 + h * h * 11, h * 4 + h * h * 2);
  CHECK((added(joints) - expected).norm() < 1e-12);
  joints.begin(h);
  CHECK(added(joints)(1, 1) > expected(1, 1));
  joints.begin(0);
  CHECK(added(joints) == M);
  ImplicitJoints none;
  none.begin(h);
  none.saturate(1);
}
