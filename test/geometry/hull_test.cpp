#include <catch2/catch.hpp>
#include <set>

#include "geometry/broad_phase.h"
#include "geometry/placed_shapes.h"

using namespace cb;
using namespace cb::test;

namespace {

constexpr double tol = 1e-9;

Motion moving(const Pose& pose, const Vec3& v = Vec3::Zero(), const Vec3& w = Vec3::Zero()) { return {pose, v, w}; }

std::vector<Vec3> on_sphere(Random& random, int count) {
  std::vector<Vec3> out;
  for (int k = 0; k < count; ++k) out.push_back(random.rotation() * Vec3(1, 0, 0));
  return out;
}

// What any hull has to be: closed, with all vertices below its faces and on them where they are corners.
void check_hull(const Polytope& hull, const std::vector<Vec3>& points, double tolerance) {
  CHECK(hull.vertices.size() + hull.faces.size() == hull.edges.size() + 2);
  std::set<int> corners;
  for (const Polytope::Face& face : hull.faces) {
    CHECK(face.normal.norm() == Approx(1));
    for (const Vec3& x : points) CHECK(face.normal.dot(x) <= face.offset + tolerance);
    for (int k = 0; k < face.count; ++k) {
      corners.insert(hull.corner(face, k));
      CHECK(face.normal.dot(hull.vertices[hull.corner(face, k)]) >= face.offset - tolerance);
    }
  }
  CHECK(corners.size() == hull.vertices.size());
  for (const Polytope::Edge& edge : hull.edges) {
    const Vec3 along = hull.vertices[edge.to] - hull.vertices[edge.from];
    const Vec3 &left = hull.faces[edge.left].normal, &right = hull.faces[edge.right].normal;
    CHECK(right.cross(left).dot(along) < 0);  // convex, the left face left
  }
}

}  // namespace

TEST_CASE("A hull of random points on a sphere has all of them as vertices and is closed") {
  Random random(81);
  for (const int count : {4, 5, 8, 20, 100}) {
    const auto points = on_sphere(random, count);
    const Polytope hull = convex_hull(points);
    CHECK(hull.vertices.size() == points.size());
    check_hull(hull, points, 1e-9);
  }
}

TEST_CASE("Points of a cube's surface and inside are its six squares, turned or not") {
  Random random(82);
  std::vector<Vec3> cube;
  for (int i = 0; i <= 4; ++i)
    for (int j = 0; j <= 4; ++j)
      for (int k = 0; k <= 4; ++k) cube.push_back(Vec3(i, j, k) / 4);
  for (int turned = 0; turned < 20; ++turned) {
    const Quat q = turned == 0 ? Quat::Identity() : random.rotation();
    const Vec3 p = turned < 2 ? Vec3(0, 0, 0) : random.vector(100);
    std::vector<Vec3> points;
    for (const Vec3& x : cube) points.push_back(p + q * x);
    const Polytope hull = convex_hull(points);
    CHECK(hull.vertices.size() == 8);
    CHECK(hull.faces.size() == 6);
    CHECK(hull.edges.size() == 12);
    check_hull(hull, points, 1e-9);
    const SolidMoments moments = solid_moments(hull);
    CHECK(moments.volume == Approx(1).epsilon(1e-9));
    CHECK((moments.centre - (p + q * Vec3(0.5, 0.5, 0.5))).norm() < 1e-9);
    CHECK((moments.inertia - Mat3::Identity() / 6).norm() < 1e-9);
  }
}

TEST_CASE("The hull does not depend on the order of the points nor on points given twice") {
  Random random(83);
  auto points = on_sphere(random, 30);
  const Polytope first = convex_hull(points);
  points.insert(points.end(), points.begin(), points.begin() + 10);
  std::reverse(points.begin(), points.end());
  const Polytope second = convex_hull(points);
  REQUIRE(second.vertices.size() == first.vertices.size());
  for (std::size_t i = 0; i < first.vertices.size(); ++i) CHECK(first.vertices[i] == second.vertices[i]);
  CHECK(first.loop == second.loop);
}

