#include "contact/feasibility.h"

#include <catch2/catch.hpp>

#include "problems.h"

using namespace cb;
using namespace cb::test;

namespace {

// A body of 2 kg between two walls (normals along +x and -x) that move towards +x with `left` and `right` m/s, and
// `more` contacts that say the same as the first.
ContactProblem between(double left, double right, int more = 0) {
  ContactProblem p;
  const int body = add_body(p, 2, {0.1, 0.2, 0.3}, {0, 0, 0});
  Matrix3d axes;
  axes << 1, 0, 0, 0, 1, 0, 0, 0, 1;
  for (int i = 0; i <= more; ++i) add_contact(p, body, {-0.5, 0.1 * i, 0}, -1, {0, 0, 0}, axes, 0.5);
  Matrix3d opposite = axes;
  opposite.row(0) *= -1;
  add_contact(p, body, {0.5, 0, 0}, -1, {0, 0, 0}, opposite, 0.5);
  p.offset.assign(3 * static_cast<std::size_t>(p.nc()), 0.0);
  for (int i = 0; i <= more; ++i) p.offset[3 * i] = -left;
  p.offset[3 * (more + 1)] = right;
  return p;
}

}  // namespace

TEST_CASE("walls that close in on a body leave it no velocity; those that keep their distance leave it one") {
  CHECK_FALSE(feasible(between(1, 0)));
  CHECK_FALSE(feasible(between(1, 1 - 1e-6)));
  CHECK(feasible(between(0, 0)));
  CHECK(feasible(between(1, 1)));
  CHECK(feasible(between(1, 2)));
  CHECK(feasible(between(-1, 1)));
}

TEST_CASE("a wall that pushes off the centre turns the body: one such can be escaped, two cannot") {
  ContactProblem p = between(1, 0);
  // The second wall meets the body higher up: it can turn out of the way.
  p.J.entry(p.J.band[1]).row(0) << -1, 0, 0, 0, 0, 0.3;
  CHECK(feasible(p));
  CHECK_FALSE(feasible(between(1, 0, 20)));
}

TEST_CASE("what stands between a wall that comes and another body can push that body away, but not into a wall") {
  // A wall comes at 1 m/s along x towards the first body, which the second stands behind.
  for (const bool wall_behind : {false, true}) {
    ContactProblem p;
    for (int b = 0; b < 2; ++b) add_body(p, 2, {0.1, 0.2, 0.3}, {0, 0, 0});
    const Matrix3d along = Matrix3d::Identity();
    Matrix3d against = along;
    against.row(0) *= -1;
    add_contact(p, 0, {-0.5, 0, 0}, -1, {}, along, 0.5);
    add_contact(p, 0, {0.5, 0, 0}, 1, {-0.5, 0, 0}, against, 0.5);
    if (wall_behind) add_contact(p, 1, {0.5, 0, 0}, -1, {}, against, 0.5);
    p.offset[0] = -1;
    CHECK(feasible(p) != wall_behind);
  }
}

TEST_CASE("rows of any length leave room or none by the velocities that they ask for") {
  // v >= 1 m/s, and a tenth of it is at most 0.15 m/s, or 0.05.
  ContactProblem p = between(1, 0);
  p.J.entry(p.J.band[1]).row(0) *= 0.1;
  p.offset[3] = 0.15;
  CHECK(feasible(p));
  p.offset[3] = 0.05;
  CHECK_FALSE(feasible(p));
}

TEST_CASE("a wall that pushes by next to no lever off another can be escaped, however fast that is") {
  ContactProblem p = between(1, -1);
  p.J.entry(p.J.band[1]).row(0) << -1, 0, 0, 0, 0, 1e-6;
  CHECK(feasible(p));
}

TEST_CASE("walls that close in by 1e-7 of their velocities are found out") {
  CHECK_FALSE(feasible(between(1, 1 - 1e-7)));
}

TEST_CASE("of a thousand contacts it is found out that they leave no velocity; of more nothing is said") {
  for (const int contacts : {1000, 1001}) {
    ContactProblem p = between(1, 0);
    while (p.nc() < contacts) {
      add_contact(p, 0, {-0.5, 0, 0}, -1, {0, 0, 0}, Matrix3d::Identity(), 0.5);
      p.offset[3 * static_cast<std::size_t>(p.nc()) - 3] = -1;
    }
    CHECK(feasible(p) == (contacts > 1000));
  }
}
