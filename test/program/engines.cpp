// Engines beside the methods: whatever one does is a typed row, and each that is here falls as Newton's law says and
// keeps momentum, so that an adapter's fault is not taken for an engine's.

#include <sys/file.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <tuple>

#include "program/program.h"

#ifdef BROKEN_ENGINE_FOLDER  // where engines are built at all

using namespace program;

namespace {

const std::string scenes = std::string(SOURCE_ROOT) + "/scenarios/preflight/";

/// Only the engine that is broken on purpose beside those of the build.
void broken_too() { setenv("CONTACTBENCH_ENGINES", BROKEN_ENGINE_FOLDER, 1); }

struct Row {
  Result result;
  Json summary;
};
Row fall(const fs::path& directory, const std::string& variant, const std::vector<std::string>& more = {}) {
  std::vector<std::string> words = {
      "run", scenes + "fall.xml", "--engine", "broken", "--variant", variant, "--out", "out", "--quiet"};
  words.insert(words.end(), more.begin(), more.end());
  Row row;
  row.result = run(directory, words, broken_too);
  INFO(variant << ": " << row.result.err);
  row.summary = summary(directory / "out");
  return row;
}

/// A fall by an engine whose program is this shell script.
Result by_odd_engine(const fs::path& directory, const std::string& script) {
  const fs::path program = directory / "contactbench-engine-odd";
  std::ofstream(program) << "#!/bin/sh\n" << script << '\n';
  fs::permissions(program, fs::perms::owner_all);
  return run(directory, {"run", scenes + "fall.xml", "--engine", "odd", "--out", "out", "--quiet"},
             [&] { setenv("CONTACTBENCH_ENGINES", directory.c_str(), 1); });
}

/// The same by one that describes itself rightly, and to the question how the scene goes does this.
Result by_odd_answer(const fs::path& directory, const std::string& script) {
  return by_odd_engine(directory,
                       "if [ \"$1\" = --describe ]; then\n"
                       R"(printf '%s' '{"variants":[{"name":"a","knobs":{}}],"knobs":[]}' >&3)"
                       "\nelse\n" +
                           script + "\nfi");
}

/// Last row of each body in trajectory.csv: t, then 13 numbers.
std::vector<std::vector<double>> last_state(const fs::path& file, std::size_t bodies) {
  const std::vector<std::string> rows = lines(read_file(file));
  REQUIRE(rows.size() > 2 * bodies);
  std::vector<std::vector<double>> out;
  for (std::size_t i = rows.size() - bodies; i < rows.size(); ++i) {
    std::vector<double> numbers;
    const std::vector<std::string> row = cells(rows[i]);
    for (std::size_t c = 2; c < row.size(); ++c) numbers.push_back(std::strtod(row[c].c_str(), nullptr));
    out.push_back(numbers);
  }
  return out;
}

/// Engines that are here, each with its variants.
Json engines_here(const fs::path& directory) {
  const Json all = Json::parse(run(directory, {"list", "engines", "--json"}).out);
  Json here = Json::array();
  for (const Json& engine : all)
    if (engine["unavailable"].is_null()) here.push_back(engine);
  return here;
}

double rounding(const Json& engine) { return engine["precision"] == "single" ? 1.2e-7 : 2.3e-16; }

}  // namespace

TEST_CASE("whatever an engine does is a typed row, with the time it came to", "[program][engines]") {
  TemporaryDirectory directory;
  struct Case {
    const char *variant, *status, *word;
    std::vector<std::string> more = {};
  };
  const std::vector<Case> cases = {
      {"falls", "ok", ""},
      {"aborts", "crash", "on purpose"},
      {"faults", "crash", ""},
      {"leaves", "crash", "no answer"},
      {"throws", "crash", "thrown on purpose"},
      {"nan", "not_finite", "no number"},
      {"refuses", "unsupported", "on purpose"},
      {"hangs", "time_limit", "did not come back", {"--time-limit", "0.3"}},
  };
  for (const Case& of : cases) {
    const Row row = fall(directory.path(), of.variant, of.more);
    INFO(of.variant << ": " << row.result.err);
    CHECK(row.summary["status"] == of.status);
    const bool finished = std::string(of.status) == "ok";
    CHECK(row.summary["finished"] == finished);
    CHECK(row.result.code == (finished ? 0 : 3));
    if (!finished) CHECK(row.summary["reason"].get<std::string>().find(of.word) != std::string::npos);
    CHECK(row.summary["engine"]["name"] == "broken");
    CHECK(row.summary["engine"]["knobs"]["depth"] == 1);
    const double t = row.summary["t_reached"];
    CHECK(t == Approx(finished ? 0.5 : std::string(of.variant) == "refuses" ? 0.0 : 0.049).margin(1e-9));
  }
}

