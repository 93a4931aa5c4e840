// A ground of triangles: which of its features carry.

#include "geometry/terrain.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "geometry/ground_shapes.h"
#include "geometry/placed_shapes.h"
#include "geometry/shapes.h"

using namespace cb;
using cb::test::first_contact;
using cb::test::roof;
using cb::test::shapes_of;

namespace {

Shape ball(double radius) {
  Shape shape;
  shape.radius = radius;
  shape.half_extents.setConstant(radius);
  return shape;
}
Shape box(const Vec3& half_extents) {
  Shape shape;
  shape.kind = ShapeKind::box;
  shape.half_extents = half_extents;
  return shape;
}

Shape cylinder(double radius, double half) {
  Shape shape = ball(radius);
  shape.kind = ShapeKind::cylinder;
  shape.half_extents.y() = half;
  return shape;
}

std::vector<ContactPoint> points_on(const std::vector<Shape>& ground, const Shape& shape, const Pose& pose) {
  std::vector<ContactPoint> points;
  for (const Shape& prism : ground) contact_points(shape, pose, 0, prism, prism.local, 1, 1e-9, points);
  return points;
}

}  // namespace

TEST_CASE("a prism under a triangle is as deep as asked for, and is about its middle") {
  // A triangle of area 3 seen from above, over (1, 2, 3); its prism's centre is half the depth below.
  const Triangle top{Vec3(0, 2, 2), Vec3(0, 2.3, 4), Vec3(3, 1.7, 3)};
  const double depth = 0.8;
  const auto prisms = ground_prisms({top, {Vec3(9, 0, 9), Vec3(9, 0, 10), Vec3(10, 0, 9)}}, depth);
  REQUIRE(prisms.size() == 2);
  const Hull& prism = *prisms[0];
  CHECK((prism.frame.p - Vec3(1, 2 - depth / 2, 3)).norm() < 1e-14);
  CHECK(prism.frame.q.isApprox(Quat::Identity()));
  CHECK(prism.volume == Approx(3 * depth));
  CHECK(prism.size == Approx(3));  // x from 0 to 3, y over 1.4, z over 2
  double furthest = 0;
  REQUIRE(prism.polytope.vertices.size() == 6);
  for (const Vec3& x : top)
    for (const double down : {0.0, depth}) {
      const Vec3 corner = x - Vec3(0, down, 0) - prism.frame.p;
      furthest = std::max(furthest, corner.norm());
      double nearest = 1;
      for (const Vec3& vertex : prism.polytope.vertices) nearest = std::min(nearest, (vertex - corner).norm());
      CHECK(nearest < 1e-14);
    }
  CHECK(prism.radius == Approx(furthest));
  // About the middle of an upright one: over a triangle sum x^2 / 12, along the depth d^2 / 12 (the corners' mean is
  // 0).
  const Triangle level{Vec3(0, 0, 2), Vec3(0, 0, 4), Vec3(3, 0, 3)};
  const double xx = (1 + 1 + 4) / 12.0, zz = (1 + 1 + 0) / 12.0, yy = depth * depth / 12;
  CHECK((ground_prisms({level}, depth)[0]->inertia_per_mass - Vec3(yy + zz, xx + zz, xx + yy)).norm() < 1e-14);
}

