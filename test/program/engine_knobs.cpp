// Knobs and variants of engines do what they are said to do: each by what it comes to in steps that are done by
// hand, and no two ways of solving are one.

#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <map>
#include <tuple>

#include "program/engine_rows.h"

#ifdef BROKEN_ENGINE_FOLDER  // where engines are built at all

using namespace program;

namespace {

Words with_knobs(Words words, const Words& knobs) {
  for (const std::string& knob : knobs) {
    words.emplace_back("--knob");
    words.push_back(knob);
  }
  return words;
}

/// A ball of 1 kg and radius 0.5 m, without gravity, at this height over the ground: after one step of 1 ms.
Row after_a_step(const fs::path& directory, const std::string& height, const Words& words) {
  std::ofstream(directory / "sunk.xml") << R"(<scenario title="A ball in the ground">
<simulation step="1e-3" duration="1e-3"/><reference kind="missing"/><gravity constant="0 0 0"/>
<bodies><half_space name="ground" point="0 0 0" normal="0 1 0"/>
<sphere name="ball" radius="0.5" mass="1" position="0 )"
                                        << height << R"( 0"/></bodies>
<contacts><pair a="ball" b="ground" mu="0"/></contacts></scenario>)";
  const Result result = run(directory, joined({"run", "sunk.xml", "--out", "out", "--quiet"}, words));
  INFO(result.err);
  REQUIRE(result.code == 0);
  return named_rows(directory / "out/trajectory.csv").back().second;
}

}  // namespace

TEST_CASE("knobs of ODE say how fast a depth is taken away, how much of it is left and how far contacts give way",
          "[program][engines]") {
  // erp / h of the depth of 0.01 m a second; against the compliance cfm 1 kg has cfm m / h = 1.
  const TemporaryDirectory directory;
  if (!engines_here(directory.path()).contains("ode")) return;
  struct Case {
    Words knobs;
    double speed;
  };
  for (const auto& [knobs, speed] :
       {Case{{}, 2}, Case{{"erp=0.5"}, 5}, Case{{"erp=0.5", "surface_layer=0.004"}, 3},
        Case{{"erp=0.5", "max_correcting_speed=4"}, 4}, Case{{"erp=0.5", "cfm=1e-3"}, 2.5}}) {
    const Words words = with_knobs({"--engine", "ode", "--variant", "world"}, knobs);
    const Row ball = after_a_step(directory.path(), "0.49", words);
    INFO(speed);
    CHECK(ball.at("vy") == Approx(speed).epsilon(1e-5));
    CHECK(ball.at("py") == Approx(0.49 + speed * 1e-3).epsilon(1e-7));
  }
  const Result two = run(directory.path(), {"run", preflight_scenes + "slide.xml", "--duration", "0.01", "--engine",
                                            "ode", "--knob", "max_contacts=2", "--out", "out", "--quiet"});
  REQUIRE(two.code == 0);
  CHECK(summary(directory.path() / "out")["contacts_max"] == 2);
}

TEST_CASE("Bullet takes a depth away beside the velocities, or in them where its knob says so", "[program][engines]") {
  // Its split impulse is for what is deeper than 0.04 m.
  const TemporaryDirectory directory;
  if (!engines_here(directory.path()).contains("bullet")) return;
  const Row beside = after_a_step(directory.path(), "0.44", {"--engine", "bullet"});
  CHECK(std::abs(beside.at("vy")) < 1e-6);
  CHECK(beside.at("py") > 0.445);
  const Row within = after_a_step(directory.path(), "0.44", with_knobs({"--engine", "bullet"}, {"split_impulse=0"}));
  CHECK(within.at("vy") == Approx(0.2 * 0.06 / 1e-3).epsilon(0.05));
  // The share is erp2 in both ways.
  const auto with = [&](const Words& knobs) {
    return after_a_step(directory.path(), "0.44", with_knobs({"--engine", "bullet"}, knobs));
  };
  CHECK(with({"erp2=0.4"}).at("py") - 0.44 == Approx(2 * (beside.at("py") - 0.44)).epsilon(0.05));
  CHECK(with({"split_impulse=0", "erp2=0.4"}).at("vy") == Approx(2 * within.at("vy")).epsilon(0.05));
}

TEST_CASE("knobs of MuJoCo say how hard a contact of a known depth pushes", "[program][engines]") {
  // From rest, a depth x is taken away with the acceleration d^2 x / (d_max timeconst dampratio)^2, d the impedance at
  // x: 0.95 at 0.01 m, where it is the largest; half way to it where solimp_width is twice that.
  const TemporaryDirectory directory;
  if (!engines_here(directory.path()).contains("mujoco")) return;
  const auto share = [](double d, double largest) { return d * d / (largest * largest); };
  struct Case {
    Words knobs;
    double speed;
  };
  for (const auto& [knobs, speed] :
       {Case{{}, 0.025}, Case{{"timeconst=0.01"}, 0.1}, Case{{"timeconst=0"}, 2.5}, Case{{"dampratio=2"}, 0.00625},
        Case{{"solimp_width=0.02"}, 0.025 * share(0.925, 0.95)},
        Case{{"solimp_width=0.02", "solimp_min=0.5"}, 0.025 * share(0.725, 0.95)},
        Case{{"solimp_width=0.02", "solimp_max=0.99"}, 0.025 * share(0.945, 0.99)}}) {
    const Row ball = after_a_step(directory.path(), "0.49", with_knobs({"--engine", "mujoco"}, knobs));
    INFO(speed);
    CHECK(ball.at("vy") == Approx(speed).epsilon(1e-3));
  }
}