#if !defined(__SANITIZE_ADDRESS__)
TEST_CASE("an engine that eats memory is stopped at its limit", "[program][engines]") {
  TemporaryDirectory directory;
  const Row eats = fall(directory.path(), "eats", {"--memory-limit", "200"});
  CHECK(eats.summary["status"] == "memory_limit");
  CHECK(eats.summary["peak_memory_mb"] < 400);
  CHECK(fall(directory.path(), "falls", {"--memory-limit", "1e14"}).summary["status"] == "ok");  // beyond 64 bits
}
#endif

TEST_CASE("an engine that is not here is unavailable and names its package", "[program][engines]") {
  TemporaryDirectory directory;
  // From elsewhere, the program finds no runners beside it: a link keeps its own place, so a copy is made.
  fs::copy_file(PROGRAM, directory.path() / "alone");
  const std::string command = "cd " + directory.path().string() + " && ./alone run " + scenes +
                              "fall.xml --engine ode --out out --quiet 2> said";
  const int code = std::system(command.c_str());
  CHECK(WEXITSTATUS(code) == 3);
  const Json row = summary(directory.path() / "out");
  CHECK(row["status"] == "unavailable");
  CHECK(row["reason"].get<std::string>().find("libode-dev") != std::string::npos);
}

TEST_CASE("an engine that does not describe itself as it should is unavailable", "[program][engines]") {
  const TemporaryDirectory directory;
  for (const std::string said :
       {R"({"variants":[],"knobs":[]})", R"({"variants":[{"name":5,"knobs":{}}],"knobs":[]})",
        R"({"variants":{"a":1},"knobs":[]})", R"({"variants":[{"name":"a","knobs":{}}],"knobs":[],"version":3})",
        R"({"variants":[{"name":"a","knobs":{}}],"knobs":[],"precision":64})",
        R"({"variants":[{"name":"a","knobs":{}}],"knobs":[],"package":["libodd"]})",
        R"({"variants":[{"name":"a"}],"knobs":[]})", R"({"variants":[{"name":"a","knobs":{"x":"fast"}}],"knobs":[]})",
        R"({"variants":[{"name":"a","knobs":{}}],"knobs":[]}' >&3; exit 3; : ')"}) {
    const Result result = by_odd_engine(directory.path(), "printf '%s' '" + said + "' >&3");
    INFO(said << ": " << result.err);
    CHECK(result.code == 3);
    CHECK(summary(directory.path() / "out")["status"] == "unavailable");
  }
}

TEST_CASE("an engine's run says in lines how long its steps took", "[program][engines]") {
  const TemporaryDirectory directory;
  const Result result = run(
      directory.path(),
      {"run", scenes + "fall.xml", "--engine", "broken", "--variant", "falls", "--duration", "0.02", "--out", "out"},
      broken_too);
  INFO(result.out << result.err);
  REQUIRE(result.code == 0);
  const double spent = summary(directory.path() / "out")["time"]["total_s"];
  const std::size_t at = result.out.find(" s stepping, ");
  REQUIRE(at != std::string::npos);
  CHECK(std::stod(result.out.substr(result.out.find("  time ") + 7)) == Approx(spent).epsilon(1e-2));
  CHECK(std::stod(result.out.substr(at + 13)) == Approx(1e6 * spent / 20).epsilon(1e-2));
}

