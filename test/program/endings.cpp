// Runs that do not finish: the files are readable, the summary says what happened, the exit code is 3.

#include <catch2/catch.hpp>
#include <chrono>
#include <sstream>
#include <thread>

#include "program/program.h"

using namespace program;

namespace {

/// A run that would take long, into `out`.
std::vector<std::string> long_run(const std::vector<std::string>& more = {}) {
  std::vector<std::string> arguments = {"run", "sticking_box.xml", "--method", "ap", "--duration", "1e6", "--out", "r"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

/// s: a bound for machines under load; without it these runs take minutes.
constexpr double limit_heard_within = 10;

/// All rows are whole: an interrupted or failed run leaves files that every reader takes.
void readable(std::string_view text, std::size_t columns) {
  REQUIRE_FALSE(text.empty());
  CHECK(text.back() == '\n');
  for (const std::string& line : lines(std::string(text))) REQUIRE(cells(line).size() == columns);
}

/// What a SIGKILL leaves: the system may have stopped in the middle of a write, so the last line may lack its end.
std::string whole_rows(const fs::path& file) {
  const std::string text = read_file(file);
  return text.substr(0, text.rfind('\n') + 1);
}

/// What the kept problem's command in a run's summary makes of it; empty where there is none.
std::string status_by_command(const fs::path& folder, const Json& json) {
  if (json["hard_problem_command"].is_null()) return "";
  std::vector<std::string> again;
  std::istringstream words(json["hard_problem_command"].get<std::string>());
  for (std::string word; words >> word;) again.push_back(word);
  REQUIRE(again.at(0) == "contactbench");
  again.erase(again.begin());
  again.emplace_back("--json");
  return Json::parse(run(folder, again).out)["status"];
}

}  // namespace

TEST_CASE("memory is the program's own, not that of the process it was started in", "[program]") {
  const TemporaryDirectory directory;
  const Result result = run(
      directory.path(),
      {"run", "sticking_box.xml", "--method", "ap", "--duration", "1", "--memory-limit", "250", "--out", "out"}, [] {
        std::vector<char> parents(std::size_t(400) << 20, 'x');
        *static_cast<volatile char*>(&parents.back()) = 'y';
      });
  INFO(result.err);
  CHECK(result.code == 0);
  const Json row = summary(directory.path() / "out");
  CHECK(row["status"] == "ok");
  CHECK(row["peak_memory_mb"] > 1);
  CHECK(row["peak_memory_mb"] < 250);
}

TEST_CASE("an interrupted run ends after its step with every file whole", "[program]") {
  for (const auto& [signal, called] :
       {std::pair(SIGINT, "2 (Interrupt)"), {SIGTERM, "15 (Terminated)"}, {SIGHUP, "1 (Hangup)"}}) {
    TemporaryDirectory directory;
    const fs::path out = directory.path() / "r";
    Process process(directory.path(), long_run({"--record-every", "10"}), [] { ::signal(SIGHUP, SIG_DFL); });
    // The header is there at once; a second's flush brings rows.
    REQUIRE(wait_until([&] { return fs::exists(out / "steps.csv") && fs::file_size(out / "steps.csv") > 1000; }));
    process.send(signal);
    const Result result = process.wait();
    INFO(result.err);
    CHECK(result.code == 3);
    CHECK(result.err.find("interrupted") != std::string::npos);
    const Json json = summary(out);
    CHECK(json["status"] == "interrupted");
    CHECK(json["finished"] == false);
    CHECK(json["reason"] == std::string("stopped by signal ") + called);
    const long steps = json["steps"].get<long>();
    CHECK(steps > 0);
    CHECK(json["t_reached"].get<double>() == Approx(1e-3 * static_cast<double>(steps)));
    CHECK_FALSE(json["errors"].empty());
    readable(read_file(out / "trajectory.csv"), 15);
    readable(read_file(out / "steps.csv"), 21);
    CHECK(lines(read_file(out / "steps.csv")).size() == static_cast<std::size_t>(1 + steps / 10));
  }
}

TEST_CASE("a run that was started not to hear of a terminal that goes, as by nohup, goes on", "[program]") {
  TemporaryDirectory directory;
  Process process(directory.path(), long_run({"--record-every", "0"}), [] { signal(SIGHUP, SIG_IGN); });
  REQUIRE(wait_until([&] { return fs::exists(directory.path() / "r/summary.json"); }));  // it hears from here on
  process.send(SIGHUP);
  std::this_thread::sleep_for(std::chrono::milliseconds(100));  // of two that wait the second would be heard first
  process.send(SIGINT);
  CHECK(process.wait().code == 3);
  CHECK(summary(directory.path() / "r")["reason"] == "stopped by signal 2 (Interrupt)");
}

TEST_CASE("a killed run leaves whole rows and a summary that says so", "[program]") {
  TemporaryDirectory directory;
  const fs::path out = directory.path() / "r";
  Process process(directory.path(), long_run());
  REQUIRE(wait_until([&] { return fs::exists(out / "steps.csv") && fs::file_size(out / "steps.csv") > 1000; }));
  process.send(SIGKILL);
  CHECK(process.wait().code == -SIGKILL);
  const Json json = summary(out);
  CHECK(json["status"] == "crash");
  CHECK(json["finished"] == false);
  CHECK(json["reason"].get<std::string>().find("did not finish") != std::string::npos);
  readable(whole_rows(out / "trajectory.csv"), 15);
  readable(whole_rows(out / "steps.csv"), 21);
}

TEST_CASE("a time limit keeps what there is", "[program]") {
  TemporaryDirectory directory;
  const Result result = run(directory.path(), long_run({"--time-limit", "0.2"}));
  INFO(result.err);
  CHECK(result.code == 3);
  CHECK(result.err.find("time_limit") != std::string::npos);
  const Json json = summary(directory.path() / "r");
  CHECK(json["status"] == "time_limit");
  CHECK(json["finished"] == false);
  CHECK(json["steps"].get<long>() > 0);
  CHECK(json["time"]["wall_s"].get<double>() < 5);
  CHECK(json["time"]["wall_s"].get<double>() > 0.15);
  readable(read_file(directory.path() / "r" / "steps.csv"), 21);
}

TEST_CASE("a time limit counts whole seconds too, and one that no clock tells from none is still one", "[program]") {
  TemporaryDirectory directory;
  CHECK(run(directory.path(), long_run({"--time-limit", "1.05", "--record-every", "0"})).code == 3);
  const Json json = summary(directory.path() / "r");
  CHECK(json["status"] == "time_limit");
  CHECK(json["reason"].get<std::string>().find("1.05 s") != std::string::npos);
  CHECK(json["time"]["wall_s"].get<double>() > 1);
  CHECK(json["time"]["wall_s"].get<double>() < limit_heard_within);
  const Result at_once = run(directory.path(), {"run", "sticking_box.xml", "--method", "ap", "--duration", "20",
                                                "--out", "s", "--record-every", "0", "--time-limit", "1e-9"});
  CHECK(at_once.code == 3);
  CHECK(summary(directory.path() / "s")["status"] == "time_limit");
  const Result never = run(directory.path(), {"run", "sticking_box.xml", "--method", "ap", "--duration", "0.01",
                                              "--out", "n", "--time-limit", "1e300"});
  CHECK(never.code == 0);
}

TEST_CASE("a time limit and a signal are heard within an event", "[program]") {
  // The first event of this stack takes Mirtich's method millions of micro-impacts: many minutes.
  const std::vector<std::string> endless = {"run",     "stack.xml", "--method", "mirtich", "--set",  "boxes=200",
                                            "--prune", "off",       "--out",    "r",       "--quiet"};
  {
    TemporaryDirectory directory;
    std::vector<std::string> limited = endless;
    limited.insert(limited.end(), {"--time-limit", "0.5"});
    CHECK(run(directory.path(), limited).code == 3);
    const Json json = summary(directory.path() / "r");
    CHECK(json["status"] == "time_limit");
    CHECK(json["t_reached"] == 0.0);
    CHECK(json["steps"] == 0);
    CHECK(json["time"]["wall_s"].get<double>() < limit_heard_within);
  }
  for (const int signal : {SIGINT, SIGTERM}) {
    TemporaryDirectory directory;
    Process process(directory.path(), endless);
    REQUIRE(wait_until([&] { return fs::exists(directory.path() / "r" / "steps.csv"); }));
    std::this_thread::sleep_for(std::chrono::milliseconds(300));  // into the event
    const auto sent = std::chrono::steady_clock::now();
    process.send(signal);
    CHECK(process.wait().code == 3);
    CHECK(std::chrono::steady_clock::now() - sent < std::chrono::duration<double>(limit_heard_within));
    const Json json = summary(directory.path() / "r");
    CHECK(json["status"] == "interrupted");
    CHECK(json["steps"] == 0);
    readable(read_file(directory.path() / "r" / "trajectory.csv"), 15);
  }
}

TEST_CASE("a time limit is heard within a step that advances without end", "[program]") {
  for (const char* scene : {"hang_r89.xml", "hang_spin_1e8.xml"})
    for (const char* method : {"newton", "mirtich", "ap", "convex"}) {
      INFO(scene << " by " << method);
      TemporaryDirectory directory;
      const fs::path path = fs::path(TEST_DATA) / "scenes" / scene;
      const Result result = run(
          directory.path(), {"run", path.string(), "--method", method, "--time-limit", "0.5", "--out", "r", "--quiet"});
      const Json json = summary(directory.path() / "r");
      INFO(result.err);
      CHECK(json["status"] != "crash");  // which is what a summary says until the run ends by itself
      CHECK(json["t_reached"].is_number());
      CHECK(json["time"]["wall_s"].get<double>() < limit_heard_within);
    }
}

TEST_CASE("a stored problem is given up at its time limit, whatever its kind", "[program]") {
  TemporaryDirectory directory;
  // A chain of springs: Gauss-Seidel needs of the order of n^2 sweeps of n^2 operations.
  constexpr int n = 1500;
  std::ofstream M(directory.path() / "M.mtx"), q(directory.path() / "q.mtx");
  M << "%%MatrixMarket matrix coordinate real general\n" << n << ' ' << n << ' ' << 3 * n - 2 << '\n';
  q << "%%MatrixMarket matrix array real general\n" << n << " 1\n";
  for (int i = 1; i <= n; ++i) {
    M << i << ' ' << i << " 2\n";
    if (i < n) M << i << ' ' << i + 1 << " -1\n" << i + 1 << ' ' << i << " -1\n";
    q << "-1\n";
  }
  M.close();
  q.close();
  const auto given_up = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--time-limit", "0.5", "--json"});
    const auto start = std::chrono::steady_clock::now();
    const Result result = run(directory.path(), arguments);
    INFO(result.err);
    CHECK(std::chrono::steady_clock::now() - start < std::chrono::duration<double>(limit_heard_within));
    CHECK(result.code == 3);
    const Json json = Json::parse(result.out);
    CHECK(json["status"] == "time_limit");
    CHECK(json["residual"].is_null());
    CHECK(json["false_claim"] == false);
  };
  given_up({"solve", "--kind", "lcp", "--matrix", "M.mtx", "--vector", "q.mtx", "--solver", "pgs"});

  const Result stored = run(directory.path(), {"run", "stack.xml", "--method", "ap", "--set", "boxes=200", "--duration",
                                               "1e-3", "--save-problems", "p", "--out", "r", "--quiet"});
  if (stored.code == 2) return;  // a build without HDF5
  given_up({"solve", "p/event_000000001.hdf5", "--kind", "contact", "--method", "mirtich"});
}

TEST_CASE("the contact problem that ended a run is kept for solve, and not beyond the next run", "[program]") {
  TemporaryDirectory directory;
  const fs::path out = directory.path() / "r";
  // A driven joint pushes a body into a wall: no velocity is feasible, with any method.
  const std::vector<std::string> failing = {"run",          SOURCE_ROOT "/scenarios/stress/driven_ram.xml",
                                            "--method",     "convex",
                                            "--warm-start", "on",
                                            "--out",        "r",
                                            "--quiet"};
  const Result result = run(directory.path(), failing);
  INFO(result.err);
  REQUIRE(result.code == 3);
  const Json json = summary(out);
  if (json["hard_problem"].is_null()) {
    CHECK(result.err.find("HDF5") != std::string::npos);  // a build without it says so
    return;
  }
  const std::string file = (out / json["hard_problem"].get<std::string>()).string();
  const Result solved = run(directory.path(), {"solve", file, "--kind", "contact", "--method", "convex", "--json"});
  CHECK(solved.code == 3);
  CHECK(Json::parse(solved.out)["status"] == json["status"]);
  CHECK(status_by_command(directory.path(), json) == json["status"]);

  std::vector<std::string> good = failing;  // it ends before the wall
  good.insert(good.end(), {"--duration", "0.1"});
  CHECK(run(directory.path(), good).code == 0);
  CHECK(summary(out)["hard_problem"].is_null());
  CHECK_FALSE(fs::exists(file));
}

TEST_CASE("the kept problem of a run with --prune off fails again by its command", "[program]") {
  // Without friction pgs finds no answer; with its unknowns it would refuse a row without a diagonal.
  TemporaryDirectory directory;
  const Result result =
      run(directory.path(), {"run", SOURCE_ROOT "/scenarios/stress/driven_ram.xml", "--set", "mu=0", "--method", "ap",
                             "--solver", "pgs", "--prune", "off", "--out", "r", "--quiet"});
  INFO(result.err);
  REQUIRE(result.code == 3);
  const Json json = summary(directory.path() / "r");
  CHECK(json["status"] == "nonconverged");
  if (json["hard_problem"].is_null()) return;  // a build without HDF5
  CHECK(status_by_command(directory.path(), json) == json["status"]);
}

TEST_CASE("a run that stalls keeps no contact problem: none failed", "[program]") {
  TemporaryDirectory directory;
  const Result result = run(directory.path(), {"run", SOURCE_ROOT "/test/data/scenes/hang_spin_1e8.xml", "--method",
                                               "ap", "--out", "r", "--quiet"});
  INFO(result.err);
  CHECK(result.code == 3);
  const Json json = summary(directory.path() / "r");
  CHECK(json["status"] == "event_stall");
  CHECK(json["hard_problem"].is_null());
  CHECK_FALSE(fs::exists(directory.path() / "r" / "hard_problem.hdf5"));
}

TEST_CASE("a memory limit ends the run with its name", "[program]") {
  // One megabyte is less than the program by itself needs.
  TemporaryDirectory directory;
  const Result result = run(directory.path(), long_run({"--memory-limit", "1"}));
  INFO(result.err);
  CHECK(result.code == 3);
  const Json json = summary(directory.path() / "r");
  CHECK(json["status"] == "memory_limit");
  CHECK(json["reason"] == "the memory limit of 1 MB was reached");
  CHECK(json["finished"] == false);
}

TEST_CASE("a memory limit beyond all bytes is none", "[program]") {
  TemporaryDirectory directory;  // 1e14 MB, which 64 bits do not hold; the scene needs memory once it runs
  const Result result = run(directory.path(), {"run", "pile.xml", "--method", "newton", "--set", "bodies=1000",
                                               "--duration", "0.002", "--memory-limit", "1e14", "--quiet"});
  INFO(result.err);
  CHECK(result.code == 0);
}

TEST_CASE("after a run with a limit the memory is what it was before, however small the stack", "[program]") {
  TemporaryDirectory directory;
  const Result result = run(directory.path(),
                            {"run", "sticking_box.xml", "--method", "ap", "--duration", "30", "--memory-limit", "1000",
                             "--format", "npz", "--quiet", "--out", "r"},
                            [] {
                              rlimit limit{1 << 20, RLIM_INFINITY};
                              getrlimit(RLIMIT_STACK, &limit);
                              limit.rlim_cur = 1 << 20;
                              setrlimit(RLIMIT_STACK, &limit);
                            });
  INFO(result.err);
  CHECK(result.code == 0);
  const Json json = summary(directory.path() / "r");
  CHECK(json["status"] == "ok");
  // Nor is the time that it took another by the looks at its memory.
  CHECK(json["time"]["wall_s"].get<double>() >= json["time"]["total_s"].get<double>());
}

TEST_CASE("a disk that fills up ends the run with whole files and a summary", "[program]") {
  // No file may grow beyond 64 kB: the summary has its place by then, the rows run into it.
  TemporaryDirectory directory;
  const Result result = run(directory.path(), long_run(), [] {
    rlimit limit{65536, 65536};
    setrlimit(RLIMIT_FSIZE, &limit);
  });
  INFO(result.err);
  CHECK(result.code == 3);
  CHECK(result.err.find("write_failed") != std::string::npos);
  const fs::path out = directory.path() / "r";
  const Json json = summary(out);
  CHECK(json["status"] == "write_failed");
  CHECK(json["finished"] == false);
  CHECK(json["reason"].get<std::string>().find(".csv") != std::string::npos);
  readable(read_file(out / "trajectory.csv"), 15);
  readable(read_file(out / "steps.csv"), 21);
  CHECK(fs::file_size(out / "trajectory.csv") <= 65536);
}

TEST_CASE("a full disk is found out by a run that finishes within one buffer", "[program]") {
  TemporaryDirectory directory;
  fs::create_directory(directory.path() / "r");
  fs::create_symlink("/dev/full", directory.path() / "r" / "steps.csv");
  const Result result =
      run(directory.path(), {"run", "sticking_box.xml", "--method", "ap", "--duration", "0.01", "--out", "r"});
  INFO(result.err);
  CHECK(result.code == 3);
  const Json json = summary(directory.path() / "r");
  CHECK(json["status"] == "write_failed");
  CHECK(json["reason"].get<std::string>().find("steps.csv") != std::string::npos);
}

TEST_CASE("a summary that finds no room goes to standard error", "[program]") {
  TemporaryDirectory directory;
  fs::create_directory(directory.path() / "r");
  fs::create_symlink("/dev/full", directory.path() / "r" / "summary.json");
  const Result result =
      run(directory.path(), {"run", "sticking_box.xml", "--method", "ap", "--duration", "0.01", "--out", "r"});
  CHECK(result.code == 3);
  const std::size_t end = result.err.rfind('}');
  REQUIRE(end != std::string::npos);
  const Json json = Json::parse(result.err.substr(0, end + 1));
  CHECK(json["status"] == "write_failed");
  CHECK(json["scenario"] == "sticking_box");
}

TEST_CASE("a listing that nobody can read is no success", "[program]") {
  TemporaryDirectory directory;
  const Result result = run(directory.path(), {"list"}, [] { dup2(open("/dev/full", O_WRONLY), STDOUT_FILENO); });
  CHECK(result.code == 3);
  CHECK(result.err.find("standard output") != std::string::npos);
}

TEST_CASE("a reader who has seen enough of a listing makes no failure of it", "[program]") {
  // Standard output is a pipe that nobody reads any more, as with `contactbench list | head -1`.
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"list"}, {"list", "--json"}, {"--help"}, {"check", "stack.xml"}}) {
    TemporaryDirectory directory;
    const Result result = run(directory.path(), command, [] {
      int ends[2];
      if (pipe(ends) != 0) _exit(97);
      close(ends[0]);
      dup2(ends[1], STDOUT_FILENO);
      close(ends[1]);
    });
    INFO(command.front());
    CHECK(result.code == 0);
    CHECK(result.err.empty());
  }
}

