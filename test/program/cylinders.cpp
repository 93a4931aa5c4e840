// Cylinders and discs in motion, by the real program.

#include <catch2/catch.hpp>
#include <cmath>

#include "program/program.h"

using namespace program;

namespace {

/// A slope of 30 degrees, written as level ground under a gravity that is turned.
std::string scene(const std::string& bodies, const std::string& pairs) {
  return "<scenario title=\"cylinders\"><simulation step=\"1e-3\" duration=\"2\" k=\"8\"/><reference kind=\"missing\"/>"
         "<gravity constant=\"4.9 ${-9.8*cos(30*deg)} 0\"/><bodies>"
         "<half_space name=\"ground\" point=\"0 0 0\" normal=\"0 1 0\"/>" +
         bodies + "</bodies><contacts>" + pairs + "</contacts></scenario>";
}

std::vector<std::string> last_row(const fs::path& trajectory, const std::string& body) {
  std::vector<std::string> last;
  for (const std::string& line : lines(read_file(trajectory))) {
    const auto row = cells(line);
    if (row[1] == body) last = row;
  }
  return last;
}

}  // namespace

TEST_CASE("A cylinder on its side rolls down a slope with two thirds of what a frictionless one slides with") {
  const TemporaryDirectory directory;
  const fs::path& scratch = directory.path();
  std::ofstream(scratch / "roll.xml") << scene(
      "<cylinder name=\"roller\" radius=\"0.5\" length=\"2\" density=\"100\" position=\"0 0.5 0\" axis=\"1 0 0\" "
      "angle=\"${pi/2}\"/><cylinder name=\"stander\" radius=\"0.5\" length=\"0.6\" density=\"100\" position=\"0 0.3 "
      "10\"/>",
      "<pair a=\"*er\" b=\"ground\" mu=\"0.7\"/>");
  for (const char* method : {"ap", "convex"}) {
    INFO(method);
    const Result result = run(scratch, {"run", "roll.xml", "--method", method, "--out", "out", "--quiet"});
    REQUIRE(result.code == 0);
    const auto roller = last_row(scratch / "out" / "trajectory.csv", "roller");
    const auto stander = last_row(scratch / "out" / "trajectory.csv", "stander");
    // a = g sin / (1 + I / m r^2) = 4.9 / 1.5. Explicit Euler: v = a t, x = a h^2 n (n + 1) / 2.
    const double a = 4.9 / 1.5;
    CHECK(std::stod(roller[9]) == Approx(2 * a).epsilon(1e-10));
    CHECK(std::stod(roller[2]) == Approx(a * 1e-6 * 2000 * 2001 / 2).epsilon(1e-10));
    CHECK(std::stod(roller[3]) == Approx(0.5).margin(1e-10));
    // tan 30 = 0.58: it sticks where mu = 0.7, and its height is 0.6 of its width: it does not tip.
    CHECK(std::hypot(std::stod(stander[2]), std::stod(stander[4]) - 10) < 1e-9);
  }
}

TEST_CASE("A disc that wobbles on its rim sinks in within a step by its square, and not at all over the steps") {
  // The lowest point of the rim is another one after the step, deeper by the square of the step; that is taken away.
  const TemporaryDirectory directory;
  const fs::path& scratch = directory.path();
  std::ofstream(scratch / "disc.xml") << scene(
      "<cylinder name=\"disc\" radius=\"0.5\" length=\"0\" mass=\"1\" position=\"0 1.5 0\" axis=\"1 0 0.3\" "
      "angle=\"1.2\" "
      "angular_velocity=\"0 0 3\"/>",
      "<pair a=\"disc\" b=\"ground\" mu=\"0.7\"/>");
  double deepest[2] = {0, 0};
  for (int i = 0; i < 2; ++i) {
    const Result result = run(scratch, {"run", "disc.xml", "--method", "convex", "--step", i == 0 ? "1e-3" : "5e-4",
                                        "--record-every", "0", "--out", "out", "--quiet"});
    REQUIRE(result.code == 0);
    const auto found = summary(scratch / "out");
    deepest[i] = found.at("penetration").at("inside_steps_m");
    CHECK(found.at("max_penetration") <= 1e-9);
    CHECK(found.at("penetration").at("removals") > 0);
  }
  CHECK(deepest[1] > 0);
  CHECK(deepest[0] / deepest[1] == Approx(4).epsilon(0.3));
}