TEST_CASE("what an engine's program answers is believed where it is an answer, and counted", "[program][engines]") {
  const TemporaryDirectory directory;
  for (const auto& [said, words] : {std::pair(R"({"status":5})", "docs/engines.md"),
                                    {R"({"status":"ok"})", "0 of 500"},
                                    {R"({"status":"ok","reason":null})", "docs/engines.md"},
                                    {R"({"status":"ok","errors":[1]})", "docs/engines.md"},
                                    {R"({"status":"fine","reason":"as it said"})", "as it said"}}) {
    const Result result = by_odd_answer(directory.path(), std::string("printf '%s' '") + said + "' >&3");
    INFO(said << ": " << result.err);
    CHECK(result.code == 3);
    const Json row = summary(directory.path() / "out");
    CHECK(row["status"] == "crash");
    CHECK(row["finished"] == false);
    CHECK(row["reason"].get<std::string>().find(words) != std::string::npos);
  }
}

TEST_CASE("an engine that a signal kills is said to have died of it, one that ends has its exit code",
          "[program][engines]") {
  for (const auto& [last, words] : {std::pair("kill -KILL $$", "died of signal 9"), {"exit 9", "exit code 9"}}) {
    const TemporaryDirectory directory;
    const Result result = by_odd_answer(directory.path(), last);
    INFO(last << ": " << result.err);
    CHECK(result.code == 3);
    const Json row = summary(directory.path() / "out");
    CHECK(row["status"] == "crash");
    CHECK(row["reason"].get<std::string>().find(words) != std::string::npos);
  }
}

TEST_CASE("what an engine's program leaves running is not waited for", "[program][engines]") {
  const TemporaryDirectory directory;
  const auto start = std::chrono::steady_clock::now();
  CHECK(by_odd_engine(directory.path(), "sleep 30 &").code == 3);
  CHECK(std::chrono::steady_clock::now() - start < std::chrono::seconds(15));
}

TEST_CASE("an engine's run leaves no file of an earlier one, and refuses before it does", "[program][engines]") {
  const TemporaryDirectory directory;
  fs::create_directories(directory.path() / "out");
  const std::vector<std::string> all = {"trajectory.npz", "contacts.csv", "shapes.csv",   "hulls.csv",
                                        "joints.csv",     "loads.csv",    "stepping.csv", "hard_problem.hdf5"};
  for (const std::string& earlier : all) std::ofstream(directory.path() / "out" / earlier) << "old";
  CHECK(fall(directory.path(), "falls").result.code == 0);
  for (const std::string& earlier : all) CHECK_FALSE(fs::exists(directory.path() / "out" / earlier));
  const std::string before = read_file(directory.path() / "out/summary.json");
  CHECK(fall(directory.path(), "falls", {"--save-problems", "/proc/nope"}).result.code == 2);
  CHECK(read_file(directory.path() / "out/summary.json") == before);
  {
    const int folder = open((directory.path() / "out").c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);  // as another run
    REQUIRE(flock(folder, LOCK_EX | LOCK_NB) == 0);
    const Result taken =
        run(directory.path(),
            {"run", scenes + "fall.xml", "--engine", "broken", "--variant", "falls", "--out", "out", "--quiet"},
            broken_too);
    CHECK(taken.code == 2);
    CHECK(taken.err.find("--out out: another run is writing into this folder") != std::string::npos);
    CHECK(read_file(directory.path() / "out/summary.json") == before);
    close(folder);
  }
  fs::create_directories(directory.path() / "own");
  std::ofstream(directory.path() / "own/step_000001.hdf5") << "old";
  const std::vector<std::string> nowhere = {
      "run",   scenes + "fall.xml", "--engine", "broken",          "--variant", "falls",
      "--out", "/proc/nope",        "--quiet",  "--save-problems", "own"};
  CHECK(run(directory.path(), nowhere, broken_too).code == 2);
  CHECK(fs::exists(directory.path() / "own/step_000001.hdf5"));
}