TEST_CASE("a check takes its steps with the joint forces that the scene names, as a run does", "[program]") {
  const TemporaryDirectory directory;
  std::string scene = read_file(SOURCE_ROOT "/scenarios/stress/stiff_joints.xml");
  const std::vector<std::string> check = {"check", "stiff.xml", "--set", "stiffness=1e8", "--method", "convex"};
  std::ofstream(directory.path() / "stiff.xml") << scene;
  CHECK(run(directory.path(), check).out.find("energy_blowup") != std::string::npos);
  scene.replace(scene.find("duration="), 0, "joint_forces=\"implicit\" ");
  std::ofstream(directory.path() / "stiff.xml") << scene;
  const Result implicit = run(directory.path(), check);
  INFO(implicit.err);
  CHECK(implicit.code == 0);
  CHECK(implicit.out.find("100 steps\n") != std::string::npos);
  // Nor does it warn of the step that the other forces would need, of 1.2e-4 s.
  CHECK(implicit.out.find("the implicit step of the robots' torques is stable up to h = ") != std::string::npos);
  CHECK(implicit.out.find("at the scene's own it is not") == std::string::npos);
  const Json json = Json::parse(run(directory.path(), {"check", "stiff.xml", "--set", "stiffness=1e8", "--json"}).out);
  CHECK(json["joint_forces"] == "implicit");
  CHECK(json["largest_stable_step_s"] > 1e-3);
}

