// Joint forces of the end of a step (dynamics/implicit_joints.h).
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <catch2/catch.hpp>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "closed_forms.h"
#include "control/controller.h"
#include "dynamics/composite_body.h"
#include "simulation/explicit_step.h"
#include "simulation/simulation.h"

using namespace cb;

namespace {

const std::string stiff = SOURCE_ROOT "/scenarios/stress/stiff_joints.xml";

SimulationOptions implicit(double step, double duration) {
  SimulationOptions options;
  options.joint_forces = JointForces::implicit;
  options.step = step;
  options.duration = duration;
  return options;
}

ContactMethod method(const std::string& name) {
  MethodOptions options;
  options.compression_bound = false;
  return find_method(name)->make(options);
}

/// The state after a run that has to end well.
State ended(const Scenario& s, const SimulationOptions& options, const std::string& name = "convex") {
  Simulation simulation(s, options, method(name), find_method(name)->law);
  while (!simulation.done()) {
    const Status status = simulation.step().status;
    INFO(simulation.reason());
    REQUIRE(status == Status::ok);
  }
  return simulation.state();
}

/// Coordinates and rates of two equal carriages of 1 kg, x'' = -C (k x + c x') with C the chain's matrix over joints.
Eigen::Vector4d carriages(double k, double c, double t) {
  // Rates of joint 1 and 2: M = [2 1; 1 1], forces -k q - c qd at each joint.
  const Eigen::Matrix2d M_inverse = (Eigen::Matrix2d() << 2, 1, 1, 1).finished().inverse();
  Eigen::Matrix4d A = Eigen::Matrix4d::Zero();
  A.topRightCorner<2, 2>().setIdentity();
  A.bottomLeftCorner<2, 2>() = -k * M_inverse;
  A.bottomRightCorner<2, 2>() = -c * M_inverse;
  const Eigen::EigenSolver<Eigen::Matrix4d> modes(A);
  const Eigen::Vector4cd at_start = modes.eigenvectors().partialPivLu().solve(
      Eigen::Vector4cd(Eigen::Vector4d(0.01, 0, 0.01, 0).cast<std::complex<double>>()));
  const Eigen::Vector4cd now = (modes.eigenvalues().array() * t).exp() * at_start.array();
  return (modes.eigenvectors() * now).real();
}

/// Two carriages of 2 kg, a robot each, without gravity.
Scenario two_rails() {
  Scenario s = test::empty_scene(1e-3, 1e-2);
  s.gravity.constant.setZero();
  for (const double x : {0.0, 5.0}) test::add_on_rail(s, test::sphere_shape(0.1), 2, {x, 0, 0});
  test::collide_all(s, 0);
  return s;
}

/// Of the one joint of a robot: in `role`, with these numbers.
ControllerSpec computed_torque(int tree, int role, std::vector<double> numbers) {
  ControllerSpec spec;
  spec.row = find_controller("computed_torque");
  spec.tree = tree;
  spec.gains = {100.0 * (1 + tree), 20.0 * (1 + tree)};
  spec.words = {0};
  spec.joints = {{role, 0, std::move(numbers)}};
  return spec;
}

double off_carriages(const State& state, const Eigen::Vector4d& exact) {
  return (Eigen::Vector4d(state.q[0], state.q[1], state.qd[0], state.qd[1]) - exact).norm();
}

}  // namespace