TEST_CASE("what is no contact's is no impact (rounding of single precision, a force in flight), many steps may be one",
          "[program][engines]") {
  const TemporaryDirectory directory;
  const Json all = Json::parse(run(directory.path(), {"list", "engines", "--json"}).out);
  std::ofstream(directory.path() / "pushed.xml") << R"(<scenario title="A ball falls and is pushed">
<simulation step="1e-3" duration="0.1"/><reference kind="analytic" name="impacting_sphere"/>
<gravity constant="0 -9.8 0"/><bodies><half_space name="ground" point="0 0 0" normal="0 1 0"/>
<sphere name="ball" radius="1" mass="4" position="0 1.5 0" velocity="1 -10 0"/></bodies>
<contacts><pair a="ball" b="ground" mu="0.6"/></contacts>
<forces><force body="ball" force="4 0 0" from="0" to="0.01"/></forces></scenario>)";
  // MuJoCo takes 0.04 s for the impact, in which it gives an eighth of the speed back.
  for (const auto& [name, scene, duration, off] : {std::tuple("bullet-float", "impacting_sphere", "0.1", 1.0),
                                                   {"ode", "pushed.xml", "0.1", 1.0},
                                                   {"mujoco", "impacting_sphere", "0.15", 2.0}}) {
    const bool here = std::any_of(all.begin(), all.end(), [&, wanted = name](const Json& engine) {
      return engine["name"] == wanted && engine["unavailable"].is_null();
    });
    if (!here) continue;
    const Result result = run(directory.path(), {"run", scene, "--engine", name, "--step", "1e-3", "--duration",
                                                 duration, "--out", "out", "--quiet"});
    INFO(name << ": " << result.err);
    REQUIRE(result.code == 0);
    const Json errors = summary(directory.path() / "out")["errors"];
    // It comes down with 10.5 m/s after 0.05 s.
    CHECK(errors["velocity_after_impact_m_per_s"].get<double>() < off);
    CHECK(errors["energy_rise_linf_j"].get<double>() < 1);  // of 200 J that it comes with, and loses
    if (errors.contains("impact_time_error_s")) CHECK(errors["impact_time_error_s"].get<double>() < 2e-3);
  }
}

TEST_CASE("shapes of one link that a pattern names do not overlap in an engine's run", "[program][engines]") {
  const TemporaryDirectory directory;
  std::ofstream(directory.path() / "hammer.xml") << R"(<scenario title="A link of two shapes falls">
<simulation step="1e-3" duration="0.01"/><reference kind="missing"/><gravity constant="0 -9.8 0"/>
<bodies><robot name="robot">
<link name="hammer" mass="1" position="0 1 0" inertia="1 1 1">
<box name="head" size="1 1 1" position="0 1 0"/><box name="handle" size="0.1 2 0.1" position="0 1 0"/></link>
<joint name="floats" kind="free" parent="world" child="hammer"/></robot></bodies>
<contacts><pair a="*" b="*" mu="0.5"/></contacts></scenario>)";
  const Result result =
      run(directory.path(), {"run", "hammer.xml", "--engine", "broken", "--out", "out", "--quiet"}, broken_too);
  INFO(result.err);
  REQUIRE(result.code == 0);
  CHECK(summary(directory.path() / "out")["max_penetration"] == 0);
}

TEST_CASE("an engine takes the steps of a method where the duration is no multiple of one", "[program][engines]") {
  const TemporaryDirectory directory;
  const std::vector<std::string> times = {"--step", "0.03", "--duration", "0.1"};
  const Row row = fall(directory.path(), "falls", times);
  CHECK(row.result.code == 0);
  CHECK(row.summary["status"] == "ok");
  CHECK(row.summary["steps"] == 4);
  std::vector<std::string> words = {"run", scenes + "fall.xml", "--method", "ap", "--out", "by_method", "--quiet"};
  words.insert(words.end(), times.begin(), times.end());
  REQUIRE(run(directory.path(), words).code == 0);
  CHECK(summary(directory.path() / "by_method")["t_reached"] == row.summary["t_reached"]);
}

TEST_CASE("flags of engines that cannot be meant are refused", "[program][engines]") {
  refused({"run", "stack", "--engine", "od"}, {"--engine od", "did you mean", "ode"});
  refused({"run", "stack", "--engine", "ode", "--k", "8"}, {"--k", "methods"});
  refused({"run", "stack", "--engine", "ode", "--method", "ap"}, {"--method", "leave it"});
  refused({"run", "stack", "--engine", "ode", "--step", "1e-11"}, {"--step 1e-11", "1e+11 steps", "--time-limit"});
  refused({"run", "stack", "--engine", "ode", "--setting", "best"}, {"--setting best", "default or tuned"});
}

