// Ways of stepping, as a user asks for them.
#include <set>

#include "program/program.h"

using namespace program;

TEST_CASE("a wanted accuracy is reached, and the summary says at what cost", "[program]") {
  TemporaryDirectory directory;
  const Result result = run(
      directory.path(), {"run", "sliding_box", "--method", "convex", "--accuracy", "1e-8", "--quiet", "--out", "out"});
  INFO(result.err);
  REQUIRE(result.code == 0);
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
  for (std::vector<std::string> flags :
       std::vector<std::vector<std::string>>{{"--accuracy", "1e-6", "--step", "1e-3"},
                                             {"--accuracy", "0"},
                                             {"--accuracy", "1e-6", "--order", "9"},
                                             {"--order", "3"},
                                             {"--record-interval", "0.1"},
                                             {"--stepping", "accuracy"},
                                             {"--stepping", "leaps"},
                                             {"--stepping", "steps", "--accuracy", "1e-6"}}) {
    flags.insert(flags.begin(), start.begin(), start.end());
    const Result result = run(directory.path(), flags);
    INFO(result.err);
    CHECK(result.code == 2);
  }
  CHECK(content(directory.path()).empty());
}

TEST_CASE("to an accuracy what is only tried leaves no contacts: an extrapolated step has none", "[program]") {
  TemporaryDirectory directory;
  const fs::path out = directory.path() / "out";
  const Result result = run(directory.path(), {"run", "sliding_box", "--method", "convex", "--accuracy", "1e-6",
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
