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
