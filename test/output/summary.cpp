#include "output/summary.h"

#include <sys/resource.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cerrno>
#include <csignal>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>

#include "output/machine.h"
#include "temporary.h"

using namespace cb;
using Json = nlohmann::json;

TEST_CASE("the median of few numbers is exact, of many it is known to 1/64", "[output]") {
  StreamMedian median;
  CHECK_FALSE(median.median().has_value());
  for (const double x : {3.0, 1.0, 2.0}) median.add(x);
  CHECK(median.median() == 2.0);
  median.add(0);
  CHECK(median.median() == 1.5);

  // Numbers over thirty decades, in two orders, so many that the histogram takes over.
  std::mt19937 random(7);
  std::uniform_real_distribution<double> decade(-30, 0);
  std::vector<double> numbers(3 * StreamMedian::kept);
  for (double& x : numbers) x = std::pow(10, decade(random));
  StreamMedian forward, sorted;
  for (const double x : numbers) forward.add(x);
  std::sort(numbers.begin(), numbers.end());
  for (const double x : numbers) sorted.add(x);
  CHECK(forward.median() == sorted.median());
  CHECK(*forward.median() == Approx(numbers[numbers.size() / 2]).epsilon(1.0 / 64));
}

TEST_CASE("the median of mostly exact answers is zero", "[output]") {
  StreamMedian median;
  for (std::size_t i = 0; i < 2 * StreamMedian::kept; ++i) median.add(i % 3 == 0 ? 1e-12 : 0);
  CHECK(median.median() == 0.0);
}

TEST_CASE("the median survives the ends of the number line", "[output]") {
  StreamMedian median;
  for (std::size_t i = 0; i <= StreamMedian::kept; ++i) median.add(1e300);
  median.add(1e-320);
  REQUIRE(median.median().has_value());
  CHECK(std::isfinite(*median.median()));
  CHECK(*median.median() > 1e30);
}

TEST_CASE("a tally keeps the largest displacement, penetration and bounce, whenever it was", "[output]") {
  RunTally tally;
  for (const double size : {1.0, 3.0, 2.0}) {
    StepRecord record;
    record.max_penetration = size;
    record.penetration_inside = 2 * size;
    record.penetration_displacement = 3 * size;
    record.bounce_speed = 4 * size;
    record.bounce_distance = 5 * size;
    tally.observe_step(record, true);
  }
  CHECK(tally.penetration_max == 3);
  CHECK(tally.penetration_inside_max == 6);
  CHECK(tally.penetration_displacement_max == 9);
  CHECK(tally.bounce_speed_max == 12);
  CHECK(tally.bounce_distance_max == 15);
  CHECK(tally.penetration_removals == 3);
}

TEST_CASE("memory is told in units of 2^20 bytes, as the system tells it", "[output]") {
  std::ifstream status("/proc/self/status");
  double told = 0;  // kB, of 2^10 bytes
  for (std::string word; status >> word;)
    if (word == "VmHWM:") status >> told;
  if (told == 0) return;  // not on this system
  CHECK(peak_memory_mb() == Approx(told / 1024).epsilon(0.2));
}

TEST_CASE("the machine is called what the system calls it, without quotes or spaces around", "[output]") {
  const Machine here = machine();
  const auto first_of = [](const char* file, const std::string& key) {
    std::ifstream in(file);
    for (std::string line; std::getline(in, line);)
      if (line.compare(0, key.size(), key) == 0) return line;
    return std::string();
  };
  const std::string model = first_of("/proc/cpuinfo", "model name"),
                    pretty = first_of("/etc/os-release", "PRETTY_NAME");
  if (!model.empty()) CHECK(model.ends_with(": " + here.cpu));
  CHECK(here.cpu.find_first_of("\":") == std::string::npos);
  if (!pretty.empty()) CHECK(pretty.find(here.os.substr(0, here.os.find(", "))) != std::string::npos);
  CHECK(here.os.find("Linux ") != std::string::npos);
  CHECK(here.os.find('"') == std::string::npos);
  CHECK(here.cores >= 1);
  CHECK(peak_memory_beyond(0.5));
  CHECK_FALSE(peak_memory_beyond(1e6));
}