TEST_CASE("Points without a volume, too few or too many, and what is not finite, have no hull") {
  Random random(84);
  const auto none = [](const std::vector<Vec3>& points) { CHECK_THROWS_AS(convex_hull(points), NoHull); };
  none({});
  none({Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)});
  none(std::vector<Vec3>(10, Vec3(1, 2, 3)));
  none({Vec3(0, 0, 0), Vec3(1, 1, 1), Vec3(2, 2, 2), Vec3(3, 3, 3), Vec3(5, 5, 5)});
  none({Vec3(0, 0, 0), Vec3(0, 0, 1), Vec3(0, 0, 2), Vec3(0, 0, 7)});
  none({Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(1, 1, 0), Vec3(0.3, 0.2, 0)});
  none({Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(1, 1, 1e-8)});
  none({Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(1, 1, 0.7e-6)});  // 1e-6 of the extent
  none({Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, NAN)});
  none({Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, HUGE_VAL)});
  none(on_sphere(random, static_cast<int>(most_hull_vertices) + 1));
  CHECK(convex_hull(on_sphere(random, static_cast<int>(most_hull_vertices))).vertices.size() == most_hull_vertices);
  CHECK(convex_hull({Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(1, 1, 1e-3)}).faces.size() == 4);
  CHECK(convex_hull({Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(1, 1, 1.5e-6)}).faces.size() == 4);
  CHECK(convex_hull({Vec3(0, 0, 0), Vec3(1e-6, 0, 0), Vec3(0, 1e-6, 0), Vec3(0, 0, 1e-6)}).faces.size() == 4);
  // As many points as are taken, most of them in one place; one more is too many.
  std::vector<Vec3> many(most_hull_points, Vec3(0.1, 0.1, 0.1));
  for (std::size_t i = 0; i < 4; ++i) many[i] = i == 3 ? Vec3(Vec3::Zero()) : Vec3(Vec3::Unit(static_cast<int>(i)));
  CHECK(convex_hull(many).vertices.size() == 4);
  many.emplace_back(0.1, 0.1, 0.1);
  none(many);
}

TEST_CASE("Four corners are one face as long as they are in one plane to 1e-9 of the extent") {
  for (const double off : {0.3e-9, 3e-9}) {
    std::vector<Vec3> corners;
    for (int k = 0; k < 8; ++k) corners.push_back(10 * Vec3(k & 1 ? 1 : 0, k & 2 ? 1 : 0, k & 4 ? 1 : 0));
    corners[7].x() += 10 * off;  // of the side at x = 10 m, in the planes of the two others
    const Polytope hull = convex_hull(corners);
    INFO(off);
    CHECK(hull.vertices.size() == 8);
    CHECK(hull.faces.size() == (off < 1e-9 ? 6 : 7));
  }
}

TEST_CASE("Points whose hull's moments are beyond what a number holds are refused, smaller and larger ones are not") {
  for (const double size : {1e-150, 1e-31, 1e-29, 1e29, 1e31, 1e100, 1e300}) {
    const std::vector<Vec3> points{Vec3(0, 0, 0), Vec3(size, 0, 0), Vec3(0, size, 0), Vec3(0, 0, size)};
    if (size < 1e-30 || size > 1e30) {
      CHECK_THROWS_AS(make_hull(points), NoHull);
    } else {
      const Hull hull = make_hull(points);
      CHECK(hull.volume == Approx(size * size * size / 6));
      CHECK(hull.inertia_per_mass.allFinite());
    }
  }
}

TEST_CASE(
    "A pyramid has its moments about its centre, a quarter of its height up, which is not the mean of its corners") {
  const SolidMoments moments = solid_moments(
      convex_hull({Vec3(0.5, 0.5, 0), Vec3(-0.5, 0.5, 0), Vec3(-0.5, -0.5, 0), Vec3(0.5, -0.5, 0), Vec3(0, 0, 1)}));
  const double mass = 1. / 3;
  CHECK(moments.volume == Approx(mass));
  CHECK((moments.centre - Vec3(0, 0, 0.25)).norm() < 1e-15);
  const Vec3 about = mass * Vec3(1. / 20 + 3. / 80, 1. / 20 + 3. / 80, 1. / 10);  // b^2/20 + 3 h^2/80, b^2/10
  CHECK((moments.inertia - Mat3(about.asDiagonal())).norm() < 1e-14);
}

