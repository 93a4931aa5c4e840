#include <catch2/catch.hpp>

#include "geometry/placed_shapes.h"

using namespace cb;
using namespace cb::test;

namespace {

// Every given position is a contact point, and there are no others.
void check_positions(const std::vector<ContactPoint>& found, const std::vector<Vec3>& expected, double tolerance) {
  REQUIRE(found.size() == expected.size());
  for (const Vec3& x : expected) {
    double best = 1e9;
    for (const ContactPoint& p : found) best = std::min(best, (p.position - x).norm());
    CHECK(best <= tolerance);
  }
}

// Turns the diagonal (1, 1, 1) upright: about (1, 1, 1) x (0, 1, 0) by the angle between them.
Quat corner_down() { return turn(std::acos(std::sqrt(1.0 / 3)), Vec3(-1, 0, 1)); }

}  // namespace

TEST_CASE("A cube at rest on the ground touches with its four lower corners, exactly and in a fixed order") {
  const auto found = points(box(1, 1, 1), at(0, 0.5, 0), half_space(), at(0, 0, 0));
  REQUIRE(found.size() == 4);
  CHECK(found[0].position == Vec3(-0.5, 0, -0.5));
  CHECK(found[1].position == Vec3(0.5, 0, -0.5));
  CHECK(found[2].position == Vec3(-0.5, 0, 0.5));
  CHECK(found[3].position == Vec3(0.5, 0, 0.5));
  for (const ContactPoint& p : found) {
    CHECK(p.gap == 0);
    CHECK(p.normal == Vec3(0, 1, 0));
    CHECK(p.shape_a == 0);
    CHECK(p.shape_b == 1);
  }
}

TEST_CASE("A corner just beyond the tolerance is no contact, one just inside is, halfway between the surfaces") {
  CHECK(points(box(1, 1, 1), at(0, 0.5 + 1.1e-9, 0), half_space(), at(0, 0, 0)).empty());
  const auto found = points(box(1, 1, 1), at(0, 0.5 + 0.8e-9, 0), half_space(), at(0, 0, 0));
  REQUIRE(found.size() == 4);
  CHECK(found[0].gap == Approx(0.8e-9).margin(1e-16));
  CHECK(found[0].position.y() == Approx(0.4e-9).margin(1e-16));
}

TEST_CASE("A sphere beside, above or off a corner of a box touches it within the tolerance and not beyond") {
  for (const Vec3& away : {Vec3(0, 1, 0), Vec3(-1, 0, 0), Vec3(0.6, 0, 0.8)}) {
    // From the surface, in the middle of a face or at the corner of the top: along the normal there.
    const Vec3 foot = away.z() > 0 ? Vec3(0.5, 0.2, 0.5) : Vec3(0.5 * away);
    for (const double gap : {0.8e-9, 1.2e-9, 0.1})
      CHECK(points(sphere(0.3), at(foot + (0.3 + gap) * away), box(1, 1, 1), at(0, 0, 0)).size() == (gap < 1e-9));
  }
}

TEST_CASE("A box balanced on its corner, its edge or its face touches with one, two or four points") {
  const Shape cube = box(1, 1, 1);
  const double r2 = std::sqrt(0.5), r3 = std::sqrt(0.75);
  // Standing on an edge: turned by 45 degrees about x. On a corner: the diagonal (1, 1, 1) turned upright.
  const Quat on_corner = corner_down();
  CHECK(points(cube, at(Vec3(3, r2, 1), turn(pi / 4, Vec3(1, 0, 0))), half_space(), at(0, 0, 0)).size() == 2);
  check_positions(points(cube, at(Vec3(3, r3, 1), on_corner), half_space(), at(0, 0, 0)), {Vec3(3, 0, 1)}, 1e-15);
}

TEST_CASE("A cube on a slope of 30 degrees touches with gaps at round-off") {
  const Quat tilt = turn(-pi / 6, Vec3(0, 0, 1));
  const auto found = points(box(1, 1, 1), at(tilt * Vec3(2, 0.5, 0), tilt), half_space(), at(Vec3::Zero(), tilt));
  REQUIRE(found.size() == 4);
  for (const ContactPoint& p : found) {
    CHECK(std::abs(p.gap) < 4e-16);
    CHECK((p.normal - Vec3(0.5, std::sqrt(3) / 2, 0)).norm() < 2e-16);
  }
}

