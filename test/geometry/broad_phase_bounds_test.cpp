// Which pairs the broad phase names at the bounds of what may meet, by numbers that are worked out by hand.
#include <catch2/catch.hpp>

#include "geometry/box_grid.h"
#include "geometry/broad_phase.h"
#include "geometry/placed_shapes.h"

using namespace cb;
using namespace cb::test;

namespace {

using Pairs = std::vector<std::pair<int, int>>;

const auto all = [](int, int) { return true; };

struct Placed {
  Shape shape;
  Motion motion;
};

Placed placed(Shape shape, int body, const Pose& pose, const Vec3& v = Vec3::Zero(), const Vec3& w = Vec3::Zero()) {
  shape.body = body;
  return {shape, {pose, v, w}};
}
Placed plane(const Pose& pose, int body = -1) { return placed(half_space(), body, pose); }

Pairs pairs_of(BroadPhase& broad_phase, const std::vector<Placed>& scene, double margin, double horizon) {
  std::vector<Shape> shapes;
  std::vector<Motion> motions;
  for (const Placed& one : scene) {
    shapes.push_back(one.shape);
    motions.push_back(one.motion);
  }
  return broad_phase.pairs(shapes, motions, margin, horizon, all);
}
Pairs pairs_of(const std::vector<Placed>& scene, double margin, double horizon) {
  BroadPhase broad_phase;
  return pairs_of(broad_phase, scene, margin, horizon);
}
bool paired(const Placed& a, const Placed& b, double margin, double horizon) {
  const Pairs one = pairs_of({a, b}, margin, horizon), other = pairs_of({b, a}, margin, horizon);
  CHECK(one == other);
  return one == Pairs{{0, 1}};
}

}  // namespace

TEST_CASE("What is over a plane is paired with it by its height, its fall and its turning within the horizon") {
  constexpr double margin = 0.1, horizon = 0.02;
  // Heights above its extent, as a part of what it may be.
  const auto check = [&](const Shape& shape, const Quat& q, const Vec3& v, const Vec3& w, double reach) {
    for (const Pose& frame : {at(0, 0, 0), at(Vec3(1, -2, 3), turn(0.9, Vec3(1, -1, 2)))})
      for (const double part : {0.99, 1.01}) {
        const Pose pose = frame * at(Vec3(5, part * reach, -7), q);
        CAPTURE(static_cast<int>(shape.kind), part);
        CHECK(paired(placed(shape, 0, pose, frame.q * v, frame.q * w), plane(frame), margin, horizon) == (part < 1));
      }
  };
  const Quat none = Quat::Identity(), turned = turn(pi / 4, Vec3(0, 0, 1));
  const Vec3 rest = Vec3::Zero(), down(3, -5, 2), up(0, 50, 0);
  const Shape ball = sphere(0.5), brick = box(2, 1, 3), rod = capsule(0.25, 1);
  // A sphere: radius, margin and 5 m/s for 20 ms, turning or not; what goes up is where it is now.
  check(ball, none, rest, rest, 0.6);
  check(ball, none, down, Vec3(9, 9, 9), 0.7);
  check(ball, none, up, rest, 0.6);
  // A box on its face, and on an edge: half of (2 + 1) / sqrt(2) m.
  check(brick, none, rest, rest, 0.6);
  check(brick, none, down, rest, 0.7);
  check(brick, turned, rest, rest, 1.5 * std::sqrt(0.5) + 0.1);
  // Turning about the normal raises no corner, about a level axis each by no more than 2 rad/s times its arm.
  const double arm = std::sqrt(1 + 0.25 + 2.25);
  check(brick, none, rest, Vec3(0, 200, 0), 0.6);
  check(brick, none, rest, Vec3(2, 0, 0), 0.6 + 2 * arm * horizon);
  check(brick, none, down, Vec3(0, 100, 2), 0.7 + 2 * arm * horizon);
  // However fast, no further than the sphere around it.
  check(brick, none, rest, Vec3(2000, 0, 0), arm + 0.1);
  // A rod is the box around it.
  check(rod, none, rest, rest, 0.85);
  check(rod, turned, rest, rest, (0.75 + 0.25) * std::sqrt(0.5) + 0.1);
}

