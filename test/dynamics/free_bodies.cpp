#include "dynamics/free_bodies.h"

#include <catch2/catch.hpp>

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

TEST_CASE("the spin's acceleration is that of Euler's equations in the world: d(I w)/dt = 0 without torque") {
  // With W = R I R^T and dW/dt = [w] W - W [w]: W dw/dt + w x W w = 0.
  Tumbler t;
  const Mat3 R = t.state.pose[0].q.toRotationMatrix();
  const Mat3 I = R * Vec3(1, 2, 3).asDiagonal() * R.transpose();
  const Vec3 w(3, 1, -2);
  const double h = 1e-3;
  accelerate(t.model, {Vec3::Zero()}, h, t.state);
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
