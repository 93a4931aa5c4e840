// What `check`, `list` and `run` say of a scene, a table and a run, word by word.

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <set>
#include <sstream>

#include "program/program.h"

using namespace program;

namespace {

const std::string stress = std::string(SOURCE_ROOT) + "/scenarios/stress/";

/// A crate of 2 kg and a ball of 3 kg that touch the ground, and a bar of 4 kg and 1 kg m^2 on a spring of 100 N m/rad.
void write_scene(const fs::path& folder, const char* rotate_cone = "0.25") {
  std::ofstream(folder / "yard.xml") << R"(<scenario title="A crate, a ball and an arm">
  <parameters><parameter name="push" type="number" default="3" minimum="0" unit="N" description="force on the crate"/>
  </parameters>
  <simulation step="2e-3" duration="0.5" k="6" compression_bound="off" rotate_cone=")"
                                     << rotate_cone << R"("/>
  <reference kind="missing"/>
  <gravity constant="0.5 -9 0.25"><harmonic axis="z" amplitude="0.125" frequency="3" phase="0.75"/></gravity>
  <bodies>
    <half_space name="ground" point="0 0 0" normal="0 1 0"/>
    <box name="crate" size="1 1 1" mass="2" position="0 0.5 0"/>
    <sphere name="ball" radius="0.25" mass="3" position="3 0.25 0"/>
    <robot name="arm"><link name="bar" mass="4" position="5 5 0" inertia="1 1 1"/>
      <joint name="hinge" kind="revolute" parent="world" child="bar" anchor="5 5 0" axis="0 1 0" stiffness="100"/>
    </robot>
  </bodies>
  <contacts>
    <pair a="crate" b="ground" mu="0.5"/>
    <pair a="ball" b="ground" mu="0.25" restitution="0.75"/>
  </contacts>
  <forces><force body="crate" force="${push} 0 1" from="0.125" to="0.25"/></forces>
</scenario>
)";
}

Json said(const fs::path& directory, const std::vector<std::string>& arguments) {
  const Result result = run(directory, arguments);
  INFO(result.err);
  REQUIRE(result.code == 0);
  return Json::parse(result.out);
}

/// Entries of a listing by their names.
std::map<std::string, Json> listed(const fs::path& directory, const char* topic) {
  std::map<std::string, Json> out;
  for (const Json& entry : said(directory, {"list", topic, "--json"})) out[entry["name"]] = entry;
  return out;
}

std::size_t width_of(const std::map<std::string, Json>& entries) {
  std::size_t width = 0;
  for (const auto& entry : entries) width = std::max(width, entry.first.size());
  return width;
}

bool has_line(const std::string& text, const std::string& line) {
  const auto all = lines(text);
  return std::find(all.begin(), all.end(), line) != all.end();
}

}  // namespace

TEST_CASE("each thing that check finds in a scene stands in its own place", "[program]") {
  const TemporaryDirectory directory;
  write_scene(directory.path());
  const Json json = said(directory.path(), {"check", "yard.xml", "--set", "push=5", "--json"});
  CHECK(json["name"] == "yard");
  CHECK(json["title"] == "A crate, a ball and an arm");
  CHECK(json["file"] == "yard.xml");
  CHECK(json["bodies"] == 3);
  CHECK(json["mass_kg"] == 9);
  CHECK(json["shapes"] == Json({{"half_space", 1}, {"box", 1}, {"sphere", 1}}));
  CHECK(json["pairs"] ==
        Json::parse(R"([{"friction": 0.5, "restitution": 0.0}, {"friction": 0.25, "restitution": 0.75}])"));
  CHECK(json["gravity_m_per_s2"] == Json::parse("[0.5, -9.0, 0.25]"));
  CHECK(json["gravity"] == "(0.5, -9, 0.25) m/s^2 + z 0.125 cos(3 t + 0.75)");
  CHECK(json["forces"] == 1);
  CHECK(json["step_s"] == 2e-3);
  CHECK(json["duration_s"] == 0.5);
  CHECK(json["k"] == 6);
  CHECK(json["rotate_cone_rad"] == 0.25);
  // It may be turned the other way, too.
  write_scene(directory.path(), "-0.25");
  CHECK(said(directory.path(), {"check", "yard.xml", "--json"})["rotate_cone_rad"] == -0.25);
  CHECK(has_line(run(directory.path(), {"check", "yard.xml"}).out,
                 "  rotate_cone friction directions turned by -0.25 rad"));
  CHECK(json["compression_bound"] == false);
  CHECK(json["parameters"] == Json({{"push", "5"}}));
  CHECK(json["reference"] == Json({{"kind", "missing"}, {"name", ""}}));
  CHECK(json["robots"] == Json::parse(R"([{"name": "arm", "links": 1, "freedoms": 1}])"));
  CHECK(json["controllers"].empty());
  CHECK(json["joint_forces"] == "explicit");
  CHECK(json["largest_stable_step_s"].get<double>() == Approx(0.2).epsilon(1e-3));  // h^2 k / I = 4
  CHECK(json["contacts_at_start"] == 5);
  CHECK(json["pairs_at_start"] == 2);
  CHECK(json["method"].is_null());
  CHECK(json["notes"].empty());
  CHECK(json["left_out"].size() == 2);  // controllers, and the ground
  const Json box = said(directory.path(), {"check", "sticking_box.xml", "--json"});
  CHECK(box["reference"] == Json({{"kind", "analytic"}, {"name", "sticking_box"}}));
  CHECK(box["largest_stable_step_s"].is_null());
  const Json train = said(directory.path(), {"check", stress + "stiff_joints.xml", "--json"});
  CHECK(train["controllers"] == Json({"computed_torque"}));
  CHECK(train["robots"][0]["links"] == 2);
  CHECK(train["largest_stable_step_s"].get<double>() ==
        Approx(2 / std::sqrt((3 + std::sqrt(5)) / 2 * 1e3)).epsilon(1e-3));
}

