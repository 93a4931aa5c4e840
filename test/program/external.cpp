// `--method external`: another program answers, and is judged as methods of ours are. The program is toy_solver.cpp,
// which shares no line with ours.

#include <algorithm>
#include <catch2/catch.hpp>
#include <cerrno>

#include "program/program.h"

using namespace program;

namespace {

const std::string data = TEST_DATA;
const std::string toy = TOY_SOLVER;
const std::string law = "coulomb";

std::vector<std::string> external(const std::string& command, std::vector<std::string> before) {
  before.insert(before.end(), {"--method", "external", "--command", command, "--law", law});
  return before;
}

std::vector<std::string> stack(const std::vector<std::string>& more = {}) {
  std::vector<std::string> arguments = {"run",  "stack.xml", "--set", "boxes=2", "--duration",
                                        "0.05", "--out",     "r",     "--quiet"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

/// Does the process whose id the program left in `file` live, or wait for its parent?
bool there(const fs::path& file) {
  const int pid = std::atoi(read_file(file).c_str());
  REQUIRE(pid > 1);
  return kill(pid, 0) == 0 || errno != ESRCH;
}
/// Whoever sees the file can read it.
const std::string note_pid = "echo $$ > pid.part; mv pid.part pid; exec ";

}  // namespace

TEST_CASE("another program answers a stored problem in every way there is to talk to it", "[program][external]") {
  const std::string problem = data + "/problems/gen_free_b4_c8_s1.hdf5";
  std::string first;
  for (const std::string& command : {toy + " binary", toy + " text", toy + " file {text} {answer}",
                                     "test -s {problem} && " + toy + " file {text} {answer}"}) {
    TemporaryDirectory directory;
    INFO(command);
    const Result result =
        run(directory.path(), external(command, {"solve", problem, "--kind", "contact", "--json", "--out", "r.mtx"}));
    INFO(result.err);
    REQUIRE(result.code == 0);
    const Json json = Json::parse(result.out);
    CHECK(json["status"] == "ok");
    CHECK(json["solver_status"] == "ok");
    CHECK(json["law_residual"].get<double>() <= 1e-9);
    CHECK(json["law"] == law);
    CHECK(json["command"] == command);
    // The same doubles by every way, so that none loses a bit.
    const std::string answer = read_file(directory.path() / "r.mtx");
    if (first.empty()) first = answer;
    CHECK(answer == first);
  }
}

TEST_CASE("a program that is started for every problem has nothing to read: what is piped to ours is not its own",
          "[program][external]") {
  TemporaryDirectory directory;
  const std::string piped = (directory.path() / "piped").string();
  std::ofstream(piped) << "for another program";
  const auto piped_in = [&] { dup2(open(piped.c_str(), O_RDONLY), STDIN_FILENO); };
  const Result result = run(directory.path(),
                            external("cat > read; " + toy + " file {text} {answer}",
                                     {"solve", data + "/problems/gen_free_b4_c8_s1.hdf5", "--kind", "contact"}),
                            piped_in);
  INFO(result.err);
  CHECK(result.code == 0);
  CHECK(fs::exists(directory.path() / "read"));
  CHECK(read_file(directory.path() / "read").empty());
}

TEST_CASE("the example of the docs is what is said, byte for byte", "[program][external]") {
  TemporaryDirectory directory;
  std::string to, from;
  for (const std::string& line : lines(read_file(fs::path(SOURCE_ROOT) / "docs/external.md"))) {
    if (line.starts_with("< ")) to += line.substr(2) + '\n';
    if (line.starts_with("> ")) from += line.substr(2) + '\n';
  }
  std::ofstream(directory.path() / "point.dat") << "3\n1\n0\n3\n3\n3 3\n1 0 0 0 1 0 0 0 1\n-2 1 0\n0.5\n";
  std::ofstream(directory.path() / "said") << from;
  const Result result =
      run(directory.path(), external("cat said & cat > heard", {"solve", "point.dat", "--kind", "contact", "--json"}));
  INFO(result.err);
  CHECK(result.code == 0);
  CHECK(read_file(directory.path() / "heard") == to);
  CHECK(Json::parse(result.out)["law_residual"].get<double>() <= 1e-12);
}

TEST_CASE("a whole run by another program has the rows of a run by ours", "[program][external]") {
  TemporaryDirectory directory;
  const Result ours = run(directory.path(), stack({"--method", "coulomb"}));
  REQUIRE(ours.code == 0);
  fs::rename(directory.path() / "r", directory.path() / "ours");
  const Json inside = summary(directory.path() / "ours");
  for (const std::string way : {"binary", "text"}) {
    const Result result = run(directory.path(), external(note_pid + toy + " " + way, stack()));
    INFO(result.err);
    REQUIRE(result.code == 0);
    const Json json = summary(directory.path() / "r");
    CHECK(json["status"] == "ok");
    CHECK(json["events"] == inside["events"]);
    CHECK(json["steps"] == inside["steps"]);
    CHECK(json["residuals"]["max"].get<double>() <= 1e-9);
    CHECK(json["residuals"]["law_max"].get<double>() <= 1e-9);
    CHECK(json["residuals"]["false_claims"] == 0);
    for (const auto& [key, value] : inside.items()) CHECK(json.contains(key));
    CHECK(lines(read_file(directory.path() / "r/steps.csv")).size() ==
          lines(read_file(directory.path() / "ours/steps.csv")).size());
    CHECK_FALSE(there(directory.path() / "pid"));
  }
}

TEST_CASE("an answer in text that goes on after its last number is misread, not cut", "[program][external]") {
  TemporaryDirectory directory;
  const Result result = run(directory.path(), external(note_pid + toy + " text long=20", stack()));
  CHECK(result.code == 3);
  const Json json = summary(directory.path() / "r");
  CHECK(json["status"] == "crash");
  CHECK(json["reason"].get<std::string>().find("is not r and 24 numbers") != std::string::npos);
  CHECK(json["steps"] == 19);
}

TEST_CASE("however another program fails, the run ends typed and keeps what it has", "[program][external]") {
  struct Case {
    std::string fault, status, reason;
  };
  for (const Case& known :
       {Case{"crash=20", "crash", "signal 11"},
        Case{"exit=20", "crash", "gave no answer and ended with exit code 7, at problem 20 that it got"},
        Case{"nan=20", "not_finite", "NaN"}, Case{"short=20", "input_error", "holds 23 impulses"},
        Case{"garbage=20", "crash", "42 is the answer"}, Case{"fail=20", "nonconverged", "it said so"}}) {
    TemporaryDirectory directory;
    INFO(known.fault);
    const Result result = run(directory.path(), external(note_pid + toy + " binary " + known.fault, stack()));
    CHECK(result.code == 3);
    CHECK(lines(result.err).size() == 1);
    const Json json = summary(directory.path() / "r");
    CHECK(json["status"] == known.status);
    CHECK(json["reason"].get<std::string>().find(known.reason) != std::string::npos);
    CHECK(json["steps"] == 19);
    CHECK(lines(read_file(directory.path() / "r/trajectory.csv")).size() == 1 + 2 * 20);
    CHECK_FALSE(there(directory.path() / "pid"));
  }
}

TEST_CASE("a program that does not begin, or talks otherwise, ends the run at its first event", "[program][external]") {
  for (const auto& [command, reason] :
       {std::pair(toy + " binary deaf", "exit code 3"), std::pair(toy + " text silent", "its first line is \"hello\""),
        std::pair(std::string("./no-such-program"), "exit code 127"),
        std::pair(std::string("read greeting; exec 0<&-; echo ready text; exit 5"),
                  "the program stopped reading and ended with exit code 5, at problem 1 that it got"),
        std::pair(toy + " file {text} /dev/null; test {answer}", "wrote no {answer}"),
        std::pair(std::string("echo 1 2 x > {answer}; test {text}"), "{answer}:1"),
        std::pair(std::string("echo 1 2 3 > {answer}; test {text}"), "holds 3 impulses"),
        std::pair(std::string("test {text} {answer}"), "exit code"),
        // An answer does not make up for an exit code, nor for a signal.
        std::pair(toy + " file {text} {answer}; exit 5", "exit code 5"),
        std::pair(toy + " file {text} {answer}; kill -9 $$", "the program was killed by signal 9 (Killed)")}) {
    TemporaryDirectory directory;
    INFO(command);
    const Result result = run(directory.path(), external(command, stack()));
    CHECK(result.code == 3);
    const Json json = summary(directory.path() / "r");
    INFO(json["reason"]);
    CHECK((json["status"] == "crash" || json["status"] == "input_error"));
    CHECK(json["reason"].get<std::string>().find(reason) != std::string::npos);
    CHECK(json["steps"] == 0);
  }
}

TEST_CASE("a program that writes no answer has none, though it wrote one to the event before", "[program][external]") {
  TemporaryDirectory directory;
  const Result result =
      run(directory.path(), external("test -e once && exit 0; touch once; " + toy + " file {text} {answer}", stack()));
  CHECK(result.code == 3);
  const Json json = summary(directory.path() / "r");
  CHECK(json["status"] == "crash");
  CHECK(json["reason"].get<std::string>().find("wrote no {answer}") != std::string::npos);
  CHECK(json["steps"] == 1);
}

TEST_CASE("the limit of time and Ctrl-C are heard while another program is waited for", "[program][external]") {
  for (const std::string& command : {note_pid + toy + " binary hang=5", note_pid + "sleep 1000; : {text} {answer}"}) {
    TemporaryDirectory directory;
    INFO(command);
    const auto start = std::chrono::steady_clock::now();
    const Result result = run(directory.path(), external(command, stack({"--time-limit", "0.5"})));
    CHECK(std::chrono::steady_clock::now() - start < std::chrono::seconds(10));  // else it would be 1000
    CHECK(result.code == 3);
    CHECK(summary(directory.path() / "r")["status"] == "time_limit");
    CHECK_FALSE(there(directory.path() / "pid"));
  }
  TemporaryDirectory directory;
  Process process(directory.path(), external(note_pid + toy + " binary hang=1", stack()));
  REQUIRE(wait_until([&] { return fs::exists(directory.path() / "pid"); }));
  process.send(SIGINT);
  CHECK(process.wait().code == 3);
  CHECK(summary(directory.path() / "r")["status"] == "interrupted");
  CHECK_FALSE(there(directory.path() / "pid"));
}

TEST_CASE("another program does not outlive ours that is killed, nor what it started the program itself",
          "[program][external]") {
  for (const bool killed : {true, false}) {
    TemporaryDirectory directory;
    INFO((killed ? "killed" : "at its own end"));
    const fs::path pid = directory.path() / "pid";
    if (killed) {
      // Its files go with the test's.
      Process process(directory.path(), external(note_pid + "sleep 1000; : {text} {answer}", stack()),
                      [&] { setenv("TMPDIR", directory.path().c_str(), 1); });
      REQUIRE(wait_until([&] { return fs::exists(pid); }));
      process.send(SIGKILL);
      CHECK(process.wait().code == -SIGKILL);
    } else {
      const std::string command = "sleep 1000 & echo $! > pid.part; mv pid.part pid; exec " + toy + " text";
      const Result result = run(directory.path(), external(command, stack()));
      INFO(result.err);
      CHECK(result.code == 0);
    }
    CHECK(wait_until([&] { return has_ended(pid); }));
    if (!has_ended(pid)) kill(std::atoi(read_file(pid).c_str()), SIGKILL);
  }
}

// Whether it fails again by a command takes solves without a limit.
TEST_CASE("a run that is stopped keeps its worst problem, and does not try it again first", "[program][external]") {
  for (const bool stopped : {false, true}) {
    TemporaryDirectory directory;
    std::vector<std::string> arguments = stack();
    if (stopped) {
      std::ranges::replace(arguments, std::string("0.05"), std::string("1e6"));
      arguments.insert(arguments.end(), {"--time-limit", "0.5"});
    }
    const Result result = run(directory.path(), external(toy + " binary wrong=1", arguments));
    INFO(result.err);
    const Json row = summary(directory.path() / "r");
    CHECK(row["status"] == (stopped ? "time_limit" : "inaccurate"));
    if (row["hard_problem"].is_null()) return;  // a build without HDF5
    CHECK(row["hard_problem_command"].is_null() == stopped);
  }
}

TEST_CASE("of several bodies apart the problem that a run keeps is of those with the worst contact alone",
          "[program][external]") {
  TemporaryDirectory directory;
  std::ofstream(directory.path() / "two.xml") << R"(<scenario title="Two boxes">
  <simulation step="1e-3" duration="2e-3"/><reference kind="missing"/><gravity constant="0 -9.8 0"/>
  <bodies><half_space name="floor" point="0 0 0" normal="0 1 0"/>
    <box name="left" size="1 1 1" mass="1" position="-2 0.5 0"/>
    <box name="right" size="1 1 1" mass="1" position="2 0.5 0"/></bodies>
  <contacts><pair a="*" b="floor" mu="0.25"/></contacts></scenario>)";
  REQUIRE(run(directory.path(), external(toy + " binary near", {"run", "two.xml", "--out", "r", "--quiet"})).code == 0);
  const Json json = summary(directory.path() / "r");
  CHECK(json["contacts_max"] == 8);
  if (json["hard_problem"].is_null()) return;  // a build without HDF5
  const Result kept =
      run(directory.path(), {"solve", "r/hard_problem.hdf5", "--kind", "contact", "--method", "coulomb", "--json"});
  REQUIRE(kept.code == 0);
  CHECK(Json::parse(kept.out)["contacts"] == 4);
}

TEST_CASE("a solve takes the answers that its tolerance says, and a claim beyond it is a false one",
          "[program][external]") {
  TemporaryDirectory directory;
  std::ofstream(directory.path() / "point.dat") << "3\n1\n0\n3\n3\n3 3\n1 0 0 0 1 0 0 0 1\n-2 1 0\n0.5\n";
  const auto solved = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words = {"solve", "point.dat", "--kind", "contact", "--json"};
    words.insert(words.end(), more.begin(), more.end());
    const Result result = run(directory.path(), external(toy + " binary near", words));
    INFO(result.err);
    REQUIRE(result.code == 0);
    return Json::parse(result.out);
  };
  const Json loose = solved({"--tolerance", "1e-2"}), strict = solved({});
  CHECK(loose["status"] == "ok");
  CHECK(loose["false_claim"] == false);
  CHECK(strict["status"] == "inaccurate");
  CHECK(strict["solver_status"] == "ok");
  CHECK(strict["false_claim"] == true);
}

