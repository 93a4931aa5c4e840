// Forward kinematics of trees of bodies.
//
// Problem: joint coordinates and rates -> poses and twists of the links; parents come before their children, so that
// one sweep does it. Source: Featherstone, Rigid Body Dynamics Algorithms (2008), sections 4.4 and 4.5. Difference from
// the source: twists are of the centres of mass and in world axes, as everywhere in this program, in place of link
// coordinates; a link's inertia is then block diagonal, and contacts need no transformation.
#include "dynamics/kinematics.h"

#include <cmath>

namespace cb {

namespace {

// cos x and sin(x) / x from x^2. The series is used where its first term left out is below 1e-18.
void half_angle(double x2, double& cosine, double& sinc) {
  constexpr double series_below = 1e-3;  // of x^2
  if (x2 < series_below) {
    cosine = 1 - x2 / 2 * (1 - x2 / 12 * (1 - x2 / 30 * (1 - x2 / 56)));
    sinc = 1 - x2 / 6 * (1 - x2 / 20 * (1 - x2 / 42));
    return;
  }
  const double x = std::sqrt(x2);
  cosine = std::cos(x);
  sinc = std::sin(x) / x;
}

Vec3 linear(const State& state, int body) {
  return body < 0 ? Vec3(Vec3::Zero()) : Vec3(&state.v[6 * static_cast<std::size_t>(body)]);
}
Vec3 angular(const State& state, int body) {
  return body < 0 ? Vec3(Vec3::Zero()) : Vec3(&state.v[6 * static_cast<std::size_t>(body) + 3]);
}

void link_pose(const Joint& joint, State& state) {
  if (joint.kind == JointKind::free) return;
  static const Pose world;
  const Pose& parent = joint.parent < 0 ? world : state.pose[joint.parent];
  Pose& pose = state.pose[joint.body];
  pose.q = parent.q * joint.turn_PC;
  Vec3 along = Vec3::Zero();
  if (joint.kind == JointKind::revolute) {
    const double half = state.q[joint.q] / 2;
    const Vec3 e = std::sin(half) * joint.axis_C;
    pose.q = pose.q * Quat(std::cos(half), e.x(), e.y(), e.z());
  } else if (joint.kind == JointKind::prismatic) {
    along = state.q[joint.q] * joint.axis_C;
  }
  pose.q.normalize();
  pose.p = parent * joint.anchor_P + pose.q * (along - joint.anchor_C);
}

void link_twist(const Joint& joint, State& state) {
  Eigen::Map<Vec3> v(&state.v[6 * static_cast<std::size_t>(joint.body)]);
  Eigen::Map<Vec3> w(&state.v[6 * static_cast<std::size_t>(joint.body) + 3]);
  if (joint.kind == JointKind::free) {
    v = Vec3(&state.qd[joint.v]);
    w = Vec3(&state.qd[joint.v + 3]);
    return;
  }
  const Pose& pose = state.pose[joint.body];
  const Vec3 w_P = angular(state, joint.parent);
  v.setZero();
  w = w_P;
  if (joint.parent >= 0) v = linear(state, joint.parent) + w_P.cross(pose.p - state.pose[joint.parent].p);
  if (joint.kind == JointKind::fixed) return;
  const Vec3 rate = state.qd[joint.v] * (pose.q * joint.axis_C);
  if (joint.kind == JointKind::revolute) {
    w += rate;
    v -= rate.cross(pose.q * joint.anchor_C);
  } else {
    v += rate;
  }
}

}  // namespace

Pose advance(const Pose& from, const Vec3& v, const Vec3& w, double t) {
  Pose pose = from;
  pose.p += t * v;
  const Vec3 half = (t / 2) * w;
  const double x2 = half.squaredNorm();
  if (x2 == 0) return pose;  // no turn: the quaternion stays as it is, bit for bit
  double cosine = 0, sinc = 0;
  half_angle(x2, cosine, sinc);
  const Quat& q = from.q;
  const Vec3 e = sinc * half;
  const Vec3 u = q.vec();
  const Vec3 vec = cosine * u + q.w() * e + e.cross(u);
  const double scalar = cosine * q.w() - e.dot(u);
  const double scale = 1 / std::sqrt(scalar * scalar + vec.squaredNorm());
  pose.q = Quat(scale * scalar, scale * vec.x(), scale * vec.y(), scale * vec.z());
  return pose;
}

void forward_kinematics(const Model&, const Tree& tree, State& state) {
  for (const Joint& joint : tree.joints) {
    link_pose(joint, state);
    link_twist(joint, state);
  }
}

void link_twists(const Model&, const Tree& tree, State& state) {
  for (const Joint& joint : tree.joints) link_twist(joint, state);
}

void move_tree(const Model& model, const Tree& tree, const double* rates, double t, State& state) {
  for (const Joint& joint : tree.joints) {
    const double* rate = rates + joint.v - tree.v;
    if (joint.kind == JointKind::free)
      state.pose[joint.body] = advance(state.pose[joint.body], Vec3(rate), Vec3(rate + 3), t);
    else if (joint.q >= 0)
      state.q[joint.q] += t * *rate;
  }
  forward_kinematics(model, tree, state);
}

void advance_tree(const Model& model, const Tree& tree, double t, State& state) {
  move_tree(model, tree, &state.qd[tree.v], t, state);
}

void link_frames(const Model& model, const Tree& tree, const State& state, std::vector<LinkFrame>& frames) {
  frames.resize(tree.joints.size());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Joint& joint = tree.joints[i];
    const Pose& pose = state.pose[joint.body];
    LinkFrame& frame = frames[i];
    const Mat3 R = pose.q.toRotationMatrix();
    const Vec3& inertia = model.bodies[joint.body].inertia;
    frame.inertia.noalias() = R * inertia.asDiagonal() * R.transpose();
    if (joint.parent >= 0) frame.arm = pose.p - state.pose[joint.parent].p;
    if (joint.kind == JointKind::revolute) {
      const Vec3 axis = R * joint.axis_C;
      frame.lever = -(R * joint.anchor_C);
      frame.S << axis.cross(frame.lever), axis;
    } else if (joint.kind == JointKind::prismatic) {
      frame.S << R * joint.axis_C, Vec3::Zero();
    }
  }
}

void point_jacobian(const Model&, const Tree& tree, const State& state, int link, const Vec3& point,
                    Eigen::Ref<Eigen::Matrix3Xd> J) {
  J.setZero();
  for (int i = link; i >= 0; i = tree.joints[i].up) {
    const Joint& joint = tree.joints[i];
    const Pose& pose = state.pose[joint.body];
    const int column = joint.v - tree.v;
    if (joint.kind == JointKind::revolute) {
      J.col(column) = (pose.q * joint.axis_C).cross(point - pose * joint.anchor_C);
    } else if (joint.kind == JointKind::prismatic) {
      J.col(column) = pose.q * joint.axis_C;
    } else if (joint.kind == JointKind::free) {
      const Vec3 x = point - pose.p;
      J.middleCols<3>(column).setIdentity();
      J.middleCols<3>(column + 3) << 0, x.z(), -x.y(), -x.z(), 0, x.x(), x.y(), -x.x(), 0;  // w x x = -[x] w
    }
  }
}

int joint_of_body(const Tree& tree, int body) {
  for (int i = 0; i < static_cast<int>(tree.joints.size()); ++i)
    if (tree.joints[i].body == body) return i;
  return -1;
}

}  // namespace cb
