// What an engine is asked for is what the flags say, and what it answers stands in its place.

#include <sys/resource.h>

#include <catch2/catch.hpp>
#include <cstdlib>
#include <tuple>

#include "program/engine_rows.h"

#ifdef BROKEN_ENGINE_FOLDER  // where engines are built at all

using namespace program;

namespace {

const std::string fall = std::string(SOURCE_ROOT) + "/scenarios/preflight/fall.xml";

/// An engine with two variants that keeps what it is asked in `asked` and gives this answer.
void write_engine(const fs::path& directory, const std::string& answer) {
  const fs::path program = directory / "contactbench-engine-odd";
  std::ofstream(program)
      << "#!/bin/sh\nif [ \"$1\" = --describe ]; then\nprintf '%s' '"
      << R"({"version": "1.2", "precision": "single", "package": "libodd", "knobs": [{"name": "y", "count_from": 2}],)"
      << R"("variants": [{"name": "a", "knobs": {"x": 1, "y": 2}}, {"name": "b", "knobs": {"x": 3}}]})"
      << "' >&3\nexit\nfi\nprintf '%s' \"$1\" > how\nprintf '%s' \"$2\" > asked\nprintf '%s' '" << answer << "' >&3\n";
  fs::permissions(program, fs::perms::owner_all);
}

Result by_engine(const fs::path& directory, const std::vector<std::string>& arguments) {
  return run(directory, arguments, [&] { setenv("CONTACTBENCH_ENGINES", directory.c_str(), 1); });
}

/// A line of a preflight as it is printed, with the note of all of them here.
std::string fmt_line(const std::string& verdict, const std::string& name, std::string measured, std::string wanted) {
  const auto padded = [](std::string text, std::size_t width) { return text + std::string(width - text.size(), ' '); };
  measured.insert(0, 14 - measured.size(), ' ');
  return "  " + padded(verdict, 6) + ' ' + padded(name, 32) + ' ' + measured + "   " + padded(std::move(wanted), 24) +
         " noted\n";
}

}  // namespace

TEST_CASE("an engine is asked for what the flags say, and its summary says so", "[program][engines]") {
  const TemporaryDirectory directory;
  write_engine(
      directory.path(),
      R"({"status": "unsupported", "reason": "why", "contacts_max": 4, "penetration_max": 0.25, "write_s": 0.5,)"
      R"("errors": [["first", 1.5], ["none", null], ["second", 2.5]]})");
  const Result result = by_engine(directory.path(), {"run",
                                                     "impacting_sphere.xml",
                                                     "--engine",
                                                     "odd",
                                                     "--variant",
                                                     "b",
                                                     "--knob",
                                                     "x=7",
                                                     "--set",
                                                     "mu=0.125",
                                                     "--friction",
                                                     "0.5",
                                                     "--restitution",
                                                     "0.75",
                                                     "--step",
                                                     "0.001",
                                                     "--duration",
                                                     "2",
                                                     "--perturb",
                                                     "0.01",
                                                     "--seed",
                                                     "3",
                                                     "--record-every",
                                                     "4",
                                                     "--time-limit",
                                                     "60",
                                                     "--memory-limit",
                                                     "4000",
                                                     "--out",
                                                     "out",
                                                     "--quiet"});
  INFO(result.err);
  CHECK(result.code == 3);
  CHECK(result.err == "contactbench run: unsupported: why (at t = 0 s; out)\n");
  CHECK(read_file(directory.path() / "how") == "--run");
  const Json asked = Json::parse(read_file(directory.path() / "asked"));
  CHECK(fs::path(asked["scene"].get<std::string>()).filename() == "impacting_sphere.xml");
  CHECK(asked["set"] == Json::parse(R"([["mu", "0.125"]])"));
  CHECK(asked["variant"] == "b");
  CHECK(asked["knobs"] == Json({{"x", 7}}));
  CHECK(asked["friction"] == 0.5);
  CHECK(asked["restitution"] == 0.75);
  CHECK(asked["step"] == 0.001);
  CHECK(asked["duration"] == 2);
  CHECK(asked["perturb"] == 0.01);
  CHECK(asked["seed"] == 3);
  CHECK(asked["record_every"] == 4);
  CHECK(asked["time_limit_s"] == 60);
  CHECK(asked["save_problems"] == "");
  CHECK(asked["save_every"] == 1);
  CHECK(asked["out"] == "out");

  const Json row = summary(directory.path() / "out");
  CHECK(row["scenario"] == "impacting_sphere");
  CHECK(row["parameters"]["mu"] == 0.125);
  CHECK(row["method"] == "odd");
  CHECK(row["variant"] == "b");
  CHECK(row["requested"] == Json({{"method", "odd"}, {"solver", nullptr}, {"variant", "b"}}));
  CHECK(row["used"] == row["requested"]);
  CHECK(row["engine"] == Json({{"name", "odd"},
                               {"version", "1.2"},
                               {"precision", "single"},
                               {"package", "libodd"},
                               {"setting", "own"},
                               {"knobs", {{"x", 7}}}}));
  const Json& options = row["options"];
  CHECK(options["friction"] == 0.5);
  CHECK(options["restitution"] == 0.75);
  CHECK(options["step"] == 0.001);
  CHECK(options["duration"] == 2);
  CHECK(options["perturb"] == 0.01);
  CHECK(options["seed"] == 3);
  CHECK(options["record_every"] == 4);
  CHECK(options["prune"] == "off");
  CHECK(options["time_limit_s"] == 60);
  CHECK(options["memory_limit_mb"] == 4000);
  CHECK(row["status"] == "unsupported");
  CHECK(row["reason"] == "why");
  CHECK(row["contacts_max"] == 4);
  CHECK(row["max_penetration"] == 0.25);
  CHECK(row["time"]["write_s"] == 0.5);
  CHECK(row["errors"] == Json({{"first", 1.5}, {"second", 2.5}}));
  CHECK(row["peak_memory_mb"].get<double>() > 0.1);
}

