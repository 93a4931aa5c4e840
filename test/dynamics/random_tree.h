#pragma once

#include <random>

#include "dynamics/kinematics.h"

namespace cb {

/// A tree of `links` bodies with joints of all kinds, anywhere and in any direction, moving at random.
struct RandomTree {
  Model model;
  State state;
  std::mt19937 random;

  double number(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); }
  Vec3 vector(double size) { return {number(-size, size), number(-size, size), number(-size, size)}; }
  Quat turn() { return Quat(Eigen::AngleAxisd(number(-3, 3), vector(1).normalized())); }
  std::vector<double> numbers(std::size_t count, double size) {
    std::vector<double> x(count);
    for (double& value : x) value = number(-size, size);
    return x;
  }

  RandomTree(unsigned seed, int links, bool floating) : random(seed) {
    Tree tree;
    tree.name = "robot";
    for (int i = 0; i < links; ++i) {
      Body body{"link_" + std::to_string(i), number(0.2, 3), {}, 0};
      for (double& moment : body.inertia) moment = number(0.01, 0.1);
      model.bodies.push_back(body);
      Joint joint;
      joint.name = "joint_" + std::to_string(i);
      joint.body = i;
      joint.up = i == 0 ? -1 : std::uniform_int_distribution<int>(std::max(0, i - 2), i - 1)(random);
      joint.parent = joint.up;
      joint.anchor_P = vector(0.3);
      joint.anchor_C = vector(0.3);
      joint.turn_PC = turn();
      joint.axis_C = vector(1).normalized();
      const double kind = number(0, 1);
      joint.kind = kind < 0.6 ? JointKind::revolute : kind < 0.85 ? JointKind::prismatic : JointKind::fixed;
      if (i == 0) joint.kind = floating ? JointKind::free : JointKind::revolute;
      if (joint.nv() > 0) joint.v = tree.nv;
      if (joint.nv() == 1) {
        joint.q = static_cast<int>(state.q.size());
        state.q.push_back(number(-3, 3));
      }
      tree.nv += joint.nv();
      tree.joints.push_back(joint);
      state.pose.push_back({vector(1), turn()});
    }
    state.v.assign(6 * static_cast<std::size_t>(links), 0);
    state.qd = numbers(static_cast<std::size_t>(tree.nv), 2);
    model.trees.push_back(tree);
    forward_kinematics(model, model.trees[0], state);
  }
  const Tree& tree() const { return model.trees[0]; }
};

}  // namespace cb