TEST_CASE("at a corner the ground goes on along every edge there, on its rim as within") {
  // Nine points, two triangles a cell, cut the same way; heights that no two share.
  const auto point = [](int i, int j) { return Vec3(i, 0.1 * i * i + 0.03 * j + 0.07 * i * j, 1.5 * j); };
  std::vector<Triangle> triangles;
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 2; ++j) {
      triangles.push_back({point(i, j), point(i, j + 1), point(i + 1, j + 1)});
      triangles.push_back({point(i, j), point(i + 1, j + 1), point(i + 1, j)});
    }
  std::vector<std::pair<Vec3, Vec3>> edges;
  for (const Triangle& t : triangles)
    for (int k = 0; k < 3; ++k)
      for (int way = 0; way < 2; ++way) edges.emplace_back(t[(k + way) % 3], t[(k + 1 - way) % 3]);
  const auto prisms = ground_prisms(triangles, 1);
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const Polytope& prism = prisms[t]->polytope;
    REQUIRE(prism.seams->beyond_vertex.size() == 6);
    for (std::size_t v = 0; v < 6; ++v) {
      const Vec3 corner = triangles[t][v % 3];
      const std::vector<Vec3>& beyond = *prism.seams->beyond_vertex[v];
      const auto is_beyond = [&](const Vec3& way) {
        return std::count_if(beyond.begin(), beyond.end(), [&](const Vec3& b) { return (b - way).norm() < 1e-12; });
      };
      INFO("triangle " << t << ", corner " << corner.transpose());
      std::vector<Vec3> ways;
      for (const auto& [from, to] : edges) {
        const Vec3 way = (to - from).normalized();
        const auto same = [&](const Vec3& other) { return (other - way).norm() < 1e-12; };
        if ((from - corner).norm() < 1e-12 && std::none_of(ways.begin(), ways.end(), same)) ways.push_back(way);
      }
      CHECK(beyond.size() == ways.size());
      for (const Vec3& way : ways) CHECK(is_beyond(way) == 1);
    }
  }
}

TEST_CASE("A triangle that is there twice is nobody's neighbour: the sides about it are the outside of each") {
  const Vec3 a(0, 0, 0), b(0, 0, 1), c(1, 0, 1), d(1, 0, 0);
  const auto inner_sides = [](const std::vector<Triangle>& triangles) {
    std::vector<long> inner;
    for (const auto& prism : ground_prisms(triangles, 1)) {
      const std::vector<char>& faces = prism->polytope.seams->inner;
      inner.push_back(std::count_if(faces.begin(), faces.end(), [](char is_inner) { return is_inner != 0; }));
    }
    return inner;
  };
  CHECK(inner_sides({{a, b, c}, {a, c, d}}) == std::vector<long>{1, 1});
  CHECK(inner_sides({{a, b, c}, {a, c, d}, {a, b, c}}) == std::vector<long>{0, 0, 0});
  CHECK(inner_sides({{a, b, c}, {a, b, c}, {a, c, d}}) == std::vector<long>{0, 0, 0});
}

TEST_CASE("a triangle looks up where it is less steep than a wall, with its corners counted from above") {
  const auto rises = [](double x) { return looks_up({Vec3(1, 5, 0), Vec3(1, 5, 2), Vec3(1 + x, 5 + 1, 1)}); };
  CHECK(rises(1));
  CHECK(rises(2e-6));
  CHECK_FALSE(rises(0.5e-6));
  CHECK_FALSE(rises(0));
  CHECK_FALSE(rises(-1));  // seen from below
}

TEST_CASE("On flat ground a ball's only normal is up, wherever it is beside a seam, and a box has its four corners") {
  const auto ground = roof(0);
  for (const double x : {-1e-5, -1e-9, -1e-12, 0.0, 1e-12, 1e-9, 1e-5, 0.2})
    for (const double height : {-5e-10, 0.0, 5e-10}) {
      INFO(x << ' ' << height);
      Pose pose;
      pose.p = Vec3(x, 0.25 + height, 0.3);
      const auto of_ball = points_on(ground, ball(0.25), pose);
      CHECK_FALSE(of_ball.empty());
      for (const ContactPoint& point : of_ball) CHECK((point.normal - Vec3::UnitY()).norm() < 2e-8);
      // A side of the box over the seam, and a corner.
      for (const double middle : {x, x + 0.2}) {
        pose.p = Vec3(middle, 0.1 + height, 0.3);
        const auto of_box = points_on(ground, box(Vec3(0.2, 0.1, 0.15)), pose);
        CHECK(of_box.size() >= 4);
        for (const ContactPoint& point : of_box) {
          CHECK((point.normal - Vec3::UnitY()).norm() < 1e-12);
          CHECK(std::abs(std::abs(point.position.x() - middle) - 0.2) < 1e-12);
          CHECK(std::abs(std::abs(point.position.z() - 0.3) - 0.15) < 1e-12);
        }
      }
    }
}