TEST_CASE("Stacked unit cubes share their four corners, gaps at round-off, whichever is named first") {
  for (int level = 0; level < 1000; level += 37) {
    const auto found = points(box(1, 1, 1), at(0, level + 1.5, 0), box(1, 1, 1), at(0, level + 0.5, 0));
    check_positions(found,
                    {Vec3(0.5, level + 1, 0.5), Vec3(-0.5, level + 1, 0.5), Vec3(-0.5, level + 1, -0.5),
                     Vec3(0.5, level + 1, -0.5)},
                    0);
    for (const ContactPoint& p : found) {
      CHECK(p.gap == 0);
      CHECK(p.normal == Vec3(0, 1, 0));
    }
    const auto turned = points(box(1, 1, 1), at(0, level + 0.5, 0), box(1, 1, 1), at(0, level + 1.5, 0));
    CHECK(set_difference(found, turned, -1) == 0);
  }
}

TEST_CASE("A cube shifted or turned on a larger one touches on the patch that the two faces share") {
  // Shifted by (0.3, 0.2): the patch is [-0.2, 0.5] x [-0.3, 0.5].
  auto found = points(box(1, 1, 1), at(0.3, 1, 0.2), box(1, 1, 1), at(0, 0, 0));
  check_positions(found, {Vec3(-0.2, 0.5, -0.3), Vec3(0.5, 0.5, -0.3), Vec3(0.5, 0.5, 0.5), Vec3(-0.2, 0.5, 0.5)},
                  1e-15);
  // Turned by 45 degrees on its like: a regular octagon at distance 1/2, corners at 1/2 tan 22.5 from the middle of a
  // side.
  found = points(box(1, 1, 1), at(Vec3(0, 1, 0), turn(pi / 4, Vec3(0, 1, 0))), box(1, 1, 1), at(0, 0, 0));
  const double c = 0.5 * std::tan(pi / 8);
  std::vector<Vec3> octagon;
  for (const double s : {-1.0, 1.0})
    for (const double r : {-1.0, 1.0}) {
      octagon.emplace_back(0.5 * s, 0.5, c * r);
      octagon.emplace_back(c * r, 0.5, 0.5 * s);
    }
  check_positions(found, octagon, 1e-15);
  // Half its size, turned on a larger one: its own four corners.
  found = points(box(1, 1, 1), at(Vec3(0, 1.5, 0), turn(0.3, Vec3(0, 1, 0))), box(4, 2, 4), at(0, 0, 0));
  REQUIRE(found.size() == 4);
  for (const ContactPoint& p : found) {
    CHECK((p.position - Vec3(0, 1, 0)).norm() == Approx(std::sqrt(0.5)).epsilon(1e-14));
    CHECK(std::abs(p.gap) < 4e-16);
  }
  // The larger one on top: the same four corners, with the reference face its own.
  found = points(box(4, 2, 4), at(0, 2, 0), box(2, 2, 2), at(Vec3(0, 0, 0), turn(0.3, Vec3(0, 1, 0))));
  REQUIRE(found.size() == 4);
  for (const ContactPoint& p : found) CHECK(p.normal == Vec3(0, 1, 0));
}

TEST_CASE("Two crossed beams share the square where they cross") {
  const auto found = points(box(4, 1, 0.5), at(0, 1, 0), box(0.5, 1, 4), at(0, 0, 0));
  check_positions(
      found, {Vec3(0.25, 0.5, 0.25), Vec3(-0.25, 0.5, 0.25), Vec3(-0.25, 0.5, -0.25), Vec3(0.25, 0.5, -0.25)}, 1e-16);
}

TEST_CASE("A box on its edge or corner touches a box's face with two points or one") {
  const double r2 = std::sqrt(0.5), r3 = std::sqrt(0.75);
  auto found = points(box(1, 1, 1), at(Vec3(0, 0.5 + r2, 0), turn(pi / 4, Vec3(1, 0, 0))), box(3, 1, 3), at(0, 0, 0));
  check_positions(found, {Vec3(0.5, 0.5, 0), Vec3(-0.5, 0.5, 0)}, 1e-15);
  found = points(box(1, 1, 1), at(Vec3(0, 0.5 + r3, 0), corner_down()), box(3, 1, 3), at(0, 0, 0));
  check_positions(found, {Vec3(0, 0.5, 0)}, 1e-15);
  CHECK((found[0].normal - Vec3(0, 1, 0)).norm() < 1e-15);
}

TEST_CASE("Two edges that cross touch in one point, along their common normal") {
  // Ridge of a along x at height 0, ridge of b above it along a direction at angle `turned` to x.
  const double r2 = std::sqrt(0.5);
  const Quat ridge = turn(pi / 4, Vec3(1, 0, 0));
  for (const double turned : {pi / 2, 0.7, 0.1, 1e-3}) {
    const Quat about_y = turn(turned, Vec3(0, 1, 0));
    const Pose low = at(Vec3(0, -r2, 0), ridge), high = at(Vec3(0.125, r2 + 1e-10, 0), about_y * ridge);
    const auto found = points(box(1, 1, 1), high, box(1, 1, 1), low);
    REQUIRE(found.size() == 1);
    // Round-off of coordinates near 1 in some ten operations, over the sine of the angle between the edges.
    CHECK((found[0].position - Vec3(0.125, 0.5e-10, 0)).norm() < 4e-15 / turned);
    CHECK((found[0].normal - Vec3(0, 1, 0)).norm() < 4e-15 / turned);
    CHECK(found[0].gap == Approx(1e-10).margin(1e-15));
  }
}

