// Robots in the step: joints, motors, limits, links that touch.
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "closed_forms.h"
#include "dynamics/free_bodies.h"
#include "simulation/explicit_step.h"
#include "simulation/simulation.h"

using namespace cb;
using cb::test::rigid_methods;

namespace {

/// A scene around the elements of <bodies>, and what follows them.
Scenario scene(const std::string& bodies, const std::string& rest, double h, double duration,
               const std::string& gravity = "0 -9.8 0") {
  std::string folder = (std::filesystem::temp_directory_path() / "robots_").string() + std::string(6, 'X');
  REQUIRE(mkdtemp(folder.data()) != nullptr);
  const std::string path = folder + "/scene.xml";
  std::ofstream(path) << "<scenario title=\"test\"><simulation step=\"" << h << "\" duration=\"" << duration
                      << "\"/><reference kind=\"missing\"/><gravity constant=\"" << gravity << "\"/><bodies>" << bodies
                      << "</bodies>" << rest << "</scenario>";
  const Scenario s = load_scenario(path, {});
  std::filesystem::remove_all(folder);
  return s;
}

ContactMethod method(const std::string& name, bool bounded = true) {
  MethodOptions options;
  options.k = 8;
  options.compression_bound = bounded;
  return find_method(name)->make(options);
}

SimulationOptions options_of(const Scenario& s) {
  SimulationOptions options;
  options.step = s.step;
  options.duration = s.duration;
  return options;
}

double energy(const Scenario& s, const State& state) {
  return kinetic_energy(s.model, state) + potential_energy(s.model, state, s.gravity.constant);
}

// A bar of 1 m and 3 kg on a hinge at its upper end: 1 kg m^2 about it. Let go level, it falls to a limit.
std::string pendulum(const std::string& attributes) {
  return R"(<robot name="pendulum"><link name="bar" mass="3" position="0.5 0 0" inertia="1e-3 0.25 0.25"/>
    <joint name="hinge" kind="revolute" parent="world" child="bar" anchor="0 0 0" axis="0 0 1" )" +
         attributes + "/></robot>";
}

}  // namespace

TEST_CASE("a pendulum that meets its limit stops there, with every method, and costs no energy") {
  for (const MethodRow& row : rigid_methods()) {
    INFO(row.name);
    const Scenario s = scene(pendulum("lower=\"-0.5\""), "", 1e-3, 1);
    Simulation simulation(s, options_of(s), method(std::string(row.name)), row.law);
    int limits = 0;
    double before = 0, after = 0;
    simulation.on_event = [&](const EventRecord& event) {
      REQUIRE(event.limits.size() == 1);
      CHECK(event.contacts.empty());
      if (limits++ > 0) return;
      // A torque impulse of the bar's moment times its rate stops it.
      before = event.problem.v_minus[0];
      after = event.v_plus[0];
      CHECK(event.solution.impulse[0] == Approx(-1 * before).epsilon(1e-9));
      // Falling by sin(0.5) / 2: 1/2 I w^2 = m g sin(0.5) / 2 up to the step's first order.
      CHECK(before == Approx(-std::sqrt(3 * 9.8 * std::sin(0.5))).epsilon(5e-3));
    };
    while (simulation.step_index() < simulation.steps_total()) {
      const StepRecord& record = simulation.step();
      REQUIRE(record.status == Status::ok);
      REQUIRE(record.events <= 1);
      REQUIRE(simulation.state().q[0] > -0.5 - 1e-9);
    }
    CHECK(limits > 500);  // once hit, then held step by step
    CHECK(std::abs(after) < 1e-9);
    CHECK(simulation.state().q[0] == Approx(-0.5).margin(1e-9));
    CHECK(std::abs(simulation.state().qd[0]) < 1e-9);
  }
}

TEST_CASE("joints that their limits have stopped stand to the last bit") {
  // What is left would be all that the next event is about at a limit: 9e-19 rad/s, which lemke's pivots do not see.
  // Newton's and Mirtich's impulses, limit after limit, end before.
  for (const char* name : {"ap", "convex", "coulomb"}) {
    INFO(name);
    const Scenario s =
        scene(R"(<robot name="arm"><link name="upper" mass="3" position="0.5 0 0" inertia="1e-3 0.25 0.25"/>
      <link name="lower" mass="1.7" position="1.3 0 0" inertia="1e-3 0.1 0.1"/>
      <joint name="shoulder" kind="revolute" parent="world" child="upper" anchor="0 0 0" axis="0 0 1" lower="-0.3"/>
      <joint name="elbow" kind="revolute" parent="upper" child="lower" anchor="1 0 0" axis="0 0 1" lower="-0.2"/></robot>)",
              "", 1e-3, 1);
    Simulation simulation(s, options_of(s), method(name), find_method(name)->law);
    while (simulation.step_index() < simulation.steps_total()) REQUIRE(simulation.step().status == Status::ok);
    CHECK(simulation.state().qd == std::vector<double>{0, 0});
  }
}

