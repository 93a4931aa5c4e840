#include "simulation/event_islands.h"

#include <catch2/catch.hpp>

using namespace cb;

namespace {

/// Free bodies 0 to 3, two links (4, 5) of one robot and one (6) of another; a shape on each, and the ground as the
/// last.
struct Scene {
  Model model;
  std::vector<Shape> shapes;
  std::vector<ContactPoint> contacts;
  std::vector<LimitContact> limits;
  std::vector<char> driven = {0, 0};
  static constexpr int ground = 7;

  Scene() {
    for (int b = 0; b < 7; ++b) {
      model.bodies.push_back({"body", 1, Vec3::Ones(), b < 4 ? -1 : b < 6 ? 0 : 1});
      Shape shape;
      shape.body = b;
      shapes.push_back(shape);
    }
    shapes.emplace_back();
    model.trees.resize(2);
  }
  void touch(int a, int b) { contacts.push_back({Vec3::Zero(), Vec3(0, 1, 0), 0, a, b}); }
  /// Which contacts, then limits, an event has where these approach; one digit each.
  std::string included(const std::vector<char>& approaches) const {
    EventIslands islands;
    islands.find(model, shapes, contacts, limits, driven, approaches);
    std::string out;
    for (std::size_t i = 0; i < approaches.size(); ++i) out += islands.includes(i) ? '1' : '0';
    return out;
  }
};

}  // namespace

TEST_CASE("bodies joined by contacts are one island, in whatever order they are joined, and the ground joins none") {
  Scene scene;
  scene.touch(0, Scene::ground);
  scene.touch(3, 1);
  scene.touch(Scene::ground, 2);
  scene.touch(2, 3);
  CHECK(scene.included({1, 0, 0, 0}) == "1000");
  for (const std::vector<char>& one : {std::vector<char>{0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}})
    CHECK(scene.included(one) == "0111");
  CHECK(scene.included({0, 0, 0, 0}) == "0000");
  CHECK(scene.included({1, 1, 1, 1}) == "1111");
}

TEST_CASE(
    "the links of a robot are one body with its limits, another robot is another, and what is driven joins none") {
  Scene scene;
  scene.touch(4, 0);              // one link and a body
  scene.touch(5, Scene::ground);  // the other link
  scene.touch(6, 1);              // the other robot and a body
  scene.limits = {{0, 0, 1, 0}, {1, 0, -1, 0}};
  CHECK(scene.included({1, 0, 0, 0, 0}) == "11010");
  CHECK(scene.included({0, 1, 0, 0, 0}) == "11010");
  CHECK(scene.included({0, 0, 0, 1, 0}) == "11010");
  CHECK(scene.included({0, 0, 1, 0, 0}) == "00101");
  CHECK(scene.included({0, 0, 0, 0, 1}) == "00101");
  // Two bodies on one belt, which is link 6.
  scene.limits.clear();
  scene.driven = {0, 1};
  scene.touch(2, 6);
  CHECK(scene.included({0, 0, 1, 0}) == "0010");
  CHECK(scene.included({0, 0, 0, 1}) == "0001");
  scene.driven = {0, 0};
  CHECK(scene.included({0, 0, 1, 0}) == "0011");
}
