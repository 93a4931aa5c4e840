// What an adapter does with scenes that go further than most: what stands at the origin, a ground that is written down
// last, many bodies, numbers that run away; and what a preflight says where there is no number.

#include <catch2/catch.hpp>
#include <cstdlib>
#include <map>

#include "contact/problem_files.h"
#include "program/engine_rows.h"

#ifdef BROKEN_ENGINE_FOLDER  // where engines are built at all

using namespace program;

namespace {

/// Only the engine that is broken on purpose beside those of the build.
void broken_too() { setenv("CONTACTBENCH_ENGINES", BROKEN_ENGINE_FOLDER, 1); }

void write_scene(const fs::path& directory, const std::string& bodies, const std::string& pairs,
                 const std::string& duration, const std::string& gravity = "0 -9.8 0") {
  std::ofstream(directory / "scene.xml") << "<scenario title=\"engines\"><simulation step=\"1e-3\" duration=\""
                                         << duration << "\"/><reference kind=\"missing\"/><gravity constant=\""
                                         << gravity << "\"/><bodies>" << bodies << "</bodies>"
                                         << (pairs.empty() ? "" : "<contacts>" + pairs + "</contacts>")
                                         << "</scenario>";
}

Result run_scene(const fs::path& directory, const Words& words) {
  return run(directory, joined({"run", "scene.xml", "--out", "out", "--quiet"}, words));
}

/// Where this body of the scene is in the end.
Row last_of(const fs::path& directory, const std::string& body, const Words& words) {
  const Result result = run_scene(directory, words);
  INFO(words[1] << ": " << result.err);
  REQUIRE(result.code == 0);
  Row last;
  for (const auto& [name, row] : named_rows(directory / "out/trajectory.csv"))
    if (name == body) last = row;
  REQUIRE(!last.empty());
  return last;
}

/// What is said of each problem in the folder own.
std::vector<Json> said_of_own(const fs::path& directory) {
  std::vector<Json> all;
  for (const auto& entry : fs::directory_iterator(directory / "own"))
    if (entry.path().extension() == ".json") all.push_back(Json::parse(read_file(entry.path())));
  REQUIRE(!all.empty());
  return all;
}

/// The lines of a preflight by their names; some fail in each here.
std::map<std::string, Json> preflight_of(const fs::path& directory, const Words& words,
                                         const std::function<void()>& in_child = {}) {
  const Result result = run(directory, joined({"check", "--step", "0.01", "--json", "--engine"}, words), in_child);
  INFO(words[0] << ": " << result.err);
  const Json rows = Json::parse(result.out);
  REQUIRE(rows.size() == 1);
  REQUIRE(rows[0]["fault"].is_null());
  std::map<std::string, Json> lines;
  for (const Json& line : rows[0]["lines"]) lines[line["name"].get<std::string>()] = line;
  return lines;
}

}  // namespace

TEST_CASE("what is turned in an engine and stands at the origin is turned there, too", "[program][engines]") {
  // Unturned it would be 0.4 m lower than the ball on it.
  const TemporaryDirectory directory;
  write_scene(directory.path(),
              R"(<box name="wall" fixed="yes" size="0.6 0.2 1" position="0 0 0" axis="1 0 0" angle="${pi/2}"/>
<sphere name="ball" radius="0.2" mass="1" position="0 0.7 0"/>)",
              R"(<pair a="ball" b="wall" mu="0.5"/>)", "0.1");
  for (const auto& [name, engine] : engines_here(directory.path())) {
    if (name == "simbody") continue;  // knows half-spaces alone to be on
    CHECK(last_of(directory.path(), "ball", {"--engine", name}).at("py") == Approx(0.7).margin(0.02));
  }
}

