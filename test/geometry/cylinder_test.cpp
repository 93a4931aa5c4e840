#include <catch2/catch.hpp>

#include "geometry/broad_phase.h"
#include "geometry/placed_shapes.h"

using namespace cb;
using namespace cb::test;

namespace {

constexpr double tol = 1e-9;

Motion moving(const Pose& pose, const Vec3& v = Vec3::Zero(), const Vec3& w = Vec3::Zero()) { return {pose, v, w}; }

// A wheel: the cylinder's y axis turned to the world's x axis.
Quat upright() { return turn(-pi / 2, Vec3(0, 0, 1)); }

// Heights over the plane y = 0 of the lowest and the highest point of an end's rim, by sampling it.
std::pair<double, double> rim_heights(const Shape& shape, const Pose& pose, int end) {
  constexpr int samples = 3600;
  double low = 1e9, high = -1e9;
  for (int k = 0; k < samples; ++k) {
    const double angle = 2 * pi * k / samples;
    const Vec3 x(shape.radius * std::cos(angle), end * shape.half_extents.y(), shape.radius * std::sin(angle));
    low = std::min(low, (pose * x).y());
    high = std::max(high, (pose * x).y());
  }
  return {low, high};
}
// A chord of the sampled rim is so far within the circle, m.
double sampling_error(const Shape& shape) { return shape.radius * 4e-7; }

}  // namespace

TEST_CASE("An upright disc touches the ground with its lowest point, wherever it has rolled to") {
  for (const double rolled : {0.0, 0.3, 2.0, -7.0}) {
    const Quat q = turn(rolled, Vec3(1, 0, 0)) * upright();
    const auto found = points(cylinder(0.0825, 0), at(Vec3(2, 0.0825, -1), q), half_space(), at(0, 0, 0));
    REQUIRE(found.size() == 1);
    CHECK((found[0].position - Vec3(2, 0, -1)).norm() < 1e-16);
    CHECK(found[0].normal == Vec3(0, 1, 0));
    CHECK(std::abs(found[0].gap) < 1e-16);
  }
}

TEST_CASE("A cylinder on its side touches with the two ends of its line, a tilted one with the lower end's point") {
  auto found = points(cylinder(0.5, 2), at(Vec3(0, 0.5, 3), upright()), half_space(), at(0, 0, 0));
  REQUIRE(found.size() == 2);
  CHECK((found[0].position - Vec3(-1, 0, 3)).norm() < 1e-15);
  CHECK((found[1].position - Vec3(1, 0, 3)).norm() < 1e-15);
  // Axis 30 degrees over the ground: the centre is at sin 30 l + cos 30 r over the lowest point, which is
  // cos 30 l - sin 30 r back along the axis.
  const Quat tilted = turn(pi / 6, Vec3(0, 0, 1)) * upright();
  const double height = 0.5 + std::cos(pi / 6) * 0.5;
  found = points(cylinder(0.5, 2), at(Vec3(0, height, 0), tilted), half_space(), at(0, 0, 0));
  REQUIRE(found.size() == 1);
  CHECK((found[0].position - Vec3(-std::cos(pi / 6) + 0.25, 0, 0)).norm() < 1e-15);
}

TEST_CASE("A standing cylinder touches with four points of its rim that stay with it") {
  for (const double turned : {0.0, 0.4, 3.0}) {
    const Quat q = turn(turned, Vec3(0, 1, 0));
    const auto found = points(cylinder(0.5, 2), at(Vec3(1, 1, 0), q), half_space(), at(0, 0, 0));
    REQUIRE(found.size() == 4);
    const Vec3 rim[] = {{0.5, -1, 0}, {0, -1, 0.5}, {-0.5, -1, 0}, {0, -1, -0.5}};
    for (int k = 0; k < 4; ++k) {
      CHECK((found[k].position - (Vec3(1, 1, 0) + q * rim[k])).norm() < 1e-15);
      CHECK(std::abs(found[k].gap) < 1e-15);
    }
  }
  // A disc flat on the ground, either way up, has the same four.
  CHECK(points(cylinder(0.5, 0), at(0, 0, 0), half_space(), at(0, 0, 0)).size() == 4);
  CHECK(points(cylinder(0.5, 0), at(Vec3(0, 0, 0), turn(pi, Vec3(0, 0, 1))), half_space(), at(0, 0, 0)).size() == 4);
}

