// Which features of boxes, hulls and segments are nearest, outermost or in common, by what they are defined to be.
#include <catch2/catch.hpp>

#include "geometry/box_box.h"
#include "geometry/core.h"
#include "geometry/core_time.h"
#include "geometry/placed_shapes.h"

using namespace cb;
using namespace cb::test;

namespace {

PlacedCore core_at(const Shape& shape, const Pose& pose) {
  PlacedCore core;
  core.place(shape, pose, Vec3::Zero());
  return core;
}

Shape rock(Random& random, int count) {
  std::vector<Vec3> corners;
  for (int i = 0; i < count; ++i) corners.push_back(random.rotation() * Vec3::UnitX());
  return hull(corners);
}

/// Of two segments, by nothing but the foot on each of the other's point, again and again.
double distance_by_feet(const Vec3& p, const Vec3& u, const Vec3& q, const Vec3& v) {
  double s = 0.5, t = 0.5;
  for (int k = 0; k < 4000; ++k) {
    t = v.squaredNorm() > 0 ? std::clamp((p + s * u - q).dot(v) / v.squaredNorm(), 0.0, 1.0) : 0;
    s = u.squaredNorm() > 0 ? std::clamp((q + t * v - p).dot(u) / u.squaredNorm(), 0.0, 1.0) : 0;
  }
  return (p + s * u - q - t * v).norm();
}

}  // namespace

TEST_CASE("Two segments are nearest where no foot of one on the other is nearer, crossed, parallel or without length") {
  Random random(491);
  for (int k = 0; k < 400; ++k) {
    const Vec3 p = random.vector(1), q = random.vector(1);
    Vec3 u = random.vector(1), v = random.vector(1);
    if (k % 4 == 1) v = (k % 8 == 1 ? 0.5 : -0.5) * u;
    if (k % 4 == 2) v = u + 0.3 * random.vector(1);
    if (k % 16 == 3) u.setZero();
    if (k % 32 == 7) v.setZero();
    const SegmentPair at = closest(p, u, q, v);
    CHECK(at.s >= 0);
    CHECK(at.s <= 1);
    CHECK(at.t >= 0);
    CHECK(at.t <= 1);
    CHECK((at.a - (p + at.s * u)).norm() < 1e-14);
    CHECK((at.b - (q + at.t * v)).norm() < 1e-14);
    CHECK(at.distance2 == Approx((at.a - at.b).squaredNorm()).margin(1e-15));
    CHECK(std::sqrt(at.distance2) <= distance_by_feet(p, u, q, v) + 1e-12);
  }
}

TEST_CASE("Segments that cross at the smallest of angles are as near as their lines, not as their ends") {
  // 1 m long, across each other at their middles and 1e-4 m apart there.
  for (const double angle : {1e-1, 1e-4, 1e-7, 3e-10}) {
    const Vec3 u = Vec3::UnitX(), v(std::cos(angle), std::sin(angle), 0);
    const SegmentPair at = closest(-0.5 * u, u, Vec3(0, 0, 1e-4) - 0.5 * v, v);
    CHECK(std::sqrt(at.distance2) == Approx(1e-4).epsilon(1e-12));
    if (angle > 1e-5) CHECK(at.s == Approx(0.5).epsilon(1e-6));
  }
}

TEST_CASE("An edge falls away on both sides along its faces") {
  Random random(492);
  for (int k = 0; k < 30; ++k) {
    const Shape shape = k % 2 ? rock(random, 8) : box(1, 2, 0.5);
    const PlacedCore core = core_at(shape, random.pose(2));
    Vec3 middle = Vec3::Zero();
    for (const Vec3& x : core.x) middle += x / static_cast<double>(core.x.size());
    for (int e = 0; e < core.edges(); ++e) {
      const EdgeOf edge = edge_of(core, e);
      const Polytope::Edge& of = core.form->edges[static_cast<std::size_t>(e)];
      CHECK(edge.sides == 2);
      CHECK((edge.e - core.along(e).normalized()).norm() < 1e-14);
      CHECK((edge.x - core.x[static_cast<std::size_t>(of.from)]).norm() < 1e-14);
      // Two faces have the edge's ends; one direction lies in each, out of it beyond the edge.
      for (const int face : {of.left, of.right}) {
        const Vec3 n = core.n[static_cast<std::size_t>(face)];
        int along = 0;
        for (const Vec3& away : edge.away) {
          CHECK(away.norm() == Approx(1));
          CHECK(std::abs(away.dot(edge.e)) < 1e-13);
          if (std::abs(away.dot(n)) > 1e-9) continue;
          ++along;
          const Polytope::Face& around = core.form->faces[static_cast<std::size_t>(face)];
          for (int c = 0; c < around.count; ++c)
            CHECK(away.dot(core.x[static_cast<std::size_t>(core.form->corner(around, c))] - edge.x) < 1e-9);
        }
        CHECK(along == 1);
      }
      CHECK((edge.away[0] - edge.away[1]).norm() > 1e-3);
    }
    const Shape capsule_2 = capsule(0.2, 2);
    const EdgeOf rod = edge_of(core_at(capsule_2, at(1, 2, 3)), 0);
    CHECK(rod.sides == 0);
    CHECK(std::abs(rod.e.y()) == Approx(1));
  }
}