TEST_CASE("each line of check says what it is about", "[program]") {
  const TemporaryDirectory directory;
  write_scene(directory.path());
  const Result result = run(directory.path(), {"check", "yard.xml", "--set", "push=4"});
  INFO(result.out);
  REQUIRE(result.code == 0);
  for (const char* line :
       {"yard: A crate, a ball and an arm", "  file        yard.xml", "  bodies      3 that move, 9 kg together",
        "  shapes      1 box, 1 half_space, 1 sphere", "  pairs       friction 0.5, restitution 0",
        "  pairs       friction 0.25, restitution 0.75",
        "  gravity     (0.5, -9, 0.25) m/s^2 + z 0.125 cos(3 t + 0.75)",
        "  force       (4, 0, 1) N on crate from 0.125 to 0.25 s", "  step        0.002 s, 0.5 s in all",
        "  k           6 edges of the friction polygon (ap)", "  rotate_cone friction directions turned by 0.25 rad",
        "  bound       off (convex)", "  parameter   push = 4: force on the crate (a number, at least 0, N) [3]",
        "  reference   missing", "  robot       arm: 1 links, 1 degrees of freedom",
        "  control     out of contact the explicit step of the robots' torques is stable up to h = 0.2 s",
        "  contacts    5 at the start, on 2 pairs of shapes", "  left out    controllers: none",
        "  left out    1 fixed shapes from contact problems: they do not move"}) {
    INFO(line);
    CHECK(has_line(result.out, line));
  }
}

TEST_CASE("of several robots check names the one that a controller drives", "[program]") {
  const TemporaryDirectory directory;
  std::string scene = read_file(stress + "stiff_joints.xml");
  scene.insert(scene.find("    <robot name=\"train\">"),
               R"(<robot name="idle"><link name="third" mass="1" position="5 0 0" inertia="1 1 1"/>
      <joint name="three" kind="prismatic" parent="world" child="third" axis="1 0 0"/></robot>
)");
  std::ofstream(directory.path() / "two.xml") << scene;
  const Result result = run(directory.path(), {"check", "two.xml"});
  INFO(result.out << result.err);
  REQUIRE(result.code == 0);
  CHECK(has_line(result.out, "  robot       idle: 1 links, 1 degrees of freedom"));
  CHECK(has_line(result.out, "  robot       train: 2 links, 2 degrees of freedom"));
  const std::string summary_of = listed(directory.path(), "controllers").at("computed_torque")["summary"];
  CHECK(has_line(result.out, "  controller  computed_torque of train: " + summary_of));
}

