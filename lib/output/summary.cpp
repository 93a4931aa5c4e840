#include "output/summary.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "output/row_file.h"

namespace cb {

namespace {

using Json = nlohmann::ordered_json;

Json text(const std::string& value) { return value.empty() ? Json() : Json(value); }
template <class T>
Json maybe(const std::optional<T>& value) {
  return value ? Json(*value) : Json();
}
/// A parameter's value: a number where it reads as one, else the word.
Json parameter(const std::string& value) {
  double x = 0;
  const char* last = value.data() + value.size();
  const auto [end, error] = std::from_chars(value.data(), last, x);
  return error == std::errc() && end == last && std::isfinite(x) ? Json(x) : Json(value);
}
Json choice(const Choice& of) {
  return {{"method", text(of.method)}, {"solver", text(of.solver)}, {"variant", text(of.variant)}};
}

Json value(const OptionValue& of) {
  if (const int* whole = std::get_if<int>(&of)) return *whole;
  if (const double* real = std::get_if<double>(&of)) return *real;
  if (const bool* on = std::get_if<bool>(&of)) return *on ? "on" : "off";
  if (const std::string* words = std::get_if<std::string>(&of)) return *words;
  return {};
}

/// Of every flag of every method; null where this one does not understand it.
void put_method_options(Json& json, const RunSummary& run) {
  const auto& flags = run.method_flags;
  const auto put = [&](const MethodRow& method, bool unknown_too) {
    for (const OptionRow& row : method.options) {
      const bool understood = std::find(flags.begin(), flags.end(), row.flag) != flags.end();
      if (!understood && !unknown_too) continue;
      Json& known = json[key(row)];
      if (understood && known.is_null()) known = value(value_of(row, method.options, run.method_options));
    }
  };
  for (const MethodRow& method : methods()) put(method, true);
  put(external_row(laws().front()), false);
}

Json options(const RunSummary& run) {
  const SimulationOptions& simulation = run.simulation;
  Json json = {{"step", simulation.step}, {"duration", simulation.duration}};
  put_method_options(json, run);
  json.update({{"restitution", maybe(run.restitution)},
               {"friction", maybe(run.friction)},
               {"rotate_cone", run.rotate_cone},
               {"record_every", run.record_every},
               {"prune", run.simulation.prune.repeats ? "rest"
                         : run.prune                  ? "on"
                                                      : "off"},
               {"jobs", run.method_options.threads},
               {"perturb", run.perturb},
               {"seed", run.seed},
               {"shuffle_contacts", simulation.shuffle},
               {"gyroscopic", simulation.gyroscopic == Gyroscopic::implicit ? "implicit" : "explicit"},
               {"accepted_residual", simulation.accepted_residual},
               {"closed_gap", simulation.closed_gap},
               {"approach", simulation.approach},
               {"event_cap", simulation.event_cap},
               {"blowup_factor", simulation.blowup_factor},
               {"blowup_energy_j", simulation.blowup_energy},
               {"penetration_limit", simulation.penetration_limit},
               {"penetration_bound", simulation.penetration_bound},
               {"time_limit_s", maybe(run.time_limit_s)},
               {"memory_limit_mb", maybe(run.memory_limit_mb)}});
  return json;
}

Json accuracy(const RunSummary& run) {
  const AccuracyTally& tally = *run.accuracy;
  return {{"wanted_m", run.simulation.accuracy},
          {"order", tally.order},
          {"smallest_step_s", tally.smallest_step},
          {"macro_steps", tally.taken},
          {"refused", tally.refused},
          {"base_steps", tally.base_steps},
          {"base_solves", tally.base_solves},
          {"switches", tally.switches},
          {"impacts", tally.impacts},
          {"first_order_steps", tally.first_order},
          {"noisy_steps", tally.noisy},
          {"shortest_s", tally.taken > 0 ? Json(tally.shortest) : Json()},
          {"longest_s", tally.taken > 0 ? Json(tally.longest) : Json()},
          {"estimated_error_m", tally.estimated_error}};
}

/// Two of them are about the one step h, which there is none of to an accuracy.
Json control(const RunSummary& run) {
  if (!run.largest_stable_step) return {};
  const double limit = *run.largest_stable_step;
  const bool of_a_step = run.simulation.stepping != Stepping::accuracy;
  return {{"largest_eigenvalue", of_a_step ? maybe(run.control_eigenvalue) : Json()},
          {"largest_stable_step", limit},
          {"stable", of_a_step ? Json(run.simulation.step <= limit) : Json()}};
}

Json engine(const EngineUse& use) {
  Json knobs = Json::object();
  for (const auto& [key, value] : use.knobs) knobs[key] = value;
  return {{"name", use.name},           {"version", use.version},
          {"precision", use.precision}, {"package", text(use.package)},
          {"setting", use.setting},     {"knobs", knobs}};
}

/// Of the worst problem measured; null where none was.
Json conditioning(const RunTally& tally) {
  if (!tally.conditioning) return {};
  const Conditioning& worst = *tally.conditioning;
  return {{"condition", worst.condition}, {"rank", worst.rank},        {"rows", worst.rows},
          {"freedoms", worst.freedoms},   {"t", tally.conditioning_t}, {"measured", tally.measured_events},
          {"too_large", tally.too_large}};
}

Json residuals(const RunTally& tally) {
  return {{"max", maybe(tally.residual_max)},
          {"median", maybe(tally.residuals.median())},
          {"false_claims", tally.false_claims},
          {"inaccurate_events", tally.inaccurate_events},
          {"doubted", tally.doubted},
          {"claimed_max", maybe(tally.claimed_max)},
          {"law_max", maybe(tally.law_max)},
          {"gap_max_j", maybe(tally.gap_max)},
          {"infeasibility_max", maybe(tally.infeasibility_max)}};
}

Json restitution(const RunTally& tally) {
  return {{"bounces_left_out", tally.bounces_left_out},
          {"largest_speed_m_per_s", tally.bounce_speed_max},
          {"largest_distance_m", tally.bounce_distance_max},
          {"scaled_events", tally.scaled_events},
          {"least_scale", maybe(tally.restitution_scale_min)}};
}

}  // namespace

std::string_view name(ReferenceKind kind) {
  switch (kind) {
    case ReferenceKind::analytic:
      return "analytic";
    case ReferenceKind::certified:
      return "certified";
    case ReferenceKind::missing:
      break;
  }
  return "missing";
}

void describe(const Scenario& scenario, RunSummary& summary) {
  summary.scenario = scenario.name;
  summary.file = scenario.file;
  summary.title = scenario.title;
  summary.parameters = scenario.parameters;
  summary.rotate_cone = scenario.rotate_cone;
  summary.reference_kind = name(scenario.reference.kind);
  summary.reference_name = scenario.reference.name;
  summary.machine = machine();
}

void describe(const MethodRow& method, const MethodOptions& options, RunSummary& summary) {
  summary.used = summary.requested = {std::string(method.name), options.solver, options.variant};
  summary.method_options = options;
  for (const OptionRow& row : method.options) summary.method_flags.emplace_back(row.flag);
}

std::string to_json(const RunSummary& run) {
  const RunTally& tally = run.tally;
  Json parameters = Json::object(), errors = Json::object();
  for (const auto& [key, value] : run.parameters) parameters[key] = parameter(value);
  for (const auto& [key, value] : run.errors) errors[key] = value;
  Json left_out = Json::array();
  for (const auto& [what, count] : run.left_out) left_out.push_back({{"what", what}, {"count", count}});
  Json answered_by = Json::object();
  for (const auto& [who, count] : run.answered_by) answered_by[who] = count;

  Json json = {
      {"scenario", run.scenario},
      {"file", run.file},
      {"title", run.title},
      {"parameters", parameters},
      {"method", run.used.method},
      {"solver", text(run.used.solver)},
      {"variant", text(run.used.variant)},
      {"requested", choice(run.requested)},
      {"used", choice(run.used)},
      {"options", options(run)},
      {"status", name(run.status)},
      {"reason", text(run.reason)},
      {"hard_problem", text(run.hard_problem)},
      {"hard_problem_command", text(run.hard_problem_command)},
      {"finished", run.finished},
      {"t_reached", tally.t_reached},
      {"steps", tally.steps},
      {"events", tally.events},
      {"contacts_max", tally.contacts_max},
      {"solves", tally.solves},
      {"iterations_total", tally.iterations},
      {"time",
       {{"total_s", tally.times.step_s},
        {"dynamics_s", tally.times.dynamics_s},
        {"collision_s", tally.times.collision_s},
        {"assembly_s", tally.times.assembly_s},
        {"solve_s", tally.times.solve_s},
        {"write_s", run.write_s},
        {"wall_s", run.wall_s}}},
      {"peak_memory_mb", run.peak_memory_mb},
      {"reference", {{"kind", text(run.reference_kind)}, {"name", text(run.reference_name)}}},
      {"errors", errors},
      {"residuals", residuals(tally)},
      {"energy", {{"max_gain_j", maybe(tally.gain_max)}, {"max_gain_relative", maybe(tally.gain_relative_max)}}},
      {"control", control(run)},
      {"max_penetration", tally.penetration_max},
      {"penetration",
       {{"inside_steps_m", tally.penetration_inside_max},
        {"removals", tally.penetration_removals},
        {"largest_displacement_m", tally.penetration_displacement_max}}},
      {"restitution", restitution(tally)},
      {"conditioning", conditioning(tally)},
      {"left_out", left_out},
      {"answered_by", answered_by.empty() ? Json() : answered_by},
      {"versions",
       {{"contactbench", run.versions.contactbench},
        {"git", run.versions.git},
        {"compiler", run.versions.compiler},
        {"flags", run.versions.flags},
        {"eigen", run.versions.eigen},
        {"suitesparse", run.versions.suitesparse}}},
      {"machine", {{"cpu", run.machine.cpu}, {"cores", run.machine.cores}, {"os", run.machine.os}}}};
  if (run.accuracy) json["accuracy"] = accuracy(run);
  if (run.simulation.joint_forces == JointForces::implicit) json["options"]["joint_forces"] = "implicit";
  if (run.engine) json["engine"] = engine(*run.engine);
  if (run.simulation.stepping != Stepping::events) {
    json["options"]["stepping"] = run.simulation.stepping == Stepping::steps ? "steps" : "accuracy";
    if (run.simulation.stepping == Stepping::accuracy) {
      json["options"]["step"] = nullptr;
      json["options"]["accuracy"] = run.simulation.accuracy;
      json["options"]["record_interval"] = run.simulation.record_interval;
    }
  }
  // A file name may hold bytes that are no UTF-8; the summary must not fail over it.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
}

std::string to_text(const RunSummary& run) {
  const RunTally& tally = run.tally;
  const auto measured = [](const std::optional<double>& x) { return x ? fmt::format("{:.3g}", *x) : "-"; };
  std::string out = fmt::format("{}: {}", run.scenario, run.used.method);
  for (const std::string& part : {run.used.solver, run.used.variant})
    if (!part.empty()) out += ", " + part;
  out += fmt::format(": {}{}{}\n", name(run.status), run.reason.empty() ? "" : ": ", run.reason);
  out +=
      fmt::format("  reached     {:g} of {:g} s in {} steps{}, {} events, at most {} contacts\n", tally.t_reached,
                  run.simulation.duration, tally.steps,
                  run.accuracy ? "" : fmt::format(" of {:g} s", run.simulation.step), tally.events, tally.contacts_max);
  if (run.accuracy)
    out += fmt::format(
        "  accuracy    {:g} m wanted, {:.3g} m estimated; order {}, {} base solves, {} switches, {} impacts\n",
        run.simulation.accuracy, run.accuracy->estimated_error, run.accuracy->order, run.accuracy->base_solves,
        run.accuracy->switches, run.accuracy->impacts);
  out += fmt::format("  time        {:.3g} s simulating ({:.3g} s solving), {:.3g} s writing", tally.times.step_s,
                     tally.times.solve_s, run.write_s);
  if (tally.steps > 0)
    out += fmt::format("; {:.3g} us a step", 1e6 * tally.times.step_s / static_cast<double>(tally.steps));
  if (tally.times.step_s > 0) out += fmt::format("; {:.3g} times real time", tally.t_reached / tally.times.step_s);
  out += fmt::format("\n  residual    max {}, median {}; {} false claims\n", measured(tally.residual_max),
                     measured(tally.residuals.median()), tally.false_claims);
  if (tally.gap_max)
    out += fmt::format("  gap         {} J, infeasibility {}\n", measured(tally.gap_max),
                       measured(tally.infeasibility_max));
  out += fmt::format("  energy      largest gain of an event {} J\n", measured(tally.gain_max));
  if (!run.errors.empty()) {
    out += fmt::format("  errors      against the {} reference {}\n", run.reference_kind, run.reference_name);
    std::size_t width = 0;
    for (const auto& error : run.errors) width = std::max(width, error.first.size());
    for (const auto& [key, value] : run.errors) out += fmt::format("    {:{}}  {:.6g}\n", key, width, value);
  }
  return out;
}

SummaryFile::SummaryFile(const std::filesystem::path& path, const std::string& provisional) {
  file_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (file_ < 0) {
    error_ = errno;
    return;
  }
  std::string text = provisional;
  text.resize(text.size() + reserve, ' ');
  text.back() = '\n';
  size_ = write_all(file_, text, 0, error_);
  // Half a reserved place would be no readable summary.
  if (error_ != 0 && ::ftruncate(file_, 0) != 0) return;
}

SummaryFile::~SummaryFile() {
  if (file_ >= 0) ::close(file_);
}

bool SummaryFile::replace(const std::string& text) {
  if (file_ < 0 || error_ != 0) return false;
  // One write over what is there already, then cut: at no time is the file without a whole summary but inside the
  // write.
  std::string padded = text;
  padded.resize(std::max(size_, text.size()), ' ');
  write_all(file_, padded, 0, error_);
  if (error_ == 0 && ::ftruncate(file_, static_cast<long>(text.size())) != 0) error_ = errno;
  return error_ == 0;
}

}  // namespace cb
