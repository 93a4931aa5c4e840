#include "control/figure_eight.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "control/controller.h"

using namespace cb;

namespace {

/// Central difference of f at t; its error is of second order in the step.
template <class Function>
double rate_of(const Function& f, double t) {
  constexpr double step = 1e-4;
  return (f(t + step) - f(t - step)) / (2 * step);
}

}  // namespace

TEST_CASE("the figure eight's rates are the time derivatives of its path, and its heading points along it") {
  FigureEight path;
  path.x_amplitude = 3;
  path.z_amplitude = 2;
  path.rate = 0.7;
  for (double t = 0; t < 9; t += 0.37) {
    const FigureEight::Wanted wanted = path.at(t);
    CHECK(wanted.vx == Approx(rate_of([&](double s) { return path.at(s).x; }, t)).margin(1e-7));
    CHECK(wanted.vz == Approx(rate_of([&](double s) { return path.at(s).z; }, t)).margin(1e-7));
    const double speed = std::hypot(wanted.vx, wanted.vz);
    CHECK(-std::sin(wanted.heading) == Approx(wanted.vx / speed).margin(1e-14));
    CHECK(-std::cos(wanted.heading) == Approx(wanted.vz / speed).margin(1e-14));
    const auto turned = [&](double s) { return std::remainder(path.at(s).heading - wanted.heading, 2 * M_PI); };
    CHECK(wanted.turning == Approx(rate_of(turned, t)).margin(1e-6));
  }
}

TEST_CASE("the figure eight starts at the origin and crosses it again half a turn later, at the extremes between") {
  const FigureEight path;
  const double turn = 2 * M_PI / path.rate;
  for (const double t : {0.0, turn / 2, turn}) CHECK(std::hypot(path.at(t).x, path.at(t).z) < 1e-13);
  // X = -4 cos s, Z = 4 sin 2s from s = 3 pi/2 on: it sets out towards negative x and z.
  CHECK(path.at(0).vx == Approx(-4 * path.rate).epsilon(1e-14));
  CHECK(path.at(0).vz == Approx(-8 * path.rate).epsilon(1e-14));
  CHECK(std::abs(path.at(turn / 4).x) == Approx(4).epsilon(1e-14));
  CHECK(std::abs(path.at(turn / 8).z) == Approx(4).epsilon(1e-14));
}

TEST_CASE("wheels turned at the wanted speeds move the robot by what the errors ask along its heading") {
  const FigureEight path;
  const double t = 2.3, heading = 0.4, x = 0.3, z = -0.2, vx = 0.1, vz = 0.05, turning = -0.02;
  const FigureEight::WheelSpeeds wheels = path.wheel_speeds(t, x, z, heading, vx, vz, turning);
  const FigureEight::Wanted wanted = path.at(t);
  const double e_x = wanted.x - x + 1e-3 * (wanted.vx - vx), e_z = wanted.z - z + 1e-3 * (wanted.vz - vz);
  const double e_turn = std::remainder(wanted.heading - heading, 2 * M_PI) + 1e-3 * (wanted.turning - turning);
  // Rolling without slip: the middle of the axle goes at the mean of the two rims, and turns by their difference.
  CHECK(path.wheel_radius * (wheels.left + wheels.right) / 2 ==
        Approx(-std::sin(heading) * e_x - std::cos(heading) * e_z).epsilon(1e-13));
  CHECK(path.wheel_radius * (wheels.right - wheels.left) / path.axle == Approx(e_turn).epsilon(1e-13));
}

TEST_CASE("the controller drives by the point between the wheels, where that is and how it moves") {
  // A base that turns, with its centre of mass off the axle, and wheels 0.8 m apart.
  Model model;
  Tree tree;
  tree.nv = 8;
  const Vec3 base(0.3, 0.1, -0.2), v(0.4, 0, 0.1), w(0, 0.7, 0);
  const double heading = 0.5;
  const Vec3 across(std::cos(heading), 0, -std::sin(heading));  // to the right; forward is y x across
  const Vec3 middle = base + Vec3(0.05, -0.1, 0.2);
  State state;
  state.t = 1.7;
  state.v.assign(18, 0.0);
  state.qd.assign(8, 0.0);
  for (int b = 0; b < 3; ++b) {
    model.bodies.push_back({"link", 1, Vec3::Constant(1), 0});
    state.pose.push_back({b == 0 ? base : Vec3(middle + (b == 1 ? -0.4 : 0.4) * across), Quat::Identity()});
    Joint joint;
    joint.kind = b == 0 ? JointKind::free : JointKind::revolute;
    joint.body = b;
    joint.parent = b == 0 ? -1 : 0;
    joint.up = b == 0 ? -1 : 0;
    joint.v = b == 0 ? 0 : 5 + b;
    tree.joints.push_back(joint);
  }
  for (int i = 0; i < 3; ++i) {
    state.v[i] = v[i];
    state.v[3 + i] = w[i];
  }
  state.qd[6] = 1.1;
  state.qd[7] = -0.6;
  model.trees = {tree};

  const FigureEight law{.x_amplitude = 3, .z_amplitude = 5, .velocity_gain = 0.2};
  ControllerSpec spec;
  spec.row = find_controller("figure_eight");
  const double kv = 2.5;
  spec.gains = {kv,       law.x_amplitude,   law.z_amplitude,  law.rate,
                law.gain, law.velocity_gain, law.wheel_radius, law.axle};
  spec.joints = {{0, 1, {}}, {1, 2, {}}};
  std::vector<double> tau(8, 0.0);
  spec.row->make(model, spec)(model, state, Vec3(0, -9.8, 0), tau);

  const Vec3 velocity = v + w.cross(middle - base);
  const FigureEight::WheelSpeeds wanted =
      law.wheel_speeds(1.7, middle.x(), middle.z(), heading, velocity.x(), velocity.z(), w.y());
  CHECK(tau[6] == Approx(kv * (wanted.left - 1.1)).epsilon(1e-12));
  CHECK(tau[7] == Approx(kv * (wanted.right + 0.6)).epsilon(1e-12));
  for (int i = 0; i < 6; ++i) CHECK(tau[i] == 0);
}

