// The verbs of a step one by one: modes, bounces that are left out, tries that are not taken.

#include "simulation/base_step.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "scenes.h"

using namespace cb;

namespace {

constexpr double h = 0.01;

/// A ball of 2 kg that touches the ground, comes down with `speed` and has this law; there is no gravity.
Scenario landing(double speed, double mu, double e) {
  Scenario s = test::empty_scene(h, 1);
  s.gravity.constant = Vec3::Zero();
  test::add_ground(s);
  test::add_sphere(s, 0.1, 2, {0, 0.1, 0}, {0, -speed, 0});
  test::collide_all(s, mu, e);
  return s;
}

/// One event of what touches. Returns whether anything approached.
bool meet(BaseStep& base) {
  base.kick(h);
  base.look(h);
  return base.approaching() && base.event(0);
}

}  // namespace

TEST_CASE("a slip is in the facet of the polygon as the event has it, where a scene turns that, too") {
  // The first corner is 0.6 rad from x towards -z (docs/scenarios.md); each of four is a quarter of the circle wide.
  const auto facet = [](double direction) {
    Scenario s = test::empty_scene(h, 1);
    test::add_ground(s);
    test::add_box(s, {1, 0.2, 1}, 2, {{0, 0.1, 0}, Quat::Identity()},
                  2 * Vec3(std::cos(direction), 0, -std::sin(direction)));
    test::collide_all(s, 0.25);
    s.rotate_cone = 0.6;
    SimulationOptions options;
    options.step = h;
    MethodOptions four;
    four.k = 4;
    BaseStep base(s, options, find_method("ap")->make(four), anitescu_potra_law());
    base.begin(1);
    REQUIRE(meet(base));
    std::vector<BaseStep::Mode> modes;
    base.read_modes(modes);
    REQUIRE(!modes.empty());
    for (const BaseStep::Mode& mode : modes) {
      CHECK(mode.facet == modes[0].facet);
      CHECK(mode.slip.norm() > 1.9);
    }
    return modes[0].facet;
  };
  // A slip is that of the first shape, the ground, as seen from the box.
  CHECK(facet(0.6) == 4);
  CHECK(facet(0.6 + 0.7) == 4);
  CHECK(facet(0.6 - 0.7) == 4);
  CHECK(facet(0.6 + M_PI) == 0);
  const int next = facet(0.6 + M_PI / 2), before = facet(0.6 - M_PI / 2);
  CHECK(std::min(next, before) == 2);
  CHECK(std::max(next, before) == 6);
}

TEST_CASE("a contact that sticks, one that slips and one that parts have their modes, the last none") {
  SimulationOptions options;
  options.step = h;
  const auto modes_of = [&](const Vec3& v) {
    Scenario s = landing(0, 0.25, 0);
    for (int i = 0; i < 3; ++i) s.initial.v[static_cast<std::size_t>(i)] = v[i];
    BaseStep base(s, options, find_method("newton")->make({}), newton_law());
    base.begin(1);
    base.kick(h);
    base.look(h);
    base.approaching();
    std::vector<BaseStep::Mode> modes;
    base.read_modes(modes);
    return modes;
  };
  REQUIRE(modes_of(Vec3::Zero()).size() == 1);
  CHECK(modes_of(Vec3::Zero())[0].facet == -1);
  REQUIRE(modes_of(Vec3(1, 0, 2)).size() == 1);
  CHECK(modes_of(Vec3(1, 0, 2))[0].facet == 0);
  CHECK(modes_of(Vec3(1, 0, 2))[0].slip.cwiseAbs() == Vec3(1, 0, 2));
  CHECK(modes_of(Vec3(0, 1, 0)).empty());
}