TEST_CASE("implicit joint forces solve with M + h D + h^2 K, which is symmetric and positive definite") {
  const Scenario s = load_scenario(find_scenario("grasp"), {});
  const Tree& tree = s.model.trees[0];
  State state = s.initial;
  const Eigen::Index nv = tree.nv;
  for (const bool by_mass : {false, true}) {
    JointGains passive(state.qd.size()), motors(state.qd.size());
    for (std::size_t i = 0; i < state.qd.size(); ++i) {
      const double x = 1 + static_cast<double>(i);
      passive.stiffness[i] = 10 * x;
      passive.damping[i] = 1 / x;
      if (by_mass && i < 6) motors.stiffness_by_mass[i] = 100 * x, motors.damping_by_mass[i] = 20;
      state.qd[i] = std::sin(x);
    }
    constexpr double h = 0.03;
    Eigen::MatrixXd M(nv, nv);
    CompositeBody().mass_matrix(s.model, tree, state, M);
    const auto vector = [&](const std::vector<double>& of) { return Eigen::VectorXd::Map(of.data(), nv); };
    const auto with_mass = [&](const std::vector<double>& of) -> Eigen::MatrixXd {
      const Eigen::VectorXd S = vector(of).cwiseSqrt();
      return S.asDiagonal() * M * S.asDiagonal();
    };
    Eigen::MatrixXd K = with_mass(motors.stiffness_by_mass), D = with_mass(motors.damping_by_mass);
    K.diagonal() += vector(passive.stiffness);
    D.diagonal() += vector(passive.damping);

    ImplicitJoints joints(passive, motors);
    joints.begin(h);
    Eigen::MatrixXd A = M;
    joints.add_to(tree, A);
    CHECK((A - (M + h * D + h * h * K)).norm() <= 1e-14 * A.norm());
    CHECK((A - A.transpose()).norm() == 0);
    CHECK(A.llt().info() == Eigen::Success);
    Eigen::VectorXd a = Eigen::VectorXd::LinSpaced(nv, -1, 2);
    const Eigen::VectorXd force = M * a - h * K * vector(state.qd);
    joints.accelerations(s.model, tree, state, {a.data(), static_cast<std::size_t>(nv)});
    CHECK(((M + h * D + h * h * K) * a - force).norm() <= 1e-12 * force.norm());

    joints.begin(0);  // an instant: impacts find M
    A = M;
    joints.add_to(tree, A);
    CHECK(A == M);
  }
}

TEST_CASE("stiff springs are stable at a hundred times the explicit limit, by events and by steps") {
  for (const Overrides& set : std::vector<Overrides>{{{"stiffness", "1e6"}},
                                                     {{"stiffness", "1e6"}, {"damping", "100"}},
                                                     {{"stiffness", "0"}, {"kp", "1e6"}, {"kv", "10"}}}) {
    const Scenario s = load_scenario(stiff, set);
    const double limit = *largest_stable_step(s), h = 100 * limit;
    CHECK(*largest_stable_step(s, JointForces::implicit) >= h);
    for (const Stepping way : {Stepping::events, Stepping::steps}) {
      SimulationOptions options = implicit(h, 500 * h);
      options.stepping = way;
      Simulation simulation(s, options, method("newton"), find_method("newton")->law);
      while (!simulation.done()) {
        REQUIRE(simulation.step().status == Status::ok);
        REQUIRE(std::abs(simulation.state().q[0]) <= 0.01 * (1 + 1e-9));
        REQUIRE(std::abs(simulation.state().q[1]) <= 0.01 * (1 + 1e-9));
      }
      CHECK(std::abs(simulation.state().q[0]) < 1e-3);  // and come to rest
    }
  }
}

TEST_CASE("implicit joint forces are of first order, and of order p where they are extrapolated") {
  const Scenario s = load_scenario(stiff, {{"stiffness", "200"}, {"damping", "2"}, {"kp", "50"}, {"kv", "1"}});
  constexpr double duration = 0.2;
  const Eigen::Vector4d exact = carriages(250, 3, duration);
  double before = 0;
  for (const double h : {4e-4, 2e-4, 1e-4, 5e-5}) {
    const double error = off_carriages(ended(s, implicit(h, duration)), exact);
    if (before > 0) CHECK(std::log2(before / error) == Approx(1).margin(0.2));
    before = error;
  }
  // From where the order shows; at 0.4 s the error of order 4 passes through zero.
  for (int order = 2; order <= 4; ++order) {
    before = 0;
    for (const double H : {0.0025, 0.00125, 0.000625, 0.0003125}) {
      SimulationOptions options = implicit(1, duration);
      options.stepping = Stepping::accuracy;
      options.order = order;
      options.accuracy = 1e6;
      options.longest = H;
      options.smallest = H / 4;
      const double error = off_carriages(ended(s, options), exact);
      INFO("order " << order << ", H " << H << ": " << before << " -> " << error);
      if (before > 0) CHECK(std::log2(before / error) == Approx(order).margin(0.2));
      before = error;
    }
  }
}

TEST_CASE("the original gains of the grasp's arm hold the box at a step of 1 ms, as computed torque does") {
  // Explicit, their step multiplies an error by -17.
  const Scenario s = load_scenario(find_scenario("grasp"), {{"gains", "torque"}});
  CHECK(*largest_stable_step(s) < 1e-3);
  CHECK(*largest_stable_step(s, JointForces::implicit) > 1e-3);
  const int box = 8, finger = 6;
  const auto place = [&](const State& state) {
    return Vec3(state.pose[finger].q.conjugate() * (state.pose[box].p - state.pose[finger].p));
  };
  double before = 0;
  for (const double h : {1e-3, 5e-4}) {
    const State state = ended(s, implicit(h, 0.5));
    const double creep = (place(state) - place(s.initial)).norm();
    CHECK(creep < 2e-4);
    if (before > 0) CHECK(std::log2(before / creep) > 0.8);
    before = creep;
    // shoulder1 follows -1.30 + 0.25 sin t.
    CHECK(state.q[0] == Approx(-1.30 + 0.25 * std::sin(0.5)).margin(5e-3));
  }
}

