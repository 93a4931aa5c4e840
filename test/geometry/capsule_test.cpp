#include <catch2/catch.hpp>

#include "geometry/placed_shapes.h"

using namespace cb;
using namespace cb::test;

namespace {

constexpr double tol = 1e-9;

Motion moving(const Pose& pose, const Vec3& v = Vec3::Zero(), const Vec3& w = Vec3::Zero()) { return {pose, v, w}; }

// The capsule's y axis turned to the world's x axis.
Quat lying() { return turn(-pi / 2, Vec3(0, 0, 1)); }

}  // namespace

TEST_CASE("A capsule without length is a sphere to whatever it touches") {
  Random random(71);
  const Shape others[] = {half_space(), sphere(0.7), box(1, 2, 0.5), capsule(0.3, 1), box_hull(1, 2, 0.5)};
  int touching = 0;
  for (int k = 0; k < 500; ++k) {
    const double radius = random.in(0.2, 1);
    const Shape ball = sphere(radius), point = capsule(radius, 0);
    for (const Shape& other : others) {
      const Pose pose = random.pose(1.2), there = other.kind == ShapeKind::half_space ? at(0, 0, 0) : random.pose(0.3);
      // Spheres to boxes go through code of their own.
      CHECK(separation(point, pose, other, there) == Approx(separation(ball, pose, other, there)).margin(1e-14));
      const auto as_ball = points(ball, pose, other, there, 0.1), as_point = points(point, pose, other, there, 0.1);
      touching += !as_ball.empty();
      CHECK(set_difference(as_ball, as_point) < 1e-13);
      CHECK(set_difference(as_ball, points(other, there, point, pose, 0.1), -1) < 1e-13);
      const Motion motion = moving(pose, random.vector(3)), still = moving(there, random.vector(1), random.vector(2));
      const double t = time_of_contact(point, motion, other, still, tol, 0.3);
      if (separation(ball, pose, other, there) > tol)
        CHECK(t == Approx(time_of_contact(ball, motion, other, still, tol, 0.3)).margin(1e-9));
    }
  }
  CHECK(touching > 500);
}

TEST_CASE("A capsule on the ground touches with the lowest points of both ends, or of the lower one") {
  auto found = points(capsule(0.5, 2), at(Vec3(0, 0.5, 3), lying()), half_space(), at(0, 0, 0));
  REQUIRE(found.size() == 2);
  CHECK((found[0].position - Vec3(-1, 0, 3)).norm() < 1e-15);
  CHECK((found[1].position - Vec3(1, 0, 3)).norm() < 1e-15);
  for (const ContactPoint& p : found) CHECK(std::abs(p.gap) < 1e-15);
  found = points(capsule(0.5, 2), at(1, 1.5, 0), half_space(), at(0, 0, 0));
  REQUIRE(found.size() == 1);
  CHECK((found[0].position - Vec3(1, 0, 0)).norm() < 1e-15);
}

TEST_CASE("A capsule that lies on a box touches with the ends of what is over the face") {
  const Shape table = box(4, 1, 4);
  // Within the face; beyond one of its edges; across all of it.
  for (const auto& [x, length, low, high] :
       {std::tuple(0.5, 2.0, -0.5, 1.5), std::tuple(1.5, 2.0, 0.5, 2.0), std::tuple(0.0, 6.0, -2.0, 2.0)}) {
    const Shape rod = capsule(0.25, length);
    for (const Shape& under : {table, box_hull(4, 1, 4)}) {
      const auto found = points(rod, at(Vec3(x, 0.75, 0.5), lying()), under, at(0, 0, 0));
      REQUIRE(found.size() == 2);
      CHECK((found[0].position - Vec3(low, 0.5, 0.5)).norm() < 1e-14);
      CHECK((found[1].position - Vec3(high, 0.5, 0.5)).norm() < 1e-14);
      for (const ContactPoint& p : found) {
        CHECK((p.normal - Vec3(0, 1, 0)).norm() < 1e-15);
        CHECK(std::abs(p.gap) < 1e-15);
      }
      CHECK(set_difference(found, points(under, at(0, 0, 0), rod, at(Vec3(x, 0.75, 0.5), lying())), -1) < 1e-14);
    }
  }
}

