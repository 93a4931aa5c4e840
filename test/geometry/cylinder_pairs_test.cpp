// Cylinders and discs on boxes, hulls, capsules and each other.
#include <algorithm>
#include <catch2/catch.hpp>

#include "geometry/shapes.h"
#include "placed_shapes.h"

using namespace cb;
using namespace cb::test;

namespace {

constexpr double tol = 1e-9;

Quat lying() { return turn(pi / 2, Vec3(0, 0, 1)); }  // y to -x
Motion moving(const Pose& pose, const Vec3& v = Vec3::Zero(), const Vec3& w = Vec3::Zero()) { return {pose, v, w}; }

// The most of n.x over a shape; |n| = 1.
double highest(const Shape& shape, const Pose& pose, const Vec3& n) {
  if (shape.kind == ShapeKind::cylinder) {
    const Vec3 local = pose.q.conjugate() * n;
    return n.dot(pose.p) + shape.half_extents.y() * std::abs(local.y()) +
           shape.radius * std::hypot(local.x(), local.z());
  }
  double most = -1e300;
  for (const Vec3& x : core_corners(shape, pose)) most = std::max(most, n.dot(x));
  return most + core_radius(shape);
}

double gap_along(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b, const Vec3& n) {
  return -highest(b, pose_b, -n) - highest(a, pose_a, n);
}

// The most that many directions say, each of the best made better at random: knows no feature.
double searched_gap(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b, Random& random) {
  constexpr int directions = 300, tries = 8;
  std::vector<std::pair<double, Vec3>> best;
  for (int i = 0; i < directions; ++i) {
    const double z = 1 - (2 * i + 1.0) / directions, s = std::sqrt(1 - z * z), angle = 2.399963229728653 * i;
    const Vec3 n(s * std::cos(angle), z, s * std::sin(angle));
    best.emplace_back(gap_along(a, pose_a, b, pose_b, n), n);
  }
  std::sort(best.begin(), best.end(), [](const auto& x, const auto& y) { return x.first > y.first; });
  double most = -1e300;
  for (int k = 0; k < 3; ++k) {
    auto [gap, n] = best[static_cast<std::size_t>(k)];
    for (double reach = 0.2; reach > 1e-7; reach *= 0.7)
      for (int t = 0; t < tries; ++t) {
        const Vec3 other = (n + random.vector(reach)).normalized();
        const double there = gap_along(a, pose_a, b, pose_b, other);
        if (there > gap) {
          gap = there;
          n = other;
          t = -1;
        }
      }
    most = std::max(most, gap);
  }
  return most;
}

Vec3 nearest_in(const Shape& shape, const Pose& pose, const Vec3& x) {
  const Vec3 q = pose.q.conjugate() * (x - pose.p);
  const double l = shape.half_extents.y();
  if (shape.kind == ShapeKind::box) return pose * q.cwiseMax(-shape.half_extents).cwiseMin(shape.half_extents);
  if (shape.kind == ShapeKind::cylinder) {
    const double across = std::hypot(q.x(), q.z()), within = across > shape.radius ? shape.radius / across : 1;
    return pose * Vec3(within * q.x(), std::clamp(q.y(), -l, l), within * q.z());
  }
  const Vec3 foot(0, std::clamp(q.y(), -l, l), 0), d = q - foot;
  return pose * (d.norm() > shape.radius ? Vec3(foot + shape.radius * d.normalized()) : q);
}

// Their distance from above, by alternating projections.
double projected_distance(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b) {
  Vec3 x = pose_a.p, y = x;
  for (int k = 0; k < 3000; ++k) {
    y = nearest_in(b, pose_b, x);
    x = nearest_in(a, pose_a, y);
  }
  return (x - y).norm();
}

Shape rock(Random& random) {
  std::vector<Vec3> corners;
  for (int i = 0; i < 12; ++i) corners.push_back(random.vector(0.8));
  return hull(corners);
}

Shape partner(Random& random, int k) {
  switch (k % 5) {
    case 0:
      return box(random.in(0.2, 2), random.in(0.2, 2), random.in(0.2, 2));
    case 1:
      return capsule(random.in(0.1, 0.5), random.in(0.1, 2));
    case 2:
      return rock(random);
    default:
      return cylinder(random.in(0.1, 1), k % 3 ? random.in(0.05, 2) : 0);
  }
}

// Moves b along `direction` until the two are `gap` apart, or a little less.
void bring_to(const Shape& a, const Pose& pose_a, const Shape& b, Pose& pose_b, const Vec3& direction, double gap) {
  pose_b.p = pose_a.p + 5 * direction;
  for (int k = 0; k < 60; ++k) pose_b.p -= (separation(a, pose_a, b, pose_b) - gap) * direction;
}

Shape prism(double radius, double length, int sides) {
  std::vector<Vec3> corners;
  for (int i = 0; i < sides; ++i)
    for (const double y : {-length / 2, length / 2})
      corners.push_back(Vec3(radius * std::cos(2 * pi * i / sides), y, radius * std::sin(2 * pi * i / sides)));
  return hull(corners);
}

}  // namespace

