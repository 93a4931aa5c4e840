// A scene in an engine is the scene: what flies, turns, is pushed and coasts there, with which laws; what the rows of
// its run say; and what a preflight measures of an engine of which all is known.

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <map>

#include "program/engine_rows.h"

#ifdef BROKEN_ENGINE_FOLDER  // where engines are built at all

using namespace program;

namespace {

/// Only the engine that is broken on purpose beside those of the build.
void broken_too() { setenv("CONTACTBENCH_ENGINES", BROKEN_ENGINE_FOLDER, 1); }

/// A run by its variant that is right: it knows gravity, and nothing that touches.
Result falls(const fs::path& directory, const Words& words) {
  return run(directory, joined(words, {"--engine", "broken", "--variant", "falls", "--out", "out", "--quiet"}),
             broken_too);
}

/// Rows of a table by the names of its columns.
std::vector<Row> rows_of(const fs::path& csv) {
  std::vector<Row> rows;
  for (const auto& [name, row] : named_rows(csv)) rows.push_back(row);
  return rows;
}

}  // namespace

TEST_CASE("a box that is turned and tumbles in an engine flies as in our own steps", "[program][engines]") {
  const TemporaryDirectory directory;
  std::ofstream(directory.path() / "tumbles.xml") << R"(<scenario title="A box tumbles">
<simulation step="1e-3" duration="0.2"/><reference kind="missing"/><gravity constant="0 0 0"/>
<bodies><box name="box" size="1 2 3" mass="2" position="0 1 -2" axis="1 2 2" angle="0.7" velocity="1 -2 3"
angular_velocity="3 2 1"/></bodies></scenario>)";
  const Words scene = {"run", "tumbles.xml", "--out", "out", "--quiet"};
  const fs::path trajectory = directory.path() / "out/trajectory.csv";
  REQUIRE(run(directory.path(), joined(scene, {"--method", "ap"})).code == 0);
  const Row ours = rows_of(trajectory).back();
  for (const auto& [name, about] : engines_here(directory.path())) {
    const Result ended = run(directory.path(), joined(scene, {"--engine", name}));
    INFO(name << ": " << ended.err);
    REQUIRE(ended.code == 0);
    const Row row = rows_of(trajectory).back();
    CHECK(row.at("t") == Approx(0.2));
    double cosine = 0;  // of half the angle between the two
    for (const char* q : {"qw", "qx", "qy", "qz"}) cosine += row.at(q) * ours.at(q);
    CHECK(std::abs(cosine) > 1 - 2e-5);
    for (const char* w : {"wx", "wy", "wz"}) CHECK(row.at(w) == Approx(ours.at(w)).margin(0.03));
    for (const char* v : {"vx", "vy", "vz"}) CHECK(row.at(v) == Approx(ours.at(v)).margin(1e-3));
    for (const char* p : {"px", "py", "pz"}) CHECK(row.at(p) == Approx(ours.at(p)).margin(1e-2));
  }
}

TEST_CASE("forces in an engine push their body and no other, each in the steps that start within its time",
          "[program][engines]") {
  const TemporaryDirectory directory;
  std::ofstream(directory.path() / "pushed.xml") << R"(<scenario title="One of two balls is pushed">
<simulation step="1e-3" duration="0.02"/><reference kind="missing"/><gravity constant="1 -10 2"/>
<bodies><sphere name="left" radius="0.5" mass="1" position="-2 0 0"/>
<sphere name="right" radius="0.5" mass="4" position="2 0 0"/></bodies>
<forces><force body="right" force="4 -8 12" from="0.005" to="0.015"/>
<force body="right" force="0 4 -4" from="0.01" to="0.018"/></forces></scenario>)";
  for (const auto& [name, about] : engines_here(directory.path())) {
    const Result ended = run(directory.path(), {"run", "pushed.xml", "--engine", name, "--out", "out", "--quiet"});
    INFO(name << ": " << ended.err);
    REQUIRE(ended.code == 0);
    const std::vector<Row> rows = rows_of(directory.path() / "out/trajectory.csv");
    REQUIRE(rows.size() == 2 * 21);
    const Row &left = rows[rows.size() - 2], &right = rows.back();
    const double rounding = about["precision"] == "single" ? 1e-6 : 1e-10;
    // Gravity for all steps; (1, -2, 3) m/s^2 for ten of them, (0, 1, -1) for eight, five of which are the same.
    const double by_gravity[] = {0.02, -0.2, 0.04}, by_forces[] = {0.01, -0.02 + 0.008, 0.03 - 0.008};
    const char* velocity[] = {"vx", "vy", "vz"};
    for (std::size_t k = 0; k < 3; ++k) {
      CHECK(left.at(velocity[k]) == Approx(by_gravity[k]).margin(rounding));
      CHECK(right.at(velocity[k]) == Approx(by_gravity[k] + by_forces[k]).margin(rounding));
    }
  }
}