TEST_CASE("Face axes that separate equally do not flip with round-off") {
  // Touching along an edge only: x and z separate equally. The first is taken, with round-off either way.
  for (const double noise : {0.0, 1e-16, -1e-16, 3e-12, -3e-12}) {
    const auto found = points(box(1, 1, 1), at(1, 0, 1 + noise), box(1, 1, 1), at(0, 0, 0));
    REQUIRE(found.size() == 2);
    CHECK(found[0].normal == Vec3(1, 0, 0));
  }
}

TEST_CASE("A sphere touches each kind of surface at its nearest point") {
  auto found = points(sphere(1), at(3, 1, -2), half_space(), at(0, 0, 0));
  REQUIRE(found.size() == 1);
  CHECK(found[0].position == Vec3(3, 0, -2));
  CHECK(found[0].gap == 0);
  CHECK(found[0].normal == Vec3(0, 1, 0));

  found = points(sphere(1), at(3, 0, 0), sphere(2), at(0, 0, 0));
  REQUIRE(found.size() == 1);
  CHECK(found[0].position == Vec3(2, 0, 0));
  CHECK(found[0].normal == Vec3(1, 0, 0));

  found = points(sphere(1), at(0.25, 1.5, 0), box(1, 1, 1), at(0, 0, 0));  // on a face
  REQUIRE(found.size() == 1);
  CHECK(found[0].position == Vec3(0.25, 0.5, 0));
  CHECK(found[0].normal == Vec3(0, 1, 0));
  CHECK(found[0].gap == 0);

  const double r2 = std::sqrt(0.5), r3 = std::sqrt(1.0 / 3);
  found = points(sphere(1), at(0.5 + r2, 0.5 + r2, 0.1), box(1, 1, 1), at(0, 0, 0));  // on an edge
  REQUIRE(found.size() == 1);
  CHECK((found[0].position - Vec3(0.5, 0.5, 0.1)).norm() < 4e-16);
  CHECK((found[0].normal - Vec3(r2, r2, 0)).norm() < 4e-16);
  found = points(sphere(1), at(0.5 + r3, 0.5 + r3, -0.5 - r3), box(1, 1, 1), at(0, 0, 0));  // on a corner
  REQUIRE(found.size() == 1);
  CHECK((found[0].position - Vec3(0.5, 0.5, -0.5)).norm() < 4e-16);
}

TEST_CASE("A sphere whose centre is inside a box is pushed out through the nearest face") {
  const auto found = points(sphere(0.25), at(0.1, -0.4, 0.2), box(1, 1, 1), at(0, 0, 0));
  REQUIRE(found.size() == 1);
  CHECK(found[0].normal == Vec3(0, -1, 0));
  CHECK(found[0].gap == Approx(-0.35));
  // Sphere's surface at -0.4 + 0.25 = -0.15, box's at -0.5: halfway is -0.325.
  CHECK((found[0].position - Vec3(0.1, -0.325, 0.2)).norm() < 1e-15);
  // In the middle of the cube all faces are equal: the first axis.
  CHECK(points(sphere(0.25), at(0, 0, 0), box(1, 1, 1), at(0, 0, 0))[0].normal == Vec3(1, 0, 0));
}

namespace {

struct Pair {
  Shape a, b;
  Pose pose_a, pose_b;
};

// Random pairs that overlap a little, of every kind.
std::vector<Pair> overlapping_pairs(unsigned seed, int count) {
  Random random(seed);
  std::vector<Pair> pairs;
  while (static_cast<int>(pairs.size()) < count) {
    const auto shape = [&random](int kind) {
      const double x = random.in(0.5, 2), y = random.in(0.5, 2), z = random.in(0.5, 2);
      return kind == 0 ? box(x, y, z) : kind == 1 ? sphere(x) : half_space();
    };
    const int i = static_cast<int>(pairs.size()) % 5;
    const int kinds[5][2] = {{0, 0}, {0, 1}, {1, 1}, {0, 2}, {1, 2}};
    Pair pair{shape(kinds[i][0]), shape(kinds[i][1]), random.pose(1.5), random.pose(1.5)};
    const double gap = separation(pair.a, pair.pose_a, pair.b, pair.pose_b);
    if (gap > -0.01 || gap < -0.3) continue;
    pairs.push_back(pair);
  }
  return pairs;
}

}  // namespace