TEST_CASE("check says which ways of stepping fit a scene and a method", "[program]") {
  const TemporaryDirectory directory;
  write_scene(directory.path());
  const auto notes = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "check");
    arguments.emplace_back("--json");
    return said(directory.path(), arguments)["stepping"];
  };
  const std::string accuracy = "--accuracy A (m): steps as long as the error lets them be";
  const std::string polygon = "; slip that turns switches from facet to facet";
  const std::string bounces = "; impacts are located, bounces too low to matter at A are left out and counted";
  const auto with = [&](const std::string& scene, const std::string& method) {
    return std::vector<std::string>{scene, "--steps", "0", "--method", method};
  };
  CHECK(notes({"sticking_box.xml"}) == Json({accuracy}));
  CHECK(notes({"yard.xml"}) == Json({accuracy + bounces}));
  CHECK(notes(with("yard.xml", "ap")) == Json({accuracy + polygon + bounces}));
  CHECK(notes(with("sticking_box.xml", "convex")) == Json({accuracy}));
  CHECK(notes(with("yard.xml", "newton"))[0].get<std::string>().starts_with("--accuracy is none of newton's: "));
  // Eight bodies that can meet each other are many; the ground is none.
  CHECK(notes({"stack.xml", "--set", "boxes=7"}) == Json({accuracy}));
  CHECK(notes({"stack.xml", "--set", "boxes=8"}) ==
        Json({accuracy, "--stepping steps: 8 bodies can meet each other; one problem a step, first order"}));
}

TEST_CASE("check warns of a box that should tip by its own friction and its own width over height", "[program]") {
  const TemporaryDirectory directory;
  // The low box tips beyond mu = 1/2, the tall one beyond 1/4. Beside them a ball, which never does, and a smooth wall.
  const auto notes = [&](const std::string& low, const std::string& tall) {
    std::ofstream(directory.path() / "two.xml")
        << R"(<scenario title="two boxes">
  <simulation step="1e-3" duration="0.1"/><reference kind="missing"/><gravity constant="0 -9.8 0"/>
  <bodies><half_space name="ground" point="0 0 0" normal="0 1 0"/>
    <half_space name="wall" point="-9 0 0" normal="1 0 0"/>
    <sphere name="ball" radius="0.5" mass="1" position="9 0.5 0"/>
    <box name="low" size="2 1 2" mass="1" position="0 0.5 0"/>
    <box name="tall" size="2 4 1" mass="1" position="5 2 0"/></bodies>
  <contacts><pair a="ball" b="ground" mu="9"/><pair a="low" b="ground" mu=")"
        << low << R"("/><pair a="tall" b="ground" mu=")" << tall
        << R"("/><pair a="low" b="wall" mu="0.1"/><pair a="tall" b="wall" mu="0.1"/></contacts></scenario>)";
    return said(directory.path(), {"check", "two.xml", "--method", "convex", "--steps", "0", "--json"})["notes"];
  };
  CHECK(notes("0.49", "0.24").empty());
  REQUIRE(notes("0.49", "0.26").size() == 1);
  CHECK(notes("0.49", "0.26")[0] ==
        "with the compression bound a box that should tip slides: tall tips before it slides where friction (0.26) is "
        "above width over height (0.25 on its narrowest base); ap or --compression-bound off tip it");
  CHECK(notes("0.51", "0.24")[0].get<std::string>().find("low tips before it slides where friction (0.51)") !=
        std::string::npos);
}

TEST_CASE("a law is claimed by the methods that list it, a solver by its own, and options say their defaults",
          "[program]") {
  const TemporaryDirectory directory;
  const auto laws = listed(directory.path(), "laws"), methods = listed(directory.path(), "methods"),
             solvers = listed(directory.path(), "solvers");
  for (const auto& [law, method] : {std::pair("newton", "newton"),
                                    {"mirtich", "mirtich"},
                                    {"anitescu_potra", "ap"},
                                    {"convex", "convex"},
                                    {"coulomb", "coulomb"},
                                    {"soft", "soft"}}) {
    INFO(law);
    CHECK(laws.at(law)["methods"] == Json({method}));
    CHECK(laws.at(law)["summary"] == std::string("claimed by ") + method);
    for (const Json& solver : methods.at(method)["solvers"]) {
      INFO(solver);
      CHECK(solvers.at(solver)["method"].is_string());
    }
  }
  CHECK(methods.at("newton")["variants"] == Json({"uncapped", "stick-tested"}));
  CHECK(methods.at("soft")["variants"] == Json({"sap", "mujoco"}));
  CHECK(methods.at("newton")["no_expansion"].is_string());
  CHECK(methods.at("ap")["no_expansion"].is_null());
  CHECK(solvers.at("lemke")["method"] == "ap");
  CHECK(solvers.at("ipm")["method"] == "convex");
  CHECK(solvers.at("nsgs")["method"] == "coulomb");
  std::map<std::string, Json> options;
  for (const Json& option : methods.at("convex")["options"]) options[option["flag"]] = option;
  CHECK(options.at("epsilon")["unit"] == "J");
  CHECK(options.at("epsilon")["default"] == "1e-12");
  CHECK(options.at("epsilon")["short"] == "eps");
  CHECK(options.at("compression-bound")["default"] == "on");
  for (const auto& [name, method] : methods) {
    INFO(name);
    CHECK(method["summary"] != method["source"]);
    CHECK_FALSE(method["source"].get<std::string>().empty());
  }
  CHECK(listed(directory.path(), "outside").count("external") == 1);
  // The lines for people end with whose a solver is.
  const Result plain = run(directory.path(), {"list", "solvers"});
  for (const auto& [solver, method] : {std::pair("lemke", "(ap)"), {"ipm", "(convex)"}, {"admm", "(coulomb)"}})
    CHECK(has_line(plain.out, solver + std::string(width_of(solvers) - std::string(solver).size() + 2, ' ') +
                                  solvers.at(solver)["summary"].get<std::string>() + ' ' + method));
}

