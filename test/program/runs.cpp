// What a run leaves behind.

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <set>

#include "program/program.h"

using namespace program;

namespace {

const char* trajectory_header = "t,body,px,py,pz,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz";
const char* steps_header =
    "step,t,events,contacts,size,iterations,status,claimed_residual,residual,law_residual,gap,infeasibility,"
    "event_energy_gain,max_penetration,kinetic_energy,potential_energy,dynamics_s,collision_s,assembly_s,solve_s,"
    "step_s";

/// Removes what two runs with the same input may differ in.
void strip(Json& json) {
  if (!json.is_object()) return;
  for (auto entry = json.begin(); entry != json.end();) {
    const std::string& key = entry.key();
    if (key.ends_with("_s") || key == "peak_memory_mb") {
      entry = json.erase(entry);
    } else {
      strip(entry.value());
      ++entry;
    }
  }
}

/// A CSV file without the columns that end in _s.
std::string strip_csv(const std::string& text) {
  std::string out;
  std::vector<bool> keep;
  for (const std::string& line : lines(text)) {
    const auto row = cells(line);
    if (keep.empty())
      for (const std::string& column : row) keep.push_back(!column.ends_with("_s"));
    for (std::size_t i = 0; i < row.size(); ++i)
      if (keep[i]) out += row[i] + ',';
    out += '\n';
  }
  return out;
}

}  // namespace

TEST_CASE("a scene is found by its name from any folder and its files go to a folder named after the run",
          "[program]") {
  TemporaryDirectory directory;
  const Result result =
      run(directory.path(), {"run", "sticking_box.xml", "--method", "ap", "--solver", "lemke", "--k", "8", "--duration",
                             "0.05", "--friction", "0.8", "--set", "rotate_cone=0.1"});
  INFO(result.err);
  REQUIRE(result.code == 0);
  CHECK(result.err.empty());  // redirected: no progress
  const fs::path out = directory.path() / "results/runs/sticking_box__ap__lemke__k8__T0.05__mu0.8__rotate_cone0.1";
  CHECK(fs::exists(out / "trajectory.csv"));
  CHECK(fs::exists(out / "steps.csv"));
  const Json json = summary(out);
  CHECK(json["scenario"] == "sticking_box");
  CHECK(json["method"] == "ap");
  CHECK(json["solver"] == "lemke");
  CHECK(json["requested"]["solver"] == "lemke");
  CHECK(json["used"]["solver"] == "lemke");
  CHECK(json["options"]["k"] == 8);
  CHECK(json["options"]["friction"] == 0.8);
  CHECK(json["options"]["duration"] == 0.05);
  CHECK(json["options"]["rotate_cone"] == 0.1);
  CHECK(json["status"] == "ok");
  CHECK(json["reason"].is_null());
  CHECK(json["finished"] == true);
  CHECK(json["steps"] == 50);
  CHECK(json["t_reached"] == 0.05);
  CHECK(json["contacts_max"] == 4);
  CHECK(json["residuals"]["max"].get<double>() <= 1e-9);
  CHECK(json["residuals"]["false_claims"] == 0);
  CHECK(json["reference"]["kind"] == "analytic");
  CHECK_FALSE(json["errors"].empty());
  CHECK(json["peak_memory_mb"].get<double>() > 1);
  CHECK(result.out.find("sticking_box") != std::string::npos);
}

TEST_CASE("the default folder tells methods and their accuracy apart", "[program]") {
  TemporaryDirectory directory;
  const auto start = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"run", "sticking_box.xml", "--quiet", "--duration", "0.002", "--method"});
    const Result result = run(directory.path(), more);
    INFO(result.err);
    CHECK(result.code == 0);
    CHECK(result.out.empty());
  };
  start({"ap"});
  start({"ap", "--k", "4"});
  start({"convex"});
  start({"convex", "--epsilon", "0.01"});
  start({"convex", "--epsilon-relative", "1e-6", "--compression-bound", "off"});
  start({"newton", "--step", "0.0005"});
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(directory.path() / "results" / "runs"))
    names.insert(entry.path().filename().string());
  CHECK(names == std::set<std::string>{"sticking_box__ap__lemke__k8__T0.002", "sticking_box__ap__lemke__k4__T0.002",
                                       "sticking_box__convex__ipm__eps1e-12__T0.002",
                                       "sticking_box__convex__ipm__eps0.01__T0.002",
                                       "sticking_box__convex__ipm__epsrel1e-06__bound-off__T0.002",
                                       "sticking_box__newton__uncapped__h0.0005__T0.002"});
}

