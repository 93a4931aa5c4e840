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

namespace {

const char* const along_z = "quaternion=\"1 1 0 0\" ";  // a cylinder's axis
const char* const along_x = "quaternion=\"1 0 0 1\" ";

std::string on_level(const std::string& bodies) {
  return "<scenario title=\"cylinders\"><simulation step=\"1e-3\" duration=\"0.5\" k=\"8\"/>"
         "<reference kind=\"missing\"/><gravity constant=\"0 -9.8 0\"/><bodies>"
         "<half_space name=\"ground\" point=\"0 0 0\" normal=\"0 1 0\"/>" +
         bodies + "</bodies><contacts><pair a=\"*\" b=\"*\" mu=\"0.5\"/></contacts></scenario>";
}
std::string log_at(const std::string& name, const std::string& position, const std::string& turn) {
  return "<cylinder name=\"" + name + "\" radius=\"0.1\" length=\"0.6\" density=\"1000\" position=\"" + position +
         "\" " + turn + "/>";
}

}  // namespace

TEST_CASE("A cylinder that stands on a box that stands on the ground stays where it is, on four points") {
  const TemporaryDirectory directory;
  const fs::path& scratch = directory.path();
  std::ofstream(scratch / "standing.xml") << on_level(
      "<box name=\"box\" size=\"1 0.5 1\" density=\"1000\" position=\"0 0.25 0\"/>"
      "<cylinder name=\"can\" radius=\"0.3\" length=\"0.8\" density=\"1000\" position=\"0.1 0.9 0\"/>");
  for (const char* method : {"ap", "convex", "soft"}) {
    INFO(method);
    REQUIRE(run(scratch, {"run", "standing.xml", "--method", method, "--out", "out", "--quiet"}).code == 0);
    CHECK(summary(scratch / "out").at("contacts_max") == 8);
    const auto can = last_row(scratch / "out" / "trajectory.csv", "can");
    CHECK(std::hypot(std::stod(can[2]) - 0.1, std::stod(can[3]) - 0.9, std::stod(can[4])) <
          (std::string(method) == "soft" ? 1e-4 : 1e-12));  // soft creeps
  }
}

TEST_CASE("Cylinders that roll off a box, lie in a pyramid, cross, and lean on an edge keep apart and gain nothing") {
  const TemporaryDirectory directory;
  const fs::path& scratch = directory.path();
  const std::pair<const char*, std::string> scenes[] = {
      {"roll.xml",
       on_level("<box name=\"box\" size=\"0.4 0.2 1\" fixed=\"yes\" position=\"0 0.1 0\"/>" +
                log_at("log", "0 0.3 0", std::string(along_z) + "velocity=\"1 0 0\" angular_velocity=\"0 0 -10\""))},
      {"pyramid.xml", on_level("<box name=\"tray\" size=\"2 0.2 1\" density=\"1000\" position=\"0 0.1 0\"/>"
                               "<box name=\"left\" size=\"0.1 0.5 1\" density=\"5000\" position=\"-0.25 0.45 0\"/>"
                               "<box name=\"right\" size=\"0.1 0.5 1\" density=\"5000\" position=\"0.25 0.45 0\"/>" +
                               log_at("a", "-0.1 0.3 0", along_z) + log_at("b", "0.1 0.3 0", along_z) +
                               log_at("c", "0 0.4733 0", along_z))},
      {"crossed.xml", on_level(log_at("a", "0 0.1 -0.2", along_x) + log_at("b", "0 0.1 0.2", along_x) +
                               log_at("c", "0 0.3 0", along_z) + log_at("d", "0 0.5 0", along_x))},
      {"leaning.xml", on_level("<box name=\"box\" size=\"1 0.5 1\" density=\"1000\" position=\"0 0.25 0\"/>"
                               "<cylinder name=\"rod\" radius=\"0.05\" length=\"1.2\" density=\"1000\" "
                               "position=\"0.72 0.62 0\" axis=\"0 0 1\" angle=\"0.5\"/>")}};
  for (const auto& [name, text] : scenes) {
    std::ofstream(scratch / name) << text;
    for (const char* method : {"ap", "convex", "soft"}) {
      INFO(name << " by " << method);
      REQUIRE(run(scratch, {"run", name, "--method", method, "--out", "out", "--quiet"}).code == 0);
      const auto found = summary(scratch / "out");
      CHECK(found.at("status") == "ok");
      CHECK(found.at("max_penetration") <= 2e-9);
      CHECK(found.at("energy").at("max_gain_relative") <= 1e-9);
      if (std::string(name) != "crossed.xml") continue;
      const auto top = last_row(scratch / "out" / "trajectory.csv", "d");
      CHECK(std::hypot(std::stod(top[2]), std::stod(top[3]) - 0.5, std::stod(top[4])) < 1e-9);
    }
  }
}