TEST_CASE("a free fall in an engine has the speed g t", "[program][engines]") {
  TemporaryDirectory directory;
  for (const Json& engine : engines_here(directory.path()))
    for (const Json& variant : engine["variants"]) {
      const std::string name = engine["name"], of = variant["name"];
      const Result ended = run(directory.path(), {"run", scenes + "fall.xml", "--engine", name, "--variant", of,
                                                  "--step", "1e-3", "--out", "out", "--quiet"});
      INFO(name << " " << of << ": " << ended.err);
      REQUIRE(ended.code == 0);
      const std::vector<double> box = last_state(directory.path() / "out" / "trajectory.csv", 1).front();
      constexpr double g = 9.8, h = 1e-3, n = 500;
      const double eps = rounding(engine);
      CHECK(std::abs(box[8] + n * h * g) <= 4 * n * eps * g);
      // Across, gravity is cos(10 t), as it is at the start of each step; Siconos takes the mean with the step before.
      double across = 0;
      for (int i = 0; i < n; ++i) across += h * std::cos(10 * h * i);
      if (name != "siconos") CHECK(std::abs(box[7] - across) <= 4 * n * eps);
      // Moved with velocities between those at the starts and those at the ends of the steps.
      const double drop = (0.5 - box[1]) / (g * h * h), slack = 1e-6 + 4 * n * n * n * eps;
      CHECK(drop >= n * (n - 1) / 2 - slack);
      CHECK(drop <= n * (n + 1) / 2 + slack);
    }
}

TEST_CASE("bodies that collide in an engine keep their momentum", "[program][engines]") {
  TemporaryDirectory directory;
  for (const Json& engine : engines_here(directory.path()))
    for (const Json& variant : engine["variants"]) {
      const std::string name = engine["name"], of = variant["name"];
      const Result ended = run(directory.path(), {"run", scenes + "collide.xml", "--engine", name, "--variant", of,
                                                  "--out", "out", "--quiet"});
      INFO(name << " " << of << ": " << ended.err);
      REQUIRE(ended.code == 0);
      const auto bodies = last_state(directory.path() / "out" / "trajectory.csv", 2);
      const double mass[2] = {1, 3};  // as in the scene: 1 kg at (2, 0, 0.5) m/s towards 3 kg at rest
      const double before[3] = {2, 0, 0.5};
      double change = 0;
      for (int k = 0; k < 3; ++k)
        change = std::max(change, std::abs(mass[0] * bodies[0][7 + k] + mass[1] * bodies[1][7 + k] - before[k]));
      CHECK(change <= 1e4 * rounding(engine));  // an engine's own solver may stop before the last bits
      CHECK(bodies[1][7] > 0.1);                // they did meet
    }
}

// A box of side 1 and mass m on a ramp of slope s. Of its corners, those downhill carry N = m g (cos s + sin s) / 4
// each (friction m g sin s acts half a side below the centre), those uphill slip with mu m g (cos s - sin s) / 4, so
// that T = m g (sin s - mu (cos s - sin s) / 2) / 2 is left to each downhill. MuJoCo's contact (Computation,
// "Parameters"):
//   R = (1 - d) / (d m); friction's velocity v = R T / b, b = 2 / (d_max timeconst);
//   depth x of R N = k d x, k = 1 / (d_max timeconst)^2; d = d_min + (d_max - d_min) 2 (x / width)^2.
TEST_CASE("a box on a ramp creeps in MuJoCo by what its contacts give way, whatever the step", "[program][engines]") {
  TemporaryDirectory directory;
  for (const Json& engine : engines_here(directory.path())) {
    if (engine["name"] != "mujoco") continue;
    const Json& of = engine["variants"][0]["knobs"];
    const double d_min = of["solimp_min"], d_max = of["solimp_max"], width = of["solimp_width"], time = of["timeconst"];
    const double g = 9.8, mu = 0.7, c = std::cos(M_PI / 6), s = std::sin(M_PI / 6), b = 2 / (d_max * time);
    const double N = g * (c + s) / 4, T = g * (s - mu * (c - s) / 2) / 2, k = 1 / (d_max * d_max * time * time);
    double d = d_min;
    for (int i = 0; i < 20; ++i) {
      const double x = (1 - d) / d * N / (k * d);
      d = d_min + (d_max - d_min) * 2 * (x / width) * (x / width);
    }
    const double rate = (1 - d) / d * T / b;
    for (const std::string h : {"1e-2", "1e-3"}) {
      const Result ended = run(directory.path(), {"run", "sticking_box", "--engine", "mujoco", "--step", h,
                                                  "--duration", "2", "--out", "out", "--quiet"});
      INFO(h << ": " << ended.err);
      REQUIRE(ended.code == 0);
      const double crept = summary(directory.path() / "out")["errors"]["creep_rate_m_per_s"];
      CHECK(crept == Approx(rate).epsilon(1e-3));
    }
  }
}

