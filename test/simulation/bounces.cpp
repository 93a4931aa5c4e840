#include "simulation/bounces.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "closed_forms.h"
#include "simulation/simulation.h"

using namespace cb;

namespace {

constexpr double radius = 0.1, speed = 1;  // m, m/s

/// A light ball at rest above the ground, a heavy one coming down on it, without gravity or friction.
Scenario squeezed(double heavy, double e, double step, double duration) {
  Scenario s = test::empty_scene(step, duration);
  s.gravity.constant.setZero();
  test::add_ground(s);
  test::add_sphere(s, radius, 1, {0, 2 * radius, 0});
  test::add_sphere(s, radius, heavy, {0, 5 * radius, 0}, {0, -speed, 0});
  test::collide_all(s, 0, e);
  return s;
}

struct Seen {
  Status status = Status::ok;
  State state;
  long events = 0, left_out = 0;
};

Seen look(const Scenario& s, const std::string& name, std::uint64_t shuffle = 0) {
  SimulationOptions options;
  options.shuffle = shuffle;
  options.step = s.step;
  options.duration = s.duration;
  Simulation simulation(s, options, find_method(name)->make({}), find_method(name)->law);
  Seen seen;
  while (simulation.step_index() < simulation.steps_total() && seen.status == Status::ok) {
    const StepRecord& record = simulation.step();
    seen.status = record.status;
    seen.events += record.events;
    seen.left_out += record.bounces_left_out;
  }
  seen.state = simulation.state();
  return seen;
}

}  // namespace

TEST_CASE("elastic balls of masses 1 and 100^k at a wall meet as often as the digits of pi say") {
  // Galperin (2003): in the plane of sqrt(m) x the pair is a point in a wedge of angle atan(sqrt(m / M)), and unfolds
  // to a straight line through floor(pi / angle) of its walls. 3 and 31 of them in one step.
  struct Case {
    double heavy;
    int meetings;
    double step;
  };
  for (const auto& [heavy, meetings, step] : {Case{1, 3, 10}, {1e2, 31, 10}, {1e4, 314, 1e-3}, {1e7, 9934, 10}}) {
    const Seen seen = look(squeezed(heavy, 1, step, 10), "ap");
    CHECK(seen.status == Status::ok);
    CHECK(seen.events == meetings);
    CHECK(seen.left_out == 0);
    const double v = seen.state.v[1], V = seen.state.v[7];
    CHECK((v * v + heavy * V * V) / (heavy * speed * speed) == Approx(1).epsilon(1e-12));
  }
}

TEST_CASE(
    "an elastic pair that meets more than eleven thousand times in a step ends the run as a stall that names it") {
  const Scenario s = squeezed(1e8, 1, 1, 1);
  SimulationOptions options;
  options.step = options.duration = 1;
  Simulation simulation(s, options, find_method("ap")->make({}), anitescu_potra_law());
  CHECK(simulation.step().status == Status::event_stall);
  CHECK(simulation.reason().find(" and body1 come together more than 11000 times") != std::string::npos);
}

TEST_CASE("a ball squeezed between a heavy one and the ground ends in contact with both, whatever the restitution") {
  // Infinitely many bounces in finite time, for e < 1: then the heavy ball stands on the light one.
  for (const double e : {0.1, 0.5, 0.9, 0.98, 0.997})
    for (const char* name : {"ap", "convex"})
      for (const double step : {1.0, 0.25}) {
        INFO(name << ", e = " << e << ", h = " << step);
        const Seen seen = look(squeezed(1e6, e, step, 1), name);
        CHECK(seen.status == Status::ok);
        CHECK(seen.state.pose[0].p[1] == Approx(radius).epsilon(1e-8));
        CHECK(seen.state.pose[1].p[1] == Approx(3 * radius).epsilon(1e-8));
        CHECK(std::abs(seen.state.v[7]) < 1e-9);
      }
}

