// Engines' own contact problems: the data that a file holds are those of the engine's step.

#include <sys/file.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <tuple>

#include "contact/answer_files.h"
#include "contact/problem_files.h"
#include "contact/referee.h"
#include "program/engine_rows.h"

#ifdef BROKEN_ENGINE_FOLDER  // where engines are built at all

using namespace program;

namespace {

/// Engines that give their contact problems away, and how well they know a normal, rad: Siconos has its contacts from
/// Bullet in single precision.
struct Giver {
  const char* name;
  double normal;
};
constexpr Giver givers[] = {{"mujoco", 1e-10}, {"dart", 1e-10}, {"siconos", 1e-3}};

bool is_here(const fs::path& directory, const std::string& name) {
  const Json all = Json::parse(run(directory, {"list", "engines", "--json"}).out);
  for (const Json& engine : all)
    if (engine["name"] == name) return engine["unavailable"].is_null();
  return false;
}

/// Stems of the problems that an engine met on a stack, in their order.
std::vector<fs::path> own_problems(const fs::path& directory, const std::string& engine, int boxes,
                                   const std::string& duration) {
  const Result ended =
      run(directory, {"run", "stack", "--set", "boxes=" + std::to_string(boxes), "--engine", engine, "--step", "1e-3",
                      "--duration", duration, "--save-problems", "own", "--out", "out", "--quiet"});
  INFO(engine << ": " << ended.err);
  REQUIRE(ended.code == 0);
  std::vector<fs::path> stems;
  for (const auto& entry : fs::directory_iterator(directory / "own"))
    if (entry.path().extension() == ".json") stems.push_back(fs::path(entry.path()).replace_extension());
  std::sort(stems.begin(), stems.end());
  return stems;
}

/// Of three boxes in a stack: does(engine, stem, what is written of the problem).
template <class Does>
void with_each_problem(const Does& does) {
  if (!cb::fclib_available()) return;
  for (const Giver& giver : givers) {
    TemporaryDirectory directory;
    if (!is_here(directory.path(), giver.name)) continue;
    const auto stems = own_problems(directory.path(), giver.name, 3, "0.02");
    REQUIRE(stems.size() > 10);
    for (const fs::path& stem : stems) {
      const Json about = Json::parse(read_file(stem.string() + ".json"));
      INFO(stem << about.dump());
      does(std::string(giver.name), stem, about);
    }
  }
}

}  // namespace

TEST_CASE("a folder of an engine's problems is that of one run, and nobody's other files", "[program][engines]") {
  if (!cb::fclib_available()) return;
  const TemporaryDirectory directory;
  const fs::path own = directory.path() / "own";
  const auto store = [&](const char* out) {
    return run(directory.path(),
               {"run", std::string(SOURCE_ROOT) + "/scenarios/preflight/fall.xml", "--engine", "broken", "--variant",
                "falls", "--save-problems", "own", "--out", out, "--quiet"},
               [] { setenv("CONTACTBENCH_ENGINES", BROKEN_ENGINE_FOLDER, 1); });
  };
  fs::create_directories(own);
  const std::vector<std::string> stored = {"step_000000001.hdf5", "step_000000001.json", "event_000000001.hdf5"},
                                 others = {"step_response.csv", "step_1.hdf5", "step_by_step.json"};
  for (const auto* files : {&stored, &others})
    for (const std::string& file : *files) std::ofstream(own / file) << "old";
  {
    const int folder = open(own.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);  // as another run has it
    REQUIRE(flock(folder, LOCK_EX | LOCK_NB) == 0);
    const Result refused = store("out");
    CHECK(refused.code == 2);
    CHECK(refused.err.find("--save-problems own: another run") != std::string::npos);
    CHECK_FALSE(fs::exists(directory.path() / "out"));
    CHECK(fs::exists(own / stored[0]));
    close(folder);
  }
  CHECK(store("out").code == 3);  // this one keeps no problem
  for (const std::string& file : stored) CHECK_FALSE(fs::exists(own / file));
  for (const std::string& file : others) CHECK(fs::exists(own / file));
  CHECK(store("own").code == 3);  // one folder for both
}