TEST_CASE("The upright edge below a corner of the outline carries, also where two triangles share the corner") {
  const auto ground = roof(0);
  for (const double x : {-1.0, 1.0})
    for (const double z : {-1.0, 1.0}) {
      INFO(x << ' ' << z);
      const Vec3 n = Vec3(x, 0, z).normalized(), edge(x, -0.5, z);
      Pose pose;
      pose.p = edge + 0.25 * n;
      const auto points = points_on(ground, ball(0.25), pose);
      CHECK_FALSE(points.empty());
      for (const ContactPoint& point : points) {
        CHECK((point.normal - n).norm() < 1e-12);
        CHECK((point.position - edge).norm() < 1e-9);
      }
      Motion motion;
      motion.pose.p = edge + 0.35 * n;
      motion.v = -n;
      CHECK(first_contact(ground, ball(0.25), motion, 1) == Approx(0.1).margin(2e-9));
      // Where two cells meet the outline is straight: the faces carry.
      pose.p = Vec3(0, -0.5, z * 1.25);
      for (const ContactPoint& point : points_on(ground, ball(0.25), pose))
        CHECK((point.normal - Vec3(0, 0, z)).norm() < 2e-8);
    }
  // Of straight sides no seam is an edge.
  for (const Shape& prism : ground) {
    const Polytope& polytope = prism.hull->polytope;
    for (std::size_t e = 0; e < polytope.edges.size(); ++e) {
      const Vec3 from = polytope.vertices[polytope.edges[e].from] + prism.local.p;
      const Vec3 to = polytope.vertices[polytope.edges[e].to] + prism.local.p;
      if ((from - to).head<1>().norm() < 1e-12 && (from - to).tail<1>().norm() < 1e-12 && std::abs(from.x()) < 1e-12)
        CHECK(polytope.seams->sharp_edge[e] == 0);
    }
  }
}

TEST_CASE("Nothing arrives at a body that slides over flat seams, and what falls arrives as on a plane") {
  const auto ground = roof(0);
  Motion motion;
  for (const Shape& shape : {box(Vec3(0.2, 0.1, 0.15)), ball(0.1)})
    for (const double height : {-5e-10, 0.0, 5e-10})
      for (const Vec3& v : {Vec3(1, 0, 0), Vec3(-0.7, 0, 0.3), Vec3(0.2, 0, -1)}) {
        motion.pose.p = Vec3(-0.3, 0.1 + height, 0.1) - 0.2 * v;
        motion.v = v;
        CHECK(first_contact(ground, shape, motion, 0.5) == 0.5);
        motion.pose.p.y() += 0.05;
        motion.v.y() = -1;
        CHECK(first_contact(ground, shape, motion, 0.5) == Approx(0.05).margin(2e-9));
      }
}

TEST_CASE("What turns about its edge on flat seams lies down when it does on a plane") {
  const auto ground = roof(0);
  Shape plane;
  plane.kind = ShapeKind::half_space;
  Motion still;
  std::mt19937 random(11);
  const auto in = [&](double low, double high) {
    return low + (high - low) * (static_cast<double>(random()) / 4294967295.0);
  };
  int lain = 0;
  for (int k = 0; k < 2000; ++k) {
    const Shape shape = k % 4 == 0 ? box(Vec3(0.2, 0.1, 0.15)) : cb::test::box_hull(0.4, 0.2, 0.3);
    const double tilt = in(0.01, 0.2), turns = in(0.2, 2), side = k % 2 == 0 ? 1 : -1;
    // The edge is along a seam to rounding, or ends at it, or is anywhere; it slides as the other comes down, over
    // seams.
    const double at[] = {0, 1e-10, -1e-10, 4e-10, in(-0.5, 0.5)};
    const Vec3 edge(at[k % 5], in(-5e-10, 5e-10), in(-0.3, 0.3));
    const bool along = k % 3 == 0;
    const Vec3 axis = along ? Vec3(0, 0, 1) : Vec3(-1, 0, 0);
    Motion motion;
    motion.pose.q = Quat(Eigen::AngleAxisd(-side * tilt, axis));
    motion.pose.p =
        edge + motion.pose.q * (along ? Vec3(-side * 0.2, 0.1, 0) : Vec3(k % 7 < 4 ? -0.2 : 0.2, 0.1, -side * 0.15));
    motion.w = side * turns * axis;
    motion.v = motion.w.cross(motion.pose.p - edge) + Vec3(in(-0.5, 0.5), 0, in(-0.5, 0.5));
    INFO(k);
    const double level = time_of_contact(shape, motion, plane, still, 1e-9, 0.5);
    CHECK(first_contact(ground, shape, motion, 0.5) == Approx(level).margin(1e-7));
    lain += level < 0.5;
  }
  CHECK(lain > 500);
}