TEST_CASE("the files have the columns of the contract and a row for each body and step", "[program]") {
  TemporaryDirectory directory;
  const Result result = run(directory.path(), {"run", "stack.xml", "--method", "convex", "--set", "boxes=3",
                                               "--duration", "0.02", "--out", "here/and/there", "--quiet"});
  INFO(result.err);
  REQUIRE(result.code == 0);
  CHECK(result.out.empty());
  const fs::path out = directory.path() / "here/and/there";
  const auto trajectory = lines(read_file(out / "trajectory.csv"));
  REQUIRE(trajectory.size() == 1 + 3 * 21);
  CHECK(trajectory[0] == trajectory_header);
  for (const std::string& line : trajectory) REQUIRE(cells(line).size() == 15);
  CHECK(cells(trajectory[1])[0] == "0");
  CHECK(cells(trajectory.back())[0] == "0.02");
  const auto steps = lines(read_file(out / "steps.csv"));
  REQUIRE(steps.size() == 1 + 20);
  CHECK(steps[0] == steps_header);
  const std::size_t columns = cells(steps[0]).size();
  for (std::size_t i = 1; i < steps.size(); ++i) {
    const auto row = cells(steps[i]);
    REQUIRE(row.size() == columns);
    CHECK(row[0] == std::to_string(i));
    CHECK(row[6] == "ok");
    CHECK(row[3] == "12");         // contacts: four an interface
    CHECK_FALSE(row[10].empty());  // gap: this method has one
    for (const std::string& cell : row) CHECK(cell.find_first_of("nN") != 0);
  }
  CHECK(summary(out)["parameters"]["boxes"] == 3);
}

TEST_CASE("a method without a duality gap leaves its cells empty", "[program]") {
  TemporaryDirectory directory;
  REQUIRE(run(directory.path(),
              {"run", "sticking_box.xml", "--method", "ap", "--duration", "0.003", "--out", "r", "--quiet"})
              .code == 0);
  for (const std::string& line : lines(read_file(directory.path() / "r" / "steps.csv"))) {
    const auto row = cells(line);
    if (row[0] == "step") continue;
    CHECK(row[10].empty());
    CHECK(row[11].empty());
  }
  CHECK(summary(directory.path() / "r")["residuals"]["gap_max_j"].is_null());
}

TEST_CASE("two runs with the same input write the same bytes but for times and memory", "[program]") {
  for (const std::vector<std::string>& method :
       {std::vector<std::string>{"ap", "--k", "8"}, std::vector<std::string>{"convex"}}) {
    TemporaryDirectory directory;
    for (const char* out : {"one", "two"}) {
      std::vector<std::string> arguments = {
          "run", "circular_sliding.xml", "--duration", "0.2", "--quiet", "--out", out, "--method"};
      arguments.insert(arguments.end(), method.begin(), method.end());
      REQUIRE(run(directory.path(), arguments).code == 0);
    }
    const fs::path one = directory.path() / "one", two = directory.path() / "two";
    CHECK(read_file(one / "trajectory.csv") == read_file(two / "trajectory.csv"));
    CHECK(strip_csv(read_file(one / "steps.csv")) == strip_csv(read_file(two / "steps.csv")));
    Json a = summary(one), b = summary(two);
    strip(a);
    strip(b);
    CHECK(a.dump(2) == b.dump(2));
  }
}