TEST_CASE("of an engine the first variant, the scene's own step and its knobs as they are stand where nothing is said",
          "[program][engines]") {
  const TemporaryDirectory directory;
  write_engine(directory.path(), R"({"status": "unsupported"})");
  const Result result = by_engine(directory.path(), {"run", fall, "--engine", "odd"});
  CHECK(result.code == 3);
  const Json asked = Json::parse(read_file(directory.path() / "asked"));
  CHECK(asked["variant"] == "a");
  CHECK(asked["knobs"] == Json({{"x", 1}, {"y", 2}}));
  CHECK(asked["step"] == 1e-3);
  CHECK(asked["duration"] == 0.5);
  CHECK(asked["record_every"] == 1);
  for (const char* none : {"friction", "restitution", "time_limit_s"}) CHECK(asked[none].is_null());
  CHECK(asked["out"] == "results/runs/fall__odd__a");
  const Json row = summary(directory.path() / "results/runs/fall__odd__a");
  CHECK(row["requested"]["variant"].is_null());
  CHECK(row["used"]["variant"] == "a");
  CHECK(row["engine"]["setting"] == "default");
  CHECK(
      result.out.starts_with("fall: engine odd, a (single precision, default): unsupported\n"
                             "  reached     0 of 0.5 s in 0 steps of 0.001 s, at most 0 contacts\n"));
  // Each override has its part of the folder's name.
  by_engine(directory.path(),
            {"run",       fall,    "--engine",   "odd", "--variant",      "b",   "--knob",        "x=2",
             "--step",    "0.01",  "--duration", "1",   "--friction",     "0.5", "--restitution", "0.25",
             "--perturb", "0.125", "--seed",     "6",   "--record-every", "7"});
  CHECK(fs::exists(directory.path() /
                   "results/runs/fall__odd__b__own__h0.01__T1__mu0.5__e0.25__perturb0.125__seed6__every7__x_2"));
  by_engine(directory.path(), {"run", "impacting_sphere.xml", "--engine", "odd", "--set", "mu=0.5", "--quiet"});
  CHECK(fs::exists(directory.path() / "results/runs/impacting_sphere__odd__a__mu0.5"));
  // A build without HDF5 keeps no problems.
  if (by_engine(directory.path(), {"run", fall, "--engine", "odd", "--save-problems", "kept", "--save-every", "3",
                                   "--out", "out", "--quiet"})
          .code == 2)
    return;
  const Json keeping = Json::parse(read_file(directory.path() / "asked"));
  CHECK(keeping["save_problems"] == "kept");
  CHECK(keeping["save_every"] == 3);
}