TEST_CASE("a limit that moves takes the joint along, and what the joint pushes; between two it has no other rate") {
  for (const std::string limits : {"lower=\"0\"", "lower=\"0\" upper=\"0\""}) {
    const std::string ram = R"(<robot name="press"><link name="ram" mass="2" position="0 0 0" inertia="1 1 1">
      <sphere name="head" radius="0.5" position="0 0 0"/></link>
      <joint name="rail" kind="prismatic" parent="world" child="ram" axis="1 0 0" limit_rate="0.5" )" +
                            limits + R"(/></robot><sphere name="ball" radius="0.5" mass="3" position="1.1 0 0"/>)";
    const Scenario s = scene(ram, "<contacts><pair a=\"ball\" b=\"head\" mu=\"0\"/></contacts>", 1e-3, 1, "-9.8 0 0");
    for (const MethodRow& row : rigid_methods()) {
      INFO(row.name << ", " << limits);
      Simulation simulation(s, options_of(s), method(std::string(row.name)), row.law);
      while (simulation.step_index() < simulation.steps_total()) REQUIRE(simulation.step().status == Status::ok);
      CHECK(simulation.state().q[0] == Approx(0.5).epsilon(1e-8));
      CHECK(simulation.state().pose[1].p[0] == Approx(1.5).epsilon(1e-8));  // in touch, e = 0
    }
  }
}

TEST_CASE("joints that are driven have their rates after a step, too, whatever the energy of where they come to") {
  const Scenario s =
      scene(R"(<robot name="arm"><link name="upper" mass="3" position="0.5 0 0" inertia="1e-2 0.25 0.25"/>
      <link name="lower" mass="2" position="1.5 0 0" inertia="1e-2 0.2 0.2"/>
      <joint name="shoulder" kind="revolute" parent="world" child="upper" anchor="0 0 0" axis="0 0 1" lower="0" upper="0"
             limit_rate="0.5" velocity="0.5"/>
      <joint name="elbow" kind="revolute" parent="upper" child="lower" anchor="1 0 0" axis="0 0 1" lower="0" upper="0"
             limit_rate="2" velocity="2"/></robot>)",
            "", 1e-2, 1);
  for (const Stepping way : {Stepping::events, Stepping::steps}) {
    SimulationOptions options = options_of(s);
    options.stepping = way;
    Simulation simulation(s, options, method("newton"), find_method("newton")->law);
    while (simulation.step_index() < simulation.steps_total()) {
      REQUIRE(simulation.step().status == Status::ok);
      CHECK(simulation.state().qd == std::vector<double>{0.5, 2});
    }
    CHECK(simulation.state().q[0] == Approx(0.5).epsilon(1e-12));
    CHECK(simulation.state().q[1] == Approx(2).epsilon(1e-12));
  }
}

TEST_CASE("a belt that the rounding of many steps has taken off its stops is driven on") {
  // As after some minutes, to either side: the closed gap of joints is 1e-9.
  for (const double off : {3e-9, -3e-9}) {
    Scenario s = scene(R"(<robot name="conveyor"><link name="band" mass="10" position="0 -0.05 0" inertia="1 10 10">
      <box name="belt" size="8 0.1 2" position="0 -0.05 0"/></link>
      <joint name="run" kind="prismatic" parent="world" child="band" axis="1 0 0" lower="0" upper="0" limit_rate="0.5"
             velocity="0.5"/></robot><box name="box" size="0.2 0.2 0.2" mass="1" position="0 0.1 0"/>)",
                       "<contacts><pair a=\"belt\" b=\"box\" mu=\"0.5\"/></contacts>", 1e-3, 1e-2);
    s.initial.q[0] = off;
    Simulation simulation(s, options_of(s), method("ap"), find_method("ap")->law);
    int events = 0;
    simulation.on_event = [&](const EventRecord& event) {
      ++events;
      CHECK(event.problem.M.blocks() == 1);
      CHECK(event.limits.empty());
    };
    while (simulation.step_index() < simulation.steps_total()) REQUIRE(simulation.step().status == Status::ok);
    CHECK(events >= 10);
    CHECK(simulation.state().v[6] == Approx(0.5 * 9.8 * 1e-2));
  }
}