TEST_CASE("a run over an earlier one leaves nothing of it", "[program]") {
  TemporaryDirectory directory;
  const auto start = [&](const char* duration, const char* every) {
    REQUIRE(run(directory.path(), {"run", "sticking_box.xml", "--method", "ap", "--duration", duration,
                                   "--record-every", every, "--out", "r", "--quiet"})
                .code == 0);
  };
  start("0.05", "1");
  start("0.01", "1");
  CHECK(lines(read_file(directory.path() / "r" / "steps.csv")).size() == 11);
  CHECK(summary(directory.path() / "r")["steps"] == 10);
  start("0.01", "4");
  const auto steps = lines(read_file(directory.path() / "r" / "steps.csv"));
  REQUIRE(steps.size() == 3);
  CHECK(cells(steps[2])[0] == "8");
  CHECK(lines(read_file(directory.path() / "r" / "trajectory.csv")).size() == 4);
  start("0.01", "0");
  CHECK(content(directory.path() / "r") == std::vector<std::string>{"summary.json"});
  CHECK(summary(directory.path() / "r")["steps"] == 10);
}

TEST_CASE("push and polygon turned together turn the motion, and a turned polygon deflects as its exact answer does",
          "[program]") {
  TemporaryDirectory directory;
  const auto errors = [&](const std::string& push, const std::string& cone) {
    const Result result = run(
        directory.path(), {"run", "sliding_box.xml", "--method", "ap", "--k", "8", "--step", "1e-2", "--record-every",
                           "0", "--set", "push_angle=" + push, "--set", "rotate_cone=" + cone, "--quiet", "--json"});
    REQUIRE(result.code == 0);
    return Json::parse(result.out)["errors"];
  };
  CHECK(errors("0.2", "0.2")["position_linf_m"].get<double>() < 1e-3);  // 0.040 h is the step's
  CHECK(errors("0.2", "-0.2")["position_final_m"].get<double>() > 0.1);
  // Between the axes of the polygon the box leaves the line of the push: the side counts.
  CHECK(errors("0", "pi/16")["polygon_position_linf_m"].get<double>() < 5e-3);
  CHECK(errors("0", "-pi/16")["polygon_position_linf_m"].get<double>() < 5e-3);
}

TEST_CASE("overriding friction changes whether the box holds", "[program]") {
  // tan 30 = 0.577: at mu = 0.3 the box slides off with g (sin 30 - 0.3 cos 30) = 2.354 m/s^2.
  TemporaryDirectory directory;
  REQUIRE(run(directory.path(), {"run", "sticking_box.xml", "--method", "convex", "--friction", "0.3", "--duration",
                                 "0.1", "--out", "r", "--quiet"})
              .code == 0);
  const auto last = cells(lines(read_file(directory.path() / "r" / "trajectory.csv")).back());
  const double vx = std::stod(last[9]), vy = std::stod(last[10]);
  const double a = 9.8 * (0.5 - 0.3 * std::sqrt(0.75));
  CHECK(std::hypot(vx, vy) == Approx(a * 0.1).epsilon(1e-6));
}

TEST_CASE("friction and restitution given on the command line hold for every pair of the scene", "[program]") {
  // Two boxes slide apart on one floor, each in a pair with a coefficient of its own; with 0.25 both lose 0.25 g t.
  TemporaryDirectory directory;
  std::ofstream(directory.path() / "two.xml") << R"(<scenario title="two pairs">
  <simulation step="1e-3" duration="0.1"/><reference kind="missing"/><gravity constant="0 -9.8 0"/>
  <bodies>
    <half_space name="floor" point="0 0 0" normal="0 1 0"/>
    <box name="left" size="1 1 1" mass="1" position="-2 0.5 0" velocity="-1 0 0"/>
    <box name="right" size="1 1 1" mass="1" position="2 0.5 0" velocity="1 0 0"/>
  </bodies>
  <contacts><pair a="left" b="floor" mu="0.5"/><pair a="right" b="floor" mu="0.75"/></contacts>
</scenario>
)";
  REQUIRE(run(directory.path(),
              {"run", "two.xml", "--method", "ap", "--friction", "0.25", "--restitution", "0", "--out", "r", "--quiet"})
              .code == 0);
  const std::vector<std::string> rows = lines(read_file(directory.path() / "r" / "trajectory.csv"));
  const double left = std::stod(cells(rows[rows.size() - 2])[9]), right = std::stod(cells(rows.back())[9]);
  CHECK(left == Approx(-(1 - 0.25 * 9.8 * 0.1)).epsilon(1e-12));
  CHECK(right == Approx(1 - 0.25 * 9.8 * 0.1).epsilon(1e-12));
}

