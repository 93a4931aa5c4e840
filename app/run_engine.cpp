#include "run_engine.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>

#include "commands.h"
#include "contact/problem_files.h"
#include "engines.h"
#include "evaluation/references.h"
#include "folder_lock.h"
#include "limits.h"
#include "output/number.h"
#include "output/summary.h"
#include "problem_folder.h"
#include "scenario/near_name.h"
#include "versions.h"

namespace cb {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

/// An engine with one of its variants and all its knobs.
struct Chosen {
  fs::path program;  ///< empty: not here
  std::string missing;
  std::string variant;
  EngineUse use;
};

/// --knob NAME=VALUE over what the setting has. Of the rows that tell of knobs, those of counts say from what on.
void own_knobs(const std::vector<std::string>& given, const Json& rows,
               std::map<std::string, double, std::less<>>& knobs) {
  std::vector<std::string> seen;
  for (const std::string& pair : given) {
    const std::size_t equals = pair.find('=');
    if (equals == std::string::npos) throw UsageError(fmt::format("--knob {}: must be NAME=VALUE", pair));
    const std::string key = pair.substr(0, equals);
    if (std::find(seen.begin(), seen.end(), key) != seen.end())
      throw UsageError(fmt::format("--knob {}: {} is given twice; leave one of them out", pair, key));
    seen.push_back(key);
    std::vector<std::string> known;
    for (const auto& knob : knobs) known.push_back(knob.first);
    const auto at = knobs.find(key);
    if (at == knobs.end())
      throw UsageError(fmt::format("--knob {}: no such knob; {}", key, suggest(key, known, "there are")));
    at->second = number_flag("knob", pair.substr(equals + 1), -HUGE_VAL, HUGE_VAL, "NAME=NUMBER");
    for (const Json& row : rows) {
      if (row.value("name", "") != key || !row.contains("count_from")) continue;
      const int least = row["count_from"], most = row.value("count_to", std::numeric_limits<int>::max());
      if (at->second != std::floor(at->second) || at->second < least || at->second > most)
        throw UsageError(fmt::format("--knob {}: must be a whole number from {} to {}", pair, least, most));
    }
  }
}

/// The engine that the flags name. Throws UsageError where it has no such variant, setting or knob.
Chosen choose(const std::string& name, const Text& variant, const Text& setting, const std::vector<std::string>& knob) {
  const std::vector<std::string> names = engine_names();
  if (std::find(names.begin(), names.end(), name) == names.end())
    throw UsageError(fmt::format("--engine {}: no such engine; {}", name, suggest(name, names, "there are")));
  if (setting && *setting != "default" && *setting != "tuned")
    throw UsageError(fmt::format("--setting {}: must be default or tuned", *setting));
  Chosen chosen;
  chosen.use.name = name;
  chosen.use.setting = setting.value_or("default");
  chosen.variant = variant.value_or("");
  chosen.program = engine_program(name);
  chosen.missing = engine_missing(name);
  if (chosen.program.empty()) return chosen;
  const Json said = describe_engine(chosen.program, chosen.missing);
  if (said.is_null()) {
    chosen.program.clear();
    return chosen;
  }
  chosen.use.version = said.value("version", "");
  chosen.use.precision = said.value("precision", "");
  chosen.use.package = said.value("package", "");
  std::vector<std::string> variants;
  for (const Json& row : said["variants"]) variants.push_back(row["name"]);
  if (chosen.variant.empty()) chosen.variant = variants.front();
  const auto at = std::find(variants.begin(), variants.end(), chosen.variant);
  if (at == variants.end())
    throw UsageError(fmt::format("--variant {}: {} has no such variant; {}", chosen.variant, name,
                                 suggest(chosen.variant, variants, "there are")));
  std::map<std::string, double, std::less<>> knobs = said["variants"][at - variants.begin()]["knobs"];
  if (chosen.use.setting == "tuned") {
    const Json tuned = tuned_knobs(name, chosen.variant);
    if (!tuned.is_object()) {
      chosen.program.clear();
      chosen.missing =
          fmt::format("nobody has searched for knobs of {}/{} (scripts/engines.py tune)", name, chosen.variant);
      return chosen;
    }
    for (const auto& [key, value] : tuned.items())
      if (const auto found = knobs.find(key); found != knobs.end()) found->second = value;
  }
  if (!knob.empty()) chosen.use.setting = "own";
  own_knobs(knob, said.value("knobs", Json::array()), knobs);
  chosen.use.knobs.assign(knobs.begin(), knobs.end());
  return chosen;
}

fs::path default_directory(const EngineRunFlags& flags, const Chosen& chosen, const std::string& scene) {
  std::string name = scene + "__" + flags.engine;
  const auto add = [&](const std::string& part) { name += "__" + file_name_part(part); };
  if (!chosen.variant.empty()) add(chosen.variant);
  if (chosen.use.setting != "default") add(chosen.use.setting);
  if (chosen.use.setting == "own" && flags.setting == "tuned") add("tuned");  // what the other knobs are of
  for (const auto& [prefix, value] :
       {std::pair("h", flags.step), std::pair("T", flags.duration), std::pair("mu", flags.friction),
        std::pair("e", flags.restitution), std::pair("perturb", flags.perturb), std::pair("seed", flags.seed),
        std::pair("every", flags.record_every)})
    if (value) add(prefix + *value);
  for (const auto& [key, value] : set_flags(flags.set)) add(key + value);
  for (const std::string& knob : flags.knob) add(knob);
  return fs::path("results") / "runs" / name;
}

struct EnginePlan {
  Chosen chosen;
  EngineRequest request;
  RunSummary summary;
  std::optional<double> memory_limit_mb;
};

EnginePlan make_plan(const EngineRunFlags& flags) {
  EnginePlan plan;
  EngineRequest& request = plan.request;
  constexpr const char* seconds = "a positive number of seconds";
  request.set = set_flags(flags.set);
  if (flags.friction)
    request.friction = number_flag("friction", *flags.friction, 0, HUGE_VAL, "a coefficient of at least 0");
  if (flags.restitution)
    request.restitution = number_flag("restitution", *flags.restitution, 0, 1, "a number from 0 to 1");
  if (flags.record_every)
    request.record_every = whole_flag("record-every", *flags.record_every, 0, 1L << 60,
                                      "a whole number of steps: 1 keeps every step, 0 none");
  if (flags.perturb)
    request.perturb = number_flag("perturb", *flags.perturb, 0, HUGE_VAL, "a length in m of at least 0");
  if (flags.seed) request.seed = whole_flag("seed", *flags.seed, 0, 1L << 60, "a whole number of at least 0");
  if (flags.time_limit) request.time_limit_s = positive_flag("time-limit", *flags.time_limit, seconds);
  if (flags.memory_limit)
    plan.memory_limit_mb = positive_flag("memory-limit", *flags.memory_limit, "a positive number of MB");
  if (flags.save_problems) {
    if (flags.save_problems->empty()) throw UsageError("--save-problems '': must name a directory");
    if (!fclib_available()) throw UsageError(fmt::format("--save-problems: {}", fclib_unavailable_reason()));
    request.save_problems = *flags.save_problems;
  }
  if (flags.save_every) {
    if (!flags.save_problems)
      throw UsageError(
          fmt::format("--save-every {}: says how often --save-problems DIR stores; give that too", *flags.save_every));
    request.save_every =
        whole_flag("save-every", *flags.save_every, 1, 1L << 60, "a whole number of steps, at least 1");
  }
  if (flags.out && flags.out->empty()) throw UsageError("--out '': must name a directory");
  plan.chosen = choose(flags.engine, flags.variant, flags.setting, flags.knob);
  request.variant = plan.chosen.variant;
  request.knobs.insert(plan.chosen.use.knobs.begin(), plan.chosen.use.knobs.end());

  const Scenario scenario = load_scenario(find_scenario(flags.scenario), request.set);
  check_reference(scenario);
  request.scene = scenario.file;
  request.step = flags.step ? positive_flag("step", *flags.step, seconds) : scenario.step;
  request.duration = flags.duration ? positive_flag("duration", *flags.duration, seconds) : scenario.duration;
  check_steps(request.step, request.duration, request.time_limit_s.has_value());
  request.out = flags.out ? *flags.out : default_directory(flags, plan.chosen, scenario.name).string();

  RunSummary& summary = plan.summary;
  describe(scenario, summary);
  summary.requested = {flags.engine, "", flags.variant.value_or("")};
  summary.used = {flags.engine, "", plan.chosen.variant};
  summary.engine = plan.chosen.use;
  summary.simulation.step = request.step;
  summary.simulation.duration = request.duration;
  summary.restitution = request.restitution;
  summary.friction = request.friction;
  summary.record_every = request.record_every;
  summary.perturb = request.perturb;
  summary.seed = request.seed;
  summary.prune = false;
  summary.time_limit_s = request.time_limit_s;
  summary.memory_limit_mb = plan.memory_limit_mb;
  summary.versions = versions();
  summary.status = Status::crash;
  summary.reason = "did not finish: the program was killed, or the machine stopped";
  return plan;
}

Status status_of(const std::string& word) {
  for (int i = 0; i < status_count; ++i)
    if (name(static_cast<Status>(i)) == word) return static_cast<Status>(i);
  return Status::crash;
}

/// What the engine's program made of it, in the words of a summary.
void take(const Ended& ended, const EnginePlan& plan, RunSummary& summary) try {
  RunTally& tally = summary.tally;
  tally.t_reached = ended.pulse.t;
  tally.steps = ended.pulse.steps;
  tally.times.solve_s = tally.times.step_s = ended.pulse.step_s;
  summary.peak_memory_mb = ended.peak_memory_mb;
  const std::string said = ended.last_words.empty() ? "" : ": " + ended.last_words;
  const Json answer = Json::parse(ended.answer, nullptr, false);
  const auto failed = [&](Status status, std::string reason) {
    summary.status = status;
    summary.reason = std::move(reason);
  };
  if (ended.stopped()) return failed(Status::interrupted, "stopped by a signal");
  if (ended.overdue)
    return failed(Status::time_limit,
                  fmt::format("the engine did not come back from a step within {:g} s; it was stopped",
                              plan.request.time_limit_s.value_or(0)));
  if (ended.code != 0 && plan.memory_limit_mb && ended.peak_memory_mb >= 0.9 * *plan.memory_limit_mb)
    return failed(Status::memory_limit, fmt::format("died at {:g} MB{}", *plan.memory_limit_mb, said));
  if (ended.code < 0)
    return failed(Status::crash,
                  fmt::format("the engine died of signal {} ({}){}", -ended.code, strsignal(-ended.code), said));
  if (ended.code != 0)
    return failed(Status::crash, fmt::format("the engine ended with exit code {}{}", ended.code, said));
  if (!answer.is_object() || !answer.contains("status"))
    return failed(Status::crash, "the engine's program gave no answer" + said);
  failed(status_of(answer["status"]), answer.value("reason", ""));
  tally.contacts_max = std::max(0, answer.value("contacts_max", 0));
  tally.penetration_max = answer.value("penetration_max", 0.0);
  summary.write_s = answer.value("write_s", 0.0);
  if (answer.contains("errors"))
    for (const Json& error : answer["errors"])
      if (error.at(1).is_number()) summary.errors.emplace_back(error[0], error[1]);
  const long steps = step_at(plan.request.duration, plan.request.step);
  if (summary.status == Status::ok && tally.steps < steps)
    failed(Status::crash, fmt::format("the engine says ok after {} of {} steps", tally.steps, steps));
  summary.finished = summary.status == Status::ok;
} catch (const Json::exception& error) {
  summary.status = Status::crash;
  summary.reason = fmt::format("the engine's program does not answer as docs/engines.md says: {}", error.what());
}

std::string lines_of(const RunSummary& summary) {
  std::string out = fmt::format("{}: engine {}", summary.scenario, summary.used.method);
  if (!summary.engine->precision.empty())
    out += fmt::format(", {} ({} precision, {})", summary.used.variant, summary.engine->precision,
                       summary.engine->setting);
  out += fmt::format(": {}{}\n", name(summary.status), summary.reason.empty() ? "" : ": " + summary.reason);
  out += fmt::format("  reached     {:g} of {:g} s in {} steps of {:g} s, at most {} contacts\n",
                     summary.tally.t_reached, summary.simulation.duration, summary.tally.steps, summary.simulation.step,
                     summary.tally.contacts_max);
  if (summary.tally.steps > 0)
    out += fmt::format("  time        {:.3g} s stepping, {:.3g} us a step\n", summary.tally.times.step_s,
                       1e6 * summary.tally.times.step_s / static_cast<double>(summary.tally.steps));
  for (const auto& [key, value] : summary.errors) out += fmt::format("    {:32}  {:.6g}\n", key, value);
  return out;
}

}  // namespace

