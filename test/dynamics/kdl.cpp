// Our dynamics against KDL's, which shares no code with it: the same arm, written down twice.
#ifdef CONTACTBENCH_HAVE_KDL
#include <Eigen/Cholesky>
#include <catch2/catch.hpp>
#include <kdl/chaindynparam.hpp>
#include <kdl/chainidsolver_recursive_newton_euler.hpp>

#include "dynamics/articulated_body.h"
#include "dynamics/composite_body.h"
#include "dynamics/newton_euler.h"
#include "random_tree.h"

using namespace cb;

namespace {

KDL::Vector vector(const Vec3& x) { return {x.x(), x.y(), x.z()}; }
KDL::Frame frame(const Quat& q, const Vec3& p) {
  return {KDL::Rotation::Quaternion(q.x(), q.y(), q.z(), q.w()), vector(p)};
}

}  // namespace

TEST_CASE("torques and mass matrices of random chains are those of KDL") {
  const Vec3 g(0.3, -9.8, 1);
  for (unsigned seed = 0; seed < 20; ++seed) {
    INFO("seed " << seed);
    RandomTree t(seed, 6, false);
    Tree& tree = t.model.trees[0];
    tree.nv = 0;
    t.state.q.clear();
    KDL::Chain chain;
    for (int i = 0; i < 6; ++i) {  // a chain of hinges and sliders
      Joint& joint = tree.joints[i];
      joint.parent = joint.up = i - 1;
      if (joint.kind == JointKind::fixed) joint.kind = JointKind::revolute;
      joint.q = joint.v = tree.nv++;
      t.state.q.push_back(t.number(-2, 2));
      // KDL: frame of a segment = joint (about an origin and axis in the parent's tip) then a fixed tip. Tips are our
      // centres of mass; the joint's axis is turn_PC axis_C through anchor_P.
      const Vec3 axis = joint.turn_PC * joint.axis_C;
      const KDL::Joint hinge(joint.name, vector(joint.anchor_P), vector(axis),
                             joint.kind == JointKind::revolute ? KDL::Joint::RotAxis : KDL::Joint::TransAxis);
      const Vec3 tip = joint.anchor_P - joint.turn_PC * joint.anchor_C;
      const Body& body = t.model.bodies[i];
      const KDL::RotationalInertia inertia(body.inertia.x(), body.inertia.y(), body.inertia.z());
      chain.addSegment(KDL::Segment(body.name, hinge, frame(joint.turn_PC, tip),
                                    KDL::RigidBodyInertia(body.mass, KDL::Vector::Zero(), inertia)));
    }
    t.state.qd = t.numbers(6, 2);
    forward_kinematics(t.model, tree, t.state);
    const std::vector<double> qdd = t.numbers(6, 3);

    KDL::JntArray q(6), qd(6), acceleration(6), torque(6);
    for (unsigned i = 0; i < 6; ++i) {
      q(i) = t.state.q[i];
      qd(i) = t.state.qd[i];
      acceleration(i) = qdd[i];
    }
    KDL::ChainIdSolver_RNE solver(chain, vector(g));
    REQUIRE(solver.CartToJnt(q, qd, acceleration, KDL::Wrenches(6, KDL::Wrench::Zero()), torque) == 0);
    KDL::ChainDynParam dynamics(chain, vector(g));
    KDL::JntSpaceInertiaMatrix H(6);
    REQUIRE(dynamics.JntToMass(q, H) == 0);

    std::vector<Vec3> weight;
    for (const Body& body : t.model.bodies) weight.push_back(body.mass * g);
    std::vector<double> tau(6), back(6);
    NewtonEuler().inverse_dynamics(t.model, tree, t.state, weight, qdd, tau);
    ArticulatedBody().forward_dynamics(t.model, tree, t.state, weight, tau, back);
    Eigen::MatrixXd M(6, 6);
    CompositeBody().mass_matrix(t.model, tree, t.state, M);
    for (unsigned i = 0; i < 6; ++i) {
      CHECK(tau[i] == Approx(torque(i)).epsilon(1e-10).margin(1e-10));
      CHECK(back[i] == Approx(qdd[i]).epsilon(1e-10).margin(1e-10));
      for (unsigned j = 0; j < 6; ++j) CHECK(M(i, j) == Approx(H(i, j)).epsilon(1e-10).margin(1e-10));
    }
  }
}
#endif
