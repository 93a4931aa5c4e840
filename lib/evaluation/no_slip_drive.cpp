// What the mobile robot would do on wheels that never slip (scenarios/mobile_robot.xml).
//
// Problem: with f, l the directions forward and left, the middle of the axle moves with speed u f and the robot turns
// with w about the vertical. A part at (a, b) forward and left of it moves with (u - w b) f + w a l. From d'Alembert's
// principle with the wheels' spins (u -+ w L/2) / r:
//   (m + 2 I / r^2) u' - S_l w'                   = F / r + S_f w^2
//   -S_l u' + (J + I L^2 / (2 r^2)) w'            = T L / (2 r) - S_f u w
// m, S_f, S_l, J: mass, its first moments forward and left, its moment about the vertical; I: a wheel about the axle;
// F, T: sum and difference (right minus left) of the motors' torques, limited, less the axles' friction.
// Differences from the simulated robot: pitch and roll are frozen (no counterweight is that heavy, the robot's is
// within 1e-6 rad); motors act at every instant, not from step to step.
// Check: the classical Runge-Kutta step is refined where the motors are quick; halving it moves the scene's robot by
// less than 1e-12 m (test/evaluation).
#include "evaluation/no_slip_drive.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace cb {

namespace {

/// The round shape about a wheel's axle.
const Shape* tyre(const Scenario& scenario, int body) {
  for (const Shape& shape : scenario.shapes)
    if (shape.body == body && shape.radius > 0) return &shape;
  return nullptr;
}

double gain(const ControllerSpec& spec, std::string_view name) {
  for (std::size_t i = 0; i < spec.row->gains.size(); ++i)
    if (spec.row->gains[i].name == name) return spec.gains[i];
  return 0;
}

double heading_of(const Vec3& left_hub, const Vec3& right_hub) {
  const Vec3 across = right_hub - left_hub;
  return std::atan2(-across.z(), across.x());
}

}  // namespace

WheeledRobot::State WheeledRobot::state_of(const cb::State& state) const {
  const Vec3 left = state.pose[left_wheel] * left_hub, right = state.pose[right_wheel] * right_hub;
  const auto velocity = [&](int body, const Vec3& point) -> Vec3 {
    const double* v = &state.v[6 * static_cast<std::size_t>(body)];
    return Vec3(v) + Vec3(v + 3).cross(point - state.pose[body].p);
  };
  const Vec3 v_left = velocity(left_wheel, left), v_right = velocity(right_wheel, right);
  State out;
  out.x = (left.x() + right.x()) / 2;
  out.z = (left.z() + right.z()) / 2;
  out.heading = heading_of(left, right);
  const Vec3 forward(-std::sin(out.heading), 0, -std::cos(out.heading));
  out.speed = forward.dot(v_left + v_right) / 2;
  out.turning = forward.dot(v_right - v_left) / axle;
  return out;
}

std::optional<WheeledRobot> wheeled_robot(const Scenario& scenario) {
  const Model& model = scenario.model;
  if (scenario.controllers.size() != 1 || scenario.controllers[0].row->name != "figure_eight") return std::nullopt;
  const ControllerSpec& spec = scenario.controllers[0];
  WheeledRobot robot;
  robot.tree = spec.tree;
  const Tree& tree = model.trees[spec.tree];
  if (tree.joints[0].kind != JointKind::free || model.bodies.size() != tree.joints.size()) return std::nullopt;
  const Joint *left = nullptr, *right = nullptr;
  for (const ControllerSpec::ControlledJoint& part : spec.joints)
    (spec.row->roles[part.role].name == "left" ? left : right) = &tree.joints[part.joint];
  if (!left || !right) return std::nullopt;
  for (const Joint& joint : tree.joints)
    if (&joint != &tree.joints[0] && &joint != left && &joint != right && joint.kind != JointKind::fixed)
      return std::nullopt;

  const Shape *left_tyre = tyre(scenario, left->body), *right_tyre = tyre(scenario, right->body);
  if (!left_tyre || !right_tyre || left_tyre->radius != right_tyre->radius) return std::nullopt;
  robot.law = {gain(spec, "x_amplitude"),   gain(spec, "z_amplitude"),  gain(spec, "rate"), gain(spec, "gain"),
               gain(spec, "velocity_gain"), gain(spec, "wheel_radius"), gain(spec, "axle")};
  robot.kv = gain(spec, "kv");
  if (robot.law.rate == 0) return std::nullopt;
  if (left->damping != right->damping || left->torque_limit != right->torque_limit) return std::nullopt;
  robot.damping = left->damping;
  robot.torque_limit = left->torque_limit;
  robot.radius = left_tyre->radius;
  robot.left_wheel = left->body;
  robot.right_wheel = right->body;
  robot.left_hub = left_tyre->local.p;
  robot.right_hub = right_tyre->local.p;

  const auto& pose = scenario.initial.pose;
  const Vec3 left_hub = pose[left->body] * robot.left_hub, right_hub = pose[right->body] * robot.right_hub;
  robot.axle = (right_hub - left_hub).norm();
  const auto about_axle = [&](const Joint& joint) {
    return model.bodies[joint.body].inertia.dot(joint.axis_C.cwiseAbs2());
  };
  robot.wheel_inertia = about_axle(*left);
  const bool level = std::abs(right_hub.y() - left_hub.y()) <= 1e-9 * robot.axle;
  if (!level || std::abs(about_axle(*right) - robot.wheel_inertia) > 1e-9 * robot.wheel_inertia) return std::nullopt;

  const Vec3 middle = (left_hub + right_hub) / 2;
  const double heading = heading_of(left_hub, right_hub);
  const Vec3 forward(-std::sin(heading), 0, -std::cos(heading)), to_left = (left_hub - right_hub) / robot.axle;
  for (std::size_t b = 0; b < model.bodies.size(); ++b) {
    const Body& body = model.bodies[b];
    const Vec3 at = pose[b].p - middle;
    const double ahead = forward.dot(at), aside = to_left.dot(at);
    const Vec3 vertical = pose[b].q.conjugate() * Vec3(0, 1, 0);
    robot.mass += body.mass;
    robot.forward_moment += body.mass * ahead;
    robot.left_moment += body.mass * aside;
    robot.yaw_inertia += body.mass * (ahead * ahead + aside * aside) + body.inertia.dot(vertical.cwiseAbs2());
  }
  return robot;
}