TEST_CASE("A cylinder's contact points are the lowest of all points of its rims") {
  Random random(61);
  int touching = 0;
  for (int k = 0; k < 300; ++k) {
    const Shape shape = cylinder(random.in(0.2, 2), k % 3 ? random.in(0.1, 3) : 0);
    Pose pose = at(random.vector(1), random.rotation());
    const double low = std::min(rim_heights(shape, pose, -1).first, rim_heights(shape, pose, 1).first);
    CHECK(separation(shape, pose, half_space(), at(0, 0, 0)) == Approx(low).margin(sampling_error(shape)));
    pose.p.y() -= separation(shape, pose, half_space(), at(0, 0, 0)) + 1e-12;
    const auto found = points(shape, pose, half_space(), at(0, 0, 0));
    REQUIRE(found.size() == 1);
    ++touching;
    CHECK(found[0].gap == Approx(-1e-12).margin(1e-15));
    const Vec3 local = pose.q.conjugate() * (found[0].position - pose.p);
    CHECK(std::hypot(local.x(), local.z()) == Approx(shape.radius).epsilon(1e-11));
    CHECK(std::abs(local.y()) == Approx(shape.half_extents.y()).margin(1e-11));
    CHECK(std::abs(found[0].position.y()) < 1e-12);
  }
  CHECK(touching == 300);
}

TEST_CASE("A sphere touches a cylinder on its side, its end or its rim, whichever is nearest") {
  const Shape can = cylinder(1, 2);
  auto found = points(sphere(0.5), at(1.5, 0.25, 0), can, at(0, 0, 0));
  REQUIRE(found.size() == 1);
  CHECK(found[0].position == Vec3(1, 0.25, 0));
  CHECK(found[0].normal == Vec3(1, 0, 0));
  found = points(sphere(0.5), at(0.2, -1.5, 0.3), can, at(0, 0, 0));
  REQUIRE(found.size() == 1);
  CHECK((found[0].position - Vec3(0.2, -1, 0.3)).norm() < 1e-15);
  CHECK(found[0].normal == Vec3(0, -1, 0));
  // Rim point (0.6, 1, 0.8), the sphere's centre (3, 4, 0) / 10 beyond it in the plane of axis and radius.
  found = points(sphere(0.5), at(0.6 * 1.3, 1.4, 0.8 * 1.3), can, at(0, 0, 0));
  REQUIRE(found.size() == 1);
  CHECK((found[0].position - Vec3(0.6, 1, 0.8)).norm() < 1e-15);
  CHECK((found[0].normal - Vec3(0.36, 0.8, 0.48)).norm() < 1e-15);
  // Within it: out through the nearer of side and end.
  CHECK(separation(sphere(0.1), at(0.2, 0.9, 0), can, at(0, 0, 0)) == Approx(-0.2));
  CHECK(separation(can, at(0, 0, 0), sphere(0.1), at(0.8, 0.1, 0)) == Approx(-0.3));
}

TEST_CASE("A sphere's distance from a cylinder is that from the nearest of many points of the cylinder") {
  Random random(62);
  for (int k = 0; k < 200; ++k) {
    const Shape can = cylinder(random.in(0.2, 2), random.in(0, 3));
    const Pose pose = random.pose(1);
    const Vec3 centre = pose.p + 3 * random.rotation()._transformVector(Vec3(1, 1, 1));
    double nearest = 1e9;
    for (int angle = 0; angle < 400; ++angle)
      for (int j = 0; j <= 40; ++j)
        for (const double across : {0.0, 0.25, 0.5, 0.75, 1.0}) {
          const double turned = 2 * pi * angle / 400, y = (j / 20.0 - 1) * can.half_extents.y();
          const Vec3 x(across * can.radius * std::cos(turned), y, across * can.radius * std::sin(turned));
          nearest = std::min(nearest, (pose * x - centre).norm());
        }
    const double gap = separation(sphere(0.1), at(centre), can, pose) + 0.1;
    CHECK(gap <= nearest + 1e-14);
    CHECK(gap >= nearest - 0.25);
  }
}

TEST_CASE("A wheel that drops lands when free of tilt as its centre's height says") {
  const Motion ground = moving(at(0, 0, 0));
  const Motion wheel = moving(at(Vec3(0, 0.5825, 0), upright()), Vec3(0, -2, 0), Vec3(30, 0, 0));
  const double t = time_of_contact(cylinder(0.0825, 0), wheel, half_space(), ground, tol, 1);
  CHECK(t == Approx(0.25).margin(1e-9));
  CHECK(points(cylinder(0.0825, 0), advance(wheel, t), half_space(), ground.pose, tol).size() == 1);
}

