// What a run and a check put out besides rows: JSON, arrays, the real-time factor.

#include <algorithm>
#include <catch2/catch.hpp>

#include "program/program.h"

using namespace program;

TEST_CASE("check says what is in a scene as JSON, and what a method leaves out", "[program]") {
  TemporaryDirectory directory;
  const Result result = run(directory.path(), {"check", "stack.xml", "--set", "boxes=3", "--json"});
  REQUIRE(result.code == 0);
  const Json json = Json::parse(result.out);
  CHECK(json["name"] == "stack");
  CHECK(json["bodies"] == 3);
  CHECK(json["shapes"]["box"] == 3);
  CHECK(json["parameters"]["boxes"] == "3");
  CHECK(json["pairs_at_start"] == 3);
  CHECK(json["contacts_at_start"].get<int>() >= 12);
  CHECK(json["step_s"].get<double>() > 0);
  CHECK(json["trial"].is_null());
  CHECK(json["fault"] == "");
  const Json tried =
      Json::parse(run(directory.path(), {"check", "stack.xml", "--method", "ap", "--steps", "5", "--json"}).out);
  CHECK(tried["trial"]["steps"] == 5);
  CHECK(tried["method"] == "ap");
}

TEST_CASE("contacts at the start are those of shapes as they lie on their bodies", "[program]") {
  TemporaryDirectory directory;
  // A unit box on its edge: turned on its link, which is not.
  std::ofstream(directory.path() / "edge.xml") << R"(<scenario title="test"><simulation step="1e-3" duration="1"/>
    <reference kind="missing"/><gravity constant="0 -9.8 0"/><bodies>
    <half_space name="ground" point="0 0 0" normal="0 1 0"/>
    <robot name="sled"><link name="runner" mass="1" position="0 0 0" inertia="1 1 1">
      <box name="keel" size="1 1 1" position="0 0.7071067811865476 0" axis="0 0 1" angle="0.7853981633974483"/></link>
      <joint name="rail" kind="prismatic" parent="world" child="runner" axis="1 0 0"/></robot></bodies>
    <contacts><pair a="keel" b="ground" mu="0.1"/></contacts></scenario>)";
  const Json json = Json::parse(run(directory.path(), {"check", "edge.xml", "--json"}).out);
  CHECK(json["contacts_at_start"] == 2);
  CHECK(json["pairs_at_start"] == 1);
}

TEST_CASE("a trajectory as npz takes the place of the rows, whatever becomes of the run", "[program]") {
  TemporaryDirectory directory;
  const fs::path out = directory.path() / "r";
  const std::vector<std::string> arguments = {"run",  "sliding_box.xml", "--method", "newton",   "--duration",
                                              "0.05", "--out",           "r",        "--format", "npz"};
  const Result result = run(directory.path(), arguments);
  REQUIRE(result.code == 0);
  CHECK(result.out.find("times real time") != std::string::npos);
  CHECK_FALSE(fs::exists(out / "trajectory.csv"));
  const std::string npz = read_file(out / "trajectory.npz");
  CHECK(npz.starts_with("PK\x03\x04"));
  for (const char* name : {"t.npy", "bodies.npy", "position.npy", "orientation.npy", "velocity.npy"})
    CHECK(npz.find(name) != std::string::npos);
  // The head of each array is as long as says numpy's format: whole lines of 64 bytes.
  for (std::size_t at = npz.find("\x93NUMPY"); at != std::string::npos; at = npz.find("\x93NUMPY", at + 1)) {
    const int length = static_cast<unsigned char>(npz[at + 8]) + 256 * static_cast<unsigned char>(npz[at + 9]);
    CHECK((10 + length) % 64 == 0);
    CHECK(npz[at + 9 + std::size_t(length)] == '\n');
  }
  // The same input, the same bytes; and rows again where they are asked for.
  REQUIRE(run(directory.path(), arguments).code == 0);
  CHECK(read_file(out / "trajectory.npz") == npz);
  REQUIRE(run(directory.path(), {"run", "sliding_box.xml", "--method", "newton", "--duration", "0.05", "--out", "r"})
              .code == 0);
  CHECK(fs::exists(out / "trajectory.csv"));
  CHECK_FALSE(fs::exists(out / "trajectory.npz"));
  refused({"run", "sliding_box.xml", "--method", "newton", "--format", "parquet"}, {"unavailable", "csv and npz"});
  refused({"run", "sliding_box.xml", "--method", "newton", "--format", "xml"}, {"csv or npz"});
  refused({"run", "sliding_box.xml", "--method", "newton", "--format", "npz", "--record-every", "0"},
          {"no trajectory"});
}