TEST_CASE("a joint meets a limit that moves where and when it is there") {
  // From 0 at -1 towards -0.5, which comes at 0.25: after 0.4 s, inside a step.
  const std::string ram = R"(<robot name="press"><link name="ram" mass="2" position="0 0 0" inertia="1 1 1"/>
      <joint name="rail" kind="prismatic" parent="world" child="ram" axis="1 0 0" lower="-0.5" limit_rate="0.25" velocity="-1"/></robot>)";
  const Scenario s = scene(ram, "", 0.3, 0.9, "0 0 0");
  Simulation simulation(s, options_of(s), method("newton"), find_method("newton")->law);
  std::vector<double> at;
  simulation.on_event = [&](const EventRecord& event) { at.push_back(event.t); };
  while (simulation.step_index() < simulation.steps_total()) {
    REQUIRE(simulation.step().status == Status::ok);
    const double t = simulation.state().t;
    CHECK(simulation.state().q[0] == Approx(std::max(-t, -0.5 + 0.25 * t)).epsilon(1e-7));
  }
  REQUIRE_FALSE(at.empty());
  CHECK(at.front() == Approx(0.4).epsilon(1e-7));
  CHECK(simulation.state().qd[0] == Approx(0.25));
}

// A limit that hardly moves and one at 1 m/s: what the second puts in is 1e8 times what the first does, and a ball that
// lands in the same event has nearly nothing.
TEST_CASE("the work of every limit that moves counts as put in") {
  const auto ram = [](const std::string& name, const std::string& rate) {
    return "<robot name=\"" + name + R"("><link name=")" + name + R"(_ram" mass="1" position="0 0 0" inertia="1 1 1"/>
      <joint name=")" +
           name + R"(_rail" kind="prismatic" parent="world" child=")" + name +
           R"(_ram" axis="1 0 0" lower="0" limit_rate=")" + rate + R"("/></robot>)";
  };
  for (const bool slow_first : {true, false}) {
    const std::string ball = R"(<half_space name="ground" point="0 -0.1 0" normal="0 1 0"/>
      <sphere name="ball" radius="0.1" mass="1" position="5 0 0" velocity="0 -1e-5 0"/>)";
    const Scenario s = scene(ball + ram("a", slow_first ? "1e-4" : "1") + ram("b", slow_first ? "1" : "1e-4"),
                             "<contacts><pair a=\"ball\" b=\"ground\" mu=\"0\"/></contacts>", 1e-3, 0.01, "0 0 0");
    Simulation simulation(s, options_of(s), method("newton"), find_method("newton")->law);
    while (simulation.step_index() < simulation.steps_total()) REQUIRE(simulation.step().status == Status::ok);
    CHECK(simulation.state().qd[slow_first ? 1 : 0] == Approx(1));
  }
}

TEST_CASE("a driven joint that pushes a body into a wall ends there, as infeasible, with every method") {
  const Scenario s = scene(R"(<half_space name="wall" point="1.6 0 0" normal="-1 0 0"/>
    <robot name="press"><link name="ram" mass="2" position="0 0 0" inertia="1 1 1">
    <sphere name="head" radius="0.5" position="0 0 0"/></link>
    <joint name="rail" kind="prismatic" parent="world" child="ram" axis="1 0 0" lower="0" limit_rate="0.5"/></robot>
    <sphere name="ball" radius="0.5" mass="3" position="1 0 0"/>)",
                           "<contacts><pair a=\"ball\" b=\"*\" mu=\"0.3\"/></contacts>", 1e-3, 1, "-9.8 0 0");
  for (const MethodRow& row : rigid_methods()) {
    INFO(row.name);
    Simulation simulation(s, options_of(s), method(std::string(row.name)), row.law);
    Status status = Status::ok;
    while (simulation.step_index() < simulation.steps_total() && status == Status::ok)
      status = simulation.step().status;
    CHECK(status != Status::ok);
    CHECK(status != Status::inaccurate);
    CHECK(simulation.state().t == Approx(0.2).margin(2e-3));  // the gap of 0.1 m at 0.5 m/s
    CHECK(simulation.reason().starts_with("infeasible"));
  }
}