TEST_CASE("a box slides down a ramp in an engine as long and as wide as it is, and on it", "[program][engines]") {
  // The ramp is tilted by 0.3 rad about z, 5 m up; gravity is along its normal, and friction 0.2 brakes the box.
  const TemporaryDirectory directory;
  std::ofstream(directory.path() / "ramp.xml") << R"(<scenario title="A box slides along a tilted plane">
<simulation step="1e-3" duration="0.1"/><reference kind="missing"/>
<gravity constant="${9.8*sin(0.3)} ${-9.8*cos(0.3)} 0"/>
<bodies><half_space name="ramp" point="1 5 2" normal="${-sin(0.3)} ${cos(0.3)} 0"/>
<box name="box" size="1 0.2 0.6" mass="2" position="${1-0.1*sin(0.3)} ${5+0.1*cos(0.3)} 2" axis="0 0 1" angle="0.3"
velocity="${2*cos(0.3)} ${2*sin(0.3)} 0"/></bodies>
<contacts><pair a="box" b="ramp" mu="0.2"/></contacts></scenario>)";
  const double c = std::cos(0.3), s = std::sin(0.3), braked = 0.2 * 9.8 * 0.1;
  for (const auto& [name, about] : engines_here(directory.path())) {
    std::vector<Words> ways(1, Words{"--engine", name});
    if (name == "simbody") ways.push_back({"--engine", name, "--variant", "rigid"});
    for (const Words& way : ways) {
      const Result ended = run(directory.path(), joined({"run", "ramp.xml", "--out", "out", "--quiet"}, way));
      INFO(way.back() << ": " << ended.err);
      REQUIRE(ended.code == 0);
      const Row row = rows_of(directory.path() / "out/trajectory.csv").back();
      const double x = row.at("px") - 1, y = row.at("py") - 5;
      CHECK(-s * x + c * y == Approx(0.1).margin(0.01));
      CHECK(c * x + s * y == Approx((2 - braked / 2) * 0.1).margin(0.01));
      CHECK(row.at("pz") == Approx(2).margin(0.01));
      CHECK(c * row.at("vx") + s * row.at("vy") == Approx(2 - braked).margin(0.1));
      CHECK(std::abs(row.at("qw") * std::cos(0.15) + row.at("qz") * std::sin(0.15)) > 1 - 1e-4);
    }
  }
}

TEST_CASE("what coasts slowly in an engine neither falls asleep nor is damped", "[program][engines]") {
  const TemporaryDirectory directory;
  for (const auto& [name, about] : engines_here(directory.path())) {
    const Result ended = run(directory.path(), {"run", preflight_scenes + "coast.xml", "--engine", name, "--step",
                                                "1e-2", "--record-every", "500", "--out", "out", "--quiet"});
    INFO(name << ": " << ended.err);
    REQUIRE(ended.code == 0);
    const Row row = rows_of(directory.path() / "out/trajectory.csv").back();
    CHECK(row.at("t") == Approx(5));
    const double rounding = about["precision"] == "single" ? 1e-4 : 1e-8;
    CHECK(row.at("vx") == Approx(1e-3).epsilon(rounding));
    CHECK(row.at("wy") == Approx(1e-3).epsilon(rounding));
  }
}

