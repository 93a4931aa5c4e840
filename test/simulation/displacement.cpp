// What the poses are displaced by at the end of a step: joints keep their limits, and the kinetic energy stays.
#include "simulation/displacement.h"

#include <catch2/catch.hpp>
#include <utility>

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
  s.model.trees[0].joints[0].lower = -1;  // of its limits the second holds
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

TEST_CASE("a shape that is turned in its body turns and moves with it, one of no body stays") {
  const Quat a(Eigen::AngleAxisd(0.7, Vec3(1, 2, -1).normalized())),
      b(Eigen::AngleAxisd(-1.9, Vec3(0.3, -1, 2).normalized()));
  State state;
  state.pose = {{Vec3(9, 9, 9), Quat::Identity()}, {Vec3(1, 2, 3), a}};
  state.v = {9, 9, 9, 9, 9, 9, 4, 5, 6, 0.1, -0.2, 0.3};
  Shape shape;
  shape.body = 1;
  shape.local = {Vec3(0.5, -1, 2), b};
  Motion motion;
  shape_motion(shape, state, motion);
  const Mat3 A = a.toRotationMatrix(), B = b.toRotationMatrix();
  const Vec3 arm = A * shape.local.p, w(0.1, -0.2, 0.3);
  CHECK((motion.pose.p - (Vec3(1, 2, 3) + arm)).norm() < 1e-14);
  CHECK((motion.pose.q.toRotationMatrix() - A * B).norm() < 1e-14);
  CHECK((motion.v - (Vec3(4, 5, 6) + w.cross(arm))).norm() < 1e-14);
  CHECK(motion.w == w);
  shape.body = -1;
  Motion still;
  shape_motion(shape, state, still);
  CHECK(still.pose.p == shape.local.p);
  CHECK(still.pose.q.isApprox(b));
  CHECK(still.v.isZero(0));
}

TEST_CASE("what overlaps a link whose joint is at its limit is pushed out alone", "[overlap]") {
  const double depth = 1e-3;
  for (const double stop : {0.0, depth / 10})
    for (const bool link_first : {false, true}) {
      INFO((link_first ? "the link" : "the ball") << " is listed first");
      Scenario s = ball_and_stop(depth, stop);
      if (link_first) std::swap(s.shapes[0], s.shapes[1]);
      SimulationOptions options;
      options.step = options.duration = 1e-3;
      Simulation simulation(s, options, find_method("ap")->make({}), anitescu_potra_law());
      REQUIRE(simulation.step().status == Status::ok);
      const State& state = simulation.state();
      CHECK(state.q[0] == Approx(stop).margin(1e-9));
      CHECK(state.pose[1].p[0] - state.pose[0].p[0] == Approx(1).epsilon(1e-9));
    }
}

TEST_CASE("how far what overlaps is moved is told of a link's points, not of its joints", "[overlap]") {
  // A ball of 0.5 m at the end of an arm of 4 m is in the ground by d: it rises by d, and turns with the arm by d / 4.
  for (const double d : {1e-5, 3e-5}) {
    Scenario s = without_gravity();
    test::add_ground(s);
    test::add_sphere(s, 0.5, 2, {0, 0.5 - d, 0});
    join(s, 0, JointKind::revolute, Vec3::UnitZ());
    Joint& joint = s.model.trees[0].joints[0];
    joint.anchor_C = {-4, 0, 0};
    joint.anchor_P = s.initial.pose[0].p + joint.anchor_C;
    test::collide_all(s, 0);
    SimulationOptions options;
    options.step = options.duration = 1e-3;
    Simulation simulation(s, options, find_method("ap")->make({}), anitescu_potra_law());
    const StepRecord& record = simulation.step();
    REQUIRE(record.status == Status::ok);
    CHECK(simulation.state().q[0] == Approx(d / 4).epsilon(1e-3));
    CHECK(record.penetration_displacement == Approx(d + 0.5 * d / 4).epsilon(1e-3));
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
      Drift().close(s, now, now, touching, {1e-9, 1e-9, 1e-9}, 1e-9, {{0, 2}, {1, 2}}, driven, reach, moved);
      CHECK(moved.pose[0].q.angularDistance(tilt) < 10 * off);
      for (const int shape : {0, 1}) {
        double lowest = 1;
        for (const ContactPoint& point : points(now, shape)) lowest = std::min(lowest, point.gap);
        CHECK(std::abs(lowest) < 1e-10);
      }
    }
  }
}

