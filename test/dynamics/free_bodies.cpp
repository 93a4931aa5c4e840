#include "dynamics/free_bodies.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "dynamics/kinematics.h"

using namespace cb;

namespace {

struct Tumbler {
  Model model{{{"slab", 2, {1, 2, 3}}}};
  State state{0, {{{0.1, 2, 0}, Quat(Eigen::AngleAxisd(0.8, Vec3(1, -1, 2).normalized()))}}, {1, -2, 0.5, 3, 1, -2}};
};

}  // namespace

TEST_CASE("kinetic energy is 1/2 m v.v + 1/2 w.(R I R^T) w") {
  const Tumbler t;
  const Mat3 R = t.state.pose[0].q.toRotationMatrix();
  const Vec3 v(1, -2, 0.5), w(3, 1, -2);
  const Mat3 I = R * Vec3(1, 2, 3).asDiagonal() * R.transpose();
  CHECK(kinetic_energy(t.model, t.state) == Approx(v.squaredNorm() + 0.5 * w.dot(I * w)).epsilon(1e-14));
  CHECK(potential_energy(t.model, t.state, {0, -9.8, 0}) == Approx(2 * 9.8 * 2).epsilon(1e-14));
}

TEST_CASE("potential energy is that of weights, and of springs from where they rest") {
  Model model;
  model.bodies = {{"ball", 2, Vec3(1, 1, 1)}};
  Joint spring;
  spring.q = 0;
  spring.stiffness = 4;
  spring.rest = 0.5;
  Tree tree;
  tree.joints = {spring};
  model.trees = {tree};
  State state;
  state.pose = {{Vec3(0, 3, 0), Quat::Identity()}};
  state.q = {0.2};
  CHECK(potential_energy(model, state, Vec3(0, -10, 0)) == Approx(2 * 10 * 3 + 0.5 * 4 * 0.3 * 0.3));
}

TEST_CASE("the spin's acceleration is that of Euler's equations in the world: d(I w)/dt = 0 without torque") {
  // With W = R I R^T and dW/dt = [w] W - W [w]: W dw/dt + w x W w = 0.
  Tumbler t;
  const Mat3 R = t.state.pose[0].q.toRotationMatrix();
  const Mat3 I = R * Vec3(1, 2, 3).asDiagonal() * R.transpose();
  const Vec3 w(3, 1, -2);
  const double h = 1e-3;
  accelerate(t.model, {Vec3::Zero()}, h, t.state, Gyroscopic::explicit_euler);
  const Vec3 dw = (Vec3(t.state.v[3], t.state.v[4], t.state.v[5]) - w) / h;
  CHECK((I * dw + w.cross(I * w)).norm() < 1e-11);
}

TEST_CASE("a force changes the velocity by h F / m and its energy bound is never below its work") {
  Tumbler t;
  const double before = t.state.v[0] * t.state.v[0] + t.state.v[1] * t.state.v[1] + t.state.v[2] * t.state.v[2];
  t.state.v[3] = t.state.v[4] = t.state.v[5] = 0;
  const double bound = accelerate(t.model, {Vec3(4, 0, -2)}, 0.1, t.state);
  CHECK(t.state.v[0] == Approx(1.2).epsilon(1e-15));
  CHECK(t.state.v[2] == Approx(0.4).epsilon(1e-15));
  const double after = t.state.v[0] * t.state.v[0] + t.state.v[1] * t.state.v[1] + t.state.v[2] * t.state.v[2];
  CHECK(bound >= after - before);  // mass 2 kg: 1/2 m v^2 = v^2
}

namespace {

// Turns of a box 1 x 2 x 3 m, 6 kg, about its middle axis at `speed` rad/s, nudged off it, as the stepper moves it.
struct Turning {
  Model model{{{"box", 6, {6.5, 5, 2.5}}}};
  State state;
  explicit Turning(double speed) : state{0, {{}}, {0, 0, 0, 1e-3 * speed, speed, 1e-3 * speed}} {}
  Vec3 momentum() const {
    const Quat& q = state.pose[0].q;
    return q * model.bodies[0].inertia.cwiseProduct(q.conjugate() * Vec3(&state.v[3]));
  }
  void go(double seconds, double h, Gyroscopic gyroscopic) {
    for (long i = 0; i < std::lround(seconds / h); ++i) {
      accelerate(model, {Vec3::Zero()}, h, state, gyroscopic);
      state.pose[0] = advance(state.pose[0], Vec3::Zero(), Vec3(&state.v[3]), h);
    }
  }
};

}  // namespace