TEST_CASE("The distance of a cylinder is what the best of many directions says, and no more than any two points'") {
  Random random(71);
  for (int k = 0; k < 600; ++k) {
    const Shape can = cylinder(random.in(0.1, 1), k % 4 ? random.in(0.05, 2) : 0), other = partner(random, k);
    const Pose pose = random.pose(0.3);
    Pose there = random.pose(0.3);
    if (k % 7 == 0) there.q = pose.q;
    if (k % 7 == 1) there.q = pose.q * lying();
    const double apart[] = {0.3, 1e-6, 0, -1e-4};
    bring_to(can, pose, other, there, random.vector(1).normalized(), apart[(k / 5) % 4]);
    const double gap = separation(can, pose, other, there);
    CHECK(gap >= searched_gap(can, pose, other, there, random) - 1e-9);
    if (gap > 1e-3 && other.kind != ShapeKind::hull) CHECK(gap <= projected_distance(can, pose, other, there) + 1e-12);
  }
}

TEST_CASE("The way out of an overlap is what the best of many directions says, also of what lies nearly flat") {
  Random random(76);
  int overlaps = 0;
  for (int k = 0; k < 600; ++k) {
    const Shape can = cylinder(random.in(0.1, 1), k % 4 ? random.in(0.05, 2) : 0), other = partner(random, k % 3);
    const Pose pose = random.pose(0.3);
    const bool flat = k % 2 == 0;
    Pose there = random.pose(0.3);
    if (flat) there.q = pose.q * (k % 4 ? lying() : Quat::Identity()) * turn(1e-3, random.vector(1));
    const Vec3 way = flat ? Vec3(pose.q * Vec3(random.in(-0.3, 0.3), 1, random.in(-0.3, 0.3))) : random.vector(1);
    bring_to(can, pose, other, there, way.normalized(), flat ? -1e-4 : -0.04);
    const double gap = separation(can, pose, other, there);
    overlaps += gap < 0;
    INFO(k << ": " << name(other.kind) << " " << gap);
    CHECK(gap >= searched_gap(can, pose, other, there, random) - 1e-4 * std::abs(gap));
  }
  CHECK(overlaps > 550);
}

TEST_CASE("However far is looked, no point is nearer than the two are, and it is where both have their surfaces") {
  constexpr double reach = 0.3, deep = -1e-4;
  Random random(77);
  std::size_t open = 0;
  for (int k = 0; k < 3000; ++k) {
    const Shape can = k % 6 == 5 ? partner(random, k % 3) : cylinder(random.in(0.1, 1), k % 4 ? random.in(0.05, 2) : 0);
    const Shape other = partner(random, k);
    const Pose pose = random.pose(0.3);
    Pose there = random.pose(0.3);
    if (k % 2 == 0) there.q = pose.q * (k % 4 ? lying() : Quat::Identity()) * turn(random.in(0, 0.1), random.vector(1));
    const double apart[] = {0, 1e-2, deep};
    bring_to(can, pose, other, there, random.vector(1).normalized(), apart[k / 7 % 3]);
    const double gap = separation(can, pose, other, there);
    std::vector<ContactPoint> found;
    contact_points(can, pose, 0, other, there, 1, tol, found, false, reach);
    // A capsule's point may be that of a sphere within it; corners of a box may pass another's beyond its faces.
    const auto exact = [](const Shape& shape) { return shape.kind != ShapeKind::capsule; };
    const bool surfaces = can.kind == ShapeKind::cylinder && exact(other);
    for (const ContactPoint& p : found) {
      INFO(k << ": " << name(can.kind) << " " << name(other.kind) << " " << gap << " " << p.gap);
      CHECK(p.gap >= gap - tol);
      if (!surfaces) continue;
      const double rough = 0.02 * std::min(can.bounding_radius(), other.bounding_radius());
      const Vec3 half = p.gap / 2 * p.normal;
      const bool touches = p.gap <= std::max(0.0, gap) + tol;
      open += !touches;
      CHECK(std::abs(separation(can, pose, sphere(0), at(p.position + half))) <= rough);
      CHECK(std::abs(separation(other, there, sphere(0), at(p.position - half))) <= rough);
    }
  }
  CHECK(open > 2500);
}

