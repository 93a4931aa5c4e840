// How a run of an engine ends where a file, a signal or the engine's own program is in the way, and what it says then;
// and how a preflight does.

#include <catch2/catch.hpp>
#include <cstdlib>

#include "program/engine_rows.h"

#ifdef BROKEN_ENGINE_FOLDER  // where engines are built at all

using namespace program;

namespace {

const std::string fall = std::string(SOURCE_ROOT) + "/scenarios/preflight/fall.xml";

/// The engine that is broken on purpose beside those of the build.
void broken_too() { setenv("CONTACTBENCH_ENGINES", BROKEN_ENGINE_FOLDER, 1); }

/// A run by its variant that is right.
Result falls(const fs::path& directory, const Words& more) {
  return run(directory, joined({"run", fall, "--engine", "broken", "--variant", "falls", "--out", "out"}, more),
             broken_too);
}

/// An engine that describes itself rightly, and does this where it is asked for anything else.
void write_odd(const fs::path& directory, const std::string& script,
               const std::string& variants = R"({"name": "a", "knobs": {}})") {
  const fs::path program = directory / "contactbench-engine-odd";
  std::ofstream(program) << "#!/bin/sh\nif [ \"$1\" = --describe ]; then\nprintf '%s' '"
                         << R"({"variants": [)" << variants << R"(], "knobs": []})"
                         << "' >&3\nelse\n"
                         << script << "\nfi\n";
  fs::permissions(program, fs::perms::owner_all);
}

Result by_odd(const fs::path& directory, const Words& arguments) {
  return run(directory, arguments, [&] { setenv("CONTACTBENCH_ENGINES", directory.c_str(), 1); });
}

}  // namespace

TEST_CASE("files of an engine's run that cannot be written end it there, and are named", "[program][engines]") {
  for (const std::string file : {"trajectory.csv", "steps.csv"})
    for (const std::string duration : {"0.5", "0.001"}) {  // 500 steps, and one, the last
      INFO(file << " in " << duration << " s");
      const TemporaryDirectory directory;
      fs::create_directories(directory.path() / "out" / file / "in_the_way");
      CHECK(falls(directory.path(), {"--duration", duration, "--quiet"}).code == 3);
      const Json row = summary(directory.path() / "out");
      CHECK(row["status"] == "write_failed");
      CHECK(row["reason"] == "out/" + file + " could not be written");
      CHECK(row["finished"] == false);
      CHECK(row["steps"] == 1);
    }
}

TEST_CASE("an engine's run whose files may not grow is one that cannot be written, and no crash",
          "[program][engines]") {
  const TemporaryDirectory directory;
  const Result result = run(
      directory.path(),
      {"run", fall, "--engine", "broken", "--variant", "falls", "--duration", "0.5", "--quiet", "--out", "out"}, [] {
        broken_too();
        const rlimit small = {16384, 16384};  // bytes, of each file
        setrlimit(RLIMIT_FSIZE, &small);
      });
  CHECK(result.code == 3);
  CHECK(summary(directory.path() / "out")["status"] == "write_failed");
}

TEST_CASE("an engine does not outlive a run that is killed, whose summary says that it did not finish",
          "[program][engines]") {
  const TemporaryDirectory directory;
  write_odd(directory.path(), "echo $$ > pid.part; mv pid.part pid; exec sleep 1000");
  const fs::path pid = directory.path() / "pid";
  Process process(directory.path(), {"run", fall, "--engine", "odd", "--out", "out", "--quiet"},
                  [&] { setenv("CONTACTBENCH_ENGINES", directory.path().c_str(), 1); });
  REQUIRE(wait_until([&] { return fs::exists(pid); }));
  process.send(SIGKILL);
  CHECK(process.wait().code == -SIGKILL);
  const Json row = summary(directory.path() / "out");
  CHECK(row["status"] == "crash");
  CHECK(row["reason"] == "did not finish: the program was killed, or the machine stopped");
  CHECK(row["finished"] == false);
  CHECK(wait_until([&] { return has_ended(pid); }));
  if (!has_ended(pid)) kill(std::atoi(read_file(pid).c_str()), SIGKILL);
}