TEST_CASE("an engine has the friction and the restitution that flags give, in place of the scene's",
          "[program][engines]") {
  const TemporaryDirectory directory;
  if (!engines_here(directory.path()).contains("ode")) return;
  const auto last_row = [&](const Words& words) {
    const Result ended =
        run(directory.path(), joined({"run"}, joined(words, {"--engine", "ode", "--out", "out", "--quiet"})));
    INFO(ended.err);
    REQUIRE(ended.code == 0);
    return rows_of(directory.path() / "out/trajectory.csv").back();
  };
  const Words slides = {preflight_scenes + "slide.xml", "--duration", "0.1"};
  CHECK(last_row(slides).at("vx") == Approx(2 - 0.2 * 9.8 * 0.1).epsilon(1e-2));
  CHECK(summary(directory.path() / "out")["contacts_max"] == 4);
  CHECK(last_row(joined(slides, {"--friction", "0"})).at("vx") == Approx(2).epsilon(1e-6));
  // It comes down with 4.4 m/s after 0.45 s, and has gone up for 0.15 s.
  CHECK(last_row({preflight_scenes + "bounce.xml"}).at("vy") < 1.5);
  CHECK(last_row({preflight_scenes + "bounce.xml", "--restitution", "1"}).at("vy") > 2.5);
}

TEST_CASE("a perturbed run of an engine starts where a method's does", "[program][engines]") {
  const TemporaryDirectory directory;
  const fs::path trajectory = directory.path() / "out/trajectory.csv";
  const Words scene = {"run", preflight_scenes + "fall.xml", "--duration", "0.01", "--perturb", "0.01", "--seed", "3"};
  REQUIRE(falls(directory.path(), scene).code == 0);
  const Row theirs = rows_of(trajectory).front();
  REQUIRE(run(directory.path(), joined(scene, {"--method", "ap", "--out", "out", "--quiet"})).code == 0);
  CHECK(theirs == rows_of(trajectory).front());
  CHECK(std::hypot(theirs.at("px"), theirs.at("py") - 0.5, theirs.at("pz")) == Approx(0.01));
}

TEST_CASE("rows of an engine's run are of the steps that are recorded, its largest overlap of the last one too",
          "[program][engines]") {
  // The link falls under a gravity that changes; its head, a metre below its centre, goes into the ground first, and
  // deeper than its claw.
  const TemporaryDirectory directory;
  std::ofstream(directory.path() / "hammer.xml") << R"(<scenario title="A hammer falls through the ground">
<simulation step="1e-3" duration="0.5"/><reference kind="missing"/>
<gravity constant="0 -9.8 0"><harmonic axis="y" amplitude="2" frequency="4"/></gravity>
<bodies><half_space name="ground" point="0 0 0" normal="0 1 0"/>
<robot name="robot"><link name="hammer" mass="3" position="0 2 0" inertia="1 1 1">
<sphere name="head" radius="0.5" position="0 1 0"/><sphere name="claw" radius="0.5" position="0 1.3 0"/></link>
<joint name="floats" kind="free" parent="world" child="hammer"/></robot></bodies>
<contacts><pair a="head" b="ground" mu="0.5"/><pair a="claw" b="ground" mu="0.5"/></contacts></scenario>)";
  const Result ended = falls(directory.path(), {"run", "hammer.xml", "--record-every", "200"});
  INFO(ended.err);
  REQUIRE(ended.code == 0);
  const std::vector<Row> steps = rows_of(directory.path() / "out/steps.csv");
  REQUIRE(steps.size() == 2);
  REQUIRE(rows_of(directory.path() / "out/trajectory.csv").size() == 3);
  constexpr double h = 1e-3, mass = 3, radius = 0.5;
  const auto gravity = [](int index) { return -9.8 + 2 * std::cos(4 * h * index); };  // m/s^2, along y
  const auto overlap = [](double y) { return std::max(0.0, radius - (y - 1)); };
  double y = 2, v = 0;
  for (int index = 0, row = 0; index < 500; ++index) {
    v += h * gravity(index);
    y += h * v;
    const int step = index + 1;
    if (step % 200 != 0) continue;
    const Row& of = steps[static_cast<std::size_t>(row++)];
    CHECK(of.at("step") == step);
    CHECK(of.at("t") == Approx(step * h));
    CHECK(of.at("kinetic_energy") == Approx(mass * v * v / 2).epsilon(1e-9));
    CHECK(of.at("potential_energy") == Approx(-mass * gravity(step) * y).epsilon(1e-9));
    CHECK(of.at("max_penetration") == Approx(overlap(y)).margin(1e-9));
  }
  CHECK(overlap(y) > steps[1].at("max_penetration") + 0.1);
  CHECK(summary(directory.path() / "out")["max_penetration"].get<double>() == Approx(overlap(y)));
}