TEST_CASE("A tetrahedron has the moments of its integrals") {
  // Corners 0, x, y, z of length 1: volume 1/6, centre 1/4 each, int x^2 = 1/60, int x y = 1/120.
  const SolidMoments moments = solid_moments(convex_hull({Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)}));
  CHECK(moments.volume == Approx(1.0 / 6));
  CHECK((moments.centre - Vec3(0.25, 0.25, 0.25)).norm() < 1e-15);
  const double xx = 1.0 / 60 - 1.0 / 96, xy = 1.0 / 120 - 1.0 / 96;
  CHECK(moments.inertia(0, 0) == Approx(2 * xx));
  CHECK(moments.inertia(0, 1) == Approx(-xy));
}

TEST_CASE("A hull's frame is that of its principal axes, nearest to the points' own") {
  Random random(85);
  for (int k = 0; k < 50; ++k) {
    const auto points = on_sphere(random, 12);
    const Hull hull = make_hull(points);
    const SolidMoments moments = solid_moments(hull.polytope);
    CHECK(moments.centre.norm() < 1e-14);
    const Mat3 off = moments.inertia - Mat3(moments.inertia.diagonal().asDiagonal());
    CHECK(off.norm() < 1e-13);
    CHECK((moments.inertia.diagonal() / moments.volume - hull.inertia_per_mass).norm() < 1e-13);
    const Mat3 R = hull.frame.q.toRotationMatrix();
    CHECK(R.trace() > 1);
    check_hull(hull.polytope, hull.polytope.vertices, 1e-9);
  }
  const Shape cube = box_hull(1, 2, 3);
  CHECK(cube.hull->frame.q.coeffs() == Quat::Identity().coeffs());
  CHECK((cube.half_extents - Vec3(0.5, 1, 1.5)).norm() < 1e-15);
  CHECK((cube.hull->inertia_per_mass - Vec3(13, 10, 5) / 12).norm() < 1e-14);
}