TEST_CASE("A common rigid motion moves contact points and turns normals with it") {
  Random random(11);
  for (const Pair& pair : overlapping_pairs(5, 500)) {
    const auto before = points(pair.a, pair.pose_a, pair.b, pair.pose_b);
    REQUIRE(!before.empty());
    const Pose motion = random.pose(3);
    const auto after = points(pair.a, motion * pair.pose_a, pair.b, motion * pair.pose_b);
    auto moved = before;
    for (ContactPoint& p : moved) {
      p.position = motion * p.position;
      p.normal = motion.q * p.normal;
    }
    CHECK(set_difference(moved, after) < 1e-12);
  }
}

TEST_CASE("Swapping the shapes turns the normal round and keeps gap and depth") {
  for (const Pair& pair : overlapping_pairs(6, 500)) {
    const auto forward = points(pair.a, pair.pose_a, pair.b, pair.pose_b);
    const auto backward = points(pair.b, pair.pose_b, pair.a, pair.pose_a);
    CHECK(set_difference(forward, backward, -1) < 1e-12);
  }
}

TEST_CASE("A mirror image has the mirror image's contact points") {
  // Mirror in x: positions (-x, y, z), rotation (w, x, -y, -z); boxes and spheres are their own mirror images.
  const auto mirror = [](const Pose& p) {
    return at(Vec3(-p.p.x(), p.p.y(), p.p.z()), Quat(p.q.w(), p.q.x(), -p.q.y(), -p.q.z()));
  };
  const auto flip = [](const Vec3& x) { return Vec3(-x.x(), x.y(), x.z()); };
  for (const Pair& pair : overlapping_pairs(7, 500)) {
    auto forward = points(pair.a, pair.pose_a, pair.b, pair.pose_b);
    const auto mirrored = points(pair.a, mirror(pair.pose_a), pair.b, mirror(pair.pose_b));
    for (ContactPoint& p : forward) {
      p.position = flip(p.position);
      p.normal = flip(p.normal);
    }
    CHECK(set_difference(forward, mirrored) < 1e-12);
  }
}

TEST_CASE("Normals push a away from b, and the deepest point is as deep as the shapes overlap") {
  for (const Pair& pair : overlapping_pairs(8, 1000)) {
    const double depth = -separation(pair.a, pair.pose_a, pair.b, pair.pose_b);
    const auto found = points(pair.a, pair.pose_a, pair.b, pair.pose_b);
    REQUIRE(!found.empty());
    double deepest = 0;
    for (const ContactPoint& p : found) {
      CHECK(std::abs(p.normal.norm() - 1) < 1e-12);
      deepest = std::max(deepest, -p.gap);
    }
    CHECK(deepest < depth + 1e-9);
    // Moved out by the overlap along the normal, the shapes just touch.
    Pose out = pair.pose_a;
    out.p += depth * found[0].normal;
    CHECK(std::abs(separation(pair.a, out, pair.b, pair.pose_b)) < 1e-8);
  }
}

TEST_CASE("Contact points lie halfway between points of both surfaces") {
  // Boxes just touching: found by moving a out of b along the contact normal.
  for (Pair pair : overlapping_pairs(9, 500)) {
    if (pair.a.kind != ShapeKind::box || pair.b.kind != ShapeKind::box) continue;
    const double depth = -separation(pair.a, pair.pose_a, pair.b, pair.pose_b);
    pair.pose_a.p += depth * points(pair.a, pair.pose_a, pair.b, pair.pose_b)[0].normal;
    const auto found = points(pair.a, pair.pose_a, pair.b, pair.pose_b);
    REQUIRE(!found.empty());
    for (const ContactPoint& p : found) {
      CHECK((nearest(pair.a, pair.pose_a, p.position) - p.position).norm() < 1e-8);
      CHECK((nearest(pair.b, pair.pose_b, p.position) - p.position).norm() < 1e-8);
    }
  }
}

TEST_CASE("A thousand kilometres from the origin a resting cube still touches") {
  const double far = 1e6;
  CHECK(points(box(1, 1, 1), at(far, far + 0.5, far), half_space(), at(far, far, far)).size() == 4);
  const Quat tilt = turn(0.4, Vec3(0.2, 0.1, 1));
  const Vec3 origin(far, -far, far / 3);
  CHECK(points(box(1, 1, 1), at(origin + tilt * Vec3(0, 0.5, 0), tilt), half_space(), at(origin, tilt)).size() == 4);
  CHECK(points(box(1, 1, 1), at(origin + tilt * Vec3(0, 1, 0), tilt), box(1, 1, 1), at(origin, tilt)).size() == 4);
}