TEST_CASE(
    "restitution is left out where nothing would part with more than rest does, and told with speed and distance") {
  Scenario s = landing(0.1, 0, 0.5);  // would part with 0.05 m/s
  test::add_sphere(s, 0.1, 1, {3, 0.1, 0}, {0, -0.02, 0});
  test::collide_all(s, 0, 0.5);
  SimulationOptions options;
  options.step = h;
  for (const double rest : {0.04, 0.06})
    for (const bool trial : {false, true}) {
      BaseStep base(s, options, find_method("newton")->make({}), newton_law());
      base.begin(1);
      base.set_rest_speed(rest);
      base.set_trial(trial);
      REQUIRE(meet(base));
      const bool left_out = rest > 0.05, told = left_out && !trial;
      CHECK(base.state().v[1] == Approx(left_out ? 0 : 0.05).margin(1e-15));
      CHECK(base.state().v[7] == Approx(left_out ? 0 : 0.01).margin(1e-15));
      CHECK(base.record().bounces_left_out == (told ? 2 : 0));
      CHECK(base.record().bounce_speed == Approx(told ? 0.05 : 0));
      CHECK(base.record().bounce_distance == Approx(told ? 0.05 * h : 0));
    }
}

TEST_CASE(
    "restitution that is left out is told once, also where the event is solved again with all points of a patch") {
  // Beside the ball a box with a grid of 3 x 3 points turns about the normal.
  Scenario s = landing(0.1, 0, 0.5);
  test::add_box(s, {1, 0.2, 1}, 2, {{3, 0.1, 0}, Quat::Identity()}, {0, -0.1, 0}, {0, 3, 0});
  s.shapes.back().contact_grid = 3;
  s.pairs.groups = 3;
  s.pairs.group = {0, 1, 2};
  s.pairs.index = {-1, 0, 1, 0, -1, -1, 1, -1, -1};
  s.pairs.laws = {{0, 0.5}, {0.1, 0}};
  SimulationOptions options;
  options.step = h;
  options.prune.corners = Corners::suffice_unless_spin;
  BaseStep base(s, options, find_method("ap")->make({}), anitescu_potra_law());
  base.begin(1);
  base.set_rest_speed(HUGE_VAL);
  REQUIRE(meet(base));
  CHECK(base.problem().nc() == 10);
  CHECK(base.record().bounces_left_out == 1);
}

TEST_CASE("how deep something came in is told of the step's own events, not of tries") {
  const Scenario s = landing(0, 0, 0);
  SimulationOptions options;
  options.step = h;
  State deep = s.initial;
  deep.pose[0].p[1] -= 0.005;
  BaseStep base(s, options, find_method("newton")->make({}), newton_law());
  for (const bool trial : {true, false}) {
    base.begin(1);
    base.set_trial(trial);
    base.set_state(deep);
    base.kick(h);
    base.look(h);
    REQUIRE(base.contacts().size() == 1);
    CHECK(base.contacts()[0].gap == Approx(-0.005));
    CHECK(base.record().penetration_inside == Approx(trial ? 0 : 0.005));
  }
}

TEST_CASE("what is approached with is the fastest of what touches, and nothing where it parts") {
  SimulationOptions options;
  options.step = h;
  for (const double speed : {0.25, -0.25}) {
    Scenario s = landing(speed, 0, 0);
    test::add_sphere(s, 0.1, 1, {3, 0.1, 0}, {7, -2 * speed, 0});
    test::collide_all(s, 0);
    BaseStep base(s, options, find_method("newton")->make({}), newton_law());
    base.begin(1);
    base.kick(h);
    base.look(h);
    CHECK(base.approach_speed() == Approx(speed > 0 ? 0.5 : 0));
  }
}

TEST_CASE("a limit that moves is approached with the difference of the rates") {
  // A carriage at its lower limit, which follows with 0.5 m/s.
  SimulationOptions options;
  options.step = h;
  for (const double rate : {0.2, 0.7}) {
    Scenario s = test::empty_scene(h, 1);
    s.gravity.constant = Vec3::Zero();
    test::add_carriage(s, rate);
    BaseStep base(s, options, find_method("newton")->make({}), newton_law());
    base.begin(1);
    base.kick(h);
    base.look(h);
    CHECK(base.approach_speed() == Approx(rate < 0.5 ? 0.3 : 0).margin(1e-15));
    CHECK(base.approaching() == (rate < 0.5));
  }
}

