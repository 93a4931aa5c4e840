#include "evaluation/robot_errors.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <map>
#include <numbers>

#include "dynamics/kinematics.h"
#include "evaluation/references.h"
#include "evaluation/scene_errors.h"

using namespace cb;
using std::numbers::pi;

namespace {

constexpr double wheel_radius = 0.1, axle_length = 0.4;

// A base on two wheels that faces -z, the middle of the axle `ahead` of the base's centre of mass.
Scenario two_wheels(double ahead) {
  Scenario scenario;
  scenario.reference = {ReferenceKind::analytic, "mobile_robot", {}};
  Tree tree;
  tree.name = "robot";
  tree.nv = 8;
  const auto add = [&](const char* name, double mass, const Vec3& inertia, const Vec3& p) {
    Body body{name, mass, inertia};
    body.tree = 0;
    scenario.model.bodies.push_back(body);
    scenario.initial.pose.push_back({p, Quat::Identity()});
  };
  add("base", 20, {1, 2, 3}, {0, 0.2, ahead});
  add("left", 1, {5e-3, 3e-3, 3e-3}, {-axle_length / 2, wheel_radius, 0});
  add("right", 1, {5e-3, 3e-3, 3e-3}, {axle_length / 2, wheel_radius, 0});
  tree.joints.resize(3);
  tree.joints[0].kind = JointKind::free;
  tree.joints[0].body = 0;
  tree.joints[0].v = 0;
  for (int i = 1; i < 3; ++i) {
    Joint& joint = tree.joints[i];
    joint.kind = JointKind::revolute;
    joint.parent = joint.up = 0;
    joint.body = i;
    joint.axis_C = -Vec3::UnitX();
    joint.anchor_P = scenario.initial.pose[i].p - scenario.initial.pose[0].p;
    joint.q = i - 1;
    joint.v = 5 + i;
    Shape tyre;
    tyre.kind = ShapeKind::sphere;
    tyre.radius = wheel_radius;
    tyre.body = i;
    scenario.shapes.push_back(tyre);
  }
  scenario.model.trees.push_back(tree);
  scenario.initial.q.assign(2, 0);
  scenario.initial.qd.assign(8, 0);
  scenario.initial.v.assign(18, 0);

  ControllerSpec spec;
  spec.row = find_controller("figure_eight");
  REQUIRE(spec.row);
  for (const GainRow& row : spec.row->gains) spec.gains.push_back(row.default_value.value_or(5));
  const auto set = [&](std::string_view name, double value) {
    for (std::size_t i = 0; i < spec.gains.size(); ++i)
      if (spec.row->gains[i].name == name) spec.gains[i] = value;
  };
  set("wheel_radius", wheel_radius);
  set("axle", axle_length);
  spec.joints = {{0, 1, {}}, {1, 2, {}}};
  scenario.controllers.push_back(spec);
  return scenario;
}

// The robot's state where the middle of its axle is somewhere and moves without slip.
State placed(const Scenario& scenario, const WheeledRobot& robot, const WheeledRobot::State& at, double t) {
  State state = scenario.initial;
  state.t = t;
  const Quat turn(Eigen::AngleAxisd(at.heading, Vec3::UnitY()));
  const Vec3 forward(-std::sin(at.heading), 0, -std::cos(at.heading)), up(0, 1, 0);
  for (std::size_t b = 0; b < state.pose.size(); ++b) {
    const Vec3 from_middle = turn * scenario.initial.pose[b].p;
    state.pose[b] = {Vec3(at.x, 0, at.z) + from_middle, turn};
    const Vec3 v = at.speed * forward + at.turning * up.cross(from_middle);
    Vec3 w = at.turning * up;
    // A wheel rolls about the axle (left to right is `turn x`): its rim's speed at the ground cancels the hub's.
    if (b > 0) w -= (forward.dot(v) / robot.radius) * (turn * Vec3::UnitX());
    for (int i = 0; i < 3; ++i) {
      state.v[6 * b + static_cast<std::size_t>(i)] = v[i];
      state.v[6 * b + 3 + static_cast<std::size_t>(i)] = w[i];
    }
  }
  return state;
}

std::map<std::string, double> named(const SceneErrors& errors, std::string_view reference) {
  std::map<std::string, double> out;
  for (const auto& [name, value] : errors.finish()) {
    CHECK(out.count(name) == 0);
    out[name] = value;
    bool listed = false;
    for (const ReferenceRow& row : references())
      if (row.name == reference)
        listed = std::any_of(row.errors.begin(), row.errors.end(), [&](const auto& e) { return e.first == name; });
    INFO(name);
    CHECK(listed);
  }
  return out;
}

}  // namespace

