#include <catch2/catch.hpp>
#include <cmath>

#include "control/controller.h"
#include "dynamics/articulated_body.h"
#include "dynamics/newton_euler.h"
#include "dynamics/random_tree.h"

using namespace cb;

namespace {

const Vec3 gravity(0.5, -9.8, 1);
constexpr int tracking = 0, closing = 1;  // roles

/// An arm of joints that turn and slide, all damped; some follow sinusoids, the last closes.
struct Arm {
  RandomTree robot;
  ControllerSpec spec;
  std::vector<double> wanted, error, error_rate;  // rad/s^2, rad, rad/s (m) of each joint, at the state's time

  Arm(unsigned seed, bool computed) : robot(seed, 5, false) {
    robot.state.t = 0.7;
    spec.row = find_controller("computed_torque");
    spec.gains = {30, 7};
    spec.words = {computed ? 0 : 1};
    Tree& tree = robot.model.trees[0];
    for (std::size_t j = 0; j < tree.joints.size(); ++j) {
      Joint& joint = tree.joints[j];
      if (joint.nv() != 1) continue;
      joint.damping = robot.number(0.1, 1);
      const double q = robot.state.q[joint.q], qd = robot.state.qd[joint.v];
      if (joint.v + 1 == tree.nv) {
        spec.joints.push_back({closing, static_cast<int>(j), {-1.5}});
        wanted.push_back(-1.5);
        error.push_back(0);
        error_rate.push_back(0);
        continue;
      }
      const double offset = 0.3, amplitude = 0.8, frequency = 3, phase = 0.4, angle = frequency * 0.7 + phase;
      spec.joints.push_back({tracking, static_cast<int>(j), {offset, amplitude, frequency, phase, 40, 9}});
      wanted.push_back(-amplitude * frequency * frequency * std::sin(angle));
      error.push_back(offset + amplitude * std::sin(angle) - q);
      error_rate.push_back(amplitude * frequency * std::cos(angle) - qd);
    }
  }
  /// The accelerations that follow from the controller's torques, less `taken` of each.
  std::vector<double> accelerations(const std::vector<double>& taken) {
    link_twists(robot.model, robot.tree(), robot.state);
    const auto nv = static_cast<std::size_t>(robot.tree().nv);
    std::vector<double> tau(nv, 0.0), qdd(nv);
    const Controller controller = spec.row->make(robot.model, spec);
    controller(robot.model, robot.state, gravity, tau);
    for (const Joint& joint : robot.tree().joints)
      if (joint.nv() == 1)
        tau[joint.v] += joint.passive_torque(robot.state.q[joint.q], robot.state.qd[joint.v]) - taken[joint.v];
    std::vector<Vec3> weight;
    for (const Body& body : robot.model.bodies) weight.push_back(body.mass * gravity);
    ArticulatedBody().forward_dynamics(robot.model, robot.tree(), robot.state, weight, tau, qdd);
    return qdd;
  }
};

}  // namespace

TEST_CASE(
    "computed torque gives the accelerations asked for, corrected by the errors, whatever gravity and damping do") {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    Arm arm(seed, true);
    const std::vector<double> qdd = arm.accelerations(std::vector<double>(arm.wanted.size(), 0.0));
    REQUIRE(qdd.size() == arm.wanted.size());
    for (std::size_t i = 0; i < qdd.size(); ++i) {
      const double asked = arm.wanted[i] + 30 * arm.error[i] + 7 * arm.error_rate[i];
      CHECK(qdd[i] == Approx(asked).epsilon(1e-9).margin(1e-9));
    }
  }
}

TEST_CASE("the gains are what the torques lose as coordinates and rates grow, the damping fed forward among it") {
  for (const bool computed : {true, false}) {
    Arm arm(3, computed);
    const auto nv = static_cast<std::size_t>(arm.robot.tree().nv);
    JointGains gains(nv);
    arm.spec.row->gains_of_joints(arm.robot.model, arm.spec, gains);
    for (const ControllerSpec::ControlledJoint& part : arm.spec.joints) {
      const Joint& joint = arm.robot.tree().joints[part.joint];
      const bool tracks = part.role == tracking;
      INFO("computed " << computed << ", tracks " << tracks);
      CHECK(gains.stiffness[joint.v] == (tracks && !computed ? 40 : 0));
      CHECK(gains.damping[joint.v] ==
            Approx((tracks && !computed ? 9 : 0) - (computed || !tracks ? joint.damping : 0)).margin(1e-14));
      CHECK(gains.stiffness_by_mass[joint.v] == (tracks && computed ? 30 : 0));
      CHECK(gains.damping_by_mass[joint.v] == (tracks && computed ? 7 : 0));
    }
  }
}