TEST_CASE("a link on the ground carries the weight that the lever gives it") {
  // The bar's far end is a ball on the ground, level: the ground carries half of the weight, the hinge the other half.
  const std::string robot = R"(<half_space name="ground" point="0 -0.1 0" normal="0 1 0"/>
    <robot name="lever"><link name="bar" mass="3" position="0.5 0 0" inertia="1e-3 0.25 0.25">
    <sphere name="tip" radius="0.1" position="1 0 0"/></link>
    <joint name="hinge" kind="revolute" parent="world" child="bar" anchor="0 0 0" axis="0 0 1"/></robot>)";
  const Scenario s = scene(robot, "<contacts><pair a=\"tip\" b=\"ground\" mu=\"0\"/></contacts>", 1e-3, 0.2);
  for (const MethodRow& row : rigid_methods()) {
    INFO(row.name);
    Simulation simulation(s, options_of(s), method(std::string(row.name)), row.law);
    simulation.on_event = [&](const EventRecord& event) {
      CHECK(event.solution.impulse[0] == Approx(3 * 9.8 / 2 * 1e-3).epsilon(1e-9));
    };
    while (simulation.step_index() < simulation.steps_total()) {
      const StepRecord& record = simulation.step();
      REQUIRE(record.status == Status::ok);
      REQUIRE(record.events == 1);
    }
    CHECK(std::abs(simulation.state().q[0]) < 1e-9);
  }
}

TEST_CASE("the energy of a robot that nothing touches holds to the order of the step") {
  double error[3];
  for (int k = 0; k < 3; ++k) {
    const Scenario s =
        scene(R"(<robot name="double"><link name="upper" mass="1" position="0.3 0 0" inertia="1e-3 0.02 0.02"/>
      <link name="lower" mass="2" position="0.8 0 0" inertia="1e-3 0.03 0.03"/>
      <joint name="a" kind="revolute" parent="world" child="upper" anchor="0 0 0" axis="0 0 1"/>
      <joint name="b" kind="revolute" parent="upper" child="lower" anchor="0.5 0 0" axis="0 1 1" velocity="2"/></robot>)",
              "", 1e-3 / (1 << k), 1);
    Simulation simulation(s, options_of(s), method("ap"), find_method("ap")->law);
    const double before = energy(s, simulation.state());
    while (simulation.step_index() < simulation.steps_total()) REQUIRE(simulation.step().status == Status::ok);
    error[k] = std::abs(energy(s, simulation.state()) - before);
  }
  CHECK(error[0] / error[1] == Approx(2).epsilon(0.15));
  CHECK(error[1] / error[2] == Approx(2).epsilon(0.15));
}

TEST_CASE("viscous friction in a joint takes the spin away as 1 / (1 + h d / I) a step, and the motor's limit holds") {
  const Scenario s = scene(pendulum("velocity=\"2\" damping=\"0.5\""), "", 1e-3, 0.5, "0 0 0");
  Simulation simulation(s, options_of(s), method("ap"), find_method("ap")->law);
  while (simulation.step_index() < simulation.steps_total()) simulation.step();
  CHECK(simulation.state().qd[0] == Approx(2 * std::pow(1 + 1e-3 * 0.5, -500)).epsilon(1e-12));

  // A motor of at most 0.25 N m that should accelerate 1 kg m^2 by 3 rad/s^2.
  const Scenario weak = scene(pendulum("torque_limit=\"0.25\""),
                              R"(<controllers><controller kind="computed_torque" robot="pendulum">
    <close joint="hinge" acceleration="3"/></controller></controllers>)",
                              1e-3, 0.1, "0 0 0");
  Simulation limited(weak, options_of(weak), method("ap"), find_method("ap")->law);
  while (limited.step_index() < limited.steps_total()) limited.step();
  CHECK(limited.torque()[0] == 0.25);
  CHECK(limited.state().qd[0] == Approx(0.25 * 0.1).epsilon(1e-12));
}

TEST_CASE("motors inside a floating robot do not push it away") {
  const Scenario s = scene(R"(<robot name="satellite"><link name="hull" mass="10" position="0 0 0" inertia="1 2 3"/>
    <link name="boom" mass="1" position="0.5 0 0" inertia="0.01 0.1 0.1"/>
    <joint name="space" kind="free" parent="world" child="hull"/>
    <joint name="motor" kind="revolute" parent="hull" child="boom" anchor="0.2 0 0" axis="0 1 0"/></robot>)",
                           R"(<controllers><controller kind="computed_torque" robot="satellite">
    <track joint="motor" amplitude="1" frequency="2"/></controller></controllers>)",
                           1e-4, 1, "0 0 0");
  Simulation simulation(s, options_of(s), method("ap"), find_method("ap")->law);
  while (simulation.step_index() < simulation.steps_total()) REQUIRE(simulation.step().status == Status::ok);
  const State& state = simulation.state();
  const Vec3 centre = (10 * state.pose[0].p + 1 * state.pose[1].p) / 11;
  CHECK((centre - Vec3(0.5 / 11, 0, 0)).norm() < 1e-4);  // first order in the step
  CHECK(std::abs(state.q[0]) > 0.3);
  CHECK(std::abs(Vec3(&state.v[3]).y()) > 0.01);  // the hull turns against the boom
}

