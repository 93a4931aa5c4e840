#include "geometry/broad_phase.h"

#include <catch2/catch.hpp>
#include <chrono>

#include "geometry/placed_shapes.h"

using namespace cb;
using namespace cb::test;

namespace {

const auto all = [](int, int) { return true; };

using Pairs = std::vector<std::pair<int, int>>;

// Do the shapes come within `margin` at one of many sampled times?
bool meet(const Shape& a, const Motion& motion_a, const Shape& b, const Motion& motion_b, double margin,
          double horizon) {
  constexpr int samples = 20;
  for (int k = 0; k <= samples; ++k) {
    const double t = horizon * k / samples;
    if (separation(a, advance(motion_a, t), b, advance(motion_b, t)) <= margin) return true;
  }
  return false;
}

struct Scene {
  std::vector<Shape> shapes;
  std::vector<Motion> motions;
  void add(const Shape& shape, const Pose& pose, const Vec3& v = Vec3::Zero(), const Vec3& w = Vec3::Zero()) {
    shapes.push_back(shape);
    shapes.back().body = shape.kind == ShapeKind::half_space ? -1 : static_cast<int>(shapes.size());
    Motion motion;
    motion.pose = pose;
    motion.v = v;
    motion.w = w;
    motions.push_back(motion);
  }
};

}  // namespace

TEST_CASE("No pair that comes close within the horizon is missed, and pairs come in ascending order") {
  Random random(31);
  BroadPhase broad_phase;
  for (int scene_index = 0; scene_index < 30; ++scene_index) {
    Scene scene;
    const int count = 2 + scene_index * 2;
    const double size = scene_index % 3 == 0 ? 10 : 4;
    for (int i = 0; i < count; ++i) {
      const Pose pose = random.pose(size);
      const Vec3 v = random.vector(5), w = random.vector(3);
      if (i % 7 == 3)
        scene.add(half_space(), pose);
      else if (i % 2)
        scene.add(sphere(random.in(0.1, 1)), pose, v, w);
      else
        scene.add(box(random.in(0.1, 2), random.in(0.1, 2), random.in(0.1, 2)), pose, v, w);
    }
    // The same object follows the scene as it moves, as in a simulation.
    for (int step = 0; step < 5; ++step) {
      const double horizon = 0.05, margin = 0.01;
      const Pairs& found = broad_phase.pairs(scene.shapes, scene.motions, margin, horizon, all);
      CHECK(std::is_sorted(found.begin(), found.end()));
      CHECK(std::adjacent_find(found.begin(), found.end()) == found.end());
      for (int i = 0; i < count; ++i)
        for (int j = i + 1; j < count; ++j) {
          if (scene.shapes[i].kind == ShapeKind::half_space && scene.shapes[j].kind == ShapeKind::half_space) continue;
          if (meet(scene.shapes[i], scene.motions[i], scene.shapes[j], scene.motions[j], margin, horizon))
            CHECK(std::binary_search(found.begin(), found.end(), std::make_pair(i, j)));
        }
      for (Motion& motion : scene.motions) motion.pose = advance(motion, horizon);
    }
  }
}

TEST_CASE("Spheres at rest: the pairs are exactly those whose bounding cubes overlap") {
  Random random(32);
  for (int scene_index = 0; scene_index < 20; ++scene_index) {
    Scene scene;
    for (int i = 0; i < 40; ++i) scene.add(sphere(random.in(0.1, 1)), at(random.vector(4)));
    Pairs expected;
    for (int i = 0; i < 40; ++i)
      for (int j = i + 1; j < 40; ++j) {
        const Vec3 apart = (scene.motions[i].pose.p - scene.motions[j].pose.p).cwiseAbs();
        if (apart.maxCoeff() <= scene.shapes[i].radius + scene.shapes[j].radius + 0.1) expected.emplace_back(i, j);
      }
    BroadPhase broad_phase;
    CHECK(broad_phase.pairs(scene.shapes, scene.motions, 0.1, 0.0, all) == expected);
  }
}

