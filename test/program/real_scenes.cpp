// Scenes that people have, by the methods that answer them: what their heads say should happen.

#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <utility>

#include "program/program.h"

using namespace program;

namespace {

struct Place {
  double x, y, z, vx, vy, vz;
};

/// Where everything is at the end of a run that ended well, and at its beginning.
struct Motion {
  std::map<std::string, Place> first, last;
  Json summary;
};

Motion run_scene(const std::string& name, const std::vector<std::string>& method,
                 const std::vector<std::string>& more) {
  const TemporaryDirectory directory;
  const fs::path out = directory.path() / "out";
  std::vector<std::string> words = {"run", name, "--quiet", "--out", out.string(), "--time-limit", "120"};
  words.insert(words.end(), method.begin(), method.end());
  words.insert(words.end(), more.begin(), more.end());
  const Result result = run(directory.path(), words);
  INFO(result.err);
  REQUIRE(result.code == 0);
  Motion motion;
  motion.summary = summary(out);
  bool head = true;
  for (const std::string& line : lines(read_file(out / "trajectory.csv"))) {
    const auto row = cells(line);
    if (!std::exchange(head, false)) {
      const auto at = [&](int column) { return std::stod(row[column]); };
      const Place place{at(2), at(3), at(4), at(9), at(10), at(11)};
      motion.first.try_emplace(row[1], place);
      motion.last[row[1]] = place;
    }
  }
  CHECK(motion.summary["status"] == "ok");
  CHECK(motion.summary["residuals"]["false_claims"] == 0);
  return motion;
}

const std::vector<std::vector<std::string>> exact = {{"--method", "convex"}, {"--method", "coulomb"}};

}  // namespace

TEST_CASE("Parts that are put on a belt lag by what they slip, and a ball keeps two sevenths") {
  for (const auto& method : exact) {
    INFO(method[1]);
    const Motion parts = run_scene("conveyor.xml", method, {"--duration", "1"});
    // 200 steps to the belt's 0.98 m/s at mu g = 4.9 m/s^2: the explicit step goes half a step's way too far.
    const double v = 0.98, a = 4.9, h = 1e-3, lag = v * v / (2 * a) - v * h / 2;
    for (const char* body : {"box", "capsule"}) {
      INFO(body);
      CHECK(parts.last.at(body).x == Approx(v * 1 - lag).margin(1e-9));
      CHECK(parts.last.at(body).vx == Approx(v).margin(1e-12));
      CHECK(parts.last.at(body).y == Approx(0.1).margin(1e-9));
    }
    CHECK(parts.last.at("wedge").vx == Approx(v).margin(1e-12));
    CHECK(parts.last.at("ball").vx == Approx(2 * v / 7).margin(1e-12));
  }
}

TEST_CASE("A robot of four legs comes to stand on its feet") {
  for (const auto& method : exact) {
    INFO(method[1]);
    const Motion robot = run_scene("quadruped.xml", method, {"--duration", "3"});
    const Place &trunk = robot.last.at("trunk"), &start = robot.first.at("trunk");
    CHECK(std::hypot(trunk.vx, trunk.vy, trunk.vz) < 1e-4);
    CHECK(start.y - trunk.y > 0.01);  // it fell that far, and sank into its springs
    CHECK(start.y - trunk.y < 0.03);
    CHECK(std::abs(trunk.z) < 1e-9);
  }
}

TEST_CASE("A gripper's cube goes up with the hand and does not slip") {
  for (const auto& method : exact) {
    INFO(method[1]);
    const Motion lift = run_scene("gripper.xml", method, {});
    const auto rise = [&](const char* body) { return lift.last.at(body).y - lift.first.at(body).y; };
    CHECK(rise("cube") > 0.15);
    CHECK(rise("cube") == Approx(rise("hand")).margin(1e-4));
    CHECK(lift.last.at("cube").vy == Approx(lift.last.at("hand").vy).margin(1e-4));
  }
}

TEST_CASE("Rocks stop at the foot of a slope that is steeper than their friction") {
  const Motion rocks = run_scene("rubble_slope.xml", exact[1], {"--set", "rocks=4", "--duration", "3"});
  CHECK(rocks.summary["energy"]["max_gain_relative"] < 1e-9);
  CHECK(rocks.summary["max_penetration"] < 1e-8);
  for (const auto& [name, place] : rocks.last) {
    INFO(name);
    CHECK(place.x > -0.3);  // from -1.8 m and beyond
    CHECK(std::hypot(place.vx, place.vy, place.vz) < 0.02);
  }
}

TEST_CASE("Balls in a turning drum are carried up on one side by friction") {
  for (const auto& method : exact) {
    INFO(method[1]);
    const Motion drum = run_scene("rolling_drum.xml", method,
                                  {"--set", "balls=20", "--stepping", "steps", "--step", "2e-3", "--duration", "2"});
    double x = 0;
    for (const auto& [name, place] : drum.last)
      if (name != "drum") {
        CHECK(std::hypot(place.x, place.y) < 0.5 / std::cos(M_PI / 16));
        x += place.x / 20;
      }
    CHECK(x > 0.05);
    CHECK(drum.summary["max_penetration"] < 1e-8);
  }
}