TEST_CASE("A cylinder on the face of a huge box is as on a half-space: points, distance and time") {
  Random random(72);
  const Shape table = box(100, 2, 100);
  for (int k = 0; k < 600; ++k) {
    const Shape can = cylinder(random.in(0.1, 1), k % 4 ? random.in(0.1, 2) : 0);
    const Pose frame = k % 2 ? random.pose(3) : at(0, 0, 0);
    Pose pose = random.pose(0.5);
    if (k % 5 < 2) pose.q = turn(k % 5 ? 0 : std::pow(10, random.in(-9, -1)), Vec3(1, 0, 0.5));
    if (k % 5 == 2) pose.q = lying();
    pose.p.y() = 0;
    pose.p.y() -= separation(can, pose, half_space(), at(0, 0, 0)) - (k % 3 ? 0 : random.in(1e-8, 0.5));
    const Pose placed = frame * pose, top = frame * at(0, -1, 0);
    // Where the lowest point of a rim is, rounding says the less the flatter it is.
    const Vec3 up = pose.q.conjugate() * Vec3(0, 1, 0);
    const double rounding = 1e-13 + 1e-15 / std::hypot(up.x(), up.z());
    for (const double tolerance : {tol, 1e-3}) {
      const auto on_box = points(can, placed, table, top, tolerance),
                 on_plane = points(can, placed, half_space(), frame, tolerance);
      CHECK(set_difference(on_box, on_plane) <= rounding);
    }
    CHECK(separation(can, placed, table, top) == Approx(separation(can, placed, half_space(), frame)).margin(1e-13));
    const Motion motion = moving(placed, random.vector(3), random.vector(4));
    const double t = time_of_contact(can, motion, half_space(), moving(frame), tol, 0.1);
    if (k % 3 == 0) CHECK(time_of_contact(can, motion, table, moving(top), tol, 0.1) == Approx(t).margin(1e-8));
  }
}

TEST_CASE("A cylinder is between the prisms that it contains and that contain it") {
  Random random(73);
  constexpr int sides = 90;
  for (int k = 0; k < 60; ++k) {
    const double radius = random.in(0.2, 1), length = random.in(0.1, 2);
    const Shape can = cylinder(radius, length), inner = prism(radius, length, sides),
                outer = prism(radius / std::cos(pi / sides), length, sides);
    const Shape others[] = {capsule(0.3, 1), capsule(0.2, 0), box(1, 0.5, 0.7)};
    const Shape& other = others[k % 3];
    const Pose pose = random.pose(0.3);
    Pose there = random.pose(0.3);
    // Hulls among themselves: exact where they overlap.
    bring_to(can, pose, other, there, random.vector(1).normalized(), k % 3 < 2 ? random.in(-0.01, 0.3) : -0.01);
    // make_hull may turn the prism's frame.
    const Pose inner_pose = pose * inner.hull->frame, outer_pose = pose * outer.hull->frame;
    const double gap = separation(can, pose, other, there);
    CHECK(gap <= separation(inner, inner_pose, other, there) + 1e-12);
    CHECK(gap >= separation(outer, outer_pose, other, there) - 1e-12);
  }
}

TEST_CASE("Side by side a cylinder is a capsule, to what is beside both") {
  for (const double along : {0.0, 0.7, 1.9}) {
    const Shape can = cylinder(0.5, 2), rod = capsule(0.5, 2);
    const Pose pose = at(Vec3(along, 1, 0), lying());
    for (const Shape& other : {capsule(0.5, 3), box(3, 1, 3)}) {
      const Pose below = other.kind == ShapeKind::box ? at(0, 0, 0) : at(Vec3(0, 0, 0), lying());
      CHECK(set_difference(points(can, pose, other, below), points(rod, pose, other, below)) <= 1e-15);
    }
    const auto found = points(can, pose, cylinder(0.5, 3), at(Vec3(0, 0, 0), lying()));
    CHECK(set_difference(found, points(rod, pose, capsule(0.5, 3), at(Vec3(0, 0, 0), lying()))) <= 1e-15);
    REQUIRE(found.size() == 2);
    CHECK(std::abs(found[0].position.x() - found[1].position.x()) == Approx(std::min(2.0, 2.5 - along)));
  }
  // Crossed, and over a ridge: one point.
  CHECK(points(cylinder(0.5, 2), at(Vec3(0, 1, 0), lying()), cylinder(0.5, 2),
               at(Vec3(0, 0, 0), turn(pi / 2, Vec3(1, 0, 0))))
            .size() == 1);
}

