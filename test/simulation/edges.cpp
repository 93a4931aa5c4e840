// Steps that come to an end of what is taken for granted: answers that are none, what no displacement opens, joints of
// one tree beside each other, impacts that pile up.
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "closed_forms.h"
#include "simulation/base_step.h"

using namespace cb;
using namespace cb::test;

namespace {

/// A scene without gravity around the elements of <bodies>, and what follows them.
Scenario loaded(const std::string& bodies, const std::string& rest) {
  std::string folder = (std::filesystem::temp_directory_path() / "edges_").string() + std::string(6, 'X');
  REQUIRE(mkdtemp(folder.data()) != nullptr);
  const std::string path = folder + "/scene.xml";
  std::ofstream(path) << "<scenario title=\"test\"><simulation step=\"1e-3\" duration=\"1e-3\"/>"
                      << "<reference kind=\"missing\"/><gravity constant=\"0 0 0\"/><bodies>" << bodies << "</bodies>"
                      << rest << "</scenario>";
  const Scenario s = load_scenario(path, {});
  std::filesystem::remove_all(folder);
  return s;
}

SimulationOptions options_of(const Scenario& s, Stepping way) {
  SimulationOptions options;
  options.stepping = way;
  options.step = s.step;
  options.duration = s.duration;
  return options;
}

/// By steps, with a method of the scenes below.
Simulation by_steps(const Scenario& s, const std::string& method) {
  MethodOptions with;
  with.k = 8;
  return {s, options_of(s, Stepping::steps), find_method(method)->make(with), find_method(method)->law};
}

}  // namespace

TEST_CASE("impulses that are not finite end the run with what the method says of them") {
  Scenario s = empty_scene(1e-3, 1e-3);
  add_ground(s);
  add_sphere(s, 0.5, 1, {0, 0.5, 0});
  collide_all(s, 0.5);
  Simulation simulation(
      s, options_of(s, Stepping::events),
      [](const ContactProblem& p, ContactSolution& out) {
        out.impulse.assign(3 * static_cast<std::size_t>(p.nc()), std::nan(""));
        out.reason = "said on purpose";
      },
      newton_law());
  CHECK(simulation.step().status == Status::not_finite);
  CHECK(simulation.reason() == "said on purpose");
}

TEST_CASE("kinetic energy that no number holds ends the run as not finite") {
  Scenario s = empty_scene(1e-3, 1e-3);
  s.gravity.constant = {0, -1e200, 0};
  add_sphere(s, 0.5, 2, {0, 0, 0});
  collide_all(s, 0);
  Simulation simulation(s, options_of(s, Stepping::events), find_method("newton")->make({}), newton_law());
  CHECK(simulation.step().status == Status::not_finite);
  CHECK(simulation.reason() == "a velocity is not a finite number");
}

TEST_CASE("by steps nothing moves in a step to which there is no answer") {
  Scenario s = empty_scene(1e-2, 1e-2);
  add_ground(s);
  add_sphere(s, 0.5, 1, {0, 0.5, 0}, {1, 0, 0});
  collide_all(s, 0.5);
  Simulation simulation(
      s, options_of(s, Stepping::steps),
      [](const ContactProblem& p, ContactSolution& out) {
        out.status = Status::ray;
        out.impulse.assign(3 * static_cast<std::size_t>(p.nc()), 0.0);
      },
      newton_law());
  CHECK(simulation.step().status == Status::ray);
  CHECK(simulation.state().pose[0].p == Vec3(0, 0.5, 0));
}

TEST_CASE("by steps an answer that lets a joint go beyond a limit of its event is not asked for again") {
  // In a step it goes 0.2 m, and its stop is 0.05 m before it.
  Scenario s = empty_scene(1e-2, 1e-2);
  s.gravity.constant.setZero();
  add_on_rail(s, sphere_shape(0.5), 1, {0, 0, 0}, 20);
  s.model.trees[0].joints[0].upper = 0.05;
  collide_all(s, 0);
  int asked = 0;
  Simulation simulation(
      s, options_of(s, Stepping::steps),
      [&](const ContactProblem& p, ContactSolution& out) {
        if (++asked > 9) throw std::runtime_error("asked again and again");
        out.impulse.assign(3 * static_cast<std::size_t>(p.nc()), 0.0);
      },
      newton_law());
  CHECK(simulation.step().status == Status::inaccurate);
  CHECK(asked == 1);
}

