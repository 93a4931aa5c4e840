// Figure-eight tracking by differential drive (spec: scenarios.md, mobile_robot).
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

FigureEight::Wanted FigureEight::at(double t) const {
  const double s = rate * t + 1.5 * std::numbers::pi;
  Wanted wanted{};
  wanted.x = -x_amplitude * std::cos(s);
  wanted.z = z_amplitude * std::sin(2 * s);
  wanted.vx = rate * x_amplitude * std::sin(s);
  wanted.vz = 2 * rate * z_amplitude * std::cos(2 * s);
  const double ax = rate * rate * x_amplitude * std::cos(s), az = -4 * rate * rate * z_amplitude * std::sin(2 * s);
  wanted.heading = std::atan2(-wanted.vx, -wanted.vz);
  // d atan2(y, x) = (x dy - y dx) / (x^2 + y^2)
  wanted.turning = (wanted.vz * ax - wanted.vx * az) / (wanted.vx * wanted.vx + wanted.vz * wanted.vz);
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

}  // namespace cb