TEST_CASE("A standing cylinder touches with four points of its rim, as far as there is something below them") {
  const Shape can = cylinder(0.5, 2);
  const auto count = [&](const Shape& below, const Pose& pose) {
    const auto found = points(can, at(0, 1, 0), below, pose);
    for (const ContactPoint& p : found) {
      CHECK((p.normal - Vec3(0, 1, 0)).norm() <= 1e-15);
      CHECK(std::abs(p.gap) <= 1e-15);
      CHECK(std::abs(p.position.y()) <= 1e-15);
      CHECK(std::hypot(p.position.x(), p.position.z()) <= 0.5 + 1e-15);
    }
    return found.size();
  };
  CHECK(count(box(4, 1, 4), at(0, -0.5, 0)) == 4);
  // The box ends at x = 0.3: two crossings, and three points of the rim.
  CHECK(count(box(4, 1, 4), at(-1.7, -0.5, 0)) == 5);
  // A post within the disc; a bar across it.
  CHECK(count(box(0.2, 1, 0.2), at(0.1, -0.5, 0)) == 4);
  CHECK(count(box(0.2, 1, 4), at(0, -0.5, 0)) == 6);
  // Discs: the smaller one's points, whichever it is; as many of either where they are alike; a lens.
  CHECK(count(cylinder(0.3, 1), at(0, -0.5, 0)) == 4);
  CHECK(count(cylinder(0.8, 1), at(0.1, -0.5, 0)) == 4);
  CHECK(count(cylinder(0.5, 1), at(0, -0.5, 0)) == 4);
  CHECK(count(cylinder(0.5, 0), at(0, 0, 0)) == 4);
  CHECK(count(cylinder(0.5, 1), at(0.4, -0.5, 0)) == 4);
  // Rods below its end: ends of what is under it.
  CHECK(count(capsule(0.1, 5), at(Vec3(0, -0.1, 0.3), lying())) == 2);
  CHECK(count(capsule(0.1, 0.2), at(Vec3(0, -0.1, 0.3), lying())) == 2);
  CHECK(count(capsule(0.1, 1), at(0, -0.6, 0)) == 1);
}

TEST_CASE("Points are on both surfaces, the same for either order and wherever both are moved") {
  Random random(74);
  std::size_t several = 0;
  for (int k = 0; k < 1500; ++k) {
    const Shape can = cylinder(random.in(0.1, 1), k % 4 ? random.in(0.05, 2) : 0), other = partner(random, k);
    const Pose pose = random.pose(0.3);
    Pose there = random.pose(0.3);
    if (k % 3 == 0) there.q = pose.q;
    if (k % 3 == 1) there.q = pose.q * lying() * turn(k % 2 ? 0 : std::pow(10, random.in(-10, -6)), random.vector(1));
    bring_to(can, pose, other, there, k % 3 ? random.vector(1).normalized() : pose.q * Vec3(0.3, 1, 0).normalized(),
             k % 2 ? 0 : random.in(0, 0.9) * tol);
    if (separation(can, pose, other, there) > tol) continue;  // not there yet: they come together at a small angle
    const auto found = points(can, pose, other, there);
    INFO(k << ": " << name(other.kind));
    REQUIRE(!found.empty());
    several += found.size() > 1;
    // The lowest point of a rim that is flat but for 1e-9 is where 1e-16 of the normal says.
    const double surface = k % 3 == 1 && k % 2 == 0 ? 1e-7 : 4 * tol;
    for (const ContactPoint& p : found) {
      CHECK(p.gap <= tol);
      CHECK(std::abs(p.normal.norm() - 1) <= 1e-14);
      const Shape point = sphere(0);
      CHECK(std::abs(separation(can, pose, point, at(p.position))) <= surface);
      CHECK(std::abs(separation(other, there, point, at(p.position))) <= surface);
    }
    // Cylinders in the order named decide which of two equal normals counts: gaps then differ within the tolerance.
    const auto swapped = points(other, there, can, pose);
    if (other.kind != ShapeKind::cylinder) CHECK(set_difference(found, swapped, -1) <= 1e-14);
    CHECK(separation(other, there, can, pose) == Approx(separation(can, pose, other, there)).margin(1e-14));
    const Pose frame = random.pose(2);
    CHECK(separation(can, frame * pose, other, frame * there) ==
          Approx(separation(can, pose, other, there)).margin(1e-13));
  }
  CHECK(several > 300);
}