TEST_CASE("Only a robot that is free, alone, level and alike on both sides has one that never slips to compare with") {
  const Scenario robot = two_wheels(0.1);
  REQUIRE(wheeled_robot(robot).has_value());
  const auto refused = [&](const auto& change) {
    Scenario other = robot;
    change(other);
    SceneErrors errors(other, SimulationOptions(), 0);
    errors.observe_step(other.initial, StepRecord());
    return !wheeled_robot(other).has_value() && errors.finish().empty();
  };
  CHECK(refused([](Scenario& s) { s.model.trees[0].joints[0].kind = JointKind::fixed; }));
  CHECK(refused([](Scenario& s) { s.model.bodies.push_back({"another", 1, Vec3::Constant(1)}); }));
  CHECK(refused([](Scenario& s) { s.controllers.clear(); }));
  CHECK(refused([](Scenario& s) { s.controllers.push_back(s.controllers[0]); }));
  CHECK(refused([](Scenario& s) { s.shapes.erase(s.shapes.begin()); }));  // a wheel without a tyre
  CHECK(refused([](Scenario& s) { s.shapes.pop_back(); }));
  const auto wheel = [](Scenario& s) -> Joint& { return s.model.trees[0].joints[s.controllers[0].joints[0].joint]; };
  CHECK(refused([&](Scenario& s) { wheel(s).damping += 1; }));
  CHECK(refused([&](Scenario& s) { wheel(s).torque_limit = 7; }));
  CHECK(refused([&](Scenario& s) { s.model.bodies[wheel(s).body].inertia *= 1.001; }));
  CHECK(refused([](Scenario& s) { s.shapes[1].radius *= 1.001; }));
  CHECK(refused([](Scenario& s) { s.initial.pose[2].p.y() += 1e-3; }));  // one wheel higher than the other
  CHECK(refused([](Scenario& s) { s.controllers[0].gains[3] = 0; }));    // the figure's rate
  CHECK(refused([](Scenario& s) {                                        // an arm on it
    s.model.bodies.push_back({"arm", 1, Vec3::Constant(1), 0});
    s.initial.pose.emplace_back();
    Joint joint;
    joint.kind = JointKind::revolute;
    joint.body = 3;
    s.model.trees[0].joints.push_back(joint);
  }));
  Scenario capped = robot;  // boxes on its wheels, listed before what is round
  for (int side = 1; side < 3; ++side) {
    Shape cap;
    cap.kind = ShapeKind::box;
    cap.body = side;
    cap.half_extents = Vec3::Constant(0.02);
    capped.shapes.insert(capped.shapes.begin(), cap);
  }
  REQUIRE(wheeled_robot(capped).has_value());
  CHECK(wheeled_robot(capped)->radius == wheel_radius);
}

TEST_CASE("A robot without motors and with its mass on the axle coasts round a circle") {
  WheeledRobot robot = *wheeled_robot(two_wheels(0));
  CHECK(robot.forward_moment == Approx(0).margin(1e-15));
  CHECK(robot.mass == 22);
  // Wheels: their own moment and mass at half the axle.
  CHECK(robot.yaw_inertia == Approx(2 + 2 * (3e-3 + 0.04)).epsilon(1e-14));
  CHECK(robot.wheel_inertia == Approx(5e-3).epsilon(1e-14));
  robot.kv = 0;
  NoSlipDrive drive(robot, {1, 2, 0.3, 0.5, 0.25});
  const WheeledRobot::State at = drive.at(7);
  // Radius 2 m: heading 0.3 + 0.25 t, and the integral of 0.5 (-sin, -cos).
  const double heading = 0.3 + 0.25 * 7;
  CHECK(at.heading == Approx(heading).epsilon(1e-11));
  CHECK(at.x == Approx(1 + 2 * (std::cos(heading) - std::cos(0.3))).epsilon(1e-11));
  CHECK(at.z == Approx(2 - 2 * (std::sin(heading) - std::sin(0.3))).epsilon(1e-11));
}

TEST_CASE("A coasting robot with its mass off the axle swings to drive mass first and keeps its energy") {
  // Chaplygin's sleigh: the mass ends up ahead, wherever it began, and the turning dies out.
  WheeledRobot robot = *wheeled_robot(two_wheels(0.15));
  CHECK(robot.forward_moment == Approx(-0.15 * 20).epsilon(1e-14));
  robot.kv = 0;
  const WheeledRobot::State start{0, 0, 0, 1, 0.5};
  const auto energy = [&](const WheeledRobot::State& s) {
    const double r = robot.radius, L = robot.axle;
    return 0.5 * (robot.mass + 2 * robot.wheel_inertia / (r * r)) * s.speed * s.speed +
           0.5 * (robot.yaw_inertia + robot.wheel_inertia * L * L / (2 * r * r)) * s.turning * s.turning;
  };
  NoSlipDrive drive(robot, start);
  for (const double t : {0.5, 2.0, 10.0, 40.0}) CHECK(energy(drive.at(t)) == Approx(energy(start)).epsilon(1e-12));
  CHECK(drive.at(40).speed < 0);  // its mass is behind: it turns about until it drives backwards
  CHECK(std::abs(drive.at(40).turning) < 1e-4);
}

TEST_CASE("The robot that never slips does not depend on how often it is asked") {
  const WheeledRobot robot = *wheeled_robot(two_wheels(0.05));
  NoSlipDrive once(robot, {}), often(robot, {});
  for (int i = 1; i <= 40000; ++i) often.at(i * 5e-4);
  const WheeledRobot::State a = once.at(20), b = often.at(20);
  CHECK(std::hypot(a.x - b.x, a.z - b.z) < 1e-11);
}