TEST_CASE("with a negative margin Bullet's shapes have their own, and are as large as they are", "[program][engines]") {
  // The can's lowest point is 0.49 m below its centre; with a core that is larger by a metre each way, and a metre
  // taken off all round, it would be a quarter of a metre lower, and in the ground.
  const TemporaryDirectory directory;
  if (!engines_here(directory.path()).contains("bullet")) return;
  write_scene(directory.path(),
              R"(<half_space name="ground" point="0 0 0" normal="0 1 0"/>
<cylinder name="can" radius="0.2" length="0.9" mass="1" position="0 0.6 0" axis="0 0 1" angle="0.3"/>)",
              R"(<pair a="can" b="ground" mu="0.5"/>)", "0.05");
  const Row can = last_of(directory.path(), "can", {"--engine", "bullet", "--knob", "margin=-1"});
  CHECK(can.at("vy") == Approx(-9.8 * 0.05).epsilon(1e-6));
}

TEST_CASE("a ground that is written down after what slides on it is met in an engine, too", "[program][engines]") {
  const TemporaryDirectory directory;
  write_scene(directory.path(),
              R"(<box name="box" size="1 0.2 1" mass="1" position="0 0.1 0" velocity="2 0 0"/>
<half_space name="ground" point="0 0 0" normal="0 1 0"/>)",
              R"(<pair a="box" b="ground" mu="0.2"/>)", "0.1");
  std::vector<Words> ways;
  for (const auto& [name, engine] : engines_here(directory.path())) {
    ways.push_back({"--engine", name});
    if (name == "simbody") ways.push_back({"--engine", name, "--variant", "rigid"});
  }
  for (const Words& way : ways) {
    INFO(way.back());
    const Row box = last_of(directory.path(), "box", way);
    CHECK(box.at("vx") == Approx(2 - 0.2 * 9.8 * 0.1).margin(0.05));
    CHECK(box.at("py") == Approx(0.1).margin(0.02));
  }
}

TEST_CASE("a ball on one that is fixed is unsupported in Simbody, whichever is written down first",
          "[program][engines]") {
  const TemporaryDirectory directory;
  if (!engines_here(directory.path()).contains("simbody")) return;
  const std::string knob = R"(<sphere name="knob" fixed="yes" radius="0.5" position="0 0 0"/>)",
                    ball = R"(<sphere name="ball" radius="0.5" mass="1" position="0 2 0"/>)";
  for (const auto& [bodies, who] : {std::pair(knob + ball, "ball and knob"), {ball + knob, "knob and ball"}}) {
    write_scene(directory.path(), bodies, R"(<pair a="ball" b="knob" mu="0.5"/>)", "0.01");
    const Result result = run_scene(directory.path(), {"--engine", "simbody", "--variant", "rigid"});
    INFO(result.err);
    CHECK(result.code == 3);
    const Json row = summary(directory.path() / "out");
    CHECK(row["status"] == "unsupported");
    CHECK(row["reason"] ==
          std::string("contact of ") + who + ": Simbody knows two spheres, and boxes and spheres on half-spaces");
  }
}

TEST_CASE("numbers that run away in MuJoCo end the run as not finite, of what is free and of joints",
          "[program][engines]") {
  // It begins anew where they do, and would go on from rest.
  const TemporaryDirectory directory;
  if (!engines_here(directory.path()).contains("mujoco")) return;
  for (const std::string bodies :
       {R"(<sphere name="ball" radius="0.5" mass="1" position="0 0 0" velocity="1e11 0 0"/>)",
        R"(<robot name="train"><link name="cart" mass="2" position="0 0 0" inertia="1 1 1"/>
<joint name="rail" kind="prismatic" parent="world" child="cart" axis="1 0 0" velocity="1e11"/></robot>)"}) {
    INFO(bodies);
    write_scene(directory.path(), bodies, "", "0.01", "0 0 0");
    const Result result = run_scene(directory.path(), {"--engine", "mujoco"});
    INFO(result.err);
    CHECK(result.code == 3);
    const Json row = summary(directory.path() / "out");
    CHECK(row["status"] == "not_finite");
    CHECK(row["reason"] == "the engine's state at t = 0.001 s holds no number");
  }
}

