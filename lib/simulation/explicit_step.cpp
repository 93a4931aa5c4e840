// Is the step of controllers and springs (explicit) and of damping stable?
//
// Accelerations are at most quadratic in the rates (Coriolis and centrifugal terms) and torques are at most that, so
// that central differences give A exactly but for round-off, whatever the step of the difference. K is good to the
// square of its own.
#include "simulation/explicit_step.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "dynamics/articulated_body.h"
#include "dynamics/kinematics.h"

namespace cb {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Accelerations of all joints at a state, out of contact.
class Accelerations {
 public:
  explicit Accelerations(const Scenario& scenario) : scenario_(scenario), state_(scenario.initial) {
    for (const ControllerSpec& spec : scenario.controllers)
      controllers_.push_back(spec.row->make(scenario.model, spec));
    for (const Body& body : scenario.model.bodies) weight_.push_back(body.mass * scenario.gravity.at(state_.t));
    tau_.resize(state_.qd.size());
    qdd_.resize(state_.qd.size());
  }
  int size() const { return static_cast<int>(state_.qd.size()); }

  /// -d qdd / d x by central differences; x: one of the state's q or qd.
  VectorXd slope(double& x, double delta) {
    const double before = x;
    x = before + delta;
    const VectorXd up = evaluate();
    x = before - delta;
    const VectorXd down = evaluate();
    x = before;
    return (down - up) / (2 * delta);
  }
  /// n x n: of the rates.
  MatrixXd damping() {
    MatrixXd A(size(), size());
    constexpr double delta = 0.5;  // rad/s or m/s
    for (int j = 0; j < size(); ++j) A.col(j) = slope(state_.qd[j], delta);
    return A;
  }
  /// n x n: M^-1, accelerations by the torques.
  MatrixXd response() {
    MatrixXd R(size(), size());
    const VectorXd without = evaluate();
    for (int j = 0; j < size(); ++j) R.col(j) = evaluate(j) - without;
    return R;
  }
  /// n x n: of the coordinates, by the rates that they belong to; free joints have none.
  MatrixXd stiffness() {
    MatrixXd K = MatrixXd::Zero(size(), size());
    constexpr double delta = 1e-5;  // rad or m
    for (const Tree& tree : scenario_.model.trees)
      for (const Joint& joint : tree.joints)
        if (joint.q >= 0) K.col(joint.v) = slope(state_.q[joint.q], delta);
    return K;
  }

 private:
  /// `pushed`: a rate with a torque of 1 besides.
  VectorXd evaluate(int pushed = -1) {
    const Model& model = scenario_.model;
    const Vec3 gravity = scenario_.gravity.at(state_.t);
    for (const Tree& tree : model.trees) forward_kinematics(model, tree, state_);
    std::fill(tau_.begin(), tau_.end(), 0.0);
    for (const Controller& controller : controllers_) controller(model, state_, gravity, tau_);
    if (pushed >= 0) tau_[pushed] += 1;
    for (const Tree& tree : model.trees) {
      for (const Joint& joint : tree.joints)
        if (joint.nv() == 1) tau_[joint.v] += joint.passive_torque(state_.q[joint.q], state_.qd[joint.v]);
      const auto at = static_cast<std::size_t>(tree.v), nv = static_cast<std::size_t>(tree.nv);
      articulated_body_.forward_dynamics(model, tree, state_, weight_, {&tau_[at], nv}, {&qdd_[at], nv});
    }
    return VectorXd::Map(qdd_.data(), size());
  }

  const Scenario& scenario_;
  State state_;
  std::vector<Controller> controllers_;
  std::vector<Vec3> weight_;
  ArticulatedBody articulated_body_;
  std::vector<double> tau_, qdd_;
};

/// What a step takes at its end, as matrices over all rates: damping D and stiffness K.
struct AtEnd {
  MatrixXd D, K;
  AtEnd(const Scenario& scenario, const MatrixXd& response, JointForces forces)
      : D(MatrixXd::Zero(response.rows(), response.rows())), K(D) {
    if (forces == JointForces::explicit_euler) {
      D.diagonal() = vector(implicit_damping(scenario));
      return;
    }
    const MatrixXd M = response.inverse();
    for (const JointGains& gains : {passive_gains(scenario), motor_gains(scenario)}) {
      const auto add = [&](MatrixXd& to, const std::vector<double>& of, const std::vector<double>& by_mass) {
        const VectorXd S = vector(by_mass).cwiseSqrt();
        to += S.asDiagonal() * M * S.asDiagonal();
        to.diagonal() += vector(of);
      };
      add(D, gains.damping, gains.damping_by_mass);
      add(K, gains.stiffness, gains.stiffness_by_mass);
    }
  }
  /// (1 + h M^-1 D + h^2 M^-1 K)^-1: what accelerations are multiplied by.
  MatrixXd brake(const MatrixXd& response, double h) const {
    const auto n = response.rows();
    return (MatrixXd::Identity(n, n) + response * (h * D + h * h * K)).partialPivLu().inverse();
  }

