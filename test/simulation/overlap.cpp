#include "simulation/overlap.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "scenario/scenario.h"
#include "scenes.h"
#include "simulation/left_out.h"
#include "simulation/simulation.h"

using namespace cb;

namespace {

// How far apart two boxes are, by the 15 axes; shares no code with lib/geometry.
double box_gap(const Vec3& h_a, const Pose& a, const Vec3& h_b, const Pose& b) {
  const auto axis = [](const Pose& pose, int i) -> Vec3 { return pose.q.normalized() * Vec3::Unit(i); };
  double best = -HUGE_VAL;
  const auto look = [&](const Vec3& along) {
    if (along.norm() < 1e-6) return;
    const Vec3 n = along.normalized();
    double reach = 0;
    for (int i = 0; i < 3; ++i) reach += h_a[i] * std::abs(n.dot(axis(a, i))) + h_b[i] * std::abs(n.dot(axis(b, i)));
    best = std::max(best, std::abs(n.dot(b.p - a.p)) - reach);
  };
  for (int i = 0; i < 3; ++i) {
    look(axis(a, i));
    look(axis(b, i));
    for (int j = 0; j < 3; ++j) look(axis(a, i).cross(axis(b, j)));
  }
  return best;
}

double sphere_gap(const Vec3& centre, double radius, const Shape& b, const Pose& pose) {
  if (b.kind == ShapeKind::sphere) return (centre - pose.p).norm() - radius - b.radius;
  const Vec3 beyond = (pose.q.conjugate() * (centre - pose.p)).cwiseAbs() - b.half_extents;
  return beyond.cwiseMax(0).norm() + std::min(0.0, beyond.maxCoeff()) - radius;
}

// Signed distance of two shapes, none a cylinder but on a plane; of two cylinders the library's own.
double gap(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b) {
  if (a.kind == ShapeKind::cylinder && b.kind == ShapeKind::cylinder) return separation(a, pose_a, b, pose_b);
  if (a.kind == ShapeKind::half_space) return gap(b, pose_b, a, pose_a);
  if (b.kind == ShapeKind::half_space) {
    const Vec3 n = pose_b.q * Vec3::UnitY(), n_A = (pose_a.q.conjugate() * n).cwiseAbs();
    const double centre = n.dot(pose_a.p - pose_b.p);
    if (a.kind == ShapeKind::sphere) return centre - a.radius;
    if (a.kind == ShapeKind::box) return centre - n_A.dot(a.half_extents);
    return centre - a.half_extents.y() * n_A.y() - a.radius * std::hypot(n_A.x(), n_A.z());
  }
  if (a.kind == ShapeKind::sphere) return sphere_gap(pose_a.p, a.radius, b, pose_b);
  if (b.kind == ShapeKind::sphere) return sphere_gap(pose_b.p, b.radius, a, pose_a);
  return box_gap(a.half_extents, pose_a, b.half_extents, pose_b);
}

struct Seen {
  Status status = Status::ok;
  std::string reason;
  double deepest = 0;       // over the body's size, at the ends of the steps
  double inside = 0;        // m, within a step
  double displacement = 0;  // m
  State state;
};

Seen look(const Scenario& s, const std::string& name = "ap", double step = 0) {
  SimulationOptions options;
  options.step = step > 0 ? step : s.step;
  options.duration = s.duration;
  PrunedRun run(s, options, *find_method(name), {}, true);
  Seen seen;
  const auto pose = [&](const Shape& shape) {
    if (shape.body < 0) return shape.local;
    const Pose& body = run.simulation.state().pose[static_cast<std::size_t>(shape.body)];
    return Pose{body * shape.local.p, body.q * shape.local.q};
  };
  for (long i = 0; i < run.simulation.steps_total() && seen.status == Status::ok; ++i) {
    const StepRecord& record = run.simulation.step();
    seen.status = record.status;
    seen.inside = std::max(seen.inside, record.penetration_inside);
    seen.displacement = std::max(seen.displacement, record.penetration_displacement);
    if (seen.status != Status::ok) break;
    for (std::size_t j = 1; j < s.shapes.size(); ++j)
      for (std::size_t k = 0; k < j; ++k) {
        const Shape &a = s.shapes[j], &b = s.shapes[k];
        if ((a.body < 0 && b.body < 0) || s.pairs.find(static_cast<int>(k), static_cast<int>(j)) == nullptr) continue;
        seen.deepest = std::max(seen.deepest, -gap(a, pose(a), b, pose(b)) / std::min(a.size(), b.size()));
      }
  }
  seen.reason = run.simulation.reason();
  seen.state = run.simulation.state();
  return seen;
}

Quat turn(double angle, const Vec3& axis) { return Quat(Eigen::AngleAxisd(angle, axis.normalized())); }

void fix_box(Scenario& s, const Vec3& size, const Pose& pose) {
  Shape shape;
  shape.kind = ShapeKind::box;
  shape.half_extents = size / 2;
  shape.local = pose;
  shape.name = "fixed";
  s.shapes.push_back(shape);
}

Scenario without_gravity() {
  Scenario s = test::empty_scene(1e-3, 1e-3);
  s.gravity.constant.setZero();
  return s;
}

}  // namespace