TEST_CASE("check says of a scene that no method can begin with what run says of it", "[program]") {
  TemporaryDirectory directory;
  const auto scene = [&](const char* name, const std::string& bodies, const char* pairs) {
    std::ofstream(directory.path() / name)
        << "<scenario title=\"a fault at the start\"><simulation step=\"1e-3\" duration=\"0.1\"/><reference "
           "kind=\"missing\"/><gravity constant=\"0 -9.81 0\"/><bodies>"
        << bodies << "</bodies><contacts>" << pairs << "</contacts></scenario>";
  };
  const std::string ground = "<half_space name=\"ground\" point=\"0 0 0\" normal=\"0 1 0\"/>";
  scene("sunk.xml", ground + "<box name=\"box\" size=\"1 1 1\" mass=\"1\" position=\"0 0.2 0\"/>",
        "<pair a=\"box\" b=\"ground\" mu=\"0.5\"/>");
  scene("sound.xml", ground + "<box name=\"box\" size=\"1 1 1\" mass=\"1\" position=\"0 0.5 0\"/>",
        "<pair a=\"box\" b=\"ground\" mu=\"0.5\"/>");
  const Result sunk = run(directory.path(), {"check", "sunk.xml"});
  CHECK(sunk.code == 3);
  CHECK(sunk.err.find("penetration") != std::string::npos);
  CHECK(lines(sunk.err).size() == 1);
  for (const char* method : {"newton", "mirtich", "ap", "convex"}) {
    INFO(method);
    CHECK(run(directory.path(), {"check", "sunk.xml", "--method", method}).code == 3);
    CHECK(run(directory.path(), {"run", "sunk.xml", "--method", method, "--out", "r"}).code == 3);
    CHECK(summary(directory.path() / "r")["status"] == "penetration");
  }
  CHECK(run(directory.path(), {"check", "sound.xml"}).code == 0);
}

