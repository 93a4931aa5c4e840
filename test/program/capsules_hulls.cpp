// Capsules and convex hulls in motion, by the real program.

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "program/program.h"

using namespace program;

namespace {

std::string scene(const std::string& gravity, const std::string& bodies, const std::string& pairs) {
  return "<scenario title=\"shapes\"><simulation step=\"1e-3\" duration=\"2\" k=\"8\"/><reference kind=\"missing\"/>"
         "<gravity constant=\"" +
         gravity +
         "\"/><bodies>"
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

const char* const cube =
    "points=\"-0.5 -0.5 -0.5  0.5 -0.5 -0.5  -0.5 0.5 -0.5  0.5 0.5 -0.5  -0.5 -0.5 0.5  0.5 -0.5 0.5  -0.5 0.5 0.5  "
    "0.5 0.5 0.5\"";

}  // namespace

TEST_CASE("A capsule on its side rolls down a slope as its moment about its axis lets it") {
  const TemporaryDirectory directory;
  const fs::path& scratch = directory.path();
  std::ofstream(scratch / "roll.xml") << scene(
      "4.9 ${-9.8*cos(30*deg)} 0",
      "<capsule name=\"roller\" radius=\"0.5\" length=\"2\" density=\"100\" position=\"0 0.5 0\" axis=\"1 0 0\" "
      "angle=\"${pi/2}\"/>",
      "<pair a=\"roller\" b=\"ground\" mu=\"0.7\"/>");
  // Middle : ends = L : 4/3 r = 3 : 1; I = (3/4 / 2 + 1/4 * 2/5) m r^2. Explicit Euler: v = a t.
  const double a = 4.9 / (1 + 0.375 + 0.1);
  for (const char* method : {"ap", "convex"}) {
    INFO(method);
    const Result result = run(scratch, {"run", "roll.xml", "--method", method, "--out", "out", "--quiet"});
    REQUIRE(result.code == 0);
    const auto roller = last_row(scratch / "out" / "trajectory.csv", "roller");
    CHECK(std::stod(roller[9]) == Approx(2 * a).epsilon(1e-10));
    CHECK(std::stod(roller[2]) == Approx(a * 1e-6 * 2000 * 2001 / 2).epsilon(1e-10));
    CHECK(std::stod(roller[3]) == Approx(0.5).margin(1e-10));
  }
}

TEST_CASE("A hull of a cube's corners slides and stacks as the cube does") {
  const TemporaryDirectory directory;
  const fs::path& scratch = directory.path();
  const auto bodies = [](const std::string& shape) {
    return "<" + shape + " name=\"lower\" mass=\"1\" position=\"0 0.5 0\" velocity=\"1 0 0\"/><" + shape +
           " name=\"upper\" mass=\"1\" position=\"0.1 1.5 0\" velocity=\"1 0 0\"/>";
  };
  const char* pairs = "<pair a=\"*er\" b=\"ground\" mu=\"0.2\"/><pair a=\"lower\" b=\"upper\" mu=\"0.5\"/>";
  std::ofstream(scratch / "box.xml") << scene("0 -9.8 0", bodies("box size=\"1 1 1\""), pairs);
  std::ofstream(scratch / "hull.xml") << scene("0 -9.8 0", bodies(std::string("hull ") + cube), pairs);
  for (const char* method : {"ap", "convex"}) {
    INFO(method);
    for (const char* name : {"box", "hull"})
      REQUIRE(run(scratch, {"run", std::string(name) + ".xml", "--method", method, "--out", name, "--quiet"}).code ==
              0);
    for (const char* body : {"lower", "upper"}) {
      const auto one = last_row(scratch / "box" / "trajectory.csv", body);
      const auto other = last_row(scratch / "hull" / "trajectory.csv", body);
      for (std::size_t k = 2; k < one.size(); ++k) CHECK(std::stod(one[k]) == Approx(std::stod(other[k])).margin(1e-9));
    }
  }
}

TEST_CASE("Tetrahedra that fall on a corner, an edge and a face come to rest on a face and never gain energy") {
  const TemporaryDirectory directory;
  const fs::path& scratch = directory.path();
  const std::string points = " points=\"0 0 0  1 0 0  0 0 1  0.2 1 0.2\" density=\"500\" ";
  std::ofstream(scratch / "fall.xml") << scene(
      "0 -9.8 0",
      "<hull name=\"face\"" + points + "position=\"0 0.2 0\"/><hull name=\"edge\"" + points +
          "position=\"3 0.3 0\" axis=\"1 0 0\" angle=\"-0.2\"/><hull name=\"corner\"" + points +
          "position=\"6 0.5 0\" axis=\"1 0.2 0.7\" angle=\"0.3\"/>",
      "<pair a=\"*\" b=\"ground\" mu=\"0.5\"/>");
  const Result result =
      run(scratch, {"run", "fall.xml", "--method", "coulomb", "--solver", "newton", "--out", "out", "--quiet"});
  REQUIRE(result.code == 0);
  const auto found = summary(scratch / "out");
  CHECK(found.at("max_penetration") <= 1e-9);
  CHECK(found.at("energy").at("max_gain_relative") <= 1e-12);
  for (const char* body : {"face", "edge", "corner"}) {
    const auto row = last_row(scratch / "out" / "trajectory.csv", body);
    for (std::size_t k = 9; k < 15; ++k) CHECK(std::abs(std::stod(row[k])) < 1e-9);
    // The centre is a quarter of the height 1 above the face that it stands on.
    CHECK(std::stod(row[3]) == Approx(0.25).margin(1e-8));
  }
}

TEST_CASE("What a hull is made of is said by check, and its corners stand in hulls.csv") {
  const TemporaryDirectory directory;
  const fs::path& scratch = directory.path();
  std::ofstream(scratch / "part.obj") << "v 0 0 0\nv 1 0 0\nv 0 0 1\nv 0.2 1 0.2\nv 0.3 0.2 0.2\n";
  std::ofstream(scratch / "one.xml") << scene(
      "0 -9.8 0", "<hull name=\"part\" file=\"part.obj\" scale=\"0.1\" density=\"500\" position=\"0 0.1 0\"/>",
      "<pair a=\"part\" b=\"ground\" mu=\"0.5\"/>");
  const Result checked = run(scratch, {"check", "one.xml"});
  REQUIRE(checked.code == 0);
  CHECK_THAT(checked.out, Catch::Contains("1 hull (4 vertices)"));
  CHECK_THAT(run(scratch, {"check", "one.xml", "--files"}).out, Catch::Contains("part.obj"));
  REQUIRE(run(scratch, {"run", "one.xml", "--method", "convex", "--duration", "0.01", "--record-contacts", "--out",
                        "out", "--quiet"})
              .code == 0);
  CHECK(lines(read_file(scratch / "out" / "hulls.csv")).size() == 13);
  // A face's corners run counter-clockwise seen from outside: what they span with any point adds up to the volume.
  const auto rows = lines(read_file(scratch / "out" / "hulls.csv"));
  std::vector<std::array<double, 3>> corners;
  double volume = 0;
  for (std::size_t i = 1; i < rows.size(); ++i) {
    const auto row = cells(rows[i]);
    CHECK(row.at(0) == "part");
    CHECK(row.at(1) == std::to_string((i - 1) / 3));
    corners.push_back({std::stod(row.at(2)), std::stod(row.at(3)), std::stod(row.at(4))});
    if (i % 3 != 0) continue;
    const auto &a = corners[i - 3], &b = corners[i - 2], &c = corners[i - 1];
    volume +=
        (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])) /
        6;
  }
  for (const auto& corner : corners) CHECK(std::count(corners.begin(), corners.end(), corner) == 3);
  CHECK(volume == Approx(1e-3 / 6).epsilon(1e-9));
  std::ofstream(scratch / "two.xml") << scene(
      "0 -9.8 0",
      "<hull name=\"part\" file=\"part.obj\" scale=\"0.1\" density=\"500\" position=\"0 0.1 0\"/><hull name=\"cube\" " +
          std::string(cube) + " mass=\"1\" position=\"3 0.6 0\"/>",
      "<pair a=\"part\" b=\"ground\" mu=\"0.5\"/>");
  CHECK_THAT(run(scratch, {"check", "two.xml"}).out, Catch::Contains("2 hull (4 to 8 vertices)"));
  REQUIRE(run(scratch, {"run", "two.xml", "--method", "convex", "--duration", "0.002", "--record-contacts", "--out",
                        "two", "--quiet"})
              .code == 0);
  // Both of them, each with faces of its own from 0 on.
  std::vector<std::string> hulls;
  int of_part = 0;
  const auto both = lines(read_file(scratch / "two" / "hulls.csv"));
  for (std::size_t i = 1; i < both.size(); ++i) {
    const auto row = cells(both[i]);
    of_part += row.at(0) == "part" ? 1 : 0;
    if (!hulls.empty() && hulls.back() == row.at(0)) continue;
    hulls.push_back(row.at(0));
    CHECK(row.at(1) == "0");
  }
  CHECK(hulls == std::vector<std::string>{"part", "cube"});
  CHECK(of_part == 12);
  std::ofstream(scratch / "part.obj") << "v 0 0 0\nv 1 0\n";
  const Result refused = run(scratch, {"check", "one.xml"});
  CHECK(refused.code == 2);
  CHECK_THAT(refused.err, Catch::Contains("part.obj, line 2"));
}