TEST_CASE("A hull that is a box touches where the box does, planes, spheres, capsules, boxes and hulls") {
  Random random(86);
  const Vec3 size(1, 0.6, 1.4);
  const Shape as_box = box(1, 0.6, 1.4), as_hull = box_hull(1, 0.6, 1.4);
  const Shape other_box = box(0.8, 1.1, 0.5), other_hull = box_hull(0.8, 1.1, 0.5);
  int touching = 0;
  for (int k = 0; k < 2000; ++k) {
    Pose pose = random.pose(1), there = random.pose(0.2);
    // Flush, on an edge, anyhow.
    if (k % 3 == 0) pose.q = (there.q * turn(random.in(-3, 3), Vec3(0, 1, 0))).normalized();
    if (k % 3 == 1) pose.q = (there.q * turn(random.in(-3, 3), Vec3(1, 0, 0))).normalized();
    const Vec3 towards = k % 3 == 2 ? random.rotation() * Vec3(0, 1, 0) : there.q * Vec3(0, 1, 0);
    pose.p = there.p + (k % 3 == 2 ? 0.1 : 1) * (there.q * Vec3(random.in(-0.4, 0.4), 0, random.in(-0.4, 0.4)));
    for (int i = 0; i < 100; ++i)
      pose.p -=
          (separation(as_box, pose, other_box, there) + (i == 0 ? -1e-3 : 0)) * (i == 0 ? 1 : 0.3) * -towards * -1;
    const auto expected = points(as_box, pose, other_box, there, tol);
    touching += !expected.empty();
    CHECK(set_difference(points(as_hull, pose, other_box, there, tol), expected) < 1e-9);
    CHECK(set_difference(points(as_box, pose, other_hull, there, tol), expected) < 1e-9);
    CHECK(set_difference(points(as_hull, pose, other_hull, there, tol), expected) < 1e-9);
    // Not touching, the hull's bound is never the larger one; deep, they are equal.
    const Pose deep = at(there.p + 0.3 * random.vector(1), random.rotation());
    CHECK(separation(as_hull, deep, other_hull, there) ==
          Approx(separation(as_box, deep, other_box, there)).margin(1e-12));
    const Pose anywhere = random.pose(2);
    const double by_box = separation(as_box, anywhere, other_box, there);
    const double by_hull = separation(as_hull, anywhere, other_hull, there);
    CHECK(by_hull <= by_box + 1e-12);
    CHECK((by_hull > 0) == (by_box > 0));

    Pose over = random.pose(0.2);
    if (k % 2) over.q = turn(k, Vec3(0, 1, 0));
    over.p.y() -= separation(as_box, over, half_space(), at(0, 0, 0));
    CHECK(set_difference(points(as_hull, over, half_space(), at(0, 0, 0), tol),
                         points(as_box, over, half_space(), at(0, 0, 0), tol)) < 1e-12);
    for (const Shape& round : {sphere(0.5), capsule(0.3, 1.2)}) {
      const Pose near = random.pose(1.2);
      CHECK(separation(round, near, as_hull, there) == Approx(separation(round, near, as_box, there)).margin(1e-12));
      CHECK(set_difference(points(round, near, as_hull, there, 0.3), points(round, near, as_box, there, 0.3)) < 1e-9);
    }
  }
  CHECK(touching > 1000);
}

TEST_CASE("A hull that is a box has the box's times of contact") {
  Random random(87);
  const Shape as_box = box(1, 0.6, 1.4), as_hull = box_hull(1, 0.6, 1.4);
  const Shape other_box = box(0.8, 1.1, 0.5), other_hull = box_hull(0.8, 1.1, 0.5);
  int landed = 0;
  for (int k = 0; k < 1500; ++k) {
    const double horizon = std::pow(10, random.in(-2, 0));
    const Motion there = moving(random.pose(0.5), random.vector(1), random.vector(3));
    Motion motion = moving(random.pose(2.5), random.vector(1), random.vector(3));
    motion.v += random.in(0, 4) * (there.pose.p - motion.pose.p);
    const double t = time_of_contact(as_box, motion, other_box, there, tol, horizon);
    // Where only a corner and an edge meet the two bounds differ by what is beside them, to first order.
    const double allowed = 1e-7 + 1e-6 * t;
    if (separation(as_box, motion.pose, other_box, there.pose) > tol) {
      landed += t < horizon;
      CHECK(time_of_contact(as_hull, motion, other_box, there, tol, horizon) == Approx(t).margin(allowed));
      CHECK(time_of_contact(as_box, motion, other_hull, there, tol, horizon) == Approx(t).margin(allowed));
      CHECK(time_of_contact(as_hull, motion, other_hull, there, tol, horizon) == Approx(t).margin(allowed));
    }
    Motion fall = moving(random.pose(1), random.vector(2), random.vector(5));
    fall.pose.p.y() -= separation(as_box, fall.pose, half_space(), at(0, 0, 0)) - (k % 2 ? 0 : random.in(0, 1));
    const Motion ground = moving(at(0, 0, 0));
    CHECK(time_of_contact(as_hull, fall, half_space(), ground, tol, horizon) ==
          Approx(time_of_contact(as_box, fall, half_space(), ground, tol, horizon)).margin(1e-9));
    for (const Shape& round : {sphere(0.5), capsule(0.3, 1.2)}) {
      if (separation(round, motion.pose, as_box, there.pose) < tol) continue;
      CHECK(time_of_contact(round, motion, as_hull, there, tol, horizon) ==
            Approx(time_of_contact(round, motion, as_box, there, tol, horizon)).margin(1e-9));
    }
  }
  CHECK(landed > 200);
}

