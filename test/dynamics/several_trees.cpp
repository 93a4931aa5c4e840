// A robot beside others moves as it does alone: where its bodies, coordinates and rates begin is no matter.
#include <Eigen/Cholesky>
#include <catch2/catch.hpp>

#include "dynamics/articulated_body.h"
#include "dynamics/composite_body.h"
#include "dynamics/free_bodies.h"
#include "dynamics/implicit_joints.h"
#include "dynamics/newton_euler.h"
#include "random_tree.h"

using namespace cb;

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A free ball, then the first tree, then the second, in one model.
struct Both {
  Model model;
  State state;
  Both(const RandomTree& first, const RandomTree& second) {
    model.bodies = {{"ball", 1, {1, 1, 1}}};
    state.pose = {{{7, 8, 9}, Quat::Identity()}};
    state.v.assign(6, 0.5);
    for (const RandomTree* from : {&first, &second}) {
      Tree tree = from->tree();
      const int bodies = static_cast<int>(model.bodies.size()), q = static_cast<int>(state.q.size());
      tree.v = static_cast<int>(state.qd.size());
      for (Joint& joint : tree.joints) {
        joint.body += bodies;
        if (joint.parent >= 0) joint.parent += bodies;
        if (joint.q >= 0) joint.q += q;
        if (joint.v >= 0) joint.v += tree.v;
      }
      for (Body body : from->model.bodies) {
        body.tree = static_cast<int>(model.trees.size());
        model.bodies.push_back(body);
      }
      const auto append = [](auto& to, const auto& what) { to.insert(to.end(), what.begin(), what.end()); };
      append(state.pose, from->state.pose);
      append(state.v, from->state.v);
      append(state.q, from->state.q);
      append(state.qd, from->state.qd);
      model.trees.push_back(tree);
    }
  }
};

std::span<double> span(VectorXd& x) { return {x.data(), static_cast<std::size_t>(x.size())}; }
std::span<const double> span(const std::vector<double>& x) { return x; }

/// The twists of a tree's links for these rates, 6 a body of the model.
std::vector<double> twists(const Model& model, const Tree& tree, State state, const VectorXd& qd) {
  for (Eigen::Index i = 0; i < qd.size(); ++i) state.qd[static_cast<std::size_t>(tree.v + i)] = qd[i];
  link_twists(model, tree, state);
  return state.v;
}

/// Generalised forces by virtual power, sum of J^T (m a - f) + J_w^T (I a_w + w x I w), from twists alone: Jacobians
/// are those of unit rates, accelerations differences of twists along the motion.
VectorXd by_virtual_power(const Model& model, const Tree& tree, const State& state, const std::vector<Vec3>& force,
                          const VectorXd& qdd) {
  constexpr double dt = 1e-5;
  const VectorXd qd = VectorXd::Map(&state.qd[static_cast<std::size_t>(tree.v)], tree.nv);
  const auto along = [&](double t) {
    State at = state;
    move_tree(model, tree, qd.data(), t, at);
    return twists(model, tree, at, qd + t * qdd);
  };
  const std::vector<double> after = along(dt), before = along(-dt);
  VectorXd tau = VectorXd::Zero(tree.nv);
  for (int i = 0; i < tree.nv; ++i) {
    const std::vector<double> J = twists(model, tree, state, VectorXd::Unit(tree.nv, i));
    for (const Joint& joint : tree.joints) {
      const std::size_t b = static_cast<std::size_t>(joint.body), at = 6 * b;
      const Vec3 a = (Vec3(&after[at]) - Vec3(&before[at])) / (2 * dt);
      const Vec3 a_w = (Vec3(&after[at + 3]) - Vec3(&before[at + 3])) / (2 * dt), w(&state.v[at + 3]);
      const Mat3 R = state.pose[b].q.toRotationMatrix();
      const Mat3 I = R * model.bodies[b].inertia.asDiagonal() * R.transpose();
      tau[i] += Vec3(&J[at]).dot(model.bodies[b].mass * a - force[b]) + Vec3(&J[at + 3]).dot(I * a_w + w.cross(I * w));
    }
  }
  return tau;
}

}  // namespace