TEST_CASE("scenes, references and controllers are listed with what belongs to each", "[program]") {
  const TemporaryDirectory directory;
  const auto scenes = listed(directory.path(), "scenarios");
  CHECK(scenes.at("sticking_box.xml")["reference"] == "analytic");
  CHECK(scenes.at("brick_wall.xml")["reference"] == "missing");
  CHECK(scenes.at("circular_sliding.xml")["parameters"] ==
        Json({{"start", "steady"}, {"mu", "0.02"}, {"rotate_cone", "0"}}));
  CHECK(scenes.at("circular_sliding.xml")["summary"] == "A box slides in a circle");
  CHECK(fs::path(scenes.at("stack.xml")["file"].get<std::string>()).filename() == "stack.xml");
  const auto references = listed(directory.path(), "references");
  CHECK(references.at("stack")["errors"].size() == 6);
  CHECK(references.at("stack")["errors"]["tilt_linf_rad"] == "rad; largest angle turned by a body");
  const Result plain = run(directory.path(), {"list", "references"});
  CHECK(has_line(plain.out, "    tilt_linf_rad             rad; largest angle turned by a body"));
  const auto controllers = listed(directory.path(), "controllers");
  const Json& gains = controllers.at("computed_torque")["gains"];
  CHECK(gains["gains"] == "one of: computed, torque; default computed");
  for (const char* role : {"<track>", "<close>", "<track> amplitude", "<close> acceleration"}) {
    INFO(role);
    CHECK(gains.contains(role));
  }
  const Json& wheels = controllers.at("figure_eight")["gains"];
  CHECK(wheels["axle"].get<std::string>().find("default 0.3206") != std::string::npos);
  CHECK(wheels["kv"].get<std::string>().ends_with("needed") != wheels["kv"].get<std::string>().ends_with("default 0"));
  std::set<std::string> explanations;
  for (const auto& [name, status] : listed(directory.path(), "statuses")) explanations.insert(status["summary"]);
  CHECK(explanations.size() == 18);
}

TEST_CASE("commands that differ late have a folder each, and values that differ in signs that a name lacks",
          "[program]") {
  const TemporaryDirectory directory;
  const std::string long_command = "true " + std::string(60, 'x');
  for (const char* last : {"1", "2"})
    CHECK(run(directory.path(), {"run", "sticking_box.xml", "--method", "external", "--law", "coulomb", "--command",
                                 long_command + last, "--duration", "0.002", "--quiet"})
              .code == 3);
  const auto folders = fs::directory_iterator(directory.path() / "results/runs");
  CHECK(std::distance(begin(folders), end(folders)) == 2);
  for (const char* boxes : {"boxes=1*2", "boxes=4/2"})
    CHECK(
        run(directory.path(), {"run", "stack.xml", "--method", "ap", "--set", boxes, "--duration", "0.002", "--quiet"})
            .code == 0);
  const auto with_stacks = fs::directory_iterator(directory.path() / "results/runs");
  CHECK(std::distance(begin(with_stacks), end(with_stacks)) == 4);
}

