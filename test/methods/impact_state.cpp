// Between two impacts: velocities, what counts as an approach, who is touched by whom.

#include "methods/impact_state.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "impacts.h"
#include "methods/mirtich.h"
#include "methods/newton.h"

using namespace cb;
using namespace cb::test;

namespace {

/// Points of 4, 1 and 9 kg: the first on the ground, the second on the first, the third on the ground elsewhere.
ContactProblem points() {
  ContactProblem p;
  const double masses[] = {4, 1, 9};
  for (const double m : masses) p.M.block(p.M.add_block(3)) = m * Matrix3d::Identity();
  p.v_minus = {-2, 0.5, 0, -6, 0, 0, -1, 0, 7};
  const auto contact = [&](int below, int body, double offset) {
    p.J.add_band();
    if (below >= 0) p.J.entry(p.J.add_entry(below, 3)) = -Matrix3d::Identity();
    p.J.entry(p.J.add_entry(body, 3)) = Matrix3d::Identity();
    p.offset.insert(p.offset.end(), {offset, 0, 0});
    p.mu.push_back(0.5);
    p.restitution.push_back(0);
  };
  contact(-1, 0, -1);
  contact(0, 1, 0);
  contact(-1, 2, 0.5);
  return p;
}

}  // namespace

TEST_CASE("velocities between impacts are those of the problem and of the impulses since, offset and all") {
  const ContactProblem p = points();
  ImpactState state;
  std::string reason;
  REQUIRE(state.start(p, {}, reason) == Status::ok);
  CHECK(state.nc() == 3);
  CHECK(state.velocity(0) == Vector3d(-3, 0.5, 0));
  CHECK(state.velocity(1) == Vector3d(-4, -0.5, 0));
  CHECK(state.velocity(2) == Vector3d(-0.5, 0, 7));
  for (int c = 0; c < 3; ++c) CHECK(state.normal_velocity(c) == state.velocity(c)[0]);
  CHECK(state.approach_before() == 4);
  CHECK((state.K(0) - 0.25 * Matrix3d::Identity()).norm() < 1e-15);
  CHECK((state.K(1) - 1.25 * Matrix3d::Identity()).norm() < 1e-15);
  state.apply(1, {2, 0, -4});
  CHECK((state.velocity(0) - Vector3d(-3.5, 0.5, 1)).norm() < 1e-15);
  CHECK((state.velocity(1) - Vector3d(-1.5, -0.5, -5)).norm() < 1e-15);
  CHECK(state.velocity(2) == Vector3d(-0.5, 0, 7));
  state.restart({12, 0, 0, 0, 0, 0, 0, 0, 9});
  CHECK((state.velocity(0) - Vector3d(0, 0.5, 0)).norm() < 1e-15);
  CHECK((state.velocity(2) - Vector3d(-0.5, 0, 8)).norm() < 1e-15);
  const auto neighbours = [&](int c) {
    return std::vector<int>(state.neighbours(c).begin(), state.neighbours(c).end());
  };
  CHECK(neighbours(0) == std::vector<int>{0, 1});
  CHECK(neighbours(1) == std::vector<int>{0, 1});
  CHECK(neighbours(2) == std::vector<int>{2});
  // Another problem of as many contacts has neighbours of its own.
  ContactProblem other = p;
  other.J.block = {0, 0, 1, 0};
  REQUIRE(state.start(other, {}, reason) == Status::ok);
  CHECK(neighbours(2) == std::vector<int>{0, 1, 2});
}

TEST_CASE("an approach is over by a part of the island's fastest, in m/s and beside its weight, or by rounding") {
  ImpactState state;
  std::string reason;
  REQUIRE(state.start(points(), {.approach = 1e-2, .rounding = 1e-4}, reason) == Status::ok);
  // 3 m/s at a weight of 1/4 are 6 sqrt(J), of which 1/2 is 3 m/s; 4 m/s are the fastest of both.
  CHECK(state.approach_tolerance(0) == Approx(0.03));
  CHECK(state.approach_tolerance(1) == Approx(0.04));
  CHECK(state.approach_tolerance(2) == Approx(0.005));
  // Terms of the largest row: 6 + 2 of the second contact, 7 along the third.
  CHECK(state.slip_rounding(0) == Approx(8e-4));
  CHECK(state.slip_rounding(1) == Approx(8e-4));
  CHECK(state.slip_rounding(2) == Approx(7e-4));
  REQUIRE(state.start(points(), {.approach = 1e-10, .rounding = 1e-2}, reason) == Status::ok);
  CHECK(state.approach_tolerance(0) == Approx(0.08));
  CHECK(state.approach_tolerance(2) == Approx(0.07));
}

TEST_CASE("a contact that approaches and that nothing can move ends an event, one that parts does not") {
  for (const double offset : {-1.0, 1.0})
    for (const bool newton : {true, false}) {
      ContactProblem p = points();
      p.J.add_band();
      p.offset.insert(p.offset.end(), {offset, 0, 0});
      p.mu.push_back(0.5);
      p.restitution.push_back(0);
      ContactSolution s;
      (newton ? make_newton({}) : make_mirtich({}))(p, s);
      CHECK((s.status == Status::ok) == (offset > 0));
      if (offset < 0) {
        CHECK(s.status == Status::singular);
        CHECK(s.reason == "an approaching contact has no body that an impulse can move");
      }
    }
}

// The light ball's tolerance would let the heavy one sink in at 5e-5 m/s.
TEST_CASE("a light ball that hits a heavy one at a million m/s does not excuse how that approaches the ground") {
  ContactProblem p;
  add_body(p, 1e6, Vector3d::Constant(4e5), {0, -5e-5, 0});
  add_body(p, 1e-6, Vector3d::Constant(4e-7), {0, -1e6, 0});
  add_contact(p, 0, {0, -1, 0}, -1, {}, ground_axes(), 0.5);
  add_contact(p, 1, {0, -1, 0}, 0, {0, 1, 0}, ground_axes(), 0.5);
  for (const bool newton : {true, false}) {
    ContactSolution s;
    (newton ? make_newton({}) : make_mirtich({}))(p, s);
    CHECK(s.status == Status::ok);
    CHECK(outcome(p, s.impulse).v[1] > -1e-6);
  }
}
