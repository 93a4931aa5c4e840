// Articulated-body algorithm: qdd = M(q)^-1 (tau - bias(q, qd) + forces), in time linear in the number of links.
//
// Source: Featherstone (2008), section 7.3, table 7.1. Difference: world axes and centres of mass, classical
// accelerations (their quadratic part is NewtonEuler's). A free joint's 6 x 6 inertia is factored as it is. Where a
// joint carries no inertia along its motion the result is not finite; the loader refuses bodies without inertia.
#include "dynamics/articulated_body.h"

#include "dynamics/newton_euler.h"

namespace cb {

namespace {

// X^T I X for X = [1, -[r]; 0, 1], which carries a parent's twist to the child's centre of mass, r away.
void add_to_parent(const Mat6& I, const Vec3& r, Mat6& parent) {
  Mat3 cross;
  cross << 0, -r.z(), r.y(), r.z(), 0, -r.x(), -r.y(), r.x(), 0;
  const Mat3 A = I.topLeftCorner<3, 3>(), B = I.topRightCorner<3, 3>();
  const Mat3 rA = cross * A;                   // X^T: rows below gain [r] times those above
  const Mat3 lower_left = B.transpose() + rA;  // [r] A + B^T
  const Mat3 lower_right = I.bottomRightCorner<3, 3>() + cross * B - lower_left * cross;
  parent.topLeftCorner<3, 3>() += A;
  parent.bottomLeftCorner<3, 3>() += lower_left;
  parent.topRightCorner<3, 3>() += lower_left.transpose();
  parent.bottomRightCorner<3, 3>() += lower_right;
}

// X^T p.
void add_to_parent(const Vec6& p, const Vec3& r, Vec6& parent) {
  parent.head<3>() += p.head<3>();
  parent.tail<3>() += p.tail<3>() + r.cross(p.head<3>());
}

}  // namespace

void ArticulatedBody::factor(const Model& model, const Tree& tree, const State& state, std::span<const double> added) {
  const std::size_t n = tree.joints.size();
  link_frames(model, tree, state, frames_);
  links_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    Link& link = links_[i];
    link.I.setZero();
    link.I.diagonal().head<3>().setConstant(model.bodies[tree.joints[i].body].mass);
    link.I.bottomRightCorner<3, 3>() = frames_[i].inertia;
  }
  for (std::size_t i = n; i-- > 0;) {
    const Joint& joint = tree.joints[i];
    Link& link = links_[i];
    if (joint.kind == JointKind::free) {  // on the world
      link.factor.compute(link.I);
      continue;
    }
    Mat6 I = link.I;
    if (joint.v >= 0) {
      const Vec6& S = frames_[i].S;
      link.U.noalias() = link.I * S;
      link.D = S.dot(link.U) + (added.empty() ? 0 : added[joint.v - tree.v]);
      I.noalias() -= link.U * (link.U.transpose() / link.D);
    }
    if (joint.up >= 0) add_to_parent(I, frames_[i].arm, links_[joint.up].I);
  }
}

void ArticulatedBody::accelerations(const Tree& tree, const State& state, std::span<const Vec3> force,
                                    std::span<const double> tau, std::span<double> qdd, bool turning) {
  const std::size_t n = tree.joints.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Joint& joint = tree.joints[i];
    Link& link = links_[i];
    const Vec3 w(&state.v[6 * static_cast<std::size_t>(joint.body) + 3]);
    link.p.head<3>().setZero();
    if (!force.empty()) link.p.head<3>() = -force[joint.body];
    if (turning) {
      link.p.tail<3>() = w.cross(frames_[i].inertia * w);
      link.bias = bias_acceleration(joint, frames_[i], state);
    } else {
      link.p.tail<3>().setZero();
      link.bias.setZero();
    }
  }

  // Inward: wrenches.
  for (std::size_t i = n; i-- > 0;) {
    const Joint& joint = tree.joints[i];
    Link& link = links_[i];
    if (joint.kind == JointKind::free) continue;
    Vec6 p = link.p + link.I * link.bias;
    if (joint.v >= 0) {
      link.u = tau[joint.v - tree.v] - frames_[i].S.dot(link.p);
      p += link.U * ((link.u - link.U.dot(link.bias)) / link.D);
    }
    if (joint.up >= 0) add_to_parent(p, frames_[i].arm, links_[joint.up].p);
  }

  // Outward: accelerations.
  for (std::size_t i = 0; i < n; ++i) {
    const Joint& joint = tree.joints[i];
    Link& link = links_[i];
    if (joint.kind == JointKind::free) {
      link.a = link.factor.solve(Eigen::Map<const Vec6>(&tau[joint.v - tree.v]) - link.p);
      Eigen::Map<Vec6>(qdd.data() + joint.v - tree.v) = link.a;
      continue;
    }
    link.a = link.bias;
    if (joint.up >= 0) {
      const Vec6& a = links_[joint.up].a;
      link.a.head<3>() += a.head<3>() + a.tail<3>().cross(frames_[i].arm);
      link.a.tail<3>() += a.tail<3>();
    }
    if (joint.v >= 0) {
      const double rate = (link.u - link.U.dot(link.a)) / link.D;
      qdd[joint.v - tree.v] = rate;
      link.a += rate * frames_[i].S;
    }
  }
}

void ArticulatedBody::forward_dynamics(const Model& model, const Tree& tree, const State& state,
                                       std::span<const Vec3> force, std::span<const double> tau,
                                       std::span<double> qdd) {
  factor(model, tree, state);
  accelerations(tree, state, force, tau, qdd);
}

}  // namespace cb