// A ball of 0.1 m at 1 m from the hinge, lowest where it begins: a straight line from there never meets the ceiling
// 0.15 m above it, the arc does at cos(angle) = 0.85.
TEST_CASE("a link that whirls stops at the plane that its arc meets, however far it turns in a step") {
  for (const double rate : {100.0, 800.0, 3000.0}) {
    INFO(rate << " rad/s");
    const Scenario s = scene(R"(<half_space name="ceiling" point="0 -0.8 0" normal="0 -1 0"/>
      <robot name="whirl"><link name="arm" mass="1" position="0 -1 0" inertia="0.1 0.1 0.1">
        <sphere name="ball" radius="0.05" position="0 -1 0"/></link>
      <joint name="hinge" kind="revolute" parent="world" child="arm" anchor="0 0 0" axis="0 0 1" velocity=")" +
                                 std::to_string(rate) + R"("/></robot>)",
                             R"(<contacts><pair a="ball" b="ceiling" mu="0"/></contacts>)", 1e-3, 0.01, "0 0 0");
    Simulation simulation(s, options_of(s), method("ap"), anitescu_potra_law());
    while (simulation.step_index() < simulation.steps_total()) REQUIRE(simulation.step().status == Status::ok);
    CHECK(simulation.state().q[0] == Approx(std::acos(0.85)).margin(1e-8));
    CHECK(std::abs(simulation.state().qd[0]) < 1e-9 * rate);
  }
}

TEST_CASE("two links of one robot that touch stop each other") {
  // Two fingers on one palm close on each other's tips with opposite torques.
  const Scenario s = scene(R"(<robot name="claw"><link name="l" mass="1" position="-0.1 -0.5 0" inertia="0.1 0.1 0.1">
    <sphere name="tip_l" radius="0.05" position="-0.1 -1 0"/></link>
    <link name="r" mass="1" position="0.1 -0.5 0" inertia="0.1 0.1 0.1">
    <sphere name="tip_r" radius="0.05" position="0.1 -1 0"/></link>
    <joint name="left" kind="revolute" parent="world" child="l" anchor="-0.1 0 0" axis="0 0 1"/>
    <joint name="right" kind="revolute" parent="world" child="r" anchor="0.1 0 0" axis="0 0 -1"/></robot>)",
                           R"(<contacts><pair a="tip_l" b="tip_r" mu="0.3"/></contacts>
    <controllers><controller kind="computed_torque" robot="claw"><close joint="left" acceleration="2"/>
    <close joint="right" acceleration="2"/></controller></controllers>)",
                           1e-3, 1);
  for (const MethodRow& row : rigid_methods()) {
    INFO(row.name);
    Simulation simulation(s, options_of(s), method(std::string(row.name)), row.law);
    double deepest = 0;
    while (simulation.step_index() < simulation.steps_total()) {
      const StepRecord& record = simulation.step();
      REQUIRE((record.status == Status::ok || record.status == Status::inaccurate));
      deepest = std::max(deepest, record.max_penetration);
    }
    const State& state = simulation.state();
    CHECK(std::abs(state.qd[0]) < 1e-6);
    CHECK(state.q[0] == Approx(state.q[1]).margin(1e-6));
    // 0.1 cos q - ... : tips are 2 (0.1 - sin q) apart, less two radii.
    CHECK(std::sin(state.q[0]) == Approx(0.05).margin(1e-6));
    CHECK(deepest < 1e-6);
  }
}