TEST_CASE("variants of engines have the knobs that published numbers were made with", "[program][engines]") {
  TemporaryDirectory directory;
  const Json wanted = Json::parse(read_file(TEST_DATA "/engine_variants.json"));
  for (const Json& engine : engines_here(directory.path())) {
    const std::string name = engine["name"];
    if (!wanted.contains(name)) continue;
    Json found = Json::object();
    for (const Json& variant : engine["variants"]) found[variant["name"].get<std::string>()] = variant["knobs"];
    INFO(name);
    CHECK(found == wanted[name]);
  }
}

TEST_CASE("contacts of scenes with several laws are as soft in MuJoCo as its knobs say", "[program][engines]") {
  TemporaryDirectory directory;
  const auto sinks = [&](const std::string& mu, const std::string& variant) {
    std::ofstream(directory.path() / "two.xml") << R"(<scenario title="Two balls at rest">
  <simulation step="1e-3" duration="1"/>
  <reference kind="missing"/>
  <gravity constant="0 -9.8 0"/>
  <bodies>
    <half_space name="ground" point="0 0 0" normal="0 1 0"/>
    <sphere name="a" radius="0.5" mass="1" position="0 0.5 0"/>
    <sphere name="b" radius="0.5" mass="1" position="2 0.5 0"/>
  </bodies>
  <contacts><pair a="a" b="ground" mu="0.25"/><pair a="b" b="ground" mu=")"
                                                << mu << R"("/></contacts>
</scenario>)";
    const Result ended = run(directory.path(),
                             {"run", "two.xml", "--engine", "mujoco", "--variant", variant, "--out", "out", "--quiet"});
    INFO(ended.err);
    REQUIRE(ended.code == 0);
    return summary(directory.path() / "out")["max_penetration"].get<double>();
  };
  for (const Json& engine : engines_here(directory.path())) {
    if (engine["name"] != "mujoco") continue;
    for (const std::string variant : {"newton-elliptic", "newton-elliptic-stiff"})
      CHECK(sinks("0.75", variant) == Approx(sinks("0.25", variant)).epsilon(0.01));
    CHECK(sinks("0.75", "newton-elliptic-stiff") < 0.1 * sinks("0.75", "newton-elliptic"));
  }
}

// Joints by anchors and axes, principal inertias, motors: all has to be right for a hand to come to the same place.
// What is left is how each takes the damping of the joints in a step, of first order in h.
TEST_CASE("an arm that touches nothing moves in MuJoCo as in our own dynamics, the better the smaller the step",
          "[program][engines]") {
  TemporaryDirectory directory;
  for (const Json& engine : engines_here(directory.path())) {
    if (engine["name"] != "mujoco") continue;
    std::vector<double> apart;
    for (const std::string h : {"1e-3", "2.5e-4"}) {
      std::vector<std::vector<double>> hand;
      for (const std::vector<std::string>& by : {std::vector<std::string>{"--engine", "mujoco"}, {"--method", "ap"}}) {
        std::vector<std::string> words = {"run", "urdf_arm", "--step", h,        "--duration",
                                          "0.3", "--out",    "out",    "--quiet"};
        words.insert(words.end(), by.begin(), by.end());
        const Result ended = run(directory.path(), words);
        INFO(ended.err);
        REQUIRE(ended.code == 0);
        hand.push_back(last_state(directory.path() / "out" / "trajectory.csv", 5)[3]);
      }
      double distance = 0;
      for (int k = 0; k < 3; ++k) distance = std::hypot(distance, hand[0][k] - hand[1][k]);
      apart.push_back(distance);
      CHECK(std::abs(hand[0][0]) > 0.1);
    }
    CHECK(apart[0] < 1e-6);
    CHECK(apart[1] < apart[0] / 3);
  }
}

#endif
