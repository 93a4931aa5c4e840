// contacts.csv: what a run says of each contact.

#include <catch2/catch.hpp>
#include <cmath>
#include <map>

#include "program/program.h"

using namespace program;

namespace {

/// A box of 1 kg that slides on level ground from 2 m/s, mu = 0.25, until it rests at 2 / (0.25 9.8) = 0.816 s.
const char* sliding =
    "<scenario title=\"a box that comes to rest\"><simulation step=\"1e-2\" duration=\"1\"/>"
    "<reference kind=\"missing\"/><gravity constant=\"0 -9.8 0\"/><bodies>"
    "<half_space name=\"ground\" point=\"0 0 0\" normal=\"0 1 0\"/>"
    "<box name=\"box\" size=\"1 0.2 1\" mass=\"1\" position=\"0 0.1 0\" velocity=\"2 0 0\"/></bodies>"
    "<contacts><pair a=\"box\" b=\"ground\" mu=\"0.25\"/></contacts></scenario>";

}  // namespace

TEST_CASE("the contacts of a box that slides bear its weight, slip as it moves, and stick once it rests", "[program]") {
  const TemporaryDirectory directory;
  std::ofstream(directory.path() / "slide.xml") << sliding;
  for (const char* method : {"ap", "convex"}) {
    INFO(method);
    const Result result =
        run(directory.path(), {"run", "slide.xml", "--method", method, "--record-contacts", "--out", "r", "--quiet"});
    INFO(result.err);
    REQUIRE(result.code == 0);
    // Per step: impulse on the box, its contacts' largest speed along x, and their modes.
    struct Step {
      double x = 0, y = 0, u = 0;
      std::map<std::string, int> modes;
    };
    std::map<int, Step> steps;
    const auto rows = lines(read_file(directory.path() / "r" / "contacts.csv"));
    for (std::size_t i = 1; i < rows.size(); ++i) {
      const auto row = cells(rows[i]);
      REQUIRE(row.size() == 17);
      Step& step = steps[std::stoi(row[1])];
      const double sign = row[2] == "box" ? 1 : -1;
      step.x += sign * std::stod(row[13]);
      step.y += sign * std::stod(row[14]);
      step.u = std::max(step.u, sign * std::stod(row[10]));
      ++step.modes[row[16]];
    }
    REQUIRE(steps.size() == 100);
    for (const auto& [number, step] : steps) {
      INFO("step " << number);
      CHECK(step.y == Approx(9.8 * 1e-2).epsilon(1e-6));
      CHECK(step.modes.count(number <= 81 ? "stick" : "slip") == 0);
      if (number <= 81) {
        CHECK(step.x == Approx(-0.25 * 9.8 * 1e-2).epsilon(1e-6));
        CHECK(step.u == Approx(2 - 0.25 * 9.8 * 1e-2 * number).margin(1e-6));
      } else if (number > 82) {
        CHECK(std::abs(step.x) < 1e-6);
      }
    }
    CHECK(lines(read_file(directory.path() / "r" / "shapes.csv")).size() == 3);
  }
}

// The world's axes do not know how the directions of friction lie.
TEST_CASE("directions of friction that are turned turn neither its impulses nor the slip", "[program]") {
  const TemporaryDirectory directory;
  std::string turned = sliding;
  turned.replace(turned.find("duration"), 0, "rotate_cone=\"0.3\" ");
  std::ofstream(directory.path() / "slide.xml") << turned;
  const Result result = run(directory.path(), {"run", "slide.xml", "--method", "convex", "--record-contacts",
                                               "--duration", "0.1", "--out", "r", "--quiet"});
  INFO(result.err);
  REQUIRE(result.code == 0);
  const auto rows = lines(read_file(directory.path() / "r" / "contacts.csv"));
  REQUIRE(rows.size() == 1 + 10 * 4);
  double friction = 0;
  for (std::size_t i = 1; i < rows.size(); ++i) {
    const auto row = cells(rows[i]);
    const double sign = row[2] == "box" ? 1 : -1;
    CHECK(sign * std::stod(row[10]) == Approx(2 - 0.25 * 9.8 * 1e-2 * std::stoi(row[1])).margin(1e-6));
    CHECK(std::abs(std::stod(row[12])) < 1e-6);
    CHECK(std::abs(std::stod(row[15])) < 1e-8);
    friction += sign * std::stod(row[13]);
  }
  CHECK(friction == Approx(-0.25 * 9.8 * 0.1).epsilon(1e-6));
}

TEST_CASE("contacts are kept in the steps that are, and not where none is", "[program]") {
  const TemporaryDirectory directory;
  std::ofstream(directory.path() / "slide.xml") << sliding;
  const Result result = run(directory.path(), {"run", "slide.xml", "--method", "ap", "--record-contacts",
                                               "--record-every", "50", "--out", "r", "--quiet"});
  REQUIRE(result.code == 0);
  for (const std::string& line : lines(read_file(directory.path() / "r" / "contacts.csv")))
    CHECK((line.starts_with("t,") || cells(line)[1] == "50" || cells(line)[1] == "100"));
  const Result none = run(directory.path(), {"run", "slide.xml", "--method", "ap", "--record-contacts",
                                             "--record-every", "0", "--out", "s", "--quiet"});
  CHECK(none.code == 2);
  CHECK(none.err.find("--record-every 0") != std::string::npos);
  CHECK_FALSE(fs::exists(directory.path() / "s"));
}

TEST_CASE("shapes that cannot be written are refused before anything is", "[program]") {
  std::string scene = sliding;
  scene.replace(scene.find("</bodies>"), 0,
                "<hull name=\"rock\" fixed=\"yes\" position=\"9 9 9\" points=\"0 0 0 1 0 0 0 1 0 0 0 1\"/>");
  for (const std::string file : {"shapes.csv", "hulls.csv"}) {
    INFO(file);
    const TemporaryDirectory directory;
    std::ofstream(directory.path() / "slide.xml") << scene;
    fs::create_directories(directory.path() / "r" / file / "in_the_way");
    const Result result =
        run(directory.path(), {"run", "slide.xml", "--method", "ap", "--record-contacts", "--out", "r", "--quiet"});
    CHECK(result.code == 2);
    CHECK(result.err.find(file) != std::string::npos);
    CHECK_FALSE(fs::exists(directory.path() / "r/summary.json"));
  }
}

TEST_CASE("a run whose corners of hulls find no room says which file is not whole", "[program]") {
  std::string points;
  for (int i = 0; i < 300; ++i)
    points += std::to_string(std::cos(i)) + " " + std::to_string(std::sin(i)) + " " + std::to_string(i % 2) + " ";
  std::string scene = sliding;
  scene.replace(scene.find("</bodies>"), 0,
                "<hull name=\"drum\" fixed=\"yes\" position=\"9 9 9\" points=\"" + points + "\"/>");
  const TemporaryDirectory directory;
  std::ofstream(directory.path() / "slide.xml") << scene;
  const Result result = run(
      directory.path(),
      {"run", "slide.xml", "--method", "ap", "--duration", "0.02", "--record-contacts", "--out", "r", "--quiet"}, [] {
        const rlimit small = {16384, 16384};  // bytes, of each file
        setrlimit(RLIMIT_FSIZE, &small);
      });
  CHECK(result.code == 3);
  INFO(result.err);
  CHECK(result.err.find("hulls.csv") != std::string::npos);
}