TEST_CASE("a motor at its greatest torque gives that, however stiff it would be") {
  Scenario s = load_scenario(stiff, {{"stiffness", "0"}, {"kp", "1e8"}, {"kv", "1e4"}});
  for (Joint& joint : s.model.trees[0].joints) joint.torque_limit = joint.name == "one" ? 0.5 : 0;
  // 0.5 N on 2 kg; joint two has no torque: carriage two goes on as it was, and carriage one takes all of it.
  const State state = ended(s, implicit(1e-3, 0.02), "newton");
  CHECK(state.qd[0] == Approx(0.01 - 0.5 * 0.02).margin(1e-12));
}

TEST_CASE("what strikes a joint within a step meets its mass alone, however stiff its implicit spring is") {
  // 1 kg each, without loss: they change velocities 2 ms before the end of the step, until which no force acts anew.
  Scenario s = test::empty_scene(1e-2, 1e-2);
  s.gravity.constant.setZero();
  test::add_on_rail(s, test::sphere_shape(0.1), 1, {0, 0, 0});
  s.model.trees[0].joints[0].stiffness = 1e6;
  test::add_sphere(s, 0.1, 1, {-0.208, 0, 0}, {1, 0, 0});
  test::collide_all(s, 0, 1);
  const State state = ended(s, implicit(1e-2, 1e-2), "newton");
  CHECK(state.v[6] == Approx(0).margin(1e-9));
  CHECK(state.qd[0] == Approx(1).epsilon(1e-9));
  CHECK(state.q[0] == Approx(2e-3).epsilon(1e-5));
}

TEST_CASE("each robot has its own springs, dampers and motors, whichever of them a controller drives") {
  Scenario s = two_rails();
  s.model.trees[0].joints[0].damping = 3;
  s.model.trees[0].joints[0].stiffness = 7;
  s.model.trees[1].joints[0].damping = 5;
  using Numbers = std::vector<double>;
  CHECK(implicit_damping(s) == Numbers{3, 5});
  s.controllers = {computed_torque(1, 0, Numbers(6, 0.0))};
  CHECK(implicit_damping(s) == Numbers{3, 0});
  // At h = 0.01 s: 40 of the motor, which makes up for its joint's damping; 3 / 2 of the damper that none makes up for.
  CHECK(*largest_eigenvalue(s, 0.01) == Approx(0.4).epsilon(1e-6));
  s.controllers.push_back(computed_torque(0, 0, Numbers(6, 0.0)));
  CHECK(implicit_damping(s) == Numbers{0, 0});
  CHECK(passive_gains(s).stiffness == Numbers{7, 0});
  CHECK(passive_gains(s).damping == Numbers{3, 5});
  CHECK(motor_gains(s).stiffness_by_mass == Numbers{100, 200});
  CHECK(motor_gains(s).damping_by_mass == Numbers{20, 40});
  CHECK(motor_gains(s).damping == Numbers{-3, -5});
}

TEST_CASE("one spring bounds the step that is stable, on whichever robot it is") {
  for (const std::size_t with : {0U, 1U}) {
    Scenario s = two_rails();
    s.model.trees[with].joints[0].stiffness = 200;
    const std::optional<double> step = largest_stable_step(s);
    REQUIRE(step.has_value());
    CHECK(*step == Approx(0.2).epsilon(1e-3));  // 2 / sqrt(k / m)
  }
}

TEST_CASE("two robots move by the torques of their own controllers") {
  Scenario s = two_rails();
  s.controllers = {computed_torque(1, 1, {-2}), computed_torque(0, 1, {3})};
  SimulationOptions options;
  options.step = s.step;
  options.duration = s.duration;
  Simulation simulation(s, options, method("newton"), find_method("newton")->law);
  while (!simulation.done()) REQUIRE(simulation.step().status == Status::ok);
  REQUIRE(simulation.torque().size() == 2);
  CHECK(simulation.torque()[0] == Approx(6));  // 2 kg each
  CHECK(simulation.torque()[1] == Approx(-4));
  CHECK(simulation.state().qd[0] == Approx(0.03));
  CHECK(simulation.state().qd[1] == Approx(-0.02));
}