TEST_CASE("two bodies that overlap part in the ratio of their masses, as least displacement says", "[overlap]") {
  Scenario s = without_gravity();
  test::add_sphere(s, 0.5, 1, {0, 0, 0});
  test::add_sphere(s, 0.5, 3, {0.999, 0, 0});
  test::collide_all(s, 0);
  const Seen seen = look(s);
  REQUIRE(seen.status == Status::ok);
  CHECK(seen.state.pose[0].p[0] == Approx(-0.75e-3).epsilon(1e-6));
  CHECK(seen.state.pose[1].p[0] == Approx(0.999 + 0.25e-3).epsilon(1e-6));
  CHECK(seen.inside == Approx(1e-3).epsilon(1e-9));
  CHECK(seen.displacement == Approx(0.75e-3).epsilon(1e-6));
  for (const double v : seen.state.v) CHECK(v == 0);
}

TEST_CASE("a body is moved and turned by the least that parts it, and as far as its furthest point is told",
          "[overlap]") {
  // A ball 1 m off its body's centre is in the ground by d. Per N s of displacement it opens by 1/m + 1/I = 1/2 + 1/3:
  // the body rises by 3/5 d and turns by 2/5 d; the far side of the ball is 1.5 m off.
  for (const double d : {1e-5, 3e-5}) {
    Scenario s = without_gravity();
    test::add_ground(s);
    const int ball = test::add_sphere(s, 0.5, 2, {0, 0.5 - d, 0});
    Shape& shape = s.shapes[1];
    shape.local.p = Vec3(1, 0, 0);
    s.model.bodies[static_cast<std::size_t>(ball)].inertia = Vec3(5, 7, 3);
    test::collide_all(s, 0);
    const Seen seen = look(s);
    REQUIRE(seen.status == Status::ok);
    CHECK(seen.inside == Approx(d).epsilon(1e-6));
    CHECK(seen.displacement == Approx((0.6 + 1.5 * 0.4) * d).epsilon(1e-3));
    CHECK(seen.state.pose[0].p[1] - (0.5 - d) == Approx(0.6 * d).epsilon(1e-3));
    CHECK(2 * seen.state.pose[0].q.z() == Approx(0.4 * d).epsilon(1e-3));
  }
}

TEST_CASE("a body that is pushed out pushes on what it touches, and opens no gap there", "[overlap]") {
  // Spheres in a row that touch; the first overlaps the second by d. Least displacement of four equal masses, the last
  // three moving as one: 3/4 d and 1/4 d.
  Scenario s = without_gravity();
  const double d = 1e-4;
  test::add_sphere(s, 0.5, 1, {d, 0, 0});
  for (int i = 1; i < 4; ++i) test::add_sphere(s, 0.5, 1, {static_cast<double>(i), 0, 0});
  test::collide_all(s, 0);
  const Seen seen = look(s);
  REQUIRE(seen.status == Status::ok);
  CHECK(seen.state.pose[0].p[0] == Approx(d - 0.75 * d).epsilon(1e-5));
  for (int i = 1; i < 4; ++i)
    CHECK(seen.state.pose[static_cast<std::size_t>(i)].p[0] - i == Approx(d / 4).epsilon(1e-4));
}