TEST_CASE("What an end that is tilted over a face comes down on is on both, corners and crossings of the rim") {
  Random random(75);
  std::size_t beyond = 0;
  for (int k = 0; k < 300; ++k) {
    const Shape can = cylinder(random.in(0.3, 1), random.in(0.05, 1)),
                post = box(random.in(0.1, 1), 1, random.in(0.1, 3));
    const Pose there = at(Vec3(0, -0.5, 0), turn(random.in(0, 3), Vec3(0, 1, 0)));
    Pose pose{Vec3(random.in(-0.2, 0.2), 2, random.in(-0.2, 0.2)), Quat::Identity()};
    pose.q = turn(random.in(0.02, 0.5), Vec3(random.in(-1, 1), 0, random.in(-1, 1)).normalized()) *
             turn(random.in(0, 3), Vec3(0, 1, 0));
    for (int i = 0; i < 100; ++i) pose.p.y() -= separation(can, pose, post, there);
    std::vector<ContactPoint> found;
    contact_points(can, pose, 0, post, there, 1, tol, found, false, 1);
    for (const ContactPoint& p : found) {
      if (p.normal.y() < 1 - 1e-12) continue;
      INFO(k << ": gap " << p.gap);
      beyond += p.gap > 0.01;
      const Vec3 half = p.gap / 2 * p.normal;
      CHECK((nearest_in(can, pose, p.position + half) - (p.position + half)).norm() < 1e-8);
      CHECK((nearest_in(post, there, p.position - half) - (p.position - half)).norm() < 1e-8);
    }
  }
  CHECK(beyond > 300);
}

TEST_CASE("A million metres away a cylinder touches as at the origin") {
  const Vec3 far(1e6, -1e6, 1e6);
  for (const Shape& below : {box(2, 1, 2), cylinder(0.7, 1)})
    for (const Quat& q : {Quat::Identity(), lying()}) {
      const Shape can = cylinder(0.25, 1);
      const double height = 0.5 + (q.w() == 1 ? 0.5 : 0.25);
      const auto near = points(can, at(Vec3(0, height, 0), q), below, at(0, 0, 0)),
                 away = points(can, at(far + Vec3(0, height, 0), q), below, at(far));
      REQUIRE(near.size() == away.size());
      for (std::size_t i = 0; i < near.size(); ++i) CHECK((near[i].position + far - away[i].position).norm() <= 1e-9);
    }
}

TEST_CASE("Random cylinders in flight never sink in before the time returned and touch at it") {
  Random random(75);
  int landed = 0;
  for (int k = 0; k < 1500; ++k) {
    const Shape can = cylinder(random.in(0.1, 1), k % 4 ? random.in(0.05, 2) : 0), other = partner(random, k);
    Motion a = moving(random.pose(2), random.vector(2), random.vector(4)),
           b = moving(random.pose(2), random.vector(2), random.vector(4));
    if (k % 6 == 0) b.v = b.w = Vec3::Zero();
    if (k % 6 == 1) a.w = 10 * (a.pose.q * Vec3(0, 1, 0));
    a.v += 3 * (b.pose.p - a.pose.p);
    if (separation(can, a.pose, other, b.pose) < 1e-6) continue;
    const double horizon = std::pow(10, random.in(-2, 0));
    const double t =
        k % 2 ? time_of_contact(can, a, other, b, tol, horizon) : time_of_contact(other, b, can, a, tol, horizon);
    INFO(k << ": " << name(other.kind));
    for (int sample = 0; sample <= 50; ++sample) {
      const double s = t * sample / 50;
      CHECK(separation(can, advance(a, s), other, advance(b, s)) >= 0);
    }
    if (t == horizon) continue;
    ++landed;
    CHECK(separation(can, advance(a, t), other, advance(b, t)) <= tol);
    CHECK(!points(can, advance(a, t), other, advance(b, t), tol).empty());
  }
  CHECK(landed > 400);
}