TEST_CASE("check names the files that a scene reads, a robot's too", "[program]") {
  TemporaryDirectory directory;
  const Result plain = run(directory.path(), {"check", "stack.xml", "--files"});
  CHECK(plain.code == 0);
  REQUIRE(lines(plain.out).size() == 1);
  CHECK(fs::path(lines(plain.out)[0]).filename() == "stack.xml");
  const Result arm = run(directory.path(), {"check", "urdf_arm.xml", "--files"});
  if (arm.err.find("built without liburdfdom") != std::string::npos) return;
  REQUIRE(lines(arm.out).size() == 2);
  CHECK(fs::path(lines(arm.out)[1]).extension() == ".urdf");
  for (const std::string& file : lines(arm.out)) CHECK(fs::is_regular_file(file));
}

TEST_CASE("of two runs into one folder at a time the second is refused, and one after the other replaces all files",
          "[program]") {
  TemporaryDirectory directory;
  const fs::path out = directory.path() / "r";
  const std::vector<std::string> grasp = {"run", "grasp.xml", "--method", "ap", "--duration", "0.01", "--out", "r"};
  REQUIRE(run(directory.path(), grasp).code == 0);
  REQUIRE(fs::exists(out / "joints.csv"));
  {
    Process first(directory.path(), long_run());
    // The first has the folder once the grasp's files are gone from it.
    REQUIRE(wait_until([&] { return !fs::exists(out / "joints.csv") && fs::file_size(out / "steps.csv") > 1000; }));
    TemporaryDirectory elsewhere;
    std::vector<std::string> second = long_run();
    second.back() = out.string();
    second.insert(second.end(), {"--time-limit", "20"});
    const Result refused = run(elsewhere.path(), second);
    CHECK(refused.code == 2);
    CHECK(refused.err.find("another run is writing") != std::string::npos);
    CHECK(refused.err.find("--out") != std::string::npos);
    first.send(SIGINT);
    CHECK(first.wait().code == 3);
  }
  CHECK_FALSE(fs::exists(out / "joints.csv"));  // nor is anything left of the grasp
  CHECK(summary(out)["scenario"] == "sticking_box");
  readable(read_file(out / "steps.csv"), 21);
  CHECK(lines(read_file(out / "steps.csv")).size() == summary(out)["steps"].get<std::size_t>() + 1);
}

