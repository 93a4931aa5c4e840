// What the command line says reaches what it is about, and nothing else.

#include <array>
#include <catch2/catch.hpp>
#include <cmath>

#include "program/program.h"

using namespace program;

TEST_CASE("a perturbation is as large as it is asked for, and each seed's is its own", "[program]") {
  const TemporaryDirectory directory;
  const auto moved = [&](const std::string& seed) {
    REQUIRE(run(directory.path(), {"run", "impacting_sphere.xml", "--method", "ap", "--duration", "0.002", "--perturb",
                                   "1e-3", "--seed", seed, "--out", "r", "--quiet"})
                .code == 0);
    const auto start = cells(lines(read_file(directory.path() / "r" / "trajectory.csv")).at(1));
    return std::array<double, 3>{std::stod(start.at(2)), std::stod(start.at(3)) - 1.5, std::stod(start.at(4))};
  };
  const auto one = moved("1"), again = moved("1"), other = moved("2");
  for (const auto& by : {one, other}) CHECK(std::hypot(by[0], by[1], by[2]) == Approx(1e-3).epsilon(1e-9));
  CHECK(one == again);
  CHECK(one != other);
}

TEST_CASE("joint forces that the command line names are those of the run, whichever the scene names", "[program]") {
  const TemporaryDirectory directory;
  for (const std::vector<std::string>& more : {std::vector<std::string>{}, {"--joint-forces", "explicit"}}) {
    std::vector<std::string> words = {"run",   "quadruped.xml", "--method", "convex", "--duration",
                                      "0.002", "--out",         "r",        "--quiet"};
    words.insert(words.end(), more.begin(), more.end());
    REQUIRE(run(directory.path(), words).code == 0);
    const Json options = summary(directory.path() / "r")["options"];  // says nothing of what is explicit
    CHECK(options.contains("joint_forces") == more.empty());
  }
}

TEST_CASE("a folder of a scene's name does not hide the scene that comes with the program", "[program]") {
  const TemporaryDirectory directory;
  fs::create_directory(directory.path() / "stack");
  const Result result = run(directory.path(), {"check", "stack", "--files"});
  INFO(result.err);
  REQUIRE(result.code == 0);
  CHECK(fs::path(lines(result.out).at(0)).filename() == "stack.xml");
}

TEST_CASE("a method is tried for as many steps as a scene has where these are fewer", "[program]") {
  const TemporaryDirectory directory;
  std::ofstream(directory.path() / "short.xml")
      << R"(<scenario title="short"><simulation step="1e-3" duration="0.005"/><reference kind="missing"/>)"
         R"(<gravity constant="0 -9.8 0"/><bodies><sphere name="ball" radius="1" mass="1" position="0 2 0"/></bodies>)"
         "</scenario>";
  for (const auto& [asked, tried] : {std::pair("100", 5), std::pair("3", 3), std::pair("0", 0)}) {
    const Result result = run(directory.path(), {"check", "short.xml", "--method", "ap", "--steps", asked, "--json"});
    INFO(result.err);
    REQUIRE(result.code == 0);
    CHECK(Json::parse(result.out)["trial"]["steps"] == tried);
  }
}

TEST_CASE("with the compression bound check tells of a box that would tip, of none that stands fixed", "[program]") {
  const TemporaryDirectory directory;
  const auto said = [&](const std::string& wall) {
    std::ofstream(directory.path() / "wall.xml")
        << R"(<scenario title="A ball and a wall"><parameters><parameter name="width" type="number" default="0.25")"
           R"( description="of the wall"/></parameters><simulation step="1e-3" duration="1" compression_bound="on"/>)"
           R"(<reference kind="missing"/><gravity constant="0 -9.8 0"/><bodies>)"
           R"(<half_space name="ground" point="0 0 0" normal="0 1 0"/><sphere name="ball" radius="1" mass="1")"
           R"( position="0 1 0"/><box name="wall" size="${width} 2 2" position="3 1 0" )"
        << wall << R"(/></bodies><contacts><pair a="ball" b="ground" mu="0.5"/><pair a="ball" b="wall" mu="0.5"/>)"
        << "</contacts></scenario>";
    return run(directory.path(), {"check", "wall.xml", "--method", "convex", "--steps", "0"}).out;
  };
  const std::string fixed = said("fixed=\"yes\"");
  CHECK(fixed.find("\n  parameter   width = 0.25: of the wall (a number) [0.25]\n") != std::string::npos);
  CHECK(fixed.find("\n  method      convex: ") != std::string::npos);
  CHECK(fixed.find("\n  note ") == std::string::npos);
  const std::string note = "\n  note        with the compression bound a box that should tip slides: wall tips ";
  CHECK(said("mass=\"1\"").find(note) != std::string::npos);
}

TEST_CASE("the ends of a range are part of it", "[program]") {
  const TemporaryDirectory directory;
  for (const auto& [restitution, friction] : {std::pair("1", "0"), std::pair("0", "9")}) {
    const Result result =
        run(directory.path(), {"run", "impacting_sphere.xml", "--method", "ap", "--duration", "0.002", "--restitution",
                               restitution, "--friction", friction, "--out", "r", "--quiet"});
    INFO(result.err);
    REQUIRE(result.code == 0);
    CHECK(summary(directory.path() / "r")["options"]["restitution"] == std::stod(restitution));
    CHECK(summary(directory.path() / "r")["options"]["friction"] == std::stod(friction));
  }
}