TEST_CASE("Capsules side by side touch at the ends of what they have in common, crossed ones at one point") {
  auto found = points(capsule(0.5, 2), at(Vec3(0, 1, 0), lying()), capsule(0.5, 4), at(Vec3(1.5, 0, 0), lying()));
  REQUIRE(found.size() == 2);
  const double left = std::min(found[0].position.x(), found[1].position.x());
  const double right = std::max(found[0].position.x(), found[1].position.x());
  CHECK(left == Approx(-0.5).margin(1e-14));
  CHECK(right == Approx(1).margin(1e-14));
  for (const ContactPoint& p : found) CHECK((p.normal - Vec3(0, 1, 0)).norm() < 1e-14);
  found = points(capsule(0.5, 2), at(Vec3(0.25, 1, 0), lying()), capsule(0.5, 2),
                 at(Vec3(0, 0, 0.5), turn(pi / 2, Vec3(1, 0, 0))));
  REQUIRE(found.size() == 1);
  CHECK((found[0].position - Vec3(0, 0.5, 0)).norm() < 1e-14);
}

TEST_CASE("A capsule in the groove between two edges lies on two points of each") {
  // Boxes that stand apart by 0.6 with their tops at y = 0; a capsule of radius 0.5 along their edges: its axis is 0.4
  // above.
  const Pose rod = at(Vec3(0, 0.4, 0), turn(pi / 2, Vec3(1, 0, 0)));
  for (const double side : {-1.0, 1.0}) {
    const auto found = points(capsule(0.5, 2), rod, box(2, 2, 10), at(side * 1.3, -1, 0));
    REQUIRE(found.size() == 2);
    for (const ContactPoint& p : found) {
      CHECK((p.normal - Vec3(-side * 0.6, 0.8, 0)).norm() < 1e-14);
      CHECK(std::abs(p.position.z()) == Approx(1));
    }
    CHECK(found[0].position.z() == Approx(-found[1].position.z()));
  }
}

TEST_CASE("The distance of a capsule is that of the nearest directions of all") {
  Random random(72);
  const std::vector<Vec3> rock{{1, 0, 0}, {-0.8, 0.1, 0}, {0, 1, 0.1}, {0.1, -0.9, 0}, {0, 0.2, 1}, {0.3, 0.1, -1}};
  int apart = 0;
  for (int k = 0; k < 600; ++k) {
    const Shape rod = capsule(random.in(0.1, 0.5), random.in(0.1, 2));
    const Shape others[] = {sphere(0.7), box(1, 2, 0.5), capsule(0.3, 1), hull(rock)};
    const Shape& other = others[k % 4];
    const Pose pose = random.pose(2), there = random.pose(0.5);
    const double gap = separation(rod, pose, other, there), certified = certified_gap(rod, pose, other, there);
    if (certified > -rod.radius) {
      ++apart;
      CHECK(gap == Approx(certified).margin(1e-10));
    } else {
      CHECK(gap < 0);
    }
    CHECK(separation(other, there, rod, pose) == Approx(gap).margin(1e-13));
    std::vector<ContactPoint> found;
    contact_points(rod, pose, 0, other, there, 1, tol, found, false, 0.2);
    CHECK(found.empty() == (gap > 0.2));
    double least = 1e9;
    for (const ContactPoint& p : found) least = std::min(least, p.gap);
    if (!found.empty()) CHECK(least == Approx(gap).margin(1e-9));
  }
  CHECK(apart > 300);
}

TEST_CASE("A capsule on one end that turns down lies flat on the ground as on a box and on a fixed capsule") {
  // The touching end is at the origin's height; the other comes down by sin(angle) times the length.
  const double angle = 1e-3, speed = 2;
  const Shape rod = capsule(0.25, 2);
  const Quat tilted = (turn(angle, Vec3(0, 0, 1)) * lying()).normalized();
  const Vec3 w(0, 0, -speed), centre = Vec3(0, 0.25, 0) + tilted * Vec3(0, 1, 0);
  const Motion motion = moving(at(centre, tilted), w.cross(centre - Vec3(0, 0.25, 0)), w);
  const auto check = [&](const Shape& under, const Motion& still) {
    REQUIRE(points(rod, motion.pose, under, still.pose, tol).size() == 1);
    const double t = time_of_contact(rod, motion, under, still, tol, 0.01);
    CHECK(t == Approx(angle / speed).epsilon(2e-3));
    CHECK(time_of_contact(under, still, rod, motion, tol, 0.01) == Approx(t));
    bool other_end = false;
    for (const ContactPoint& p : points(rod, advance(motion, t), under, still.pose, tol))
      other_end |= p.position.x() > 1.9;
    CHECK(other_end);
  };
  check(half_space(), moving(at(0, 0, 0)));
  check(box(10, 2, 10), moving(at(0, -1, 0)));
  check(box_hull(10, 2, 10), moving(at(0, -1, 0)));
  check(capsule(0.5, 10), moving(at(Vec3(0, -0.5, 0), lying())));
}