TEST_CASE("what a step says of bounces left out is e u of the events that were solved without restitution") {
  const double e = 0.98;
  const Scenario s = squeezed(1e6, e, 1, 1);
  SimulationOptions options;
  options.step = options.duration = 1;
  Simulation simulation(s, options, find_method("ap")->make({}), anitescu_potra_law());
  int left_out = 0;
  double fastest = 0, furthest = 0;
  simulation.on_event = [&](const EventRecord& event) {
    std::vector<double> u;
    contact_velocity(event.problem, event.problem.v_minus, u);
    for (int c = 0; c < event.problem.nc(); ++c) {
      if (event.problem.restitution[c] != 0 || u[3 * c] > -1e-12) continue;
      ++left_out;
      fastest = std::max(fastest, -e * u[3 * c]);
      furthest = std::max(furthest, -e * u[3 * c] * (1 - event.t));
    }
  };
  const StepRecord& record = simulation.step();
  CHECK(record.status == Status::ok);
  CHECK(left_out > 0);
  CHECK(record.bounces_left_out == left_out);
  CHECK(record.bounce_speed == Approx(fastest).epsilon(1e-12));
  CHECK(record.bounce_distance == Approx(furthest).epsilon(1e-9));
}

TEST_CASE("bounces are over when e^n is spent, each pair for itself") {
  Bounces bounces;
  const Bounces::Pair a{0, 1}, b{0, 2};
  for (int n = 1; n <= 9; ++n) {
    CHECK(bounces.arrive(a) == n);
    bounces.impact(n);
  }
  CHECK_FALSE(bounces.over(a, 0.5));  // 0.5^9 = 1.95e-3
  CHECK(bounces.over(a, 0.4));
  CHECK(bounces.arrive(b) == 1);
  bounces.impact(1);
  bounces.arrive(a);
  bounces.impact(1);
  CHECK(bounces.over(a, 0.5));  // 9.8e-4
  CHECK_FALSE(bounces.over(b, 0.5));
  CHECK_FALSE(bounces.over(a, 1));  // nothing is lost
  CHECK_FALSE(bounces.over(a, 0));  // nothing is left out
  // Pairs that come together and do not approach spend nothing.
  const Bounces::Pair c{0, 3};
  for (int n = 1; n <= 20; ++n) CHECK(bounces.arrive(c) == n);
  CHECK_FALSE(bounces.over(c, 0.5));
  bounces.clear();
  CHECK_FALSE(bounces.over(a, 0.5));
}

TEST_CASE("the times of contact of a pair are a hundredth of the step apart once a hundred were without restitution") {
  Bounces bounces;
  const double h = 1e-3, size = 0.1;
  for (int n = 1; n <= 100; ++n) {
    bounces.arrive({0, 1});
    CHECK(bounces.wait({0, 1}, 0, 0, h, size, 1) == 0);
    bounces.impact(1e-6 * n);
  }
  CHECK(bounces.wait({0, 1}, 0, 1e-4, h, size, 1) == Approx(h / 100));
  CHECK(bounces.wait({0, 1}, 0, 1.04e-4, h, size, 1) == Approx(0.6 * h / 100));
  CHECK(bounces.wait({0, 1}, 0, 2e-4, h, size, 1) == 0);
  CHECK(bounces.wait({0, 2}, 0, 1e-4, h, size, 1) == 0);
  // So fast that it would be deeper than a hundredth of its size by then.
  CHECK(bounces.wait({0, 1}, 0, 1e-4, h, size, 1e3) == Approx(1e-3 / 1e3));
  // With restitution 1/2 there were ten bounces among them, elastic ones are never over.
  CHECK(bounces.wait({0, 1}, 0.5, 1e-4, h, size, 1) == 0);
  CHECK(bounces.wait({0, 1}, 1, 1e-4, h, size, 1) == 0);
}

