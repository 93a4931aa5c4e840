#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "linalg/block_matrix.h"

namespace cb {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using Quat = Eigen::Quaterniond;

/// Position and orientation of a body's centre of mass in the world: x_W = p + R(q) x_B.
struct Pose {
  Vec3 p = Vec3::Zero();      ///< m
  Quat q = Quat::Identity();  ///< unit
  Vec3 operator*(const Vec3& x_B) const { return p + q * x_B; }
};

/// A rigid body that moves freely; its axes are principal and its origin is its centre of mass.
struct Body {
  std::string name;
  double mass = 0;              ///< kg, > 0
  Vec3 inertia = Vec3::Zero();  ///< principal moments about the centre of mass, kg m^2, > 0
};

/// What does not change after loading.
struct Model {
  std::vector<Body> bodies;  ///< bodies fixed to the world are not here
  int nv() const { return 6 * static_cast<int>(bodies.size()); }
};

/// What changes; copying it is a checkpoint. v: 6 per body, linear velocity of the centre of mass then angular
/// velocity, both in the world frame (m/s, rad/s).
struct State {
  double t = 0;  ///< s
  std::vector<Pose> pose;
  std::vector<double> v;
};

}  // namespace cb