TEST_CASE("a tumbling box keeps its energy, and gains it where the paper's explicit step is asked for", "[program]") {
  TemporaryDirectory directory;
  std::ofstream(directory.path() / "tumble.xml") << R"(<scenario title="tumbling">
  <simulation step="4e-3" duration="1"/><reference kind="missing"/><gravity constant="0 0 0"/>
  <bodies><box name="box" size="1 2 3" mass="1" position="0 0 0" angular_velocity="0.3 30 0.3"/></bodies>
  <contacts/>
</scenario>
)";
  const auto growth = [&](const std::vector<std::string>& flags, const char* said) {
    std::vector<std::string> arguments = {"run", "tumble.xml", "--method", "ap", "--out", "r", "--quiet"};
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    REQUIRE(run(directory.path(), arguments).code == 0);
    CHECK(summary(directory.path() / "r")["options"]["gyroscopic"] == said);
    const std::vector<std::string> rows = lines(read_file(directory.path() / "r" / "steps.csv"));
    const std::vector<std::string> names = cells(rows.front());
    const auto at = std::find(names.begin(), names.end(), "kinetic_energy") - names.begin();
    return std::stod(cells(rows.back())[at]) / std::stod(cells(rows[1])[at]);
  };
  CHECK(growth({}, "implicit") == Approx(1).epsilon(1e-12));
  CHECK(growth({"--gyroscopic", "implicit"}, "implicit") == Approx(1).epsilon(1e-12));
  CHECK(growth({"--gyroscopic", "explicit"}, "explicit") > 1.05);
}

TEST_CASE("pruning says what it left out, and the sphere hits the ground as without it", "[program]") {
  TemporaryDirectory directory;
  std::vector<std::vector<std::string>> last;
  for (const char* prune : {"on", "off"}) {
    REQUIRE(run(directory.path(), {"run", "impacting_sphere.xml", "--method", "ap", "--duration", "0.1", "--prune",
                                   prune, "--out", prune, "--quiet"})
                .code == 0);
    last.push_back(cells(lines(read_file(directory.path() / prune / "trajectory.csv")).back()));
    CHECK(summary(directory.path() / prune)["options"]["prune"] == prune);
  }
  const Json on = summary(directory.path() / "on"), off = summary(directory.path() / "off");
  CHECK(off["left_out"].empty());
  REQUIRE_FALSE(on["left_out"].empty());
  CHECK(on["left_out"][0]["what"] == "solver calls for single contacts with a closed form");
  CHECK(on["left_out"][0]["count"] == on["solves"]);  // each event is one contact of a sphere
  CHECK(on["events"].get<int>() > 10);
  for (std::size_t i = 2; i < last[0].size(); ++i)
    CHECK(std::stod(last[0][i]) == Approx(std::stod(last[1][i])).margin(1e-10));
}

TEST_CASE("what rests is solved once where that is asked for, and each step has its row", "[program]") {
  TemporaryDirectory directory;
  REQUIRE(run(directory.path(), {"run", "sticking_box.xml", "--method", "ap", "--duration", "0.02", "--prune", "rest",
                                 "--quiet", "--record-contacts"})
              .code == 0);
  const std::filesystem::path folder = directory.path() / "results/runs/sticking_box__ap__lemke__k8__T0.02__prune-rest";
  const Json rest = summary(folder);
  CHECK(rest["options"]["prune"] == "rest");
  CHECK(rest["events"] == 20);
  CHECK(rest["solves"] == 1);
  CHECK(rest["left_out"].back()["what"] == "events of what rests");
  CHECK(rest["left_out"].back()["count"] == 19);
  CHECK(lines(read_file(folder / "steps.csv")).size() == 1 + 20);
  CHECK(lines(read_file(folder / "contacts.csv")).size() == 1 + 20 * 4);
}