TEST_CASE("with gains that are torques the errors ask for torques, beside what the wanted accelerations need") {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    Arm arm(seed, false);
    std::vector<double> correction;
    for (const ControllerSpec::ControlledJoint& part : arm.spec.joints) {
      const Joint& joint = arm.robot.tree().joints[part.joint];
      const std::size_t i = correction.size();
      correction.push_back(part.role == closing ? 0 : 40 * arm.error[i] + (9 + joint.damping) * arm.error_rate[i]);
    }
    const std::vector<double> qdd = arm.accelerations(correction);
    for (std::size_t i = 0; i < qdd.size(); ++i) CHECK(qdd[i] == Approx(arm.wanted[i]).epsilon(1e-9).margin(1e-9));
  }
}

TEST_CASE("a controller of the second robot adds its torques to those of its own joints, and none to a free joint") {
  for (const bool computed : {true, false}) {
    // A robot of two rates, then one on a free joint; something has asked for torques before.
    Arm arm(5, computed);
    RandomTree floating(6, 6, true);
    Model model = floating.model;
    State state = floating.state;
    Tree tree = floating.tree();
    const int shift = 2;
    state.q.insert(state.q.begin(), shift, 9.0);
    state.qd.insert(state.qd.begin(), shift, 9.0);
    state.t = 0.7;
    tree.v = shift;
    ControllerSpec spec = arm.spec;
    spec.tree = 1;
    spec.joints.clear();
    std::vector<double> wanted(static_cast<std::size_t>(tree.nv), 0.0), extra = wanted;
    for (std::size_t j = 0; j < tree.joints.size(); ++j) {
      Joint& joint = tree.joints[j];
      if (joint.v >= 0) joint.v += shift;
      if (joint.q < 0) continue;
      joint.q += shift;
      joint.damping = 0.1 + 0.2 * static_cast<double>(j);
      if (j == 2) continue;  // one that is not named is held with acceleration 0
      // q* = 0.2 - 0.5 sin(2 t + 1) at t = 0.7
      spec.joints.push_back({tracking, static_cast<int>(j), {0.2, -0.5, 2, 1, 40, 9}});
      const auto at = static_cast<std::size_t>(joint.v - shift);
      const double error = 0.2 - 0.5 * std::sin(2.4) - state.q[static_cast<std::size_t>(joint.q)];
      const double error_rate = -std::cos(2.4) - state.qd[static_cast<std::size_t>(joint.v)];
      wanted[at] = 2 * std::sin(2.4) + (computed ? 30 * error + 7 * error_rate : 0);
      extra[at] = computed ? 0 : 40 * error + (9 + joint.damping) * error_rate;
    }
    model.trees = {Tree(), tree, Tree()};
    model.trees[0].nv = shift;
    std::vector<Vec3> weight;
    for (const Body& body : model.bodies) weight.push_back(body.mass * gravity);
    std::vector<double> inverse(wanted.size()), tau(state.qd.size(), 0.25);
    NewtonEuler().inverse_dynamics(model, tree, state, weight, wanted, inverse);
    spec.row->make(model, spec)(model, state, gravity, tau);
    for (int i = 0; i < shift; ++i) CHECK(tau[static_cast<std::size_t>(i)] == 0.25);
    for (const Joint& joint : tree.joints) {
      if (joint.nv() == 6)
        for (int i = 0; i < 6; ++i) CHECK(tau[static_cast<std::size_t>(joint.v + i)] == 0.25);
      if (joint.nv() != 1) continue;
      const auto at = static_cast<std::size_t>(joint.v - shift), v = static_cast<std::size_t>(joint.v);
      CHECK(tau[v] == Approx(0.25 + inverse[at] + extra[at] + joint.damping * state.qd[v]).epsilon(1e-11));
    }

    JointGains gains(state.qd.size());
    for (auto* part : {&gains.stiffness, &gains.damping, &gains.stiffness_by_mass, &gains.damping_by_mass})
      std::fill(part->begin(), part->end(), 0.5);  // of what came before
    spec.row->gains_of_joints(model, spec, gains);
    for (std::size_t j = 0; j < tree.joints.size(); ++j) {
      const Joint& joint = tree.joints[j];
      if (joint.nv() != 1) continue;
      const auto v = static_cast<std::size_t>(joint.v);
      const bool tracks = j != 2;
      CHECK(gains.stiffness[v] == 0.5 + (tracks && !computed ? 40 : 0));
      CHECK(gains.damping[v] ==
            Approx(0.5 + (tracks && !computed ? 9 : 0) - (computed || !tracks ? joint.damping : 0)));
      CHECK(gains.stiffness_by_mass[v] == 0.5 + (tracks && computed ? 30 : 0));
      CHECK(gains.damping_by_mass[v] == 0.5 + (tracks && computed ? 7 : 0));
    }
    for (int i = 0; i < shift + 6; ++i) CHECK(gains.damping[static_cast<std::size_t>(i)] == 0.5);
  }
}
