// A run as a whole: what it takes from its scene, how many steps it has, and where they end.
#include "simulation/simulation.h"

#include <catch2/catch.hpp>

#include "scenes.h"

using namespace cb;

namespace {

ContactMethod method(const std::string& name) {
  MethodOptions options;
  options.epsilon = 1e-22;
  return find_method(name)->make(options);
}

}  // namespace

TEST_CASE("a simulation takes step, duration and joint forces from its scene, and nothing else") {
  Scenario s = test::empty_scene(2e-3, 0.7);
  SimulationOptions options;
  options.accuracy = 1e-4;
  options.stepping = Stepping::steps;
  options.joint_forces = JointForces::implicit;
  take_from(s, options);
  CHECK(options.step == 2e-3);
  CHECK(options.duration == 0.7);
  CHECK(options.joint_forces == JointForces::explicit_euler);
  s.implicit_joints = true;
  take_from(s, options);
  CHECK(options.joint_forces == JointForces::implicit);
  CHECK(options.accuracy == 1e-4);
  CHECK(options.stepping == Stepping::steps);
}

TEST_CASE("equal steps begin at the first multiple from a time on, however it is rounded") {
  CHECK(step_at(1, 0.1) == 10);
  CHECK(step_at(0.3, 0.1) == 3);      // 0.3 / 0.1 is a bit less than 3
  CHECK(step_at(0.7, 0.1) == 7);      // a bit less than 7
  CHECK(step_at(0.6, 0.2) == 3);      // 0.6 / 0.2 is a bit less than 3
  CHECK(step_at(3 * 0.1, 0.1) == 3);  // a bit more than 3
  CHECK(step_at(0.3001, 0.1) == 4);
  CHECK(step_at(0, 0.1) == 0);
  CHECK(step_at(1e30, 1e-3) == 1000000000000000000);
}

TEST_CASE("a run of equal steps ends with the first that reaches its duration, each at its own multiple of the step") {
  Scenario s = test::empty_scene(0.1, 0.75);
  s.gravity.constant.setZero();
  test::add_sphere(s, 0.5, 1, {0, 1, 0}, {1, 0, 0});
  test::collide_all(s, 0.5);
  for (const Stepping way : {Stepping::events, Stepping::steps}) {
    SimulationOptions options;
    take_from(s, options);
    options.stepping = way;
    Simulation simulation(s, options, method("ap"), find_method("ap")->law);
    CHECK(simulation.steps_total() == 8);
    CHECK(simulation.accuracy() == nullptr);
    for (int n = 1; n <= 8; ++n) {
      CHECK_FALSE(simulation.done());
      CHECK(simulation.step().step == n);
      CHECK(simulation.step_index() == n);
      CHECK(simulation.state().t == n * 0.1);
      CHECK(simulation.state().pose[0].p.x() == Approx(n * 0.1));
    }
    CHECK(simulation.done());
  }
}

TEST_CASE("stepping to an accuracy closes contacts to a tenth of it, beside bodies of any size") {
  // A ball falls on ground, a large one is far away: before the impact the ball's gap is that of a closed contact.
  const double accuracy = 1e-11;
  int impacts = 0;
  double worst = 0;
  for (int i = 0; i < 12; ++i) {
    Scenario s = test::empty_scene(1e-3, 1.5);
    test::add_ground(s);
    test::add_sphere(s, 0.5, 1, {0, 1 + 0.13 * i, 0}, {0.3, -0.2, 0});
    test::add_sphere(s, 50, 1, {1000, 50, 0});
    test::collide_all(s, 0, 0.5);
    SimulationOptions options;
    take_from(s, options);
    options.stepping = Stepping::accuracy;
    options.accuracy = accuracy;
    Simulation simulation(s, options, method("convex"), find_method("convex")->law);
    for (bool landed = false; !landed && !simulation.done();) {
      const double gap = simulation.state().pose[0].p.y() - 0.5;
      const StepRecord& record = simulation.step();
      REQUIRE(record.status == Status::ok);
      landed = record.accuracy->impact;
      if (!landed) continue;
      ++impacts;
      worst = std::max(worst, std::abs(gap));
    }
  }
  INFO("gap " << worst);
  CHECK(impacts == 12);
  CHECK(worst <= 0.1 * accuracy + 1e-15);
}

TEST_CASE("a body within a closed gap of the ground touches it, however small another one is") {
  // The cube's gap is a half of one that counts as closed, and five times what pairs are widened by for the ball of
  // 0.1 mm alone. It is pushed down from the second step on, by 9.8e-6 m in a step if the ground is not there.
  Scenario s = test::empty_scene(1e-3, 3e-3);
  s.gravity.constant = Vec3::Zero();
  test::add_ground(s);
  test::add_box(s, {1, 1, 1}, 1, {{0, 0.5 + 5e-10, 0}, Quat::Identity()});
  test::add_sphere(s, 5e-5, 1, {5, 1, 0});
  s.forces.push_back({0, {0, -9.8, 0}, 1e-3, 1});
  test::collide_all(s, 0);
  SimulationOptions options;
  take_from(s, options);
  Simulation simulation(s, options, find_method("ap")->make({}), find_method("ap")->law);
  while (!simulation.done()) {
    const StepRecord& record = simulation.step();
    REQUIRE(record.status == Status::ok);
    CHECK(record.penetration_inside <= 1e-9);
  }
  CHECK(simulation.state().pose[0].p.y() == Approx(0.5 + 5e-10).margin(1e-12));
}

TEST_CASE("to an accuracy forces act from when each begins to when it ends, in whatever order they are listed") {
  // On 2 kg: 2 m/s^2 along x from 0.5 s to 0.8 s, 3 m/s^2 along y from 0.1 s to 0.3 s.
  const Force later{0, {4, 0, 0}, 0.5, 0.8}, sooner{0, {0, 6, 0}, 0.1, 0.3};
  for (const bool in_order : {true, false}) {
    INFO((in_order ? "in order" : "the later one first"));
    Scenario s = test::empty_scene(1e-3, 1);
    s.gravity.constant.setZero();
    test::add_sphere(s, 0.5, 2, {0, 0, 0});
    test::collide_all(s, 0);
    s.forces = {in_order ? sooner : later, in_order ? later : sooner};
    SimulationOptions options;
    take_from(s, options);
    options.stepping = Stepping::accuracy;
    Simulation simulation(s, options, method("convex"), find_method("convex")->law);
    while (!simulation.done()) REQUIRE(simulation.step().status == Status::ok);
    const State& state = simulation.state();
    CHECK(state.v[0] == Approx(2 * 0.3).epsilon(1e-9));
    CHECK(state.v[1] == Approx(3 * 0.2).epsilon(1e-9));
    CHECK(state.pose[0].p.x() == Approx(0.09 + 0.6 * 0.2).epsilon(1e-5));
    CHECK(state.pose[0].p.y() == Approx(0.06 + 0.6 * 0.7).epsilon(1e-5));
  }
}