TEST_CASE("Two shapes are paired where their boxes, swept along the motion and widened by the margin, overlap") {
  constexpr double margin = 0.1, horizon = 0.02;
  const auto check = [&](const Shape& a, const Shape& b, const Vec3& v, const Vec3& w, const Vec3& direction,
                         double reach) {
    for (const Vec3& from : {Vec3(0, 0, 0), Vec3(40, -30, 20)})
      for (const double part : {0.99, 1.01}) {
        CAPTURE(direction.transpose(), part);
        const Placed still = placed(b, 1, at(from + part * reach * direction));
        CHECK(paired(placed(a, 0, at(from), v, w), still, margin, horizon) == (part < 1));
      }
  };
  const Shape ball = sphere(0.5), brick = box(2, 1, 3);
  const Vec3 rest = Vec3::Zero();
  for (const double sign : {1.0, -1.0}) {
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 e = sign * Vec3::Unit(axis);
      check(ball, ball, rest, rest, e, 1.1);
      check(ball, ball, 5 * e, rest, e, 1.2);
      check(ball, ball, -5 * e, rest, e, 1.1);
      check(ball, ball, rest, Vec3(90, 90, 90), e, 1.1);  // a sphere is the same however it turns
      const double h = brick.half_extents[axis];
      check(brick, ball, rest, rest, e, h + 0.6);
      // Turning, by no more than its corners' arm times the angle, nor beyond the sphere around it.
      const double arm = brick.half_extents.norm();
      check(brick, ball, rest, Vec3(3, 0, 4), e, h + 0.6 + 5 * arm * horizon);
      check(brick, ball, rest, Vec3(3000, 0, 4000), e, arm + 0.6);
    }
  }
}

TEST_CASE("Two that are fixed to the world are no pair, a fixed one and a free one are") {
  const Placed free_ball = placed(sphere(1), 0, at(0, 0, 0)), fixed_ball = placed(sphere(1), -1, at(0, 1, 0)),
               other_fixed = placed(box(1, 1, 1), -1, at(0, 0.5, 0));
  CHECK(pairs_of({free_ball, fixed_ball, other_fixed, plane(at(0, 0, 0)), plane(at(0, 0.1, 0))}, 1e-3, 1e-3) ==
        Pairs{{0, 1}, {0, 2}, {0, 3}, {0, 4}});
  CHECK(pairs_of({plane(at(0, 0, 0)), fixed_ball}, 1e-3, 1e-3).empty());
  CHECK(pairs_of({plane(at(0, 0, 0)), plane(at(0, 0, 0))}, 1e-3, 1e-3).empty());
  CHECK(pairs_of({plane(at(0, 0, 0)), free_ball}, 1e-3, 1e-3) == Pairs{{0, 1}});
}

TEST_CASE("Other shapes in the place of the last ones are as those of a broad phase that has seen none") {
  // The same number of shapes, and of those that are no plane; which one is the plane goes round.
  BroadPhase kept;
  for (std::size_t turn = 0; turn < 8; ++turn) {
    std::vector<Placed> scene;
    for (int i = 0; i < 4; ++i) scene.push_back(placed(sphere(0.5), i, at(0.8 * i, 0.2, 0)));
    if (turn != 3) scene[turn % 4] = plane(at(0, 0, 0));
    if (turn == 5) scene.push_back(placed(sphere(0.5), 4, at(0.8 * 4, 0.2, 0)));
    if (turn == 7) scene.pop_back();  // the plane; now there are three as before
    CHECK(pairs_of(kept, scene, 1e-3, 1e-3) == pairs_of(scene, 1e-3, 1e-3));
  }
}

TEST_CASE("Bodies that change their order along the sweep, or spread along another axis, are still paired right") {
  Random random(471);
  BroadPhase kept;
  for (int call = 0; call < 60; ++call) {
    std::vector<Placed> scene;
    for (int i = 0; i < 30; ++i) {
      Vec3 p = random.vector(1);
      p[(call / 5) % 3] *= 8;
      scene.push_back(placed(sphere(0.4), i % 5 ? i : -1, at(p)));
    }
    Pairs expected;
    for (int i = 0; i < 30; ++i)
      for (int j = i + 1; j < 30; ++j)
        if ((i % 5 || j % 5) &&
            (scene[static_cast<std::size_t>(i)].motion.pose.p - scene[static_cast<std::size_t>(j)].motion.pose.p)
                    .cwiseAbs()
                    .maxCoeff() <= 0.9)
          expected.emplace_back(static_cast<int>(i), static_cast<int>(j));
    CHECK(pairs_of(kept, scene, 0.1, 0.01) == expected);
  }
}