TEST_CASE(
    "In a heap of sizes from a millimetre to ten metres the pairs are exactly those whose bounding cubes overlap") {
  Random random(34);
  constexpr int count = 1500;
  Scene scene;
  for (int i = 0; i < count; ++i)
    scene.add(sphere(i % 100 == 0 ? random.in(1, 10) : std::exp(random.in(-7, 0))), at(random.vector(4)));
  for (const Vec3& from : {Vec3(0, 0, 0), Vec3(1e5, -1e5, 1e5)}) {  // far away, where lengths are rounded
    for (Motion& motion : scene.motions) motion.pose.p += from;
    Pairs expected;
    for (int i = 0; i < count; ++i)
      for (int j = i + 1; j < count; ++j) {
        const Vec3 apart = (scene.motions[i].pose.p - scene.motions[j].pose.p).cwiseAbs();
        if (apart.maxCoeff() <= scene.shapes[i].radius + scene.shapes[j].radius + 0.1) expected.emplace_back(i, j);
      }
    BroadPhase broad_phase;
    for (int call = 0; call < 100; ++call)  // grids, and sweeps that are tried again
      REQUIRE(broad_phase.pairs(scene.shapes, scene.motions, 0.1, 0.0, all) == expected);
  }
}

TEST_CASE("A layer of many bodies pairs each with its eight neighbours") {
  constexpr int columns = 120;
  Scene scene;
  for (int i = 0; i < columns * columns; ++i) scene.add(sphere(0.5), at(0.9 * (i % columns), 0, 0.9 * (i / columns)));
  BroadPhase broad_phase;
  CHECK(broad_phase.pairs(scene.shapes, scene.motions, 1e-3, 1e-3, all).size() ==
        static_cast<std::size_t>(2 * columns * (columns - 1) + 2 * (columns - 1) * (columns - 1)));
}

TEST_CASE("A stack pairs each cube with its neighbours and the lowest with the ground") {
  Scene scene;
  scene.add(half_space(), at(0, 0, 0));
  for (int i = 0; i < 1000; ++i) scene.add(box(1, 1, 1), at(0, i + 0.5, 0));
  BroadPhase broad_phase;
  Pairs expected{{0, 1}};
  for (int i = 1; i < 1000; ++i) expected.emplace_back(i, i + 1);
  CHECK(broad_phase.pairs(scene.shapes, scene.motions, 1e-3, 1e-3, all) == expected);
  // Only what is allowed comes through.
  const auto& ground_only =
      broad_phase.pairs(scene.shapes, scene.motions, 1e-3, 1e-3, [](int i, int) { return i == 0; });
  CHECK(ground_only == Pairs{{0, 1}});
}

TEST_CASE("A row of separate boxes pairs each with the ground alone, and fixed shapes never with each other") {
  Scene scene;
  for (int i = 0; i < 1000; ++i) scene.add(box(1, 1, 1), at(2.0 * i, 0.5, 0));
  scene.add(half_space(), at(0, 0, 0));
  BroadPhase broad_phase;
  CHECK(broad_phase.pairs(scene.shapes, scene.motions, 1e-3, 1e-3, all).size() == 1000);
  scene.shapes[0].body = -1;
  scene.shapes[1].body = -1;
  scene.motions[1].pose.p.x() = 0.5;
  const Pairs found = broad_phase.pairs(scene.shapes, scene.motions, 1e-3, 1e-3, all);
  CHECK(found.size() == 998);
  CHECK(std::find(found.begin(), found.end(), std::make_pair(0, 1)) == found.end());
}

TEST_CASE("The answer does not depend on what the broad phase saw before") {
  Random random(33);
  BroadPhase kept;
  for (int scene_index = 0; scene_index < 40; ++scene_index) {
    Scene scene;
    const int count = 1 + static_cast<int>(random.in(0, 12));
    for (int i = 0; i < count; ++i) {
      if (random.in(0, 1) < 0.2)
        scene.add(half_space(), random.pose(2));
      else
        scene.add(sphere(random.in(0.1, 1)), random.pose(2), random.vector(1));
    }
    BroadPhase fresh;
    CHECK(kept.pairs(scene.shapes, scene.motions, 0.01, 0.1, all) ==
          fresh.pairs(scene.shapes, scene.motions, 0.01, 0.1, all));
  }
}

TEST_CASE(
    "A rod whose tip turns up to a sphere within the horizon is paired with it, and not with one beyond its reach") {
  Shape rod;
  rod.kind = ShapeKind::box;
  rod.half_extents = {1, 0.01, 0.01};
  Shape ball;
  ball.kind = ShapeKind::sphere;
  ball.radius = 0.01;
  // At 50 rad/s the tip rises by 0.05 m in a millisecond.
  for (const double height : {0.05, 0.2}) {
    Scene scene;
    scene.add(rod, Pose{}, Vec3::Zero(), {0, 0, 50});
    Pose above;
    above.p = {1, height, 0};
    scene.add(ball, above);
    BroadPhase broad_phase;
    CHECK(broad_phase.pairs(scene.shapes, scene.motions, 1e-6, 1e-3, all).size() == (height < 0.1 ? 1 : 0));
  }
}
