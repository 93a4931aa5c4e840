#pragma once

namespace cb {

/// The figure eight and the law that drives a robot with two wheels along it (scenarios/mobile_robot.xml).
/// Path: X = -x_amplitude cos s, Z = z_amplitude sin 2s, s = rate t + 3 pi/2. It starts at the origin.
/// Heading: angle about the world's y axis; at 0 the robot faces -z, at pi/2 it faces -x.
struct FigureEight {
  double x_amplitude = 4, z_amplitude = 4;  ///< m
  double rate = 0.1;                        ///< rad/s
  double gain = 1;                          ///< of the pose error, 1/s
  double velocity_gain = 1e-3;              ///< of the velocity error, -
  double wheel_radius = 0.0825;             ///< m
  double axle = 0.3206;                     ///< m, from wheel to wheel

  /// Wanted position of the middle of the axle (m) and its rate.
  struct Place {
    double x, z, vx, vz;
  };
  Place place_at(double t) const;
  /// With the heading (rad, in (-pi, pi]) and its rate.
  struct Wanted : Place {
    double heading, turning;
  };
  Wanted at(double t) const;

  /// Wanted speeds of the wheels, rad/s, positive forward, from where the middle of the axle is and how it moves:
  ///   e = gain (pose error) + velocity_gain (velocity error), the heading's error in (-pi, pi]
  ///   speeds = pseudo-inverse of the 3 x 2 Jacobian from wheel speeds to (vx, vz, turning), times e
  /// The error across the heading does not enter.
  struct WheelSpeeds {
    double left, right;
  };
  WheelSpeeds wheel_speeds(double t, double x, double z, double heading, double vx, double vz, double turning) const;
};

}  // namespace cb