TEST_CASE("What turns about a ridge lies down on the slope when it does on its plane, whatever seams it slides over") {
  Shape plane;
  plane.kind = ShapeKind::half_space;
  std::mt19937 random(31);
  const auto in = [&](double low, double high) {
    return low + (high - low) * (static_cast<double>(random()) / 4294967295.0);
  };
  int lain = 0;
  for (int k = 0; k < 4000; ++k) {
    const double drop = in(0.02, 0.2), slope = std::atan(drop), tilt = in(0.01 - slope, slope - 0.01);
    const Shape brick = k % 2 == 0 ? box(Vec3(0.2, 0.1, 0.15)) : cb::test::box_hull(0.4, 0.2, 0.3);
    const Vec3 on_ridge(0, in(-5e-10, 5e-10), in(-0.3, 0.3));
    Motion motion, falls;
    falls.pose.q = Quat(Eigen::AngleAxisd(-slope, Vec3::UnitZ()));
    motion.pose.q = Quat(Eigen::AngleAxisd(tilt, Vec3::UnitZ()));
    motion.pose.p = on_ridge - motion.pose.q * Vec3(in(-0.15, 0.1), -0.1, 0);
    motion.w = Vec3(0, 0, -in(0.2, 2));
    motion.v = motion.w.cross(motion.pose.p - on_ridge) + Vec3(0, 0, in(-0.5, 0.5));
    INFO(k);
    const double level = time_of_contact(brick, motion, plane, falls, 1e-9, 0.5);
    CHECK(first_contact(roof(drop, 1 + k % 4), brick, motion, 0.5) == Approx(level).margin(1e-6));
    lain += level < 0.5;
  }
  CHECK(lain > 2000);
}

TEST_CASE("A ridge carries between the normals of its two sides, a valley's seam along these alone") {
  const double slope = 0.5, length = std::sqrt(1 + slope * slope);
  for (const double turn : {-0.9, -0.4, 0.0, 0.3, 0.9}) {
    // A ball over the ridge, off the vertical by a part of the sides' normals' angle.
    const Vec3 n(std::sin(turn * std::atan(slope)), std::cos(turn * std::atan(slope)), 0);
    Pose pose;
    pose.p = 0.25 * n + Vec3(0, 0, 0.3);
    const auto on_ridge = points_on(roof(slope), ball(0.25), pose);
    CHECK_FALSE(on_ridge.empty());
    for (const ContactPoint& point : on_ridge) CHECK((point.normal - n).norm() < 1e-12);
  }
  Pose pose;
  pose.p = Vec3(0, 0.25 * length, 0.3);
  const auto in_valley = points_on(roof(-slope), ball(0.25), pose);
  CHECK(in_valley.size() == 2);
  for (const ContactPoint& point : in_valley) {
    CHECK(point.normal.y() == Approx(1 / length));
    CHECK(std::abs(point.normal.x()) == Approx(slope / length));
  }
}

TEST_CASE("Of a ball that lies on one slope a ridge is no contact, however far is looked ahead") {
  const auto ground = roof(1);  // 45 degrees to both sides
  const double r = 0.25, along = 0.02;
  const Vec3 slope = Vec3(1, -1, 0).normalized(), up = Vec3(1, 1, 0).normalized();
  Pose pose;
  pose.p = along * slope + r * up + Vec3(0, 0, 0.3);
  // The ridge is r - sqrt(r^2 + along^2) = 0.8 mm further from the ball than the slope, along a normal beyond the
  // slope's.
  std::vector<ContactPoint> points;
  for (const Shape& prism : ground) contact_points(ball(r), pose, 0, prism, prism.local, 1, 1e-9, points, false, 0.01);
  CHECK_FALSE(points.empty());
  for (const ContactPoint& point : points) CHECK((point.normal - up).norm() < 1e-8);
  // Above the ridge it is one.
  points.clear();
  pose.p = Vec3(0, r + 1e-3, 0.3);
  for (const Shape& prism : ground) contact_points(ball(r), pose, 0, prism, prism.local, 1, 1e-9, points, false, 0.01);
  CHECK_FALSE(points.empty());
  for (const ContactPoint& point : points) CHECK((point.normal - Vec3::UnitY()).norm() < 1e-8);
}