TEST_CASE("a face with a grid of n x n points touches a plane in n^2 points that fill it evenly") {
  Shape ground;
  ground.kind = ShapeKind::half_space;
  Shape box;
  box.kind = ShapeKind::box;
  box.half_extents = Vec3(1, 0.5, 2);
  box.contact_grid = 5;
  std::vector<ContactPoint> out;
  contact_points(box, {Vec3(3, 0.5, 4), Quat::Identity()}, 0, ground, {}, 1, 1e-9, out);
  REQUIRE(out.size() == 25);
  Vec3 mean = Vec3::Zero(), square = Vec3::Zero();
  for (const ContactPoint& c : out) {
    CHECK(c.gap == Approx(0).margin(1e-15));
    CHECK(c.normal.y() == 1);
    mean += c.position / 25;
    square += (c.position - Vec3(3, 0, 4)).cwiseAbs2() / 25;
  }
  CHECK((mean - Vec3(3, 0, 4)).norm() < 1e-14);
  // Mean square of -1, -1/2, 0, 1/2, 1 is 1/2.
  CHECK(square.x() == Approx(0.5));
  CHECK(square.z() == Approx(2));
}

TEST_CASE("a box with a grid that stands on an edge touches in the points of that edge alone") {
  Shape ground;
  ground.kind = ShapeKind::half_space;
  Shape box;
  box.kind = ShapeKind::box;
  box.half_extents = Vec3::Constant(0.5);
  box.contact_grid = 4;
  std::vector<ContactPoint> out;
  const Quat turn(Eigen::AngleAxisd(M_PI / 4, Vec3::UnitZ()));
  contact_points(box, {Vec3(0, std::sqrt(0.5), 0), turn}, 0, ground, {}, 1, 1e-9, out);
  CHECK(out.size() == 4);
}

TEST_CASE("A contact of every two kinds lies halfway between their surfaces, with a gap as with an overlap") {
  const Shape ball = sphere(0.5), cube = box(1, 1, 1), drum = cylinder(0.5, 1), plane = half_space();
  const Shape rod = capsule(0.3, 0.4), block = box_hull(1, 1, 1);
  // Within the tolerance, and beyond it where more is looked at; each is 1 m high.
  for (const auto& [tolerance, reach] : {std::pair(0.1, 0.0), {1e-9, 0.1}})
    for (const double gap : {0.05, -0.05})
      for (const Shape& low : {plane, ball, cube, drum, rod, block})
        for (const Shape& high : {ball, cube, drum, rod, block}) {
          const double top = low.kind == ShapeKind::half_space ? 0 : 0.5;
          for (const bool swapped : {false, true}) {
            INFO(name(low.kind) << " below " << name(high.kind) << ", gap " << gap << ", looked for up to " << reach);
            std::vector<ContactPoint> points;
            const Pose above = at(0, top + gap + 0.5, 0), still = at(0, 0, 0);
            if (swapped)
              contact_points(low, still, 0, high, above, 1, tolerance, points, false, reach);
            else
              contact_points(high, above, 1, low, still, 0, tolerance, points, false, reach);
            REQUIRE(!points.empty());
            for (const ContactPoint& point : points) {
              CHECK(point.position.y() == Approx(top + gap / 2).margin(1e-14));
              CHECK(point.gap == Approx(gap).margin(1e-14));
              CHECK(point.normal.y() == Approx(swapped ? -1 : 1).margin(1e-14));
              CHECK(point.shape_a == (swapped ? 0 : 1));
              CHECK(point.shape_b == (swapped ? 1 : 0));
            }
          }
        }
}

TEST_CASE("a tilted box whose grid touches in part keeps every point of it, where a whole face keeps its corners") {
  Shape grid = box(1, 1, 1);
  grid.contact_grid = 5;
  const double tolerance = 1e-9;
  // Columns of the grid rise by a quarter of the tilt each: two of five are within the tolerance.
  for (const double rise : {0.0, 2.5e-9}) {
    const Pose tilted = at(Vec3(0, 0.5 + rise / 2, 0), turn(rise, Vec3::UnitZ()));
    std::vector<ContactPoint> all, corners;
    contact_points(grid, tilted, 0, half_space(), at(0, 0, 0), 1, tolerance, all);
    const int left_out = contact_points(grid, tilted, 0, half_space(), at(0, 0, 0), 1, tolerance, corners, true);
    CHECK(all.size() == (rise == 0 ? 25 : 10));
    CHECK(corners.size() == (rise == 0 ? 4 : 10));
    CHECK(left_out == (rise == 0 ? 21 : 0));
  }
}

namespace {

Shape box_with_grid(const Vec3& size, int grid) {
  Shape shape = box(size.x(), size.y(), size.z());
  shape.contact_grid = grid;
  return shape;
}

}  // namespace

