// The example of a robot from a URDF file, as docs/scenarios.md tells a user to run it.

#include <catch2/catch.hpp>
#include <cmath>

#include "program/program.h"

using namespace program;

TEST_CASE("An arm from a URDF file pushes a cube along the table and leaves it lying there") {
  const TemporaryDirectory directory;
  const fs::path& scratch = directory.path();
  const Result check = run(scratch, {"check", "urdf_arm"});
  if (check.err.find("built without liburdfdom") != std::string::npos) return;
  REQUIRE(check.code == 0);
  CHECK_THAT(check.out, Catch::Contains("left out") && Catch::Contains("<transmission>"));
  const Result result = run(scratch, {"run", "urdf_arm", "--method", "ap", "--out", "out", "--quiet"});
  CHECK(result.code == 0);
  std::vector<std::string> last;
  for (const std::string& line : lines(read_file(scratch / "out" / "trajectory.csv"))) {
    const auto row = cells(line);
    if (row[1] == "cube") last = row;
  }
  REQUIRE(!last.empty());
  const auto number = [](const std::string& text) { return std::stod(text); };
  CHECK(number(last[3]) == Approx(0.04).margin(1e-9));
  CHECK(std::hypot(number(last[9]), number(last[11])) < 1e-9);

  // The palm slows down by less than friction does: the cube stops with it, its centre ahead of the palm's by half the
  // palm (0.06 m) and at most half the cube's diagonal.
  double largest = 0;
  for (const std::string& line : lines(read_file(scratch / "out" / "joints.csv"))) {
    const auto row = cells(line);
    if (row[1] == "turn") largest = std::max(largest, number(row[2]));
  }
  const double x = number(last[2]), z = number(last[4]), ahead = std::atan2(-z, x) - largest;
  CHECK(largest > 0.7);
  CHECK(std::hypot(x, z) * std::sin(ahead) > 0.06);
  CHECK(std::hypot(x, z) * std::sin(ahead) < 0.06 + 0.04 * std::sqrt(2.0));
}