TEST_CASE("islands solved on several cores leave the files of one", "[program]") {
  TemporaryDirectory directory;
  const std::string scene = std::string(SOURCE_ROOT) + "/bench/scenes/boxes.xml";
  for (const char* method : {"ap", "convex"}) {
    for (const char* jobs : {"1", "2", "5"})
      REQUIRE(run(directory.path(), {"run", scene, "--set", "boxes=40", "--method", method, "--perturb", "1e-3",
                                     "--duration", "0.01", "--jobs", jobs, "--out", jobs, "--quiet"})
                  .code == 0);
    const Json one = summary(directory.path() / "1");
    for (const char* jobs : {"2", "5"}) {
      INFO(method << " --jobs " << jobs);
      CHECK(read_file(directory.path() / jobs / "trajectory.csv") == read_file(directory.path() / "1/trajectory.csv"));
      const Json several = summary(directory.path() / jobs);
      CHECK(several["options"]["jobs"] == std::stoi(jobs));
      for (const char* same :
           {"status", "events", "solves", "iterations_total", "left_out", "residuals", "answered_by"})
        CHECK(several[same] == one[same]);
    }
  }
}

TEST_CASE("convex says whose answer was taken in each event, and others, which try one way, do not", "[program]") {
  TemporaryDirectory directory;
  for (const char* method : {"convex", "ap"})
    REQUIRE(run(directory.path(), {"run", "sticking_box.xml", "--method", method, "--duration", "0.5", "--step", "0.01",
                                   "--out", method, "--quiet"})
                .code == 0);
  const Json convex = summary(directory.path() / "convex"), &answered = convex["answered_by"];
  long islands = 0;
  for (const auto& item : answered.items()) islands += item.value().get<long>();
  CHECK(islands == convex["solves"].get<long>());  // one box
  REQUIRE(answered.contains("sticking"));          // that sticks
  CHECK(answered["sticking"].get<long>() == islands);
  CHECK(summary(directory.path() / "ap")["answered_by"].is_null());
}

TEST_CASE("the summary on standard output is the one in the file", "[program]") {
  TemporaryDirectory directory;
  const Result result =
      run(directory.path(), {"run", "sliding_box.xml", "--method", "ap", "--duration", "0.01", "--out", "r", "--json"});
  REQUIRE(result.code == 0);
  CHECK(Json::parse(result.out) == summary(directory.path() / "r"));
  CHECK(result.out == read_file(directory.path() / "r" / "summary.json"));
}

TEST_CASE("check says what a scene has without writing anything", "[program]") {
  TemporaryDirectory directory;
  const Result result =
      run(directory.path(), {"check", "stack.xml", "--set", "boxes=5", "--set", "mu=0.5", "--method", "convex"});
  INFO(result.err << result.out);
  REQUIRE(result.code == 0);
  for (const char* part : {"5 box", "half_space", "20 at the start", "friction 0.5",
                           "boxes = 5: number of boxes (an integer, from 1 to 100000) [16]",
                           "mu = 0.5: Coulomb friction between boxes, and between box and ground "
                           "(a number, at least 0) [0.5]",
                           "(0, -9.8, 0)", "left out", "controllers: none", "convex", "100 steps"})
    CHECK(result.out.find(part) != std::string::npos);
  CHECK(content(directory.path()).empty());
}

