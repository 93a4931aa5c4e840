#pragma once

#include <vector>

#include "dynamics/model.h"

namespace cb {

using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat6 = Eigen::Matrix<double, 6, 6>;

/// The pose after t seconds: translation with v (m/s), rotation by the exponential map of w t (w in rad/s, world).
Pose advance(const Pose& pose, const Vec3& v, const Vec3& w, double t);

/// Sets poses and twists of a tree's links from q and qd; the body of a free joint has its pose already.
void forward_kinematics(const Model& model, const Tree& tree, State& state);
/// Sets their twists alone (after a change of qd).
void link_twists(const Model& model, const Tree& tree, State& state);
/// Moves the joints by t times `rates` (tree.nv, as qd): coordinates add, a free joint's body goes as `advance` says;
/// then poses and twists of the links.
void move_tree(const Model& model, const Tree& tree, const double* rates, double t, State& state);
/// q <- q + t qd (the pose of a free joint's body: advance), then poses and twists of the links.
void advance_tree(const Model& model, const Tree& tree, double t, State& state);

/// One joint and its link in the present configuration: what the algorithms below need of it. World axes; twists and
/// wrenches (linear, then angular part) refer to the link's centre of mass.
struct LinkFrame {
  Vec3 arm = Vec3::Zero();      ///< from the parent's centre of mass to the link's, m; 0 where the parent is the world
  Vec3 lever = Vec3::Zero();    ///< revolute: from the joint's axis to the link's centre of mass, m
  Vec6 S = Vec6::Zero();        ///< revolute, prismatic: the link's twist for qd = 1, its parent at rest
  Mat3 inertia = Mat3::Zero();  ///< about the centre of mass, kg m^2
};
/// One for each joint of the tree. Does not allocate after the first call.
void link_frames(const Model& model, const Tree& tree, const State& state, std::vector<LinkFrame>& frames);

/// J with J qd = velocity (m/s, world) of the material point of joint `link`'s body that is at `point` now.
/// 3 x tree.nv, all columns are written.
void point_jacobian(const Model& model, const Tree& tree, const State& state, int link, const Vec3& point,
                    Eigen::Ref<Eigen::Matrix3Xd> J);
/// Index in tree.joints of the joint that carries a body, -1 where none does.
int joint_of_body(const Tree& tree, int body);

}  // namespace cb
