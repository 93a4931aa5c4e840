// What the poses are displaced by at the end of a step: joints keep their limits, and the kinetic energy stays.
#include "simulation/displacement.h"

#include <catch2/catch.hpp>

#include "dynamics/free_bodies.h"
#include "dynamics/kinematics.h"
#include "scenes.h"
#include "simulation/drift.h"
#include "simulation/simulation.h"

using namespace cb;

namespace {

Scenario without_gravity() {
  Scenario s = test::empty_scene(1e-3, 1e-3);
  s.gravity.constant.setZero();
  return s;
}

/// Makes bodies from..last a chain of hinges about z, each at its body's left end; the first hangs on the world.
void join(Scenario& s, int from, JointKind kind, const Vec3& axis) {
  Tree tree;
  tree.v = static_cast<int>(s.initial.qd.size());
  for (int body = from; body < static_cast<int>(s.model.bodies.size()); ++body) {
    Joint joint;
    joint.kind = kind;
    joint.body = body;
    joint.parent = body == from ? -1 : body - 1;
    joint.up = body - from - 1;
    joint.axis_C = axis;
    if (kind == JointKind::revolute) joint.anchor_C = {-0.5, 0, 0};
    const Vec3 anchor = s.initial.pose[body].p + joint.anchor_C;
    joint.anchor_P = body == from ? anchor : Vec3(anchor - s.initial.pose[body - 1].p);
    joint.q = static_cast<int>(s.initial.q.size());
    joint.v = static_cast<int>(s.initial.qd.size());
    s.initial.q.push_back(0);
    s.initial.qd.push_back(0);
    s.model.bodies[body].tree = static_cast<int>(s.model.trees.size());
    tree.joints.push_back(joint);
  }
  tree.nv = static_cast<int>(tree.joints.size());
  s.model.trees.push_back(tree);
}

/// A ball that overlaps another one by `depth`, and pushes it along its rail into its stop at q = `stop`.
Scenario ball_and_stop(double depth, double stop) {
  Scenario s = without_gravity();
  test::add_sphere(s, 0.5, 1, {-1 + depth, 0, 0});
  test::add_sphere(s, 0.5, 1, {0, 0, 0});
  join(s, 1, JointKind::prismatic, Vec3::UnitX());
  s.model.trees[0].joints[0].upper = stop;
  test::collide_all(s, 0);
  return s;
}

std::vector<Motion> motions_at(const Scenario& s, const State& state) {
  std::vector<Motion> motions(s.shapes.size());
  for (std::size_t i = 0; i < motions.size(); ++i) shape_motion(s.shapes[i], state, motions[i]);
  return motions;
}

/// Of the first two shapes.
std::vector<ContactPoint> one_contact(const Scenario& s, const std::vector<Motion>& motions) {
  std::vector<ContactPoint> touching;
  contact_points(s.shapes[0], motions[0].pose, 0, s.shapes[1], motions[1].pose, 1, 1e-9, touching);
  REQUIRE(touching.size() == 1);
  return touching;
}

}  // namespace

TEST_CASE("what overlaps a link whose joint is at its limit is pushed out alone", "[overlap]") {
  const double depth = 1e-3;
  for (const double stop : {0.0, depth / 10}) {
    const Scenario s = ball_and_stop(depth, stop);
    SimulationOptions options;
    options.step = options.duration = 1e-3;
    Simulation simulation(s, options, find_method("ap")->make({}), anitescu_potra_law());
    REQUIRE(simulation.step().status == Status::ok);
    const State& state = simulation.state();
    CHECK(state.q[0] == Approx(stop).margin(1e-9));
    CHECK(state.pose[1].p[0] - state.pose[0].p[0] == Approx(1).epsilon(1e-9));
  }
}

TEST_CASE("a gap that arithmetic leaves at a link is closed without its joint going beyond its limit", "[drift]") {
  const double depth = 1e-6;
  Scenario s = ball_and_stop(0, 0);
  State state = s.initial;
  std::vector<Motion> motions = motions_at(s, state);
  const std::vector<ContactPoint> touching = one_contact(s, motions);
  // As if an arc of half a millimetre had taken the ball into the link.
  state.v[5] = motions[0].w[2] = 31.6;
  state.pose[0].p[0] += depth;
  Drift().remove(s, motions, touching, {1e-9, 1e-9}, 1e-9, {0.5, 0.5}, {{0, 1}}, {0}, 1e-3, state);
  CHECK(state.q[0] == Approx(0).margin(1e-10));
  CHECK(state.pose[1].p[0] - state.pose[0].p[0] == Approx(1).epsilon(1e-9));
}