TEST_CASE("The least way out of a box or a hull for a ball or a rod that is deep in it is the least over all normals") {
  Random random(493);
  int deep = 0;
  for (int k = 0; k < 600; ++k) {
    const Shape rod = k % 5 ? capsule(random.in(0.05, 0.3), random.in(0.1, 1.5)) : sphere(0.3);
    const Shape solid = k % 2 ? rock(random, 10) : k % 3 ? box(1, 2, 0.5) : box_hull(1, 2, 0.5);
    const Pose pose = random.pose(0.7), there = at(random.vector(0.1), random.rotation());
    const double gap = separation(rod, pose, solid, there), certified = certified_gap(rod, pose, solid, there);
    CHECK(gap == Approx(certified).margin(1e-10));
    if (gap > -rod.radius) continue;
    ++deep;
    // Out along the normal, and not by less.
    const auto found = points(rod, pose, solid, there);
    REQUIRE(!found.empty());
    double deepest = 0;
    Vec3 n = Vec3::Zero();
    for (const ContactPoint& p : found)
      if (p.gap < deepest) {
        deepest = p.gap;
        n = p.normal;
      }
    CHECK(deepest == Approx(gap).margin(1e-9));
    CHECK(std::abs(certified_gap(rod, at(pose.p - gap * n, pose.q), solid, there)) < 1e-9);
  }
  CHECK(deep > 200);
}