TEST_CASE("a long row of bodies, each in the next, spreads evenly about its middle", "[overlap]") {
  // Equal masses that overlap by d each: least displacement keeps the centre of mass and moves body i by
  // d (i - (n - 1) / 2). Too many points for one dense factor (simulation/least_displacement.h).
  constexpr int n = 401;
  constexpr double d = 1e-5;
  Scenario s = without_gravity();
  for (int i = 0; i < n; ++i) test::add_sphere(s, 0.5, 1, {i * (1 - d), 0, 0});
  test::collide_all(s, 0);
  const Seen seen = look(s);
  REQUIRE(seen.status == Status::ok);
  CHECK(seen.deepest <= 1e-9);
  for (int i = 0; i < n; ++i) {
    const double moved = seen.state.pose[static_cast<std::size_t>(i)].p[0] - i * (1 - d);
    CHECK(moved == Approx(d * (i - (n - 1) / 2.0)).epsilon(1e-4).margin(1e-9));
  }
  CHECK(seen.displacement == Approx(d * (n - 1) / 2).epsilon(1e-4));
}

TEST_CASE("a body wedged between walls ends the run as penetration, and the reason names the two", "[overlap]") {
  Scenario s = without_gravity();
  test::add_sphere(s, 0.5, 1, {0, 0, 0});
  fix_box(s, {1, 1, 1}, {{0.999, 0, 0}, Quat::Identity()});
  fix_box(s, {1, 1, 1}, {{-0.999, 0, 0}, Quat::Identity()});
  test::collide_all(s, 0);
  const Seen seen = look(s);
  CHECK(seen.status == Status::penetration);
  CHECK(seen.reason.find("body0") != std::string::npos);
}

TEST_CASE("what cannot be taken away ends the run from a millionth of the smaller body's size on", "[overlap]") {
  for (const double overlap : {0.5e-6, 2e-6}) {
    Scenario s = without_gravity();
    test::add_sphere(s, 0.5, 1, {0, 0, 0});
    for (const double side : {-1.0, 1.0}) fix_box(s, {1, 1, 1}, {{side * (1 - overlap), 0, 0}, Quat::Identity()});
    test::collide_all(s, 0);
    INFO(overlap << " m");
    CHECK((look(s).status == Status::penetration) == (overlap > 1e-6));
  }
}

TEST_CASE("each pair that stays wedged in is held to its own size, and its own depth is what is told", "[overlap]") {
  // Beside it a ball a hundred times as large is wedged in by 5e-5 m, half of what it may be.
  for (const double overlap : {0.9e-6, 2e-6}) {
    Scenario s = without_gravity();
    test::add_sphere(s, 0.5, 1, {0, 0, 0});
    test::add_sphere(s, 50, 1, {0, 1000, 0});
    for (const double side : {-1.0, 1.0}) {
      fix_box(s, {1, 1, 1}, {{side * (1 - overlap), 0, 0}, Quat::Identity()});
      fix_box(s, {100, 100, 100}, {{side * (100 - 5e-5), 1000, 0}, Quat::Identity()});
    }
    test::collide_all(s, 0);
    const Seen seen = look(s);
    INFO(overlap << " m: " << seen.reason);
    CHECK(seen.inside == Approx(5e-5).epsilon(1e-4));
    CHECK((seen.status == Status::penetration) == (overlap > 1e-6));
    CHECK((seen.reason.find("body0 and fixed interpenetrate by 2e-06 m") == 0) == (overlap > 1e-6));
  }
}

TEST_CASE("a box that slides and tips over the rim of another never overlaps it at the end of a step", "[overlap]") {
  for (const double angle : {0.0, 0.3, M_PI / 4}) {
    INFO(angle);
    Scenario s = test::empty_scene(1e-3, 0.6);
    test::add_ground(s);
    fix_box(s, {1, 0.4, 1}, {{0, 0.2, 0}, turn(0.2, {0, 1, 0})});
    test::add_box(s, {0.3, 0.2, 0.25}, 1, {{0.3, 0.5, 0}, turn(angle, {0, 1, 0})}, {1.5, 0, 0.2}, {0, 2, -3});
    test::collide_all(s, 0.2);
    const Seen seen = look(s);
    CHECK(seen.status == Status::ok);
    CHECK(seen.deepest < 1e-8);
  }
}

