#include "simulation/bounces.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "scenes.h"
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

Seen look(const Scenario& s, const std::string& name) {
  SimulationOptions options;
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

TEST_CASE("elastic balls of masses 1 and 100^k at a wall meet as often as the digits of pi say, within one step") {
  // Galperin (2003): in the plane of sqrt(m) x the pair is a point in a wedge of angle atan(sqrt(m / M)), and unfolds
  // to a straight line through floor(pi / angle) of its walls.
  for (const auto& [heavy, meetings] : {std::pair(1.0, 3), std::pair(1e2, 31), std::pair(1e4, 314)}) {
    const Seen seen = look(squeezed(heavy, 1, 10, 10), "ap");
    CHECK(seen.status == Status::ok);
    CHECK(seen.events == meetings);
    CHECK(seen.left_out == 0);
    const double v = seen.state.v[1], V = seen.state.v[7];
    CHECK((v * v + heavy * V * V) / (heavy * speed * speed) == Approx(1).epsilon(1e-12));
  }
}

TEST_CASE("a ball squeezed between a heavy one and the ground ends in contact with both, whatever the restitution") {
  // Infinitely many bounces in finite time, for e < 1: then the heavy ball stands on the light one.
  for (const double e : {0.1, 0.5, 0.9, 0.98})
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
  Simulation simulation(s, options, find_method("ap")->make({}), Law::anitescu_potra);
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
    bounces.impact();
  }
  CHECK_FALSE(bounces.over(a, 0.5));  // 0.5^9 = 1.95e-3
  CHECK(bounces.over(a, 0.4));
  CHECK(bounces.arrive(b) == 1);
  bounces.impact();
  bounces.arrive(a);
  bounces.impact();
  CHECK(bounces.over(a, 0.5));  // 9.8e-4
  CHECK_FALSE(bounces.over(b, 0.5));
  CHECK_FALSE(bounces.over(a, 1));  // nothing is lost
  CHECK_FALSE(bounces.over(a, 0));  // nothing is left out
  bounces.clear();
  CHECK_FALSE(bounces.over(a, 0.5));
}