TEST_CASE("The distance from a figure eight is the distance along its normal, on the branch that is driven") {
  const FigureEight path;
  // The one from 0.2 s behind the wanted place, the other from 5 s behind: half a radian of the figure.
  for (const double behind : {0.2, 5.0})
    for (const double off : {0.0, 0.02, -0.3}) {
      CrossTrack track(path);
      for (double t = behind; t < 70; t += 0.05) {
        // Beside the place that the path had then; 31.4 s and 62.8 s are at the crossing.
        const FigureEight::Wanted at = path.at(t - behind);
        const double speed = std::hypot(at.vx, at.vz);
        const double x = at.x + off * at.vz / speed, z = at.z - off * at.vx / speed;
        const double found = track.distance(t, x, z);
        if (t < behind + 0.1) continue;  // it is being sought, from the wanted place on
        INFO(behind << " s behind at " << t << " s");
        CHECK(found == Approx(std::abs(off)).margin(1e-9));
      }
    }
}

TEST_CASE(
    "A robot's mass, moments and axle are those of its parts, wherever it faces and whatever side its load is on") {
  // Base: 20 kg, 0.1 m behind the axle and 0.05 m to the right of its middle; faces 0.5 rad off -z, at (2, 3).
  Scenario scenario = two_wheels(0.1);
  scenario.initial.pose[0].p.x() = 0.05;
  // The left wheel's centre of mass is above its hub.
  scenario.initial.pose[1].p.y() += 0.02;
  scenario.shapes[0].local.p.y() = -0.02;
  // Each number of the controller and of the motors is another.
  scenario.controllers[0].gains = {2.5, 3, 5, 0.2, 0.7, 0.4, 0.11, 0.6};
  for (int i = 1; i < 3; ++i) {
    scenario.model.trees[0].joints[static_cast<std::size_t>(i)].damping = 0.03;
    scenario.model.trees[0].joints[static_cast<std::size_t>(i)].torque_limit = 7;
  }
  const Quat turn(Eigen::AngleAxisd(0.5, Vec3::UnitY()));
  for (Pose& pose : scenario.initial.pose) pose = {turn * pose.p + Vec3(2, 0, 3), turn};
  const WheeledRobot robot = *wheeled_robot(scenario);
  CHECK(robot.axle == Approx(0.4).epsilon(1e-14));
  CHECK(robot.radius == wheel_radius);
  CHECK(robot.kv == 2.5);
  CHECK(robot.damping == 0.03);
  CHECK(robot.torque_limit == 7);
  const FigureEight& law = robot.law;
  const double numbers[] = {law.x_amplitude,   law.z_amplitude,  law.rate, law.gain,
                            law.velocity_gain, law.wheel_radius, law.axle};
  const double expected[] = {3, 5, 0.2, 0.7, 0.4, 0.11, 0.6};
  for (int i = 0; i < 7; ++i) CHECK(numbers[i] == expected[i]);
  CHECK(robot.mass == 22);
  CHECK(robot.forward_moment == Approx(-20 * 0.1).epsilon(1e-13));
  CHECK(robot.left_moment == Approx(-20 * 0.05).epsilon(1e-13));
  CHECK(robot.yaw_inertia == Approx(2 + 20 * (0.1 * 0.1 + 0.05 * 0.05) + 2 * (3e-3 + 0.2 * 0.2)).epsilon(1e-13));
  State state = scenario.initial;
  const Vec3 forward = turn * Vec3(0, 0, -1), up(0, 1, 0), middle(2, 0.1, 3);
  for (std::size_t b = 0; b < 3; ++b) {  // 0.75 m/s ahead, 0.25 rad/s to the left
    const Vec3 v = 0.75 * forward + 0.25 * up.cross(state.pose[b].p - middle);
    for (std::size_t i = 0; i < 3; ++i) {
      state.v[6 * b + i] = v[static_cast<int>(i)];
      state.v[6 * b + 3 + i] = 0.25 * up[static_cast<int>(i)];
    }
  }
  const WheeledRobot::State now = robot.state_of(state);
  CHECK(now.x == Approx(2));
  CHECK(now.z == Approx(3));
  CHECK(now.heading == Approx(0.5));
  CHECK(now.speed == Approx(0.75));
  CHECK(now.turning == Approx(0.25));
}

TEST_CASE("A coasting robot with its load on one side keeps its energy, and drag alone stops it exponentially") {
  WheeledRobot robot = *wheeled_robot(two_wheels(0));
  robot.kv = 0;
  const double r = robot.radius, L = robot.axle;
  const double a = robot.mass + 2 * robot.wheel_inertia / (r * r);
  const double d = robot.yaw_inertia + robot.wheel_inertia * L * L / (2 * r * r);
  {
    robot.damping = 0.03;  // N m s, about each axle
    NoSlipDrive drive(robot, {1, 2, 0, 0.5, 0});
    const double rate = 2 * 0.03 / (r * r) / a;
    CHECK(drive.at(3).speed == Approx(0.5 * std::exp(-rate * 3)).epsilon(1e-11));
    CHECK(drive.at(3).x == 1);
    CHECK(drive.at(3).z == Approx(2 - 0.5 * (1 - std::exp(-rate * 3)) / rate).epsilon(1e-11));
    NoSlipDrive spin(robot, {0, 0, 0, 0, 0.5});
    const double slowing = 0.03 * L * L / (2 * r * r) / d;
    CHECK(spin.at(3).turning == Approx(0.5 * std::exp(-slowing * 3)).epsilon(1e-11));
  }
  robot.damping = 0;
  robot.left_moment = -1.25;
  robot.forward_moment = 0.75;
  const WheeledRobot::State start{0, 0, 0, 1, 0.5};
  const auto energy = [&](const WheeledRobot::State& s) {  // a point (a, b) forward and left moves with u - w b, w a
    return 0.5 * a * s.speed * s.speed - robot.left_moment * s.speed * s.turning + 0.5 * d * s.turning * s.turning;
  };
  NoSlipDrive drive(robot, start);
  for (const double t : {0.5, 2.0, 10.0}) CHECK(energy(drive.at(t)) == Approx(energy(start)).epsilon(1e-12));
  CHECK(std::abs(drive.at(2).speed - 1) > 1e-3);
}