TEST_CASE("with theta 1 Siconos takes forces of the step alone, and moves with the velocity at its end",
          "[program][engines]") {
  const TemporaryDirectory directory;
  if (!engines_here(directory.path()).contains("siconos")) return;
  const Result ended = run(directory.path(), {"run", preflight_scenes + "fall.xml", "--duration", "0.1", "--engine",
                                              "siconos", "--knob", "theta=1", "--out", "out", "--quiet"});
  INFO(ended.err);
  REQUIRE(ended.code == 0);
  const Row box = named_rows(directory.path() / "out/trajectory.csv").back().second;
  constexpr double h = 1e-3, n = 100;
  double across = 0;
  for (int i = 0; i < n; ++i) across += h * std::cos(10 * h * i);
  CHECK(box.at("vx") == Approx(across).epsilon(1e-9));
  CHECK(box.at("py") == Approx(0.5 - 9.8 * h * h * n * (n + 1) / 2).epsilon(1e-9));
}

TEST_CASE("no two ways of solving that an engine has are one", "[program][engines]") {
  const TemporaryDirectory directory;
  for (const auto& [name, about] : engines_here(directory.path())) {
    if (name == "bullet-float") continue;         // has those of bullet
    std::map<std::string, std::string> variants;  // by the way of a box that slides askew
    for (const Json& variant : about.at("variants")) {
      const std::string word = variant["name"];
      const Result ended =
          run(directory.path(), {"run", preflight_scenes + "slide.xml", "--set", "heading=0.5", "--duration", "0.01",
                                 "--engine", name, "--variant", word, "--out", "out", "--quiet"});
      INFO(ended.err);
      REQUIRE(ended.code == 0);
      const auto [same, first] = variants.emplace(read_file(directory.path() / "out/trajectory.csv"), word);
      INFO(name << ": " << word << " does what " << same->second << " does");
      CHECK(first);
    }
  }
}

namespace {

struct Turned {
  const char *engine, *variant, *knob;
};

/// Does each change the way of a slab that slides and turns, with a block on it where the engine knows such a contact?
void check_turned(const std::vector<Turned>& cases) {
  const TemporaryDirectory directory;
  const auto here = engines_here(directory.path());
  std::map<std::string, std::string> plain;  // ways without a knob that is turned
  for (const auto& [engine, variant, knob] : cases) {
    if (!here.contains(engine)) continue;
    INFO(engine << " " << variant << " " << knob);
    const bool block = engine != std::string("simbody");
    std::ofstream(directory.path() / "slab.xml")
        << R"(<scenario title="A slab slides with a block on it">
<simulation step="1e-3" duration="0.02"/><reference kind="missing"/><gravity constant="0 -9.8 0"/>
<bodies><half_space name="ground" point="0 0 0" normal="0 1 0"/>
<box name="slab" size="1 0.2 0.8" mass="2" position="0 0.1 0" velocity="2 0 0.5" angular_velocity="0 3 0"/>)"
        << (block ? R"(<box name="block" size="0.4 0.4 0.4" mass="1"
position="0.1 0.4 0" velocity="2 0 0.5"/>)"
                  : "")
        << R"(</bodies><contacts><pair a="slab" b="ground" mu="0.3"/>)"
        << (block ? R"(<pair a="slab" b="block" mu="0.3"/>)" : "") << "</contacts></scenario>";
    const auto way = [&, by = Words{"--engine", engine, "--variant", variant}](const Words& knobs) {
      const Result ended =
          run(directory.path(), with_knobs(joined({"run", "slab.xml", "--out", "out", "--quiet"}, by), knobs));
      INFO(ended.err);
      REQUIRE(ended.code == 0);
      return read_file(directory.path() / "out/trajectory.csv");
    };
    std::string& as_it_is = plain[std::string(engine) + variant];
    if (as_it_is.empty()) as_it_is = way({});
    CHECK(way({knob}) != as_it_is);
  }
}

}  // namespace

TEST_CASE("knobs of how ODE, Bullet and MuJoCo solve change what comes of it", "[program][engines]") {
  check_turned({{"ode", "quick", "iterations=1"},
                {"ode", "quick", "relaxation=1"},
                {"ode", "world", "finite_rotation=1"},
                {"bullet", "si10", "iterations=1"},
                {"bullet", "si10", "cfm=1e-3"},
                {"bullet", "si10", "warm_start=0.5"},
                {"bullet", "si10", "friction_directions=2"},
                {"mujoco", "pgs-elliptic", "iterations=1"},
                {"mujoco", "pgs-elliptic", "tolerance=1"},
                {"mujoco", "newton-elliptic", "noslip_iterations=3"},
                {"mujoco", "newton-elliptic", "impratio=10"}});
}

TEST_CASE("knobs of how DART, Simbody and Siconos solve change what comes of it", "[program][engines]") {
  check_turned({{"dart", "pgs", "iterations=1"},
                {"simbody", "compliant", "stiffness=1e5"},
                {"simbody", "compliant", "dissipation=0"},
                {"simbody", "compliant", "transition_speed=5"},
                {"siconos", "nsgs", "iterations=1"}});
}

TEST_CASE("counts among an engine's own knobs are whole, not too few, and not too many where there are so many",
          "[program][engines]") {
  const TemporaryDirectory directory;
  const auto here = engines_here(directory.path());
  for (const auto& [engine, knob, from_to] : {std::tuple("ode", "max_contacts=0", "1 to 2147483647"),
                                              {"bullet", "iterations=2.5", "1 to 2147483647"},
                                              {"bullet", "friction_directions=3", "1 to 2"},
                                              {"mujoco", "noslip_iterations=-1", "0 to 2147483647"}}) {
    if (!here.contains(engine)) continue;
    refused({"run", "stack", "--engine", engine, "--knob", knob},
            {std::string("--knob ") + knob + ": must be a whole number from " + from_to});
  }
}

#endif