TEST_CASE("a box between two fingers is held, one event a step, and creeps by the first order of the step") {
  double creep[3];
  for (int k = 0; k < 3; ++k) {
    const Scenario s = load_scenario(find_scenario("grasp"), {});
    SimulationOptions options = options_of(s);
    options.step = 2e-3 / (1 << k);
    options.duration = 0.5;
    Simulation simulation(s, options, method("convex", false), find_method("convex")->law);
    const int box = 8, finger = 6;
    const auto place = [&] {
      const State& state = simulation.state();
      return Vec3(state.pose[finger].q.conjugate() * (state.pose[box].p - state.pose[finger].p));
    };
    const Vec3 start = place();
    double deepest = 0;
    while (simulation.step_index() < simulation.steps_total()) {
      const StepRecord& record = simulation.step();
      REQUIRE(record.status == Status::ok);
      REQUIRE(record.events == 1);
      deepest = std::max(deepest, record.max_penetration);
    }
    creep[k] = (place() - start).norm();
    CHECK(deepest < 1e-10);
  }
  CHECK(std::log2(creep[0] / creep[1]) > 0.9);
  CHECK(std::log2(creep[1] / creep[2]) > 0.9);
  CHECK(creep[1] < 1e-4);
}

// Semi-implicit Euler of an undamped spring: h^2 k/m < 4; two equal ones on end: (3 + sqrt 5)/2 k/m. A damper alone: h
// c/m < 2. With both, an eigenvalue -1: 4 - 2 h c/m - h^2 k/m = 0. A rod on end falls at any step: that is no
// instability of the step.
TEST_CASE("the largest stable step of springs and dampers is that of the linearised step", "[robots]") {
  const std::string file = SOURCE_ROOT "/scenarios/stress/stiff_joints.xml";
  const double mode = (3 + std::sqrt(5.0)) / 2;
  CHECK(*largest_stable_step(load_scenario(file, {{"stiffness", "1e3"}})) ==
        Approx(2 / std::sqrt(mode * 1e3)).epsilon(1e-3));
  CHECK(*largest_stable_step(load_scenario(file, {{"stiffness", "0"}, {"damping", "10"}})) ==
        Approx(2 / (mode * 10)).epsilon(1e-3));
  const double c = 10 * mode, k = 1e3 * mode;
  CHECK(*largest_stable_step(load_scenario(file, {{"stiffness", "0"}, {"kp", "1e3"}, {"kv", "10"}})) ==
        Approx((std::sqrt(c * c + 4 * k) - c) / k).epsilon(1e-3));
  CHECK_FALSE(largest_stable_step(load_scenario(find_scenario("sticking_box"), {})).has_value());
  CHECK_FALSE(largest_stable_step(scene(pendulum("velocity=\"2\""), "", 1e-3, 0.01)).has_value());

  // Beyond it energy grows, up to a typed ending.
  const Scenario s = load_scenario(file, {});
  for (const double factor : {0.99, 1.05}) {
    SimulationOptions options = options_of(s);
    options.step = factor * *largest_stable_step(s);
    options.duration = 2000 * options.step;
    Simulation simulation(s, options, method("newton"), find_method("newton")->law);
    Status ending = Status::ok;
    while (ending == Status::ok && simulation.step_index() < simulation.steps_total())
      ending = simulation.step().status;
    CHECK(ending == (factor < 1 ? Status::ok : Status::energy_blowup));
  }
}

// Of a bar that hangs, weight and spring: q'' = -(w + k) q, k at the step's end. Explicit h^2 (w + k) <= 4; else the
// step's matrix has 1 + trace + determinant = 4 + h^2 k - h^2 w over 1 + h^2 k, which is 0 at the limit.
TEST_CASE("a spring at the step's end takes its part of the stiffness and of the damping from the limit", "[robots]") {
  const double w = 3 * 9.8 * 0.5, k = 5;
  const Scenario s = scene(pendulum("stiffness=\"5\""), "", 1e-3, 1, "9.8 0 0");
  CHECK(*largest_stable_step(s) == Approx(2 / std::sqrt(w + k)).epsilon(1e-3));
  CHECK(*largest_stable_step(s, JointForces::implicit) == Approx(2 / std::sqrt(w - k)).epsilon(1e-3));
}

TEST_CASE("a motor's rate and angle taken at the step's end brake it by 1 + h d + h^2 k", "[robots]") {
  const Scenario s =
      scene(pendulum(""), R"(<controllers><controller kind="computed_torque" robot="pendulum" kp="1e3" kd="10">
    <track joint="hinge"/></controller></controllers>)",
            1e-3, 1);
  const double h = 0.1, d = 10, k = 1e3;
  CHECK(*largest_eigenvalue(s, h, JointForces::explicit_euler) == Approx(h * d).epsilon(1e-6));
  CHECK(*largest_eigenvalue(s, h, JointForces::implicit) == Approx(h * d / (1 + h * d + h * h * k)).epsilon(1e-6));
}

