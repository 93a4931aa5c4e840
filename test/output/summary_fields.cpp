// Each thing that a summary says of a run stands in its own place, in JSON and in the lines for people.

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "output/summary.h"

using namespace cb;
using Json = nlohmann::json;

namespace {

struct Place {
  std::string where;
  Json value;
};

void check_places(const RunSummary& summary, const std::vector<Place>& places) {
  const Json json = Json::parse(to_json(summary));
  for (const auto& [where, value] : places) {
    INFO(where);
    CHECK(json.at(Json::json_pointer(where)) == value);
  }
}

std::vector<std::string> lines(const std::string& text) {
  std::vector<std::string> out;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = text.find('\n', at);
    out.push_back(text.substr(at, end - at));
    at = end + 1;
  }
  return out;
}

}  // namespace

TEST_CASE("each word of a summary stands in its own place", "[output]") {
  RunSummary summary;
  summary.scenario = "scene";
  summary.file = "file";
  summary.title = "title";
  summary.requested = {"method asked", "solver asked", "variant asked"};
  summary.used = {"method", "solver", "variant"};
  summary.versions = {"program", "git", "compiler", "flags", "eigen", "suitesparse"};
  summary.machine = {"cpu", 3, "os"};
  summary.status = Status::ray;
  summary.reason = "reason";
  summary.hard_problem = "problem";
  summary.hard_problem_command = "command";
  summary.reference_kind = "kind";
  summary.reference_name = "name";
  summary.parameters = {{"n", "2"}, {"word", "2 boxes"}, {"large", "1e999"}, {"negative", "-0.5"}, {"no", "nan"}};
  summary.errors = {{"first", 1}, {"second", 2}};
  summary.left_out = {{"this", 3}, {"that", 4}};
  summary.answered_by = {{"one", 5}, {"other", 6}};
  check_places(summary,
               {{"/scenario", "scene"},
                {"/file", "file"},
                {"/title", "title"},
                {"/method", "method"},
                {"/solver", "solver"},
                {"/variant", "variant"},
                {"/requested", {{"method", "method asked"}, {"solver", "solver asked"}, {"variant", "variant asked"}}},
                {"/used", {{"method", "method"}, {"solver", "solver"}, {"variant", "variant"}}},
                {"/versions",
                 {{"contactbench", "program"},
                  {"git", "git"},
                  {"compiler", "compiler"},
                  {"flags", "flags"},
                  {"eigen", "eigen"},
                  {"suitesparse", "suitesparse"}}},
                {"/machine", {{"cpu", "cpu"}, {"cores", 3}, {"os", "os"}}},
                {"/status", "ray"},
                {"/reason", "reason"},
                {"/hard_problem", "problem"},
                {"/hard_problem_command", "command"},
                {"/finished", false},
                {"/reference", {{"kind", "kind"}, {"name", "name"}}},
                {"/parameters", {{"n", 2}, {"word", "2 boxes"}, {"large", "1e999"}, {"negative", -0.5}, {"no", "nan"}}},
                {"/errors", {{"first", 1}, {"second", 2}}},
                {"/left_out", {{{"what", "this"}, {"count", 3}}, {{"what", "that"}, {"count", 4}}}},
                {"/answered_by", {{"one", 5}, {"other", 6}}}});
  CHECK_FALSE(Json::parse(to_json(summary)).contains("engine"));
  summary.finished = true;
  check_places(summary, {{"/finished", true}});
}

TEST_CASE("each option of a run stands in its own place of the summary", "[output]") {
  RunSummary summary;
  SimulationOptions& simulation = summary.simulation;
  simulation.step = 1;
  simulation.duration = 2;
  summary.restitution = 3;
  summary.friction = 4;
  summary.rotate_cone = 5;
  summary.record_every = 6;
  summary.method_options.threads = 7;
  summary.perturb = 8;
  summary.seed = 9;
  simulation.shuffle = 10;
  simulation.accepted_residual = 11;
  simulation.closed_gap = 12;
  simulation.approach = 13;
  simulation.event_cap = 14;
  simulation.blowup_factor = 15;
  simulation.blowup_energy = 16;
  simulation.penetration_limit = 17;
  simulation.penetration_bound = 18;
  summary.time_limit_s = 19;
  summary.memory_limit_mb = 20;
  int expected = 0;
  std::vector<Place> places;
  for (const char* key :
       {"step",         "duration",       "restitution",   "friction",         "rotate_cone",       "record_every",
        "jobs",         "perturb",        "seed",          "shuffle_contacts", "accepted_residual", "closed_gap",
        "approach",     "event_cap",      "blowup_factor", "blowup_energy_j",  "penetration_limit", "penetration_bound",
        "time_limit_s", "memory_limit_mb"})
    places.push_back({std::string("/options/") + key, ++expected});
  check_places(summary, places);
}