TEST_CASE("Cylinders that touch and turn find what closes next, before anything is deep") {
  Random random(76);
  int next = 0;
  for (int k = 0; k < 600; ++k) {
    const Shape can = cylinder(random.in(0.1, 1), random.in(0.05, 2)), other = partner(random, k);
    Motion a = moving(random.pose(0.3)), b = moving(random.pose(0.3));
    if (k % 3 == 0) b.pose.q = a.pose.q * turn(random.in(0, 0.01), random.vector(1));
    if (k % 3 == 1) b.pose.q = a.pose.q * lying() * turn(random.in(0, 0.01), random.vector(1));
    bring_to(can, a.pose, other, b.pose, random.vector(1).normalized(), tol / 2);
    const auto touching = points(can, a.pose, other, b.pose, tol);
    if (separation(can, a.pose, other, b.pose) > tol) continue;
    REQUIRE(!touching.empty());
    // It turns about a point that touches: that one stays.
    a.w = random.vector(1);
    a.v = -a.w.cross(touching[0].position - a.pose.p);
    const double horizon = k % 2 ? 1e-3 : 1e-2, t = time_of_contact(can, a, other, b, tol, horizon);
    next += t < horizon;
    // Arcs: second order in the horizon, and what of the points approaches is the caller's.
    double approach = 0;
    for (const ContactPoint& p : touching)
      approach = std::max(approach, -p.normal.dot(a.v + a.w.cross(p.position - a.pose.p)));
    const double arcs = approach * horizon + 6 * a.w.squaredNorm() * horizon * horizon + 4 * tol;
    INFO(k << ": " << name(other.kind));
    for (int sample = 0; sample <= 20; ++sample)
      CHECK(separation(can, advance(a, t * sample / 20), other, advance(b, t * sample / 20)) >= -arcs);
  }
  CHECK(next > 30);
}

TEST_CASE("What is closed is left aside: a cylinder that stands, rolls or slides on a box") {
  const Shape table = box(4, 1, 4), can = cylinder(0.25, 1);
  const Motion still = moving(at(0, -0.5, 0));
  for (const Vec3& v : {Vec3(0, 0, 0), Vec3(1, 0, 0.3)}) {
    CHECK(time_of_contact(can, moving(at(0, 0.5, 0), v, Vec3(0, 3, 0)), table, still, tol, 1e-2) == 1e-2);
    // Rolls: about its own axis, along x.
    CHECK(time_of_contact(can, moving(at(Vec3(0, 0.25, 0), lying()), v, Vec3(v.z() / 0.25, 0, 0)), table, still, tol,
                          1e-2) == 1e-2);
  }
  // Beside another one, side by side, both turning; a hair above it.
  for (const double gap : {0.0, 1.01e-9}) {
    const Motion upper = moving(at(Vec3(0, 0.5 + gap, 0), lying()), Vec3::Zero(), Vec3(30, 0, 0)),
                 lower = moving(at(Vec3(0.2, 0, 0), lying()), Vec3::Zero(), Vec3(-30, 0, 0));
    CHECK(time_of_contact(can, upper, can, lower, tol, 1e-2) == 1e-2);
  }
}

TEST_CASE("A cylinder that leans on one end lies down on a box when it does on the ground, or on its edge") {
  const Shape can = cylinder(0.25, 2);
  for (const double tilt : {1e-2, 1e-5}) {
    // On the lowest point of one end, the other one up by `tilt`; turns down about it.
    const Quat q = turn(tilt, Vec3(0, 0, 1)) * lying();
    const Vec3 low = q * Vec3(-0.25, 1, 0) + Vec3(0, 0, 0), w(0, 0, -0.5);
    const Pose pose = at(-low, q);
    const Motion tipping = moving(pose, w.cross(-low), w);
    const double ground = time_of_contact(can, tipping, half_space(), moving(at(0, 0, 0)), tol, 1);
    CHECK(ground == Approx(tilt / 0.5).epsilon(0.03));
    CHECK(time_of_contact(can, tipping, box(6, 1, 6), moving(at(0, -0.5, 0)), tol, 1) == Approx(ground).epsilon(1e-6));
    // A box that ends under the middle of the cylinder: its edge.
    const double edge = time_of_contact(can, tipping, box(2, 1, 6), moving(at(0, -0.5, 0)), tol, 1);
    CHECK(edge == Approx(ground).epsilon(0.05));
  }
}

TEST_CASE("A capsule that leans on one end lies down on the end of a cylinder when it does on the ground") {
  const Shape rod = capsule(0.25, 2), drum = cylinder(3, 1);
  for (const double tilt : {1e-2, 1e-4}) {
    // Turns down about the middle of its lower ball, in less time than any point of it takes to go as far as it is
    // wide.
    const Quat q = turn(tilt, Vec3(0, 0, 1)) * lying();
    const Vec3 arm = q * Vec3(0, 1, 0), w(0, 0, -0.5), to_middle = arm.x() > 0 ? arm : Vec3(-arm);
    const Motion tipping = moving(at(Vec3(0, 0.25, 0) + to_middle, q), w.cross(to_middle), w);
    const double horizon = 3 * tilt / 0.5;
    const double ground = time_of_contact(rod, tipping, half_space(), moving(at(0, 0, 0)), tol, horizon);
    CHECK(ground == Approx(tilt / 0.5).epsilon(0.03));
    CHECK(time_of_contact(rod, tipping, drum, moving(at(0, -0.5, 0)), tol, horizon) == Approx(ground).epsilon(1e-3));
  }
}

