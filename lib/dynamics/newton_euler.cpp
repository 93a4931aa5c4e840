// Recursive Newton-Euler algorithm: tau = M(q) qdd + bias(q, qd) - forces, in time linear in the number of links.
//
// Source: Featherstone (2008), section 5.3, table 5.1. Difference: classical accelerations of the centres of mass in
// world axes (as in Luh, Walker and Paul 1980), not spatial ones in link coordinates. Does not fail.
#include "dynamics/newton_euler.h"

namespace cb {

Vec6 bias_acceleration(const Joint& joint, const LinkFrame& frame, const State& state) {
  Vec6 bias = Vec6::Zero();
  if (joint.kind == JointKind::free) return bias;
  const Vec3 w_P =
      joint.parent < 0 ? Vec3(Vec3::Zero()) : Vec3(&state.v[6 * static_cast<std::size_t>(joint.parent) + 3]);
  const Vec3 w(&state.v[6 * static_cast<std::size_t>(joint.body) + 3]);
  switch (joint.kind) {
    case JointKind::revolute: {
      const Vec3 turning = w_P.cross(w);  // w_P x axis qd, as w = w_P + axis qd
      bias.head<3>() =
          w_P.cross(w_P.cross(frame.arm - frame.lever)) + turning.cross(frame.lever) + w.cross(w.cross(frame.lever));
      bias.tail<3>() = turning;
      break;
    }
    case JointKind::prismatic:
      bias.head<3>() = w_P.cross(w_P.cross(frame.arm)) + 2 * state.qd[joint.v] * w_P.cross(frame.S.head<3>());
      break;
    default:
      bias.head<3>() = w_P.cross(w_P.cross(frame.arm));
  }
  return bias;
}

void NewtonEuler::inverse_dynamics(const Model& model, const Tree& tree, const State& state,
                                   std::span<const Vec3> force, std::span<const double> qdd, std::span<double> tau) {
  const std::size_t n = tree.joints.size();
  link_frames(model, tree, state, frames_);
  for (auto* part : {&linear_, &angular_, &wrench_f_, &wrench_n_}) part->resize(n);

  // Outward: accelerations, and the wrench that each link needs.
  for (std::size_t i = 0; i < n; ++i) {
    const Joint& joint = tree.joints[i];
    const LinkFrame& frame = frames_[i];
    const Body& body = model.bodies[joint.body];
    Vec6 a = bias_acceleration(joint, frame, state);
    if (joint.up >= 0) {
      a.head<3>() += linear_[joint.up] + angular_[joint.up].cross(frame.arm);
      a.tail<3>() += angular_[joint.up];
    }
    if (joint.kind == JointKind::free)
      a += Eigen::Map<const Vec6>(&qdd[joint.v - tree.v]);
    else if (joint.v >= 0)
      a += qdd[joint.v - tree.v] * frame.S;
    linear_[i] = a.head<3>();
    angular_[i] = a.tail<3>();
    const Vec3 w(&state.v[6 * static_cast<std::size_t>(joint.body) + 3]);
    wrench_f_[i] = body.mass * linear_[i];
    if (!force.empty()) wrench_f_[i] -= force[joint.body];
    wrench_n_[i] = frame.inertia * angular_[i] + w.cross(frame.inertia * w);
  }

  // Inward: what the joints transmit.
  for (std::size_t i = n; i-- > 0;) {
    const Joint& joint = tree.joints[i];
    const LinkFrame& frame = frames_[i];
    if (joint.kind == JointKind::free) {
      Eigen::Map<Vec3>(tau.data() + joint.v - tree.v) = wrench_f_[i];
      Eigen::Map<Vec3>(tau.data() + joint.v - tree.v + 3) = wrench_n_[i];
    } else if (joint.v >= 0) {
      tau[joint.v - tree.v] = frame.S.head<3>().dot(wrench_f_[i]) + frame.S.tail<3>().dot(wrench_n_[i]);
    }
    if (joint.up >= 0) {
      wrench_f_[joint.up] += wrench_f_[i];
      wrench_n_[joint.up] += wrench_n_[i] + frame.arm.cross(wrench_f_[i]);
    }
  }
}

}  // namespace cb