TEST_CASE("A rolling and turning wheel that touches costs no small steps") {
  const Motion rolling = moving(at(Vec3(0, 0.0825, 0), upright()), Vec3(0, 0, -0.5), Vec3(-0.5 / 0.0825, 0.3, 0));
  CHECK(time_of_contact(cylinder(0.0825, 0), rolling, half_space(), moving(at(0, 0, 0)), 1e-10, 1e-3) == 1e-3);
  // A hair above the tolerance, no nearer at the end.
  Motion hovering = rolling;
  hovering.pose.p.y() += 1.01e-10;
  CHECK(time_of_contact(cylinder(0.0825, 0), hovering, half_space(), moving(at(0, 0, 0)), 1e-10, 1e-3) == 1e-3);
}

TEST_CASE("A cylinder that tips back onto its end finds when it stands flat") {
  // Leans by `tilt` to +x, on its rim's point (0.5, 0, 0), and turns back at 0.5 rad/s. The centre goes straight on, so
  // that the rim's point rises by 1 - cos of the tilt times the arm: it lands a hair later than it is flat.
  const Shape can = cylinder(0.5, 2);
  for (const double tilt : {0.01, 1e-4, 1e-7}) {
    const Quat q = turn(-tilt, Vec3(0, 0, 1));
    const Vec3 w(0, 0, 0.5), arm = q * Vec3(-0.5, 1, 0);
    const Motion tipping = moving(at(Vec3(0.5, 0, 0) + arm, q), w.cross(arm), w);
    REQUIRE(points(can, tipping.pose, half_space(), at(0, 0, 0), tol).size() == 1);
    const double t = time_of_contact(can, tipping, half_space(), moving(at(0, 0, 0)), tol, 1);
    CHECK(t == Approx(tilt / 0.5).epsilon(0.02));
    const auto found = points(can, advance(tipping, t), half_space(), at(0, 0, 0), tol);
    CHECK(!found.empty());
    bool far_side = false;
    for (const ContactPoint& p : found) far_side |= p.position.x() < 0;
    CHECK(far_side);
  }
}

TEST_CASE("Random cylinders over the ground: no open part of a rim sinks in before, and one is closed at the time") {
  Random random(63);
  int landed = 0, far_landed = 0;
  for (int k = 0; k < 3000; ++k) {
    const Shape shape = cylinder(random.in(0.1, k % 16 < 12 ? 1 : 5), k % 3 ? random.in(0.1, 2) : 0);
    const double horizon = std::pow(10, random.in(-3, 0));
    Motion motion = moving(random.pose(1), random.vector(3), random.vector(k % 4 ? (k % 8 > 4 ? 30 : 6) : 1e-6));
    // Near to standing, near to lying, any other way; touching, or above.
    if (k % 5 < 2) motion.pose.q = turn(std::pow(10, random.in(-7, -1)), Vec3(1, 0, 0.5));
    if (k % 5 == 2) motion.pose.q = (turn(std::pow(10, random.in(-7, -1)), Vec3(0, 0.2, 1)) * upright()).normalized();
    motion.pose.p.y() = 0;
    motion.pose.p.y() = -separation(shape, motion.pose, half_space(), at(0, 0, 0)) + (k % 2 ? 0 : random.in(1e-8, 0.5));
    const double t = time_of_contact(shape, motion, half_space(), moving(at(0, 0, 0)), tol, horizon);
    REQUIRE(t >= 0);
    REQUIRE(t <= horizon);
    double least = 1e9, at_end = 1e9;
    bool by_far = false;
    for (const int end : {-1, 1}) {
      const Mat3 R0 = motion.pose.q.toRotationMatrix();
      const double middle = motion.pose.p.y() + end * shape.half_extents.y() * R0(1, 1);
      const double slope = std::hypot(R0(1, 0), R0(1, 2));
      const bool lowest = middle - shape.radius * slope > tol;
      if (!lowest && middle <= tol) continue;
      // Lowest of many points of the rim, all of it or the half across from its lowest point at the start.
      const double up = std::atan2(R0(1, 2), R0(1, 0));
      const auto gap = [&](double s) {
        const Pose pose = advance(motion, s);
        double low = 1e9;
        for (int i = 0; i <= 720; ++i) {
          const double angle = up + (lowest ? 2 : 1) * pi * (i / 720.0 - 0.5);
          const Vec3 x(shape.radius * std::cos(angle), end * shape.half_extents.y(), shape.radius * std::sin(angle));
          low = std::min(low, (pose * x).y());
        }
        return low;
      };
      for (int sample = 0; sample <= 20; ++sample) least = std::min(least, gap(t * sample / 20));
      const double now = gap(t);
      if (now < at_end) by_far = !lowest;
      at_end = std::min(at_end, now);
    }
    CHECK(least >= 0);
    if (t == horizon) continue;
    ++landed;
    far_landed += by_far;
    // The sampled rim is within the circle by the square of half a degree.
    CHECK(at_end <= tol + 1e-5 * shape.radius);
    CHECK(!points(shape, advance(motion, t), half_space(), at(0, 0, 0), tol).empty());
  }
  CHECK(landed > 500);
  CHECK(far_landed > 50);
}