TEST_CASE("check says what the compression bound forbids in a scene, to who asks for convex with it", "[program]") {
  TemporaryDirectory directory;
  const auto notes = [&](const std::vector<std::string>& arguments) {
    const Result result = run(directory.path(), arguments);
    INFO(result.err);
    REQUIRE(result.code == 0);
    return std::pair(result.out.find("should tip slides") != std::string::npos,
                     result.out.find("no more friction than the pusher's own") != std::string::npos);
  };
  const std::vector<std::string> tall = {"check", "tipping_box.xml", "--steps", "0", "--method"},
                                 row = {"check", "pushed_block.xml", "--steps", "0", "--method"};
  const auto with = [](std::vector<std::string> arguments, const std::vector<std::string>& more) {
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  };
  CHECK(notes(with(tall, {"convex"})) == std::pair(true, false));
  CHECK(notes(with(tall, {"ap"})) == std::pair(false, false));
  CHECK(notes(with(tall, {"convex", "--set", "mu=0.4"})) == std::pair(false, false));  // slides before it tips
  CHECK(notes(with(row, {"convex"})) == std::pair(false, true));
  CHECK(notes(with(row, {"ap"})) == std::pair(false, false));
  for (const char* held : {"sticking_box.xml", "stack.xml", "sliding_box.xml"})
    CHECK(notes({"check", held, "--steps", "0", "--method", "convex"}) == std::pair(false, false));
  CHECK(notes({"check", "urdf_arm.xml", "--steps", "0", "--method", "convex"}) ==
        std::pair(false, false));  // bound off
  // Whichever of what a block meets stands last, the one that pushes it or the ground.
  std::string scene = read_file(SOURCE_ROOT "/scenarios/pushed_block.xml");
  const std::string ground = "    <half_space name=\"ground\" point=\"0 0 0\" normal=\"0 1 0\"/>\n";
  REQUIRE(scene.find(ground) != std::string::npos);
  scene.erase(scene.find(ground), ground.size());
  scene.insert(scene.find("  </bodies>"), ground);
  std::ofstream(directory.path() / "ground_last.xml") << scene;
  CHECK(notes({"check", "ground_last.xml", "--steps", "0", "--method", "convex"}) == std::pair(false, true));
}

TEST_CASE("every scene that comes with the program is valid", "[program]") {
  TemporaryDirectory directory;
  const Result listed = run(directory.path(), {"list", "scenarios", "--json"});
  REQUIRE(listed.code == 0);
  const Json scenes = Json::parse(listed.out);
  CHECK(scenes.size() >= 5);
  for (const Json& scene : scenes) {
    const Result checked = run(directory.path(), {"check", scene["name"].get<std::string>()});
    INFO(checked.err);
    CHECK(checked.code == 0);
    CHECK(checked.out.find(scene["summary"].get<std::string>()) != std::string::npos);
  }
}

TEST_CASE("what check says will be left out is what a run leaves out, in every scene", "[program]") {
  TemporaryDirectory directory;
  const Json scenes = Json::parse(run(directory.path(), {"list", "scenarios", "--json"}).out);
  bool any = false;
  for (const Json& scene : scenes)
    for (const char* method : {"newton", "mirtich", "ap", "convex"}) {
      const auto name = scene["name"].get<std::string>();
      INFO(name << ", " << method);
      std::vector<std::string> check = {"check", name, "--method", method, "--steps", "10"};
      // One impact at a time, in a wall of 100 bricks: a minute.
      const std::vector<std::string> smaller = {"--set", "bricks=12"};
      if (name == "brick_wall.xml") check.insert(check.end(), smaller.begin(), smaller.end());
      const Result checked = run(directory.path(), check);
      const double step = std::stod(checked.out.substr(checked.out.find("  step ") + 7));
      std::vector<std::string> start = {
          "run",   name, "--method",       method, "--duration", fmt::format("{}", 10 * step),
          "--out", "r",  "--record-every", "0",    "--quiet"};
      if (name == "brick_wall.xml") start.insert(start.end(), smaller.begin(), smaller.end());
      const Result ran = run(directory.path(), start);
      INFO(ran.err);
      CHECK(checked.code == ran.code);
      std::set<std::string> said, counted;
      const auto from = checked.out.find("  trial ");
      REQUIRE(from != std::string::npos);
      for (const std::string& line : lines(checked.out.substr(from)))
        if (line.starts_with("  left out ") && line.find("nothing else") == std::string::npos)
          said.insert(line.substr(line.find_first_not_of(' ', 11)));
      const Json left_out = summary(directory.path() / "r")["left_out"];
      for (const Json& item : left_out)
        counted.insert(fmt::format("{} {}", item["count"].get<long>(), item["what"].get<std::string>()));
      REQUIRE(said.size() == counted.size());
      for (const std::string& item : counted) {
        INFO(item);
        const auto told = std::find_if(said.begin(), said.end(), [&](const std::string& line) {
          return line.starts_with(item + ": ") && line.size() > item.size() + 2;  // and why
        });
        CHECK(told != said.end());
      }
      any = any || !counted.empty();
    }
  CHECK(any);
}