TEST_CASE("an engine's run whose summary finds no room has not finished", "[program][engines]") {
  // No file may grow beyond 64 kB; the engine takes its one step, and gives an error with a longer name.
  const TemporaryDirectory directory;
  write_engine(directory.path(), R"({"status": "ok", "errors": [[")" + std::string(100000, 'x') + R"(", 1]]})");
  std::ofstream(directory.path() / "contactbench-engine-odd", std::ios::app)
      << R"(printf '\0\0\0\0\0\0\0\0\1' >&4)" << '\n';
  for (const bool room : {true, false}) {
    const Result result =
        run(directory.path(),
            {"run", fall, "--engine", "odd", "--step", "0.5", "--duration", "0.5", "--out", "out", "--quiet"}, [&] {
              setenv("CONTACTBENCH_ENGINES", directory.path().c_str(), 1);
              rlimit limit{65536, 65536};
              if (!room) setrlimit(RLIMIT_FSIZE, &limit);
            });
    INFO(result.err.substr(0, 1000));
    CHECK(result.code == (room ? 0 : 3));
    CHECK(result.err.empty() == room);
  }
}

TEST_CASE("an engine's knobs that nobody has tuned, or that it does not have, are refused by name",
          "[program][engines]") {
  const TemporaryDirectory directory;
  write_engine(directory.path(), R"({"status": "unsupported"})");
  const std::vector<std::string> start = {"run", fall, "--engine", "odd", "--out", "out", "--quiet"};
  CHECK(by_engine(directory.path(), joined(start, {"--setting", "tuned"})).code == 3);
  const Json row = summary(directory.path() / "out");
  CHECK(row["status"] == "unavailable");
  CHECK(row["reason"] == "nobody has searched for knobs of odd/a (scripts/engines.py tune)");
  CHECK_FALSE(fs::exists(directory.path() / "asked"));
  const auto refused_with = [&](const std::vector<std::string>& more, const std::string& words) {
    const Result result = by_engine(directory.path(), joined(start, more));
    INFO(result.err);
    CHECK(result.code == 2);
    CHECK(result.err.find(words) != std::string::npos);
  };
  refused_with({"--knob", "z=1"}, "--knob z: no such knob; there are x, y");
  for (const std::string value : {"1", "2.5", "2147483648", "1e300", "-1"})
    refused_with({"--knob", "y=" + value}, "--knob y=" + value + ": must be a whole number from 2 to 2147483647");
  refused_with({"--knob", "x"}, "--knob x: must be NAME=VALUE");
  refused_with({"--knob", "x=2", "--knob", "y=3", "--knob", "x=4"}, "--knob x=4: x is given twice");
  refused_with({"--knob", "x=fast"}, "--knob fast: must be NAME=NUMBER");
  refused_with({"--variant", "c"}, "--variant c: odd has no such variant; there are a, b");
  CHECK_FALSE(fs::exists(directory.path() / "asked"));
}

