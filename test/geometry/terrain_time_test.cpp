// Times of contact of a cylinder that touches a ground of triangles: what of the ground arrives at it, and what only
// seems to.
#include <catch2/catch.hpp>
#include <cmath>

#include "geometry/ground_shapes.h"
#include "geometry/placed_shapes.h"

using namespace cb;
using namespace cb::test;

namespace {

constexpr double tol = 1e-9;
constexpr double tilt = 0.01, spin = 0.5;  // rad, rad/s

/// Of a cylinder along the x axis of a frame, its middle over the frame's origin: the end at -x touches the plane y = 0
/// with its lowest point, the other one is up by `tilt` and comes down as the cylinder turns about its own middle.
Motion seesaw(const Pose& frame, double radius, double half) {
  const Quat q = turn(tilt, Vec3::UnitZ()) * turn(pi / 2, Vec3::UnitZ());
  const double height = half * std::sin(tilt) + radius * std::cos(tilt);
  Motion motion;
  motion.pose = frame * at(Vec3(0, height, 0), q);
  motion.w = frame.q * Vec3(0, 0, -spin);
  return motion;
}

double time_on(const Shape& prism, const Shape& shape, const Motion& motion, double horizon) {
  return first_contact({prism}, shape, motion, horizon);
}

}  // namespace

TEST_CASE("A cylinder that touches flat ground with one end and turns about its middle lands on the other end") {
  // All of it over one triangle. Its ends are level when it has turned by twice the tilt.
  constexpr double radius = 0.05, half = 0.15, closing = spin * half;
  for (const Vec3& slide : {Vec3(0, 0, 0), Vec3(0.2, 0, 0.1)}) {
    Motion motion = seesaw(at(-0.25, 0, 0), radius, half);
    motion.v = slide;
    const double t = first_contact(roof(0), cylinder(radius, 2 * half), motion, 0.06);
    CHECK(t == Approx(2 * tilt / spin).epsilon(0).margin(2 * tol / closing));
  }
}

TEST_CASE("A standing cylinder slides over flat seams with all of its rim, and nothing arrives") {
  // From 0.05 m before a seam to 0.05 m beyond it.
  for (const double way : {1.0, -1.0})
    for (const double height : {-5e-10, 0.0, 5e-10})
      for (const double turning : {0.0, 3.0}) {
        INFO(way << ' ' << height << ' ' << turning);
        Motion motion;
        motion.pose = at(-0.15 * way, 0.1 + height, 0.1);
        motion.v = Vec3(way, 0, way > 0 ? 0 : 0.3);
        motion.w = Vec3(0, turning, 0);
        CHECK(first_contact(roof(0), cylinder(0.1, 0.2), motion, 0.3) == Approx(0.3).epsilon(1e-12));
      }
}

TEST_CASE("An edge of the ground, its rim or a ridge, comes up to the side of a cylinder that turns down over it") {
  // With `over` from the middle to the edge: it has turned by `below` beyond the level when r / cos - over tan is its
  // middle's height.
  constexpr double radius = 0.05, half = 0.25, over = 0.1, slope = 0.5, closing = spin * over;
  const double height = half * std::sin(tilt) + radius * std::cos(tilt);
  const double below = std::acos(radius / std::hypot(height, over)) - std::atan2(over, height);
  const double expected = (tilt + below) / spin;
  const Shape rod = cylinder(radius, 2 * half);
  const Motion on_rim = seesaw(at(1 - over, 0, 0), radius, half);
  CHECK(first_contact(roof(0), rod, on_rim, 0.1) == Approx(expected).epsilon(0).margin(2 * tol / closing));
  // It touches the ridge's one side, and stands out over the other one: both have the ridge.
  const Quat up = turn(std::atan(slope), Vec3::UnitZ());
  const Motion on_ridge = seesaw(at(up * Vec3(-over, 0, 0), up), radius, half);
  const auto ground = roof(slope);
  for (const std::size_t side : {1u, 2u}) {
    INFO(side);
    CHECK(time_on(ground[side], rod, on_ridge, 0.1) == Approx(expected).epsilon(0).margin(2 * tol / closing));
  }
}

TEST_CASE("A cylinder meets a ridge along normals between those of its two sides, and not from below the other side") {
  // Along the ridge, over the other side's ground or in it: it meets the edge with its middle so far before that.
  constexpr double radius = 0.2, before = 0.5, horizon = 0.45, slope = 0.5;
  const Shape prism = roof(slope)[2];
  for (const double height : {0.19, 0.17, -0.1}) {
    INFO(height);
    const double at_edge = before - std::sqrt(radius * radius - height * height);
    const bool carries = std::asin(std::sqrt(1 - height * height / (radius * radius))) < std::atan(slope) && height > 0;
    Motion motion;
    motion.pose = at(Vec3(-before, height, 0), turn(pi / 2, Vec3::UnitX()));
    motion.v = Vec3(1, 0, 0);
    REQUIRE(at_edge < horizon);
    CHECK(time_on(prism, cylinder(radius, 0.6), motion, horizon) ==
          Approx(carries ? at_edge : horizon).epsilon(0).margin(1e-8));
  }
}
