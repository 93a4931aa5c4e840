// Files of a method's run that cannot be written, whichever it is: the run ends typed, and its other files stay.

#include <catch2/catch.hpp>

#include "contact/problem_files.h"
#include "program/program.h"

using namespace program;

namespace {

std::vector<std::string> short_run(const std::vector<std::string>& more) {
  std::vector<std::string> arguments = {"run", "sticking_box.xml", "--method", "ap", "--duration", "0.01", "--out",
                                        "r",   "--quiet"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

}  // namespace

TEST_CASE("a trajectory that finds no room as npz ends the run so, and stays as rows", "[program]") {
  const TemporaryDirectory directory;
  const fs::path out = directory.path() / "r";
  fs::create_directories(out);
  fs::create_symlink("/dev/full", out / "trajectory.npz.part");
  const Result result = run(directory.path(), short_run({"--format", "npz"}));
  CHECK(result.code == 3);
  const std::string reason = "r/trajectory.npz could not be written: No space left on device";
  CHECK(result.err.find("contactbench run: write_failed: " + reason) != std::string::npos);
  const Json row = summary(out);
  CHECK(row["status"] == "write_failed");
  CHECK(row["reason"] == reason);
  CHECK(row["finished"] == false);
  CHECK(lines(read_file(out / "trajectory.csv")).size() == 1 + 11);
  CHECK_FALSE(fs::exists(out / "trajectory.npz"));
}

TEST_CASE("contacts that find no room end the run in its first step, whichever of their files it is", "[program]") {
  for (const std::string file : {"contacts.csv", "shapes.csv"}) {
    INFO(file);
    const TemporaryDirectory directory;
    const fs::path out = directory.path() / "r";
    fs::create_directories(out);
    fs::create_symlink("/dev/full", out / file);
    CHECK(run(directory.path(), short_run({"--record-contacts"})).code == 3);
    const Json row = summary(out);
    CHECK(row["status"] == "write_failed");
    CHECK(row["reason"] == "r/" + file + " could not be written: No space left on device");
    CHECK(row["finished"] == false);
    CHECK(row["steps"] == 1);
  }
}

TEST_CASE("a problem that cannot be stored ends the run at its event, with the file's name", "[program]") {
  if (!cb::fclib_available()) return;
  const TemporaryDirectory directory;
  fs::create_directories(directory.path() / "p/event_000000003.hdf5/in_the_way");
  CHECK(run(directory.path(), short_run({"--save-problems", "p"})).code == 3);
  const Json row = summary(directory.path() / "r");
  CHECK(row["status"] == "write_failed");
  CHECK(row["reason"].get<std::string>().starts_with("p/event_000000003.hdf5: cannot be written: Is a directory"));
  CHECK(row["finished"] == false);
  CHECK(row["steps"] == 2);
}

TEST_CASE("that the problem which ended a run cannot be kept is a warning, and the run ends as it did", "[program]") {
  if (!cb::fclib_available()) return;
  const TemporaryDirectory directory;
  const std::vector<std::string> failing = {
      "run", SOURCE_ROOT "/scenarios/stress/driven_ram.xml", "--method", "convex", "--out", "r", "--quiet"};
  REQUIRE(run(directory.path(), failing).code == 3);
  const Json before = summary(directory.path() / "r");
  fs::remove_all(directory.path() / "r");
  fs::create_directories(directory.path() / "r/hard_problem.hdf5/in_the_way");
  const Result result = run(directory.path(), failing);
  CHECK(result.code == 3);
  CHECK(result.err.find("contactbench run: warning: r/hard_problem.hdf5: cannot be written: Is a directory") !=
        std::string::npos);
  const Json row = summary(directory.path() / "r");
  CHECK(row["status"] == before["status"]);
  CHECK(row["reason"] == before["reason"]);
  CHECK(row["hard_problem"].is_null());
}

TEST_CASE("a run whose summary cannot be put into its place in the end is no success, and says it elsewhere",
          "[program]") {
  // What is written there goes, and cannot be cut to its length.
  const TemporaryDirectory directory;
  fs::create_directories(directory.path() / "r");
  fs::create_symlink("/dev/null", directory.path() / "r/summary.json");
  const Result result = run(directory.path(), short_run({}));
  CHECK(result.code == 3);
  const std::size_t end = result.err.rfind('}');
  REQUIRE(end != std::string::npos);
  const Json row = Json::parse(result.err.substr(0, end + 1));
  CHECK(row["status"] == "ok");
  CHECK(row["finished"] == true);
  CHECK(result.err.substr(end).find("(at t = 0.01 s; the summary is above)") != std::string::npos);
}
