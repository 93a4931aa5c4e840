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