NoSlipDrive::NoSlipDrive(const WheeledRobot& robot, const WheeledRobot::State& start) : robot_(robot), state_(start) {
  const double r = robot.radius, L = robot.axle;
  const double a = robot.mass + 2 * robot.wheel_inertia / (r * r);
  const double b = -robot.left_moment;
  const double d = robot.yaw_inertia + robot.wheel_inertia * L * L / (2 * r * r);
  const double determinant = a * d - b * b;
  turn_inverse_[0][0] = d / determinant;
  turn_inverse_[0][1] = turn_inverse_[1][0] = -b / determinant;
  turn_inverse_[1][1] = a / determinant;
  // The motors' quickest rate, 1/s: a step stays a small fraction of it.
  const double motor = robot.kv + robot.damping;
  const double quickest = motor * std::max(2 / (r * r) / a, L * L / (2 * r * r) / d);
  constexpr double fraction = 0.02;
  longest_ = std::min(1e-3, fraction / std::max(quickest, 1e-9));
}

WheeledRobot::State NoSlipDrive::rate(double t, const WheeledRobot::State& state) const {
  const double forward_x = -std::sin(state.heading), forward_z = -std::cos(state.heading);
  const double vx = state.speed * forward_x, vz = state.speed * forward_z;
  const FigureEight::WheelSpeeds wanted =
      robot_.law.wheel_speeds(t, state.x, state.z, state.heading, vx, vz, state.turning);
  const double r = robot_.radius, half = robot_.axle / 2;
  const auto torque = [&](double wanted_speed, double speed) {
    return std::clamp(robot_.kv * (wanted_speed - speed), -robot_.torque_limit, robot_.torque_limit) -
           robot_.damping * speed;
  };
  const double left = torque(wanted.left, (state.speed - state.turning * half) / r);
  const double right = torque(wanted.right, (state.speed + state.turning * half) / r);
  const double along = (left + right) / r + robot_.forward_moment * state.turning * state.turning;
  const double about = (right - left) * half / r - robot_.forward_moment * state.speed * state.turning;
  return {vx, vz, state.turning, turn_inverse_[0][0] * along + turn_inverse_[0][1] * about,
          turn_inverse_[1][0] * along + turn_inverse_[1][1] * about};
}

const WheeledRobot::State& NoSlipDrive::at(double t) {
  const double span = t - t_;
  if (!(span > 0)) return state_;
  const auto plus = [](const WheeledRobot::State& a, double h, const WheeledRobot::State& b) {
    return WheeledRobot::State{a.x + h * b.x, a.z + h * b.z, a.heading + h * b.heading, a.speed + h * b.speed,
                               a.turning + h * b.turning};
  };
  const int steps = std::max(1, static_cast<int>(std::ceil(span / longest_ * (1 - 1e-9))));
  const double h = span / steps;
  for (int i = 0; i < steps; ++i) {
    const double now = t_ + i * h;
    const WheeledRobot::State k1 = rate(now, state_);
    const WheeledRobot::State k2 = rate(now + h / 2, plus(state_, h / 2, k1));
    const WheeledRobot::State k3 = rate(now + h / 2, plus(state_, h / 2, k2));
    const WheeledRobot::State k4 = rate(now + h, plus(state_, h, k3));
    state_ = plus(plus(plus(plus(state_, h / 6, k1), h / 3, k2), h / 3, k3), h / 6, k4);
  }
  t_ = t;
  return state_;
}

// Newton's method for the least distance from the place where the last one was, kept within `reach` of the wanted
// place: the figure's branches are further apart than that but at the crossing, where continuity tells them apart.
double CrossTrack::distance(double t, double x, double z) {
  constexpr double reach = 0.8;  // rad
  const double s_wanted = path_.rate * t;
  double lag = lag_.value_or(0);
  const auto place = [&](double by, double d[2], double d1[2], double d2[2]) {
    const FigureEight::Place at = path_.place_at((s_wanted - by) / path_.rate);
    d[0] = x - at.x;
    d[1] = z - at.z;
    d1[0] = at.vx / path_.rate;
    d1[1] = at.vz / path_.rate;
    d2[0] = -at.x;
    d2[1] = -4 * at.z;
  };
  double d[2], d1[2], d2[2];
  for (int i = 0; i < 8; ++i) {
    place(lag, d, d1, d2);
    const double length2 = d1[0] * d1[0] + d1[1] * d1[1];
    const double slope = d[0] * d1[0] + d[1] * d1[1];
    // A minimum has this curvature positive; far from the path Gauss and Newton's, which always is.
    const double curvature = std::max(length2 - (d[0] * d2[0] + d[1] * d2[1]), 0.5 * length2);
    const double step = std::clamp(-slope / curvature, -0.2, 0.2);
    lag = std::clamp(lag + step, -reach, reach);
    if (std::abs(step) < 1e-9) break;
  }
  place(lag, d, d1, d2);
  lag_ = lag;
  return std::hypot(d[0], d[1]);
}

}  // namespace cb
