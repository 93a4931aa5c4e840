#include <catch2/catch.hpp>

#include "geometry/placed_shapes.h"

using namespace cb;
using namespace cb::test;

namespace {

// Does any face of a, cut by the six half-spaces of b, leave something over?
bool face_inside(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b) {
  for (int face = 0; face < 6; ++face) {
    const int i = face / 2, i1 = (i + 1) % 3, i2 = (i + 2) % 3;
    std::vector<Vec3> polygon;
    for (int k = 0; k < 4; ++k) {
      Vec3 x;
      x[i] = face % 2 ? 1 : -1;
      x[i1] = k == 1 || k == 2 ? 1 : -1;
      x[i2] = k >= 2 ? 1 : -1;
      polygon.push_back(pose_b.q.conjugate() * (pose_a * x.cwiseProduct(a.half_extents) - pose_b.p));
    }
    for (int plane = 0; plane < 6 && !polygon.empty(); ++plane) {
      const auto outside = [&](const Vec3& x) {
        return (plane % 2 ? 1 : -1) * x[plane / 2] - b.half_extents[plane / 2];
      };
      std::vector<Vec3> rest;
      for (std::size_t k = 0; k < polygon.size(); ++k) {
        const Vec3 &x = polygon[k], &y = polygon[(k + 1) % polygon.size()];
        const double d_x = outside(x), d_y = outside(y);
        if (d_x <= 0) rest.push_back(x);
        if ((d_x <= 0) != (d_y <= 0)) rest.push_back(x + d_x / (d_x - d_y) * (y - x));
      }
      polygon = rest;
    }
    if (!polygon.empty()) return true;
  }
  return false;
}

bool surfaces_meet(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b) {
  return face_inside(a, pose_a, b, pose_b) || face_inside(b, pose_b, a, pose_a);
}

}  // namespace

TEST_CASE("Distances of spheres, boxes and half-spaces in closed form") {
  CHECK(separation(sphere(1), at(0, 3, 0), half_space(), at(0, 0, 0)) == 2);
  CHECK(separation(half_space(), at(0, 0, 0), sphere(1), at(0, 3, 0)) == 2);
  CHECK(separation(sphere(1), at(3, 4, 0), sphere(2), at(0, 0, 0)) == 2);
  CHECK(separation(box(1, 2, 1), at(7, 1.5, 0), half_space(), at(0, 0, 0)) == 0.5);
  CHECK(separation(box(1, 1, 1), at(0, 2, 0), box(1, 1, 1), at(0, 0, 0)) == 1);
  CHECK(separation(box(1, 1, 1), at(0, 0.75, 0), box(1, 1, 1), at(0, 0, 0)) == -0.25);
  CHECK(separation(box(1, 1, 1), at(0, 0, 0), sphere(0.5), at(2.5, 2, 0)) == Approx(2));  // corner at 1.5, 2: 3-4-5
  CHECK(std::isinf(separation(half_space(), at(0, 0, 0), half_space(), at(0, 5, 0))));
}

TEST_CASE("The separation of two boxes never exceeds the distance of any two of their points") {
  Random random(21);
  for (int k = 0; k < 2000; ++k) {
    const Shape a = box(random.in(0.2, 2), random.in(0.2, 2), random.in(0.2, 2));
    const Shape b = box(random.in(0.2, 2), random.in(0.2, 2), random.in(0.2, 2));
    const Pose pose_a = random.pose(2);
    Pose pose_b = random.pose(2);
    // Every third pair: axes nearly parallel, down to round-off.
    if (k % 3 == 0) pose_b.q = (turn(std::pow(10, -random.in(0, 17)), random.vector(1)) * pose_a.q).normalized();
    const double lower = separation(a, pose_a, b, pose_b);
    CHECK(lower <= distance_by_projection(a, pose_a, b, pose_b, 200) + 1e-14);
  }
}

TEST_CASE("Where two boxes come to touch, separation vanishes with their distance") {
  Random random(22);
  for (int k = 0; k < 400; ++k) {
    const Shape a = box(random.in(0.2, 2), random.in(0.2, 2), random.in(0.2, 2));
    const Shape b = box(random.in(0.2, 2), random.in(0.2, 2), random.in(0.2, 2));
    Pose pose_a = at(Vec3::Zero(), random.rotation());
    Pose pose_b = at(Vec3::Zero(), random.rotation());
    if (k % 3 == 0) pose_b.q = (turn(std::pow(10, -random.in(0, 12)), random.vector(1)) * pose_a.q).normalized();
    // b comes in along a line through a; bisection for the place where the separation is zero.
    const Vec3 direction = random.vector(1).normalized();
    double in = 0, out = 5;
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (in + out);
      pose_b.p = middle * direction;
      (separation(a, pose_a, b, pose_b) > 0 ? out : in) = middle;
    }
    // A hair further in they share points, a hair further out they do not: a face of one cut to the inside of the
    // other.
    pose_b.p = (in - 1e-9) * direction;
    CHECK(surfaces_meet(a, pose_a, b, pose_b));
    pose_b.p = (out + 1e-9) * direction;
    CHECK(!surfaces_meet(a, pose_a, b, pose_b));
  }
}

TEST_CASE("The separation of two boxes is symmetric and does not depend on the frame") {
  Random random(23);
  for (int k = 0; k < 1000; ++k) {
    const Shape a = box(random.in(0.2, 2), random.in(0.2, 2), random.in(0.2, 2));
    const Shape b = k % 2 ? sphere(random.in(0.2, 1)) : box(random.in(0.2, 2), random.in(0.2, 2), random.in(0.2, 2));
    const Pose pose_a = random.pose(1), pose_b = random.pose(1), motion = random.pose(5);
    const double gap = separation(a, pose_a, b, pose_b);
    CHECK(separation(b, pose_b, a, pose_a) == Approx(gap).margin(1e-13));
    CHECK(separation(a, motion * pose_a, b, motion * pose_b) == Approx(gap).margin(1e-13));
  }
}