TEST_CASE("the momentum that MuJoCo's own impulses give is that of its step where it keeps rows sparse, too",
          "[program][engines]") {
  if (!cb::fclib_available()) return;
  const TemporaryDirectory directory;  // 66 velocities: it does so from 60 on
  if (!engines_here(directory.path()).contains("mujoco")) return;
  const Result result =
      run(directory.path(), {"run", "stack", "--set", "boxes=11", "--engine", "mujoco", "--step", "1e-3", "--duration",
                             "0.02", "--save-problems", "own", "--save-every", "3", "--out", "out", "--quiet"});
  INFO(result.err);
  REQUIRE(result.code == 0);
  for (const Json& about : said_of_own(directory.path())) {
    INFO(about.dump());
    CHECK(about["velocities"] == 66);
    CHECK(about["momentum_error"].get<double>() <= 1e-9);
  }
}

TEST_CASE("DART's own problem is of all groups that it solves in a step, and of no contact that it leaves out",
          "[program][engines]") {
  // The contact of the first two balls, which are in one place, has no normal.
  if (!cb::fclib_available()) return;
  const TemporaryDirectory directory;
  if (!engines_here(directory.path()).contains("dart")) return;
  write_scene(directory.path(),
              R"(<half_space name="ground" point="0 0 0" normal="0 1 0"/>
<sphere name="a" radius="0.5" mass="1" position="0 5 0"/><sphere name="b" radius="0.5" mass="1" position="0 5 0"/>
<sphere name="c" radius="0.5" mass="1" position="5 0.4999 0" velocity="1 -1 0"/>
<sphere name="d" radius="0.5" mass="2" position="9 0.4999 0" velocity="0 -1 1"/>)",
              R"(<pair a="*" b="*" mu="0.5"/>)", "1e-3");
  const Result result = run_scene(directory.path(), {"--engine", "dart", "--save-problems", "own"});
  INFO(result.err);
  REQUIRE(result.code == 0);
  const std::vector<Json> said = said_of_own(directory.path());
  REQUIRE(said.size() == 1);
  INFO(said[0].dump());
  CHECK(said[0]["contacts"] == 2);
  CHECK(said[0]["velocities"] == 24);
  REQUIRE(said[0]["momentum_error"].is_number());
  CHECK(said[0]["momentum_error"].get<double>() <= 1e-8);
}

TEST_CASE("an engine's run that records no step goes to its end all the same", "[program][engines]") {
  const TemporaryDirectory directory;
  const Result result = run(directory.path(),
                            {"run", preflight_scenes + "fall.xml", "--engine", "broken", "--variant", "falls",
                             "--duration", "0.01", "--record-every", "0", "--out", "out", "--quiet"},
                            broken_too);
  INFO(result.err);
  CHECK(result.code == 0);
  const Json row = summary(directory.path() / "out");
  CHECK(row["status"] == "ok");
  CHECK(row["steps"] == 10);
}

TEST_CASE("a preflight allows for the rounding of the engine's precision, and passes nothing that is no number",
          "[program][engines]") {
  // Speeds after 50 steps: a sum of as many terms.
  const TemporaryDirectory directory;
  const auto twice = preflight_of(directory.path(), {"broken", "--variant", "nan"}, broken_too);
  const Json& gravity = twice.at("gravity");
  CHECK(gravity["measured"].is_null());
  CHECK(gravity["passed"] == false);
  CHECK(gravity["allowed"].get<double>() == Approx(9.8 * (50 * 2.3e-16 + 1e-14)));
  CHECK(twice.at("speed kept")["passed"] == true);
  if (!engines_here(directory.path()).contains("bullet-float")) return;
  const auto once = preflight_of(directory.path(), {"bullet-float", "--variant", "si10"});
  CHECK(once.at("gravity")["allowed"].get<double>() == Approx(9.8 * (50 * 1.2e-7 + 1e-14)));
}

TEST_CASE("a preflight says where an engine does not say how many contacts it has", "[program][engines]") {
  const TemporaryDirectory directory;
  const std::string line = "contacts of a box on the ground";
  CHECK(preflight_of(directory.path(), {"broken", "--variant", "falls"}, broken_too).at(line)["note"] == "");
  if (!engines_here(directory.path()).contains("simbody")) return;
  const Json silent = preflight_of(directory.path(), {"simbody", "--variant", "rigid"}).at(line);
  CHECK(silent["measured"] == -1);
  CHECK(silent["passed"] == false);
  CHECK(silent["note"] == "the engine does not say");
}

#endif