TEST_CASE("runs whose knobs lie over the defaults and over those tuned have a folder each", "[program][engines]") {
  const TemporaryDirectory directory;
  // In the place of an engine that has been tuned.
  const fs::path program = directory.path() / "contactbench-engine-ode";
  std::ofstream(program) << "#!/bin/sh\nif [ \"$1\" = --describe ]; then\nprintf '%s' '"
                         << R"({"knobs": [], "variants": [{"name": "quick", "knobs": {"erp": 1, "iterations": 2}}]})"
                         << "' >&3\nelse\nprintf '%s' '{\"status\": \"unsupported\"}' >&3\nfi\n";
  fs::permissions(program, fs::perms::owner_all);
  for (const char* setting : {"default", "tuned"}) {
    const Result result = by_engine(
        directory.path(), {"run", fall, "--engine", "ode", "--setting", setting, "--knob", "iterations=50", "--quiet"});
    INFO(result.err);
    CHECK(result.code == 3);
  }
  const fs::path runs = directory.path() / "results/runs";
  CHECK(summary(runs / "fall__ode__quick__own__iterations_50")["engine"]["knobs"]["erp"] == 1);
  CHECK(summary(runs / "fall__ode__quick__own__tuned__iterations_50")["engine"]["knobs"]["erp"] != 1);
  by_engine(directory.path(), {"run", fall, "--engine", "ode", "--setting", "tuned", "--quiet"});
  CHECK(fs::exists(runs / "fall__ode__quick__tuned/summary.json"));
  // Nor is the preflight of the one that of the other.
  for (const std::string setting : {"default", "tuned"}) {
    const Result checked = by_engine(directory.path(), {"check", "--engine", "ode", "--setting", setting, "--json"});
    const Json knobs = Json::parse(checked.out)[0]["knobs"];
    CHECK((knobs["erp"] == 1) == (setting == "default"));
    CHECK(knobs.size() == 2);  // cfm was tuned, too, which this one does not have
  }
}

TEST_CASE("an engine is listed with what it says of itself, or with why it says nothing", "[program][engines]") {
  const TemporaryDirectory directory;
  const auto listed = [&] {
    const Json all = Json::parse(by_engine(directory.path(), {"list", "engines", "--json"}).out);
    for (const Json& entry : all)
      if (entry["name"] == "odd") return entry;
    return Json();
  };
  write_engine(directory.path(), "{}");
  const Json entry = listed();
  CHECK(entry["version"] == "1.2");
  CHECK(entry["precision"] == "single");
  CHECK(entry["package"] == "libodd");
  CHECK(entry["program"] == (directory.path() / "contactbench-engine-odd").string());
  CHECK(entry["unavailable"].is_null());
  CHECK(entry["variants"][1]["knobs"] == Json({{"x", 3}}));
  const std::string plain = by_engine(directory.path(), {"list", "engines"}).out;
  CHECK(plain.find(" (odd 1.2, single precision, libodd)\n") != std::string::npos);
  CHECK(plain.find("    a             \n") != std::string::npos);  // its variants have no summary
  std::ofstream(directory.path() / "contactbench-engine-odd") << "#!/bin/sh\necho first >&2; echo 'no library' >&2\n";
  CHECK(listed()["unavailable"] == "contactbench-engine-odd does not say what it is: no library");
}

TEST_CASE("an engine that does not hear that it should stop is stopped, and the run was interrupted",
          "[program][engines]") {
  const TemporaryDirectory directory;
  write_engine(directory.path(), "' >&3; trap '' TERM; : > going; while :; do sleep 0.05; done; printf '");
  Process process(directory.path(), {"run", fall, "--engine", "odd", "--out", "out", "--quiet"},
                  [&] { setenv("CONTACTBENCH_ENGINES", directory.path().c_str(), 1); });
  REQUIRE(wait_until([&] { return fs::exists(directory.path() / "going"); }));
  process.send(SIGINT);
  const Result result = process.wait();
  CHECK(result.code == 3);
  const Json row = summary(directory.path() / "out");
  CHECK(row["status"] == "interrupted");
  CHECK(row["reason"] == "stopped by a signal");
  CHECK(row["finished"] == false);
}