// The plate as above beside a ball that is in a link, and pushes it into its stop: the try that turns the plate too far
// holds the stop, and so must the next.
TEST_CASE("a stop that holds at one try holds at the next, when points of another body have been let go", "[drift]") {
  const double thickness = 1e-4, lean = 0.05, off = 1e-6, reach = 1e-5, depth = 1e-6;
  const Quat tilt(Eigen::AngleAxisd(lean, Vec3::UnitX()));
  Scenario s = without_gravity();
  test::add_box(s, {1, 1, thickness}, 1, {{0, 0.5 * (std::cos(lean) + thickness * std::sin(lean)), 0}, tilt});
  test::add_sphere(s, 0.5, 1, {4, 5, 0});
  test::add_sphere(s, 0.5, 1, {5, 5, 0});
  join(s, 2, JointKind::prismatic, Vec3::UnitX());
  s.model.trees[0].joints[0].lower = -1;
  s.model.trees[0].joints[0].upper = 0;
  test::add_ground(s);
  test::collide_all(s, 0);
  State state = s.initial;
  std::vector<Motion> motions = motions_at(s, state);
  std::vector<ContactPoint> touching;
  contact_points(s.shapes[0], motions[0].pose, 0, s.shapes[3], motions[3].pose, 3, reach, touching);
  contact_points(s.shapes[1], motions[1].pose, 1, s.shapes[2], motions[2].pose, 2, reach, touching);
  REQUIRE(touching.size() == 5);
  state.pose[0].p[1] += off;
  state.pose[1].p[0] += depth;
  for (std::size_t i = 0; i < 2; ++i) shape_motion(s.shapes[i], state, motions[i]);
  Drift().close(s, motions, motions, touching, {1e-9, 1e-9, 1e-9, 1e-9}, 1e-9, {{0, 3}, {1, 2}}, {0}, reach, state);
  CHECK(state.pose[0].q.angularDistance(tilt) < 10 * off);
  CHECK(state.q[0] == Approx(0).margin(1e-10));
  CHECK(state.pose[2].p[0] - state.pose[1].p[0] == Approx(1).epsilon(1e-9));
}