TEST_CASE("the points of a grid are those of the surface in all directions, each halfway to the plane below it") {
  const Vec3 size(1, 0.6, 1.4);
  const Quat tilt = turn(0.3, Vec3(1, 0, 2));
  const Pose plane = at(Vec3(1, 2, 3), tilt);
  const Vec3 n = tilt * Vec3::UnitY();
  for (const int grid : {3, 4, 5})
    for (const double angle : {-0.4, 0.25}) {
      const Pose pose = at(Vec3(1, 2, 3) + 0.2 * n, turn(angle, Vec3(2, 1, -1)) * tilt);
      for (const double tolerance : {0.1, 0.35, 5.0}) {
        std::vector<Vec3> expected;
        for (int i = 0; i < grid; ++i)
          for (int j = 0; j < grid; ++j)
            for (int k = 0; k < grid; ++k) {
              const auto is_end = [grid](int m) { return m == 0 || m == grid - 1; };
              if (!is_end(i) && !is_end(j) && !is_end(k)) continue;
              const Vec3 part = Vec3(i, j, k) / (grid - 1) - Vec3::Constant(0.5);
              const Vec3 x = pose * size.cwiseProduct(part);
              const double gap = n.dot(x - plane.p);
              if (gap <= tolerance) expected.push_back(x - gap / 2 * n);
            }
        INFO(grid << " points along an edge, up to " << tolerance);
        std::vector<ContactPoint> out;
        CHECK(contact_points(box_with_grid(size, grid), pose, 0, half_space(), plane, 1, tolerance, out) == 0);
        check_positions(out, expected, 1e-14);
        for (const ContactPoint& c : out) CHECK(n.dot(c.position - plane.p) == Approx(c.gap / 2).margin(1e-14));
      }
    }
}

TEST_CASE("of a face, an edge or a corner that touches whole the corners of the box stand for its grid") {
  const auto left_out = [](const Shape& shape, const Pose& pose, double tolerance, std::size_t points) {
    std::vector<ContactPoint> out;
    const int more = contact_points(shape, pose, 0, half_space(), at(0, 0, 0), 1, tolerance, out, true);
    CHECK(out.size() == points);
    return more;
  };
  const double r2 = std::sqrt(0.5), r3 = std::sqrt(0.75);
  for (const int grid : {3, 4}) {
    const Shape cube = box_with_grid(Vec3::Ones(), grid);
    CHECK(left_out(cube, at(0, 0.5, 0), 1e-9, 4) == grid * grid - 4);
    for (const double way : {1.0, -1.0})
      for (const Vec3& along : {Vec3(1, 0, 0), Vec3(0, 0, 1)})
        CHECK(left_out(cube, at(Vec3(0, r2, 0), turn(way * pi / 4, along)), 1e-9, 2) == grid - 2);
    CHECK(left_out(cube, at(Vec3(0, r3, 0), corner_down()), 1e-9, 1) == 0);
    // A plate thinner than the tolerance touches with all of its points, which are no face.
    const Shape plate = box_with_grid(Vec3(1, 1e-3, 2), grid);
    const auto all = static_cast<std::size_t>(grid * grid * grid - (grid - 2) * (grid - 2) * (grid - 2));
    CHECK(left_out(plate, at(0, 0.5e-3, 0), 1e-9, 4) == grid * grid - 4);
    CHECK(left_out(plate, at(0, 0.5e-3, 0), 1.1e-3, all) == 0);
  }
  // Three points along an edge: the next one is a half of its rise up.
  const Shape cube = box_with_grid(Vec3::Ones(), 3);
  for (const double rise : {1e-3, -1e-3}) {
    const Pose pose = at(Vec3(0, 0.5 + std::abs(rise) / 2, 0), turn(rise, Vec3::UnitZ()));
    CHECK(left_out(cube, pose, 0.45e-3, 2) == 1);  // an edge
    CHECK(left_out(cube, pose, 0.55e-3, 6) == 0);
    CHECK(left_out(cube, pose, 1.05e-3, 4) == 5);  // the face
  }
}