TEST_CASE("a run leaves no file of an earlier one that it does not write itself", "[program]") {
  const TemporaryDirectory directory;
  const fs::path out = directory.path() / "r";
  const std::vector<std::string> earlier = {"hard_problem.hdf5", "trajectory.npz", "joints.csv",   "loads.csv",
                                            "stepping.csv",      "contacts.csv",   "shapes.csv",   "hulls.csv",
                                            "steps.csv",         "trajectory.csv", "summary.json", "notes.txt"};
  fs::create_directories(out);
  for (const std::string& name : earlier) std::ofstream(out / name) << "old\n";
  REQUIRE(
      run(directory.path(), {"run", "sticking_box.xml", "--method", "ap", "--duration", "0.002", "--out", "r"}).code ==
      0);
  auto names = content(out);
  std::sort(names.begin(), names.end());
  CHECK(names == std::vector<std::string>{"notes.txt", "steps.csv", "summary.json", "trajectory.csv"});
  CHECK(read_file(out / "notes.txt") == "old\n");
  for (const char* name : {"steps.csv", "trajectory.csv", "summary.json"})
    CHECK(read_file(out / name).find("old") == std::string::npos);
}

TEST_CASE("check says of a scene that no velocity lets its contacts be, as a run would", "[program]") {
  // A ram that its stop drives against a cube against a wall.
  const TemporaryDirectory directory;
  const std::string ram = std::string(SOURCE_ROOT) + "/scenarios/stress/driven_ram.xml";
  const std::string fault = "infeasible: no velocity lets none of the contacts approach";
  for (const auto& [gap, code] : {std::pair("gap=0", 3), std::pair("gap=0.1", 0)}) {
    const Result result = run(directory.path(), {"check", ram, "--set", gap, "--json"});
    INFO(gap << ": " << result.err);
    CHECK(result.code == code);
    CHECK(Json::parse(result.out)["fault"] == (code == 0 ? "" : fault));
    if (code != 0) CHECK(result.err == "contactbench check: a run of driven_ram does not finish: " + fault + "\n");
  }
}

TEST_CASE("bodies that pass through each other are not told to step their impacts one by one", "[program]") {
  const TemporaryDirectory directory;
  for (const auto& [other, notes] : {std::pair("ground", 1), std::pair("s_*", 2)}) {
    std::ofstream(directory.path() / "eight.xml")
        << R"(<scenario title="eight balls"><simulation step="1e-3" duration="1"/><reference kind="missing"/>)"
           R"(<gravity constant="0 -9.8 0"/><bodies><half_space name="ground" point="0 0 0" normal="0 1 0"/>)"
           R"(<array count="8" offset="3 0 0"><sphere name="s" radius="1" mass="1" position="0 1 0"/></array></bodies>)"
           R"(<contacts><pair a="s_*" b=")"
        << other << R"(" mu="0.5"/></contacts></scenario>)";
    const Json json = Json::parse(run(directory.path(), {"check", "eight.xml", "--json"}).out);
    INFO(other);
    CHECK(json["stepping"].size() == static_cast<std::size_t>(notes));
  }
}

TEST_CASE("a listing of everything has a heading for each topic, and below it what belongs to each", "[program]") {
  const TemporaryDirectory directory;
  const std::string all = run(directory.path(), {"list"}).out;
  CHECK(all.starts_with("methods\n  newton "));
  CHECK(all.find("\nstatuses\n  ok ") != std::string::npos);
  CHECK(all.find("\ncontrollers\n  figure_eight ") != std::string::npos);
  const std::string one = run(directory.path(), {"list", "controllers"}).out;
  CHECK(one.starts_with("figure_eight "));
  CHECK(one.find("one of: computed, torque; default computed\n") != std::string::npos);
}
