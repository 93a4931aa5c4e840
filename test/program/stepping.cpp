// Ways of stepping, as a user asks for them.
#include <catch2/catch.hpp>
#include <set>

#include "program/program.h"

using namespace program;

namespace {

/// Summary of a run to an accuracy of a box that slides, answered by toy_solver.cpp with this fault.
Json slides_to_an_accuracy(const fs::path& directory, const std::string& fault) {
  std::ofstream(directory / "slide.xml") << R"(<scenario title="A box slides">
  <simulation step="1e-3" duration="0.2"/><reference kind="missing"/><gravity constant="0 -9.8 0"/>
  <bodies><half_space name="floor" point="0 0 0" normal="0 1 0"/>
    <box name="box" size="1 1 1" mass="1" position="0 0.5 0" velocity="0.6 0 0"/></bodies>
  <contacts><pair a="box" b="floor" mu="0.25"/></contacts></scenario>)";
  const std::string command = std::string(TOY_SOLVER) + " binary " + fault;
  const Result result =
      run(directory, {"run", "slide.xml", "--method", "external", "--command", command, "--law", "coulomb",
                      "--accuracy", "1e-4", "--record-interval", "0.02", "--out", "r", "--quiet"});
  INFO(result.err);
  REQUIRE(result.code == 0);
  return summary(directory / "r");
}

}  // namespace

TEST_CASE("a wanted accuracy is reached, and the summary says at what cost", "[program]") {
  TemporaryDirectory directory;
  const Result result = run(
      directory.path(), {"run", "sliding_box", "--method", "convex", "--accuracy", "1e-8", "--quiet", "--out", "out"});
  INFO(result.err);
  REQUIRE(result.code == 0);
  CHECK(result.err.empty());
  const Json json = summary(directory.path() / "out");
  CHECK(json["errors"]["position_linf_m"] <= 1e-7);
  CHECK(json["accuracy"]["wanted_m"] == 1e-8);
  CHECK(json["options"]["epsilon"] == 1e-22);  // 1e-6 of its square, J/m^2: velocities are roots of energies
  CHECK(json["accuracy"]["estimated_error_m"] <= 1e-8);
  CHECK(json["accuracy"]["switches"] == 1);
  CHECK(json["accuracy"]["base_solves"] == json["solves"]);
  CHECK(json["solves"] < 1000);
  CHECK(json["options"]["stepping"] == "accuracy");
  CHECK(json["options"]["step"].is_null());
}

TEST_CASE("where the error may be larger than what was wanted a run says by how much", "[program]") {
  // Each of the boxes stops at a time of its own, in a step of first order that may miss half of what is wanted.
  TemporaryDirectory directory;
  std::ofstream(directory.path() / "four.xml") << R"(<scenario title="Four boxes stop">
  <simulation step="1e-3" duration="0.2"/><reference kind="missing"/><gravity constant="0 -9.8 0"/>
  <bodies><half_space name="floor" point="0 0 0" normal="0 1 0"/>
    <box name="a" size="1 1 1" mass="1" position="0 0.5 0" velocity="0.1 0 0"/>
    <box name="b" size="1 1 1" mass="1" position="0 0.5 3" velocity="0.2 0 0"/>
    <box name="c" size="1 1 1" mass="1" position="0 0.5 6" velocity="0.3 0 0"/>
    <box name="d" size="1 1 1" mass="1" position="0 0.5 9" velocity="0.4 0 0"/></bodies>
  <contacts><pair a="*" b="floor" mu="0.25"/></contacts></scenario>)";
  const Result result =
      run(directory.path(), {"run", "four.xml", "--method", "convex", "--accuracy", "1e-6", "--quiet", "--out", "out"});
  INFO(result.err);
  REQUIRE(result.code == 0);
  const double estimated = summary(directory.path() / "out")["accuracy"]["estimated_error_m"];
  REQUIRE(estimated > 1e-6);
  const std::string words = "contactbench run: warning: the error is estimated to be up to ";
  REQUIRE(result.err.starts_with(words));
  CHECK(std::stod(result.err.substr(words.size())) == Approx(estimated).epsilon(1e-2));
  CHECK(result.err.ends_with(" m, of 1e-06 m wanted\n"));
}

TEST_CASE("the summary has the closed gap that is in force", "[program]") {
  TemporaryDirectory directory;
  const Result result = run(directory.path(), {"run", "sliding_box", "--method", "convex", "--accuracy", "1e-9",
                                               "--duration", "0.01", "--quiet", "--out", "out"});
  INFO(result.err);
  REQUIRE(result.code == 0);
  CHECK(summary(directory.path() / "out")["options"]["closed_gap"].get<double>() == Approx(1e-10));
}

