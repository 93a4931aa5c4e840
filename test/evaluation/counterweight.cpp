// When the mobile robot's counterweight lifts a wheel: the simulated robot against a model of one pitch angle.
//
// The counterweight is a rod of moment I about pitch and roll that stands upright and turns with the robot at the rate
// w. Held level across by the two wheels, it is free to pitch by theta: centrifugal moments tip it over, the motors
// push it back,
//   I theta'' = I w^2 theta - m h u'                                                (1)
// m, h, u: mass, height of its centre, speed forward. To turn with the robot it needs the moment about roll
//   I (2 w theta' + w' theta)                                                       (2)
// which the wheels can give up to m g L / 2 (L: axle). I theta, and so (2), does not depend on I: no counterweight is
// heavy enough.
#include <catch2/catch.hpp>
#include <string>

#include "evaluation/no_slip_drive.h"
#include "methods/registry.h"
#include "simulation/simulation.h"

using namespace cb;

namespace {

constexpr double height = 0.2, inertia = 1e10, gravity = 9.8;  // m, kg m^2, m/s^2

/// Time at which (2) is more than the wheels can give, s.
double lifting_time(const WheeledRobot& robot, const WheeledRobot::State& start, double moment, double end) {
  NoSlipDrive drive(robot, start);
  WheeledRobot::State last = start;
  double theta = 0, rate = 0;
  constexpr double dt = 1e-3;
  for (double t = dt; t < end; t += dt) {
    const WheeledRobot::State now = drive.at(t);
    const double acceleration = (now.speed - last.speed) / dt, turning_rate = (now.turning - last.turning) / dt;
    const double w = (now.turning + last.turning) / 2;
    rate += dt * (w * w * theta - robot.mass * height * acceleration / moment);
    theta += dt * rate;
    if (std::abs(moment * (2 * w * rate + turning_rate * theta)) > robot.mass * gravity * robot.axle / 2) return t;
    last = now;
  }
  return end;
}

}  // namespace

TEST_CASE("A counterweight of any inertia lifts a wheel of the mobile robot once its pitch has grown with the yaw") {
  const Scenario scenario = load_scenario(std::string(SOURCE_ROOT) + "/scenarios/mobile_robot.xml", {});
  const std::optional<WheeledRobot> robot = wheeled_robot(scenario);
  REQUIRE(robot);
  const WheeledRobot::State start = robot->state_of(scenario.initial);
  constexpr double end = 30;
  const double predicted = lifting_time(*robot, start, inertia, end);
  CHECK(predicted < end);
  for (const double other : {1e8, 1e15})
    CHECK(lifting_time(*robot, start, other, end) == Approx(predicted).margin(0.01));

  // The simulated robot: both wheels carry well over a twentieth of the load until then, and one next to nothing after.
  SimulationOptions options;
  options.step = scenario.step;
  options.duration = predicted + 0.5;
  MethodOptions unbounded;
  unbounded.compression_bound = false;
  Simulation simulation(scenario, options, find_method("convex")->make(unbounded), convex_law());
  double lesser = 1, lifted = end;
  simulation.on_event = [&](const EventRecord& event) {
    REQUIRE(event.contacts.size() == 2);
    const double a = event.solution.impulse[0], b = event.solution.impulse[3];
    lesser = std::min(a, b) / (a + b);
    if (event.t < predicted - 0.5) CHECK(lesser > 0.05);
    if (lesser < 0.01) lifted = std::min(lifted, event.t);
  };
  while (simulation.step_index() < simulation.steps_total()) {
    const Status status = simulation.step().status;
    REQUIRE((status == Status::ok || status == Status::inaccurate));
  }
  CHECK(lifted == Approx(predicted).margin(0.25));
  CHECK(lesser < 0.01);
}