TEST_CASE("A capsule that turns down over the edge of a table finds the edge") {
  // One end at x = 0 on the table, whose edge is at x = 1: what comes down is the side, over the edge.
  const Shape rod = capsule(0.25, 3), table = box(2, 2, 2);
  const double angle = 1e-3, speed = 2;
  const Quat tilted = (turn(angle, Vec3(0, 0, 1)) * lying()).normalized();
  const Vec3 w(0, 0, -speed), end(0, 0.25, 0), centre = end + tilted * Vec3(0, 1.5, 0);
  const Motion motion = moving(at(centre, tilted), w.cross(centre - end), w), still = moving(at(0, -1, 0));
  const double t = time_of_contact(rod, motion, table, still, tol, 0.01);
  CHECK(t == Approx(angle / speed).epsilon(4e-3));
  CHECK(time_of_contact(table, still, rod, motion, tol, 0.01) == Approx(t).epsilon(1e-5));
  const auto found = points(rod, advance(motion, t), table, still.pose, tol);
  bool edge = false;
  for (const ContactPoint& p : found) edge |= std::abs(p.position.x() - 1) < 1e-3;
  CHECK(edge);
}

TEST_CASE("Random capsules in flight never sink in before the time returned and touch at it") {
  Random random(73);
  const std::vector<Vec3> rock{{1, 0, 0}, {-0.8, 0.1, 0}, {0, 1, 0.1}, {0.1, -0.9, 0}, {0, 0.2, 1}, {0.3, 0.1, -1}};
  const Shape others[] = {sphere(0.4), box(0.5, 1, 0.7), capsule(0.3, 1), hull(rock), half_space()};
  int landed = 0, short_of = 0;
  for (int k = 0; k < 3000; ++k) {
    const Shape rod = capsule(random.in(0.05, 0.5), random.in(0, 2));
    const Shape& other = others[k % 5];
    Motion motion = moving(random.pose(2.5), random.vector(2), random.vector(k % 3 ? 5 : 0.01));
    Motion there = moving(random.pose(0.5), random.vector(1), random.vector(5));
    if (other.kind == ShapeKind::half_space) there = moving(at(0, -2, 0));
    motion.v += random.in(0, 3) * (there.pose.p - motion.pose.p);
    if (separation(rod, motion.pose, other, there.pose) < 1e-6) continue;
    const double horizon = std::pow(10, random.in(-2, 0));
    const double t = time_of_contact(rod, motion, other, there, tol, horizon);
    REQUIRE(t >= 0);
    REQUIRE(t <= horizon);
    double least = 1e9;
    for (int sample = 0; sample <= 40; ++sample) {
      const double s = t * sample / 40;
      const Pose a = advance(motion, s), b = advance(there, s);
      least = std::min(
          least, other.kind == ShapeKind::half_space ? separation(rod, a, other, b) : certified_gap(rod, a, other, b));
    }
    CHECK(least >= 0);
    if (t == horizon) continue;
    ++landed;
    short_of += separation(rod, advance(motion, t), other, advance(there, t)) > tol;
  }
  CHECK(landed > 300);
  CHECK(short_of == 0);
}

TEST_CASE("Random capsules that touch and turn find what closes next") {
  // From a touching pose, over a short time: the pair never gets deeper than what touched went down, and 1e-4 of it.
  Random random(74);
  const Shape others[] = {box(3, 1, 3), capsule(0.3, 3), box_hull(3, 1, 3)};
  int found_more = 0;
  for (int k = 0; k < 1500; ++k) {
    const Shape rod = capsule(random.in(0.05, 0.3), random.in(0.2, 2));
    const Shape& other = others[k % 3];
    const Quat near_flat = (turn(std::pow(10, random.in(-5, -1)), random.vector(1)) * lying()).normalized();
    Motion motion = moving(at(Vec3(random.in(-1, 1), 2, k % 3 == 1 ? 0 : random.in(-1, 1)), near_flat));
    const Motion still = moving(at(Vec3(0, 0, 0), k % 3 == 1 ? lying() : Quat::Identity()));
    for (int i = 0; i < 60; ++i) motion.pose.p.y() -= separation(rod, motion.pose, other, still.pose);
    const auto now = points(rod, motion.pose, other, still.pose, tol);
    if (now.size() != 1) continue;
    // Turns about the point that touches.
    motion.w = random.vector(3);
    motion.v = motion.w.cross(motion.pose.p - now[0].position);
    const double horizon = 1e-2;
    const double t = time_of_contact(rod, motion, other, still, tol, horizon);
    found_more += t < horizon;
    // The arcs: (2 w (v + w r) + w^2 r) t^2 / 2, r the half length; where two edges cross, the point runs along them by
    // 1 / sine of their angle faster.
    const double w = motion.w.norm(), fastest = motion.v.norm() + w * rod.half_extents.y();
    const double arcs = (2 * w * fastest + w * w * rod.half_extents.y()) * t * t / 2;
    double least = 1e9;
    for (int sample = 0; sample <= 20; ++sample)
      least = std::min(least, certified_gap(rod, advance(motion, t * sample / 20), other, still.pose));
    const double sine = k % 3 == 1 ? (motion.pose.q * Vec3::UnitY()).cross(Vec3::UnitX()).norm() : 1;
    CHECK(least >= -arcs * 8 / sine - 10 * tol);
  }
  CHECK(found_more > 100);
}

