#include "contact/conditioning.h"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

using namespace cb;

namespace {

// A body of mass m and inertia I at the origin that touches level ground in `points`.
ContactProblem on_ground(const std::vector<Eigen::Vector3d>& points, double mass, double inertia) {
  ContactProblem p;
  auto M = p.M.block(p.M.add_block(6));
  M.diagonal() << mass, mass, mass, inertia, inertia, inertia;
  p.v_minus.assign(6, 0.0);
  const Eigen::Vector3d axes[3] = {{0, 1, 0}, {1, 0, 0}, {0, 0, -1}};
  for (const Eigen::Vector3d& x : points) {
    p.J.add_band();
    auto J = p.J.entry(p.J.add_entry(0, 6));
    for (int i = 0; i < 3; ++i) {
      J.row(i).head<3>() = axes[i].transpose();
      J.row(i).tail<3>() = x.cross(axes[i]).transpose();
    }
  }
  p.offset.assign(3 * points.size(), 0.0);
  p.mu.assign(points.size(), 0.5);
  p.restitution.assign(points.size(), 0.0);
  return p;
}

Conditioning measure(const ContactProblem& p) {
  Conditioning out;
  REQUIRE(ConditioningEstimate().measure(p, out));
  return out;
}

}  // namespace

TEST_CASE("one contact under the centre of mass has rank 3 and condition (1/m + r^2/I) m") {
  // W = diag(1/m, 1/m + r^2/I, 1/m + r^2/I): 2, 2 + 0.25 / 0.1 = 4.5.
  const Conditioning c = measure(on_ground({{0, -0.5, 0}}, 0.5, 0.1));
  CHECK(c.rows == 3);
  CHECK(c.freedoms == 6);
  CHECK(c.rank == 3);
  CHECK(c.condition == Approx(2.25).epsilon(1e-12));
}

TEST_CASE("two points in line block all motions but one, four and more block all six") {
  CHECK(measure(on_ground({{-1, 0, 0}, {1, 0, 0}}, 1, 1)).rank == 5);
  std::vector<Eigen::Vector3d> patch;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) patch.push_back({i / 3.0 - 0.5, -0.5, j / 3.0 - 0.5});
  const Conditioning c = measure(on_ground(patch, 1, 1.0 / 6));
  CHECK(c.rows == 48);
  CHECK(c.rank == 6);
}

TEST_CASE("a contact that is there twice adds rows but no rank, and no condition") {
  const Conditioning once = measure(on_ground({{0, -0.5, 0}}, 1, 1)),
                     twice = measure(on_ground({{0, -0.5, 0}, {0, -0.5, 0}}, 1, 1));
  CHECK(twice.rows == 2 * once.rows);
  CHECK(twice.rank == once.rank);
  CHECK(twice.condition == Approx(once.condition).epsilon(1e-9));
}

TEST_CASE("other units of mass leave rank and condition as they are") {
  const std::vector<Eigen::Vector3d> points{{0.1, -0.5, 0.2}, {-0.3, -0.5, 0.1}, {0.2, -0.5, -0.4}};
  const Conditioning kg = measure(on_ground(points, 2, 0.3)), g = measure(on_ground(points, 2000, 300));
  CHECK(g.rank == kg.rank);
  CHECK(g.condition == Approx(kg.condition).epsilon(1e-10));
}

TEST_CASE("a light body beside a heavy one, each with its contact, leaves the condition as it is") {
  ContactProblem p = on_ground({{0, -0.5, 0}}, 0.5, 0.1);
  const double alone = measure(p).condition;
  const int heavy = p.M.add_block(6);
  p.M.block(heavy) = 1e6 * p.M.block(0);
  p.v_minus.resize(12, 0.0);
  p.J.add_band();
  const int entry = p.J.add_entry(1, 6);
  p.J.entry(entry) = p.J.entry(0);
  p.offset.resize(6, 0.0);
  p.mu.push_back(0.5);
  p.restitution.push_back(0);
  const Conditioning both = measure(p);
  CHECK(both.rank == 6);
  CHECK(both.condition == Approx(alone).epsilon(1e-12));
}

TEST_CASE("contacts that come together lose rank's meaning by the square of their distance") {
  // Two points d apart: turning about their normal is resisted with a lever of d / 2, W's eigenvalue falls as d^2.
  const auto condition = [](double d) { return measure(on_ground({{-d, 0, 0}, {d, 0, 0}}, 1, 1)).condition; };
  CHECK(condition(1e-4) / condition(1e-2) == Approx(1e4).epsilon(1e-3));
}