int run_engine(const EngineRunFlags& flags) {
  EnginePlan plan = make_plan(flags);
  RunSummary& summary = plan.summary;
  const fs::path out = plan.request.out;
  Limits limits({}, {});  // signals; the engine's own limits are kept by run_program
  const ProblemFolder problems(plan.request.save_problems);
  std::error_code refused;
  fs::create_directories(out, refused);
  const FolderLock lock(out);
  if (lock.taken() && !problems.is(out)) refuse_taken("out", out);
  SummaryFile file(out / "summary.json", to_json(summary));
  if (!file.ok())
    throw UsageError(fmt::format("--out: {} cannot be written: {}", out.string(), std::strerror(file.error())));
  for (const char* earlier : {"hard_problem.hdf5", "trajectory.csv", "trajectory.npz", "steps.csv", "joints.csv",
                              "loads.csv", "stepping.csv", "contacts.csv", "shapes.csv", "hulls.csv"})
    fs::remove(out / earlier, refused);
  problems.clear();
  if (plan.chosen.program.empty()) {
    summary.status = Status::unavailable;
    summary.reason = plan.chosen.missing;
  } else {
    const Ended ended = run_program(plan.chosen.program, {"--run", Json(plan.request).dump()},
                                    plan.request.time_limit_s, plan.memory_limit_mb);
    take(ended, plan, summary);
  }
  limits.lift();
  summary.wall_s = std::chrono::duration<double>(Limits::Clock::now() - limits.start()).count();
  const std::string json = to_json(summary);
  const bool written = file.replace(json);
  if (!written) print_error(json);
  if (!summary.finished)
    print_error(fmt::format("contactbench run: {}: {} (at t = {:g} s; {})\n", name(summary.status), summary.reason,
                            summary.tally.t_reached, out.string()));
  if (flags.json)
    fmt::print("{}", json);
  else if (!flags.quiet)
    fmt::print("{}  files       {}\n", lines_of(summary), out.string());
  return summary.finished && written ? finished : not_finished;
}

}  // namespace cb
