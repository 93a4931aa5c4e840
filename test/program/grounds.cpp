// Bodies on a fixed ground of triangles, by the real program: seams are no obstacle, ridges and valleys carry.

#include <fmt/format.h>

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <map>

#include "program/program.h"

using namespace program;

namespace {

std::string scene(const std::string& ground, const std::string& bodies, double mu, double duration) {
  return "<scenario title=\"ground\"><simulation step=\"1e-3\" duration=\"" + std::to_string(duration) +
         "\" k=\"8\"/><reference kind=\"missing\"/><gravity constant=\"0 -9.8 0\"/><bodies>" + ground + bodies +
         "</bodies><contacts><pair a=\"ground*\" b=\"body*\" mu=\"" + std::to_string(mu) + "\"/></contacts></scenario>";
}

/// 7 x 7 heights, 1 m apart, about the origin.
std::string field(const std::function<double(double, double)>& height, const std::string& more = "") {
  std::string heights;
  for (int j = -3; j <= 3; ++j)
    for (int i = -3; i <= 3; ++i) heights += fmt::format("{} ", height(i, j));
  return "<heightfield name=\"ground\" position=\"-3 0 -3\" columns=\"7\" spacing=\"1 1\" heights=\"" + heights +
         "\" " + more + "/>";
}
std::string flat_field(const std::string& more = "") {
  return field([](double, double) { return 0; }, more);
}

struct Run {
  Json summary;
  std::vector<std::vector<std::string>> rows;  ///< of trajectory.csv
};
Run run_scene(const fs::path& scratch, const std::string& text, const std::string& method) {
  std::ofstream(scratch / "scene.xml") << text;
  std::vector<std::string> words{"run", "scene.xml", "--method", method, "--out", "out", "--quiet"};
  if (method == "coulomb") words.insert(words.end(), {"--solver", "newton"});
  const Result result = run(scratch, words);
  INFO(result.err);
  REQUIRE(result.code == 0);
  Run out{summary(scratch / "out"), {}};
  for (const std::string& line : lines(read_file(scratch / "out" / "trajectory.csv"))) out.rows.push_back(cells(line));
  return out;
}

/// The largest difference of any number of two trajectories.
double difference(const Run& a, const Run& b) {
  REQUIRE(a.rows.size() == b.rows.size());
  double largest = 0;
  for (std::size_t i = 1; i < a.rows.size(); ++i)
    for (std::size_t k = 2; k < a.rows[i].size(); ++k)
      largest = std::max(largest, std::abs(std::stod(a.rows[i][k]) - std::stod(b.rows[i][k])));
  return largest;
}

const std::string brick =
    "points=\"-0.3 -0.2 -0.25  0.3 -0.2 -0.25  -0.3 0.2 -0.25  0.3 0.2 -0.25  -0.3 -0.2 0.25  0.3 -0.2 0.25  -0.3 0.2 "
    "0.25  0.3 0.2 0.25\"";

struct Form {
  std::string element;  ///< and its extents
  double height;        ///< of its centre above a plane that it lies on, m
};
const std::map<std::string, Form> forms{{"box", {"box size=\"0.6 0.4 0.5\"", 0.2}},
                                        {"sphere", {"sphere radius=\"0.25\"", 0.25}},
                                        {"capsule", {"capsule radius=\"0.2\" length=\"0.9\"", 0.2}},
                                        {"hull", {"hull " + brick, 0.2}}};

std::string body(const Form& form, const std::string& place) {
  return "<" + form.element + " name=\"body\" mass=\"2\" " + place + "/>";
}

}  // namespace

TEST_CASE("What slides or rolls over a flat field of triangles moves as on a half-space") {
  const TemporaryDirectory directory;
  const std::string plane = "<half_space name=\"ground\" point=\"0 0 0\" normal=\"0 1 0\"/>";
  const std::array<double, 2> headings[] = {{1.7, 0}, {0, -1.9}, {0.9, 1.3}, {-1.1, 1.1}};
  for (const auto& [name, form] : forms)
    for (const double mu : {0.0, 0.3})
      for (const auto& [vx, vz] : headings) {
        // An end of a capsule that rolls askew leaves the plane and lands again and again, at times that its tolerances
        // decide, which are another ground's.
        if (name == "capsule" && mu > 0 && vx != 0 && vz != 0) continue;
        const std::string lying =
            name == "capsule" ? "axis=\"1 0 0\" angle=\"${pi/2}\"" : "axis=\"0 1 0\" angle=\"0.4\"";
        const std::string text = body(form, fmt::format("{} position=\"{} {} {}\" velocity=\"{} 0 {}\"", lying,
                                                        0.013 - 0.6 * vx, form.height, -0.6 * vz, vx, vz));
        for (const char* method : {"convex", "ap"}) {
          INFO(name << " mu " << mu << " heading " << vx << ' ' << vz << ' ' << method);
          const Run on_plane = run_scene(directory.path(), scene(plane, text, mu, 1), method);
          const Run on_field = run_scene(directory.path(), scene(flat_field(), text, mu, 1), method);
          CHECK(difference(on_plane, on_field) < 1e-9);
          CHECK(on_field.summary.at("events") == on_plane.summary.at("events"));
          CHECK(on_field.summary.at("energy").at("max_gain_relative") <= 1e-12);
          CHECK(on_field.summary.at("max_penetration") <= 1e-9);
        }
      }
}