TEST_CASE("Hulls that are boxes on one edge of a wide one lie flat when the box does") {
  Random random(88);
  int landed = 0;
  for (int k = 0; k < 300; ++k) {
    const Vec3 size(random.in(0.5, 2), random.in(0.5, 2), random.in(0.5, 2));
    const Shape as_box = box(size.x(), size.y(), size.z()), as_hull = box_hull(size.x(), size.y(), size.z());
    const Shape table = box(20, 2, 20), table_hull = box_hull(20, 2, 20);
    const double tilt = std::pow(10, random.in(-4, -1));
    const Quat yaw = turn(random.in(-3, 3), Vec3(0, 1, 0));
    const Quat tilted = turn(k % 2 ? tilt : -tilt, k % 4 < 2 ? Vec3(0, 0, 1) : Vec3(1, 0, 0));
    const Vec3 back = yaw * ((k % 2 ? -1 : 1) * (k % 4 < 2 ? Vec3(0, 0, 1) : Vec3(1, 0, 0)));
    Motion motion = moving(at(random.vector(1), (yaw * tilted).normalized()), random.vector(0.2),
                           random.in(0, 3) * back + random.vector(0.1));
    motion.pose.p.y() -= separation(as_box, motion.pose, half_space(), at(0, 0, 0));
    const Motion still = moving(at(0, -1, 0));
    const double t = time_of_contact(as_box, motion, table, still, tol, 0.02);
    landed += t < 0.02;
    CHECK(time_of_contact(as_hull, motion, table, still, tol, 0.02) == Approx(t).margin(1e-8));
    CHECK(time_of_contact(as_box, motion, table_hull, still, tol, 0.02) == Approx(t).margin(1e-8));
    CHECK(time_of_contact(table_hull, still, as_hull, motion, tol, 0.02) == Approx(t).margin(1e-8));
  }
  CHECK(landed > 100);
}

TEST_CASE("Hulls that are bars across each other lie flat when the boxes do") {
  Random random(89);
  int landed = 0;
  for (int k = 0; k < 300; ++k) {
    const Vec3 upper(random.in(0.2, 1), random.in(0.2, 1), 6), lower(6, 1, random.in(0.2, 1));
    const double tilt = std::pow(10, random.in(-4, -1));
    const Vec3 axis = (k % 2 ? -1 : 1) * (k % 4 < 2 ? Vec3(0, 0, 1) : Vec3(1, 0, 0));
    const Quat yaw = turn(random.in(-0.5, 0.5), Vec3(0, 1, 0));
    Motion motion = moving(at(Vec3(random.in(-1, 1), 2, random.in(-1, 1)), (yaw * turn(tilt, axis)).normalized()),
                           Vec3::Zero(), -random.in(0, 5) * (yaw * axis) + random.vector(0.1));
    const Shape as_box = box(upper.x(), upper.y(), upper.z()), as_hull = box_hull(upper.x(), upper.y(), upper.z());
    const Shape bar = box(lower.x(), lower.y(), lower.z()), bar_hull = box_hull(lower.x(), lower.y(), lower.z());
    const Motion still = moving(at(random.vector(1e-3)));
    for (int i = 0; i < 60; ++i) motion.pose.p.y() -= separation(as_box, motion.pose, bar, still.pose);
    if (separation(as_box, motion.pose, bar, still.pose) > tol) continue;
    const double t = time_of_contact(as_box, motion, bar, still, tol, 0.05);
    landed += t < 0.05;
    INFO(k << ": after " << t << " s");
    CHECK(time_of_contact(as_hull, motion, bar, still, tol, 0.05) == Approx(t).margin(1e-7));
    CHECK(time_of_contact(as_box, motion, bar_hull, still, tol, 0.05) == Approx(t).margin(1e-7));
    CHECK(time_of_contact(bar_hull, still, as_hull, motion, tol, 0.05) == Approx(t).margin(1e-7));
  }
  CHECK(landed > 100);
}

