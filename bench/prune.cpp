// What leaving out saves where it applies, and costs where it does not: steps of two simulations of one scene, which
// differ in one thing, in turns. CPU time of the thread, smallest of many batches; ratios are what counts.
//   bench_prune              two tables, as text
//   bench_prune FILE.csv     besides, their rows as a file (scripts/contactbench/sections.py)

#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <fstream>
#include <string>
#include <vector>

#include "simulation/left_out.h"

namespace {

using namespace cb;

/// What a side of a comparison leaves out.
struct Setting {
  bool problem = true;  ///< hand the method less than the whole problem, as `contact` says
  PruneOptions contact;
  StepPruning step;
  bool corners = true, warm_start = false;
};

struct Case {
  std::string what, scene;
  Overrides overrides;
  std::string method;
  Setting with, without;
  int skip = 50;    ///< steps before measuring
  int steps = 200;  ///< in a batch
  std::string label;
};

double cpu_us() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
}

struct Side {
  Side(const Scenario& scenario, const MethodRow& row, const Setting& setting) : left_out(std::make_shared<LeftOut>()) {
    SimulationOptions options;
    options.step = scenario.step;
    options.duration = 1e9 * scenario.step;
    MethodOptions method;
    if (scenario.k) method.k = *scenario.k;
    method.warm_start = setting.warm_start;
    options.prune = setting.step;
    if (setting.corners) options.prune.corners = row.law.leave_out(row.terms(method)).corners;
    simulation = std::make_unique<Simulation>(
        scenario, options, setting.problem ? pruned(row, method, left_out, setting.contact) : row.make(method),
        row.law);
  }
  /// us a step
  double batch(int steps) {
    const double start = cpu_us();
    for (int i = 0; i < steps; ++i) {
      const StepRecord& record = simulation->step();
      if (record.status != Status::ok) status = record.status;
    }
    const double us = (cpu_us() - start) / steps;
    best = std::min(best, us);
    return us;
  }
  std::shared_ptr<LeftOut> left_out;
  std::unique_ptr<Simulation> simulation;
  double best = HUGE_VAL;
  Status status = Status::ok;
};

struct Row {
  Case of;
  double with = 0, without = 0;  ///< us a step
  Status status = Status::ok;
};

Row measure(const Case& c) {
  const Scenario scenario = load_scenario(find_scenario(c.scene), c.overrides);
  const MethodRow& row = *find_method(c.method);
  Side with(scenario, row, c.with), without(scenario, row, c.without);
  for (Side* side : {&with, &without}) {
    side->batch(c.skip);
    side->best = HUGE_VAL;
  }
  // Enough batches for the smallest to be undisturbed, but not for long.
  constexpr int most = 40;
  constexpr double budget_us = 5e5;
  double spent = 0;
  for (int i = 0; i < most && spent < budget_us; ++i) spent += (with.batch(c.steps) + without.batch(c.steps)) * c.steps;
  return {c, with.best, without.best, std::max(with.status, without.status)};
}

const Setting nothing = {false, {}, {Corners::differ, false, false, false}, false};
const std::string boxes = SOURCE_ROOT "/bench/scenes/boxes.xml",
                  grid = SOURCE_ROOT "/scenarios/stress/contact_grid.xml";

std::vector<Case> speed() {
  std::vector<Case> all;
  for (const std::string method : {"ap", "convex"}) {
    Setting warm, cold_plain = nothing;
    warm.warm_start = true;
    const auto add = [&](std::string label, std::string scene, Overrides overrides, const Setting& with, int skip,
                         int steps) {
      all.push_back(
          {"", std::move(scene), std::move(overrides), method, with, cold_plain, skip, steps, std::move(label)});
    };
    add("sticking box (warm)", "sticking_box.xml", {}, warm, 50, 500);
    add("1 box", boxes, {{"boxes", "1"}}, {}, 50, 200);
    add("1 box (warm)", boxes, {{"boxes", "1"}}, warm, 50, 500);
    if (method == "convex") {
      add("200 boxes", boxes, {{"boxes", "200"}}, {}, 3, 3);
      add("200 boxes (warm)", boxes, {{"boxes", "200"}}, warm, 3, 3);
    }
    add("box on 4 points (warm)", grid, {{"n", "2"}}, warm, 50, 200);
    if (method == "convex") add("box on 1024 points (warm)", grid, {{"n", "32"}}, warm, 3, 20);
    if (method == "convex") add("stack of 64 (warm)", "stack.xml", {{"boxes", "64"}}, warm, 10, 10);
    add("sliding box (pushed)", "sliding_box.xml", {}, {}, 1500, 200);
    add("stack of 16", "stack.xml", {{"boxes", "16"}}, {}, 3, 5);
    add("arm from a URDF file", "urdf_arm.xml", {}, {}, 100, 100);
  }
  // Lemke's method on all of it at once takes minutes: beside warm starts alone, not beside the plain way.
  Setting warm, plain_warm = nothing;
  warm.warm_start = plain_warm.warm_start = true;
  Setting apart = nothing;
  apart.problem = true;
  all.push_back({"", boxes, {{"boxes", "200"}}, "ap", {}, apart, 3, 3, "200 boxes (off: islands apart)"});
  all.push_back({"", boxes, {{"boxes", "200"}}, "ap", warm, apart, 3, 10, "200 boxes (warm; off: islands apart)"});
  all.push_back({"", grid, {{"n", "32"}}, "ap", warm, {}, 20, 200, "box on 1024 points (warm; off: warm)"});
  all.push_back({"", "stack.xml", {{"boxes", "64"}}, "ap", warm, plain_warm, 3, 5, "stack of 64 (warm; off: warm)"});
  return all;
}

