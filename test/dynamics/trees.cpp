#include <Eigen/Cholesky>
#include <catch2/catch.hpp>

#include "dynamics/articulated_body.h"
#include "dynamics/composite_body.h"
#include "dynamics/free_bodies.h"
#include "dynamics/newton_euler.h"
#include "random_tree.h"

using namespace cb;

namespace {

using Eigen::Map;
using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd inverse(const RandomTree& t, const std::vector<Vec3>& force, const VectorXd& qdd) {
  NewtonEuler newton_euler;
  VectorXd tau(t.tree().nv);
  newton_euler.inverse_dynamics(t.model, t.tree(), t.state, force, {qdd.data(), static_cast<std::size_t>(qdd.size())},
                                {tau.data(), static_cast<std::size_t>(tau.size())});
  return tau;
}
VectorXd forward(const RandomTree& t, const std::vector<Vec3>& force, const VectorXd& tau) {
  ArticulatedBody articulated_body;
  VectorXd qdd(t.tree().nv);
  articulated_body.forward_dynamics(t.model, t.tree(), t.state, force,
                                    {tau.data(), static_cast<std::size_t>(tau.size())},
                                    {qdd.data(), static_cast<std::size_t>(qdd.size())});
  return qdd;
}
MatrixXd mass(const RandomTree& t) {
  CompositeBody composite_body;
  MatrixXd M(t.tree().nv, t.tree().nv);
  composite_body.mass_matrix(t.model, t.tree(), t.state, M);
  return M;
}
std::vector<Vec3> random_forces(RandomTree& t) {
  std::vector<Vec3> force;
  for (std::size_t b = 0; b < t.model.bodies.size(); ++b) force.push_back(t.vector(5));
  return force;
}
double relative(const VectorXd& a, const VectorXd& b) { return (a - b).norm() / b.norm(); }

}  // namespace

TEST_CASE("articulated bodies accelerate as M^-1 (tau - bias), and Newton-Euler inverts them, on random trees") {
  for (unsigned seed = 0; seed < 60; ++seed) {
    RandomTree t(seed, 1 + static_cast<int>(seed % 12), seed % 2 == 1);
    INFO("seed " << seed);
    const int nv = t.tree().nv;
    const std::vector<Vec3> force = random_forces(t);
    const VectorXd tau = VectorXd::Map(t.numbers(static_cast<std::size_t>(nv), 4).data(), nv);
    const VectorXd qdd = forward(t, force, tau);
    const VectorXd bias = inverse(t, force, VectorXd::Zero(nv));
    CHECK(relative(qdd, mass(t).llt().solve(tau - bias)) < 1e-12);
    CHECK(relative(inverse(t, force, qdd), tau) < 1e-12);
  }
}

TEST_CASE(
    "one factorisation serves accelerations with what turning asks for and without; what is added counts in both") {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const bool floating = seed % 2 == 1;
    RandomTree t(seed, 1 + static_cast<int>(seed % 12), floating);
    INFO("seed " << seed);
    const auto nv = static_cast<std::size_t>(t.tree().nv);
    const std::vector<Vec3> force = random_forces(t);
    const std::vector<double> tau = t.numbers(nv, 4);
    std::vector<double> added = t.numbers(nv, 3), qdd(nv);
    for (double& a : added) a = std::abs(a);
    if (floating) std::fill_n(added.begin(), 6, 0.0);  // nothing damps a free joint
    const VectorXd zero = VectorXd::Zero(t.tree().nv), given = VectorXd::Map(tau.data(), t.tree().nv);
    MatrixXd M = mass(t);
    M.diagonal() += VectorXd::Map(added.data(), t.tree().nv);
    const VectorXd turning = M.llt().solve(given - inverse(t, force, zero));
    ArticulatedBody articulated_body;
    articulated_body.factor(t.model, t.tree(), t.state, added);
    articulated_body.accelerations(t.tree(), t.state, force, tau, qdd, true);
    CHECK(relative(VectorXd::Map(qdd.data(), t.tree().nv), turning) < 1e-12);
    articulated_body.accelerations(t.tree(), t.state, force, tau, qdd, false);
    std::fill(t.state.qd.begin(), t.state.qd.end(), 0.0);
    std::fill(t.state.v.begin(), t.state.v.end(), 0.0);
    CHECK(relative(VectorXd::Map(qdd.data(), t.tree().nv), M.llt().solve(given - inverse(t, force, zero))) < 1e-12);
  }
}