 private:
  static VectorXd vector(const std::vector<double>& x) {
    return VectorXd::Map(x.data(), static_cast<Eigen::Index>(x.size()));
  }
};

double largest_magnitude(const MatrixXd& A) {
  return Eigen::EigenSolver<MatrixXd>(A, false).eigenvalues().cwiseAbs().maxCoeff();
}

}  // namespace

std::vector<double> implicit_damping(const Scenario& scenario) {
  std::vector<double> damping(scenario.initial.qd.size(), 0.0);
  for (const Tree& tree : scenario.model.trees)
    for (const Joint& joint : tree.joints)
      if (joint.nv() == 1) damping[joint.v] = joint.damping;
  for (const ControllerSpec& spec : scenario.controllers)
    for (const ControllerSpec::ControlledJoint& driven : spec.joints)
      damping[scenario.model.trees[spec.tree].joints[driven.joint].v] = 0;
  return damping;
}

JointGains passive_gains(const Scenario& scenario) {
  JointGains gains(scenario.initial.qd.size());
  for (const Tree& tree : scenario.model.trees)
    for (const Joint& joint : tree.joints)
      if (joint.nv() == 1) {
        gains.stiffness[joint.v] = joint.stiffness;
        gains.damping[joint.v] = joint.damping;
      }
  return gains;
}

JointGains motor_gains(const Scenario& scenario) {
  JointGains gains(scenario.initial.qd.size());
  for (const ControllerSpec& spec : scenario.controllers) spec.row->gains_of_joints(scenario.model, spec, gains);
  return gains;
}

std::optional<double> largest_eigenvalue(const Scenario& scenario, double h, JointForces forces) {
  if (scenario.controllers.empty()) return std::nullopt;
  Accelerations accelerations(scenario);
  const MatrixXd A = accelerations.damping();
  const MatrixXd response = accelerations.response();
  return h * largest_magnitude(AtEnd(scenario, response, forces).brake(response, h) * A);
}

std::optional<double> largest_stable_step(const Scenario& scenario, JointForces forces) {
  bool any = !scenario.controllers.empty();
  for (const Tree& tree : scenario.model.trees)
    for (const Joint& joint : tree.joints) any = any || joint.stiffness != 0 || joint.damping != 0;
  if (!any) return std::nullopt;
  Accelerations accelerations(scenario);
  const MatrixXd A = accelerations.damping(), K = accelerations.stiffness(), response = accelerations.response();
  const AtEnd at_end(scenario, response, forces);
  const auto n = A.rows();
  const MatrixXd one = MatrixXd::Identity(n, n);
  MatrixXd flow(2 * n, 2 * n);
  flow << -A, -K, one, MatrixXd::Zero(n, n);
  const double growth = std::max(0.0, Eigen::EigenSolver<MatrixXd>(flow, false).eigenvalues().real().maxCoeff());
  const auto stable = [&](double h) {
    const MatrixXd brake = at_end.brake(response, h), A_h = brake * (A + h * response * at_end.K), K_h = brake * K;
    MatrixXd step(2 * n, 2 * n);
    step << one - h * A_h, -h * K_h, h * (one - h * A_h), one - h * h * K_h;
    // Rates without torque are double eigenvalues of 1, which rounding takes apart by its square root.
    constexpr double rounding = 1e-6;
    return largest_magnitude(step) <= std::exp(h * growth) + rounding;
  };
  constexpr double least = 1e-9, most = 1e3, accuracy = 1e-4;  // s, s, -
  // A motion that grows by itself may grow by anything in so long a step.
  if (growth * most < 1 && stable(most)) return most;
  // Upwards by quarters to the first step that is not stable: stable ones may come again beyond it.
  double low = least, high = least;
  while (stable(high) && high < most) {
    low = high;
    high *= 1.25;
  }
  while (high > low * (1 + accuracy)) {
    const double middle = std::sqrt(low * high);
    (stable(middle) ? low : high) = middle;
  }
  return low;
}

}  // namespace cb