TEST_CASE("by steps a joint that is struck goes no further than its limit, where another of its tree is at one") {
  // The rider's rail is on a carriage at its stop; what strikes the rider would take it 0.18 m along in the step.
  Scenario s = empty_scene(1e-2, 1e-2);
  s.gravity.constant.setZero();
  add_on_rail(s, sphere_shape(0.5), 1, {0, 0, 0});
  const int rider =
      add_free(s, sphere_shape(0.5), 1, Vec3::Ones(), {{0, 0, 5}, Quat::Identity()}, Vec3::Zero(), Vec3::Zero());
  Tree& tree = s.model.trees[0];
  tree.joints[0].upper = 0;
  Joint across;
  across.name = "across";
  across.kind = JointKind::prismatic;
  across.parent = across.up = 0;
  across.body = rider;
  across.anchor_P = {0, 0, 5};
  across.q = across.v = 1;
  across.upper = 0.05;
  tree.joints.push_back(across);
  tree.nv = 2;
  s.model.bodies[static_cast<std::size_t>(rider)].tree = 0;
  s.initial.q.push_back(0);
  s.initial.qd.push_back(0);
  add_sphere(s, 0.5, 10, {-1, 0, 5}, {20, 0, 0});
  collide_all(s, 0);
  for (const std::string method : {"ap", "coulomb"}) {
    INFO(method);
    Simulation simulation = by_steps(s, method);
    const Status status = simulation.step().status;
    INFO(simulation.reason());
    CHECK(status == Status::ok);
    CHECK(simulation.state().q[0] == Approx(0).margin(1e-8));
    CHECK(simulation.state().q[1] == Approx(0.05).margin(1e-8));
  }
}

TEST_CASE("by steps a ball that is struck goes through no wall that it would not have come to") {
  // Both gaps close, of 1 cm and of 1 mm.
  const double h = 0.01, r = 0.1;
  Scenario s = empty_scene(h, h);
  s.gravity.constant.setZero();
  add_ground(s, Quat::FromTwoVectors(Vec3::UnitY(), -Vec3::UnitX()));
  s.shapes[0].local.p = Vec3(3 * r + 0.011, 0, 0);
  add_sphere(s, r, 10, {0, 0, 0}, {20, 0, 0});
  add_sphere(s, r, 1, {2 * r + 0.01, 0, 0});
  collide_all(s, 0);
  for (const std::string method : {"ap", "convex", "coulomb"}) {
    INFO(method);
    Simulation simulation = by_steps(s, method);
    const StepRecord& record = simulation.step();
    INFO(simulation.reason());
    CHECK(record.status == Status::ok);
    CHECK(record.contacts == 2);
    CHECK(simulation.state().v[0] == Approx(1.1).epsilon(1e-8));
    CHECK(simulation.state().v[6] == Approx(0.1).epsilon(1e-8));
  }
}

TEST_CASE("boxes that slide at their own speeds, none of which turns, are asked about by their corners") {
  Scenario s = empty_scene(1e-2, 1);
  add_ground(s);
  for (const double speed : {1.0, 2.0}) {
    add_box(s, {1, 0.2, 1}, 2, {{3 * speed, 0.1, 0}, Quat::Identity()}, {speed, -0.1, 0});
    s.shapes.back().contact_grid = 3;
  }
  collide_all(s, 0);
  SimulationOptions options;
  options.step = s.step;
  options.prune.corners = Corners::suffice_unless_spin;
  BaseStep base(s, options, find_method("ap")->make({}), anitescu_potra_law());
  base.begin(1);
  base.kick(s.step);
  base.look(s.step);
  REQUIRE(base.approaching());
  REQUIRE(base.event(0));
  CHECK(base.problem().nc() == 8);
}

TEST_CASE("what an event leaves at rest within the ground is taken out of it, and does not wait there") {
  constexpr double depth = 1e-4;  // m
  Scenario s = empty_scene(1e-3, 5e-3);
  add_ground(s);
  add_sphere(s, 0.5, 1, {0, 0.5 - depth, 0});
  collide_all(s, 0.5);
  for (const Stepping way : {Stepping::events, Stepping::steps}) {
    SimulationOptions options = options_of(s, way);
    options.prune.repeats = true;
    Simulation simulation(s, options, find_method("coulomb")->make({}), find_method("coulomb")->law);
    for (int i = 0; i < 5; ++i) {
      const StepRecord& record = simulation.step();
      INFO("step " << record.step << ": " << simulation.reason());
      CHECK(record.status == Status::ok);
      CHECK(record.max_penetration < 1e-8);
      if (i == 0) CHECK(record.penetration_displacement == Approx(depth).epsilon(1e-3));
    }
    CHECK(simulation.state().pose[0].p.y() == Approx(0.5).margin(1e-8));
  }
}