TEST_CASE("In a crowd the pairs are the same, those with planes, fixed bodies and what is far away among them") {
  Random random(472);
  constexpr int count = 900;
  std::vector<Placed> scene;
  for (int i = 0; i < count; ++i)
    scene.push_back(placed(sphere(i % 3 ? 0.25 : std::exp(random.in(-4, 0))), i % 2 ? i : -1, at(random.vector(1.5))));
  scene[0] = plane(at(0, -1, 0));
  scene[1] = plane(at(0, 0.5, 0), 1);
  BroadPhase kept;
  for (const double far : {0.0, 1e14}) {  // beyond what a cell can be given to
    scene[2].motion.pose.p.x() = far;
    Pairs expected;
    for (int i = 0; i < count; ++i)
      for (int j = i + 1; j < count; ++j) {
        const Placed &a = scene[static_cast<std::size_t>(i)], &b = scene[static_cast<std::size_t>(j)];
        if ((a.shape.body < 0 && b.shape.body < 0) || j < 2) continue;
        const Vec3 apart = b.motion.pose.p - a.motion.pose.p;
        const bool meet = i < 2 ? apart.y() <= b.shape.radius + 0.1
                                : apart.cwiseAbs().maxCoeff() <= a.shape.radius + b.shape.radius + 0.1;
        if (meet) expected.emplace_back(static_cast<int>(i), static_cast<int>(j));
      }
    BroadPhase broad_phase;
    for (int call = 0; call < 3; ++call) CHECK(pairs_of(broad_phase, scene, 0.1, 0) == expected);
    // It goes there while a grid finds the pairs.
    for (int call = 0; call < 3; ++call) CHECK(pairs_of(kept, scene, 0.1, 0) == expected);
  }
}

TEST_CASE("Boxes on the lines between the grid's cells are paired once each, and none twice") {
  // Edges of 1, 0.5 and 0.25 m on a lattice of 0.25 m: low and high corners are on the lines of every level.
  std::vector<SweptBox> boxes;
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j)
      for (int k = 0; k < 6; ++k) {
        const double edge = std::ldexp(1.0, -(i + 2 * j + k) % 3);
        const Vec3 low = Vec3(i - 3, j - 3, k - 3) * 0.75;
        boxes.push_back({low, low + Vec3(edge, edge / 2, edge), static_cast<int>(boxes.size()), (i + j + k) % 4 == 0});
      }
  Pairs expected, found;
  for (std::size_t i = 0; i < boxes.size(); ++i)
    for (std::size_t j = i + 1; j < boxes.size(); ++j) {
      const SweptBox &a = boxes[i], &b = boxes[j];
      bool meet = !(a.fixed && b.fixed);
      for (int axis = 0; axis < 3; ++axis) meet = meet && a.low[axis] <= b.high[axis] && b.low[axis] <= a.high[axis];
      if (meet) expected.emplace_back(static_cast<int>(i), static_cast<int>(j));
    }
  BoxGrid grid;
  REQUIRE(grid.pairs(boxes, found));
  std::sort(found.begin(), found.end());
  CHECK(found == expected);
}

TEST_CASE("The grid takes no box that has no size, is not finite, or is 2^30 of its edges away") {
  BoxGrid grid;
  const auto taken = [&](const Vec3& low, const Vec3& high) {
    Pairs found;
    const bool ok = grid.pairs({{Vec3(0, 0, 0), Vec3(1, 1, 1), 0, false}, {low, high, 1, false}}, found);
    if (!ok) CHECK(found.empty());
    return ok;
  };
  CHECK(taken(Vec3(0, 0, 0), Vec3(1, 0, 0)));
  CHECK(!taken(Vec3(0, 0, 0), Vec3(0, 0, 0)));
  CHECK(!taken(Vec3(0, 0, NAN), Vec3(1, 1, 1)));
  CHECK(!taken(Vec3(0, 0, 0), Vec3(1, HUGE_VAL, 1)));
  CHECK(taken(Vec3(0x1p30 - 2, 0, 0), Vec3(0x1p30 - 1, 1, 1)));
  CHECK(!taken(Vec3(0x1p30 + 1, 0, 0), Vec3(0x1p30 + 2, 1, 1)));
  CHECK(!taken(Vec3(0, -0x1p30 - 2, 0), Vec3(1, -0x1p30 - 1, 1)));
}