TEST_CASE("A cylinder tips back onto its end on a box, and on another cylinder, when it stands flat on the ground") {
  const Shape can = cylinder(0.5, 2);
  for (const double tilt : {0.01, 1e-4, 1e-7}) {
    const Quat q = turn(-tilt, Vec3(0, 0, 1));
    const Vec3 w(0, 0, 0.5), arm = q * Vec3(-0.5, 1, 0);
    const Motion tipping = moving(at(Vec3(0.5, 0, 0) + arm, q), w.cross(arm), w);
    const double t = time_of_contact(can, tipping, half_space(), moving(at(0, 0, 0)), tol, 1);
    for (const Shape& below : {box(4, 1, 4), cylinder(1, 1)})
      CHECK(time_of_contact(can, tipping, below, moving(at(0, -0.5, 0)), tol, 1) ==
            Approx(t).epsilon(1e-3).margin(4 * tol));
  }
}

TEST_CASE("The lowest point is as deep as the two are, also where that is beside the face by less than is closed") {
  // A side along a box's face, about as high as the face's edge, and an end over another's rim, off by hairs.
  Random random(75);
  int deep = 0;
  for (int k = 0; k < 4000; ++k) {
    const Shape can = cylinder(random.in(0.05, 0.3), random.in(0.1, 0.4));
    const Shape other = k % 2 ? box(0.2, 0.4, random.in(0.1, 0.4)) : cylinder(random.in(0.05, 0.3), 0.4);
    const auto hair = [&](double most) { return std::pow(10, random.in(-9, most)) * (k % 4 < 2 ? 1 : -1); };
    const Quat tilt = turn(hair(-4), random.vector(1)) * turn(hair(-4), random.vector(1));
    Pose pose = at(Vec3(hair(-4), 0.2 + hair(-5), random.in(-0.1, 0.1)), tilt * turn(pi / 2, Vec3(1, 0, 0)));
    Vec3 towards(1, 0, 0);
    if (k % 2 == 0) {
      pose = at(Vec3(other.radius - can.radius + hair(-5), 0, 0), tilt);
      towards = Vec3(0, -1, 0);
    }
    const double want = -std::pow(10, random.in(-9, -6));
    pose.p -= towards;  // apart, then so deep
    for (int i = 0; i < 3; ++i) pose.p += towards * (separation(can, pose, other, at(0, 0, 0)) - want);
    const double gap = separation(can, pose, other, at(0, 0, 0));
    if (std::abs(gap - want) > tol) continue;
    deep += gap < -2 * tol;
    const auto found = points(can, pose, other, at(0, 0, 0));
    REQUIRE(!found.empty());
    double lowest = 1;
    for (const ContactPoint& p : found) lowest = std::min(lowest, p.gap);
    INFO(k << ": " << name(other.kind) << " " << gap << " " << lowest);
    CHECK(lowest <= gap + 2 * tol);
  }
  CHECK(deep > 2000);
}

TEST_CASE(
    "a cylinder that lies over an end or a face that is shorter touches where its line leaves that, gaps in between") {
  // Its lowest line is 0.24 m off the middle of an end of radius 0.4 m, or along a box: both are 0.64 m long there. It
  // rises by 1 mm/m.
  const double slope = 1e-3, gap = 2e-3;
  const Shape lying = cylinder(0.2, 1);
  for (const Shape& under : {cylinder(0.4, 0.6), box(0.64, 0.6, 1)})
    for (const double middle : {0.1, 0.4, -0.4}) {
      // Rises along x; the other way round along -x.
      for (const double way : {1.0, -1.0}) {
        INFO(static_cast<int>(under.kind) << ", " << middle << " m, " << way);
        const Pose pose = at(Vec3(middle, 0.3 + 0.2 + gap, 0.24), turn(way * slope - pi / 2, Vec3(0, 0, 1)));
        std::vector<ContactPoint> found;
        contact_points(lying, pose, 0, under, at(0, 0, 0), 1, 1e-9, found, false, 0.01);
        INFO(found.size() << " points");
        for (const double x : {std::max(-0.32, middle - 0.5), std::min(0.32, middle + 0.5)}) {
          const double expected = gap + way * slope * (x - middle);
          double nearest = 1;
          for (const ContactPoint& p : found)
            nearest =
                std::min(nearest, (p.position - Vec3(x, 0.3 + expected / 2, 0.24)).norm() + std::abs(p.gap - expected));
          CHECK(nearest < 1e-3);
        }
        for (const ContactPoint& p : found) {
          CHECK(p.gap == Approx(gap + way * slope * (p.position.x() - middle)).margin(2e-6));
          CHECK(p.normal.y() == Approx(1).epsilon(1e-5));
        }
      }
    }
}

