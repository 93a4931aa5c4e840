#pragma once

#include <optional>

#include "control/figure_eight.h"
#include "scenario/scenario.h"

namespace cb {

/// A robot on two wheels whose rims neither slip nor leave level ground, driven along a figure eight by its motors: its
/// mass, yaw inertia and motors, without contact forces to solve for.
struct WheeledRobot {
  FigureEight law;
  double kv = 0;            ///< N m s/rad, of the motors
  double torque_limit = 0;  ///< N m, each; may be infinite
  double damping = 0;       ///< N m s/rad, of each axle
  double radius = 0;        ///< m, of both wheels
  double axle = 0;          ///< m, from wheel to wheel
  double mass = 0;          ///< kg, all of it
  /// First moments of the mass about the middle of the axle, forward and to the left, kg m; moment about the vertical
  /// through it, kg m^2.
  double forward_moment = 0, left_moment = 0, yaw_inertia = 0;
  double wheel_inertia = 0;  ///< kg m^2, of each wheel about the axle

  /// Bodies and shapes that it was read from.
  int tree = -1, left_wheel = -1, right_wheel = -1;        ///< index into Model::trees, Model::bodies
  Vec3 left_hub = Vec3::Zero(), right_hub = Vec3::Zero();  ///< centres of the wheels in their own frames, m

  /// Middle of the axle and heading (figure_eight.h), forward and turning speed.
  struct State {
    double x = 0, z = 0, heading = 0;  ///< m, m, rad
    double speed = 0, turning = 0;     ///< m/s, rad/s
  };
  State state_of(const cb::State& state) const;
};

/// Reads the robot out of a scene: one tree on a free joint, a figure_eight controller, two equal round wheels about
/// one level axle. None where the scene is another.
std::optional<WheeledRobot> wheeled_robot(const Scenario& scenario);

/// Its motion under the law, taken at every instant: rolling without slip, integrated by the classical Runge-Kutta
/// method with steps of at most 1 ms.
class NoSlipDrive {
 public:
  NoSlipDrive(const WheeledRobot& robot, const WheeledRobot::State& start);
  /// State at t >= 0, s; times asked for must not decrease.
  const WheeledRobot::State& at(double t);

 private:
  WheeledRobot::State rate(double t, const WheeledRobot::State& state) const;

  WheeledRobot robot_;
  WheeledRobot::State state_;
  double t_ = 0, longest_ = 0;                    ///< s, s
  double turn_inverse_[2][2] = {{0, 0}, {0, 0}};  ///< inverse of the 2 x 2 mass matrix for (speed, turning)
};

/// Distance from a figure eight: to the branch that the wanted place runs on, not to the other one where they cross.
class CrossTrack {
 public:
  explicit CrossTrack(const FigureEight& path) : path_(path) {}
  /// m; times asked for must not decrease.
  double distance(double t, double x, double z);

 private:
  FigureEight path_;
  std::optional<double> lag_;  ///< rad, of the nearest place behind the wanted one
};

}  // namespace cb