TEST_CASE("A tetrahedron touches the ground with one corner, two of an edge, three of a face") {
  Pose frame;
  const Shape shape = hull({Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 0, 1), Vec3(0.2, 1, 0.2)}, &frame);
  const auto count = [&](const Quat& q) {
    // The points' own frame has the orientation q: the hull's is q frame.q.
    Pose pose = at(Vec3(0, 0, 0), (q * frame.q).normalized());
    pose.p.y() -= separation(shape, pose, half_space(), at(0, 0, 0));
    const Shape table = box(10, 2, 10);
    const auto on_plane = points(shape, pose, half_space(), at(0, 0, 0), tol);
    CHECK(set_difference(points(shape, pose, table, at(0, -1, 0), tol), on_plane) < 1e-12);
    return on_plane.size();
  };
  CHECK(count(Quat::Identity()) == 3);
  CHECK(count(turn(-0.2, Vec3(1, 0, 0))) == 2);
  CHECK(count(turn(0.3, Vec3(1, 0.2, 0.7))) == 1);
}

TEST_CASE("Random rocks never sink into each other before the time returned, and touch at it") {
  Random random(89);
  int landed = 0, apart = 0;
  for (int k = 0; k < 400; ++k) {
    const Shape a = hull(on_sphere(random, 6 + k % 3)),
                b = k % 4 ? hull(on_sphere(random, 5 + k % 4)) : box(1, 0.5, 1.5);
    Motion motion = moving(random.pose(2), random.vector(2), random.vector(4));
    const Motion there = moving(random.pose(0.5), random.vector(1), random.vector(4));
    motion.v += random.in(0, 3) * (there.pose.p - motion.pose.p);
    const double gap = separation(a, motion.pose, b, there.pose);
    const double certified = certified_gap(a, motion.pose, b, there.pose);
    CHECK(gap <= certified + 1e-12);
    CHECK((gap > 0) == (certified > 0));
    if (certified < 0) CHECK(gap == Approx(certified).margin(1e-12));
    if (gap < 1e-6) continue;
    ++apart;
    const double horizon = std::pow(10, random.in(-2, 0));
    const double t = time_of_contact(a, motion, b, there, tol, horizon);
    double least = 1e9;
    for (int sample = 0; sample <= 10; ++sample) {
      const double s = t * sample / 10;
      least = std::min(least, certified_gap(a, advance(motion, s), b, advance(there, s)));
    }
    CHECK(least >= 0);
    if (t == horizon) continue;
    ++landed;
    CHECK(separation(a, advance(motion, t), b, advance(there, t)) <= tol);
    CHECK(!points(a, advance(motion, t), b, advance(there, t), tol).empty());
  }
  CHECK(apart > 200);
  CHECK(landed > 50);
}

// Faces that are nearly one plane: that which looks most against the other's need not be the one that is deepest.
TEST_CASE("Of two worn blocks that overlap the deepest point is one of those in contact") {
  Random random(96);
  const auto worn_block = [&random] {
    std::vector<Vec3> corners;
    for (int k = 0; k < 8; ++k)
      corners.push_back(Vec3(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1).cwiseProduct(Vec3(0.6, 0.3, 0.5)) +
                        0.03 * random.vector(1));
    for (int k = 0; k < 12; ++k)
      corners.emplace_back(random.in(-0.6, 0.6), (k & 1 ? 1 : -1) * random.in(0.3, 0.33), random.in(-0.5, 0.5));
    return hull(corners);
  };
  constexpr double overlap = 1e-2;
  for (int k = 0; k < 1000; ++k) {
    const Shape a = worn_block(), b = worn_block();
    const Pose below = at(0, 0, 0), tilted = at(Vec3::Zero(), turn(random.in(0, 0.05), random.vector(1)));
    const Vec3 beside(random.in(-1, 1), 0, random.in(-0.8, 0.8));
    const auto at_height = [&](double y) { return at(beside + Vec3(0, y, 0), tilted.q); };
    const auto apart = [&](double t) { return separation(a, below, b, at_height(t)) + overlap; };
    double in = 0, out = 2;
    REQUIRE((apart(in) < 0 && apart(out) > 0));
    while (out - in > 1e-12) (apart(0.5 * (in + out)) < 0 ? in : out) = 0.5 * (in + out);
    const Pose above = at_height(in);
    const double depth = separation(a, below, b, above);
    double deepest = 0;
    for (const ContactPoint& point : points(a, below, b, above, tol)) deepest = std::min(deepest, point.gap);
    INFO(k);
    CHECK(deepest == Approx(depth).margin(1e-9));
  }
}