TEST_CASE("of an engine's own problems every n-th is kept, from the first on, whichever steps they are of",
          "[program][engines]") {
  if (!cb::fclib_available()) return;
  const TemporaryDirectory directory;
  if (!is_here(directory.path(), "mujoco")) return;
  const auto kept = [&](const std::string& every) {
    const Result ended =
        run(directory.path(), {"run", "stack", "--set", "boxes=1", "--engine", "mujoco", "--step", "1e-3", "--duration",
                               "0.03", "--save-problems", "own", "--save-every", every, "--out", "out", "--quiet"});
    INFO(ended.err);
    REQUIRE(ended.code == 0);
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(directory.path() / "own"))
      if (entry.path().extension() == ".hdf5") names.push_back(entry.path().stem().string());
    std::sort(names.begin(), names.end());
    return names;
  };
  const std::vector<std::string> all = kept("1");
  REQUIRE(all.size() > 10);
  std::vector<std::string> wanted;
  for (std::size_t i = 0; i < all.size(); i += 5) wanted.push_back(all[i]);
  CHECK(kept("5") == wanted);
}

TEST_CASE("an engine that keeps no problems, or none of robots, says so", "[program][engines]") {
  if (!cb::fclib_available()) return;
  const TemporaryDirectory directory;
  for (const auto& [engine, scene, reason] :
       {std::tuple("ode", "stack", "--save-problems: ode does not give its contact problems away"),
        {"mujoco", "urdf_arm", "--save-problems: of free bodies only, and this scene has a robot"}}) {
    INFO(engine);
    if (!is_here(directory.path(), engine)) continue;
    const Result ended = run(directory.path(), {"run", scene, "--engine", engine, "--duration", "0.01",
                                                "--save-problems", "own", "--out", "out", "--quiet"});
    INFO(ended.err);
    CHECK(ended.code == 3);
    CHECK(summary(directory.path() / "out")["status"] == "unsupported");
    CHECK(summary(directory.path() / "out")["reason"] == reason);
  }
}

TEST_CASE("a problem of an engine that cannot be written, or not what is said of it, ends the run and is named",
          "[program][engines]") {
  if (!cb::fclib_available()) return;
  const TemporaryDirectory directory;
  if (!is_here(directory.path(), "mujoco")) return;
  for (const auto& [own, ending, reason] : {std::tuple("first", ".hdf5", ".hdf5: cannot be written: Is a directory"),
                                            {"second", ".json", ".json: could not be written"}}) {
    INFO(ending);
    for (int step = 1; step <= 30; ++step) {  // whichever is the first with a contact
      const std::string number = std::to_string(step);
      const std::string file = "step_" + std::string(9 - number.size(), '0') + number + ending;
      fs::create_directories(directory.path() / own / file / "in_the_way");
    }
    const Result ended =
        run(directory.path(), {"run", "stack", "--set", "boxes=1", "--engine", "mujoco", "--step", "1e-3", "--duration",
                               "0.03", "--save-problems", own, "--out", "out", "--quiet"});
    INFO(ended.err);
    CHECK(ended.code == 3);
    const Json row = summary(directory.path() / "out");
    CHECK(row["status"] == "write_failed");
    const std::string said = row["reason"];
    CHECK(said.starts_with(std::string(own) + "/step_0000000"));
    CHECK(said.find(reason) != std::string::npos);
  }
}

TEST_CASE("the momentum that an engine's own impulses give is that of its step", "[program][engines]") {
  with_each_problem([](const std::string&, const fs::path&, const Json& about) {
    CHECK(about["momentum_error"].get<double>() <= 1e-12);
    CHECK(about["velocity_error"].get<double>() <= 1e-12);
  });
}