TEST_CASE("a folder of stored problems holds those of one run", "[program]") {
  TemporaryDirectory directory;
  const auto store = [&](const char* duration) {
    return run(directory.path(), {"run", "sticking_box.xml", "--method", "ap", "--duration", duration,
                                  "--save-problems", "p", "--out", "p", "--quiet"});
  };
  const Result first = store("0.02");
  if (first.code == 2) {
    CHECK(first.err.find("HDF5") != std::string::npos);  // a build without it says so
    return;
  }
  REQUIRE(first.code == 0);
  CHECK(fs::exists(directory.path() / "p" / "event_000000020.hdf5"));
  CHECK(store("0.01").code == 0);
  CHECK(fs::exists(directory.path() / "p" / "event_000000010.hdf5"));
  CHECK_FALSE(fs::exists(directory.path() / "p" / "event_000000020.hdf5"));

  // Nor those of an engine's run; what no run names so is somebody's.
  const std::vector<std::string> stored = {"step_000000001.hdf5", "step_000000001.json"},
                                 others = {"step_response.csv",   "step_1.hdf5",     "event_000000001.json",
                                           "event_.hdf5",         "event_mine.hdf5", "event_00000000x.hdf5",
                                           "event_-00000001.hdf5"};
  for (const auto* files : {&stored, &others})
    for (const std::string& file : *files) std::ofstream(directory.path() / "p" / file) << "old";
  CHECK(store("0.01").code == 0);
  for (const std::string& file : stored) CHECK_FALSE(fs::exists(directory.path() / "p" / file));
  for (const std::string& file : others) CHECK(fs::exists(directory.path() / "p" / file));
}