TEST_CASE(
    "a box over the rim of an end touches with its corners, where its sides cross the rim, and with the rim's points") {
  // Over x from 0.1 to 0.5 and z up to 0.15 on both sides, on an end of radius 0.4 m: the sides cross at x = 0.371 m.
  // Its lower face rises along x by 1 mm/m, not at all, or falls; all of that is looked at.
  const double crossing = std::sqrt(0.4 * 0.4 - 0.15 * 0.15), gap = 2e-3;
  for (const Shape& upper : {box(0.4, 0.2, 0.3), box_hull(0.4, 0.2, 0.3)})
    for (const double slope : {1e-3, 0.0, -1e-3})
      for (int k = 0; k < 8; ++k) {
        const bool swapped = k >= 4;
        INFO(static_cast<int>(upper.kind) << ", " << slope);
        const Pose over = at(Vec3(0.3, 0.3 + gap + 0.1, 0), turn(slope, Vec3(0, 0, 1)));
        const Pose under = at(Vec3::Zero(), turn(k * pi / 2, Vec3(0, 1, 0)));
        std::vector<ContactPoint> found;
        if (swapped)
          contact_points(cylinder(0.4, 0.6), under, 0, upper, over, 1, 1e-9, found, false, 0.01);
        else
          contact_points(upper, over, 0, cylinder(0.4, 0.6), under, 1, 1e-9, found, false, 0.01);
        const auto gap_at = [&](double x) { return gap + slope * (x - 0.3); };
        for (const auto& [x, z] :
             {std::pair(0.1, 0.15), {0.1, -0.15}, {crossing, 0.15}, {crossing, -0.15}, {0.4, 0.0}}) {
          double nearest = 1;
          for (const ContactPoint& p : found)
            nearest = std::min(nearest, (p.position - Vec3(x, 0.3 + gap_at(x) / 2, z)).norm());
          CHECK(nearest < 5e-4);
        }
        CHECK(found.size() == 5);
        for (const ContactPoint& p : found) {
          CHECK(p.gap == Approx(gap_at(p.position.x())).margin(2e-6));
          CHECK(p.normal.y() == Approx(swapped ? -1 : 1).epsilon(1e-5));
        }
      }
}

TEST_CASE("of a cylinder that stands on a post no point is that of the end that looks up, however far is looked") {
  std::vector<ContactPoint> found;
  contact_points(cylinder(0.4, 0.3), at(0, 0.15, 0), 0, box(0.2, 1, 0.3), at(0, -0.5, 0), 1, tol, found, false, 0.5);
  CHECK(found.size() == 4);
  for (const ContactPoint& p : found) CHECK(std::abs(p.gap) <= tol);
}

TEST_CASE("the far end of a cylinder that touches another with one end, and rises from it, is as far as it is") {
  constexpr double rise = 0.1;
  for (const bool swapped : {false, true}) {
    const Shape low = cylinder(0.2, 0.6), high = cylinder(0.25, 0.5);
    const Pose under = at(Vec3::Zero(), lying());
    Pose over = at(Vec3(0, 1, 0), turn(rise, Vec3(0, 0, 1)) * lying());
    for (int k = 0; k < 60; ++k) over.p.y() -= separation(low, under, high, over);
    std::vector<ContactPoint> found;
    if (swapped)
      contact_points(high, over, 0, low, under, 1, tol, found, false, 0.2);
    else
      contact_points(low, under, 0, high, over, 1, tol, found, false, 0.2);
    REQUIRE(found.size() == 2);
    double furthest = 0;
    for (const ContactPoint& p : found) {
      const Vec3 half = p.gap / 2 * (swapped ? Vec3(-p.normal) : p.normal);
      CHECK(std::abs(separation(low, under, sphere(0), at(p.position + half))) <= 1e-5);
      CHECK(std::abs(separation(high, over, sphere(0), at(p.position - half))) <= 1e-5);
      furthest = std::max(furthest, p.gap);
    }
    CHECK(furthest > 0.9 * 0.5 * std::sin(rise));
    CHECK(furthest <= 0.5 * std::sin(rise) + tol);  // the whole line's
  }
}
