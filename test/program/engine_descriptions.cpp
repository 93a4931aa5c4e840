// What an engine's program says of itself, of its preflight and of its run where a part is missing or of another kind,
// and where no program is looked for.

#include <catch2/catch.hpp>
#include <cstdlib>

#include "program/engine_rows.h"

#ifdef BROKEN_ENGINE_FOLDER  // where engines are built at all

using namespace program;

namespace {

const std::string fall = std::string(SOURCE_ROOT) + "/scenarios/preflight/fall.xml";
const std::string sound = R"({"variants": [{"name": "a", "knobs": {}}], "knobs": []})";

/// An engine that says this where it is asked what it is, and that where it is asked for anything else.
void write_engine(const fs::path& directory, const std::string& description, const std::string& answer,
                  const std::string& name = "odd") {
  const fs::path program = directory / ("contactbench-engine-" + name);
  std::ofstream(program) << "#!/bin/sh\nif [ \"$1\" = --describe ]; then\nprintf '%s' '" << description
                         << "' >&3\nelse\nprintf '%s' '" << answer << "' >&3\nfi\n";
  fs::permissions(program, fs::perms::owner_all);
}

Result by_engine(const fs::path& directory, const Words& words) {
  return run(directory, words, [&] { setenv("CONTACTBENCH_ENGINES", directory.c_str(), 1); });
}

}  // namespace

TEST_CASE("a description that lacks a part, or has it of another kind, says nothing, and the run is named without",
          "[program][engines]") {
  const TemporaryDirectory directory;
  write_engine(directory.path(), sound, R"({"lines": []})");
  CHECK(by_engine(directory.path(), {"check", "--engine", "odd"}).code == 0);
  for (const char* description :
       {"5", R"({"knobs": []})", R"({"variants": [{"name": "a", "knobs": {}}]})", R"({"variants": [], "knobs": []})",
        R"({"variants": {"a": {"name": "a", "knobs": {}}}, "knobs": []})", R"({"variants": [5], "knobs": []})",
        R"({"variants": [{"knobs": {}}], "knobs": []})", R"({"variants": [{"name": 5, "knobs": {}}], "knobs": []})",
        R"({"variants": [{"name": "a"}], "knobs": []})", R"({"variants": [{"name": "a", "knobs": [1]}], "knobs": []})",
        R"({"variants": [{"name": "a", "knobs": {"x": "1"}}], "knobs": []})",
        R"({"variants": [{"name": "a", "knobs": {}}], "knobs": [], "version": 5})"}) {
    INFO(description);
    write_engine(directory.path(), description, R"({"lines": []})");
    const Result result = by_engine(directory.path(), {"check", "--engine", "odd"});
    CHECK(result.code == 3);
    CHECK(result.err == "contactbench check: unavailable: contactbench-engine-odd does not say what it is\n");
  }
  CHECK(by_engine(directory.path(), {"run", fall, "--engine", "odd", "--quiet"}).code == 3);
  const Json row = summary(directory.path() / "results/runs/fall__odd");
  CHECK(row["status"] == "unavailable");
  CHECK(row["reason"] == "contactbench-engine-odd does not say what it is");
}

TEST_CASE("a preflight whose lines are none, or have a word where a number should be, is no success",
          "[program][engines]") {
  const TemporaryDirectory directory;
  const Json line = Json::parse(R"({"name": "good", "measured": 2.25, "expected": 2, "allowed": 0.5, "unit": "m/s",)"
                                R"( "note": "noted", "passed": true})");
  std::vector<std::string> answers = {"{}", "[]", R"({"lines": null})", "{\"lines\": {\"a\": " + line.dump() + "}}"};
  for (const char* part : {"name", "expected", "allowed", "unit", "note"}) {
    Json other = line;
    other[part] = line[part].is_string() ? Json(5) : Json("word");
    answers.push_back("{\"lines\": [" + other.dump() + "]}");
  }
  for (const std::string& answer : answers) {
    INFO(answer);
    write_engine(directory.path(), sound, answer);
    const Result result = by_engine(directory.path(), {"check", "--engine", "odd"});
    CHECK(result.code == 3);
    CHECK(result.out.starts_with(
        "odd a, default, h = 0.001 s: crash: its preflight has no lines as docs/engines.md says\n"));
  }
}

TEST_CASE("an engine that says nothing of how its run ended has given no answer", "[program][engines]") {
  const TemporaryDirectory directory;
  for (const char* answer : {"{}", "[]", ""}) {
    INFO(answer);
    write_engine(directory.path(), sound, answer);
    CHECK(by_engine(directory.path(), {"run", fall, "--engine", "odd", "--out", "out", "--quiet"}).code == 3);
    const Json row = summary(directory.path() / "out");
    CHECK(row["status"] == "crash");
    CHECK(row["reason"] == "the engine's program gave no answer");
  }
  const Result nowhere = by_engine(directory.path(), {"run", fall, "--engine", "odd", "--save-problems", ""});
  CHECK(nowhere.code == 2);
  CHECK(nowhere.err == "contactbench run: --save-problems '': must name a directory\n");
}

TEST_CASE("no engine is found in the folder at hand where none is named, and what is no word of one is not printed",
          "[program][engines]") {
  const TemporaryDirectory directory;
  const fs::path installed = directory.path() / "bin/contactbench";
  fs::create_directories(installed.parent_path());
  fs::copy_file(PROGRAM, installed);
  const auto told = [&](const std::string& folder, const std::string& words) {
    const int status = std::system(("cd '" + directory.path().string() + "' && CONTACTBENCH_ENGINES='" + folder +
                                    "' bin/contactbench " + words + " > out 2> err")
                                       .c_str());
    return WEXITSTATUS(status);
  };
  write_engine(directory.path(), sound, R"({"lines": []})", "ode");
  CHECK(told("", "check --engine ode") == 3);
  CHECK(read_file(directory.path() / "err") ==
        "contactbench check: unavailable: this build has no program of the engine ode: install libode-dev and build "
        "again (scripts/setup.sh --engines)\n");
  write_engine(directory.path(),
               R"({"summary": 7, "version": "1", "precision": "single", "knobs": [],)"
               R"( "variants": [{"name": "a", "summary": 5, "knobs": {}}]})",
               "{}");
  CHECK(told(directory.path().string(), "list engines") == 0);
  const std::string lines_of_it = "   (odd 1, single precision, )\n    a" + std::string(13, ' ') + "\n";
  CHECK(read_file(directory.path() / "out").find(lines_of_it) != std::string::npos);
}

#endif