TEST_CASE("each flag of a run is in the name of its folder and in its summary", "[program]") {
  const TemporaryDirectory directory;
  const fs::path runs = directory.path() / "results/runs";
  const auto of = [&](const std::string& name, std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "run");
    arguments.emplace_back("--quiet");
    const Result result = run(directory.path(), arguments);
    INFO(result.err);
    CHECK(result.code == 0);
    INFO(name);
    REQUIRE(fs::exists(runs / name / "summary.json"));
    return summary(runs / name);
  };
  const Json json =
      of("sticking_box__newton__stick-tested__h0.002__T0.008__mu0.75__e0.25__every2__prune-off__perturb1e-09seed3__"
         "shuffle4__gyroscopic-explicit",
         {"sticking_box.xml",
          "--method",
          "newton",
          "--variant",
          "stick-tested",
          "--step",
          "2e-3",
          "--duration",
          "8e-3",
          "--friction",
          "0.75",
          "--restitution",
          "0.25",
          "--record-every",
          "2",
          "--prune",
          "off",
          "--perturb",
          "1e-9",
          "--seed",
          "3",
          "--shuffle-contacts",
          "4",
          "--gyroscopic",
          "explicit",
          "--time-limit",
          "60",
          "--memory-limit",
          "4000"});
  const Json& options = json["options"];
  for (const auto& [key, value] : std::map<std::string, double>{{"step", 2e-3},
                                                                {"duration", 8e-3},
                                                                {"friction", 0.75},
                                                                {"restitution", 0.25},
                                                                {"record_every", 2},
                                                                {"perturb", 1e-9},
                                                                {"seed", 3},
                                                                {"shuffle_contacts", 4},
                                                                {"time_limit_s", 60},
                                                                {"memory_limit_mb", 4000}}) {
    INFO(key);
    CHECK(options[key] == value);
  }
  CHECK(json["requested"] == Json({{"method", "newton"}, {"solver", nullptr}, {"variant", "stick-tested"}}));
  CHECK(json["variant"] == "stick-tested");
  const Json accurate = of("sticking_box__convex__ipm__eps1e-14__A1e-05__p3__dt0.5__T0.002",
                           {"sticking_box.xml", "--method", "convex", "--accuracy", "1e-5", "--order", "3", "--epsilon",
                            "1e-14", "--record-interval", "0.5", "--duration", "2e-3"});
  CHECK(accurate["options"]["accuracy"] == 1e-5);
  CHECK(accurate["options"]["record_interval"] == 0.5);
  CHECK(accurate["accuracy"]["order"] == 3);
  of("sticking_box__ap__lemke__k8__steps__T0.002",
     {"sticking_box.xml", "--method", "ap", "--stepping", "steps", "--duration", "2e-3"});
  const Json joints =
      of("stiff_joints__convex__ipm__eps1e-12__T0.002__joints-implicit",
         {stress + "stiff_joints.xml", "--method", "convex", "--joint-forces", "implicit", "--duration", "2e-3"});
  CHECK(joints["options"]["joint_forces"] == "implicit");
}

TEST_CASE("a run whose joints are too stiff for its step is warned of it, with the step that is not", "[program]") {
  const TemporaryDirectory directory;
  const auto warning = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {
        "run", stress + "stiff_joints.xml", "--method", "ap", "--duration", "0.1", "--out", "r", "--quiet"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run(directory.path(), arguments).err;
  };
  // 2 / sqrt((3 + sqrt 5) / 2 1e3) = 0.0391 s.
  CHECK(warning({"--step", "0.05"}) ==
        "contactbench run: warning: out of contact the explicit step of the robots' torques is unstable at h = 0.05 s; "
        "it is stable up to --step 0.0391, or with --joint-forces implicit\n");
  CHECK(summary(directory.path() / "r")["control"]["stable"] == false);
  CHECK(warning({"--step", "0.025"}).empty());
  CHECK(summary(directory.path() / "r")["control"]["stable"] == true);
  CHECK(warning({"--step", "0.05", "--joint-forces", "implicit"}).empty());
}

TEST_CASE("conditioning is measured where it is asked for: of a box on its corners", "[program]") {
  const TemporaryDirectory directory;
  const std::vector<std::string> start = {"run",  "sticking_box.xml", "--method", "ap", "--duration",
                                          "0.01", "--quiet",          "--out",    "r"};
  REQUIRE(run(directory.path(), start).code == 0);
  CHECK(summary(directory.path() / "r")["conditioning"].is_null());
  std::vector<std::string> asked = start;
  asked.emplace_back("--conditioning");
  REQUIRE(run(directory.path(), asked).code == 0);
  const Json found = summary(directory.path() / "r")["conditioning"];
  CHECK(found["rows"] == 12);
  CHECK(found["freedoms"] == 6);
  CHECK(found["rank"] == 6);
  CHECK(found["t"] == 0);
  CHECK(found["measured"] == 2);  // the first, and the first of the hundreds that are like it
}