TEST_CASE("Motors at their limit turn the robot, or drive it on, with all the torque they have") {
  WheeledRobot robot = *wheeled_robot(two_wheels(0));
  robot.kv = 1e3;
  robot.torque_limit = 1e-3;
  const double r = robot.radius, L = robot.axle;
  const double a = robot.mass + 2 * robot.wheel_inertia / (r * r);
  const double d = robot.yaw_inertia + robot.wheel_inertia * L * L / (2 * r * r);
  // The figure begins at the origin towards (-0.4, -0.8), which is to the left of -z; or straight on.
  NoSlipDrive turns(robot, {}), drives(robot, {0, 0, robot.law.at(0).heading, 0, 0});
  CHECK(turns.at(0.1).turning == Approx(2e-3 * L / (2 * r) / d * 0.1).epsilon(1e-9));
  CHECK(turns.at(0.1).speed == Approx(0).margin(1e-15));
  CHECK(drives.at(0.1).speed == Approx(2e-3 / r / a * 0.1).epsilon(1e-9));
  CHECK(drives.at(0.1).turning == Approx(0).margin(1e-15));
  // The axles' friction is beside what the motors give: a u' = 2 (M - c u / r) / r.
  robot.damping = 0.03;
  NoSlipDrive dragged(robot, {0, 0, robot.law.at(0).heading, 0, 0});
  const double rate = 2 * 0.03 / (r * r) / a;
  CHECK(dragged.at(0.1).speed == Approx(1e-3 * r / 0.03 * (1 - std::exp(-rate * 0.1))).epsilon(1e-9));
}

TEST_CASE("Distances from the figure count from 5 s on, those from the robot that never slips from the start") {
  const Scenario scenario = two_wheels(0.05);
  const WheeledRobot robot = *wheeled_robot(scenario);
  SimulationOptions options;
  options.step = 0.01;
  options.duration = 8;
  SceneErrors errors(scenario, options, 0);
  NoSlipDrive exact(robot, robot.state_of(scenario.initial));
  CrossTrack exact_track(robot.law);
  const FigureEight& path = robot.law;
  double exact_largest = 0, exact_sum = 0, largest = 0, sum = 0, last = 0;
  int late = 0;
  for (int n = 1; n <= 800; ++n) {
    const double t = 0.01 * n;
    // 0.5 m beside the figure to begin with; from 5 s on 0.04 m, and 0.02 m from 6.5 s.
    const double off = n < 500 ? 0.5 : n < 650 ? 0.04 : 0.02;
    const FigureEight::Wanted at = path.at(t);
    const double speed = std::hypot(at.vx, at.vz);
    const WheeledRobot::State place{at.x + off * at.vz / speed, at.z - off * at.vx / speed, 0, 0, 0};
    errors.observe_step(placed(scenario, robot, place, t), StepRecord());
    const WheeledRobot::State& there = exact.at(t);
    const double cross = exact_track.distance(t, there.x, there.z);
    last = std::hypot(place.x - there.x, place.z - there.z);
    largest = std::max(largest, last);
    sum += last * last;
    if (n < 500) continue;
    ++late;
    exact_largest = std::max(exact_largest, cross);
    exact_sum += cross * cross;
  }
  const auto found = named(errors, "mobile_robot");
  const double rms = std::sqrt((150 * 0.04 * 0.04 + 151 * 0.02 * 0.02) / 301), exact_rms = std::sqrt(exact_sum / late);
  CHECK(found.at("cross_track_linf_m") == Approx(0.04).epsilon(1e-6));
  CHECK(found.at("cross_track_rms_m") == Approx(rms).epsilon(1e-6));
  CHECK(found.at("no_slip_cross_track_linf_m") == Approx(exact_largest).epsilon(1e-9));
  CHECK(found.at("no_slip_cross_track_rms_m") == Approx(exact_rms).epsilon(1e-9));
  CHECK(found.at("cross_track_rms_difference_m") == Approx(std::abs(rms - exact_rms)).epsilon(1e-5));
  CHECK(exact_largest != Approx(exact_rms));
  CHECK(found.at("position_final_m") == Approx(last).epsilon(1e-9));
  CHECK(found.at("position_linf_m") == Approx(largest).epsilon(1e-9));
  CHECK(found.at("position_l2_m") == Approx(std::sqrt(sum / 800)).epsilon(1e-9));
}