TEST_CASE("a bar that turns about its centre is given no energy", "[robots]") {
  const std::string wheel = R"(<robot name="wheel"><link name="bar" mass="3" position="0 0 0" inertia="1e-3 0.25 0.25"/>
    <joint name="hinge" kind="revolute" parent="world" child="bar" anchor="0 0 0" axis="0 0 1" velocity="2"/></robot>)";
  const Scenario s = scene(wheel, "", 1e-3, 0.01);
  for (const double factor : {1 - 1e-9, 1 + 1e-9}) {  // of what was put in, beyond which a run ends
    SimulationOptions options = options_of(s);
    options.blowup_factor = factor;
    Simulation simulation(s, options, method("newton"), find_method("newton")->law);
    CHECK(simulation.step().kinetic_energy == Approx(0.5 * 0.25 * 2 * 2).epsilon(1e-12));
    CHECK((simulation.step().status == Status::energy_blowup) == (factor < 1));
  }
}

TEST_CASE("a damper far too strong for an explicit step brings its joint to rest and never drives it", "[robots]") {
  // h d / I = 100, where the explicit step would multiply the rate by -99.
  const Scenario s = scene(pendulum("velocity=\"2\" damping=\"1e5\""), "", 1e-3, 0.01, "0 0 0");
  CHECK(largest_stable_step(s) == 1e3);  // the longest that is looked at
  Simulation simulation(s, options_of(s), method("ap"), find_method("ap")->law);
  double rate = 2;
  while (simulation.step_index() < simulation.steps_total()) {
    CHECK(simulation.step().status == Status::ok);
    CHECK(simulation.state().qd[0] == Approx(rate / 101).epsilon(1e-10));
    rate = simulation.state().qd[0];
  }
}

TEST_CASE("the explicit step of torque gains is 18 on the grasp's arm and 29 on a robot's free wheel") {
  // Wheel: h kv / I = 1e-3 * 50 / 1.7e-3. Arm: spec/scenarios.md, grasp.
  CHECK(*largest_eigenvalue(load_scenario(find_scenario("mobile_robot"), {}), 1e-3) == Approx(29.4).epsilon(0.01));
  CHECK(*largest_eigenvalue(load_scenario(find_scenario("grasp"), {{"gains", "torque"}}), 1e-3) ==
        Approx(18).epsilon(0.03));
  CHECK(*largest_eigenvalue(load_scenario(find_scenario("grasp"), {}), 1e-3) == Approx(0.02).epsilon(0.01));
}

TEST_CASE("what bounces on a belt gains no energy as seen from it, by the convex model with restitution", "[robots]") {
  // A light box on the belt, and beside it what could pay for its gain: a smooth ball, or a box of 400 kg that bounces.
  const std::string belt = R"(<robot name="drive"><link name="band" mass="10" position="0 -0.1 0" inertia="1 10 10">
    <box name="belt" size="10 0.2 2" position="0 -0.1 0"/></link>
    <joint name="roll" kind="prismatic" parent="world" child="band" axis="1 0 0" lower="0" upper="0"
    limit_rate="-3.383" velocity="-3.383"/></robot>
    <box name="a" size="0.2309 0.4501 0.5602" mass="0.2436" position="-0.45 0.22505 0"/>)";
  const std::string law = R"(<contacts><pair a="a" b="belt" mu="1.103" restitution="0.5331"/><pair a="b" b="belt" )";
  const std::vector<std::pair<std::string, std::string>> others{
      {R"(<sphere name="b" radius="0.1245" mass="5.166" position="-1.35 0.1245 0"/>)", "mu=\"0\"/></contacts>"},
      {R"(<box name="b" size="0.5 0.25 0.2" mass="400" position="1 0.125 0"/>)",
       "mu=\"0.3\" restitution=\"0.9\"/></contacts>"}};
  for (const auto& [other, pair] : others) {
    const Scenario s = scene(belt + other, law + pair, 1e-3, 0.02, "0 -30 0");
    const auto seen_from_belt = [&](const State& state, std::size_t body) {
      State alone = state;
      std::fill(alone.v.begin(), alone.v.end(), 0.0);
      std::copy_n(state.v.begin() + 6 * static_cast<long>(body), 6, alone.v.begin() + 6 * static_cast<long>(body));
      alone.v[6 * body] += 3.383;
      return kinetic_energy(s.model, alone);
    };
    for (const bool bounded : {true, false}) {
      Simulation simulation(s, options_of(s), method("convex", bounded), convex_law());
      while (simulation.step_index() < simulation.steps_total()) {
        State before = simulation.state();
        for (const std::size_t body : {1, 2}) before.v[6 * body + 1] -= 30 * s.step;
        REQUIRE(simulation.step().status == Status::ok);
        for (const std::size_t body : {1, 2}) {
          INFO("bounded " << bounded << ", body " << body << ", t = " << simulation.state().t);
          CHECK(seen_from_belt(simulation.state(), body) <= seen_from_belt(before, body) * (1 + 1e-9));
        }
      }
    }
  }
}

