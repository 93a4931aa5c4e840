// Figure-eight tracking by differential drive (scenarios/mobile_robot.xml).
//
// Problem: speeds of two wheels (rad/s) that bring the middle of the axle to a moving pose. With the forward direction
// f = (-sin heading, -cos heading) in (x, z), radius r and axle length L, wheel speeds (l, r) move it by
//   (vx, vz) = f r (l + r) / 2,   turning = r (r - l) / L
// The columns for the sum and for the difference of the speeds are orthogonal, so that the pseudo-inverse is
//   l, r = (f.(e_x, e_z) -+ e_heading L / 2) / r
// Motors: torque = kv (wanted - actual speed).
#include "control/figure_eight.h"

#include <cmath>
#include <numbers>

#include "control/controller.h"

namespace cb {

FigureEight::Place FigureEight::place_at(double t) const {
  const double s = rate * t + 1.5 * std::numbers::pi;
  return {-x_amplitude * std::cos(s), z_amplitude * std::sin(2 * s), rate * x_amplitude * std::sin(s),
          2 * rate * z_amplitude * std::cos(2 * s)};
}

FigureEight::Wanted FigureEight::at(double t) const {
  Wanted wanted{place_at(t), 0, 0};
  const double ax = -rate * rate * wanted.x, az = -4 * rate * rate * wanted.z;
  wanted.heading = std::atan2(-wanted.vx, -wanted.vz);
  // d atan2(y, x) = (x dy - y dx) / (x^2 + y^2)
  const double square = wanted.vx * wanted.vx + wanted.vz * wanted.vz;
  wanted.turning = square > 0 ? (wanted.vz * ax - wanted.vx * az) / square : 0;  // it stands still
  return wanted;
}

FigureEight::WheelSpeeds FigureEight::wheel_speeds(double t, double x, double z, double heading, double vx, double vz,
                                                   double turning) const {
  const Wanted wanted = at(t);
  double turn = std::remainder(wanted.heading - heading, 2 * std::numbers::pi);
  if (turn <= -std::numbers::pi) turn += 2 * std::numbers::pi;
  const double e_x = gain * (wanted.x - x) + velocity_gain * (wanted.vx - vx);
  const double e_z = gain * (wanted.z - z) + velocity_gain * (wanted.vz - vz);
  const double e_turn = gain * turn + velocity_gain * (wanted.turning - turning);
  const double forward = -std::sin(heading) * e_x - std::cos(heading) * e_z;
  return {(forward - e_turn * axle / 2) / wheel_radius, (forward + e_turn * axle / 2) / wheel_radius};
}

namespace {

constexpr int left = 0, right = 1;  // roles

class FigureEightController {
 public:
  FigureEightController(const Model& model, const ControllerSpec& spec) : tree_(spec.tree) {
    const auto value = spec.gains.begin();
    law_ = {value[1], value[2], value[3], value[4], value[5], value[6], value[7]};
    kv_ = value[0];
    for (const ControllerSpec::ControlledJoint& part : spec.joints) wheel_[part.role] = part.joint;
    base_ = model.trees[tree_].joints[wheel_[left]].parent;
  }

  void operator()(const Model& model, const State& state, const Vec3&, std::span<double> tau) {
    const Tree& tree = model.trees[tree_];
    const Joint &l = tree.joints[wheel_[left]], &r = tree.joints[wheel_[right]];
    // The middle of the axle moves with the body that carries the wheels.
    const Vec3 middle = (state.pose[l.body] * l.anchor_C + state.pose[r.body] * r.anchor_C) / 2;
    Vec3 velocity = Vec3::Zero(), turning = Vec3::Zero();
    if (base_ >= 0) {
      const auto at = 6 * static_cast<std::size_t>(base_);
      turning = Vec3(&state.v[at + 3]);
      velocity = Vec3(&state.v[at]) + turning.cross(middle - state.pose[base_].p);
    }
    const Vec3 across = state.pose[r.body] * r.anchor_C - state.pose[l.body] * l.anchor_C;  // forward is y x across
    const double heading = std::atan2(-across.z(), across.x());
    const FigureEight::WheelSpeeds wanted =
        law_.wheel_speeds(state.t, middle.x(), middle.z(), heading, velocity.x(), velocity.z(), turning.y());
    tau[l.v] += kv_ * (wanted.left - state.qd[l.v]);
    tau[r.v] += kv_ * (wanted.right - state.qd[r.v]);
  }

 private:
  FigureEight law_;
  double kv_ = 0;
  int tree_ = 0, wheel_[2] = {0, 0}, base_ = -1;
};

}  // namespace

ControllerRow figure_eight_row() {
  const FigureEight d;
  return {
      "figure_eight",
      "drives a robot with two wheels along a figure eight; positive wheel rates drive forward",
      "the original's law, scenarios/mobile_robot.xml",
      {{"kv", "N m s/rad", "torque for each rad/s that a wheel is slower than wanted", std::nullopt, 0},
       {"x_amplitude", "m", "of the path X = -x_amplitude cos s", d.x_amplitude},
       {"z_amplitude", "m", "of the path Z = z_amplitude sin 2s", d.z_amplitude},
       {"rate", "rad/s", "s = rate t + 3 pi/2", d.rate},
       {"gain", "1/s", "of the error in position and heading", d.gain},
       {"velocity_gain", "", "of the error in velocity", d.velocity_gain},
       {"wheel_radius", "m", "", d.wheel_radius, 1e-6},
       {"axle", "m", "from wheel to wheel", d.axle, 1e-6}},
      {},
      {{"left", "the left wheel's joint", 1, 1, {}}, {"right", "the right wheel's joint", 1, 1, {}}},
      [](const Model& model, const ControllerSpec& spec) -> Controller { return FigureEightController(model, spec); },
      [](const Model& model, const ControllerSpec& spec, JointGains& gains) {
        for (const ControllerSpec::ControlledJoint& part : spec.joints)
          gains.damping[model.trees[spec.tree].joints[part.joint].v] += spec.gains[0];  // kv
      }};
}

}  // namespace cb