TEST_CASE("a path without length, or at no rate, is a place to stand still at") {
  for (const double rate : {0.0, 1.0}) {
    FigureEight path;
    path.rate = rate;
    if (rate != 0) path.x_amplitude = path.z_amplitude = 0;
    const auto [left, right] = path.wheel_speeds(0.3, 1, 2, 0.1, 0, 0, 0);
    CHECK(std::isfinite(left));
    CHECK(std::isfinite(right));
  }
}

TEST_CASE("the wheels' motors damp their own rates, by what a rad/s too many costs them") {
  Model model;
  Tree tree;
  for (int j = 0; j < 4; ++j) {
    Joint joint;
    joint.kind = JointKind::revolute;
    joint.v = 3 + j;
    tree.joints.push_back(joint);
  }
  model.trees = {Tree(), tree};
  ControllerSpec spec;
  spec.row = find_controller("figure_eight");
  spec.tree = 1;
  spec.gains = {2.5, 1, 1, 1, 1, 1, 1, 1};
  spec.joints = {{0, 3, {}}, {1, 1, {}}};
  JointGains gains(7);
  gains.damping[6] = 0.5;  // of a controller before
  spec.row->gains_of_joints(model, spec, gains);
  CHECK(gains.damping == std::vector<double>{0, 0, 0, 0, 2.5, 0, 3});
  for (const auto* none : {&gains.stiffness, &gains.stiffness_by_mass, &gains.damping_by_mass})
    CHECK(*none == std::vector<double>(7, 0.0));
}

TEST_CASE("controllers are found by their names, and rows say what their numbers are") {
  std::vector<std::string_view> names;
  for (const ControllerRow& row : controllers()) names.push_back(row.name);
  CHECK(names == std::vector<std::string_view>{"figure_eight", "computed_torque"});
  CHECK(find_controller("nobody") == nullptr);
  const auto units = [](const std::vector<GainRow>& rows) {
    std::string out;
    for (const GainRow& row : rows)
      out += std::string(row.name) + " [" + std::string(row.unit) + "]" + (row.default_value ? " " : "! ");
    return out;
  };
  CHECK(units(find_controller("figure_eight")->gains) ==
        "kv [N m s/rad]! x_amplitude [m] z_amplitude [m] rate [rad/s] gain [1/s] velocity_gain [] wheel_radius [m] "
        "axle [m] ");
  CHECK(units(find_controller("computed_torque")->gains) == "kp [1/s^2] kd [1/s] ");
  CHECK(units(find_controller("computed_torque")->roles[0].gains) ==
        "offset [rad or m] amplitude [rad or m] frequency [rad/s] phase [rad] kp [N m/rad or N/m] kv [N m s/rad or N "
        "s/m] ");
  CHECK(units(find_controller("computed_torque")->roles[1].gains) == "acceleration [rad/s^2 or m/s^2]! ");
}

