// Computed torque along sinusoids, and a gripper that closes with a wanted acceleration (scenarios/grasp.xml).
//
// Problem: torques that let each tracked joint follow q* = offset + amplitude sin(frequency t + phase) and each closing
// joint accelerate as wanted, from q, qd and gravity. Source: Luh, Walker, Paul, "Resolved-acceleration control of
// mechanical manipulators" (1980), joint space form; the inverse dynamics are lib/dynamics/newton_euler. Joint damping
// is fed forward in both variants.
//   gains = computed   tau = RNEA(q, qd, qdd* + kp (q* - q) + kd (qd* - qd)); kp in 1/s^2, kd in 1/s for all joints
//   gains = torque     tau = RNEA(q, qd, qdd*) + KP (q* - q) + KV (qd* - qd); each joint has its own (N m/rad, N m
//   s/rad)
// Joints that are not named are held where the inverse dynamics hold them: with acceleration 0. What a gripper holds is
// not part of the model. Bodies under a free joint get no torque.
#include <cmath>

#include "control/controller.h"
#include "dynamics/newton_euler.h"

namespace cb {

namespace {

constexpr int kp = 0, kd = 1;                                                       // gains
constexpr int gains_are = 0, computed = 0;                                          // words
constexpr int close = 1;                                                            // role, beside <track>
constexpr int offset = 0, amplitude = 1, frequency = 2, phase = 3, KP = 4, KV = 5;  // of <track>
constexpr int acceleration = 0;                                                     // of <close>

class ComputedTorque {
 public:
  explicit ComputedTorque(const ControllerSpec& spec) : spec_(spec) {}

  void operator()(const Model& model, const State& state, const Vec3& gravity, std::span<double> tau) {
    const Tree& tree = model.trees[spec_.tree];
    force_.assign(model.bodies.size(), Vec3::Zero());
    for (const Joint& joint : tree.joints) force_[joint.body] = model.bodies[joint.body].mass * gravity;
    wanted_.assign(tree.nv, 0.0);
    extra_.assign(tree.nv, 0.0);
    inverse_.resize(tree.nv);
    for (const ControllerSpec::ControlledJoint& part : spec_.joints) {
      const Joint& joint = tree.joints[part.joint];
      const int at = joint.v - tree.v;
      if (part.role == close) {
        wanted_[at] = part.gains[acceleration];
        continue;
      }
      const double angle = part.gains[frequency] * state.t + part.gains[phase];
      const double rate = part.gains[amplitude] * part.gains[frequency];
      const double error = part.gains[offset] + part.gains[amplitude] * std::sin(angle) - state.q[joint.q];
      const double error_rate = rate * std::cos(angle) - state.qd[joint.v];
      wanted_[at] = -rate * part.gains[frequency] * std::sin(angle);
      if (spec_.words[gains_are] == computed)
        wanted_[at] += spec_.gains[kp] * error + spec_.gains[kd] * error_rate;
      else
        extra_[at] = part.gains[KP] * error + part.gains[KV] * error_rate + joint.damping * error_rate;
    }
    newton_euler_.inverse_dynamics(model, tree, state, force_, wanted_, inverse_);
    for (const Joint& joint : tree.joints)
      if (joint.nv() == 1)
        tau[joint.v] += inverse_[joint.v - tree.v] + extra_[joint.v - tree.v] + joint.damping * state.qd[joint.v];
  }

 private:
  ControllerSpec spec_;
  NewtonEuler newton_euler_;
  std::vector<Vec3> force_;
  std::vector<double> wanted_, extra_, inverse_;
};

// gains = computed: kp M, kd M over the tracked joints. Joint damping is fed forward in all of the tree.
void gains_of_joints(const Model& model, const ControllerSpec& spec, JointGains& gains) {
  const Tree& tree = model.trees[spec.tree];
  for (const Joint& joint : tree.joints)
    if (joint.nv() == 1) gains.damping[joint.v] -= joint.damping;
  for (const ControllerSpec::ControlledJoint& part : spec.joints) {
    if (part.role == close) continue;
    const Joint& joint = tree.joints[part.joint];
    if (spec.words[gains_are] == computed) {
      gains.stiffness_by_mass[joint.v] += spec.gains[kp];
      gains.damping_by_mass[joint.v] += spec.gains[kd];
    } else {
      gains.stiffness[joint.v] += part.gains[KP];
      gains.damping[joint.v] += part.gains[KV] + joint.damping;
    }
  }
}

}  // namespace

ControllerRow computed_torque_row() {
  return {"computed_torque",
          "joints along sinusoids by inverse dynamics; a gripper that closes with a wanted acceleration",
          "Luh, Walker, Paul 1980",
          {{"kp", "1/s^2", "gain of the position errors, gains=computed", 100, 0},
           {"kd", "1/s", "gain of the velocity errors, gains=computed", 20, 0}},
          {{"gains", {"computed", "torque"}}},
          {{"track",
            "a joint that follows offset + amplitude sin(frequency t + phase)",
            0,
            std::numeric_limits<int>::max(),
            {{"offset", "rad or m", "middle of the motion", 0},
             {"amplitude", "rad or m", "half of its stroke", 0},
             {"frequency", "rad/s", "", 0},
             {"phase", "rad", "", 0},
             {"kp", "N m/rad or N/m", "gain of the position error, gains=torque", 0, 0},
             {"kv", "N m s/rad or N s/m", "gain of the velocity error, gains=torque", 0, 0}}},
           {"close",
            "a joint that accelerates as wanted",
            0,
            std::numeric_limits<int>::max(),
            {{"acceleration", "rad/s^2 or m/s^2", "wanted acceleration", std::nullopt}}}},
          [](const Model&, const ControllerSpec& spec) -> Controller { return ComputedTorque(spec); },
          gains_of_joints};
}

}  // namespace cb