TEST_CASE("a tally adds counts up and keeps the worst of the rest", "[output]") {
  RunTally tally;
  CHECK_FALSE(tally.residual_max.has_value());
  StepRecord record;
  record.step = 1;
  record.t = 0.5;
  tally.observe_step(record, true);
  CHECK_FALSE(tally.residual_max.has_value());  // no event, no residual

  record.t = 1;
  record.events = record.solves = 1;
  record.false_claims = 2;
  record.doubted = 3;
  record.contacts = 4;
  record.iterations = 5;
  record.residual = 1e-12;
  record.gap = -3e-13;
  record.times.solve_s = 0.25;
  tally.observe_step(record, true);
  record.t = 1.5;
  record.residual = 1e-15;
  record.gap = 2e-13;
  tally.observe_step(record, true);
  record.t = 2;
  record.residual = std::numeric_limits<double>::quiet_NaN();
  record.gap.reset();
  tally.observe_step(record, false);

  CHECK(tally.steps == 3);
  CHECK(tally.t_reached == 1.5);
  CHECK(tally.events == 3);
  CHECK(tally.solves == 3);
  CHECK(tally.iterations == 15);
  CHECK(tally.false_claims == 6);
  CHECK(tally.doubted == 9);
  CHECK(tally.contacts_max == 4);
  CHECK(tally.residual_max == 1e-12);
  CHECK(tally.residual_max_t == 1);
  CHECK(tally.gap_max == -3e-13);
  CHECK(tally.times.solve_s == Approx(0.75));
  CHECK_FALSE(tally.law_max.has_value());
}

namespace {

RunSummary some_summary() {
  RunSummary summary;
  summary.scenario = "sticking_box";
  summary.file = "sticking_box.xml";
  summary.parameters = {{"boxes", "8"}, {"start", "steady"}};
  summary.used = {"ap", "lemke", ""};
  summary.requested = {"ap", "", ""};
  summary.method_options.k = 8;
  summary.method_flags = {"k"};
  summary.errors = {{"creep", 1e-12}, {"undefined", std::numeric_limits<double>::quiet_NaN()}};
  return summary;
}

}  // namespace

TEST_CASE("the summary is JSON with every field of the contract", "[output]") {
  const Json json = Json::parse(to_json(some_summary()));
  for (const char* field :
       {"scenario", "method",           "solver",   "requested",    "used",     "options", "status",   "reason",
        "steps",    "events",           "time",     "contacts_max", "solves",   "errors",  "energy",   "peak_memory_mb",
        "left_out", "iterations_total", "finished", "t_reached",    "versions", "machine", "residuals"})
    CHECK(json.contains(field));
  for (const char* field : {"total_s", "dynamics_s", "collision_s", "assembly_s", "solve_s", "write_s"})
    CHECK(json["time"].contains(field));
  for (const char* field : {"max", "median", "false_claims"}) CHECK(json["residuals"].contains(field));
  for (const char* field : {"max_gain_j", "max_gain_relative"}) CHECK(json["energy"].contains(field));
  for (const char* field : {"contactbench", "git", "compiler", "flags", "eigen", "suitesparse"})
    CHECK(json["versions"].contains(field));
  for (const char* field : {"cpu", "cores", "os"}) CHECK(json["machine"].contains(field));
}

TEST_CASE("each number of a tally stands in its own place of the summary", "[output]") {
  RunSummary summary = some_summary();
  RunTally& tally = summary.tally;
  double next = 0;
  const auto number = [&next](auto& x) { x = static_cast<std::decay_t<decltype(x)>>(++next); };
  const auto some = [&next](std::optional<double>& x) { x = ++next; };
  std::vector<std::pair<const char*, double>> places;
  const auto put = [&](const char* place, auto& x) {
    if constexpr (std::is_same_v<std::decay_t<decltype(x)>, std::optional<double>>)
      some(x);
    else
      number(x);
    places.emplace_back(place, next);
  };
  put("/steps", tally.steps);
  put("/t_reached", tally.t_reached);
  put("/events", tally.events);
  put("/solves", tally.solves);
  put("/iterations_total", tally.iterations);
  put("/contacts_max", tally.contacts_max);
  put("/residuals/false_claims", tally.false_claims);
  put("/residuals/inaccurate_events", tally.inaccurate_events);
  put("/residuals/doubted", tally.doubted);
  put("/residuals/max", tally.residual_max);
  put("/residuals/claimed_max", tally.claimed_max);
  put("/residuals/law_max", tally.law_max);
  put("/residuals/gap_max_j", tally.gap_max);
  put("/residuals/infeasibility_max", tally.infeasibility_max);
  put("/energy/max_gain_j", tally.gain_max);
  put("/energy/max_gain_relative", tally.gain_relative_max);
  put("/max_penetration", tally.penetration_max);
  put("/penetration/inside_steps_m", tally.penetration_inside_max);
  put("/penetration/removals", tally.penetration_removals);
  put("/penetration/largest_displacement_m", tally.penetration_displacement_max);
  put("/restitution/bounces_left_out", tally.bounces_left_out);
  put("/restitution/largest_speed_m_per_s", tally.bounce_speed_max);
  put("/restitution/largest_distance_m", tally.bounce_distance_max);
  put("/restitution/scaled_events", tally.scaled_events);
  put("/restitution/least_scale", tally.restitution_scale_min);
  put("/time/total_s", tally.times.step_s);
  put("/time/dynamics_s", tally.times.dynamics_s);
  put("/time/collision_s", tally.times.collision_s);
  put("/time/assembly_s", tally.times.assembly_s);
  put("/time/solve_s", tally.times.solve_s);
  put("/time/write_s", summary.write_s);
  put("/time/wall_s", summary.wall_s);
  put("/peak_memory_mb", summary.peak_memory_mb);
  tally.conditioning = Conditioning{};
  put("/conditioning/condition", tally.conditioning->condition);
  put("/conditioning/rank", tally.conditioning->rank);
  put("/conditioning/rows", tally.conditioning->rows);
  put("/conditioning/freedoms", tally.conditioning->freedoms);
  put("/conditioning/t", tally.conditioning_t);
  put("/conditioning/measured", tally.measured_events);
  put("/conditioning/too_large", tally.too_large);
  const Json json = Json::parse(to_json(summary));
  for (const auto& [place, value] : places) {
    INFO(place);
    CHECK(json.at(Json::json_pointer(place)) == value);
  }
}

