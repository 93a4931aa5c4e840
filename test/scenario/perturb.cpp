#include "scenario/perturb.h"

#include <catch2/catch.hpp>
#include <set>

#include "scenes.h"

using namespace cb;

TEST_CASE("a perturbation moves every free body by its size and no point of it by more than twice that") {
  Scenario before = test::empty_scene(1e-3, 1);
  test::add_ground(before);
  for (int i = 0; i < 20; ++i)
    test::add_box(before, Vec3(1 + 0.5 * i, 2, 3), 1, {Vec3(4.0 * i, 1, 0), Quat::Identity()});
  Scenario after = before;
  perturb(after, 1e-3, 7);
  for (int b = 0; b < 20; ++b) {
    const double reach = before.shapes[b + 1].bounding_radius();
    CHECK((after.initial.pose[b].p - before.initial.pose[b].p).norm() == Approx(1e-3));
    CHECK(after.initial.pose[b].q.angularDistance(before.initial.pose[b].q) == Approx(1e-3 / reach).epsilon(1e-6));
    CHECK(after.initial.pose[b].q.norm() == Approx(1));
  }
}

TEST_CASE("the same seed perturbs alike, another seed does not") {
  const auto place = [](std::uint64_t seed) {
    Scenario s = test::empty_scene(1e-3, 1);
    test::add_sphere(s, 1, 1, Vec3::Zero());
    perturb(s, 1, seed);
    return s.initial.pose[0].p[0];
  };
  CHECK(place(1) == place(1));
  std::set<double> places;
  for (std::uint64_t seed = 0; seed < 10; ++seed) places.insert(place(seed));
  CHECK(places.size() == 10);
}

TEST_CASE("a body turns by what its farthest shape makes of the size, wherever that is in the list; links stay") {
  for (const bool far_first : {true, false}) {
    Scenario before = test::empty_scene(1e-3, 1);
    test::add_sphere(before, 1, 1, Vec3(5, 0, 0));
    test::add_sphere(before, 1, 1, Vec3(9, 0, 0));
    test::add_ground(before);
    before.model.bodies[1].tree = 0;
    Shape far = before.shapes[0];
    far.radius = 0.5;
    far.local.p = Vec3(0, 0, 2);  // its farthest point is 2.5 from the body's centre
    before.shapes.insert(far_first ? before.shapes.begin() : before.shapes.end(), far);
    Scenario after = before;
    perturb(after, 1e-3, 3);
    CHECK((after.initial.pose[0].p - before.initial.pose[0].p).norm() == Approx(1e-3));
    CHECK(after.initial.pose[0].q.angularDistance(before.initial.pose[0].q) == Approx(1e-3 / 2.5).epsilon(1e-6));
    CHECK(after.initial.pose[1].p == before.initial.pose[1].p);
    CHECK(after.initial.pose[1].q.coeffs() == before.initial.pose[1].q.coeffs());
  }
}

TEST_CASE("directions are all over, and no axis of a turn is the direction of its move") {
  Scenario before = test::empty_scene(1e-3, 1);
  for (int i = 0; i < 200; ++i) test::add_box(before, {1, 2, 3}, 1, {Vec3(4.0 * i, 1, 0), Quat::Identity()});
  Scenario after = before;
  perturb(after, 1e-3, 11);
  Vec3 moves = Vec3::Zero(), turns = Vec3::Zero();
  double along = 0;
  for (int b = 0; b < 200; ++b) {
    const Vec3 move = (after.initial.pose[b].p - before.initial.pose[b].p) / 1e-3;
    const Vec3 axis = after.initial.pose[b].q.vec().normalized();
    moves += move / 200;
    turns += axis / 200;
    along += move.dot(axis) / 200;
    CHECK(std::abs(move.dot(axis)) < 1 - 1e-6);
  }
  // Means of 200 numbers of variance 1/3: 0.04, here five times that.
  CHECK(moves.cwiseAbs().maxCoeff() < 0.2);
  CHECK(turns.cwiseAbs().maxCoeff() < 0.2);
  CHECK(std::abs(along) < 0.2);
}