TEST_CASE("what is approached with is the fastest of contacts and of limits together") {
  // The carriage's stop comes with 0.3 m/s as seen from it; a ball comes down on the ground.
  SimulationOptions options;
  options.step = h;
  for (const double speed : {0.1, 0.4}) {
    Scenario s = test::empty_scene(h, 1);
    s.gravity.constant = Vec3::Zero();
    test::add_carriage(s, 0.2);
    test::add_ground(s);
    test::add_sphere(s, 0.1, 1, {5, 0.1, 0}, {0, -speed, 0});
    test::collide_all(s, 0);
    BaseStep base(s, options, find_method("newton")->make({}), newton_law());
    base.begin(1);
    base.kick(h);
    base.look(h);
    CHECK(base.approach_speed() == Approx(std::max(0.3, speed)));
  }
}

TEST_CASE("a try that is not taken takes back what its answers were worth, not what they cost") {
  const Scenario s = landing(1, 0, 0);
  SimulationOptions options;
  options.step = h;
  int events = 0;
  const ContactMethod method = [&](const ContactProblem&, ContactSolution& solution) {
    // The first stops it; the second throws it up with 2 m/s and claims nothing.
    solution.impulse = {events == 0 ? 2.0 : 6.0, 0, 0};
    solution.status = events == 0 ? Status::ok : Status::inaccurate;
    solution.claimed_residual = events == 0 ? 0.25 : 0.5;
    solution.iterations = 3;
    solution.size = 5;
    ++events;
  };
  BaseStep base(s, options, method, newton_law());
  base.begin(1);
  REQUIRE(meet(base));
  CHECK(base.record().event_energy_gain == Approx(-1));
  base.set_trial(true);
  base.set_state(s.initial);
  REQUIRE(meet(base));
  CHECK(base.record().status == Status::inaccurate);
  CHECK(base.record().residual > 1e-3);
  CHECK(base.record().event_energy_gain == Approx(-1));
  CHECK(base.record().event_energy_gain_relative == Approx(3));
  CHECK_FALSE(base.reason().empty());
  int told = 0;
  base.on_forgive = [&told] { ++told; };
  base.forgive();
  CHECK(told == 1);
  const StepRecord& record = base.record();
  CHECK(record.status == Status::ok);
  CHECK(base.reason().empty());
  CHECK(record.residual < 1e-9);
  CHECK(record.claimed_residual == 0.25);
  CHECK(*record.law_residual < 1e-9);
  CHECK(record.event_energy_gain == Approx(-1));
  CHECK(record.event_energy_gain_relative == 0);
  CHECK(record.events == 2);
  CHECK(record.solves == 2);
  CHECK(record.iterations == 6);
  CHECK(record.size == 10);
}

namespace {

/// s, from the start of a step in which nothing is solved.
double longest_move(const Scenario& s) {
  SimulationOptions options;
  options.step = h;
  BaseStep base(s, options, find_method("newton")->make({}), newton_law());
  base.begin(1);
  base.kick(h);
  base.look(h);
  return base.longest_move();
}

/// s, in which half its square times `bending` (m/s^2) is a thousandth of `size` (m).
double until_turned_in(double bending, double size) { return std::sqrt(2 * 1e-3 * size / bending); }

/// A box that slides along x at 2 m/s and turns about z with `spin`, on what is added next below y = 0.
Scenario whirling_box(double spin) {
  Scenario s = test::empty_scene(h, 1);
  s.gravity.constant = Vec3::Zero();
  test::add_box(s, {0.3, 0.2, 0.4}, 1, {{0, 0.1, 0}, Quat::Identity()}, {2, 0, 0}, {0, 0, spin});
  return s;
}
const double reach = Vec3(0.15, 0.1, 0.2).norm(), size = 0.4;  // m, of that box

}  // namespace