TEST_CASE("the composite mass matrix is symmetric and its columns are what Newton-Euler needs for one acceleration") {
  for (unsigned seed = 0; seed < 60; ++seed) {
    const RandomTree t(seed, 1 + static_cast<int>(seed % 12), seed % 2 == 1);
    INFO("seed " << seed);
    const int nv = t.tree().nv;
    const MatrixXd M = mass(t);
    CHECK((M - M.transpose()).norm() == 0);
    const VectorXd bias = inverse(t, {}, VectorXd::Zero(nv));
    for (int j = 0; j < nv; ++j)
      CHECK((inverse(t, {}, VectorXd::Unit(nv, j)) - bias - M.col(j)).norm() < 1e-12 * M.norm());
    // Twice the kinetic energy, from the twists of the bodies.
    const VectorXd qd = VectorXd::Map(t.state.qd.data(), nv);
    CHECK(qd.dot(M * qd) == Approx(2 * kinetic_energy(t.model, t.state)).epsilon(1e-12));
  }
}

TEST_CASE("a link's twist is how its pose changes, and the Jacobian is how its points move") {
  for (unsigned seed = 0; seed < 20; ++seed) {
    RandomTree t(seed, 8, seed % 2 == 1);
    INFO("seed " << seed);
    const double dt = 1e-6;
    State before = t.state, after = t.state;
    advance_tree(t.model, t.tree(), -dt, before);
    advance_tree(t.model, t.tree(), dt, after);
    for (std::size_t i = 0; i < t.tree().joints.size(); ++i) {
      const Vec3 x_B = t.vector(0.5);
      const Vec3 measured = (after.pose[i] * x_B - before.pose[i] * x_B) / (2 * dt);
      Eigen::Matrix3Xd J(3, t.tree().nv);
      point_jacobian(t.model, t.tree(), t.state, static_cast<int>(i), t.state.pose[i] * x_B, J);
      const Vec3 v(&t.state.v[6 * i]), w(&t.state.v[6 * i + 3]);
      const Vec3 exact = v + w.cross(t.state.pose[i].q * x_B);
      CHECK((J * VectorXd::Map(t.state.qd.data(), t.tree().nv) - exact).norm() < 1e-12 * (1 + exact.norm()));
      CHECK((measured - exact).norm() < 1e-7 * (1 + exact.norm()));
    }
  }
}

TEST_CASE("a body on a free joint falls and tumbles as a free body does") {
  RandomTree t(3, 1, true);
  const std::vector<Vec3> force{Vec3(1, -2, 3)};
  const VectorXd qdd = forward(t, force, VectorXd::Zero(6));
  State free = t.state;
  Model body = t.model;
  body.bodies[0].tree = -1;
  accelerate(body, force, 1, free, Gyroscopic::explicit_euler);
  for (int i = 0; i < 6; ++i)
    CHECK(qdd[i] ==
          Approx(free.v[static_cast<std::size_t>(i)] - t.state.v[static_cast<std::size_t>(i)]).epsilon(1e-12));
}