TEST_CASE("a run that is refused its folder leaves the problems that another one stored", "[program]") {
  TemporaryDirectory directory;
  const auto store = [&](const char* out) {
    return run(directory.path(), {"run", "sticking_box.xml", "--method", "ap", "--duration", "0.01", "--save-problems",
                                  "p", "--out", out, "--quiet"});
  };
  const Result first = store("r");
  if (first.code == 2) {
    CHECK(first.err.find("HDF5") != std::string::npos);  // a build without it says so
    return;
  }
  REQUIRE(first.code == 0);
  const std::vector<std::string> stored = content(directory.path() / "p");
  REQUIRE(stored.size() == 10);
  CHECK(store("/proc/nope").code == 2);
  CHECK(content(directory.path() / "p").size() == stored.size());
}

TEST_CASE("a solver that is not installed ends the run as unavailable", "[program]") {
  TemporaryDirectory directory;
  const Result listed = run(directory.path(), {"list", "solvers", "--json"});
  REQUIRE(listed.code == 0);
  for (const Json& row : Json::parse(listed.out)) {
    if (row["unavailable"].is_null() || row["method"].is_null()) continue;
    const Result result =
        run(directory.path(), {"run", "sticking_box.xml", "--method", row["method"].get<std::string>(), "--solver",
                               row["name"].get<std::string>(), "--duration", "0.01", "--out", "r"});
    CHECK(result.code == 3);
    const Json json = summary(directory.path() / "r");
    CHECK(json["status"] == "unavailable");
    CHECK(json["reason"] == row["unavailable"]);
    CHECK(json["steps"] == 0);
    readable(read_file(directory.path() / "r" / "trajectory.csv"), 15);
  }
}