TEST_CASE("choices among words are said as the flags have them", "[output]") {
  RunSummary summary;
  SimulationOptions& simulation = summary.simulation;
  check_places(summary, {{"/options/prune", "on"}, {"/options/gyroscopic", "implicit"}});
  Json json = Json::parse(to_json(summary));
  for (const char* key : {"stepping", "joint_forces", "accuracy", "record_interval"})
    CHECK_FALSE(json["options"].contains(key));
  summary.prune = false;
  simulation.gyroscopic = Gyroscopic::explicit_euler;
  simulation.joint_forces = JointForces::implicit;
  simulation.stepping = Stepping::steps;
  check_places(summary, {{"/options/prune", "off"},
                         {"/options/gyroscopic", "explicit"},
                         {"/options/joint_forces", "implicit"},
                         {"/options/stepping", "steps"},
                         {"/options/step", 1e-3}});
  summary.prune = true;
  simulation.prune.repeats = true;
  simulation.stepping = Stepping::accuracy;
  simulation.accuracy = 0.25;
  simulation.record_interval = 0.5;
  check_places(summary, {{"/options/prune", "rest"},
                         {"/options/stepping", "accuracy"},
                         {"/options/step", nullptr},
                         {"/options/accuracy", 0.25},
                         {"/options/record_interval", 0.5}});
}

TEST_CASE("what stepping to an accuracy did stands in its own places", "[output]") {
  RunSummary summary;
  summary.simulation.accuracy = 1;
  AccuracyTally tally;
  tally.order = 2;
  tally.smallest_step = 3;
  tally.taken = 4;
  tally.refused = 5;
  tally.base_steps = 6;
  tally.base_solves = 7;
  tally.switches = 8;
  tally.impacts = 9;
  tally.first_order = 10;
  tally.noisy = 11;
  tally.shortest = 12;
  tally.longest = 13;
  tally.estimated_error = 14;
  summary.accuracy = tally;
  int expected = 0;
  std::vector<Place> places;
  for (const char* key :
       {"wanted_m", "order", "smallest_step_s", "macro_steps", "refused", "base_steps", "base_solves", "switches",
        "impacts", "first_order_steps", "noisy_steps", "shortest_s", "longest_s", "estimated_error_m"})
    places.push_back({std::string("/accuracy/") + key, ++expected});
  check_places(summary, places);
  summary.accuracy->taken = 0;  // no length where there was no step
  check_places(summary, {{"/accuracy/shortest_s", nullptr}, {"/accuracy/longest_s", nullptr}});
}

TEST_CASE("an engine stands in the summary with all of its knobs", "[output]") {
  RunSummary summary;
  summary.engine = EngineUse{"name", "version", "precision", "", "tuned", {{"a", 1}, {"b", 2}}};
  check_places(summary, {{"/engine",
                          {{"name", "name"},
                           {"version", "version"},
                           {"precision", "precision"},
                           {"package", nullptr},
                           {"setting", "tuned"},
                           {"knobs", {{"a", 1}, {"b", 2}}}}}});
}

TEST_CASE("a step is stable up to the largest that is", "[output]") {
  RunSummary summary;
  check_places(summary, {{"/control", nullptr}});
  summary.simulation.step = 0.25;
  summary.control_eigenvalue = 3;
  for (const double limit : {0.125, 0.25, 0.5}) {
    summary.largest_stable_step = limit;
    check_places(summary, {{"/control/largest_eigenvalue", 3},
                           {"/control/largest_stable_step", limit},
                           {"/control/stable", limit >= 0.25}});
  }
  summary.simulation.stepping = Stepping::accuracy;  // whose base steps are of any length
  check_places(
      summary,
      {{"/control/largest_eigenvalue", nullptr}, {"/control/largest_stable_step", 0.5}, {"/control/stable", nullptr}});
  summary.simulation.stepping = Stepping::events;
  summary.control_eigenvalue.reset();  // springs without a controller
  check_places(summary, {{"/control/largest_eigenvalue", nullptr}});
}