TEST_CASE("energy and momentum of a robot that nothing touches hold to the order of the integrator") {
  // Semi-implicit Euler as the step does it, 0.5 s, no forces but gravity (energy) or none at all (momentum): the error
  // halves with the step.
  double energy_error[3], momentum_error[3];
  for (int k = 0; k < 3; ++k) {
    const double h = 1e-3 / (1 << k);
    RandomTree pendulum(5, 4, false), floating(8, 5, true);
    ArticulatedBody articulated_body;
    const Vec3 g(0, -9.8, 0);
    const auto step = [&](RandomTree& t, const Vec3& gravity) {
      std::vector<Vec3> force;
      for (const Body& body : t.model.bodies) force.push_back(body.mass * gravity);
      const VectorXd qdd = forward(t, force, VectorXd::Zero(t.tree().nv));
      for (int i = 0; i < t.tree().nv; ++i) t.state.qd[static_cast<std::size_t>(i)] += h * qdd[i];
      advance_tree(t.model, t.tree(), h, t.state);
    };
    const auto energy = [&] {
      return kinetic_energy(pendulum.model, pendulum.state) + potential_energy(pendulum.model, pendulum.state, g);
    };
    const auto momentum = [&] {
      Vec6 sum = Vec6::Zero();
      for (std::size_t b = 0; b < floating.model.bodies.size(); ++b) {
        const Body& body = floating.model.bodies[b];
        const Pose& pose = floating.state.pose[b];
        const Vec3 v(&floating.state.v[6 * b]), w(&floating.state.v[6 * b + 3]);
        sum.head<3>() += body.mass * v;
        sum.tail<3>() += pose.p.cross(body.mass * v) + pose.q * body.inertia.cwiseProduct(pose.q.conjugate() * w);
      }
      return sum;
    };
    const double energy_before = energy();
    const Vec6 momentum_before = momentum();
    for (int i = 0; i < 500 << k; ++i) {
      step(pendulum, g);
      step(floating, Vec3::Zero());
    }
    energy_error[k] = std::abs(energy() - energy_before);
    momentum_error[k] = (momentum() - momentum_before).norm();
  }
  for (int k = 0; k < 2; ++k) {
    CHECK(std::log2(energy_error[k] / energy_error[k + 1]) > 0.8);
    CHECK(std::log2(momentum_error[k] / momentum_error[k + 1]) > 0.8);
  }
  CHECK(energy_error[2] < 0.05);
}

TEST_CASE("a pendulum swings with the period of its length") {
  // A bar on a hinge at its end: I = m L^2 / 3 about it, T = 2 pi sqrt(2 L / (3 g)) for small swings.
  const double length = 0.6, g = 9.8, h = 1e-4, swing = 1e-3;
  Model model;
  model.bodies.push_back({"bar", 2, {2 * length * length / 12, 1e-4, 2 * length * length / 12}, 0});
  Joint hinge;
  hinge.kind = JointKind::revolute;
  hinge.body = 0;
  hinge.q = hinge.v = 0;
  hinge.axis_C = Vec3::UnitZ();
  hinge.anchor_C = Vec3(0, length / 2, 0);
  model.trees.push_back({"pendulum", {hinge}, 0, 1});
  State state{0, {Pose{}}, std::vector<double>(6, 0), {swing}, {0}};
  forward_kinematics(model, model.trees[0], state);
  ArticulatedBody articulated_body;
  const std::vector<Vec3> weight{Vec3(0, -2 * g, 0)};
  const double tau = 0;
  double t = 0, quarter = 0;
  while (quarter == 0) {
    double qdd = 0;
    articulated_body.forward_dynamics(model, model.trees[0], state, weight, {&tau, 1}, {&qdd, 1});
    state.qd[0] += h * qdd;
    const double before = state.q[0];
    advance_tree(model, model.trees[0], h, state);
    t += h;
    if (state.q[0] <= 0) quarter = t - h * state.q[0] / (state.q[0] - before);
  }
  CHECK(4 * quarter == Approx(2 * 3.14159265358979 * std::sqrt(2 * length / (3 * g))).epsilon(2e-4));
}

TEST_CASE("each body of a tree is moved by its own joint, and one that is in no tree by none") {
  for (unsigned seed = 0; seed < 4; ++seed) {
    const RandomTree t(seed, 5, seed % 2 == 1);
    for (int i = 0; i < static_cast<int>(t.tree().joints.size()); ++i)
      CHECK(joint_of_body(t.tree(), t.tree().joints[i].body) == i);
    CHECK(joint_of_body(t.tree(), static_cast<int>(t.model.bodies.size())) == -1);
  }
}