TEST_CASE("an engine that hears that it should stop ends its run by itself, and says what it came to",
          "[program][engines]") {
  const TemporaryDirectory directory;
  Process process(directory.path(),
                  {"run", fall, "--engine", "broken", "--variant", "falls", "--step", "1e-7", "--duration", "50",
                   "--record-every", "1000000000", "--out", "out", "--quiet"},
                  broken_too);
  const fs::path rows = directory.path() / "out/trajectory.csv";
  REQUIRE(wait_until([&] { return fs::exists(rows) && lines(read_file(rows)).size() == 2; }));  // it has begun
  process.send(SIGINT);
  CHECK(process.wait().code == 3);
  const Json row = summary(directory.path() / "out");
  CHECK(row["status"] == "interrupted");
  CHECK(row["reason"] == "stopped by a signal");
  CHECK(row["finished"] == false);
  CHECK(row["steps"] >= 1);
  CHECK(row["time"]["write_s"] > 0);  // which is known of an engine that answers alone
}

TEST_CASE("what an engine says on standard output is none of its errors", "[program][engines]") {
  const TemporaryDirectory directory;
  write_odd(directory.path(), "echo no licence >&2; echo good bye; kill -KILL $$");
  CHECK(by_odd(directory.path(), {"run", fall, "--engine", "odd", "--out", "out", "--quiet"}).code == 3);
  const std::string reason = summary(directory.path() / "out")["reason"];
  CHECK(reason.find("no licence") != std::string::npos);
  CHECK(reason.find("good bye") == std::string::npos);
}

TEST_CASE("an engine that does not hear that it should stop was stopped, in a run and in a preflight",
          "[program][engines]") {
  const TemporaryDirectory directory;
  std::ofstream(directory.path() / "contactbench-engine-odd")
      << "#!/bin/sh\nif [ \"$1\" = --describe ]; then\nprintf '%s' '"
      << R"({"variants": [{"name": "a", "knobs": {}}, {"name": "b", "knobs": {}}], "knobs": []})"
      << "' >&3\nelse\ntouch began\nexec sleep 1000\nfi\n";
  fs::permissions(directory.path() / "contactbench-engine-odd", fs::perms::owner_all);
  const auto stopped = [&](const Words& words) {
    fs::remove(directory.path() / "began");
    Process process(directory.path(), words, [&] { setenv("CONTACTBENCH_ENGINES", directory.path().c_str(), 1); });
    REQUIRE(wait_until([&] { return fs::exists(directory.path() / "began"); }));
    process.send(SIGINT);
    Result ended = process.wait();
    CHECK(ended.code == 3);
    return ended;
  };
  stopped({"run", fall, "--engine", "odd", "--out", "out", "--quiet"});
  CHECK(summary(directory.path() / "out")["status"] == "interrupted");
  const Json rows = Json::parse(stopped({"check", "--engine", "odd", "--json"}).out);
  REQUIRE(rows.size() == 1);
  CHECK(rows[0]["fault"] == "interrupted: stopped by a signal");
}

TEST_CASE("an engine's run is printed as JSON or in lines, with its errors, or not at all", "[program][engines]") {
  const TemporaryDirectory directory;
  const Result json = falls(directory.path(), {"--duration", "0.01", "--json"});
  INFO(json.err);
  REQUIRE(json.code == 0);
  CHECK(json.out == read_file(directory.path() / "out/summary.json"));
  const Result quiet = falls(directory.path(), {"--duration", "0.01", "--quiet"});
  CHECK(quiet.code == 0);
  CHECK(quiet.out.empty());
  CHECK(quiet.err.empty());
  write_odd(directory.path(), R"(printf '%s' '{"status": "unsupported", "reason": "why", "contacts_max": 3,)"
                              R"( "errors": [["first", 1.5], ["second", 2.5]]}' >&3)");
  const Result said = by_odd(directory.path(), {"run", fall, "--engine", "odd", "--out", "out"});
  CHECK(said.code == 3);
  CHECK(said.out ==
        "fall: engine odd: unsupported: why\n"
        "  reached     0 of 0.5 s in 0 steps of 0.001 s, at most 3 contacts\n"
        "    first" +
            std::string(29, ' ') + "1.5\n    second" + std::string(28, ' ') + "2.5\n  files       out\n");
}