// A cube lies on half a millimetre of another one's upper face: within the window it overlaps it beside that, too.
TEST_CASE("a gap over the edge of a face is closed along the axis along which the two are apart", "[drift]") {
  const double overhang = 5e-4, off = 5e-6, reach = 1e-3;
  Scenario s = without_gravity();
  test::add_box(s, {1, 1, 1}, 1, {{1 - overhang, 1 + off, 0}, Quat::Identity()});
  Shape fixed = s.shapes[0];
  fixed.body = -1;
  s.shapes.push_back(fixed);
  test::collide_all(s, 0);
  State state = s.initial;
  std::vector<Motion> motions = motions_at(s, state);
  std::vector<ContactPoint> touching;
  contact_points(s.shapes[0], motions[0].pose, 0, s.shapes[1], motions[1].pose, 1, 1e-9, touching, false, reach);
  REQUIRE(touching.size() == 4);
  Drift().close(s, motions, motions, touching, {1e-9, 1e-9}, 1e-9, {{0, 1}}, {}, reach, state);
  CHECK(state.pose[0].p.x() == Approx(1 - overhang).margin(1e-8));
  CHECK(state.pose[0].p.y() == Approx(1).margin(1e-8));
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
  // Unequal about two axes is enough for the spin to turn, whichever two.
  const Vec3 inertia = GENERATE(Vec3(1, 2, 3), Vec3(2, 2, 5), Vec3(5, 2, 2), Vec3(2, 5, 2));
  s.model.bodies[0].inertia = inertia;
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

TEST_CASE("a tree at rest stays at rest, whatever energy it is to have, and one that moves has that") {
  Scenario s = without_gravity();
  test::add_sphere(s, 0.5, 1, {0, 0, 0});
  join(s, 0, JointKind::prismatic, Vec3::UnitX());
  State state = s.initial;
  set_tree_energy(s.model, s.model.trees[0], 2, state);
  CHECK(state.qd[0] == 0);
  state.qd[0] = -1;
  link_twists(s.model, s.model.trees[0], state);
  set_tree_energy(s.model, s.model.trees[0], 2, state);  // m v^2 / 2
  CHECK(state.qd[0] == Approx(-2));
  CHECK(state.v[0] == Approx(-2));
}

namespace {

// Two balls of radius 0.5 m that touch along the x axis, at the start of a step of 1 ms; the second on a rail along x,
// or free. What closes of a gap that is there at the end.
struct Balls {
  Scenario s = without_gravity();
  State end;
  Vec3 v = Vec3::Zero(), w_a = Vec3::Zero(), w_b = Vec3::Zero();  // m/s of the first; rad/s of both
  std::vector<double> tolerance{1e-9, 1e-9};
  bool touched = true, exact = false;

  explicit Balls(bool rail) {
    test::add_sphere(s, 0.5, 1, {2, 0, 0});
    test::add_sphere(s, 0.5, 2, {3, 0, 0});
    if (rail) join(s, 1, JointKind::prismatic, Vec3::UnitX());
    test::collide_all(s, 0);
    end = s.initial;
  }
  /// m: the gap that is left of one.
  double left_of(double gap) const {
    State state = end;
    Eigen::Map<Vec3>(state.v.data()) = v;
    Eigen::Map<Vec3>(&state.v[3]) = w_a;
    Eigen::Map<Vec3>(&state.v[9]) = w_b;
    State start = state;
    start.pose = s.initial.pose;
    std::vector<Motion> motions = motions_at(s, start);
    const std::vector<ContactPoint> touching = touched ? one_contact(s, motions) : std::vector<ContactPoint>();
    state.pose[0].p = state.pose[1].p - Vec3(1 + gap, 0, 0);
    Drift drift;
    drift.set_exact(exact);
    drift.remove(s, motions, touching, tolerance, 1e-9, {0.7, 2}, {{0, 1}}, {0}, 1e-3, state);
    for (std::size_t i = 0; i < 2; ++i) CHECK(motions[i].pose.p == state.pose[i].p);
    return state.pose[1].p[0] - state.pose[0].p[0] - 1;
  }
  void closes_up_to(double reach) const {
    const double rest = 0.1 * std::min(tolerance[0], tolerance[1]);
    for (const double sign : {-1.0, 1.0}) {
      CHECK(std::abs(left_of(sign * 0.98 * reach)) <= rest);
      CHECK(left_of(sign * 1.02 * reach) == Approx(sign * 1.02 * reach).epsilon(1e-9));
    }
  }
};

}  // namespace

TEST_CASE("what turning and slipping can have opened in a step is closed, and no more", "[drift]") {
  Balls balls(false);
  // Of each, its spin times 3/2 of its reach times that and the slip: 30 (1.5 30 0.7 + 4) + 20 (1.5 20 2 + 4) m/s^2.
  balls.w_a = {30, 0, 0};
  balls.w_b = {-20, 0, 0};
  balls.v = {0, 4, 0};
  balls.closes_up_to(2345e-6);
  balls.v = {0, 0, 0};
  balls.closes_up_to(2145e-6);
  // What parts by more than that as steady motion goes is not held; what comes together is.
  balls.v = {-2.4, 0, 0};
  CHECK(balls.left_of(1e-3) == Approx(1e-3));
  balls.v = {2.4, 0, 0};
  CHECK(std::abs(balls.left_of(1e-3)) < 1e-9);
}

TEST_CASE("what a link's arc has left of steady motion is closed, its turn by its radius", "[drift]") {
  Balls balls(true);
  balls.end.q[0] = 5e-5;
  forward_kinematics(balls.s.model, balls.s.model.trees[0], balls.end);
  balls.closes_up_to(5e-5);
  balls.end.pose[1].q = Quat(Eigen::AngleAxisd(4e-5, Vec3::UnitX()));  // times 0.5 m
  balls.closes_up_to(7e-5);
  // Besides what a spin can open, 30 1.5 30 0.7 m/s^2, and the tolerance.
  balls.w_a = {30, 0, 0};
  balls.closes_up_to(945e-6 + 7e-5);
  balls.tolerance = {2e-4, 2e-4};
  balls.closes_up_to(945e-6 + 7e-5 + 2e-4);
}

TEST_CASE("a gap counts as closed by the smaller tolerance of a pair", "[drift]") {
  for (const bool first_is_larger : {false, true}) {
    Balls balls(false);
    balls.tolerance = first_is_larger ? std::vector{6e-4, 2e-4} : std::vector{2e-4, 6e-4};
    balls.closes_up_to(2e-4);
    // A tenth is good, unless all but rounding is to go.
    for (const double gap : {-1.9e-5, 1.9e-5}) {
      balls.exact = false;
      CHECK(balls.left_of(gap) == Approx(gap));
      CHECK(std::abs(balls.left_of(2 * gap)) < 1e-9);
      balls.exact = true;
      CHECK(std::abs(balls.left_of(gap)) < 1e-9);
    }
  }
}

TEST_CASE("of a pair that did not touch only what overlaps is taken away, as far as arcs reach", "[drift]") {
  Balls balls(false);
  balls.touched = false;
  balls.w_a = {30, 0, 0};  // 30 1.5 30 0.7 m/s^2
  const double reach = 945e-6;
  for (const double gap : {-1.02 * reach, 0.5 * reach, 1.02 * reach}) CHECK(balls.left_of(gap) == Approx(gap));
  CHECK(std::abs(balls.left_of(-0.98 * reach)) < 1e-9);
  balls.tolerance = {2e-4, 2e-4};  // within which it touches
  for (const double gap : {-1.9e-4, 1.9e-4}) CHECK(balls.left_of(gap) == Approx(gap));
  CHECK(std::abs(balls.left_of(-2.1e-4)) <= 2e-5);
}

TEST_CASE("gaps are closed of the pairs that touched alone, each as deep as asked for", "[drift]") {
  // Three balls in a row, off by 1, 2 and 3 micrometres from the ground; the middle one did not touch it.
  Scenario s = without_gravity();
  for (const double x : {0.0, 2.0, 4.0}) test::add_sphere(s, 0.5, 1, {x, 0.5 + 1e-6 * (1 + x / 2), 0});
  test::add_ground(s);
  test::collide_all(s, 0);
  const std::vector<Motion> motions = motions_at(s, s.initial);
  std::vector<ContactPoint> touching;
  for (const int ball : {2, 0})
    contact_points(s.shapes[ball], motions[ball].pose, ball, s.shapes[3], motions[3].pose, 3, 1e-5, touching);
  REQUIRE(touching.size() == 2);
  for (const double reach : {5e-6, 2e-6}) {
    State state = s.initial;
    std::vector<Motion> now = motions;
    Drift().close(s, now, now, touching, {1e-9, 1e-9, 1e-9, 1e-9}, 1e-9, {{0, 3}, {1, 3}, {2, 3}}, {}, reach, state);
    CHECK(state.pose[0].p[1] == Approx(0.5).margin(1e-10));
    CHECK(state.pose[1].p[1] == 0.5 + 1e-6 * 2);
    CHECK(state.pose[2].p[1] == Approx(reach > 3e-6 ? 0.5 : 0.5 + 3e-6).margin(1e-10));
  }
  // No point is looked for beyond what is asked for, or else the smaller tolerance.
  State state = s.initial;
  std::vector<Motion> now = motions;
  const std::vector<double> wide{2.5e-6, 2.5e-6, 2.5e-6, 9e-6};
  Drift().close(s, now, now, touching, wide, 1e-9, {{0, 3}, {1, 3}, {2, 3}}, {}, 1e-7, state);
  CHECK(state.pose[0].p[1] == Approx(0.5).margin(1e-10));
  CHECK(state.pose[2].p[1] == 0.5 + 1e-6 * 3);
  // What touched and is not among the pairs that can meet stays as it is, and so does what comes next among these.
  state = s.initial;
  now = motions;
  Drift().close(s, now, now, touching, {1e-9, 1e-9, 1e-9, 1e-9}, 1e-9, {{1, 3}, {2, 3}}, {}, 5e-6, state);
  CHECK(state.pose[0].p[1] == 0.5 + 1e-6);
  CHECK(state.pose[1].p[1] == 0.5 + 1e-6 * 2);
  CHECK(state.pose[2].p[1] == Approx(0.5).margin(1e-10));
}

TEST_CASE("gaps of heavy bodies are closed beside light ones, too", "[drift]") {
  // A ball of 1000 kg and one of 1e-9 kg, a micrometre off the ground each, in either order.
  for (const bool heavy_first : {true, false}) {
    Scenario s = without_gravity();
    for (const bool first : {true, false})
      test::add_sphere(s, 0.5, first == heavy_first ? 1000 : 1e-9, {first ? 0.0 : 2.0, 0.5 + 1e-6, 0});
    test::add_ground(s);
    test::collide_all(s, 0);
    std::vector<Motion> motions = motions_at(s, s.initial);
    std::vector<ContactPoint> touching;
    for (const int ball : {0, 1})
      contact_points(s.shapes[ball], motions[ball].pose, ball, s.shapes[2], motions[2].pose, 2, 1e-5, touching);
    REQUIRE(touching.size() == 2);
    State state = s.initial;
    Drift().close(s, motions, motions, touching, {1e-9, 1e-9, 1e-9}, 1e-9, {{0, 2}, {1, 2}}, {}, 5e-6, state);
    for (const int ball : {0, 1}) CHECK(std::abs(state.pose[ball].p[1] - 0.5) < 1e-10);
  }
}