TEST_CASE("methods that answer contact after contact say why they have no accuracy", "[program]") {
  for (const std::string method : {"newton", "mirtich"}) {
    TemporaryDirectory directory;
    const Result result = run(
        directory.path(), {"run", "sliding_box", "--method", method, "--accuracy", "1e-6", "--quiet", "--out", "out"});
    CHECK(result.code == 3);
    CHECK(summary(directory.path() / "out")["status"] == "unsupported");
    CHECK(result.err.find("no expansion in the step") != std::string::npos);
  }
}

TEST_CASE("by steps a run says so, and by events it says nothing new", "[program]") {
  TemporaryDirectory directory;
  for (const std::string way : {"steps", "events"}) {
    const Result result = run(directory.path(), {"run", "stack", "--method", "ap", "--duration", "0.01", "--stepping",
                                                 way, "--quiet", "--out", way});
    INFO(result.err);
    REQUIRE(result.code == 0);
  }
  CHECK(summary(directory.path() / "steps")["options"]["stepping"] == "steps");
  CHECK(!summary(directory.path() / "events")["options"].contains("stepping"));
  CHECK(!summary(directory.path() / "events").contains("accuracy"));
}

TEST_CASE("flags of stepping that contradict each other are refused", "[program]") {
  TemporaryDirectory directory;
  const std::vector<std::string> start = {"run", "stack", "--method", "convex"};
  const std::pair<std::vector<std::string>, const char*> rows[] = {
      {{"--accuracy", "1e-6", "--step", "1e-3"}, "--step 1e-3: --accuracy finds its own steps"},
      {{"--accuracy", "0"}, "--accuracy 0: must be a positive length in m"},
      {{"--accuracy", "1e-6", "--order", "9"}, "--order 9: must be a whole number from 2 to 8"},
      {{"--order", "3"}, "--order 3: belongs to --accuracy A; give that too"},
      {{"--record-interval", "0.1"}, "--record-interval 0.1: belongs to --accuracy A; give that too"},
      {{"--stepping", "accuracy"}, "--stepping accuracy: give the accuracy, as in --accuracy 1e-6"},
      {{"--stepping", "leaps"}, "--stepping leaps: must be events or steps; or give --accuracy A"},
      {{"--stepping", "steps", "--accuracy", "1e-6"}, "--stepping steps: has no --accuracy; leave one out"}};
  for (auto [flags, words] : rows) {
    flags.insert(flags.begin(), start.begin(), start.end());
    const Result result = run(directory.path(), flags);
    INFO(result.err);
    CHECK(result.code == 2);
    CHECK(result.err.find(words) != std::string::npos);
  }
  CHECK(content(directory.path()).empty());
}

TEST_CASE("to an accuracy what is only tried leaves no contacts: an extrapolated step has none", "[program]") {
  TemporaryDirectory directory;
  const fs::path out = directory.path() / "out";
  const Result result =
      run(directory.path(), {"run", "sliding_box", "--method", "convex", "--accuracy", "1e-6", "--stepping", "accuracy",
                             "--duration", "0.05", "--record-contacts", "--quiet", "--out", "out"});
  INFO(result.err);
  REQUIRE(result.code == 0);
  std::set<std::string> extrapolated;
  for (const std::string& line : lines(read_file(out / "stepping.csv"))) {
    const auto row = cells(line);
    if (row.at(2) == "macro" && row.at(3) == "0") extrapolated.insert(row[0]);
  }
  REQUIRE_FALSE(extrapolated.empty());
  for (const std::string& line : lines(read_file(out / "contacts.csv")))
    CHECK_FALSE(extrapolated.contains(cells(line).at(1)));
}

TEST_CASE("of answers that do not hold a run to an accuracy keeps the worst, whichever step it is of",
          "[program][external]") {
  // The later a problem, the nearer its answer.
  TemporaryDirectory directory;
  const Json json = slides_to_an_accuracy(directory.path(), "near");
  CHECK(json["status"] == "inaccurate");
  REQUIRE(json["steps"] >= 10);
  CHECK(json["residuals"]["inaccurate_events"] > 10);
  const std::string reason = json["reason"], words = "the worst: checked residual ";
  const std::size_t at = reason.find(words);
  REQUIRE(at != std::string::npos);
  CHECK(std::stod(reason.substr(at + words.size())) == Approx(json["residuals"]["max"].get<double>()).epsilon(1e-2));
}

TEST_CASE("an answer that does not hold in a try that is not taken is none of the run's", "[program][external]") {
  // The box falls into the floor in one base step of the first try, which the others show.
  TemporaryDirectory directory;
  const Json json = slides_to_an_accuracy(directory.path(), "wrong=4");
  CHECK(json["status"] == "ok");
  CHECK(json["residuals"]["false_claims"] == 1);
  CHECK(json["residuals"]["inaccurate_events"] == 0);
  CHECK(json["hard_problem"].is_null());
}