namespace {

/// Their shapes are 0 and 1, that of the ground is 2.
Scenario two_wheels_on_the_ground() {
  Scenario scenario = two_wheels(0.05);
  Shape ground;
  ground.kind = ShapeKind::half_space;
  scenario.shapes.push_back(ground);
  return scenario;
}

}  // namespace

TEST_CASE("A robot that moves as the one that never slips has no error, and shares its load as it was given") {
  Scenario scenario = two_wheels_on_the_ground();
  const WheeledRobot robot = *wheeled_robot(scenario);
  SimulationOptions options;
  options.step = 1e-2;
  options.duration = 12;
  SceneErrors errors(scenario, options, 0);
  errors.observe_start(scenario.initial);
  NoSlipDrive drive(robot, robot.state_of(scenario.initial));

  // A left wheel with three quarters of the load; in one step of six with none of it; in another both are in the air.
  ContactProblem problem;
  ContactSolution solution;
  Residuals residuals;
  const std::vector<double> v_plus;
  std::vector<ContactPoint> contacts(2);
  contacts[0].shape_a = 0;
  contacts[1].shape_a = 1;
  contacts[0].shape_b = contacts[1].shape_b = 2;
  for (long n = 1; n <= 1200; ++n) {
    const double t = static_cast<double>(n) * options.step;
    solution.impulse = n % 6 == 0 ? std::vector<double>{0, 0, 0, 2, 0, 0} : std::vector<double>{3, 0, 0, 1, 0, 0};
    if (n % 6 != 3) errors.observe_event(EventRecord{t, problem, solution, residuals, v_plus, contacts});
    StepRecord record;
    errors.observe_step(placed(scenario, robot, drive.at(t), t), record);
  }
  const auto found = named(errors, "mobile_robot");
  for (const char* name : {"position_final_m", "position_linf_m", "position_l2_m", "cross_track_rms_difference_m",
                           "slip_left_along_linf_m_per_s", "slip_left_across_linf_m_per_s",
                           "slip_right_along_linf_m_per_s", "slip_right_across_linf_m_per_s"}) {
    INFO(name);
    CHECK(std::abs(found.at(name)) < 1e-10);
  }
  CHECK(found.at("load_asymmetry_mean_relative") == Approx(0.8 * 0.5 + 0.2).epsilon(1e-12));
  CHECK(found.at("load_asymmetry_linf_relative") == 1);
  CHECK(found.at("unloaded_left_relative") == Approx(1. / 3));
  CHECK(found.at("unloaded_right_relative") == Approx(1. / 6));
}

TEST_CASE(
    "A wheel has a load where it has a millionth of both wheels', whichever of wheel and ground is listed first") {
  Scenario scenario = two_wheels_on_the_ground();
  const WheeledRobot robot = *wheeled_robot(scenario);
  SimulationOptions options;
  options.duration = 10;
  for (const bool ground_first : {false, true}) {
    INFO((ground_first ? "ground first" : "wheels first"));
    SceneErrors errors(scenario, options, 0);
    ContactProblem problem;
    ContactSolution solution;
    Residuals residuals;
    const std::vector<double> v_plus;
    std::vector<ContactPoint> contacts(2);
    for (int wheel = 0; wheel < 2; ++wheel) {
      ContactPoint& contact = contacts[static_cast<std::size_t>(wheel)];
      contact.shape_a = ground_first ? 2 : wheel;
      contact.shape_b = ground_first ? wheel : 2;
    }
    double t = 0;
    for (const double left : {1e-7, 1e-5, 2e-6, 0.5e-6, 1.0}) {  // N s, of the right wheel's 1
      t += 1e-3;
      for (const bool second : {false, true}) {  // in two events of the step
        solution.impulse = {second ? 0.0 : left, 0, 0, second ? 0.75 : 0.25, 0, 0};
        errors.observe_event(EventRecord{t, problem, solution, residuals, v_plus, contacts});
      }
      errors.observe_step(placed(scenario, robot, {}, t), StepRecord());
    }
    const auto found = named(errors, "mobile_robot");
    CHECK(found.at("unloaded_left_relative") == Approx(0.4));
    CHECK(found.at("load_asymmetry_linf_relative") == Approx(1).epsilon(1e-6));
    CHECK(found.at("load_asymmetry_mean_relative") == Approx(0.8).epsilon(1e-4));
    CHECK(found.at("unloaded_right_relative") == 0);
  }
}

TEST_CASE("To an accuracy a robot has no loads, and all other errors") {
  const Scenario scenario = two_wheels(0.05);
  SimulationOptions options;
  options.duration = 10;
  std::map<std::string, double> all;
  for (const Stepping stepping : {Stepping::steps, Stepping::accuracy}) {
    options.stepping = stepping;
    SceneErrors errors(scenario, options, 0);
    const WheeledRobot robot = *wheeled_robot(scenario);
    errors.observe_step(placed(scenario, robot, {0, 0, 0.7, 0.4, 0.1}, 6), StepRecord());
    const auto found = named(errors, "mobile_robot");
    if (stepping == Stepping::steps) {
      all = found;
      CHECK(found.at("unloaded_left_relative") == 1);
      continue;
    }
    for (const auto& [name, value] : all) {
      INFO(name);
      CHECK(found.count(name) == (name.starts_with("unloaded_") || name.starts_with("load_") ? 0 : 1));
    }
  }
}