TEST_CASE("what whirls on what it touches moves until its corners have turned in by a thousandth of the smaller size") {
  // Its lower corners slip with (2 + 0.1 w, 0.15 w, 0).
  for (const double spin : {9.0, -9.0}) {
    Scenario s = whirling_box(spin);
    test::add_ground(s);
    test::collide_all(s, 0);
    const double slip = std::hypot(2 + 0.1 * spin, 0.15 * spin);
    CHECK(longest_move(s) == Approx(until_turned_in(9 * (1.5 * 9 * reach + slip), size)));
  }
  // At most 0.02 rad a step is slow, and no move is shorter than a thousandth of the step.
  for (const double spin : {1.99, 2.01, 1e6}) {
    Scenario s = whirling_box(spin);
    test::add_ground(s);
    test::collide_all(s, 0);
    CHECK((longest_move(s) == HUGE_VAL) == (spin < 2));
    if (spin > 1e5) CHECK(longest_move(s) == Approx(1e-3 * h));
  }
  // Of two that touch the ground the faster one counts, by its own size, wherever it comes.
  for (const bool first : {false, true}) {
    Scenario s = whirling_box(first ? 9 : 3);
    test::add_box(s, {0.3, 0.2, 0.4}, 1, {{5, 0.1, 0}, Quat::Identity()}, {2, 0, 0}, {0, 0, first ? 3.0 : 9.0});
    test::add_ground(s);
    test::collide_all(s, 0);
    CHECK(longest_move(s) == Approx(until_turned_in(9 * (1.5 * 9 * reach + std::hypot(2.9, 1.35)), size)));
  }
  // What turns without touching anything has no limit.
  Scenario s = whirling_box(9);
  s.initial.pose[0].p[1] = 1;
  test::add_ground(s);
  test::collide_all(s, 0);
  CHECK(longest_move(s) == HUGE_VAL);
}

TEST_CASE("a face that whirls on something round turns about its middle, or about as far as its points come down") {
  for (const double radius : {0.05, 0.5, 1e5}) {
    // The ball moves along, at 0.5 m/s, and does not count by its own spin; its size is 2 R.
    Scenario s = whirling_box(9);
    test::add_sphere(s, radius, 3, {0, -radius, 0}, {0.5, 0, 0}, {30 / radius, 0, 0});
    test::collide_all(s, 0);
    const double smaller = std::min(size, 2 * radius);
    const double middle = std::min(radius, 2 * reach * reach / (1e-3 * smaller));
    const Vec3 slip = Vec3(2 + 0.9, 0, 0) - Vec3(0.5, 0, 30);
    const double bending = 9 * (1.5 * 9 * reach + slip.norm()) + 81 * middle;
    CHECK(longest_move(s) == Approx(until_turned_in(bending, smaller)));
    // About its face's normal it does not turn into the ball.
    s.initial.v = {2, 0, 0, 0, 9, 0, 0.5, 0, 0, 0, 0, 0};
    CHECK(longest_move(s) == Approx(until_turned_in(9 * (1.5 * 9 * reach + 1.5), smaller)));
  }
}

TEST_CASE("a link that turns moves until its arc has left its tangent by a twentieth of the smallest shape") {
  // The bar's centre is 0.5 m from its hinge: at 4 rad/s 2 m/s.
  Scenario s = test::empty_scene(h, 1);
  s.gravity.constant = Vec3::Zero();
  test::add_box(s, {0.6, 0.1, 0.1}, 1, {{0.5, 0, 0}, Quat::Identity()});
  Joint joint;
  joint.kind = JointKind::revolute;
  joint.axis_C = Vec3::UnitZ();
  joint.anchor_C = {-0.5, 0, 0};
  joint.body = joint.q = joint.v = 0;
  s.model.bodies[0].tree = 0;
  Tree tree;
  tree.joints = {joint};
  tree.nv = 1;
  s.model.trees = {tree};
  s.initial.q = {0};
  s.initial.qd = {4};
  // Free, and faster, which is no arc.
  test::add_box(s, {0.2, 0.1, 0.1}, 1, {{9, 0, 0}, Quat::Identity()}, {50, 0, 0}, {0, 0, 50});
  // What it touches is looked after elsewhere.
  s.shapes[static_cast<std::size_t>(test::add_ground(s))].local.p[1] = -0.05;
  s.initial.pose[1].p[1] = 9;
  test::collide_all(s, 0);
  CHECK(longest_move(s) == Approx(std::sqrt(2 * 0.05 * 0.2 / (2 * 4))));
  s.initial.qd = {0};
  CHECK(longest_move(s) == HUGE_VAL);
}