TEST_CASE("a run some of whose answers do not hold counts them, names the worst, and keeps its problem", "[program]") {
  const TemporaryDirectory directory;
  const Result result =
      run(directory.path(), {"run", "stack.xml", "--set", "boxes=4", "--method", "coulomb", "--solver", "nsgs",
                             "--sweeps", "3", "--duration", "0.02", "--out", "r", "--quiet"});
  INFO(result.err);
  CHECK(result.code == 0);
  const Json json = summary(directory.path() / "r");
  CHECK(json["status"] == "inaccurate");
  CHECK(json["finished"] == true);
  double worst = 0, worst_t = 0;
  int inaccurate = 0, events = 0;
  const auto rows = lines(read_file(directory.path() / "r" / "steps.csv"));
  for (std::size_t i = 1; i < rows.size(); ++i) {
    const auto row = cells(rows[i]);
    CHECK(row[2] == "1");
    ++events;
    const double residual = std::stod(row[8]);
    CHECK(row[6] == (residual > 1e-9 ? "inaccurate" : "ok"));
    if (residual > 1e-9) ++inaccurate;
    if (residual <= worst) continue;
    worst = residual;
    worst_t = std::stod(row[1]) - 1e-3;  // the event is at the start of the step
  }
  REQUIRE(inaccurate > 1);
  CHECK(json["residuals"]["inaccurate_events"] == inaccurate);
  CHECK(json["residuals"]["max"] == worst);
  const std::string reason = json["reason"];
  CHECK(reason.starts_with(std::to_string(inaccurate) + " of " + std::to_string(events) +
                           " events beyond what is accepted; the worst: checked residual "));
  CHECK(std::stod(reason.substr(reason.find("residual ") + 9)) == Approx(worst).epsilon(1e-2));
  CHECK(std::stod(reason.substr(reason.rfind("t = ") + 4)) == Approx(worst_t).margin(1e-12));
  if (json["hard_problem"].is_null()) return;  // a build without HDF5
  const std::string command = json["hard_problem_command"];
  CHECK(command.starts_with(
      "contactbench solve r/hard_problem.hdf5 --kind contact --method coulomb --solver nsgs --sweeps 3"));
  // A shell takes r[1] for r1 where there is one.
  run(directory.path(), {"run", "stack.xml", "--set", "boxes=4", "--method", "coulomb", "--solver", "nsgs", "--sweeps",
                         "3", "--duration", "0.02", "--out", "r[1]", "--quiet"});
  const std::string of_folder = summary(directory.path() / "r[1]")["hard_problem_command"];
  CHECK(of_folder.starts_with("contactbench solve 'r[1]/hard_problem.hdf5' --kind contact"));
}

TEST_CASE("a run tells in lines what its summary says, and where its files are", "[program]") {
  const TemporaryDirectory directory;
  const Result result =
      run(directory.path(), {"run", "sticking_box.xml", "--method", "ap", "--duration", "0.01", "--out", "here"});
  REQUIRE(result.code == 0);
  const auto all = lines(result.out);
  const Json json = summary(directory.path() / "here");
  CHECK(all[0] == "sticking_box: ap, lemke: ok");
  CHECK(all[1] == "  reached     0.01 of 0.01 s in 10 steps of 0.001 s, 10 events, at most 4 contacts");
  CHECK(all.back() == "  files       here");
  CHECK(has_line(result.out, "  errors      against the analytic reference sticking_box"));
  for (const auto& error : json["errors"].items())
    CHECK(result.out.find("    " + error.key() + ' ') != std::string::npos);
}

TEST_CASE("stored problems are numbered by the events that they are of", "[program]") {
  const TemporaryDirectory directory;
  const Result result =
      run(directory.path(), {"run", "sticking_box.xml", "--method", "ap", "--duration", "0.01", "--out", "r", "--quiet",
                             "--save-problems", "kept", "--save-every", "4"});
  if (result.code == 2) return;  // a build without HDF5
  auto names = content(directory.path() / "kept");
  std::sort(names.begin(), names.end());
  CHECK(names == std::vector<std::string>{"event_000000001.hdf5", "event_000000005.hdf5", "event_000000009.hdf5"});
}