TEST_CASE("A wheel that spins on the spot slips along, one that is pushed sideways slips across") {
  const Scenario scenario = two_wheels(0.05);
  const WheeledRobot robot = *wheeled_robot(scenario);
  SimulationOptions options;
  options.duration = 10;
  SceneErrors errors(scenario, options, 0);
  State state = placed(scenario, robot, {0, 0, 0.7, 0.4, 0.1}, 1e-3);
  const Vec3 axle = state.pose[2].p - state.pose[1].p;
  for (int i = 0; i < 3; ++i) {
    state.v[6 + static_cast<std::size_t>(i)] += 0.02 * axle[i] / axle.norm();      // left: 0.02 m/s sideways
    state.v[12 + 3 + static_cast<std::size_t>(i)] -= 0.5 * axle[i] / axle.norm();  // right: 0.5 rad/s faster
  }
  errors.observe_step(state, StepRecord());
  const auto found = named(errors, "mobile_robot");
  CHECK(found.at("slip_left_along_linf_m_per_s") < 1e-12);
  CHECK(found.at("slip_left_across_linf_m_per_s") == Approx(0.02).epsilon(1e-10));
  CHECK(found.at("slip_right_along_linf_m_per_s") == Approx(0.05).epsilon(1e-10));
  CHECK(found.at("slip_right_across_linf_m_per_s") < 1e-12);
  CHECK(found.at("unloaded_left_relative") == 1);
  CHECK(found.count("cross_track_rms_m") == 0);  // not before 5 s
  CHECK(found.count("position_final_m") == 0);   // nor before the end
  // And without slip in three steps more: a quarter of the mean square.
  for (const double t : {2e-3, 3e-3, 4e-3})
    errors.observe_step(placed(scenario, robot, {0, 0, 0.7, 0.4, 0.1}, t), StepRecord());
  const auto later = named(errors, "mobile_robot");
  CHECK(later.at("slip_left_across_rms_m_per_s") == Approx(0.01).epsilon(1e-10));
  CHECK(later.at("slip_left_across_linf_m_per_s") == Approx(0.02).epsilon(1e-10));
  CHECK(later.at("slip_left_along_rms_m_per_s") < 1e-12);
  CHECK(later.at("slip_right_along_rms_m_per_s") == Approx(0.025).epsilon(1e-10));
  CHECK(later.at("slip_right_across_rms_m_per_s") < 1e-12);
}

namespace {

// Two fingers on a joint each, a free cube of 0.2 m between them, and an arm's joint that follows 0.3 + 0.5 sin(2 t +
// 0.1).
Scenario grasped() {
  Scenario scenario;
  scenario.reference = {ReferenceKind::analytic, "grasp", {}};
  Tree tree;
  tree.nv = 2;
  for (int i = 0; i < 2; ++i) {
    Body finger{i == 0 ? "left" : "right", 1, Vec3::Constant(1)};
    finger.tree = 0;
    scenario.model.bodies.push_back(finger);
    Joint joint;
    joint.kind = JointKind::revolute;
    joint.body = joint.q = joint.v = i;
    tree.joints.push_back(joint);
  }
  scenario.model.trees = {tree};
  scenario.model.bodies.push_back({"cube", 1, Vec3::Constant(1)});
  Shape cube;
  cube.kind = ShapeKind::box;
  cube.body = 2;
  cube.half_extents = Vec3::Constant(0.1);
  scenario.shapes = {cube};
  scenario.initial.pose = {{Vec3(-1, 0, 0), Quat::Identity()}, {Vec3(1, 0, 0), Quat::Identity()}, Pose()};
  scenario.initial.v.assign(18, 0);
  scenario.initial.q.assign(2, 0);
  scenario.initial.qd.assign(2, 0);
  ControllerSpec spec;
  spec.row = find_controller("computed_torque");
  REQUIRE(spec.row);
  spec.words.assign(spec.row->words.size(), 0);
  for (const GainRow& row : spec.row->gains) spec.gains.push_back(row.default_value.value_or(0));
  const auto role = std::find_if(spec.row->roles.begin(), spec.row->roles.end(),
                                 [](const JointRoleRow& row) { return row.name == "close"; });
  REQUIRE(role != spec.row->roles.end());
  for (int i = 0; i < 2; ++i)
    spec.joints.push_back(
        {static_cast<int>(role - spec.row->roles.begin()), i, std::vector<double>(role->gains.size(), 1.0)});
  // And the arm's joint.
  scenario.model.bodies.push_back({"arm", 1, Vec3::Constant(1), 0});
  scenario.initial.pose.emplace_back();
  scenario.initial.v.resize(24, 0);
  scenario.initial.q.resize(3, 0);
  scenario.initial.qd.resize(3, 0);
  Joint arm;
  arm.kind = JointKind::revolute;
  arm.body = 3;
  arm.q = arm.v = 2;
  scenario.model.trees[0].joints.push_back(arm);
  scenario.model.trees[0].nv = 3;
  const auto track = std::find_if(spec.row->roles.begin(), spec.row->roles.end(),
                                  [](const JointRoleRow& row) { return row.name == "track"; });
  REQUIRE(track != spec.row->roles.end());
  spec.joints.push_back({static_cast<int>(track - spec.row->roles.begin()), 2, {0.3, 0.5, 2, 0.1, 0, 0}});
  scenario.controllers = {spec};
  return scenario;
}

}  // namespace