TEST_CASE("an engine's summary has the most of what its steps have, and the sum of their times", "[program][engines]") {
  // The ball meets the ground on its way, after 0.45 s; in the end it is in flight again.
  const TemporaryDirectory directory;
  if (!engines_here(directory.path()).contains("ode")) return;
  const fs::path out = directory.path() / "out";
  const Result ended = run(directory.path(), {"run", preflight_scenes + "bounce.xml", "--restitution", "1", "--engine",
                                              "ode", "--out", "out", "--quiet"});
  INFO(ended.err);
  REQUIRE(ended.code == 0);
  const std::vector<Row> steps = rows_of(out / "steps.csv");
  REQUIRE(steps.size() == 600);
  double contacts = 0, deepest = 0, stepping = 0, solving = 0;
  for (const Row& step : steps) {
    contacts = std::max(contacts, step.at("contacts"));
    deepest = std::max(deepest, step.at("max_penetration"));
    stepping += step.at("step_s");
    solving += step.at("solve_s");
  }
  CHECK(contacts == 1);
  CHECK(deepest > 1e-4);
  CHECK(steps.back().at("contacts") == 0);
  CHECK(steps.back().at("max_penetration") == 0);
  const Json row = summary(out);
  CHECK(row["contacts_max"] == 1);
  CHECK(row["max_penetration"].get<double>() == Approx(deepest));
  CHECK(row["time"]["total_s"].get<double>() == Approx(stepping));
  CHECK(row["time"]["solve_s"].get<double>() == Approx(solving));
}

TEST_CASE("a preflight measures of ODE the friction and the restitution that it has", "[program][engines]") {
  const TemporaryDirectory directory;
  if (!engines_here(directory.path()).contains("ode")) return;
  const Result ended = run(directory.path(), {"check", "--engine", "ode", "--variant", "world", "--json"});
  INFO(ended.err);
  CHECK(ended.code == 3);  // what takes depth away throws back what has no restitution
  const Json rows = Json::parse(ended.out);
  REQUIRE(rows.size() == 1);
  std::map<std::string, Json> measured;
  for (const Json& line : rows[0]["lines"]) measured[line["name"].get<std::string>()] = line;
  const double pyramid = std::sqrt(2.0);
  for (const auto& [name, value] : {std::pair("friction along x, of mu", 1.0),
                                    {"friction at 45 degrees, of mu", pyramid},
                                    {"heading left at 45 degrees", 0.0},
                                    {"contacts of a box on the ground", 4.0},
                                    {"restitution of 0.5", 0.5}}) {
    INFO(name);
    const Json& line = measured.at(name);
    CHECK(line["measured"].get<double>() == Approx(value).margin(5e-3));
    CHECK(line["expected"].get<double>() == Approx(value));
    CHECK(line["passed"] == true);
  }
  const Json& none = measured.at("restitution of 0");
  CHECK(none["measured"].get<double>() == Approx(0.15).margin(0.05));
  CHECK(none["expected"] == 0);
  CHECK(none["passed"] == false);
}

TEST_CASE("an engine that comes back from its steps ends at its time limit by itself", "[program][engines]") {
  const TemporaryDirectory directory;
  const Result ended = falls(directory.path(), {"run", preflight_scenes + "fall.xml", "--step", "1e-7", "--duration",
                                                "100", "--record-every", "1000000000", "--time-limit", "0.2"});
  CHECK(ended.code == 3);
  const Json row = summary(directory.path() / "out");
  CHECK(row["status"] == "time_limit");
  CHECK(row["reason"] == "the time limit of 0.2 s was reached");
  CHECK(row["steps"].get<long>() > 0);
}