namespace {

/// A hull that floats and two booms, the second within limits that it meets again and again.
Scenario satellite(const std::string& limits, double h, double duration, const std::string& others = "",
                   const std::string& contacts = "") {
  return scene(R"(<robot name="satellite"><link name="hull" mass="1" position="0 0 0" inertia="0.1 0.2 0.15"/>
    <link name="boom" mass="3" position="1 0 0" inertia="0.01 0.3 0.3"/>
    <link name="tip" mass="0.2" position="2 0 0" inertia="0.001 0.02 0.02"/>
    <joint name="space" kind="free" parent="world" child="hull" angular_velocity="1 2 3"/>
    <joint name="elbow" kind="revolute" parent="hull" child="boom" axis="0 1 1" anchor="0.5 0 0" velocity="4"/>
    <joint name="wrist" kind="revolute" parent="boom" child="tip" axis="0 0 1" anchor="1.5 0 0" velocity="-20" )" +
                   limits + "/></robot>" + others,
               contacts, h, duration, "0 0 0");
}

}  // namespace

TEST_CASE("a floating robot's motion keeps its kinetic energy at any step, and its path is right to first order") {
  double error[2];
  const auto end = [](double h) {
    const Scenario s = satellite("", h, 0.2);
    Simulation simulation(s, options_of(s), method("ap"), find_method("ap")->law);
    const double before = energy(s, simulation.state());
    while (simulation.step_index() < simulation.steps_total()) REQUIRE(simulation.step().status == Status::ok);
    CHECK(energy(s, simulation.state()) == Approx(before).epsilon(1e-10));  // of 2e5 steps
    return simulation.state().q;
  };
  const std::vector<double> exact = end(1e-6);
  for (int k = 0; k < 2; ++k) {
    const std::vector<double> q = end(1e-3 / (1 << k));
    error[k] = 0;
    for (std::size_t i = 0; i < q.size(); ++i) error[k] = std::max(error[k], std::abs(q[i] - exact[i]));
  }
  CHECK(error[0] / error[1] == Approx(2).epsilon(0.1));
}

TEST_CASE("a joint that meets its limits within steps takes energy from a floating robot and never gives it any") {
  // What centrifugal forces of the whole step lend the rates is no robot's own that a limit stops halfway.
  for (const char* name : {"ap", "convex", "newton", "mirtich"})
    for (const double h : {1e-2, 1e-3}) {
      INFO(name << ", h = " << h);
      const Scenario s = satellite(R"(lower="-0.3" upper="0.3")", h, 1);
      Simulation simulation(s, options_of(s), method(name), find_method(name)->law);
      double before = energy(s, simulation.state());
      const double start = before;
      while (simulation.step_index() < simulation.steps_total()) {
        REQUIRE(simulation.step().status == Status::ok);
        const double now = energy(s, simulation.state());
        CHECK(now <= before * (1 + 1e-12));
        before = now;
      }
      CHECK(before < 0.99 * start);
    }
}

// What velocity-product forces lend the rates of a step is given back by the first of its moves, and once.
TEST_CASE("a ball that bounces within a step, and another robot, take no energy from a robot that is far from them") {
  const Scenario s = satellite("", 1e-3, 0.01, R"(<half_space name="wall" point="0 -9 0" normal="0 1 0"/>
    <sphere name="ball" radius="0.1" mass="1" position="9 -8.8945 0" velocity="0 -1 0"/>
    <robot name="cart"><link name="chassis" mass="2" position="-9 0 0" inertia="1 1 1"/>
    <joint name="rail" kind="prismatic" parent="world" child="chassis" axis="1 0 0" velocity="1"/></robot>)",
                               R"(<contacts><pair a="ball" b="wall" mu="0" restitution="1"/></contacts>)");
  Simulation simulation(s, options_of(s), method("newton"), newton_law());
  const double before = energy(s, simulation.state());
  int events = 0;
  while (simulation.step_index() < simulation.steps_total()) {
    const StepRecord& record = simulation.step();
    REQUIRE(record.status == Status::ok);
    events += record.events;
  }
  CHECK(events == 1);
  CHECK(energy(s, simulation.state()) == Approx(before).epsilon(1e-11));
}