TEST_CASE("Creep of a grasp is what the held body moves in both fingers' frames, whatever the hand does") {
  const Scenario scenario = grasped();
  SimulationOptions options;
  options.step = 0.01;
  options.duration = 4;
  SceneErrors errors(scenario, options, 0);
  for (int n = 1; n <= 400; ++n) {
    State state = scenario.initial;
    state.t = n * 0.01;
    // All swing together; the cube slides down by 0.03 m/s in the hand and turns by 0.01 rad/s about the line between
    // the fingers.
    const Quat swing(Eigen::AngleAxisd(std::sin(state.t), Vec3(1, 2, 3).normalized()));
    const Quat turn(Eigen::AngleAxisd(0.01 * state.t, Vec3::UnitX()));
    for (Pose& pose : state.pose) pose = {swing * pose.p, swing};
    state.pose[2].p += swing * Vec3(0, -0.03 * state.t, 0);
    state.pose[2].q = swing * turn;
    state.q[2] = 0.3 + 0.5 * std::sin(2 * state.t + 0.1) - 0.01 * state.t;
    errors.observe_step(state, StepRecord());
  }
  {
    // Back where it was at the end: the largest stays what it was.
    SceneErrors back(scenario, options, 0);
    for (const double off : {0.07, 0.0}) {
      State state = scenario.initial;
      state.t = off > 0 ? 2 : 4;
      state.pose[2].p.x() = off;
      state.pose[2].q = Quat(Eigen::AngleAxisd(off, Vec3::UnitZ()));
      state.q[2] = 0.3 + 0.5 * std::sin(2 * state.t + 0.1) + off;
      back.observe_step(state, StepRecord());
    }
    const auto at_the_end = named(back, "grasp");
    CHECK(at_the_end.at("creep_final_m") == 0);
    CHECK(at_the_end.at("creep_linf_m") == Approx(std::sqrt(2) * 0.07).epsilon(1e-12));
    CHECK(at_the_end.at("creep_rate_m_per_s") == Approx(std::sqrt(2) * 0.07 / 2).epsilon(1e-12));
    CHECK(at_the_end.at("rotation_linf_rad") == Approx(0.07).epsilon(1e-12));
    CHECK(at_the_end.at("tracking_shoulder1_linf_rad") == Approx(0.07).epsilon(1e-12));
    CHECK(at_the_end.count("dropped_s") == 0);
  }
  {
    // By steps to an accuracy, none of which ends at T/2: it slides down by 0.03 m/s.
    options.stepping = Stepping::accuracy;
    SceneErrors uneven(scenario, options, 0);
    for (const double t : {1.0, 3.0, 4.0}) {
      State state = scenario.initial;
      state.t = t;
      state.pose[2].p.y() = -0.03 * t;
      uneven.observe_step(state, StepRecord());
    }
    CHECK(named(uneven, "grasp").at("creep_rate_m_per_s") == Approx(std::sqrt(2) * 0.03).epsilon(1e-12));
  }
  const auto found = named(errors, "grasp");
  CHECK(found.at("tracking_shoulder1_linf_rad") == Approx(0.04).epsilon(1e-12));
  CHECK(found.at("tracking_shoulder1_rms_rad") == Approx(0.04 / std::sqrt(3)).epsilon(2e-3));
  CHECK(found.at("creep_final_m") == Approx(std::sqrt(2) * 0.12).epsilon(1e-12));
  CHECK(found.at("creep_linf_m") == found.at("creep_final_m"));
  CHECK(found.at("creep_rate_m_per_s") == Approx(std::sqrt(2) * 0.03).epsilon(1e-12));
  CHECK(found.at("rotation_linf_rad") == Approx(0.04).epsilon(1e-12));
  CHECK(found.at("dropped_s") == Approx(3.34).epsilon(1e-12));  // 0.1 m are passed after 10/3 s
}

TEST_CASE("A held body is dropped once it is half its own size from its place in the frames of both fingers") {
  Scenario scenario = grasped();
  Shape table = scenario.shapes[0];  // larger than what is held
  table.body = -1;
  table.half_extents = Vec3::Constant(5);
  scenario.shapes.push_back(table);
  Shape knob = scenario.shapes[0];  // on what is held, and smaller
  knob.half_extents = Vec3::Constant(0.01);
  scenario.shapes.push_back(knob);
  SimulationOptions options;
  options.step = 0.01;
  options.duration = 4;
  for (const std::size_t opens : {0U, 1U}) {
    INFO("finger " << opens);
    SceneErrors errors(scenario, options, 0);
    State state = scenario.initial;
    state.t = 0.5;
    state.pose[2].p.x() += 0.05;  // less than half the cube's size, more than half the knob's
    errors.observe_step(state, StepRecord());
    state = scenario.initial;
    state.t = 1;
    state.pose[opens].p.x() += 0.15;  // this finger goes; the cube stays in the other's frame
    errors.observe_step(state, StepRecord());
    auto found = named(errors, "grasp");
    CHECK(found.count("dropped_s") == 0);
    CHECK(found.at("creep_linf_m") == Approx(0.15).epsilon(1e-12));
    state.t = 1.5;
    state.pose[1 - opens].p.x() += 0.15;
    errors.observe_step(state, StepRecord());
    found = named(errors, "grasp");
    CHECK(found.at("dropped_s") == 1.5);
    CHECK(found.count("creep_final_m") == 0);  // it ended early
    CHECK(found.count("creep_rate_m_per_s") == 0);
  }
}