TEST_CASE("an engine that ends by itself where it finds no more memory has come to its limit", "[program][engines]") {
  if (std::system("python3 -c pass") != 0) return;
  const TemporaryDirectory directory;
  write_odd(directory.path(),
            "exec python3 -c \"\nimport os\nheld = []\ntry:\n  while True: held.append(bytearray(b'x') * (1 << 20))\n"
            "except MemoryError:\n  os._exit(9)\n\"");
  CHECK(by_odd(directory.path(), {"run", fall, "--engine", "odd", "--memory-limit", "100", "--out", "out", "--quiet"})
            .code == 3);
  const Json row = summary(directory.path() / "out");
  CHECK(row["status"] == "memory_limit");
  CHECK(row["reason"] == "died at 100 MB");
}

TEST_CASE("a preflight that dies, that lacks part of a line, or of no engine at all is no success",
          "[program][engines]") {
  const TemporaryDirectory directory;
  const auto check = [&] { return by_odd(directory.path(), {"check", "--engine", "odd"}); };
  write_odd(directory.path(), "kill -KILL $$");
  const Result killed = check();
  CHECK(killed.code == 3);
  CHECK(killed.out.starts_with("odd a, default, h = 0.001 s: crash: signal 9\n"));

  const Json whole = {{"name", "good"}, {"measured", 2.25}, {"expected", 2}, {"allowed", 0.5},
                      {"unit", "m/s"},  {"note", "noted"},  {"passed", true}};
  const auto of_line = [&](const Json& line) {
    write_odd(directory.path(), "printf '%s' '{\"lines\": [" + line.dump() + "]}' >&3");
    return check();
  };
  CHECK(of_line(whole).code == 0);
  Json word = whole;
  word["passed"] = "yes";
  std::vector<Json> odd(1, word);
  for (const auto& part : whole.items()) {
    odd.push_back(whole);
    odd.back().erase(part.key());
  }
  for (const Json& line : odd) {
    const Result result = of_line(line);
    INFO(line.dump() << ": " << result.err);
    CHECK(result.code == 3);
    CHECK(result.out.find(": crash: its preflight has no lines as docs/engines.md says\n") != std::string::npos);
  }

  std::ofstream(directory.path() / "contactbench-engine-odd") << "#!/bin/sh\necho 'no library' >&2\n";
  const Result none = check();
  CHECK(none.code == 3);
  CHECK(none.out.empty());
  CHECK(none.err == "contactbench check: unavailable: contactbench-engine-odd does not say what it is: no library\n");
}

TEST_CASE("a preflight is no success where one of its variants or lines is none, whatever the last one is",
          "[program][engines]") {
  const TemporaryDirectory directory;
  const Json good = {{"name", "good"}, {"measured", 2.25}, {"expected", 2}, {"allowed", 0.5},
                     {"unit", "m/s"},  {"note", "noted"},  {"passed", true}};
  Json bad = good;
  bad["name"] = "bad";
  bad["passed"] = false;
  const auto says = [](const std::vector<Json>& all) {
    return "printf '%s' '" + Json({{"lines", all}}).dump() + "' >&3";
  };
  const std::string last_words = "A line that fails stands beside the engine's rows (docs/engines.md).\n";
  for (const std::string& first : {std::string("exit 5"), says({good, bad, good})}) {
    INFO(first);
    write_odd(directory.path(),
              "case \"$2\" in *'\"variant\":\"a\"'*)\n" + first + "\n;; *)\n" + says({good}) + "\n;; esac",
              R"({"name": "a", "knobs": {}}, {"name": "b", "knobs": {}})");
    const Result in_lines = by_odd(directory.path(), {"check", "--engine", "odd"});
    CHECK(in_lines.code == 3);
    CHECK(in_lines.out.find("\nodd b, default, h = 0.001 s\n  ok ") != std::string::npos);
    CHECK(in_lines.out.ends_with(last_words));
    const Result as_json = by_odd(directory.path(), {"check", "--engine", "odd", "--json"});
    CHECK(as_json.code == 3);
    CHECK(Json::parse(as_json.out).size() == 2);
  }
}

TEST_CASE("an engine that fails far below its limit of memory has not come to it", "[program][engines]") {
  const TemporaryDirectory directory;
  write_odd(directory.path(), "exit 9");
  const Words words = {"run", fall, "--engine", "odd", "--memory-limit", "4000", "--out", "out", "--quiet"};
  CHECK(by_odd(directory.path(), words).code == 3);
  const Json row = summary(directory.path() / "out");
  CHECK(row["status"] == "crash");
  CHECK(row["reason"] == "the engine ended with exit code 9");
}