// Of the point that slides, v- + r / m is (0, 2, 0) m/s; that between the walls stays at rest, and the third one leaves
// with (1, 0.5, 0) m/s, which is its own. In the first term of the natural map r is (8, -4, 0), r - u / w (8, -12, 0),
// and its projection (11.2, -5.6, 0); in that of what leaves r - u / w is opposite to the cone, and its projection 0.
TEST_CASE("what is said of an engine's own problem is what its numbers come to, the worst of all bodies and contacts",
          "[program][engines]") {
  if (!cb::fclib_available()) return;
  const TemporaryDirectory directory;
  const Result ended = run(directory.path(),
                           {"run", preflight_scenes + "fall.xml", "--engine", "broken", "--variant", "tells",
                            "--duration", "0.002", "--save-problems", "own", "--out", "out", "--quiet"},
                           [] { setenv("CONTACTBENCH_ENGINES", BROKEN_ENGINE_FOLDER, 1); });
  INFO(ended.err);
  REQUIRE(ended.code == 0);
  const fs::path stem = directory.path() / "own/step_000000002";
  const Json about = Json::parse(read_file(stem.string() + ".json"));
  CHECK(about["engine"] == "broken");
  CHECK(about["version"] == "1");
  CHECK(about["variant"] == "tells");
  CHECK(about["knobs"] == Json({{"depth", 1}}));
  CHECK(about["step"] == 2);
  CHECK(about["step_s"] == 1e-3);
  CHECK(about["t"].get<double>() == Approx(2e-3));
  CHECK(about["contacts"] == 4);
  CHECK(about["velocities"] == 9);
  CHECK(about["law"] == "friction cone");
  CHECK(about["offset"] == "nothing");
  CHECK(about["compliance_per_kg"] == Json::parse("[0, 0, 0, 0.5, 0.5, 0.5, 0.25, 0.25, 0.25, 0, 0, 0]"));
  CHECK(about["largest_compliance_per_kg"] == 0.5);
  CHECK(about["velocity_error"].get<double>() == Approx(1.5));                // the other's: 0.75
  CHECK(about["momentum_error"].get<double>() == Approx(4 * 1.5 / (4 * 3)));  // the other's: 0.75 of |r| + |r| = 6
  const double slides = 0.25 * (3.2 * 3.2 + 1.6 * 1.6), held = 1.5 * 1.5 + 0.75 * 0.75,
               before = (2 * 2 + 3 * 3) / 0.25 + 1 + 0.5 * 0.5;
  CHECK(about["own_residual"].get<double>() == Approx(std::sqrt((slides + held) / before)));
  CHECK(cb::read_impulses(stem.string() + ".hdf5", 4) == std::vector<double>{8, -4, 0, 3, 0, 0, 3, 0, 0, 0, 0, 0});
}

TEST_CASE("what an engine's own impulses give a turned box that falls on a corner is that of its step",
          "[program][engines]") {
  // Its lowest corner is 1.3 mm above the ground; friction and the way to the centre have their part in it.
  if (!cb::fclib_available()) return;
  const TemporaryDirectory directory;
  std::ofstream(directory.path() / "corner.xml") << R"(<scenario title="A box falls on a corner">
<simulation step="1e-3" duration="0.02"/><reference kind="missing"/><gravity constant="0 -9.8 0"/>
<bodies><half_space name="ground" point="0 0 0" normal="0 1 0"/>
<box name="box" size="1 0.6 0.4" mass="2" position="0 0.525 0" axis="1 2 2" angle="0.7" velocity="1 -1 0.5"/></bodies>
<contacts><pair a="box" b="ground" mu="0.5"/></contacts></scenario>)";
  for (const auto& [engine, variant] : {std::pair("mujoco", "newton-elliptic"),
                                        {"mujoco", "newton-pyramidal"},
                                        {"dart", "dantzig"},
                                        {"siconos", "nsgs"}}) {
    if (!is_here(directory.path(), engine)) continue;
    const Result ended = run(directory.path(), {"run", "corner.xml", "--engine", engine, "--variant", variant,
                                                "--save-problems", "own", "--out", "out", "--quiet"});
    INFO(engine << " " << variant << ": " << ended.err);
    REQUIRE(ended.code == 0);
    double across = 0;  // N s, of friction
    for (const auto& entry : fs::directory_iterator(directory.path() / "own")) {
      if (entry.path().extension() != ".json") continue;
      const Json about = Json::parse(read_file(entry.path()));
      INFO(about.dump());
      CHECK(about["momentum_error"].get<double>() <= 1e-8);
      CHECK(about["velocity_error"].get<double>() <= 1e-8);
      CHECK(about["own_residual"].is_number() == (variant == std::string("newton-elliptic")));
      const fs::path file = fs::path(entry.path()).replace_extension(".hdf5");
      const std::vector<double> impulse = cb::read_impulses(file.string(), about["contacts"].get<int>());
      for (std::size_t i = 0; i < impulse.size(); i += 3)
        across = std::max(across, std::hypot(impulse[i + 1], impulse[i + 2]));
    }
    CHECK(across > 0.01);
  }
}