TEST_CASE("Two fingers may be those of two robots, each on its own controller, and begin turned as they like") {
  Scenario scenario = grasped();
  // The second finger is the only joint of a robot of its own.
  Tree second;
  second.v = 1;
  second.nv = 1;
  second.joints = {scenario.model.trees[0].joints[1]};
  scenario.model.trees.push_back(second);
  scenario.model.bodies[1].tree = 1;
  ControllerSpec other = scenario.controllers[0];
  other.tree = 1;
  other.joints = {other.joints[0]};
  std::vector<ControllerSpec::ControlledJoint>& joints = scenario.controllers[0].joints;
  joints.erase(joints.begin() + 1);
  scenario.controllers.push_back(other);
  scenario.initial.pose[1].q = Quat(Eigen::AngleAxisd(0.5, Vec3::UnitX()));
  SceneErrors errors(scenario, SimulationOptions(), 0);
  State state = scenario.initial;
  state.t = 1;
  state.pose[1].p.y() += 0.05;
  errors.observe_step(state, StepRecord());
  const auto found = named(errors, "grasp");
  REQUIRE(found.count("creep_linf_m") == 1);
  CHECK(found.at("creep_linf_m") == Approx(0.05).epsilon(1e-12));
  CHECK(found.at("rotation_linf_rad") < 1e-12);
}

TEST_CASE("Of the joints on sinusoids the first two that swing are told, whatever is held still before them") {
  Scenario scenario = grasped();
  Tree& tree = scenario.model.trees[0];
  std::vector<ControllerSpec::ControlledJoint>& controlled = scenario.controllers[0].joints;
  const int track = controlled.back().role;
  for (int j = 3; j < 6; ++j) {
    scenario.model.bodies.push_back({"link", 1, Vec3::Constant(1), 0});
    Joint joint;
    joint.kind = JointKind::revolute;
    joint.body = j + 1;
    joint.q = joint.v = j;
    tree.joints.push_back(joint);
  }
  scenario.initial.pose.resize(7);
  scenario.initial.v.resize(42, 0);
  scenario.initial.q.resize(6, 0);
  scenario.initial.qd.resize(6, 0);
  // Held at 0.7; the arm's; 0.2 sin 3 t; one more.
  controlled.insert(controlled.end() - 1, ControllerSpec::ControlledJoint{track, 3, {0.7, 0, 2, 0.1, 0, 0}});
  controlled.push_back({track, 4, {0, 0.2, 3, 0, 0, 0}});
  controlled.push_back({track, 5, {0, 0.9, 5, 0, 0, 0}});
  SceneErrors errors(scenario, SimulationOptions(), 0);
  State state = scenario.initial;
  state.t = 0.5;
  state.q = {0, 0, 0.3 + 0.5 * std::sin(1.1) + 0.01, 1.7, 0.2 * std::sin(1.5) - 0.02, 4};
  errors.observe_step(state, StepRecord());
  const auto found = named(errors, "grasp");
  CHECK(found.at("tracking_shoulder1_linf_rad") == Approx(0.01).epsilon(1e-9));
  CHECK(found.at("tracking_shoulder1_rms_rad") == Approx(0.01).epsilon(1e-9));
  CHECK(found.at("tracking_shoulder2_linf_rad") == Approx(0.02).epsilon(1e-9));
  CHECK(found.at("tracking_shoulder2_rms_rad") == Approx(0.02).epsilon(1e-9));
}

TEST_CASE("A grasp is measured where two fingers hold one body") {
  const auto measured = [](const Scenario& scenario) {
    SceneErrors errors(scenario, SimulationOptions(), 0);
    errors.observe_step(scenario.initial, StepRecord());
    return !errors.finish().empty();
  };
  CHECK(measured(grasped()));
  Scenario beside_another = grasped();  // a controller that grasps nothing, and comes first
  ControllerSpec drive;
  drive.row = find_controller("figure_eight");
  REQUIRE(drive.row);
  beside_another.controllers.insert(beside_another.controllers.begin(), drive);
  CHECK(measured(beside_another));
  Scenario one_finger = grasped(), three_fingers = grasped(), two_bodies = grasped(), nothing_held = grasped();
  one_finger.controllers[0].joints.erase(one_finger.controllers[0].joints.begin());
  three_fingers.controllers[0].joints.push_back(three_fingers.controllers[0].joints[0]);
  two_bodies.model.bodies.push_back({"another", 1, Vec3::Constant(1)});
  two_bodies.initial.pose.emplace_back();
  two_bodies.initial.v.resize(30, 0);
  nothing_held.model.bodies[2].tree = 0;
  CHECK_FALSE(measured(one_finger));
  CHECK_FALSE(measured(three_fingers));
  CHECK_FALSE(measured(two_bodies));
  CHECK_FALSE(measured(nothing_held));
}
