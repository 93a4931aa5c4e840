#include "scenario/perturb.h"

#include <catch2/catch.hpp>
#include <set>

#include "scenes.h"

using namespace cb;

TEST_CASE("a perturbation moves every free body by its size and no point of it by more than twice that") {
  Scenario before = test::empty_scene(1e-3, 1);
  test::add_ground(before);
  for (int i = 0; i < 20; ++i) test::add_box(before, {1, 2, 3}, 1, {Vec3(4.0 * i, 1, 0), Quat::Identity()});
  Scenario after = before;
  perturb(after, 1e-3, 7);
  const double reach = before.shapes[1].bounding_radius();
  for (int b = 0; b < 20; ++b) {
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