TEST_CASE("a motor in MuJoCo gives no more than its greatest torque", "[program][engines]") {
  // 1 kg m^2 about the hinge: 3 N m are asked for, and 0.25 N m there, for 0.1 s.
  const TemporaryDirectory directory;
  if (!engines_here(directory.path()).contains("mujoco")) return;
  for (const std::string asked : {"3", "-3"}) {
    std::ofstream(directory.path() / "weak.xml")
        << R"(<scenario title="A motor that is too weak"><simulation step="1e-3" duration="0.1"/>
<reference kind="missing"/><gravity constant="0 0 0"/><bodies><robot name="pendulum">
<link name="bar" mass="3" position="0.5 0 0" inertia="1e-3 0.25 0.25"/>
<joint name="hinge" kind="revolute" parent="world" child="bar" anchor="0 0 0" axis="0 0 1" torque_limit="0.25"/>
</robot></bodies><controllers><controller kind="computed_torque" robot="pendulum">
<close joint="hinge" acceleration=")"
        << asked << R"("/></controller></controllers></scenario>)";
    const Result ended = run(directory.path(), {"run", "weak.xml", "--engine", "mujoco", "--out", "out", "--quiet"});
    INFO(ended.err);
    REQUIRE(ended.code == 0);
    const double spin = rows_of(directory.path() / "out/trajectory.csv").back().at("wz");
    CHECK(spin == Approx(asked == "3" ? 0.025 : -0.025).epsilon(1e-6));
    CHECK(named_rows(directory.path() / "out/joints.csv").back().second.at("tau") == (asked == "3" ? 0.25 : -0.25));
  }
}

TEST_CASE("a preflight measures of an engine that knows gravity alone what that comes to", "[program][engines]") {
  const TemporaryDirectory directory;
  const Result ended =
      run(directory.path(), {"check", "--engine", "broken", "--variant", "soft", "--json"}, broken_too);
  INFO(ended.err);
  CHECK(ended.code == 3);
  const Json rows = Json::parse(ended.out);
  REQUIRE(rows.size() == 1);
  CHECK(rows[0]["fault"].is_null());
  const Json& measured = rows[0]["lines"];
  // Nothing stops the box, which comes 3 m far in 1.5 s: v^2 / (2 g (s + v h / 2)) would be its friction.
  const double friction = 4 / (2 * 9.8 * (3 + 2 * 1e-3 / 2)) / 0.2;
  struct Line {
    const char* name;
    double measured, expected;
    bool passed;
  };
  const std::vector<Line> wanted = {{"gravity", 9.8, 9.8, true},
                                    {"velocity that moves", 1, 1, true},
                                    {"time at which forces are taken", 0, 0, true},
                                    {"speed kept, asleep or not", 1, 1, true},
                                    {"speed kept", 1, 1, true},
                                    {"spin kept", 1, 1, true},
                                    {"friction along x, of mu", friction, 1, false},
                                    {"friction at 45 degrees, of mu", friction, 1, false},
                                    {"heading left at 45 degrees", 0, 0, true},
                                    {"contacts of a box on the ground", 0, 4, false},
                                    {"restitution of 0.5", 0, 0, false},
                                    {"restitution of 0", 0, 0, true}};
  REQUIRE(measured.size() == wanted.size());
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const Json& line = measured[i];
    INFO(line.dump());
    CHECK(line["name"] == wanted[i].name);
    CHECK(line["passed"] == wanted[i].passed);
    if (line["name"] == "restitution of 0.5") {  // which it refuses
      CHECK(line["measured"].is_null());
      CHECK(line["unsupported"] == true);
      CHECK(line["note"] == "restitution, on purpose");
      continue;
    }
    CHECK(line["measured"].get<double>() == Approx(wanted[i].measured).epsilon(1e-9).margin(1e-9));
    CHECK(line["expected"] == wanted[i].expected);
    CHECK_FALSE(line.contains("unsupported"));
  }
}

#endif