TEST_CASE("the preflight of an engine is that of each variant, or of the one that is asked for", "[program][engines]") {
  const TemporaryDirectory directory;
  const auto line = [](const char* name, const char* measured, const char* rest) {
    return std::string(R"({"name": ")") + name + R"(", "measured": )" + measured +
           R"(, "expected": 2, "allowed": 0.5, )" + R"("unit": "m/s", "note": "noted", )" + rest + "}";
  };
  const std::string good = line("good", "2.25", "\"passed\": true"), bad = line("bad", "3.5", "\"passed\": false"),
                    none = line("none", "null", "\"passed\": false, \"unsupported\": true");
  write_engine(directory.path(), "{\"lines\": [" + good + ", " + none + "]}");
  const Result passes = by_engine(directory.path(), {"check", "--engine", "odd"});
  INFO(passes.out << passes.err);
  CHECK(passes.code == 0);
  const std::string ok = fmt_line("ok", "good", "2.25", "2 +- 0.5 m/s"), not_there = fmt_line("-", "none", "-", "");
  CHECK(passes.out ==
        "odd a, default, h = 0.001 s\n" + ok + not_there + "odd b, default, h = 0.001 s\n" + ok + not_there);
  CHECK(read_file(directory.path() / "how") == "--preflight");
  const Json asked = Json::parse(read_file(directory.path() / "asked"));
  CHECK(asked["variant"] == "b");
  CHECK(asked["knobs"] == Json({{"x", 3}}));
  CHECK(asked["step"] == 1e-3);
  CHECK(fs::is_directory(asked["out"].get<std::string>()));

  write_engine(directory.path(), "{\"lines\": [" + good + ", " + bad + "]}");
  const Result fails = by_engine(
      directory.path(), {"check", "--engine", "odd", "--variant", "a", "--step", "0.01", "--setting", "tuned"});
  CHECK(fails.code == 3);
  CHECK(fails.out == "odd a, tuned, h = 0.01 s\n" + ok + fmt_line("FAILS", "bad", "3.5", "2 +- 0.5 m/s") +
                         "A line that fails stands beside the engine's rows (docs/engines.md).\n");
  CHECK(Json::parse(read_file(directory.path() / "asked"))["step"] == 0.01);
  const Result as_json = by_engine(directory.path(), {"check", "--engine", "odd", "--variant", "a", "--json"});
  CHECK(as_json.code == 3);
  const Json rows = Json::parse(as_json.out);
  REQUIRE(rows.size() == 1);
  CHECK(rows[0]["engine"] == "odd");
  CHECK(rows[0]["variant"] == "a");
  CHECK(rows[0]["setting"] == "default");
  CHECK(rows[0]["step"] == 1e-3);
  CHECK(rows[0]["fault"].is_null());
  CHECK(rows[0]["knobs"] == Json({{"x", 1}, {"y", 2}}));
  CHECK(rows[0]["lines"] == Json::parse("[" + good + ", " + bad + "]"));

  // The fall of the preflight takes half a second.
  const Result too_long = by_engine(directory.path(), {"check", "--engine", "odd", "--variant", "a", "--step", "10"});
  CHECK(too_long.code == 2);
  CHECK(too_long.err.find("--step 10: must be a positive number of seconds, at most 0.5") != std::string::npos);
  const std::vector<std::string> check = {"check", "--engine", "odd"};
  CHECK(by_engine(directory.path(), joined(check, {"--variant", "a", "--step", "0.5"})).code == 3);
  for (const auto& [flag, value, words] :
       {std::tuple("--step", "0.5001", "--step 0.5001: must be a positive number of seconds, at most 0.5"),
        std::tuple("--variant", "c", "--variant c: odd has no such variant; there are a, b"),
        std::tuple("--setting", "best", "--setting best: must be default or tuned"),
        std::tuple("--engine", "od", "--engine od: no such engine")}) {
    const Result refused =
        by_engine(directory.path(), flag == std::string("--engine") ? std::vector<std::string>{"check", flag, value}
                                                                    : joined(check, {flag, value}));
    INFO(refused.err);
    CHECK(refused.code == 2);
    CHECK(refused.out.empty());
    CHECK(refused.err.find(words) != std::string::npos);
  }
  for (const std::string odd : {R"({"lines": [{"name": "good"}]})", R"({"lines": 3})"}) {
    write_engine(directory.path(), odd);
    const Result unlike = by_engine(directory.path(), {"check", "--engine", "odd", "--variant", "a"});
    CHECK(unlike.code == 3);
    CHECK(unlike.out.starts_with("odd a, default, h = 0.001 s: crash: its preflight has no lines"));
  }

  write_engine(directory.path(), "' >&3; echo 'what was last said' >&2; exit 5; printf '");
  const Result dies = by_engine(directory.path(), {"check", "--engine", "odd", "--variant", "a"});
  CHECK(dies.code == 3);
  CHECK(dies.out.starts_with("odd a, default, h = 0.001 s: crash: exit code 5: what was last said\n"));
}

#endif
