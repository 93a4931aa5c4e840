// Is the controllers' explicit step stable?
//
// Accelerations are at most quadratic in the rates (Coriolis and centrifugal terms) and torques are at most that, so
// that central differences give A exactly but for round-off, whatever the step of the difference.
#include "simulation/explicit_step.h"

#include <Eigen/Eigenvalues>

#include "dynamics/articulated_body.h"

namespace cb {

std::optional<double> largest_eigenvalue(const Scenario& scenario, double h) {
  if (scenario.controllers.empty()) return std::nullopt;
  const Model& model = scenario.model;
  State state = scenario.initial;
  std::vector<Controller> controllers;
  for (const ControllerSpec& spec : scenario.controllers) controllers.push_back(spec.row->make(model, spec));
  const Vec3 gravity = scenario.gravity.at(state.t);
  std::vector<Vec3> weight;
  for (const Body& body : model.bodies) weight.push_back(body.mass * gravity);

  const int n = static_cast<int>(state.qd.size());
  ArticulatedBody articulated_body;
  std::vector<double> tau(state.qd.size()), qdd(state.qd.size());
  const auto accelerations = [&]() -> Eigen::VectorXd {
    for (const Tree& tree : model.trees) link_twists(model, tree, state);
    std::fill(tau.begin(), tau.end(), 0.0);
    for (const Controller& controller : controllers) controller(model, state, gravity, tau);
    for (const Tree& tree : model.trees) {
      for (const Joint& joint : tree.joints)
        if (joint.nv() == 1) tau[joint.v] -= joint.damping * state.qd[joint.v];
      const auto at = static_cast<std::size_t>(tree.v), nv = static_cast<std::size_t>(tree.nv);
      articulated_body.forward_dynamics(model, tree, state, weight, {&tau[at], nv}, {&qdd[at], nv});
    }
    return Eigen::VectorXd::Map(qdd.data(), n);
  };
  Eigen::MatrixXd A(n, n);
  constexpr double delta = 0.5;  // rad/s or m/s
  for (int j = 0; j < n; ++j) {
    const double rate = state.qd[j];
    state.qd[j] = rate + delta;
    const Eigen::VectorXd up = accelerations();
    state.qd[j] = rate - delta;
    A.col(j) = -(up - accelerations()) / (2 * delta);
    state.qd[j] = rate;
  }
  const Eigen::EigenSolver<Eigen::MatrixXd> solver(h * A, false);
  return solver.info() == Eigen::Success ? std::optional(solver.eigenvalues().cwiseAbs().maxCoeff()) : std::nullopt;
}

}  // namespace cb