TEST_CASE("However far is looked ahead, flat ground has the points of a plane, on whichever triangles they are") {
  constexpr double reach = 0.06;
  const auto ground = roof(0);
  Shape plane;
  plane.kind = ShapeKind::half_space;
  Shape rod = cylinder(0.08, 0.3);
  rod.kind = ShapeKind::capsule;
  std::mt19937 random(5);
  const auto in = [&](double low, double high) {
    return low + (high - low) * (static_cast<double>(random()) / 4294967295.0);
  };
  int found = 0, open = 0;
  for (int k = 0; k < 2000; ++k) {
    const Shape shapes[] = {box(Vec3(0.3, 0.1, 0.25)), rod, cylinder(0.25, 0.1), cylinder(0.08, 0.3)};
    const Shape& shape = shapes[k % 4];
    const Quat lying(Eigen::AngleAxisd(k % 4 % 2 * M_PI / 2, Vec3::UnitX()));
    const Vec3 tilt(in(-0.2, 0.2), in(-3, 3), in(-0.2, 0.2));
    Pose pose;
    pose.q = Quat(Eigen::AngleAxisd(tilt.norm(), tilt.normalized())) * lying;
    pose.p = Vec3(in(-0.5, 0.5), 0, in(-0.5, 0.5));
    const double gap = k % 3 == 0 ? 0 : in(0, reach);
    pose.p.y() += gap - separation(shape, pose, plane, Pose());
    std::vector<ContactPoint> level, points;
    contact_points(shape, pose, 0, plane, Pose(), 1, 1e-9, level, false, reach);
    for (const Shape& prism : ground) contact_points(shape, pose, 0, prism, prism.local, 1, 1e-9, points, false, reach);
    for (const ContactPoint& expected : level) {
      double nearest = 1;
      for (const ContactPoint& point : points)
        nearest = std::min(nearest, (point.position - expected.position).norm() +
                                        (point.normal - expected.normal).norm() + std::abs(point.gap - expected.gap));
      INFO(k << ": " << expected.gap << " beside " << gap);
      CHECK(nearest < 1e-7);
      ++found;
      open += expected.gap > gap + 1e-3;
    }
    for (const ContactPoint& point : points) CHECK(point.gap > gap - 1e-8);
  }
  CHECK(found > 3500);
  CHECK(open > 1500);
}

TEST_CASE("What passes a ridge's inner sides far below the ridge's other slope meets nothing of it") {
  // A box flush on the left slope whose lower edge is far below the right slope's plane, up to the ridge.
  const double slope = 0.5, tilt = std::atan(slope);
  Pose pose;
  pose.q = Quat(Eigen::AngleAxisd(tilt, Vec3::UnitZ()));
  for (const double beyond : {-1e-10, 0.0, 1e-10, 1e-6, 1e-3}) {
    INFO(beyond);
    pose.p = pose.q * Vec3(beyond - 0.2, 0.1, 0) + Vec3(0, 0, 0.3);
    for (const ContactPoint& point : points_on(roof(slope), box(Vec3(0.2, 0.1, 0.15)), pose)) {
      CHECK(std::abs(point.gap) < 1e-9);
      CHECK((point.normal - Vec3(-std::sin(tilt), std::cos(tilt), 0)).norm() < 1e-9);
    }
  }
}