TEST_CASE("Corners of what the faces of two boxes have in common are where their names say, each once") {
  Random random(494);
  int of_reference = 0, crossings = 0;
  for (int k = 0; k < 300; ++k) {
    const Shape one = box(random.in(0.5, 2), random.in(0.5, 2), random.in(0.5, 2));
    const Shape other = box(random.in(0.5, 2), random.in(0.5, 2), random.in(0.5, 2));
    // One face of each at the other, turned about their normal and leaning a little, over any of the three axes.
    const int axis = k % 6;
    const Vec3 e = Vec3::Unit(axis % 3), aside = random.vector(0.4);
    const Pose frame = random.pose(1);
    const double reach = one.half_extents[axis % 3] + other.half_extents[axis % 3] + 0.05;
    const Pose pose = frame * at((k % 4 < 2 ? 1 : -1) * reach * e + aside - aside.dot(e) * e,
                                 (turn(0.02, random.vector(1)) * turn(random.in(-3, 3), e)).normalized());
    const PlacedBox a(one, frame), b(other, pose);
    FacePatch patch;
    face_patch(a, b, RelativeBox(a, b), axis, 1e-9, patch);
    CHECK(patch.reference_is_a == (axis < 3));
    CHECK(patch.axis == axis % 3);
    const PlacedBox &reference = axis < 3 ? a : b, &incident = axis < 3 ? b : a;
    CHECK((patch.n - (axis < 3 ? 1 : -1) * (k % 4 < 2 ? 1 : -1) * (frame.q * e)).norm() < 0.03);
    const int iu = (axis + 1) % 3, iv = (axis + 2) % 3;
    const Vec3 out = reference.R * patch.incident;
    CHECK(out.dot(patch.n) < -0.99);
    std::vector<int> ids;
    for (int i = 0; i < patch.count; ++i) {
      const PatchPoint& p = patch.point[i];
      ids.push_back(p.id);
      const double h_u = reference.h[iu], h_v = reference.h[iv];
      CHECK(std::abs(p.u) <= h_u + 2e-9);
      CHECK(std::abs(p.v) <= h_v + 2e-9);
      const Vec3 on_incident = reference.c + p.u * reference.R.col(iu) + p.v * reference.R.col(iv) +
                               (reference.h[patch.axis] + p.gap) * patch.n;
      const Vec3 local = incident.R.transpose() * (on_incident - incident.c);
      // It is on the incident face.
      int j = 0;
      (incident.R.transpose() * out).cwiseAbs().maxCoeff(&j);
      CHECK(std::abs(std::abs(local[j]) - incident.h[j]) < 1e-9);
      const auto at_side = [&](int axis_of) { return std::abs(std::abs(local[axis_of]) - incident.h[axis_of]) < 1e-9; };
      if (p.id < 4) {
        CHECK(at_side(patch.incident_u));
        CHECK(at_side(patch.incident_v));
        CHECK((local[patch.incident_u] > 0) == (p.id == 1 || p.id == 2));
        CHECK((local[patch.incident_v] > 0) == (p.id >= 2));
      } else if (p.id < 8) {
        ++of_reference;
        CHECK(std::abs(p.u) == Approx(h_u));
        CHECK(std::abs(p.v) == Approx(h_v));
      } else {
        ++crossings;
        const int edge = (p.id - 8) / 4, side = (p.id - 8) % 4;
        // Edges 0 and 2 run along u, at the low and the high end of v; 1 and 3 along v, at the high and the low of u.
        const int across = edge % 2 == 0 ? patch.incident_v : patch.incident_u;
        CHECK(at_side(across));
        CHECK((local[across] > 0) == (edge == 1 || edge == 2));
        const double expected[] = {h_u, -h_u, h_v, -h_v};
        CHECK((side < 2 ? p.u : p.v) == Approx(expected[side]));
      }
    }
    std::sort(ids.begin(), ids.end());
    CHECK(std::adjacent_find(ids.begin(), ids.end()) == ids.end());
  }
  CHECK(of_reference > 50);
  CHECK(crossings > 300);
}

TEST_CASE("Corners of what the faces of two hulls have in common are where their names say, each once") {
  Random random(495);
  int counts[3] = {0, 0, 0};
  for (int k = 0; k < 300; ++k) {
    const Shape one = rock(random, 10), other = k % 2 ? rock(random, 10) : box(1.2, 0.8, 1);
    const PlacedCore reference = core_at(one, random.pose(1));
    const int face = k % static_cast<int>(reference.n.size());
    // A face of the other opposite to it, leaning a little.
    const Polytope& form = core_of(other);
    const Vec3 n = reference.n[static_cast<std::size_t>(face)];
    const Polytope::Face& opposite = form.faces[static_cast<std::size_t>(k) % form.faces.size()];
    Pose pose;
    pose.q = (turn(0.01, random.vector(1)) * turn(random.in(-3, 3), n) * Quat::FromTwoVectors(opposite.normal, -n))
                 .normalized();
    Vec3 middle = Vec3::Zero();
    const Polytope::Face& around = reference.form->faces[static_cast<std::size_t>(face)];
    for (int c = 0; c < around.count; ++c)
      middle += reference.x[static_cast<std::size_t>(reference.form->corner(around, c))] / around.count;
    PlacedCore placed = core_at(other, pose);
    double lowest = 1e9;
    for (const Vec3& x : placed.x) lowest = std::min(lowest, n.dot(x));
    Vec3 over = Vec3::Zero();
    for (int c = 0; c < opposite.count; ++c) {
      const int vertex = form.corner(opposite, c);
      over += placed.x[static_cast<std::size_t>(vertex)] / opposite.count;
    }
    pose.p = middle - over;
    pose.p += (0.03 + n.dot(middle) - lowest - n.dot(pose.p)) * n + 0.3 * random.vector(1).cross(n);
    placed = core_at(other, pose);
    CorePatch patch;
    face_patch(reference, placed, face, 1e-9, patch);
    const Polytope::Face& incident = placed.form->faces[static_cast<std::size_t>(patch.incident)];
    std::vector<std::uint64_t> ids;
    for (const CorePatchPoint& p : patch.point) {
      ids.push_back(p.id);
      ++counts[p.kind];
      CHECK(n.dot(p.foot) == Approx(reference.offset[static_cast<std::size_t>(face)]).margin(1e-9));
      const Vec3 above = p.foot + p.gap * n;
      CHECK(placed.n[static_cast<std::size_t>(patch.incident)].dot(above) ==
            Approx(placed.offset[static_cast<std::size_t>(patch.incident)]).margin(1e-9));
      const auto beside = [](const Vec3& x, const Vec3& from, const Vec3& to) {
        return (x - from).cross((to - from).normalized()).norm();
      };
      if (p.kind == CorePatchPoint::vertex_over_face) {
        CHECK((above - placed.x[static_cast<std::size_t>(p.incident)]).norm() < 1e-9);
      } else if (p.kind == CorePatchPoint::face_over_vertex) {
        CHECK((p.foot - reference.x[static_cast<std::size_t>(p.reference)]).norm() < 1e-8);
      } else {
        const auto corner = [](const PlacedCore& core, const Polytope::Face& of, int c) {
          return core.x[static_cast<std::size_t>(core.form->corner(of, c))];
        };
        CHECK(beside(p.foot, corner(reference, around, p.reference), corner(reference, around, p.reference + 1)) <
              1e-8);
        CHECK(beside(above, corner(placed, incident, p.incident), corner(placed, incident, p.incident + 1)) < 1e-8);
      }
    }
    std::sort(ids.begin(), ids.end());
    CHECK(std::adjacent_find(ids.begin(), ids.end()) == ids.end());
  }
  for (const int count : counts) CHECK(count > 30);
}