// No impulse holds what a stop drives: its way into the ground is an overlap, and no contact that is asked for an
// answer.
TEST_CASE("what is driven into the ground ends the run as an overlap, by every method", "[program]") {
  const TemporaryDirectory directory;
  std::ofstream(directory.path() / "ram.xml") << R"(<scenario title="ram"><simulation step="1e-3" duration="0.2"/>
<reference kind="missing"/><gravity constant="0 -9.8 0"/><bodies><half_space name="ground" point="0 0 0" normal="0 1 0"/>
<robot name="ram" position="0 0 0"><link name="head" mass="1" position="0 0.501 0" inertia="1 1 1">
<box name="block" size="1 1 1" position="0 0.501 0"/></link><joint name="slide" kind="prismatic" parent="world"
child="head" axis="0 1 0" lower="0" upper="0" limit_rate="-0.1" velocity="-0.1"/></robot></bodies>
<contacts><pair a="*" b="*" mu="0.3"/></contacts></scenario>)";
  for (const char* method : {"newton", "mirtich", "ap", "convex", "soft", "coulomb"}) {
    INFO(method);
    CHECK(run(directory.path(), {"run", "ram.xml", "--method", method, "--out", "r", "--quiet"}).code == 3);
    const Json row = summary(directory.path() / "r");
    CHECK(row["status"] == "penetration");
    CHECK(row["reason"] == "ground and block interpenetrate by 0.0001 m at t = 0.011 s");
  }
  // So says a check that tries a method, where nothing is wrong at the start.
  const Result checked = run(directory.path(), {"check", "ram.xml", "--method", "ap", "--json"});
  CHECK(checked.code == 3);
  const Json told = Json::parse(checked.out);
  CHECK(told["fault"] == "penetration: ground and block interpenetrate by 0.0001 m at t = 0.011 s");
  CHECK(told["trial"]["failed"] == told["fault"]);
  CHECK(told["trial"]["steps"] == 10);
}