TEST_CASE("However far is looked, what lies on one side of a ridge has no points below the other side's plane") {
  Shape rod = cylinder(0.05, 0.15);
  rod.kind = ShapeKind::capsule;
  std::size_t points = 0;
  for (const double slope : {0.5, 1.0, 2.0}) {
    const double tilt = std::atan(slope);
    const auto ground = roof(slope);
    for (const Shape& shape : {box(Vec3(0.15, 0.05, 0.1)), rod, cylinder(0.1, 0.05), cylinder(0.05, 0.15)})
      for (const double below : {0.16, 0.3, 0.6}) {
        Pose pose;
        const bool round = shape.kind != ShapeKind::box && shape.half_extents.y() > 0.1;
        const Quat lying(Eigen::AngleAxisd(round ? M_PI / 2 : 0, Vec3::UnitZ()));
        pose.q = Quat(Eigen::AngleAxisd(tilt, Vec3::UnitZ()));
        pose.p = pose.q * Vec3(-below, 0.05, 0) + Vec3(0, 0, 0.3);
        pose.q = pose.q * lying;
        std::vector<ContactPoint> found;
        for (const Shape& prism : ground)
          contact_points(shape, pose, 0, prism, prism.local, 1, 1e-9, found, false, 0.5);
        INFO(slope << ' ' << name(shape.kind) << ' ' << below);
        CHECK(!found.empty());
        for (const ContactPoint& point : found) CHECK(point.gap > -1e-9);
        points += found.size();
      }
  }
  CHECK(points > 72);
}

TEST_CASE("On flat ground a cylinder stands on points of its rim and lies on those of its ends, beside a seam or not") {
  const Quat lying(Eigen::AngleAxisd(M_PI / 2, Vec3(0.6, 0, 0.8)));
  // One with a corner of the ground in its middle, under the end.
  for (const auto& ground : {roof(0), roof(0, 2)})
    for (const double x : {-0.3, -1e-5, -1e-9, 0.0, 1e-12, 1e-9, 1e-5, 0.2})
      for (const double height : {-5e-10, 0.0, 5e-10})
        for (const double half : {0.3, 0.0}) {
          INFO(x << ' ' << height << ' ' << half);
          Pose pose;
          pose.p = Vec3(x, half + height, 0.1);
          const auto standing = points_on(ground, cylinder(0.2, half), pose);
          CHECK(standing.size() >= 4);
          for (const ContactPoint& point : standing) {
            CHECK((point.normal - Vec3::UnitY()).norm() < 1e-12);
            CHECK(std::abs(std::hypot(point.position.x() - x, point.position.z() - 0.1) - 0.2) < 1e-12);
          }
          pose.p.y() = 0.2 + height;
          pose.q = lying;
          const auto on_side = points_on(ground, cylinder(0.2, half), pose);
          CHECK(on_side.size() >= (half > 0 ? 2 : 1));
          for (const ContactPoint& point : on_side) {
            CHECK((point.normal - Vec3::UnitY()).norm() < 1e-7);
            CHECK(std::abs((point.position - pose.p).dot(lying * Vec3::UnitY())) == Approx(half).margin(1e-9));
          }
        }
}

TEST_CASE("Nothing arrives at a cylinder that slides and rolls over flat seams, and what falls arrives as on a plane") {
  const auto ground = roof(0);
  const Quat lying(Eigen::AngleAxisd(M_PI / 2, Vec3(0, 0, 1)));  // rolls along z
  for (const bool upright : {true, false})
    for (const double height : {-5e-10, 0.0, 5e-10})
      for (const Vec3& v : {Vec3(1, 0, 0), Vec3(-0.7, 0, 0.3), Vec3(0.2, 0, -1)}) {
        Motion motion;
        motion.pose.p = Vec3(upright ? -0.15 : -0.05, 0.1 + height, 0.1) - 0.05 * v;
        motion.v = v;
        if (upright) {
          motion.w.y() = 3;
        } else {
          motion.pose.q = lying;
          motion.w.x() = v.z() / 0.1;
        }
        CHECK(first_contact(ground, cylinder(0.1, 0.1), motion, 0.1) == 0.1);
        motion.pose.p.y() += 0.05;
        motion.v.y() = -1;
        CHECK(first_contact(ground, cylinder(0.1, 0.1), motion, 0.1) == Approx(0.05).margin(2e-9));
      }
}