// A ball that spins at 5 rad/s on a link of 10 m: what its spin can open in a step is of its radius, 1.9e-5 m, not of
// the link's, 1.4e-4 m.
TEST_CASE("a gap beyond what arcs can have opened is that of a pair that parts, however large the other shape",
          "[drift]") {
  Scenario s = ball_and_stop(0, 1);
  std::vector<Motion> motions = motions_at(s, s.initial);
  const std::vector<ContactPoint> touching = one_contact(s, motions);
  motions[0].w[0] = 5;  // about the normal: no slip
  for (const double gap : {1e-5, 5e-5}) {
    State state = s.initial;
    std::vector<Motion> now = motions;
    state.v[3] = 5;
    state.pose[0].p[0] -= gap;
    Drift().remove(s, now, touching, {1e-9, 1e-9}, 1e-9, {0.5, 5}, {{0, 1}}, {0}, 1e-3, state);
    CHECK(state.pose[1].p[0] - state.pose[0].p[0] - 1 == Approx(gap > 1.9e-5 ? gap : 0).margin(1e-9));
  }
}

// A disc on its rim turns by 0.79 rad in the step: what arcs can have opened is more than its radius, as high as the
// points at its sides are. Closing these, too, would turn and lift it.
TEST_CASE("a wheel that turns by radians a step stays where it touches", "[drift]") {
  const double radius = 0.1, spin = 787;
  Scenario s = without_gravity();
  test::add_ground(s);
  const Quat upright(Eigen::AngleAxisd(std::acos(0.0), Vec3::UnitX()));
  Shape disc;
  disc.kind = ShapeKind::cylinder;
  disc.radius = radius;
  disc.half_extents = {radius, 0, radius};
  test::add_free(s, disc, 1, {1, 2, 1}, {{0, radius, 0}, upright}, {0, 0, 0}, {0, 0, spin});
  test::collide_all(s, 0);
  State state = s.initial;
  std::vector<Motion> motions = motions_at(s, state);
  const std::vector<ContactPoint> touching = one_contact(s, motions);
  Drift drift;
  drift.set_exact(true);
  drift.remove(s, motions, touching, {1e-9, 1e-9}, 1e-9, {0, radius}, {{0, 1}}, {}, 1e-3, state);
  CHECK(state.pose[0].p[1] == Approx(radius).epsilon(1e-9));
  CHECK(state.pose[0].q.angularDistance(upright) < 1e-9);
}

// A plate that stands on its lower edge on the ground, or on a belt, leaning by 0.05 rad. Its other lower edge is
// within reach of that, too: closing both would lay it upright, by 5 cm at its top. A cube beside it drifted further.
TEST_CASE("a gap that only a turn by more than arcs can have made would close is left open, and others are closed",
          "[drift]") {
  const double thickness = 1e-4, lean = 0.05, off = 1e-6, reach = 1e-5, cube_off = 8e-6;
  const Quat tilt(Eigen::AngleAxisd(lean, Vec3::UnitX()));
  for (const bool on_belt : {false, true}) {
    INFO((on_belt ? "on a belt" : "on the ground"));
    Scenario s = without_gravity();
    const double height = 0.5 * (std::cos(lean) + thickness * std::sin(lean));
    test::add_box(s, {1, 1, thickness}, 1, {{0, height, 0}, tilt});
    test::add_box(s, {1, 1, 1}, 1e8, {{5, 0.5, 0}, Quat::Identity()});
    if (on_belt) {
      test::add_box(s, {20, 1, 20}, 1, {{0, -0.5, 0}, Quat::Identity()});
      join(s, 2, JointKind::prismatic, Vec3::UnitX());
    } else {
      test::add_ground(s);
    }
    test::collide_all(s, 0);
    const State state = s.initial;
    const std::vector<Motion> motions = motions_at(s, state);
    const auto points = [&](const std::vector<Motion>& at, int shape) {
      std::vector<ContactPoint> found;
      contact_points(s.shapes[shape], at[shape].pose, shape, s.shapes[2], at[2].pose, 2, reach, found);
      return found;
    };
    std::vector<ContactPoint> touching = points(motions, 0);
    REQUIRE(touching.size() == 4);
    for (const ContactPoint& point : points(motions, 1)) touching.push_back(point);
    for (const double lifted : {-off, off}) {
      State moved = state;
      std::vector<Motion> now = motions;
      moved.pose[0].p[1] += lifted;
      moved.pose[1].p[1] += cube_off;
      for (std::size_t i = 0; i < 2; ++i) shape_motion(s.shapes[i], moved, now[i]);
      const std::vector<char> driven(s.model.trees.size(), 1);
      Drift().close(s, now, touching, {1e-9, 1e-9, 1e-9}, 1e-9, {{0, 2}, {1, 2}}, driven, reach, moved);
      CHECK(moved.pose[0].q.angularDistance(tilt) < 10 * off);
      for (const int shape : {0, 1}) {
        double lowest = 1;
        for (const ContactPoint& point : points(now, shape)) lowest = std::min(lowest, point.gap);
        CHECK(std::abs(lowest) < 1e-10);
      }
    }
  }
}