TEST_CASE("what is within a link that cannot move is taken out of it, though that is within the ground itself") {
  // The foot is 0.05 micrometres in the ground, which nothing changes; the ball on it is 10 micrometres in the foot.
  const double foot_in = 5e-8, ball_in = 1e-5;
  Scenario s = loaded(R"(<half_space name="ground" point="0 0 0" normal="0 1 0"/>
<robot name="arm"><link name="base" mass="1" position="0 0.5 0" inertia="1 1 1">
<box name="foot" size="1 1 1" position="0 ${0.5-5e-8} 0"/></link>
<link name="bar" mass="3" position="5.5 2 0" inertia="1 1 1"/>
<joint name="mount" kind="fixed" parent="world" child="base"/>
<joint name="hinge" kind="revolute" parent="base" child="bar" anchor="5 2 0" axis="0 0 1"/></robot>
<sphere name="ball" radius="0.5" mass="1" position="0 ${1.5-5e-8-1e-5} 0"/>)",
                      R"(<contacts><pair a="*" b="*" mu="0"/></contacts>)");
  Simulation simulation(s, options_of(s, Stepping::events), find_method("newton")->make({}), newton_law());
  const StepRecord& record = simulation.step();
  INFO(simulation.reason());
  CHECK(record.status == Status::ok);
  CHECK(record.penetration_displacement == Approx(ball_in).epsilon(1e-3));
  CHECK(record.max_penetration == Approx(foot_in).epsilon(1e-3));
  CHECK(simulation.state().pose.back().p.y() == Approx(1.5 - foot_in).margin(1e-8));
}

TEST_CASE("a motor at its greatest torque has a mode of its own one way and the other") {
  const auto facet = [](const std::string& acceleration) {
    const Scenario s = loaded(
        R"(<robot name="pendulum"><link name="bar" mass="3" position="0.5 0 0" inertia="1e-3 0.25 0.25"/>
<joint name="hinge" kind="revolute" parent="world" child="bar" anchor="0 0 0" axis="0 0 1" torque_limit="0.25"/>
</robot>)",
        R"(<controllers><controller kind="computed_torque" robot="pendulum"><close joint="hinge" acceleration=")" +
            acceleration + R"("/></controller></controllers>)");
    BaseStep base(s, options_of(s, Stepping::events), find_method("newton")->make({}), newton_law());
    base.begin(1);
    base.kick(s.step);
    base.look(s.step);
    CHECK_FALSE(base.approaching());
    std::vector<BaseStep::Mode> modes;
    base.read_modes(modes);
    REQUIRE(modes.size() == 1);
    return modes[0].facet;
  };
  CHECK(facet("3") == 1);
  CHECK(facet("-3") == 2);
}

TEST_CASE("a contact that is let go is one point of one pair: the rest of its pair is held, and another pair's there") {
  // A box on its four corners, and two balls in one place that know nothing of each other.
  Scenario s = empty_scene(1e-2, 1);
  s.gravity.constant.setZero();
  add_ground(s);
  add_box(s, {1, 0.2, 1}, 2, {{0, 0.1, 0}, Quat::Identity()});
  for (int i = 0; i < 2; ++i) add_sphere(s, 0.1, 1, {3, 0.1, 0});
  collide(s, {{0, 1, 0.0}, {0, 2, 0.0}, {0, 3, 0.0}});
  BaseStep base(s, options_of(s, Stepping::events), find_method("newton")->make({}), newton_law());
  base.begin(1);
  base.kick(s.step);
  base.look(s.step);
  std::vector<ContactPoint> all, held;
  base.read_held(all);
  REQUIRE(all.size() == 6);
  for (const ContactPoint& gone : all) {
    base.release({gone});
    base.read_held(held);
    CHECK(held.size() == 5);
  }
}

TEST_CASE("where impacts pile up, as many steps of the smallest length as make a pile go on by events", "[accuracy]") {
  // Elastic balls, each of which comes down every 6 ms, one of them every 0.375 ms: 12 within 12 smallest steps.
  constexpr double gravity = 10, speed = 0.03, radius = 0.1, flight = 2 * speed / gravity;
  constexpr int balls = 16;
  Scenario s = empty_scene(1e-3, 0.03);
  s.gravity.constant = {0, -gravity, 0};
  add_ground(s);
  for (int i = 0; i < balls; ++i) {
    const double t = (i + 0.5) * flight / balls;
    add_sphere(s, radius, 1, {1.0 * i, radius + speed * t - gravity * t * t / 2, 0}, {0, speed - gravity * t, 0});
  }
  collide_all(s, 0, 1);
  SimulationOptions options = options_of(s, Stepping::accuracy);
  options.accuracy = 1e-6;
  options.smallest = 1e-3;
  Simulation simulation(s, options, find_method("newton")->make({}), newton_law());
  while (!simulation.done()) {
    const Status status = simulation.step().status;
    INFO(simulation.reason());
    REQUIRE(status == Status::ok);
  }
  CHECK(simulation.accuracy()->impacts >= 12);
  CHECK(simulation.accuracy()->first_order >= 12);
}