TEST_CASE("a box that tumbles about its middle axis loses and gains no energy, and its momentum keeps its size") {
  // At 30 rad/s a turn is 0.2 s: 48 turns. Rounding alone is left, at steps of 0.03 and of 0.12 rad.
  for (const double h : {1e-3, 4e-3}) {
    Turning t(30);
    const double energy = kinetic_energy(t.model, t.state), momentum = t.momentum().norm();
    t.go(10, h, Gyroscopic::implicit);
    CHECK(1e12 * std::abs(kinetic_energy(t.model, t.state) / energy - 1) < 1);
    CHECK(1e12 * std::abs(t.momentum().norm() / momentum - 1) < 1);
    CHECK(std::abs(t.state.v[4]) < 31);
  }
  Turning fast(1e4);  // 10 rad a step
  const double energy = kinetic_energy(fast.model, fast.state);
  fast.go(1, 1e-3, Gyroscopic::implicit);
  CHECK(std::abs(kinetic_energy(fast.model, fast.state) / energy - 1) < 1e-11);
}

TEST_CASE("the explicit step of Euler's equations gains energy: 28 % in 48 turns of 0.2 s at a step of 1 ms") {
  Turning t(30);
  const double energy = kinetic_energy(t.model, t.state);
  t.go(10, 1e-3, Gyroscopic::explicit_euler);
  CHECK(kinetic_energy(t.model, t.state) / energy > 1.05);
}

TEST_CASE("the direction of a tumbling body's momentum is right to first order in the step") {
  double error[2];
  for (int i = 0; i < 2; ++i) {
    Turning t(3);
    const Vec3 before = t.momentum();
    t.go(10, i == 0 ? 1e-3 : 5e-4, Gyroscopic::implicit);
    error[i] = (t.momentum() - before).norm() / before.norm();
  }
  CHECK(error[0] < 0.02);
  CHECK(error[0] / error[1] == Approx(2).epsilon(0.1));
}

TEST_CASE("a body that turns by more than fifty radians a step keeps the spin it has in its own axes") {
  Turning t(1e8);
  const double energy = kinetic_energy(t.model, t.state);
  const Vec3 spin(&t.state.v[3]);  // the axes of the body are the world's at first
  t.go(1e-2, 1e-3, Gyroscopic::implicit);
  CHECK(std::abs(kinetic_energy(t.model, t.state) / energy - 1) < 1e-6);
  CHECK((t.state.pose[0].q.conjugate() * Vec3(&t.state.v[3]) - spin).norm() < 1e-9 * spin.norm());
}

TEST_CASE("a body that turns steadily has turned by rate times time, to the last bits of small and large angles") {
  const Vec3 axis = Vec3(1, -2, 3).normalized();
  for (const double angle : {0.0, 1e-9, 1e-4, 0.02, 0.06, 0.0632, 0.0633, 0.5, 3.0}) {
    const Pose pose = advance(Pose{}, Vec3::Zero(), 10 * angle * axis, 0.1);
    INFO(angle << " rad");
    CHECK(std::abs(pose.q.w() - std::cos(angle / 2)) < 3e-16);
    CHECK((pose.q.vec() - std::sin(angle / 2) * axis).norm() < 3e-16 + 1e-15 * angle);
  }
}

namespace {

/// Two free bodies and a link between them in the list.
struct Mixed {
  Model model{{{"ball", 2, {0.5, 0.5, 0.5}}, {"link", 3, {1, 2, 3}, 0}, {"cube", 5, {4, 4, 4}}}};
  State state;
  Mixed() {
    state.pose = {{{1, 2, 3}, Quat::Identity()}, {{4, 5, 6}, Quat::Identity()}, {{7, 8, 9}, Quat::Identity()}};
    for (int i = 0; i < 18; ++i) state.v.push_back(0.5 * (i - 4));
  }
};

}  // namespace

TEST_CASE("energies add up over all bodies, links too, and over the springs of all trees") {
  Mixed t;
  Tree trees[2];
  for (int k = 0; k < 2; ++k) {
    Joint spring;
    spring.kind = JointKind::prismatic;
    spring.q = k;
    spring.stiffness = 4 + 2 * k;
    spring.rest = 0.5 * k;
    trees[k].joints = {Joint(), spring};
  }
  t.model.trees = {trees[0], trees[1]};
  t.state.q = {0.25, 2};
  // -g.p is 10 y - 2 x + z.
  const double weights = 2 * (20 - 2 + 3) + 3 * (50 - 8 + 6) + 5 * (80 - 14 + 9);
  CHECK(potential_energy(t.model, t.state, {2, -10, -1}) ==
        Approx(weights + 0.5 * 4 * 0.25 * 0.25 + 0.5 * 6 * 1.5 * 1.5));
  // v: (-2, -1.5, -1), (-0.5, 0, 0.5); (1, 1.5, 2), (2.5, 3, 3.5); (4, 4.5, 5), (5.5, 6, 6.5).
  const double kinetic =
      0.5 * (2 * 7.25 + 0.5 * 0.5) + 0.5 * (3 * 7.25 + 1 * 6.25 + 2 * 9 + 3 * 12.25) + 0.5 * (5 * 61.25 + 4 * 108.5);
  CHECK(kinetic_energy(t.model, t.state) == Approx(kinetic));
}