TEST_CASE("an engine that takes no step leaves no motion of an earlier run in its folder", "[program][engines]") {
  const TemporaryDirectory directory;
  const fs::path out = directory.path() / "out";
  fs::create_directories(out);
  for (const char* earlier : {"trajectory.csv", "steps.csv"}) std::ofstream(out / earlier) << "old";
  write_odd(directory.path(), R"(printf '%s' '{"status": "unsupported", "reason": "why"}' >&3)");
  CHECK(by_odd(directory.path(), {"run", fall, "--engine", "odd", "--out", "out", "--quiet"}).code == 3);
  CHECK(content(out) == Words{"summary.json"});
}

TEST_CASE("an engine's program that is started by hand describes itself, or says how it is started",
          "[program][engines]") {
  const TemporaryDirectory directory;
  const fs::path out = directory.path() / "said", err = directory.path() / "wrong";
  const auto by_hand = [&](const std::string& words) {
    const int status = std::system(("'" BROKEN_ENGINE_FOLDER "/contactbench-engine-broken' " + words + " > '" +
                                    out.string() + "' 2> '" + err.string() + "' 3>&-")
                                       .c_str());
    return WEXITSTATUS(status);
  };
  CHECK(by_hand("--describe") == 0);
  const Json said = Json::parse(read_file(out));
  const Json wanted = {{"name", "broken"},
                       {"summary", "goes wrong on purpose"},
                       {"version", "1"},
                       {"precision", "double"},
                       {"package", "none"},
                       {"documentation", Json::array({"none, either"})},
                       {"shared", Json::array({"gravity"})},
                       {"apart", Json::array({"forces: none", "contacts: none"})}};
  for (const auto& part : wanted.items()) CHECK(said.at(part.key()) == part.value());
  CHECK(said["knobs"] == Json::parse(R"([{"name": "depth", "default": 1, "unit": "m", "meaning": "of nothing"}])"));
  CHECK(said["variants"][0] ==
        Json::parse(R"({"name": "falls", "summary": "falls", "diagonal": 1, "knobs": {"depth": 1}})"));
  CHECK(by_hand("") == 2);
  CHECK(read_file(err).starts_with("The engine broken for contactbench"));
  for (const char* words : {"--run", "--preflight", "--frob {}"}) CHECK(by_hand(words) == 2);
  CHECK(by_hand("--preflight nonsense") == 1);
  CHECK(by_hand("--run nonsense") == 1);
  CHECK(read_file(err).starts_with("broken: "));
}

TEST_CASE("engines of an installed program are those of its libexec that can be started", "[program][engines]") {
  const TemporaryDirectory directory;
  const fs::path installed = directory.path() / "bin/contactbench", folder = directory.path() / "libexec/contactbench";
  fs::create_directories(installed.parent_path());
  fs::create_directories(folder);
  fs::copy_file(PROGRAM, installed);
  write_odd(folder, "exit 1");
  std::ofstream(folder / "contactbench-engine-notes") << "no program\n";
  const fs::path listed = directory.path() / "list.json";
  REQUIRE(std::system(("'" + installed.string() + "' list engines --json > '" + listed.string() + "'").c_str()) == 0);
  std::map<std::string, Json> engines;
  for (const Json& engine : Json::parse(read_file(listed))) engines[engine["name"].get<std::string>()] = engine;
  REQUIRE(engines.contains("odd"));
  CHECK(engines.at("odd")["unavailable"].is_null());
  CHECK(engines.at("odd")["program"].get<std::string>().ends_with("/libexec/contactbench/contactbench-engine-odd"));
  CHECK_FALSE(engines.contains("notes"));
  // Each once, wherever it is found, and in the order of their names.
  for (const char* name : {"mine", "also", "zeta", "beta"})
    fs::copy_file(folder / "contactbench-engine-odd", folder / (std::string("contactbench-engine-") + name));
  REQUIRE(std::system(("CONTACTBENCH_ENGINES='" + folder.string() + "' '" + installed.string() +
                       "' list engines --json > '" + listed.string() + "'")
                          .c_str()) == 0);
  Words names;
  for (const Json& engine : Json::parse(read_file(listed))) names.push_back(engine["name"].get<std::string>());
  REQUIRE(names.size() > 5);
  CHECK(Words(names.end() - 5, names.end()) == Words{"also", "beta", "mine", "odd", "zeta"});
}

#endif
