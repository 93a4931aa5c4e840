// What stepping to an accuracy needs of the base step: modes of joints, and what a try that is not taken leaves.

#include <catch2/catch.hpp>
#include <cmath>

#include "scenes.h"
#include "simulation/base_step.h"

using namespace cb;

namespace {

constexpr double h = 0.01;

}  // namespace

TEST_CASE("a joint has a mode while it goes with its limit, and one while its motor is at its greatest torque") {
  // A carriage at a stop that moves with 0.5 m/s; -1: of the first tree.
  const auto modes_of = [](bool lower, double rate, double torque_limit) {
    Scenario s = test::empty_scene(h, 1);
    s.gravity.constant = Vec3::Zero();
    test::add_carriage(s, rate, lower);
    s.model.trees[0].joints[0].torque_limit = torque_limit;
    SimulationOptions options;
    options.step = h;
    BaseStep base(s, options, find_method("newton")->make({}), newton_law());
    base.begin(1);
    base.kick(h);
    base.look(h);
    CHECK_FALSE(base.approaching());
    std::vector<BaseStep::Mode> modes;
    base.read_modes(modes);
    return modes;
  };
  for (const bool lower : {true, false}) {
    const std::vector<BaseStep::Mode> stays = modes_of(lower, 0.5, HUGE_VAL);
    REQUIRE(stays.size() == 1);
    CHECK(stays[0].a == -1);
    CHECK(stays[0].b == 0);
    CHECK(modes_of(lower, lower ? 0.7 : 0.3, HUGE_VAL).empty());
    CHECK(modes_of(lower, lower ? 0.7 : 0.3, 0).size() == 1);  // there is no motor, and no torque that it might give
    CHECK(modes_of(lower, 0.5, 0).size() == 2);
  }
  CHECK(modes_of(true, 0.5, HUGE_VAL)[0].facet != modes_of(false, 0.5, HUGE_VAL)[0].facet);
}

TEST_CASE("a try that is not taken takes back the bounces that it left out and what it moved out of an overlap") {
  // With e = 1e-4 one bounce is all: what comes down again in the same step does not bounce.
  Scenario s = test::empty_scene(h, 1);
  s.gravity.constant = {0, -10, 0};
  test::add_ground(s);
  test::add_sphere(s, 0.1, 2, {0, 0.1 + 1e-3, 0}, {0, -1, 0});
  test::collide_all(s, 0, 1e-4);
  SimulationOptions options;
  options.step = h;
  BaseStep base(s, options, find_method("newton")->make({}), newton_law());
  base.begin(1);
  base.set_trial(true);
  base.kick(h);
  base.look(h);
  REQUIRE_FALSE(base.approaching());
  const double dt = base.until_contact(h, false, false);
  REQUIRE(dt == Approx(1e-3 / 1.1).epsilon(1e-5));
  base.move(dt);
  REQUIRE(base.arrive(dt));
  base.find_contacts();
  REQUIRE(base.approaching());
  REQUIRE(base.event(h - dt));
  CHECK(base.record().bounces_left_out == 0);
  base.kick(h);
  base.find_contacts();
  REQUIRE(base.approaching());
  REQUIRE(base.event(h / 2));
  CHECK(base.record().bounces_left_out == 1);
  CHECK(base.record().bounce_speed > 0);
  CHECK(base.record().bounce_distance > 0);
  State deep = s.initial;
  deep.pose[0].p[1] = 0.1 - 1e-3;
  base.set_state(deep);
  base.look(h);
  base.part();
  CHECK(base.record().penetration_displacement == Approx(1e-3).epsilon(1e-3));
  base.forgive();
  CHECK(base.record().bounces_left_out == 0);
  CHECK(base.record().bounce_speed == 0);
  CHECK(base.record().bounce_distance == 0);
  CHECK(base.record().penetration_displacement == 0);
}

// A box that is 0.1 mm in a table hangs over its edge, first by a little, then by most of it: the nearest point that
// carries is then a tenth of a metre from its middle, and it tips as it is lifted.
TEST_CASE("what overlaps is taken away where it overlaps now, wherever the two have overlapped before") {
  Scenario s = test::empty_scene(h, 1);
  s.gravity.constant = Vec3::Zero();
  Shape table;
  table.kind = ShapeKind::box;
  table.name = "table";
  table.half_extents = Vec3::Constant(0.5);
  table.local.p = Vec3(0, -0.5, 0);
  s.shapes.push_back(table);
  test::add_box(s, {0.5, 0.2, 0.5}, 1, {{0, 1, 0}, Quat::Identity()});
  test::collide_all(s, 0.3);
  SimulationOptions options;
  options.step = h;
  const auto parted = [&](BaseStep& base, double x) {
    State state = s.initial;
    state.pose[0].p = Vec3(x, 0.1 - 1e-4, 0);
    base.begin(1);
    base.set_state(state);
    base.settle();
    CHECK(base.going_on());
    CHECK(base.record().penetration_displacement > 0);
    return base.state().pose[0];
  };
  BaseStep used(s, options, find_method("newton")->make({}), newton_law());
  BaseStep fresh(s, options, find_method("newton")->make({}), newton_law());
  CHECK(std::abs(parted(used, 0.3).q.z()) < 1e-9);
  const Pose again = parted(used, 0.6), first = parted(fresh, 0.6);
  CHECK(std::abs(first.q.z()) > 1e-5);
  CHECK((again.p - first.p).norm() < 1e-12);
  CHECK((again.q.coeffs() - first.q.coeffs()).norm() < 1e-12);
}