TEST_CASE("which bounces are left out does not depend on the order of contacts") {
  // A ball on the ground between two walls a micrometre apart from it, until its bounces are over.
  Scenario s = test::empty_scene(100, 100);
  s.gravity.constant.setZero();
  test::add_ground(s);
  for (const double turn : {-0.5, 0.5}) {
    const int wall = test::add_ground(s, Quat(Eigen::AngleAxisd(turn * std::numbers::pi, Vec3::UnitZ())));
    s.shapes[wall].local.p[0] = turn < 0 ? -radius : radius + 1e-6;
  }
  test::add_sphere(s, radius, 1, {0, radius, 0}, {speed, 0, 0});
  test::collide_all(s, 0, 0.9);
  const Seen in_order = look(s, "newton");
  CHECK(in_order.left_out == 1);
  CHECK(in_order.state.v[0] == Approx(0).margin(1e-9));
  for (const std::uint64_t order : {1, 2, 3, 4, 5}) CHECK(look(s, "newton", order).left_out == in_order.left_out);
}

TEST_CASE("a pair's bounces count where another pair comes with it, in each event") {
  // Two balls side by side between floor and ceiling, alike to the last bit until the first one's bounces are over.
  Scenario s = test::empty_scene(100, 100);
  s.gravity.constant.setZero();
  test::add_ground(s);
  const int ceiling = test::add_ground(s, Quat(0, 0, 0, 1));
  s.shapes[ceiling].local.p[1] = 2 * radius + 1e-6;
  for (const double z : {-1.0, 1.0}) test::add_sphere(s, radius, 1, {0, radius, z}, {0, speed, 0});
  test::collide_all(s, 0, 0.9);
  const Seen seen = look(s, "newton");
  CHECK(seen.status == Status::ok);
  CHECK(seen.left_out == 1);
  CHECK(seen.state.v[1] == Approx(0).margin(1e-12));
  CHECK(std::abs(seen.state.v[7]) > 1e-9);  // its own have hardly begun to count
}

TEST_CASE("how often a pair may come together in one step is counted anew in each") {
  // A ball to and fro between floor and ceiling, once in a step of 0.1 s at most: 13 times up and 12 times down in 6 s.
  Scenario s = test::empty_scene(0.1, 6);
  s.gravity.constant.setZero();
  test::add_ground(s);
  const int ceiling = test::add_ground(s, Quat(Eigen::AngleAxisd(std::numbers::pi, Vec3::UnitZ())));
  s.shapes[ceiling].local.p[1] = 4 * radius;
  test::add_sphere(s, radius, 1, {0, 2 * radius, 0}, {0, 0.83, 0});
  test::collide_all(s, 0, 1);
  SimulationOptions options;
  options.step = s.step;
  options.duration = s.duration;
  options.event_cap = 1;  // and ten times that, as elastic bounces are never over
  Simulation simulation(s, options, find_method("newton")->make({}), newton_law());
  int events = 0;
  while (!simulation.done()) {
    const StepRecord& record = simulation.step();
    INFO(simulation.reason());
    REQUIRE(record.status == Status::ok);
    events += record.events;
  }
  CHECK(events == 25);
  CHECK(simulation.state().v[1] == Approx(-0.83).epsilon(1e-12));
}

TEST_CASE("a joint that comes to a limit too often in a step is named, with when and how long after what came before") {
  // The second of two carriages is 0.05 s from its stop, less half a closed gap: it comes there within the third step.
  for (const double side : {1.0, -1.0}) {
    Scenario s = test::empty_scene(0.02, 1);
    s.gravity.constant.setZero();
    test::add_on_rail(s, test::sphere_shape(radius), 1, {0, 0, 0});
    test::add_on_rail(s, test::sphere_shape(radius), 1, {10, 0, 0}, side * speed);
    test::collide_all(s, 0);
    Joint& rail = s.model.trees[1].joints[0];
    rail.lower = -0.05;
    rail.upper = 0.05;
    SimulationOptions options;
    options.step = s.step;
    options.event_cap = 0;
    Simulation simulation(s, options, find_method("ap")->make({}), anitescu_potra_law());
    for (int i = 0; i < 2; ++i) CHECK(simulation.step().status == Status::ok);
    CHECK(simulation.step().status == Status::event_stall);
    CHECK(simulation.reason() ==
          "joint rail1 and its limit come together more than 0 times in one step: at t = 0.0499999995 s, 0.01 s after "
          "the time before");
    CHECK(std::abs(simulation.state().q[1]) <= 0.05);
  }
}