TEST_CASE("the wheels' speeds follow each gain, radius and axle, and the shorter way round to the heading") {
  const FigureEight law{.x_amplitude = 3,
                        .z_amplitude = 2,
                        .rate = 0.5,
                        .gain = 0.7,
                        .velocity_gain = 0.2,
                        .wheel_radius = 0.1,
                        .axle = 0.6};
  const double t = 1.9, s = 0.5 * t + 1.5 * M_PI;
  // Path and rates by hand.
  const double x = -3 * std::cos(s), z = 2 * std::sin(2 * s), vx = 1.5 * std::sin(s), vz = 2 * std::cos(2 * s);
  const double heading = std::atan2(-vx, -vz);
  const FigureEight::Wanted wanted = law.at(t);
  CHECK(wanted.x == Approx(x));
  CHECK(wanted.z == Approx(z));
  CHECK(wanted.heading == Approx(heading));
  for (const double off : {0.3, -3.0, 3.5, 9.0}) {  // how far the robot has turned beyond what is wanted, rad
    const double at = heading + off, turn = std::remainder(-off, 2 * M_PI);
    const FigureEight::WheelSpeeds wheels = law.wheel_speeds(t, x - 0.1, z + 0.2, at, vx - 0.3, vz + 0.4, 0.25);
    const double e_x = 0.7 * 0.1 + 0.2 * 0.3, e_z = -0.7 * 0.2 - 0.2 * 0.4;
    const double e_turn = 0.7 * turn + 0.2 * (wanted.turning - 0.25);
    const double forward = -std::sin(at) * e_x - std::cos(at) * e_z;
    INFO(off << " rad");
    CHECK(wheels.left == Approx((forward - 0.3 * e_turn) / 0.1));
    CHECK(wheels.right == Approx((forward + 0.3 * e_turn) / 0.1));
  }
  // Half a turn off it turns to the left, as (-pi, pi] says: on a line along z the wanted heading is that of -z or +z.
  FigureEight line = law;
  line.x_amplitude = 0;
  const double there = M_PI / line.rate;  // s, half way: it goes towards -z, as at the start
  for (const double at : {there + 0.2, there + M_PI / 2 / line.rate + 0.2}) {
    const FigureEight::Wanted place = line.at(at);
    const double opposite = place.vz > 0 ? 0 : M_PI;
    const auto [left, right] = line.wheel_speeds(at, place.x, place.z, opposite, 0, place.vz, 0);
    CHECK(right - left == Approx(0.7 * M_PI * 0.6 / 0.1));
  }
}

TEST_CASE("the axle's middle is that of the wheels' joints, on whichever body and in whichever order they are named") {
  Model model;
  Tree tree;
  // A robot elsewhere, then a base on a free joint with two wheels that hang by anchors off their centres.
  const Vec3 base(1, 2, 3), v(0.4, 0.2, -0.3), w(0.1, 0.7, -0.2);
  const double heading = -0.8;
  const Vec3 across(std::cos(heading), 0, -std::sin(heading)), middle = base + Vec3(0.3, -0.1, 0.2);
  State state;
  state.t = 0.6;
  for (int b = 0; b < 4; ++b) model.bodies.push_back({"body", 1, Vec3::Constant(1), b == 0 ? 0 : 1});
  state.pose.assign(4, {});
  state.v.assign(24, 5.0);
  state.qd.assign(10, 0.0);
  state.pose[1].p = base;
  for (int i = 0; i < 3; ++i) {
    state.v[static_cast<std::size_t>(6 + i)] = v[i];
    state.v[static_cast<std::size_t>(9 + i)] = w[i];
  }
  Joint floating;
  floating.kind = JointKind::free;
  floating.body = 1;
  floating.v = 2;
  tree.joints.push_back(floating);
  for (int wheel = 0; wheel < 2; ++wheel) {
    Joint joint;
    joint.kind = JointKind::revolute;
    joint.body = 2 + wheel;
    joint.parent = 1;
    joint.up = 0;
    joint.v = 8 + wheel;
    joint.anchor_C = Vec3(0.2, wheel == 0 ? -0.1 : 0.3, 0.1);
    Pose& pose = state.pose[static_cast<std::size_t>(2 + wheel)];
    pose.q = Quat(Eigen::AngleAxisd(1.1 + wheel, Vec3(1, 2, -1).normalized()));
    // The right wheel (joint 1 here) half an axle along `across`, the left one against it.
    pose.p = middle + (wheel == 0 ? 0.5 : -0.5) * across - pose.q * joint.anchor_C;
    tree.joints.push_back(joint);
  }
  state.qd[8] = 1.5;   // right
  state.qd[9] = -0.5;  // left
  tree.v = 2;
  tree.nv = 8;
  model.trees = {Tree(), tree, Tree()};

  FigureEight law{.x_amplitude = 3,
                  .z_amplitude = 5,
                  .rate = 0.2,
                  .gain = 0.7,
                  .velocity_gain = 0.4,
                  .wheel_radius = 0.1,
                  .axle = 1};
  ControllerSpec spec;
  spec.row = find_controller("figure_eight");
  spec.tree = 1;
  spec.gains = {2.5, 3, 5, 0.2, 0.7, 0.4, 0.1, 1};
  spec.joints = {{1, 1, {}}, {0, 2, {}}};
  for (const bool on_world : {false, true}) {
    if (on_world)  // nothing carries the wheels: their axle stands still
      for (Joint& joint : model.trees[1].joints) joint.parent = -1;
    std::vector<double> tau(10, 0.25);
    spec.row->make(model, spec)(model, state, Vec3(0, -9.8, 0), tau);
    const Vec3 velocity = on_world ? Vec3(Vec3::Zero()) : Vec3(v + w.cross(middle - base));
    const FigureEight::WheelSpeeds wanted =
        law.wheel_speeds(0.6, middle.x(), middle.z(), heading, velocity.x(), velocity.z(), on_world ? 0 : w.y());
    CHECK(tau[8] == Approx(0.25 + 2.5 * (wanted.right - 1.5)));
    CHECK(tau[9] == Approx(0.25 + 2.5 * (wanted.left + 0.5)));
    for (std::size_t i = 0; i < 8; ++i) CHECK(tau[i] == 0.25);
  }
}