TEST_CASE("list names what is here", "[program]") {
  TemporaryDirectory directory;
  const auto names = [&](const char* topic) {
    const Result result = run(directory.path(), {"list", topic, "--json"});
    INFO(result.err);
    REQUIRE(result.code == 0);
    std::set<std::string> out;
    for (const Json& row : Json::parse(result.out)) {
      CHECK(row["summary"].is_string());
      out.insert(row["name"].get<std::string>());
    }
    // The plain form has a line for each.
    const Result plain = run(directory.path(), {"list", topic});
    for (const std::string& name : out) CHECK(plain.out.find(name) != std::string::npos);
    CHECK(plain.out.find("unavailable: )") == std::string::npos);  // not without a reason
    return out;
  };
  const auto has = [](const std::set<std::string>& all, std::initializer_list<const char*> some) {
    for (const char* name : some) CHECK(all.contains(name));
  };
  has(names("methods"), {"newton", "mirtich", "ap", "convex"});
  has(names("solvers"), {"lemke", "ipm"});
  has(names("references"), {"sliding_box", "sticking_box"});
  CHECK(names("statuses") == std::set<std::string>{"ok", "inaccurate", "nonconverged", "ray", "cycling", "singular",
                                                   "not_finite", "energy_blowup", "penetration", "interrupted",
                                                   "write_failed", "event_stall", "time_limit", "memory_limit", "crash",
                                                   "unavailable", "unsupported", "input_error"});
  const Result all = run(directory.path(), {"list", "--json"});
  REQUIRE(all.code == 0);
  const Json topics = Json::parse(all.out);
  for (const char* topic : {"methods", "solvers", "scenarios", "references", "statuses"})
    CHECK(topics[topic].is_array());
  CHECK(run(directory.path(), {"list"}).code == 0);
}

TEST_CASE("an installed program lists the scenes that came with it, and nothing else beside them", "[program]") {
  TemporaryDirectory directory;
  const fs::path installed = directory.path() / "bin" / "contactbench";
  const fs::path scenes = directory.path() / "share" / "contactbench" / "scenarios";
  fs::create_directories(installed.parent_path());
  fs::create_directories(scenes / "kept.xml");
  fs::copy_file(PROGRAM, installed);
  fs::copy_file(SOURCE_ROOT "/scenarios/sticking_box.xml", scenes / "sticking_box.xml");
  std::ofstream(scenes / "README") << "scenes\n";
  const fs::path listed = directory.path() / "list.json";
  REQUIRE(std::system(("'" + installed.string() + "' list scenarios --json > '" + listed.string() + "'").c_str()) == 0);
  const Json list = Json::parse(read_file(listed));
  REQUIRE(list.size() == 1);
  CHECK(list[0]["name"] == "sticking_box.xml");
  // One that cannot be read is among them, with why, and hides none.
  std::ofstream(scenes / "broken.xml") << "<scenario title=\"broken\">";
  REQUIRE(std::system(("'" + installed.string() + "' list scenarios --json > '" + listed.string() + "'").c_str()) == 0);
  const Json both = Json::parse(read_file(listed));
  REQUIRE(both.size() == 2);
  CHECK(both[0]["summary"].get<std::string>().starts_with("cannot be read: "));
  CHECK(both[0]["summary"].get<std::string>().find("broken.xml:1:") != std::string::npos);
  CHECK(both[1] == list[0]);
}

TEST_CASE("help and version are answers, not errors", "[program]") {
  TemporaryDirectory directory;
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"--help"}, std::vector<std::string>{"run", "--help"},
        std::vector<std::string>{"check", "--help"}, std::vector<std::string>{"list", "--help"},
        std::vector<std::string>{"--version"}}) {
    const Result result = run(directory.path(), arguments);
    CHECK(result.code == 0);
    CHECK(result.out.find("contactbench") != std::string::npos);
    CHECK(result.err.empty());
  }
  const std::string version = run(directory.path(), {"--version"}).out;
  CHECK(version.find(fmt::format("; Eigen {}.{}.{}, ", EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION,
                                 EIGEN_MINOR_VERSION)) != std::string::npos);
}