TEST_CASE(
    "Random spheres in flight at turning cylinders are never deeper than the tolerance before the time returned") {
  Random random(64);
  int landed = 0, total = 0;
  while (total < 500) {
    const Shape ball = sphere(random.in(0.1, 1)), can = cylinder(random.in(0.1, 1), random.in(0, 2));
    Motion motion_a = moving(random.pose(2), random.vector(2), random.vector(4));
    const Motion motion_b = moving(random.pose(2), random.vector(2), random.vector(4));
    motion_a.v += 3 * (motion_b.pose.p - motion_a.pose.p);
    if (separation(ball, motion_a.pose, can, motion_b.pose) < 1e-6) continue;
    ++total;
    const double horizon = std::pow(10, random.in(-2, 0));
    const double t = time_of_contact(ball, motion_a, can, motion_b, tol, horizon);
    double least = 1e9;
    for (int sample = 0; sample <= 200; ++sample) {
      const double s = t * sample / 200;
      least = std::min(least, separation(can, advance(motion_b, s), ball, advance(motion_a, s)));
    }
    CHECK(least >= 0);
    if (t == horizon) continue;
    ++landed;
    CHECK(separation(ball, advance(motion_a, t), can, advance(motion_b, t)) <= tol);
    CHECK(points(can, advance(motion_b, t), ball, advance(motion_a, t), tol).size() == 1);
  }
  CHECK(landed > 100);
}

TEST_CASE("The broad phase names every cylinder that can reach the ground or a sphere within the horizon") {
  Random random(65);
  int needed = 0;
  for (int k = 0; k < 500; ++k) {
    std::vector<Shape> shapes{cylinder(random.in(0.1, 1), random.in(0, 2)), sphere(0.3), half_space()};
    shapes[1].body = 1;
    std::vector<Motion> motions{moving(random.pose(1), random.vector(2), random.vector(6)),
                                moving(random.pose(1), random.vector(2)), moving(at(0, -1, 0))};
    BroadPhase broad_phase;
    const double horizon = 0.2;
    const auto pairs = broad_phase.pairs(shapes, motions, 1e-6, horizon, [](int, int) { return true; });
    for (const int other : {1, 2}) {
      double least = 1e9;
      for (int sample = 0; sample <= 20; ++sample) {
        const double s = horizon * sample / 20;
        least =
            std::min(least, separation(shapes[0], advance(motions[0], s), shapes[other], advance(motions[other], s)));
      }
      if (least > 0) continue;
      ++needed;
      CHECK(std::find(pairs.begin(), pairs.end(), std::pair(0, other)) != pairs.end());
    }
  }
  CHECK(needed > 100);
}

TEST_CASE("an end that is sunk in askew touches at its lowest and highest points and across, each halfway") {
  const double r = 0.5, half = 0.3, tilt = 0.1, middle = -0.06;  // m, of the lower end; its rim is within r sin tilt
  for (const double way : {1.0, -1.0}) {
    // Turned about a direction across which it slopes down: neither is an axis of the cylinder.
    const Vec3 axis = way * Vec3(0.8, 0, 0.6);
    const Quat q = turn(tilt, axis);
    const Vec3 end(2, middle, 3), along = q * axis.cross(Vec3::UnitY());
    const Pose pose = at(end + half * (q * Vec3::UnitY()), q);
    const auto found = points(cylinder(r, 2 * half), pose, half_space(), at(0, 0, 0));
    REQUIRE(found.size() == 4);
    for (const Vec3& off : {along, Vec3(-along), axis, Vec3(-axis)}) {
      const Vec3 rim = end + r * off;
      double nearest = 1;
      for (const ContactPoint& p : found)
        nearest =
            std::min(nearest, (p.position - Vec3(rim.x(), rim.y() / 2, rim.z())).norm() + std::abs(p.gap - rim.y()));
      CHECK(nearest < 1e-14);
    }
  }
}

