#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <limits>
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

/// A rigid body; its axes are principal and its origin is its centre of mass.
struct Body {
  std::string name;
  double mass = 0;              ///< kg, > 0
  Vec3 inertia = Vec3::Zero();  ///< principal moments about the centre of mass, kg m^2, > 0
  int tree = -1;                ///< index into Model::trees of the robot that it is a link of; -1: moves freely
};

enum class JointKind { fixed, revolute, prismatic, free };

/// Joins a body to its parent. With R, p for the poses of parent P and body C, q the joint's coordinate:
///   R_C = R_P turn_PC exp([axis_C q])                   revolute (R_P turn_PC otherwise)
///   p_C = p_P + R_P anchor_P - R_C anchor_C (+ R_C axis_C q  prismatic)
/// A free joint hangs on the world; its coordinates are the body's pose and its rates the body's twist in State::v's
/// order, so that it has six rates and no entry of State::q.
struct Joint {
  std::string name;
  JointKind kind = JointKind::fixed;
  int parent = -1;               ///< index into Model::bodies, -1: the world
  int body = -1;                 ///< index into Model::bodies: the child
  int up = -1;                   ///< index of the parent's joint in Tree::joints, -1 where the parent is the world
  Vec3 anchor_P = Vec3::Zero();  ///< a point of the joint's axis, in the parent's frame (the world's), m
  Vec3 anchor_C = Vec3::Zero();  ///< the same point where q = 0, in the body's frame, m
  Quat turn_PC = Quat::Identity();
  Vec3 axis_C = Vec3::UnitX();                              ///< unit, in the body's frame
  double lower = -std::numeric_limits<double>::infinity();  ///< least q, rad or m
  double upper = std::numeric_limits<double>::infinity();   ///< largest q
  /// With it both limits move, rad/s or m/s, whatever that takes: a stop driven from outside, not a motor.
  double limit_rate = 0;
  double damping = 0;                                             ///< viscous, N m s/rad or N s/m: torque -damping qd
  double stiffness = 0;                                           ///< of a spring, N m/rad or N/m
  double rest = 0;                                                ///< q at which the spring has no torque
  double torque_limit = std::numeric_limits<double>::infinity();  ///< of the motor, N m or N: |tau| at most this
  int q = -1;  ///< where the coordinate is in State::q; -1: it has none
  int v = -1;  ///< where the rates begin in State::qd and tau; -1: fixed

  int nv() const { return kind == JointKind::fixed ? 0 : kind == JointKind::free ? 6 : 1; }
  /// What damping and spring give at coordinate q and rate qd, N m or N.
  double passive_torque(double at_q, double qd) const { return -damping * qd - stiffness * (at_q - rest); }
  bool limited() const { return std::isfinite(lower) || std::isfinite(upper); }
  /// How far coordinate q is from the lower (sign 1) or upper (sign -1) limit at time t (s); negative: beyond it.
  double limit_gap(double sign, double at_q, double t) const {
    return sign * (at_q - limit_rate * t - (sign > 0 ? lower : upper));
  }
};

/// A robot: bodies joined without loops, in reduced coordinates.
struct Tree {
  std::string name;
  std::vector<Joint> joints;  ///< one a link, parents first
  int v = 0;                  ///< where its rates begin in State::qd
  int nv = 0;                 ///< number of them, > 0
};

/// What does not change after loading.
struct Model {
  std::vector<Body> bodies;  ///< all that move, links too; bodies fixed to the world are not here
  std::vector<Tree> trees = {};
  int nv() const { return 6 * static_cast<int>(bodies.size()); }
};

/// What changes; copying it is a checkpoint. v: 6 per body, linear velocity of the centre of mass then angular
/// velocity, both in the world frame (m/s, rad/s). Poses and twists of links follow from q and qd (kinematics.h).
struct State {
  double t = 0;  ///< s
  std::vector<Pose> pose;
  std::vector<double> v;
  std::vector<double> q = {};   ///< one a revolute or prismatic joint, rad or m
  std::vector<double> qd = {};  ///< rates of all trees: one a revolute or prismatic joint, six a free one
};
/// Of the body's point that is at `position`, m/s.
inline Vec3 velocity_at(const State& state, int body, const Vec3& position) {
  const double* v = &state.v[6 * static_cast<std::size_t>(body)];
  return Vec3(v) + Vec3(v + 3).cross(position - state.pose[body].p);
}

}  // namespace cb