TEST_CASE("what a run does not have is null in its summary, never 0 and never NaN", "[output]") {
  const std::string text = to_json(some_summary());
  const Json json = Json::parse(text);
  CHECK(json["residuals"]["max"].is_null());
  CHECK(json["energy"]["max_gain_j"].is_null());
  CHECK(json["errors"]["creep"] == 1e-12);
  CHECK(json["errors"]["undefined"].is_null());
  CHECK(json["options"]["k"] == 8);
  CHECK(json["options"]["epsilon"].is_null());  // ap has no use for it
  CHECK(json["options"]["friction"].is_null());
  CHECK(json["requested"]["solver"].is_null());
  CHECK(json["used"]["solver"] == "lemke");
  CHECK(json["parameters"]["boxes"] == 8);
  CHECK(json["parameters"]["start"] == "steady");
  CHECK(text.find("nan") == std::string::npos);
}

TEST_CASE("an epsilon that is relative stands alone", "[output]") {
  RunSummary summary = some_summary();
  summary.method_flags = {"epsilon", "epsilon-relative"};
  Json json = Json::parse(to_json(summary));
  CHECK(json["options"]["epsilon"] == 1e-12);
  CHECK(json["options"]["epsilon_relative"].is_null());
  summary.method_options.epsilon_relative = 1e-9;
  json = Json::parse(to_json(summary));
  CHECK(json["options"]["epsilon"].is_null());
  CHECK(json["options"]["epsilon_relative"] == 1e-9);
}

TEST_CASE("bytes that are no text in a file's name do not cost the summary", "[output]") {
  RunSummary summary = some_summary();
  summary.file = "scene\xff.xml";
  CHECK(Json::accept(to_json(summary)));
}

TEST_CASE("the place of the summary is valid before, and holds the final one on a full disk", "[output]") {
  TemporaryDirectory directory;
  const auto path = directory.path() / "summary.json";
  const std::string provisional = to_json(some_summary());
  SummaryFile file(path, provisional);
  REQUIRE(file.ok());
  CHECK(Json::parse(read_file(path)) == Json::parse(provisional));

  // From here on no file may grow beyond what this one has already.
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit before;
  REQUIRE(getrlimit(RLIMIT_FSIZE, &before) == 0);
  rlimit small = before;
  small.rlim_cur = std::filesystem::file_size(path);
  REQUIRE(setrlimit(RLIMIT_FSIZE, &small) == 0);
  RunSummary last = some_summary();
  last.status = Status::write_failed;
  for (int i = 0; i < 50; ++i) last.errors.emplace_back("some_error_with_a_long_name_" + std::to_string(i), 0.1 * i);
  const bool replaced = file.replace(to_json(last));
  REQUIRE(setrlimit(RLIMIT_FSIZE, &before) == 0);
  CHECK(replaced);
  CHECK(read_file(path) == to_json(last));
}

TEST_CASE("a summary without a place says so", "[output]") {
  SummaryFile full("/dev/full", "{}\n");
  CHECK(full.error() == ENOSPC);
  CHECK_FALSE(full.replace("{}\n"));
  TemporaryDirectory directory;
  SummaryFile nowhere(directory.path() / "nowhere" / "summary.json", "{}\n");
  CHECK(nowhere.error() == ENOENT);
  CHECK_FALSE(nowhere.replace("{}\n"));
}