TEST_CASE("an end that is nearly flat touches with its whole rim only where its highest point is closed, too") {
  // Its rim rises by 0.4 nm to both sides, to below the tolerance of 1 nm or beyond it; the middle is within it.
  const double r = 0.5;
  for (const double middle : {0.5e-9, 0.7e-9}) {
    const Pose pose = at(Vec3(0, 0.3 + middle, 0), turn(0.8e-9, Vec3(0, 0, 1)));
    CHECK(points(cylinder(r, 0.6), pose, half_space(), at(0, 0, 0)).size() == (middle < 0.6e-9 ? 4 : 3));
  }
}

TEST_CASE("a sphere whose centre is inside a cylinder is pushed out through its side or the nearer end") {
  const double r = 0.5, half = 0.8, radius = 0.25;
  struct Case {
    Vec3 centre, normal, surface;  // in the cylinder's frame
    double depth;
  };
  const Case cases[] = {
      {{0.24, -0.2, -0.32}, {0.6, 0, -0.8}, {0.3, -0.2, -0.4}, 0.1},  // its side
      {{0.24, 0.3, -0.32}, {0.6, 0, -0.8}, {0.3, 0.3, -0.4}, 0.1},
      {{0.06, -0.75, 0.08}, {0, -1, 0}, {0.06, -0.8, 0.08}, 0.05},  // its lower end, its upper one
      {{0.06, 0.75, 0.08}, {0, 1, 0}, {0.06, 0.8, 0.08}, 0.05},
      {{0.24, 0.7, -0.32}, {0, 1, 0}, {0.24, 0.8, -0.32}, 0.1},  // both are as near: the end
      {{0.24, -0.7, -0.32}, {0, -1, 0}, {0.24, -0.8, -0.32}, 0.1},
  };
  for (const Pose& frame : {at(0, 0, 0), at(Vec3(1, 2, 3), turn(0.7, Vec3(1, 2, -1)))})
    for (const Case& one : cases) {
      INFO(one.centre.transpose());
      const auto found = points(sphere(radius), at(frame * one.centre, Quat::Identity()), cylinder(r, 2 * half), frame);
      REQUIRE(found.size() == 1);
      CHECK(found[0].gap == Approx(-one.depth - radius));
      CHECK((found[0].normal - frame.q * one.normal).norm() < 1e-14);
      const Vec3 position = one.surface - (one.depth + radius) / 2 * one.normal;
      CHECK((found[0].position - frame * position).norm() < 1e-14);
    }
  // On its axis no side is nearer: along its x axis.
  const auto found = points(sphere(radius), at(0, 0.1, 0), cylinder(r, 2 * half), at(0, 0, 0));
  REQUIRE(found.size() == 1);
  CHECK(found[0].normal == Vec3(1, 0, 0));
  CHECK((found[0].position - Vec3(0.5 - 0.375, 0.1, 0)).norm() < 1e-15);
}

TEST_CASE("a cylinder that stands half beside another touches where the rims cross, and with what lies on the other") {
  // Rims of 0.5 and 0.4 m whose centres are 0.6 m apart cross at (0.6^2 + 0.4^2 - 0.5^2) / 1.2 = 0.225 m from the
  // latter.
  const double beside = std::sqrt(0.4 * 0.4 - 0.225 * 0.225);
  const std::vector<Vec3> expected{{0.225, 0.3, beside}, {0.225, 0.3, -beside}, {0.4, 0.3, 0}, {0.1, 0.3, 0}};
  for (const double angle : {0.0, pi / 2, pi, -pi / 2})
    for (const Pose& frame : {at(0, 0, 0), at(Vec3(1, 2, 3), turn(0.7, Vec3(1, 2, -1)))})
      for (const bool swapped : {false, true}) {
        const Pose under = frame * at(Vec3::Zero(), turn(angle, Vec3(0, 1, 0)));
        const Pose over = frame * at(Vec3(0.6, 0.6, 0), turn(2 * angle, Vec3(0, 1, 0)));
        const Shape wide = cylinder(0.5, 0.6), narrow = cylinder(0.4, 0.6);
        const auto found = swapped ? points(narrow, under, wide, over) : points(wide, over, narrow, under);
        REQUIRE(found.size() == expected.size());
        for (const Vec3& x : expected) {
          double nearest = 1;
          for (const ContactPoint& p : found) nearest = std::min(nearest, (p.position - frame * x).norm());
          CHECK(nearest < 1e-9);
        }
        for (const ContactPoint& p : found)
          CHECK((p.normal - (swapped ? -1 : 1) * (frame.q * Vec3::UnitY())).norm() < 1e-12);
      }
}