TEST_CASE("the second robot of a model has the dynamics that virtual power gives it, and its links' places") {
  for (unsigned seed = 0; seed < 12; ++seed) {
    INFO("seed " << seed);
    RandomTree first(seed + 100, 4, seed % 3 == 0), second(seed, 7, seed % 2 == 1);
    const Both both(first, second);
    const Tree& tree = both.model.trees[1];
    REQUIRE(tree.v > 0);
    std::vector<Vec3> force;
    for (std::size_t b = 0; b < both.model.bodies.size(); ++b) force.push_back(second.vector(5));
    const VectorXd qdd = VectorXd::Map(second.numbers(static_cast<std::size_t>(tree.nv), 3).data(), tree.nv);
    const VectorXd expected = by_virtual_power(both.model, tree, both.state, force, qdd);

    VectorXd tau = VectorXd::Constant(tree.nv, 7);  // what was there is no matter
    NewtonEuler newton_euler;
    VectorXd of_first(both.model.trees[0].nv);
    newton_euler.inverse_dynamics(both.model, both.model.trees[0], both.state, force, span(first.state.qd),
                                  span(of_first));  // scratch of another tree is no matter either
    newton_euler.inverse_dynamics(both.model, tree, both.state, force, {qdd.data(), static_cast<std::size_t>(tree.nv)},
                                  span(tau));
    CHECK((tau - expected).norm() < 1e-7 * expected.norm());

    MatrixXd M = MatrixXd::Constant(tree.nv, tree.nv, 7);
    CompositeBody composite_body;
    MatrixXd M_first(both.model.trees[0].nv, both.model.trees[0].nv);
    composite_body.mass_matrix(both.model, both.model.trees[0], both.state, M_first);
    composite_body.mass_matrix(both.model, tree, both.state, M);
    const VectorXd rest = by_virtual_power(both.model, tree, both.state, force, VectorXd::Zero(tree.nv));
    CHECK((M * qdd - (expected - rest)).norm() < 1e-7 * expected.norm());

    ArticulatedBody articulated_body;
    VectorXd found = VectorXd::Constant(tree.nv, 7);
    articulated_body.forward_dynamics(both.model, both.model.trees[0], both.state, force, span(first.state.qd),
                                      span(of_first));
    articulated_body.forward_dynamics(both.model, tree, both.state, force,
                                      {expected.data(), static_cast<std::size_t>(tree.nv)}, span(found));
    CHECK((found - qdd).norm() < 1e-6 * qdd.norm());
    // Added to the diagonal: of each rate, none of a free joint's.
    std::vector<double> added(static_cast<std::size_t>(tree.nv), 0.0);
    for (const Joint& joint : tree.joints)
      if (joint.nv() == 1) added[static_cast<std::size_t>(joint.v - tree.v)] = 0.1 * (1 + joint.v);
    articulated_body.factor(both.model, tree, both.state, added);
    articulated_body.accelerations(tree, both.state, force, {expected.data(), static_cast<std::size_t>(tree.nv)},
                                   span(found));
    M.diagonal() += VectorXd::Map(added.data(), tree.nv);
    CHECK((M * found - (expected - rest)).norm() < 1e-6 * expected.norm());

    for (std::size_t i = 0; i < tree.joints.size(); ++i) {
      const int body = tree.joints[i].body;
      CHECK(both.state.pose[static_cast<std::size_t>(body)].p == second.state.pose[i].p);
      CHECK(joint_of_body(tree, body) == static_cast<int>(i));
      const Vec3 point = second.vector(1);
      Eigen::Matrix3Xd J = Eigen::Matrix3Xd::Constant(3, tree.nv, 7);
      point_jacobian(both.model, tree, both.state, static_cast<int>(i), point, J);
      const VectorXd qd = VectorXd::Map(&both.state.qd[static_cast<std::size_t>(tree.v)], tree.nv);
      CHECK((J * qd - velocity_at(both.state, body, point)).norm() < 1e-12 * (1 + J.norm()));
    }
  }
}