TEST_CASE(
    "A cylinder along a ridge lies on the ridge, one across it on the ridge's point, one in a valley on both sides") {
  const double slope = 0.5, length = std::sqrt(1 + slope * slope), r = 0.2;
  Pose pose;
  pose.q = Quat(Eigen::AngleAxisd(M_PI / 2, Vec3(1, 0, 0)));  // along z, as the ridge
  pose.p = Vec3(0, r, 0.1);
  const auto along = points_on(roof(slope), cylinder(r, 0.3), pose);
  CHECK(along.size() >= 2);
  for (const ContactPoint& point : along) {
    CHECK((point.normal - Vec3::UnitY()).norm() < 1e-12);
    CHECK(std::abs(std::abs(point.position.z() - 0.1) - 0.3) < 1e-12);
  }
  pose.p.y() = r * length;
  const auto in_valley = points_on(roof(-slope), cylinder(r, 0.3), pose);
  CHECK(in_valley.size() >= 4);
  for (const ContactPoint& point : in_valley) CHECK(point.normal.y() == Approx(1 / length));
  pose.p = Vec3(0, r, 0.1);
  pose.q = Quat(Eigen::AngleAxisd(M_PI / 2, Vec3(0, 0, 1)));
  const auto across = points_on(roof(slope), cylinder(r, 0.3), pose);
  CHECK(!across.empty());
  for (const ContactPoint& point : across) {
    CHECK((point.normal - Vec3::UnitY()).norm() < 1e-12);
    CHECK((point.position - Vec3(0, 0, 0.1)).norm() < 1e-9);
  }
}

TEST_CASE("On rough ground something carries a body wherever it has come down, and nothing deeper than it is in") {
  std::mt19937 engine(7);
  const auto in = [&](double low, double high) {
    return low + (high - low) * (static_cast<double>(engine()) / 4294967295.0);
  };
  int down = 0;
  for (int k = 0; k < 2400; ++k) {
    const double roughness = k % 2 ? 0.15 : 0.5;
    double height[3][3];
    for (auto& row : height)
      for (double& h : row) h = in(0, roughness);
    const bool peak = k / 24 % 2 == 0;
    if (peak) height[1][1] += 0.3;
    const auto at = [&](int i, int j) { return Vec3(0.5 * i - 0.5, height[j][i], 0.5 * j - 0.5); };
    std::vector<Triangle> triangles;
    for (int j = 0; j < 2; ++j)
      for (int i = 0; i < 2; ++i) {
        triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j + 1)});
        triangles.push_back({at(i, j), at(i + 1, j + 1), at(i + 1, j)});
      }
    const auto ground = shapes_of(triangles);
    Shape rod = cylinder(in(0.05, 0.1), in(0.05, 0.2));
    rod.kind = ShapeKind::capsule;
    const Shape shapes[] = {cylinder(in(0.05, 0.2), in(0.01, 0.2)), cylinder(in(0.05, 0.2), 0), rod,
                            box(Vec3(in(0.05, 0.2), in(0.05, 0.2), in(0.05, 0.2)))};
    const Shape& shape = shapes[k / 2 % 4];
    Pose pose;
    const double beside = peak ? 0.1 : 0.2;
    pose.p = Vec3(in(-beside, beside), 1.5, in(-beside, beside));
    pose.q = Quat(in(-1, 1), in(-1, 1), in(-1, 1), in(-1, 1)).normalized();
    // Down to where it touches; or on, until it is so deep in the ground.
    const double depth = k / 8 % 3 == 0 ? 0 : k / 8 % 3 == 1 ? 1e-7 : 1e-5;
    double gap = 1;
    for (int i = 0; i < 400 && gap > 5e-10; ++i) {
      gap = 1;
      for (const Shape& prism : ground) gap = std::min(gap, separation(shape, pose, prism, prism.local));
      if (gap > 5e-10) pose.p.y() -= gap - 4e-10;
    }
    if (gap > 5e-10) continue;
    ++down;
    pose.p.y() -= depth;
    const auto points = points_on(ground, shape, pose);
    INFO(k << ": " << name(shape.kind) << ", " << depth);
    CHECK(!points.empty());
    for (const ContactPoint& point : points) CHECK(point.gap >= -depth - 1e-9);
  }
  CHECK(down > 2000);
}