TEST_CASE("scene, method and its flags are described from what they are", "[output]") {
  Scenario scenario;
  scenario.name = "name";
  scenario.file = "file";
  scenario.title = "title";
  scenario.parameters = {{"a", "1"}};
  scenario.rotate_cone = 0.5;
  scenario.reference = {ReferenceKind::certified, "reference", {}};
  RunSummary summary;
  describe(scenario, summary);
  MethodOptions options;
  options.solver = "solver";
  options.variant = "variant";
  options.k = 6;
  options.regularise = 0.125;
  describe(*find_method("ap"), options, summary);
  CHECK(summary.machine.cores >= 1);
  CHECK_FALSE(summary.machine.cpu.empty());
  CHECK_FALSE(summary.machine.os.empty());
  check_places(summary, {{"/scenario", "name"},
                         {"/file", "file"},
                         {"/title", "title"},
                         {"/parameters", {{"a", 1}}},
                         {"/options/rotate_cone", 0.5},
                         {"/reference", {{"kind", "certified"}, {"name", "reference"}}},
                         {"/method", "ap"},
                         {"/solver", "solver"},
                         {"/variant", "variant"},
                         {"/requested", {{"method", "ap"}, {"solver", "solver"}, {"variant", "variant"}}},
                         {"/options/k", 6},
                         {"/options/regularise", 0.125},
                         {"/options/epsilon", nullptr}});
  CHECK_FALSE(Json::parse(to_json(summary))["options"].contains("command"));  // of another program alone
  CHECK(name(ReferenceKind::analytic) == "analytic");
  CHECK(name(ReferenceKind::missing) == "missing");
}

TEST_CASE("the lines for people say each number of a run by its name", "[output]") {
  RunSummary summary;
  summary.scenario = "scene";
  summary.used = {"method", "solver", ""};
  summary.status = Status::ok;
  summary.simulation.duration = 8;
  summary.simulation.step = 0.5;
  RunTally& tally = summary.tally;
  tally.t_reached = 4;
  tally.steps = 10;
  tally.events = 11;
  tally.contacts_max = 12;
  tally.times.step_s = 2;
  tally.times.solve_s = 1.5;
  summary.write_s = 0.25;
  tally.residual_max = 0.125;
  tally.residuals.add(0.0625);
  tally.false_claims = 13;
  tally.gain_max = 14;
  CHECK(lines(to_text(summary)) ==
        std::vector<std::string>{
            "scene: method, solver: ok", "  reached     4 of 8 s in 10 steps of 0.5 s, 11 events, at most 12 contacts",
            "  time        2 s simulating (1.5 s solving), 0.25 s writing; 2e+05 us a step; 2 times "
            "real time",
            "  residual    max 0.125, median 0.0625; 13 false claims", "  energy      largest gain of an event 14 J"});
  summary.used.variant = "variant";
  summary.status = Status::inaccurate;
  summary.reason = "reason";
  tally.gap_max = -15;
  tally.infeasibility_max = 16;
  summary.reference_kind = "analytic";
  summary.reference_name = "sliding_box";
  summary.errors = {{"short", 17}, {"much_longer", 18}};
  AccuracyTally accuracy;
  accuracy.estimated_error = 19;
  accuracy.order = 20;
  accuracy.base_solves = 21;
  accuracy.switches = 22;
  accuracy.impacts = 23;
  summary.accuracy = accuracy;
  summary.simulation.accuracy = 24;
  const auto all = lines(to_text(summary));
  REQUIRE(all.size() == 10);
  CHECK(all[0] == "scene: method, solver, variant: inaccurate: reason");
  CHECK(all[1] == "  reached     4 of 8 s in 10 steps, 11 events, at most 12 contacts");
  CHECK(all[2] == "  accuracy    24 m wanted, 19 m estimated; order 20, 21 base solves, 22 switches, 23 impacts");
  CHECK(all[5] == "  gap         -15 J, infeasibility 16");
  CHECK(all[7] == "  errors      against the analytic reference sliding_box");
  CHECK(all[8] == "    short        17");
  CHECK(all[9] == "    much_longer  18");
  // Of a run without a step there is nothing to divide by, and nothing was measured.
  CHECK(lines(to_text(RunSummary()))[3] == "  residual    max -, median -; 0 false claims");
}