TEST_CASE("one robot moves and the others stay") {
  RandomTree first(11, 4, true), second(12, 6, true);
  Both both(first, second);
  const State before = both.state;
  const Tree& tree = both.model.trees[1];
  advance_tree(both.model, tree, 0.2, both.state);
  advance_tree(second.model, second.tree(), 0.2, second.state);
  for (std::size_t i = 0; i < 6; ++i) {
    CHECK(both.state.pose[5 + i].p == second.state.pose[i].p);
    CHECK(both.state.pose[5 + i].q.coeffs() == second.state.pose[i].q.coeffs());
  }
  for (std::size_t i = 0; i < second.state.v.size(); ++i) CHECK(both.state.v[30 + i] == second.state.v[i]);
  for (std::size_t i = 0; i < 5; ++i) CHECK(both.state.pose[i].p == before.pose[i].p);
  const std::vector<double> rates = second.numbers(static_cast<std::size_t>(tree.nv), 1);
  move_tree(both.model, tree, rates.data(), 0.1, both.state);
  move_tree(second.model, second.tree(), rates.data(), 0.1, second.state);
  for (std::size_t i = 0; i < 6; ++i) CHECK(both.state.pose[5 + i].p == second.state.pose[i].p);
}

TEST_CASE("implicit joint forces of the second robot are those of its own gains, its motors at their limits or not") {
  RandomTree first(21, 4, false), second(22, 6, true);
  const Both both(first, second);
  const Tree& tree = both.model.trees[1];
  const Eigen::Index nv = tree.nv;
  const std::size_t all = both.state.qd.size();
  JointGains passive(all), motors(all);
  for (std::vector<double>* gains : {&passive.stiffness, &passive.damping, &motors.stiffness, &motors.damping,
                                     &motors.stiffness_by_mass, &motors.damping_by_mass})
    for (std::size_t i = 0; i < all; ++i) (*gains)[i] = second.number(1, 20);
  const auto of = [&](const std::vector<double>& gains) -> VectorXd { return VectorXd::Map(&gains[tree.v], nv); };
  MatrixXd M(nv, nv);
  CompositeBody().mass_matrix(both.model, tree, both.state, M);
  const double h = 0.05;
  ImplicitJoints joints(passive, motors);
  joints.begin(h);
  const int saturated = tree.joints.back().nv() == 1 ? tree.joints.back().v : tree.v + tree.nv - 1;
  for (const bool at_limit : {false, true}) {
    if (at_limit) {
      joints.saturate(saturated);
      for (std::vector<double>* gains :
           {&motors.stiffness, &motors.damping, &motors.stiffness_by_mass, &motors.damping_by_mass})
        (*gains)[static_cast<std::size_t>(saturated)] = 0;
    }
    const auto matrix = [&](const VectorXd& diagonal, const VectorXd& by_mass) -> MatrixXd {
      const VectorXd S = by_mass.cwiseSqrt();
      MatrixXd out = S.asDiagonal() * M * S.asDiagonal();
      out.diagonal() += diagonal;
      return out;
    };
    const MatrixXd K = matrix(of(passive.stiffness) + of(motors.stiffness), of(motors.stiffness_by_mass));
    const MatrixXd D = matrix(of(passive.damping) + of(motors.damping), of(motors.damping_by_mass));
    VectorXd a = VectorXd::LinSpaced(nv, -1, 2);
    const VectorXd expected = (M + h * D + h * h * K).llt().solve(M * a - h * K * of(both.state.qd));
    joints.accelerations(both.model, tree, both.state, span(a));
    INFO("at its limit " << at_limit);
    CHECK((a - expected).norm() < 1e-11 * expected.norm());
  }
}