// A box falls by n h g before its first contact, and all four corners with it: M has its mass, and J v- is its speed.
TEST_CASE("the first contact problem of a box that an engine meets is that of a fall", "[program][engines]") {
  if (!cb::fclib_available()) return;
  constexpr double h = 1e-3, g = 9.8;
  for (const auto& [engine, normal] : givers) {
    TemporaryDirectory directory;
    if (!is_here(directory.path(), engine)) continue;
    const auto stems = own_problems(directory.path(), engine, 1, "0.01");
    REQUIRE(!stems.empty());
    const Json about = Json::parse(read_file(stems.front().string() + ".json"));
    const cb::ContactProblem problem = cb::read_contact_problem(stems.front().string() + ".hdf5").problem;
    REQUIRE(problem.nv() == 6);
    for (int k = 0; k < 6; ++k) CHECK(std::abs(problem.M.block(0)(k, k) - (k < 3 ? 1.0 : 1.0 / 6)) <= 1e-12);
    const double speed = about["step"].get<double>() * h * g;
    CHECK(std::abs(problem.v_minus[1] + speed) <= 1e-12);
    std::vector<double> u(3 * static_cast<std::size_t>(problem.nc()));
    cb::multiply(problem.J, problem.M, problem.v_minus, u);
    for (int c = 0; c < problem.nc(); ++c) {
      const double along = std::hypot(u[3 * c + 1], u[3 * c + 2]);
      CHECK(std::abs(std::hypot(u[3 * c], along) - speed) <= 1e-12);  // whatever the frame
      CHECK(u[3 * c] < 0);
      CHECK(along <= normal * speed);
    }
  }
}

// What has fallen 1 m is wanted back with half its speed.
TEST_CASE("the velocity that DART wants back is the offset of its problem, against the approach",
          "[program][engines]") {
  if (!cb::fclib_available()) return;
  TemporaryDirectory directory;
  if (!is_here(directory.path(), "dart")) return;
  const Result ended = run(directory.path(), {"run", preflight_scenes + "bounce.xml", "--engine", "dart",
                                              "--save-problems", "own", "--out", "out", "--quiet"});
  INFO(ended.err);
  REQUIRE(ended.code == 0);
  std::vector<fs::path> stems;
  for (const auto& entry : fs::directory_iterator(directory.path() / "own"))
    if (entry.path().extension() == ".json") stems.push_back(fs::path(entry.path()).replace_extension());
  REQUIRE(!stems.empty());
  const fs::path first = *std::min_element(stems.begin(), stems.end());
  const cb::ContactProblem problem = cb::read_contact_problem(first.string() + ".hdf5").problem;
  std::vector<double> u(3 * static_cast<std::size_t>(problem.nc()));
  cb::multiply(problem.J, problem.M, problem.v_minus, u);
  CHECK(u[0] == Approx(-std::sqrt(2 * 9.8)).epsilon(0.01));
  CHECK(problem.offset[0] == Approx(0.5 * u[0]).epsilon(1e-6));
  const Json about = Json::parse(read_file(first.string() + ".json"));
  CHECK(about["law_residual"] < 1e-4);
  CHECK(about["law_residual_without_offset"] > 0.05);
}

TEST_CASE("what an engine's answer is said to be off by is what the referee says, and its own model is solved",
          "[program][engines]") {
  with_each_problem([](const std::string& engine, const fs::path& stem, const Json& about) {
    cb::ContactProblem problem = cb::read_contact_problem(stem.string() + ".hdf5").problem;
    cb::ContactSolution answer;
    answer.impulse = cb::read_impulses(stem.string() + ".hdf5", problem.nc());
    std::vector<double> v_plus;
    const auto off_by = [&] {
      return cb::Referee().check(problem, answer, cb::newton_law(), v_plus).law.value_or(HUGE_VAL);
    };
    CHECK(about["contacts"] == problem.nc());
    CHECK(about["t"].get<double>() == Approx(1e-3 * about["step"].get<double>()));
    CHECK(about["law_residual"].get<double>() == Approx(off_by()).epsilon(1e-6).margin(1e-12));
    problem.offset.assign(problem.offset.size(), 0.0);
    CHECK(about["law_residual_without_offset"].get<double>() == Approx(off_by()).epsilon(1e-6).margin(1e-12));
    // Of rigid contacts, and of a pyramid, nothing of the kind is said.
    CHECK(about["own_residual"].is_number() == (engine == "mujoco"));
    if (engine == "mujoco") CHECK(about["own_residual"].get<double>() < 1e-6);
  });
}

#endif