TEST_CASE("An earlier axis is kept unless a later one separates by more than the margin further") {
  // Cubes that are 0.1 m apart along x, and by 0.1 m and a bit along y.
  const Shape cube = box(1, 1, 1);
  for (const double bit : {0.5e-3, 1.5e-3})
    for (const double margin : {1e-3, 0.0})
      for (const double sign : {1.0, -1.0}) {
        const bool later = bit > margin;
        const PlacedBox a(cube, at(0, 0, 0)), b(cube, at(sign * 1.1, -sign * (1.1 + bit), 0.2));
        const SeparatingAxis axis = separating_axis(a, b, RelativeBox(a, b), margin);
        CHECK(axis.index == (later ? 1 : 0));
        CHECK(axis.gap == Approx(later ? 0.1 + bit : 0.1));
        CHECK((axis.normal_A - (later ? Vec3(0, -sign, 0) : Vec3(sign, 0, 0))).norm() < 1e-14);
        const Shape as_hull = box_hull(1, 1, 1);  // its core is looked at where it is
        const PlacedCore core_a = core_at(as_hull, at(0, 0, 0)),
                         core_b = core_at(as_hull, at(sign * 1.1, -sign * (1.1 + bit), 0.2));
        const CoreAxis of_cores = separating_axis(core_a, core_b, margin);
        CHECK(of_cores.kind == CoreAxis::Kind::face_a);
        CHECK(of_cores.gap >= 0.1 + bit - std::max(margin, 1e-12));
      }
  // The face of b separates better than a's, by more than the margin or less: turned by a hair about z.
  const double angle = 1e-3;
  for (const double margin : {1e-2, 0.0}) {
    const Pose turned = at(Vec3(1.2, 0.3, 0), turn(angle, Vec3::UnitZ()));
    const PlacedBox a(cube, at(0, 0, 0)), b(cube, turned);
    const SeparatingAxis axis = separating_axis(a, b, RelativeBox(a, b), margin);
    CHECK((axis.index < 3) == (margin > 0));
  }
}

TEST_CASE("what coordinates resolve is of their size, on whichever side of the origin") {
  const Vec3 near(1, -2, 0.5);
  for (int axis = 0; axis < 3; ++axis)
    for (const double far : {1e9, -1e9}) {
      Vec3 at = near;
      at[axis] = far;
      CHECK(largest_coordinate(at, near) == 1e9);
      CHECK(largest_coordinate(near, at) == 1e9);
      CHECK(resolved_tolerance(1e-9, at, near) == resolved_tolerance(1e-9, near, at));
      CHECK(resolved_tolerance(1e-9, at, near) > 1e-7);
    }
  CHECK(resolved_tolerance(1e-9, near, near) == 1e-9);
}
