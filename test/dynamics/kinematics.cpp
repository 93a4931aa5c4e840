// Poses, twists and limits of joints as lib/dynamics/model.h states them, with matrices written down anew.
#include "dynamics/kinematics.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "random_tree.h"

using namespace cb;

namespace {

Mat3 skew(const Vec3& x) {
  Mat3 S;
  S << 0, -x.z(), x.y(), x.z(), 0, -x.x(), -x.y(), x.x(), 0;
  return S;
}

/// exp([w]) by Rodrigues.
Mat3 turned(const Vec3& w) {
  const double angle = w.norm();
  if (angle == 0) return Mat3::Identity();
  const Mat3 K = skew(w / angle);
  return Mat3::Identity() + std::sin(angle) * K + (1 - std::cos(angle)) * K * K;
}

}  // namespace

TEST_CASE("the pose of a link is that of its parent, turned and moved as its joint says") {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const RandomTree t(seed, 9, seed % 2 == 1);
    INFO("seed " << seed);
    for (const Joint& joint : t.tree().joints) {
      if (joint.kind == JointKind::free) continue;
      const Mat3 R_P = joint.parent < 0 ? Mat3::Identity() : t.state.pose[joint.parent].q.toRotationMatrix();
      const Vec3 p_P = joint.parent < 0 ? Vec3::Zero() : t.state.pose[joint.parent].p;
      Mat3 R = R_P * joint.turn_PC.toRotationMatrix();
      if (joint.kind == JointKind::revolute) R = R * turned(t.state.q[joint.q] * joint.axis_C);
      Vec3 p = p_P + R_P * joint.anchor_P - R * joint.anchor_C;
      if (joint.kind == JointKind::prismatic) p += R * joint.axis_C * t.state.q[joint.q];
      CHECK((t.state.pose[joint.body].q.toRotationMatrix() - R).norm() < 1e-13);
      CHECK((t.state.pose[joint.body].p - p).norm() < 1e-13);
    }
  }
}

TEST_CASE("a body that has turned before goes on about the world's axes") {
  const Quat q(Eigen::AngleAxisd(2.1, Vec3(1, -2, 0.5).normalized()));
  for (const Vec3& w : {Vec3(0.01, 0.02, -0.01), Vec3(-2, 1, 3)}) {
    const Pose pose = advance({{1, 2, 3}, q}, {4, -5, 6}, w, 0.25);
    CHECK((pose.q.toRotationMatrix() - turned(0.25 * w) * q.toRotationMatrix()).norm() < 1e-14);
    CHECK((pose.p - Vec3(2, 0.75, 4.5)).norm() < 1e-15);
    const Pose back = advance(pose, {4, -5, 6}, w, -0.25);
    CHECK((back.q.toRotationMatrix() - q.toRotationMatrix()).norm() < 1e-14);
  }
}

TEST_CASE("an orientation is a unit quaternion, however long a body has turned and whatever it was before") {
  Pose pose;
  for (int i = 0; i < 20000; ++i) pose = advance(pose, Vec3::Zero(), {3, -1, 2}, 0.01);
  CHECK(std::abs(pose.q.norm() - 1) < 1e-15);
  const Quat off(1.0001 * Quat::Identity().coeffs());
  CHECK(std::abs(advance({{0, 0, 0}, off}, Vec3::Zero(), {3, -1, 2}, 0.01).q.norm() - 1) < 1e-15);
  CHECK(advance({{0, 0, 0}, off}, Vec3::Zero(), Vec3::Zero(), 0.01).q.coeffs() == off.coeffs());
}

TEST_CASE("a tree moves by the rates that are given, whatever its own are") {
  for (const bool floating : {false, true}) {
    const RandomTree t(4, 6, floating);
    RandomTree moved = t;
    std::vector<double> rates = moved.numbers(t.state.qd.size(), 1);
    move_tree(t.model, t.tree(), rates.data(), 0.3, moved.state);
    for (const Joint& joint : t.tree().joints) {
      if (joint.q >= 0) CHECK(moved.state.q[joint.q] == Approx(t.state.q[joint.q] + 0.3 * rates[joint.v]));
      if (joint.kind != JointKind::free) continue;
      const Vec3 v(&rates[joint.v]), w(&rates[joint.v + 3]);
      CHECK((moved.state.pose[joint.body].p - t.state.pose[joint.body].p - 0.3 * v).norm() < 1e-15);
      CHECK((moved.state.pose[joint.body].q.toRotationMatrix() -
             turned(0.3 * w) * t.state.pose[joint.body].q.toRotationMatrix())
                .norm() < 1e-14);
    }
    CHECK(moved.state.qd == t.state.qd);
    // Links follow: twists are those of the tree's own rates where it is now.
    State again = moved.state;
    std::fill(again.v.begin(), again.v.end(), 0.0);
    forward_kinematics(t.model, t.tree(), again);
    CHECK(again.v == moved.state.v);
    State twists = moved.state;
    for (double& rate : twists.qd) rate *= 2;
    link_twists(t.model, t.tree(), twists);
    for (std::size_t i = 0; i < twists.v.size(); ++i) CHECK(twists.v[i] == Approx(2 * moved.state.v[i]).margin(1e-14));
  }
}

TEST_CASE("a point of a body has the velocity of its centre and what turning adds") {
  State state;
  state.pose = {{}, {{1, 2, 3}, Quat::Identity()}};
  state.v = {9, 9, 9, 9, 9, 9, 1, 2, 3, 0.5, -1, 2};
  // w x (0, 1, -2) = (-1 (-2) - 2 1, 2 0 - 0.5 (-2), 0.5 1).
  CHECK((velocity_at(state, 1, {1, 3, 1}) - Vec3(1 + 0, 2 + 1, 3 + 0.5)).norm() < 1e-15);
}

TEST_CASE("gaps of a joint's limits close as the limits move, and torques oppose stretch and rate") {
  Joint joint;
  CHECK_FALSE(joint.limited());
  joint.upper = 2;
  CHECK(joint.limited());
  CHECK(joint.limit_gap(-1, 0.5, 7) == 1.5);
  joint.lower = -1;
  joint.limit_rate = 0.25;
  CHECK(joint.limit_gap(1, 0.5, 2) == 1);        // the lower one is at -0.5
  CHECK(joint.limit_gap(-1, 0.5, 2) == 2);       // the upper one at 2.5
  CHECK(joint.limit_gap(1, -0.75, 2) == -0.25);  // beyond it
  Joint lower;
  lower.lower = 0;
  CHECK(lower.limited());
  joint.damping = 3;
  joint.stiffness = 5;
  joint.rest = 0.5;
  CHECK(joint.passive_torque(1.5, 2) == -11);
  CHECK(Joint().nv() == 0);
}