TEST_CASE("a program that is talked to hears the end of the run, and has its last word", "[program][external]") {
  TemporaryDirectory directory;
  const Result result = run(directory.path(), external(toy + " binary time", stack()));
  CHECK(result.code == 0);
  CHECK(result.err.ends_with(" 50\n"));  // seconds and problems: one a step
  // Solved several times for the times: after one that is not counted.
  std::ofstream(directory.path() / "point.dat") << "3\n1\n0\n3\n3\n3 3\n1 0 0 0 1 0 0 0 1\n-2 1 0\n0.5\n";
  for (const auto& [repeat, asked] : {std::pair("1", " 1\n"), {"3", " 4\n"}})
    CHECK(run(directory.path(),
              external(toy + " binary time", {"solve", "point.dat", "--kind", "contact", "--json", "--repeat", repeat}))
              .err.ends_with(asked));
}

#if !defined(__SANITIZE_ADDRESS__)  // which is given no limit
TEST_CASE("a limit of memory holds for the other program too", "[program][external]") {
  TemporaryDirectory directory;
  const Result result =
      run(directory.path(), external("ulimit -Sd > limit; exec " + toy + " binary", stack({"--memory-limit", "300"})));
  INFO(result.err);
  CHECK(result.code == 0);
  CHECK(std::atol(read_file(directory.path() / "limit").c_str()) >= 300 * 1024);  // kB; "unlimited" is 0
}
#endif

TEST_CASE("flags of another program are refused in one line", "[program][external]") {
  const auto refuse = [](std::vector<std::string> more, const std::vector<std::string>& parts) {
    more.insert(more.begin(), {"run", "stack.xml", "--method", "external"});
    refused(more, parts);
  };
  refuse({"--law", "newton"}, {"--command is missing"});
  refuse({"--command", "", "--law", "newton"}, {"--command is missing"});
  refuse({"--command", "./mine"}, {"--law is missing", "newton"});
  refuse({"--command", "./mine", "--law", "newto"}, {"--law newto", "newton"});
  refuse({"--command", "./mine {problem}", "--law", "newton"}, {"no {answer}"});
  refuse({"--command", "./mine {answer}", "--law", "newton"}, {"no {problem}"});
  refuse({"--command", "./mine", "--law", "newton", "--k", "8"}, {"--k 8", "no use"});
  refused({"run", "stack.xml", "--method", "newton", "--command", "./mine"}, {"--command", "only external"});
}