std::vector<Case> ablation() {
  std::vector<Case> all;
  struct Item {
    const char* what;
    void (*leave_in)(Setting&);
    std::string scene;
    Overrides overrides;
    std::vector<std::string> methods;
    bool warm, repeats = false;
  };
  const std::vector<Item> items = {
      {"islands solved apart", [](Setting& s) { s.contact.islands = false; }, boxes, {{"boxes", "8"}}, {"ap"}, false},
      {"single contacts with a closed form",
       [](Setting& s) { s.contact.closed_forms = false; },
       "impacting_sphere.xml",
       {},
       {"ap", "convex"},
       false},
      {"coplanar contacts", [](Setting& s) { s.corners = false; }, grid, {{"n", "8"}}, {"ap", "convex"}, false},
      {"unknowns of friction where mu = 0",
       [](Setting& s) { s.contact.idle_friction = false; },
       "stack.xml",
       {{"boxes", "16"}, {"mu", "0"}},
       {"ap"},
       false},
      {"searches for pairs",
       [](Setting& s) { s.step.pair_searches = false; },
       "stack.xml",
       {{"boxes", "16"}},
       {"ap", "convex"},
       true},
      {"searches for times of contact",
       [](Setting& s) { s.step.contact_times = false; },
       "stack.xml",
       {{"boxes", "16"}},
       {"convex"},
       true},
      {"cold solves (warm start)",
       [](Setting& s) { s.warm_start = false; },
       "stack.xml",
       {{"boxes", "16"}},
       {"ap", "convex"},
       true},
      {"cold solves (warm start)",
       [](Setting& s) { s.warm_start = false; },
       "sticking_box.xml",
       {},
       {"ap", "convex"},
       true},
      {"events of what rests",
       [](Setting& s) { s.step.repeats = false; },
       "stack.xml",
       {{"boxes", "16"}},
       {"ap", "convex"},
       true,
       true}};
  for (const Item& item : items) {
    Setting with, without;
    with.warm_start = without.warm_start = item.warm;
    with.step.repeats = item.repeats;
    without.step = with.step;
    item.leave_in(without);
    for (const std::string& method : item.methods)
      all.push_back({item.what, item.scene, item.overrides, method, with, without, 10,
                     item.scene == "stack.xml" ? 5 : 50, "saves"});
    if (with.warm_start != without.warm_start) continue;  // there is no scene in motion without use for a warm start
    // Where nothing can be left out; the sliding box comes to rest in the end.
    const char* none = item.repeats ? "circular_sliding.xml" : "sliding_box.xml";
    for (const std::string& method : item.methods)
      all.push_back({item.what, none, {}, method, with, without, 1500, 200, "costs"});
  }
  return all;
}

std::string scene_name(const Case& c) {
  const std::size_t slash = c.scene.rfind('/'), from = slash == std::string::npos ? 0 : slash + 1;
  std::string name = c.scene.substr(from, c.scene.rfind('.') - from);
  for (const auto& [key, value] : c.overrides) name += fmt::format(" {}={}", key, value);
  return name;
}

}  // namespace

int main(int argc, char** argv) {
  std::ofstream file;
  if (argc > 1) {
    file.open(argv[1]);
    file << "table,what,scene,method,with_us,without_us,ratio,status\n";
  }
  const auto keep = [&](const char* table, const std::string& what, const Row& row) {
    if (!file.is_open()) return;
    file << fmt::format("{},{},{},{},{:.3f},{:.3f},{:.3f},{}\n", table, what, scene_name(row.of), row.of.method,
                        row.with, row.without, row.with / row.without, name(row.status));
    file.flush();
  };
  fmt::print("A step with pruning on and off (cold unless it says warm; off is cold), us of CPU time\n");
  fmt::print("{:<48}{:<8}{:>10}{:>12}{:>8}  {}\n", "scene", "method", "on", "off", "on/off", "status");
  for (const Case& c : speed()) {
    const Row row = measure(c);
    fmt::print("{:<48}{:<8}{:>10.2f}{:>12.2f}{:>8.3f}  {}\n", c.label, c.method, row.with, row.without,
               row.with / row.without, name(row.status));
    std::fflush(stdout);
    keep("speed", c.label, row);
  }
  fmt::print("\nEach thing left out: a step with it left out and left in, us of CPU time\n");
  fmt::print("{:<38}{:<26}{:<8}{:>10}{:>12}{:>8}  {}\n", "what", "scene", "method", "out", "in", "out/in", "status");
  for (const Case& c : ablation()) {
    const Row row = measure(c);
    fmt::print("{:<38}{:<26}{:<8}{:>10.2f}{:>12.2f}{:>8.3f}  {}\n", c.what, scene_name(c), c.method, row.with,
               row.without, row.with / row.without, name(row.status));
    std::fflush(stdout);
    keep(c.label.c_str(), c.what, row);
  }
  return 0;
}