TEST_CASE("a link that met a body askew is put back to where it touches, not to where a straight line says",
          "[drift]") {
  // The ball does not budge; the link slides along x, and their line of centres is 0.6 off it: a first correction of
  // 1e-3 leaves 0.36 / 2 of its square, 2e-7.
  Scenario s = without_gravity();
  test::add_sphere(s, 0.5, 1e12, {-0.8, -0.6, 0});
  test::add_sphere(s, 0.5, 1, {0, 0, 0});
  join(s, 1, JointKind::prismatic, Vec3::UnitX());
  test::collide_all(s, 0);
  State state = s.initial;
  std::vector<Motion> motions = motions_at(s, state);
  const std::vector<ContactPoint> touching = one_contact(s, motions);
  for (const double off : {-1e-3, 1e-3}) {
    State moved = state;
    std::vector<Motion> now = motions;
    moved.v[5] = now[0].w[2] = 40;
    moved.q[0] = off;
    forward_kinematics(s.model, s.model.trees[0], moved);
    Drift().remove(s, now, touching, {1e-9, 1e-9}, 1e-9, {0.5, 0.5}, {{0, 1}}, {0}, 1e-3, moved);
    CHECK(std::abs((moved.pose[1].p - moved.pose[0].p).norm() - 1) < 1e-9);
  }
}

TEST_CASE("a displacement turns a body's spin with it, and keeps the kinetic energy of an arm", "[overlap]") {
  Scenario s = without_gravity();
  test::add_box(s, {1, 0.2, 0.1}, 2, {{5, 0, 0}, Quat::Identity()}, {1, 2, 3}, {4, -5, 6});
  for (const double x : {0.5, 1.5}) test::add_box(s, {1, 0.1, 0.1}, 3, {{x, 0, 0}, Quat::Identity()});
  join(s, 1, JointKind::revolute, Vec3::UnitZ());
  State state = s.initial;
  state.q = {0.3, 1.1};
  state.qd = {2, -3};
  forward_kinematics(s.model, s.model.trees[0], state);
  const double before = kinetic_energy(s.model, state);
  const Vec3 spin_B = state.pose[0].q.conjugate() * Vec3(&state.v[3]);

  Eigen::VectorXd d(8);
  d << 0.1, -0.1, 0.2, 0.03, -0.02, 0.01, 0.02, 0.3;
  displace(s.model, {{0, -1}, {-1, 0}}, {0, 6, 8}, d, state);
  CHECK(kinetic_energy(s.model, state) == Approx(before).epsilon(1e-14));
  CHECK((state.pose[0].q.conjugate() * Vec3(&state.v[3]) - spin_B).norm() < 1e-14 * spin_B.norm());
  CHECK(state.q[1] == Approx(1.4).epsilon(1e-15));
  CHECK(state.qd[0] / state.qd[1] == Approx(-2.0 / 3).epsilon(1e-15));
}