TEST_CASE("problems without contacts or beyond the limit are left alone") {
  Conditioning out;
  CHECK_FALSE(ConditioningEstimate().measure(on_ground({}, 1, 1), out));
  CHECK_FALSE(ConditioningEstimate().measure(on_ground({{0, 0, 0}}, 1, 1), out, 2));
}

TEST_CASE("problems with a contact of nothing that moves are left alone") {
  Conditioning out;
  ContactProblem p = on_ground({{0, 0, 0}, {1, 0, 0}}, 1, 1);
  p.J.entry(1).setZero();
  CHECK_FALSE(ConditioningEstimate().measure(p, out));
}

namespace {

/// Limits of two joints that turn the same links: M = [[2, 1], [1, 2]]. `coordinates`: of each limit, and from which
/// side.
ContactProblem at_limits(const std::vector<std::pair<int, double>>& coordinates) {
  ContactProblem p;
  p.M.block(p.M.add_block(2)) << 2, 1, 1, 2;
  p.v_minus.assign(2, 0.0);
  for (const auto& [coordinate, sign] : coordinates) {
    p.J.add_band();
    p.J.entry(p.J.add_entry(0, 2))(0, coordinate) = sign;
  }
  p.offset.assign(3 * coordinates.size(), 0.0);
  p.mu.assign(coordinates.size(), 0.0);
  p.restitution.assign(coordinates.size(), 0.0);
  return p;
}

}  // namespace

TEST_CASE("a limit of a joint is one row, and one that is beside its other limit adds no rank") {
  // W = M^-1 = [[2, -1], [-1, 2]] / 3, of which 2/3 is the weight: eigenvalues 3/2 and 1/2.
  const Conditioning two = measure(at_limits({{0, 1}, {1, -1}}));
  CHECK(two.rows == 2);
  CHECK(two.freedoms == 2);
  CHECK(two.rank == 2);
  CHECK(two.condition == Approx(3).epsilon(1e-12));
  const Conditioning one = measure(at_limits({{1, 1}}));
  CHECK(one.rows == 1);
  CHECK(one.freedoms == 2);
  CHECK(one.rank == 1);
  CHECK(one.condition == Approx(1).epsilon(1e-12));
  const Conditioning both = measure(at_limits({{0, 1}, {0, -1}}));
  CHECK(both.rows == 2);
  CHECK(both.rank == 1);
}

TEST_CASE("rank and condition count the directions of all bodies that a contact joins, turned masses too") {
  // Two balls of 1 and 3 kg on each other, one contact: W_nn = 1 + 1/3, W_tt = 3.5 times that.
  ContactProblem p;
  for (const double mass : {1.0, 3.0}) {
    const int b = p.M.add_block(6);
    p.M.block(b).diagonal() << mass, mass, mass, 0.4 * mass, 0.4 * mass, 0.4 * mass;
  }
  p.v_minus.assign(12, 0.0);
  p.J.add_band();
  for (const int b : {0, 1}) {
    auto J = p.J.entry(p.J.add_entry(b, 6));
    const double sign = b == 0 ? 1 : -1;
    J(0, 1) = J(1, 0) = J(2, 2) = sign;
    J(1, 5) = 1;  // arms of 1 m to the point between them
    J(2, 3) = -1;
  }
  p.offset.assign(3, 0.0);
  p.mu = {0.5};
  p.restitution = {0};
  const Conditioning c = measure(p);
  CHECK(c.rows == 3);
  CHECK(c.freedoms == 12);
  CHECK(c.rank == 3);
  CHECK(c.condition == Approx(3.5).epsilon(1e-12));
}

TEST_CASE("a problem as large as the limit is measured, in rows and in freedoms; one that is larger is not") {
  Conditioning out{.rows = 7, .freedoms = 7, .rank = 7, .condition = 7};
  ConditioningEstimate estimate;
  const ContactProblem free = on_ground({{0, -0.5, 0}}, 1, 1);  // 3 rows, 6 freedoms
  CHECK_FALSE(estimate.measure(free, out, 5));
  const ContactProblem patch = on_ground({{1, -0.5, 0}, {-1, -0.5, 0}, {0, -0.5, 1}}, 1, 1);  // 9 rows
  CHECK_FALSE(estimate.measure(patch, out, 8));
  CHECK(out.rank == 7);
  CHECK(estimate.measure(free, out, 6));
  CHECK(estimate.measure(patch, out, 9));
}
