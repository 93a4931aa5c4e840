#include <catch2/catch.hpp>

#include "geometry/placed_shapes.h"

using namespace cb;
using namespace cb::test;

TEST_CASE("Tangents are the world axes on level ground") {
  Vec3 t1, t2;
  contact_tangents(Vec3(0, 1, 0), 0, t1, t2);
  CHECK(t1 == Vec3(1, 0, 0));
  CHECK(t2 == Vec3(0, 0, -1));
  // Where x projects to nothing, z takes its place; t2 = n x t1 = x x z = -y.
  contact_tangents(Vec3(1, 0, 0), 0, t1, t2);
  CHECK(t1 == Vec3(0, 0, 1));
  CHECK(t2 == Vec3(0, -1, 0));
  contact_tangents(Vec3(-1, 1e-17, 0), 0, t1, t2);
  CHECK(t1.z() == Approx(1));
}

TEST_CASE("Tangents and normal are right-handed and orthonormal, and t1 lies in the plane of the normal and world x") {
  Random random(1);
  for (int k = 0; k < 200; ++k) {
    Vec3 n = random.vector(1).normalized(), t1, t2;
    if (k < 20) n = Vec3(1, 1e-5 * random.in(-1, 1), 1e-5 * random.in(-1, 1)).normalized();
    contact_tangents(n, 0, t1, t2);
    CHECK(std::abs(t1.dot(n)) < 1e-15);
    CHECK(std::abs(t1.norm() - 1) < 1e-15);
    CHECK((n.cross(t1) - t2).norm() < 1e-15);
    CHECK(t1.x() > 0);  // the projection of x, not its opposite
    CHECK(std::abs(t1.dot(n.cross(Vec3(1, 0, 0)))) < 1e-15);
    const double angle = random.in(-3, 3);
    Vec3 s1, s2;
    contact_tangents(n, angle, s1, s2);
    CHECK((s1 - std::cos(angle) * t1 - std::sin(angle) * t2).norm() < 1e-15);
    CHECK((n.cross(s1) - s2).norm() < 1e-15);
  }
}

TEST_CASE("A pose without spin keeps its quaternion bit for bit") {
  Random random(2);
  Motion motion;
  motion.pose = random.pose(1);
  motion.v = Vec3(1, 2, 3);
  const Pose after = advance(motion, 0.25);
  CHECK(after.q.coeffs() == motion.pose.q.coeffs());
  CHECK((after.p - motion.pose.p - Vec3(0.25, 0.5, 0.75)).norm() < 1e-15);
}

TEST_CASE("A steady spin turns by its angle about its axis, for small and large angles") {
  Random random(3);
  for (const double size : {1e-12, 1e-6, 0.01, 0.06, 0.064, 1.0, 10.0}) {
    Motion motion;
    motion.pose = random.pose(1);
    motion.w = random.vector(size);
    const Quat expected = turn(motion.w.norm() * 0.7, motion.w) * motion.pose.q;
    const Pose after = advance(motion, 0.7);
    CHECK((after.q.coeffs() - expected.coeffs()).norm() < 1e-15);
    CHECK(after.p == motion.pose.p);
  }
}

TEST_CASE("A million turns leave the quaternion unit to 1e-12") {
  Motion motion;
  motion.w = Vec3(3, -20, 7);
  for (int k = 0; k < 1000000; ++k) motion.pose = advance(motion, 1e-3);
  CHECK(std::abs(motion.pose.q.norm() - 1) < 1e-12);
}

TEST_CASE("Two half turns make a whole one") {
  Random random(4);
  for (int k = 0; k < 50; ++k) {
    Motion motion;
    motion.pose = random.pose(1);
    motion.v = random.vector(1);
    motion.w = random.vector(3);
    Motion half = motion;
    half.pose = advance(motion, 0.4);
    const Pose twice = advance(half, 0.4), once = advance(motion, 0.8);
    CHECK((twice.p - once.p).norm() < 1e-15);
    CHECK((twice.q.coeffs() - once.q.coeffs()).norm() < 1e-15);
  }
}

TEST_CASE("Bounding radius and size of the shapes") {
  CHECK(sphere(2).bounding_radius() == 2);
  CHECK(sphere(2).size() == 4);
  CHECK(box(2, 4, 4).bounding_radius() == Approx(3));
  CHECK(box(2, 4, 1).size() == 4);
  CHECK(cylinder(3, 8).bounding_radius() == Approx(5));
  CHECK(cylinder(3, 8).size() == 8);
  CHECK(cylinder(3, 5).size() == 6);
  CHECK(capsule(3, 8).bounding_radius() == 7);
  CHECK(capsule(3, 8).size() == 14);
  CHECK(box_hull(2, 4, 4).bounding_radius() == Approx(3));
  CHECK(box_hull(2, 4, 1).size() == Approx(4));
  // Of the box around it: a capsule's is longer by its caps.
  CHECK(sphere(2).box_around() == Vec3(2, 2, 2));
  CHECK(box(2, 4, 1).box_around() == Vec3(1, 2, 0.5));
  CHECK(cylinder(3, 8).box_around() == Vec3(3, 4, 3));
  CHECK(capsule(3, 8).box_around() == Vec3(3, 7, 3));
  CHECK(std::isinf(half_space().bounding_radius()));
  CHECK(std::isinf(half_space().size()));
}

TEST_CASE("A kind of shape is told by the name of its element in a scene") {
  const std::pair<ShapeKind, std::string_view> elements[] = {
      {ShapeKind::sphere, "sphere"},   {ShapeKind::box, "box"},   {ShapeKind::cylinder, "cylinder"},
      {ShapeKind::capsule, "capsule"}, {ShapeKind::hull, "hull"}, {ShapeKind::half_space, "half_space"}};
  for (const auto& [kind, element] : elements) CHECK(name(kind) == element);
}