TEST_CASE("Rocks that touch and turn find what closes next") {
  // Turning about the point that touches, until the time returned: no deeper than the arcs, which run faster along
  // edges that cross at a small angle; and what is found closes there.
  Random random(91);
  int found_more = 0, tried = 0;
  for (int k = 0; k < 400; ++k) {
    const Shape a = hull(on_sphere(random, 6)), b = k % 2 ? box(3, 1, 3) : box_hull(3, 1, 3);
    // A face of the rock almost flat on the box.
    const Polytope& rock = a.hull->polytope;
    const Vec3 normal = rock.faces[static_cast<std::size_t>(k) % rock.faces.size()].normal;
    const Quat flat = Quat::FromTwoVectors(normal, Vec3(0, -1, 0));
    Motion motion =
        moving(at(Vec3(0, 3, 0), (turn(std::pow(10, random.in(-4, -1.5)), random.vector(1)) * flat).normalized()));
    const Motion still = moving(at(0, 0, 0));
    motion.pose.p.y() -= separation(a, motion.pose, b, still.pose);
    const auto now = points(a, motion.pose, b, still.pose, tol);
    if (now.size() != 1) continue;
    ++tried;
    motion.w = random.vector(3);
    motion.v = motion.w.cross(motion.pose.p - now[0].position);
    const double horizon = 2e-2;
    const double t = time_of_contact(a, motion, b, still, tol, horizon);
    found_more += t < horizon;
    const double w = motion.w.norm(), arcs = (2 * w * (motion.v.norm() + w) + w * w) * t * t / 2;
    double least = 1e9;
    for (int sample = 0; sample <= 10; ++sample)
      least = std::min(least, certified_gap(a, advance(motion, t * sample / 10), b, still.pose));
    CHECK(least >= -2 * arcs - 10 * tol);
    if (t < horizon) CHECK(points(a, advance(motion, t), b, still.pose, 2 * arcs + 10 * tol).size() > 1);
  }
  CHECK(tried > 150);
  CHECK(found_more > 50);
}

TEST_CASE("The broad phase names every capsule and hull that can reach another shape within the horizon") {
  Random random(90);
  int needed = 0;
  for (int k = 0; k < 300; ++k) {
    std::vector<Shape> shapes{capsule(random.in(0.1, 1), random.in(0, 2)), hull(on_sphere(random, 8)), half_space()};
    shapes[1].body = 1;
    std::vector<Motion> motions{moving(random.pose(1.5), random.vector(2), random.vector(6)),
                                moving(random.pose(1.5), random.vector(2), random.vector(6)), moving(at(0, -2, 0))};
    BroadPhase broad_phase;
    const double horizon = 0.2;
    const auto pairs = broad_phase.pairs(shapes, motions, 1e-6, horizon, [](int, int) { return true; });
    for (const auto& [i, j] : {std::pair(0, 1), std::pair(0, 2), std::pair(1, 2)}) {
      double least = 1e9;
      for (int sample = 0; sample <= 20; ++sample) {
        const double s = horizon * sample / 20;
        least = std::min(least, separation(shapes[i], advance(motions[i], s), shapes[j], advance(motions[j], s)));
      }
      if (least > 0) continue;
      ++needed;
      CHECK(std::find(pairs.begin(), pairs.end(), std::pair(i, j)) != pairs.end());
    }
  }
  CHECK(needed > 100);
}