TEST_CASE("On a slope of triangles bodies move as on a sloping half-space") {
  const TemporaryDirectory directory;
  const double slope = 0.35, across = 0.1;
  const std::string plane =
      fmt::format("<half_space name=\"ground\" point=\"0 0 0\" normal=\"{} 1 {}\"/>", slope, across);
  const std::string ground = field([&](double x, double z) { return -slope * x - across * z; });
  const double length = std::sqrt(1 + slope * slope + across * across), tilt = std::acos(1 / length);
  for (const char* name : {"box", "sphere", "hull"})
    for (const double mu : {0.0, 0.2}) {
      const Form& form = forms.at(name);
      const double x = -1.53, z = 0.11, h = form.height / length;
      const std::string text =
          body(form, fmt::format("position=\"{} {} {}\" axis=\"{} 0 {}\" angle=\"{}\"", x + h * slope,
                                 -slope * x - across * z + h, z + h * across, across, -slope, tilt));
      for (const char* method : {"convex", "ap"}) {
        INFO(name << " mu " << mu << ' ' << method);
        const Run on_plane = run_scene(directory.path(), scene(plane, text, mu, 1), method);
        const Run on_field = run_scene(directory.path(), scene(ground, text, mu, 1), method);
        CHECK(difference(on_plane, on_field) < 1e-9);
        CHECK(std::stod(on_field.rows.back()[2]) > x + 0.2);
      }
    }
}

TEST_CASE("A field that is turned is the ground that its axes say") {
  const TemporaryDirectory directory;
  // The y axis along x: a wall that a ball without gravity's help rests against nowhere, turned back by the body's
  // turn.
  const std::string text = body(forms.at("sphere"), "position=\"0.3 0.25 0.2\" velocity=\"0.5 0 0.7\"");
  const Run level = run_scene(directory.path(), scene(flat_field(), text, 0.3, 0.5), "convex");
  const std::string turned =
      "<heightfield name=\"ground\" position=\"-3 0 3\" axis=\"0 1 0\" angle=\"${pi/2}\" columns=\"7\" spacing=\"1 1\" "
      "heights=\"" +
      [] {
        std::string zeros;
        for (int i = 0; i < 49; ++i) zeros += "0 ";
        return zeros;
      }() +
      "\"/>";
  CHECK(difference(level, run_scene(directory.path(), scene(turned, text, 0.3, 0.5), "convex")) < 1e-9);
}

TEST_CASE("A ball that falls into a valley comes to rest on both of its sides") {
  const TemporaryDirectory directory;
  const std::string valley = field([](double x, double) { return 0.75 * std::abs(x); });
  const std::string planes =
      "<half_space name=\"ground_1\" point=\"0 0 0\" normal=\"0.75 1 0\"/><half_space name=\"ground_2\" point=\"0 0 "
      "0\" "
      "normal=\"-0.75 1 0\"/>";
  const std::string text = body(forms.at("sphere"), "position=\"0.4 1 0.2\"");
  for (const char* method : {"convex", "coulomb"}) {
    INFO(method);
    const Run fallen = run_scene(directory.path(), scene(valley, text, 0.5, 4), method);
    const auto& last = fallen.rows.back();
    // On both planes of slope 3/4 at distance r: height r 5/4. What is left to and fro is of a step's gravity.
    CHECK(std::stod(last[2]) == Approx(0).margin(1e-5));
    CHECK(std::stod(last[3]) == Approx(0.3125).margin(1e-5));
    CHECK(std::stod(last[11]) == Approx(0).margin(1e-12));
    CHECK(fallen.summary.at("energy").at("max_gain_relative") <= 1e-12);
    CHECK(fallen.summary.at("max_penetration") <= 1e-9);
    CHECK(difference(fallen, run_scene(directory.path(), scene(planes, text, 0.5, 4), method)) < 1e-9);
  }
}