TEST_CASE(
    "where edges cross and faces nearly lie on each other the corners that come next are there, with their gaps") {
  // Crossed beams, the upper one's lower face rising by 6 mm/m along x and falling by 4 mm/m along z.
  const double along_x = 6e-3, along_z = -4e-3, gap = 1e-4;
  const Quat tilt = turn(along_x, Vec3(0, 0, 1)) * turn(-along_z, Vec3(1, 0, 0));
  const auto rise = [&](double x, double z) { return along_x * x + along_z * z; };
  const Pose high = at(Vec3(0, 1 + gap - rise(-0.25, 0.25), 0), tilt), low = at(0, 0, 0);
  for (const int kind : {0, 1, 2, 3})
    for (const auto& [reach, corners] : {std::pair(0.0, 1), {1e-3, 1}, {2.5e-3, 2}, {4e-3, 3}, {8e-3, 4}}) {
      const bool swapped = kind % 2 == 1, hulls = kind >= 2;
      INFO(reach << (hulls ? " m, hulls" : " m, boxes"));
      const Shape beam = hulls ? box_hull(4, 1, 0.5) : box(4, 1, 0.5);
      const Shape other = hulls ? box_hull(0.5, 1, 4) : box(0.5, 1, 4);
      std::vector<ContactPoint> found;
      if (swapped)
        contact_points(other, low, 0, beam, high, 1, 2e-4, found, false, reach);
      else
        contact_points(beam, high, 0, other, low, 1, 2e-4, found, false, reach);
      std::vector<int> seen(4, 0);
      for (const ContactPoint& p : found) {
        const int corner = (p.position.x() > 0 ? 1 : 0) + (p.position.z() < 0 ? 2 : 0);
        seen[static_cast<std::size_t>(corner)] = 1;
        const double x = corner % 2 == 1 ? 0.25 : -0.25, z = corner >= 2 ? -0.25 : 0.25;
        const double expected = gap + rise(x, z) - rise(-0.25, 0.25);
        CHECK(p.gap == Approx(expected).margin(3e-5));
        CHECK((p.position - Vec3(x, 0.5 + expected / 2, z)).norm() < 4e-3);
        CHECK(std::abs(p.normal.y() - (swapped ? -1 : 1)) < 1e-4);
      }
      CHECK(std::count(seen.begin(), seen.end(), 1) == corners);
    }
}

TEST_CASE("corners that pass each other diagonally have one point where they touch, halfway to the face, else none") {
  // Nearest along the axis of the first face of the first shape that looks at the other: of axes that tie within the
  // tolerance that one counts. The edges are parallel to the face, or the one body is turned a little, so that two of
  // its corners come closest.
  const double tolerance = 2e-3, touching = 1.5e-3, passing = 2.3e-3;
  for (const Shape& cube : {box(1, 1, 1), box_hull(1, 1, 1)}) {
    for (const Vec3& way : {Vec3(1, 1, 1), Vec3(-1, 1, -1), Vec3(1, -1, -1), Vec3(-1, -1, 1)}) {
      for (const bool turned_is_first : {true, false}) {
        const double sign = turned_is_first ? 1 : -1;
        int first = 0;
        if (cube.kind == ShapeKind::hull)
          for (const Polytope::Face& face : cube.hull->polytope.faces) {
            face.normal.cwiseAbs().maxCoeff(&first);
            if (face.normal[first] * sign * way[first] < 0) break;
          }
        for (const double angle : {0.0, 3e-4}) {
          INFO((cube.kind == ShapeKind::box ? "box" : "hull")
               << ", way " << way.transpose() << ", turned " << (turned_is_first ? "first" : "second") << " by "
               << angle);
          const double about_z = sign * (first == 1 ? -1 : 1) * way.x() * way.y() * angle;
          const Quat turn(Eigen::AngleAxisd(about_z, Vec3::UnitZ()));
          const auto found_at = [&](double along_first) {
            Vec3 apart(2.7e-3, 2.7e-3, 2.7e-3);
            apart[first] = along_first;
            const Pose above = at((Vec3::Ones() + apart).cwiseProduct(way), turn), origin = at(0, 0, 0);
            std::vector<ContactPoint> found;
            if (turned_is_first)
              contact_points(cube, above, 0, cube, origin, 1, tolerance, found, false, 0.01);
            else
              contact_points(cube, origin, 0, cube, above, 1, tolerance, found, false, 0.01);
            return found;
          };
          CHECK(found_at(passing).empty());
          const std::vector<ContactPoint> found = found_at(touching);
          REQUIRE(found.size() == 1);
          const ContactPoint& point = found[0];
          // A face's normal: of the one or the other, which differ by the angle.
          CHECK((point.normal - sign * way[first] * Vec3(Vec3::Unit(first))).norm() < 1.5 * angle + 1e-12);
          CHECK(std::abs(point.gap - touching) < angle + 1e-12);
          // Where both corners are, to what they are apart and what the angle moves them.
          for (int k = 0; k < 3; ++k) CHECK(std::abs(point.position[k] - 0.5 * way[k]) < 3.5e-3);
          CHECK(point.position[first] == Approx((0.5 + 0.5 * point.gap) * way[first]).margin(2 * angle));
        }
      }
    }
  }
}

namespace {

/// A beam whose lower edge crosses the upper rim of a slab of 2 x 0.1 x 2 m at x = 1, z = 0: it leans out over the rim
/// by `lean`, turned by `askew` about the vertical, and the slab's face nearly lies on it.
struct OverRim {
  double lean, askew, beyond;  // rad; m, of the beam's middle from the rim
  Quat turned() const { return turn(askew, Vec3::UnitY()) * turn(-lean, Vec3::UnitZ()) * turn(pi / 4, Vec3::UnitX()); }
  Vec3 along() const { return turned() * Vec3::UnitX(); }
  /// Across both edges, upwards.
  Vec3 normal() const { return Vec3(0, 0, 1).cross(along()).normalized(); }
  /// Of the beam, whose cross section is a square with this side, `gap` above the rim.
  Pose pose(double side, double gap) const {
    const Vec3 lower_edge = turned() * Vec3(0, -side / 2, side / 2);  // from its middle
    return at(Vec3(1, 0.05, 0) + gap * normal() + beyond * along() - lower_edge, turned());
  }
};

}  // namespace