TEST_CASE("crossed edges that slide over each other stay apart", "[overlap]") {
  for (const double tilt : {0.1, 0.4, 0.7}) {
    INFO(tilt);
    Scenario s = test::empty_scene(1e-3, 0.5);
    fix_box(s, {2, 0.3, 0.3}, {{0, 0, 0}, turn(M_PI / 4, {1, 0, 0})});
    fix_box(s, {2, 0.3, 0.3}, {{0, 0, 0.8}, turn(M_PI / 4, {1, 0, 0})});
    test::add_box(s, {0.2, 0.2, 1.2}, 1, {{0, 0.45, 0.4}, turn(tilt, {0.2, 0.3, 1})}, {1, 0, 0.5}, {4, 1, 6});
    test::collide_all(s, 0.3);
    const Seen seen = look(s);
    CHECK(seen.status == Status::ok);
    CHECK(seen.deepest < 1e-8);
  }
}

TEST_CASE("a cylinder that wobbles on its rim sinks in within a step by its square alone", "[overlap]") {
  double inside[2];
  for (int i = 0; i < 2; ++i) {
    Scenario s = test::empty_scene(1e-3, 0.5);
    test::add_ground(s);
    Shape cylinder;
    cylinder.kind = ShapeKind::cylinder;
    cylinder.radius = 0.1;
    cylinder.half_extents = {0.1, 0.1, 0.1};
    test::add_free(s, cylinder, 1, {5.83e-3, 5e-3, 5.83e-3}, {{0, 0.14, 0}, turn(0.35, {1, 0, 0.3})}, Vec3::Zero(),
                   {0, 12, 3});
    test::collide_all(s, 0.5);
    const Seen seen = look(s, "ap", i == 0 ? 1e-3 : 2.5e-4);
    CHECK(seen.status == Status::ok);
    CHECK(seen.deepest < 1e-8);
    inside[i] = seen.inside;
  }
  CHECK(inside[0] > 0);
  CHECK(inside[0] / inside[1] > 8);
}

// Its lowest point runs around the rim at the least turn: one point at a time would be followed for ever.
TEST_CASE("a light cylinder under heavy ones that tilt is not left within the ground", "[overlap]") {
  Scenario s = test::empty_scene(1e-3, 0.05);
  test::add_ground(s);
  const auto stand = [&](double radius, double height, double mass, double y, const Vec3& v, double spin) {
    Shape cylinder;
    cylinder.kind = ShapeKind::cylinder;
    cylinder.radius = radius;
    cylinder.half_extents = {radius, height / 2, radius};
    const double across = mass * (3 * radius * radius + height * height) / 12;
    test::add_free(s, cylinder, mass, {across, mass * radius * radius / 2, across}, {{0, y, 0}, Quat::Identity()}, v,
                   {0, spin, 0});
  };
  stand(0.2, 0.2, 0.001, 0.1, Vec3::Zero(), 0);
  stand(0.25, 0.1, 5, 0.25, {3, 0, -2}, 8);
  stand(0.3, 0.2, 200, 0.4, Vec3::Zero(), 0);
  test::collide_all(s, 0.3, 0.5);
  for (const char* method : {"ap", "convex"}) {
    const Seen seen = look(s, method);
    INFO(method << ": " << seen.reason);
    CHECK(seen.status == Status::ok);
    CHECK(seen.deepest < 1e-8);
    CHECK(seen.displacement > 0);
  }
}

TEST_CASE("in piles of boxes and spheres thrown into a bin nothing overlaps at the end of a step", "[overlap]") {
  for (const char* file : {"pen_r26", "pen_r62", "pen_r87", "pen_r91", "tame_r5"}) {
    INFO(file);
    Scenario s = load_scenario(std::string(SOURCE_ROOT "/test/data/scenes/") + file + ".xml", {});
    s.duration = 0.15;
    const Seen seen = look(s);
    CHECK(seen.status == Status::ok);
    CHECK(seen.deepest < 1e-8);
  }
}