TEST_CASE("A ball, a box and a capsule go over a ridge of triangles as over one convex wedge") {
  const TemporaryDirectory directory;
  const std::string ridge = field([](double x, double) { return -0.25 * std::abs(x); });
  const std::string wedge =
      "<hull name=\"ground\" fixed=\"yes\" position=\"0 0 0\" points=\"-3 -0.75 -3  0 0 -3  3 -0.75 -3  -3 -0.75 3  0 "
      "0 3 "
      "3 -0.75 3  -3 -2 -3  3 -2 -3  -3 -2 3  3 -2 3\"/>";
  const double length = std::sqrt(1 + 0.25 * 0.25);
  for (const auto& [name, form] : forms)
    for (const double mu : {0.0, 0.3}) {
      // Up the left slope, fast enough to come over it.
      const double x = -0.9, h = form.height / length, v = mu > 0 ? 4 : 2.6;
      const std::string text =
          body(form, fmt::format("position=\"{} {} 0.13\" {} velocity=\"{} {} 0\"", x - 0.25 * h, 0.25 * x + h,
                                 name == "capsule" ? "axis=\"1 0 0\" angle=\"${pi/2}\""
                                                   : fmt::format("axis=\"0 0 1\" angle=\"{}\"", std::atan(0.25)),
                                 v / length, 0.25 * v / length));
      INFO(name << " mu " << mu);
      const Run over = run_scene(directory.path(), scene(ridge, text, mu, 0.8), "convex");
      const Run same = run_scene(directory.path(), scene(wedge, text, mu, 0.8), "convex");
      CHECK(std::stod(over.rows.back()[2]) > 0.3);
      // Balanced on the ridge, a box or a hull tips to one side or the other by rounding.
      if (name == "sphere" || name == "capsule")
        CHECK(std::stod(over.rows.back()[2]) == Approx(std::stod(same.rows.back()[2])).margin(1e-4));
      CHECK(over.summary.at("energy").at("max_gain_relative") <= 1e-12);
      CHECK(over.summary.at("max_penetration") <= 1e-9);
    }
}

TEST_CASE("A mesh is the ground that a height field of its triangles is, whatever the file's form") {
  const TemporaryDirectory directory;
  const fs::path& scratch = directory.path();
  const auto height = [](double x, double z) { return 0.125 * x * x + 0.25 * (static_cast<int>(x + z + 6) % 2); };
  std::string obj, facets = "solid hill\n";
  for (int j = 0; j < 7; ++j)
    for (int i = 0; i < 7; ++i) obj += fmt::format("v {} {} {}\n", i, height(i - 3, j - 3), j);
  const auto vertex = [&](int i, int j) { return fmt::format("vertex {} {} {}\n", i, height(i - 3, j - 3), j); };
  const auto facet = [&](const std::string& corners) {
    facets += "facet normal 0 1 0\nouter loop\n" + corners + "endloop\nendfacet\n";
  };
  for (int j = 0; j < 6; ++j)
    for (int i = 0; i < 6; ++i) {
      const int at = 7 * j + i + 1;  // the fan about the cell's first corner, one of them counted from the end
      obj += fmt::format("f {}/1 {}/2/3 {} {}//4\n", at, at + 7, at + 8 - 50, at + 1);
      facet(vertex(i, j) + vertex(i, j + 1) + vertex(i + 1, j + 1));
      facet(vertex(i, j) + vertex(i + 1, j + 1) + vertex(i + 1, j));
    }
  // Its underside is no ground.
  std::ofstream(scratch / "hill.obj") << obj << "f 1 7 49 43\n";
  facet("vertex 0 -1 0\nvertex 1 -1 0\nvertex 0 -1 1\n");
  std::ofstream(scratch / "hill.stl") << facets << "endsolid hill\n";
  const std::string text =
      "<box name=\"body\" size=\"0.3 0.2 0.4\" mass=\"1\" position=\"0.3 1 0.2\" axis=\"1 2 3\" "
      "angle=\"1\" velocity=\"1 0 0.5\"/>";
  const Run on_field = run_scene(scratch, scene(field(height), text, 0.4, 1), "convex");
  for (const char* file : {"hill.obj", "hill.stl"}) {
    INFO(file);
    const std::string mesh = std::string("<mesh name=\"ground\" position=\"-3 0 -3\" file=\"") + file + "\"/>";
    const Run on_mesh = run_scene(scratch, scene(mesh, text, 0.4, 1), "convex");
    CHECK(on_mesh.rows == on_field.rows);
    const Result checked = run(scratch, {"check", "scene.xml"});
    CHECK_THAT(checked.out,
               Catch::Contains(file == std::string("hill.obj") ? "2 of 74 triangles" : "1 of 73 triangles"));
    CHECK_THAT(run(scratch, {"check", "scene.xml", "--files"}).out, Catch::Contains(file));
  }
}

TEST_CASE("Balls, boxes and rocks come down on hilly ground without overlap and without a gain of energy") {
  const TemporaryDirectory directory;
  const std::string hills = std::string(SOURCE_ROOT) + "/scenarios/hills.xml";
  for (const std::vector<std::string>& method :
       {std::vector<std::string>{"convex"}, std::vector<std::string>{"coulomb", "--solver", "newton"}}) {
    INFO(method[0]);
    std::vector<std::string> words{"run", hills, "--out", "out", "--quiet", "--duration", "1.2", "--method"};
    words.insert(words.end(), method.begin(), method.end());
    REQUIRE(run(directory.path(), words).code == 0);
    const Json found = summary(directory.path() / "out");
    CHECK(found.at("max_penetration") <= 1e-9);
    CHECK(found.at("energy").at("max_gain_relative") <= 1e-12);
    for (const std::string& line : lines(read_file(directory.path() / "out" / "trajectory.csv"))) {
      const auto row = cells(line);
      if (row[0] != "t") REQUIRE(std::stod(row[3]) > -0.3);
    }
  }
}