TEST_CASE("edges that cross where a face nearly lies on another are listed once, along the normal of both") {
  const double side = 0.1;
  // The last one's middle is below the slab's.
  for (const OverRim& rim : {OverRim{0.12, 0, 0}, OverRim{0.05, 1, 0}, OverRim{0.12, 0, 1.2}})
    for (const double gap : {0.0, 5e-4})
      for (const bool hulls : {false, true})
        for (const bool swapped : {false, true}) {
          INFO((hulls ? "hulls" : "boxes") << ", leaning by " << rim.lean << ", askew by " << rim.askew << ", middle "
                                           << rim.beyond << " m out, " << gap << " m above");
          Pose frame_of_beam, frame_of_slab;
          const auto made = [&](double x, double y, double z, Pose& frame) {
            std::vector<Vec3> corners;
            for (int k = 0; k < 8; ++k) corners.push_back(Vec3(k & 1 ? x : -x, k & 2 ? y : -y, k & 4 ? z : -z) / 2);
            return hulls ? hull(corners, &frame) : box(x, y, z);
          };
          const Shape beam = made(3, side, side, frame_of_beam), slab = made(2, 0.1, 2, frame_of_slab);
          const Pose above = rim.pose(side, gap) * frame_of_beam, below = frame_of_slab;
          std::vector<ContactPoint> found;
          if (swapped)
            contact_points(beam, above, 0, slab, below, 1, 1e-9, found, false, 1e-3);
          else
            contact_points(slab, below, 0, beam, above, 1, 1e-9, found, false, 1e-3);
          REQUIRE(found.size() == 1);
          CHECK((found[0].normal - (swapped ? 1 : -1) * rim.normal()).norm() < 1e-12);
          CHECK((found[0].position - (Vec3(1, 0.05, 0) + gap / 2 * rim.normal())).norm() < 1e-12);
          CHECK(found[0].gap == Approx(gap).margin(1e-14));
        }
}

TEST_CASE(
    "the corner that comes next is above the face that carries, also where the other's middle is below the first "
    "one's") {
  const double lean = 0.12, side = 0.1, inside = 0.3;
  const Pose beam = OverRim{lean, 0, 1.5 - inside}.pose(side, 0);
  const double end = inside * std::sin(lean);  // 0.036: of the lower edge, above the face; other corners are 0.07 up
  for (const bool swapped : {false, true}) {
    std::vector<ContactPoint> found;
    if (swapped)
      contact_points(box(3, side, side), beam, 0, box(2, 0.1, 2), at(0, 0, 0), 1, 1e-9, found, false, 0.04);
    else
      contact_points(box(2, 0.1, 2), at(0, 0, 0), 0, box(3, side, side), beam, 1, 1e-9, found, false, 0.04);
    REQUIRE(found.size() == 2);
    CHECK(found[1].gap == Approx(end).epsilon(1e-9));
    CHECK((found[1].position - Vec3(1 - inside * std::cos(lean), 0.05 + end / 2, 0)).norm() < 1e-9);
    CHECK((found[1].normal - Vec3(0, swapped ? 1 : -1, 0)).norm() < 1e-12);
  }
}

TEST_CASE(
    "of two that cross at a small angle the point between their ends is there where the ends are not near enough") {
  // Their ends are further apart than their middles by sine^2 / (2 * 0.2009 m), 0.49 mm: beyond the tolerance.
  const double tolerance = 1e-3, gap = 0.9e-3, angle = std::sqrt(2 * 0.2009 * 0.5e-3);
  for (const Shape& one : {capsule(0.1, 2), cylinder(0.1, 2)})
    for (const Shape& other : {capsule(0.1, 2), cylinder(0.1, 2)}) {
      INFO(name(one.kind) << " beside " << name(other.kind));
      std::vector<ContactPoint> found =
          points(one, at(0, 0, 0), other, at(Vec3(0.2 + gap, 0, 0), turn(angle, Vec3(1, 0, 0))), tolerance);
      REQUIRE(found.size() == 1);
      CHECK(found[0].gap == Approx(gap).epsilon(1e-6));
      CHECK((found[0].normal - Vec3(-1, 0, 0)).norm() < 1e-6);
      CHECK((found[0].position - Vec3(0.1 + gap / 2, 0, 0)).norm() < 1e-6);
    }
}