// Its face would turn into the ball by (R + h / 2)(1 - cos w dt), a tenth of a metre by the end of the step.
TEST_CASE("a box that whirls on a ball is met again before it has turned into it", "[overlap]") {
  for (const char* name : {"ap", "convex", "newton"})
    for (const double radius : {0.22, 20.0})
      for (const double spin : {100.0, 800.0, 3000.0}) {
        INFO(name << " on a ball of " << radius << " m, " << spin << " rad/s");
        Scenario s = without_gravity();
        test::add_sphere(s, radius, 30, {0, 0, 0});
        test::add_box(s, {0.3, 0.3, 0.3}, 0.01, {{0, radius + 0.15, 0}, Quat::Identity()}, Vec3::Zero(), {0, 0, spin});
        test::collide_all(s, 0.3);
        const Seen seen = look(s, name);
        CHECK(seen.status == Status::ok);
        CHECK(seen.inside < 2e-3 * 0.3);
        CHECK(seen.deepest < 1e-8);
      }
}

// What a move may turn a body into another is a thousandth of its size, to first order (longest_move).
TEST_CASE("boxes that whirl about the corner on which they stand turn in by a few thousandths at most", "[overlap]") {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto draw = [&] { return Vec3(uniform(random), uniform(random), uniform(random)); };
  double worst = 0;
  for (int k = 0; k < 3000; ++k) {
    Scenario s = without_gravity();
    if (k % 3 == 0)
      test::add_ground(s);
    else if (k % 3 == 1)
      fix_box(s, {0.4, 1, 0.4}, {{0, -0.5, 0}, Quat::Identity()});
    else
      test::add_box(s, {0.3, 0.3, 0.3}, 1, {{0, -0.15, 0}, Quat::Identity()});
    const Quat q = turn(3 * uniform(random), draw());
    const Vec3 half = 0.15 * (Vec3(1.1, 1, 1.1) + Vec3(1, 0, 1).cwiseProduct(draw()));
    Vec3 corner = Vec3::Zero();  // the lowest, from the centre
    for (int i = 0; i < 8; ++i) {
      const Vec3 c = q * Vec3(i & 1 ? half[0] : -half[0], i & 2 ? half[1] : -half[1], i & 4 ? half[2] : -half[2]);
      if (c[1] < corner[1]) corner = c;
    }
    const Vec3 w = std::pow(10, 1.5 + 2 * std::abs(uniform(random))) * draw().cwiseProduct(Vec3(1, 0.3, 1));
    const Vec3 at = 0.1 * draw().cwiseProduct(Vec3(1, 0, 1));
    test::add_box(s, 2 * half, 1, {at - corner, q}, corner.cross(w), w);  // the corner stands
    test::collide_all(s, 0.5);
    const Seen seen = look(s, "newton");
    CHECK(seen.status == Status::ok);
    worst = std::max(worst, seen.inside / 0.3);
  }
  CHECK(worst < 5e-3);
  CHECK(worst > 1e-4);  // they do meet
}

TEST_CASE("a body that turns too fast for its times of contact ends the run as a stall, with the reason", "[overlap]") {
  const Scenario s = load_scenario(SOURCE_ROOT "/test/data/scenes/hang_spin_1e8.xml", {});
  const Seen seen = look(s);
  CHECK(seen.status == Status::event_stall);
  CHECK(seen.reason.find("come together more than 1000 times") != std::string::npos);
}

// It goes along a ridge to where that ends in a peak, and is in the prisms beside it by what it sinks in on the way.
TEST_CASE("a box that slides over the ridges of a rough ground is not met again by what carries nothing of it") {
  for (const char* file : {"rough_ridge", "rough_peak"}) {
    INFO(file);
    const Seen seen = look(load_scenario(std::string(SOURCE_ROOT "/test/data/scenes/") + file + ".xml", {}), "convex");
    CHECK(seen.status == Status::ok);
    CHECK(seen.inside < 1e-3);
  }
}
