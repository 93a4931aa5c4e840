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