TEST_CASE("forces move free bodies, each its own; what they may have put in is the sum over these") {
  Mixed t;
  const State before = t.state;
  const double h = 0.1, bound = accelerate(t.model, {{4, 0, -2}, {100, 100, 100}, {0, 5, 0}}, h, t.state);
  const double expected[18] = {-2 + 0.2, -1.5, -1 - 0.1, -0.5, 0,         0.5, 1,   1.5, 2,
                               2.5,      3,    3.5,      4,    4.5 + 0.1, 5,   5.5, 6,   6.5};
  for (int i = 0; i < 18; ++i) CHECK(t.state.v[i] == Approx(expected[i]));
  // |F.v| h + m |dv|^2 / 2: |-8 + 2| 0.1 + 0.05, and 22.5 0.1 + 5 0.01 / 2.
  CHECK(bound == Approx(0.6 + 0.05 + 2.25 + 0.025));
  CHECK(t.state.pose[0].p == before.pose[0].p);
}

TEST_CASE("a body whose moments are alike about two axes turns and has energy as its third moment says, whichever") {
  for (int odd = 0; odd < 3; ++odd) {
    INFO("axis " << odd);
    Vec3 inertia(2, 2, 2);
    inertia[odd] = 5;
    Model model{{{"disc", 1, inertia}}};
    const Quat q(Eigen::AngleAxisd(0.8, Vec3(1, -1, 2).normalized()));
    const Vec3 w(3, 1, -2), own = q.conjugate() * w;
    State state{0, {{{0, 0, 0}, q}}, {0, 0, 0, 3, 1, -2}};
    CHECK(kinetic_energy(model, state) == Approx(0.5 * inertia.dot(own.cwiseAbs2())).epsilon(1e-14));
    // Euler's equations: the spin about the odd axis stays, the others turn by (I_odd - I) / I w_odd.
    const double h = 1e-6;
    accelerate(model, {Vec3::Zero()}, h, state, Gyroscopic::explicit_euler);
    const Vec3 change = (q.conjugate() * (Vec3(&state.v[3]) - w)) / h;
    const int next = (odd + 1) % 3, last = (odd + 2) % 3;
    CHECK(change[odd] == Approx(0).margin(1e-8));
    CHECK(change[next] == Approx(-1.5 * own[odd] * own[last]).epsilon(1e-6).margin(1e-8));
    CHECK(change[last] == Approx(1.5 * own[odd] * own[next]).epsilon(1e-6).margin(1e-8));
  }
}

TEST_CASE("a spin goes by the midpoint rule in the axes of the body, in as many steps as its turn needs") {
  const Vec3 inertia(1, 2, 3.5);
  const Quat q(Eigen::AngleAxisd(0.8, Vec3(1, -1, 2).normalized()));
  const Vec3 direction = Vec3(3, 1, -2).normalized();
  const auto change = [&](double speed, double h, Gyroscopic gyroscopic) {
    const Model model{{{"slab", 2, inertia}}};
    State state{0, {{{0, 0, 0}, q}}, std::vector<double>(6, 0.0)};
    Eigen::Map<Vec3>(&state.v[3]) = q * (speed * direction);
    accelerate(model, {Vec3::Zero()}, h, state, gyroscopic);
    return Vec3(q.conjugate() * Vec3(&state.v[3]) - speed * direction);
  };
  // One step, 0.4 rad: the rule itself.
  const Vec3 w_0 = 2 * direction, w_1 = w_0 + change(2, 0.2, Gyroscopic::implicit), w_m = (w_0 + w_1) / 2;
  CHECK((inertia.cwiseProduct(w_1 - w_0) - 0.2 * inertia.cwiseProduct(w_m).cross(w_m)).norm() < 1e-14);
  // 3 rad and 40 rad: Euler's equations by Runge and Kutta's method; one step would be off by as much as it turns.
  for (const double angle : {3.0, 40.0}) {
    Vec3 w = direction;
    const auto f = [&](const Vec3& x) { return Vec3(inertia.cwiseProduct(x).cross(x).cwiseQuotient(inertia)); };
    const int steps = 4000;
    const double h = angle / steps;
    for (int i = 0; i < steps; ++i) {
      const Vec3 k1 = f(w), k2 = f(w + h / 2 * k1), k3 = f(w + h / 2 * k2), k4 = f(w + h * k3);
      w += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    }
    INFO(angle << " rad");
    CHECK((change(1, angle, Gyroscopic::implicit) - (w - direction)).norm() < 8e-3 * angle);
    CHECK((w - direction).norm() > 0.1);
  }
  CHECK(change(1, 60, Gyroscopic::implicit).norm() < 1e-14);  // beyond what is told apart: it keeps its spin
  // However slowly a body turns, and whatever the step: to first order both rules say the same.
  for (const double speed : {1e-3, 1e-6})
    for (const double h : {1e-3, 1e-6}) {
      const Vec3 expected =
          h * (speed * speed) * inertia.cwiseProduct(direction).cross(direction).cwiseQuotient(inertia);
      for (const Gyroscopic way : {Gyroscopic::implicit, Gyroscopic::explicit_euler}) {
        INFO(speed << " rad/s, " << h << " s");
        CHECK((change(speed, h, way) - expected).norm() < 1e-6 * expected.norm() + 1e-15 * speed);
      }
    }
}