TEST_CASE("what a capsule nearly lies along has points at both ends of what they share, each with its own gap") {
  // It rises by 1 mm/m along x, or falls, 2 mm above a box, a hull, or a capsule that lies along x; these are 0.64 m
  // long.
  const double gap = 2e-3;
  const Shape lying = capsule(0.2, 1);
  const Quat along_x = turn(-pi / 2, Vec3(0, 0, 1));
  for (const Shape& under : {box(0.64, 0.6, 1), box_hull(0.64, 0.6, 1), capsule(0.3, 0.64)})
    for (const double middle : {0.1, 0.4, -0.4})
      for (const double slope : {1e-3, -1e-3})
        for (const bool swapped : {false, true}) {
          INFO(static_cast<int>(under.kind) << ", " << middle << " m, " << slope);
          const Pose low = at(Vec3::Zero(), under.kind == ShapeKind::capsule ? along_x : Quat::Identity());
          const Pose high = at(Vec3(middle, 0.3 + 0.2 + gap, 0), turn(slope, Vec3(0, 0, 1)) * along_x);
          for (const double reach : {0.01, 0.0}) {
            std::vector<ContactPoint> found;
            if (swapped)
              contact_points(under, low, 0, lying, high, 1, 2e-3, found, false, reach);
            else
              contact_points(lying, high, 0, under, low, 1, 2e-3, found, false, reach);
            const double from = std::max(-0.32, middle - 0.5), to = std::min(0.32, middle + 0.5);
            const auto gap_at = [&](double x) { return gap + slope * (x - middle); };
            int expected = 0;
            for (const double x : {from, to}) {
              if (gap_at(x) > (reach > 0 ? reach : 2e-3)) continue;
              ++expected;
              double nearest = 1;
              for (const ContactPoint& p : found)
                nearest = std::min(nearest, (p.position - Vec3(x, 0.3 + gap_at(x) / 2, 0)).norm());
              CHECK(nearest < 1e-3);
            }
            CHECK(static_cast<int>(found.size()) == expected);
            for (const ContactPoint& p : found) {
              CHECK(p.gap == Approx(gap_at(p.position.x())).margin(2e-6));
              CHECK(p.normal.y() == Approx(swapped ? -1 : 1).epsilon(1e-5));
            }
          }
        }
}

TEST_CASE("Balls in one place are pushed apart by both of their radii, the first upwards") {
  for (const Shape& one : {sphere(0.5), capsule(0.5, 0)})
    for (const Shape& other : {sphere(0.2), capsule(0.2, 0)}) {
      INFO(name(one.kind) << " in " << name(other.kind));
      const auto found = points(one, at(1, 2, 3), other, at(1, 2, 3));
      REQUIRE(found.size() == 1);
      CHECK(found[0].normal == Vec3(0, 1, 0));
      CHECK(found[0].gap == Approx(-0.7));
      // Halfway from the lowest point of the first, at 1.5, to the highest one of the other, at 2.2.
      CHECK((found[0].position - Vec3(1, 1.85, 3)).norm() < 1e-15);
    }
}

TEST_CASE("What has its middle on a capsule's axis is pushed apart across that axis, and across its own") {
  // Exactly upright, and exactly along z.
  const Quat upright = Quat::Identity(), level(0.5, 0.5, 0.5, 0.5);
  const Shape ball = sphere(0.5), rod = capsule(0.2, 3);
  const Vec3 x = Vec3::UnitX(), middle(1, 2, 3);
  const auto in_one_place = [&](const Shape& one, const Quat& q, const Shape& other, const Quat& r) {
    const auto found = points(one, at(middle, q), other, at(middle, r));
    REQUIRE(found.size() == 1);
    CHECK(found[0].gap == Approx(-0.7));
    // Halfway between the outermost points of both, 0.5 m and 0.2 m from the middle.
    CHECK((found[0].position - (middle + (one.radius == 0.5 ? -0.15 : 0.15) * found[0].normal)).norm() < 1e-15);
    return found[0].normal;
  };
  CHECK(in_one_place(capsule(0.5, 2), upright, rod, level) == x);
  CHECK(in_one_place(ball, upright, rod, upright) == x);
  CHECK(in_one_place(rod, upright, ball, upright) == Vec3(-x));
  CHECK(in_one_place(ball, upright, rod, level).z() == 0);
}
