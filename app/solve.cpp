#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "commands.h"
#include "contact/conditioning.h"
#include "contact/problem_files.h"
#include "contact/referee.h"
#include "flags.h"
#include "lcp/lcp.h"
#include "lcp/lcp_files.h"
#include "limits.h"
#include "linalg/matrix_market.h"
#include "linalg/stop.h"
#include "method_flags.h"
#include "methods/lcp_status.h"
#include "methods/pruned.h"
#include "print_json.h"
#include "scenario/near_name.h"
#include "simulation/simulation.h"

namespace cb {

namespace {

using Json = nlohmann::ordered_json;

/// The command line of `solve`, as text.
struct SolveFlags : MethodFlags {
  Text problem, kind, matrix, vector, method, tolerance, time_limit, repeat, out, velocities, prune;
  bool symmetrise = false, json = false;
};

/// What is printed, in this order, and how the program ends.
struct Report {
  Json json = Json::object();
  Status status = Status::ok;
  std::string reason;
  std::vector<double> answer, velocities;  ///< empty where there are none to write
};

/// A flag that this kind of problem cannot use.
void refuse_flag(std::string_view flag, const Text& value, std::string_view why) {
  if (value) throw UsageError(fmt::format("--{} {}: {}; leave it out", flag, *value, why));
}

/// What the command line may say of every kind.
struct Common {
  long repeat = 1;
  std::optional<double> tolerance, time_limit_s;
};

Common common_flags(const SolveFlags& flags) {
  Common common;
  if (flags.repeat)
    common.repeat = whole_flag("repeat", *flags.repeat, 1, 1'000'000, "a whole number of solves, at least 1");
  if (flags.tolerance)
    common.tolerance = positive_flag("tolerance", *flags.tolerance, "a positive residual, as in --tolerance 1e-10");
  if (flags.time_limit)
    common.time_limit_s = positive_flag("time-limit", *flags.time_limit, "a positive number of seconds");
  const auto check_file = [](std::string_view flag, const Text& file) {
    if (!file) return;
    const std::filesystem::path folder = std::filesystem::path(*file).parent_path();
    std::error_code error;
    if (file->empty() || std::filesystem::is_directory(*file, error) ||
        (!folder.empty() && !std::filesystem::is_directory(folder, error)))
      throw UsageError(fmt::format("--{} {}: must name a file in a folder that exists, as in --{} answer.mtx", flag,
                                   file->empty() ? "''" : *file, flag));
  };
  check_file("out", flags.out);
  check_file("velocities", flags.velocities);
  return common;
}

/// What several calls of a solver came to.
struct Timed {
  std::vector<double> seconds;  ///< of each, sorted; none where they were stopped
  Status stop = Status::ok;     ///< interrupted or time_limit, with its reason
  std::string reason;
};

/// Calls `solve` as often as the command line says; where that is several times, once more before, which does not
/// count.
template <class Solve>
Timed timed(const Common& common, Solve&& solve) {
  using Clock = std::chrono::steady_clock;
  Timed out;
  Limits limits(common.time_limit_s, {});
  try {
    if (common.repeat > 1) solve();
    for (long i = 0; i < common.repeat; ++i) {
      const Clock::time_point start = Clock::now();
      solve();
      out.seconds.push_back(std::chrono::duration<double>(Clock::now() - start).count());
    }
    std::sort(out.seconds.begin(), out.seconds.end());
  } catch (const Stopped&) {
    out = {{}, limits.status(), limits.reason(limits.status())};
  }
  return out;
}

double median(const std::vector<double>& sorted) {
  const std::size_t n = sorted.size();
  return n % 2 == 1 ? sorted[n / 2] : (sorted[n / 2 - 1] + sorted[n / 2]) / 2;
}

Json number(const std::optional<double>& x) { return finite_or_null(x); }

bool answered(Status status) { return status == Status::ok || status == Status::inaccurate; }

void put_times(Json& json, const Timed& times) {
  const std::vector<double>& seconds = times.seconds;
  json["repeats"] = seconds.size();
  json["time_min_s"] = seconds.empty() ? Json() : Json(seconds.front());
  json["time_median_s"] = seconds.empty() ? Json() : Json(median(seconds));
}

Report solve_lcp(const SolveFlags& flags) {
  constexpr std::string_view useless = "--kind lcp has no use for it";
  refuse_flag("method", flags.method, useless);
  refuse_flag("variant", flags.variant, useless);
  for (const auto& [flag, value] : flags.own) refuse_flag(flag, value, useless);
  refuse_flag("velocities", flags.velocities, useless);
  refuse_flag("prune", flags.prune, useless);
  if (flags.symmetrise) throw UsageError(fmt::format("--symmetrise: {}; leave it out", useless));
  const Common common = common_flags(flags);

  if (flags.problem && (flags.matrix || flags.vector))
    throw UsageError(
        fmt::format("{}: --matrix and --vector are the whole problem; leave one or the other out", *flags.problem));
  if (!flags.problem && !(flags.matrix && flags.vector))
    throw UsageError("the problem is missing: give --matrix M.mtx --vector q.mtx, or a Siconos text file");
  if (flags.problem && flags.problem->ends_with(".mtx"))
    throw UsageError(fmt::format("{}: a Matrix Market file is one half of an LCP; give --matrix M.mtx --vector q.mtx",
                                 *flags.problem));
  const std::string chosen = flags.solver.value_or(std::string(lcp_solvers().front().name));
  const LcpSolverRow* row = find_lcp_solver(chosen);
  if (!row) {
    std::vector<std::string> known;
    for (const LcpSolverRow& known_row : lcp_solvers()) known.emplace_back(known_row.name);
    throw UsageError(fmt::format("--solver {}: no such LCP solver; {}", chosen, suggest(chosen, known, "there are")));
  }

  const LcpProblem problem =
      flags.problem ? read_lcp_siconos(*flags.problem) : read_lcp_matrix_market(*flags.matrix, *flags.vector);
  LcpOptions options;
  if (common.tolerance) options.tolerance = *common.tolerance;

  Report report;
  LcpSolution solution;
  Timed times;
  double residual = HUGE_VAL;
  if (!row->unavailable.empty()) {
    solution.status = LcpStatus::unavailable;
    solution.reason = row->unavailable;
  } else {
    const LcpSolver solver = row->make(options);
    times = timed(common, [&] { solver(problem, solution); });
    if (times.stop != Status::ok) solution = {};
    if (solution.z.size() == problem.q.size() && solution.z.allFinite())
      residual = natural_residual(problem, solution.z);
  }
  report.status = times.stop != Status::ok ? times.stop : status_of(solution.status);
  report.reason = times.stop != Status::ok ? times.reason : solution.reason;
  const bool claimed = solution.status == LcpStatus::solved;
  const bool holds = residual <= options.tolerance;
  if (!holds && report.status == Status::ok) {
    report.status = Status::inaccurate;
    report.reason = fmt::format("the checked natural residual is {:.3g}, beyond {:g}", residual, options.tolerance);
  }
  if (answered(report.status)) report.answer.assign(solution.z.data(), solution.z.data() + solution.z.size());

  Json& json = report.json;
  json["kind"] = "lcp";
  json["problem"] = flags.problem ? *flags.problem : *flags.matrix;
  if (flags.vector) json["vector"] = *flags.vector;
  json["solver"] = row->name;
  json["tolerance"] = options.tolerance;
  json["status"] = name(report.status);
  json["reason"] = report.reason;
  json["pivots"] = solution.pivots;
  json["factorisations"] = solution.factorisations;
  json["claimed_residual"] = number(solution.residual);
  json["residual"] = number(residual);
  json["false_claim"] = claimed && !holds;
  put_times(json, times);
  json["size"] = problem.n();
  return report;
}

/// Joules that the impulses put in: r.u- + r.W r / 2 = r.(u- + u+) / 2. The objective of `convex`.
double energy_change(const ContactProblem& problem, const std::vector<double>& impulse,
                     const std::vector<double>& v_plus) {
  std::vector<double> before, after;
  contact_velocity(problem, problem.v_minus, before);
  contact_velocity(problem, v_plus, after);
  double sum = 0;
  for (std::size_t i = 0; i < impulse.size(); ++i) sum += impulse[i] * (before[i] + after[i]) / 2;
  return sum;
}

/// The largest weight, 1/kg: how fast an impulse makes the lightest contact.
double largest_weight(const ContactProblem& problem) {
  BlockCholesky factor;
  std::vector<double> weight;
  if (!factor.factor(problem.M)) return 0;
  contact_weights(problem, factor, weight);
  return weight.empty() ? 0 : *std::max_element(weight.begin(), weight.end());
}

Report solve_contact(const SolveFlags& flags) {
  constexpr std::string_view useless = "--kind contact has no use for it";
  refuse_flag("matrix", flags.matrix, useless);
  refuse_flag("vector", flags.vector, useless);
  const Common common = common_flags(flags);
  if (!flags.problem)
    throw UsageError("the problem is missing: give an FCLIB HDF5 file or a Siconos friction text file");
  if (!flags.method) throw UsageError("--method is missing; contactbench list methods says what there is");
  const std::shared_ptr<const MethodRow> chosen = method_flag(*flags.method, flags);
  const MethodRow& row = *chosen;
  const MethodOptions options = method_options(flags, row, {}, {});
  const bool prune = flags.prune && on_off_flag("prune", *flags.prune);
  const double tolerance = common.tolerance.value_or(SimulationOptions().accepted_residual);

  const StoredProblem stored = read_contact_problem(*flags.problem, {.symmetrise = flags.symmetrise});
  const ContactProblem& problem = stored.problem;
  if (flags.symmetrise && stored.format == ProblemFormat::fclib_global)
    throw UsageError(
        fmt::format("--symmetrise: {} is given by M and H, there is no W to symmetrise; leave it out", *flags.problem));
  if (options.epsilon_relative && quadratic_form(problem.M, problem.v_minus) == 0)
    throw UsageError(fmt::format("--epsilon-relative: {} has no kinetic energy before the event; give --epsilon in J",
                                 *flags.problem));

  Report report;
  ContactSolution solution;
  Timed times;
  std::vector<double> v_plus;
  Residuals residuals;
  bool checked = false, holds = false;
  if (const std::string reason = unavailable_reason(row, options); !reason.empty()) {
    solution.status = Status::unavailable;
    solution.reason = reason;
  } else {
    const ContactMethod method = prune ? pruned(row, options, std::make_shared<LeftOut>()) : row.make(options);
    times = timed(common, [&] { method(problem, solution); });
    if (times.stop != Status::ok) {
      solution = {};
      solution.status = times.stop;
      solution.reason = times.reason;
    }
    checked = solution.impulse.size() == 3 * static_cast<std::size_t>(problem.nc());
    if (checked) {
      Referee referee;
      residuals = referee.check(problem, solution, row.law, v_plus);
      holds = Referee::holds(residuals, tolerance);
    }
  }
  // The check decides; where it does not hold, a typed failure says more than `inaccurate`.
  report.status = holds ? Status::ok : solution.status;
  if (!holds) report.reason = solution.reason;
  if (!holds && report.status == Status::ok) {
    report.status = residuals.finite ? Status::inaccurate : Status::not_finite;
    report.reason = Referee::refusal(residuals, tolerance);
  }
  if (checked && residuals.finite && answered(report.status)) {
    report.answer = solution.impulse;
    contact_velocity(problem, v_plus, report.velocities);
  }

  Json& json = report.json;
  json["kind"] = "contact";
  json["problem"] = *flags.problem;
  json["format"] = name(stored.format);
  json["notes"] = stored.notes;
  json["method"] = row.name;
  json["solver"] = options.solver.empty() ? Json() : Json(options.solver);
  json["variant"] = options.variant.empty() ? Json() : Json(options.variant);
  put_options(json, row.options, options);
  json["status"] = name(report.status);
  json["reason"] = report.reason;
  json["solver_status"] = name(solution.status);
  json["solver_reason"] = solution.reason;
  json["claimed_residual"] = checked ? number(solution.claimed_residual) : Json();
  json["residual"] = checked ? number(residuals.model) : Json();
  json["law_residual"] = checked ? number(residuals.law) : Json();
  json["gap"] = checked ? number(residuals.gap) : Json();
  json["infeasibility"] = checked ? number(residuals.infeasibility) : Json();
  json["false_claim"] = solution.status == Status::ok && !holds;
  json["energy_before_j"] = quadratic_form(problem.M, problem.v_minus) / 2;
  std::vector<double> u_minus;
  contact_velocity(problem, problem.v_minus, u_minus);
  double fastest = 0;
  for (const double u : u_minus) fastest = std::max(fastest, std::abs(u));
  json["speed_before_m_per_s"] = fastest;
  Conditioning conditioning;
  const bool measured = times.stop == Status::ok && ConditioningEstimate().measure(problem, conditioning);
  json["rank"] = measured ? Json(conditioning.rank) : Json();
  json["rows"] = measured ? Json(conditioning.rows) : Json();
  json["condition"] = measured ? number(conditioning.condition) : Json();
  json["weight_max_per_kg"] = largest_weight(problem);
  json["energy_change_j"] = checked ? number(energy_change(problem, solution.impulse, v_plus)) : Json();
  json["iterations"] = solution.iterations;
  put_times(json, times);
  json["size"] = solution.size;
  json["contacts"] = problem.nc();
  json["velocities"] = problem.nv();
  return report;
}

int solve(const SolveFlags& flags) {
  if (!flags.kind) throw UsageError("--kind is missing: give --kind lcp or --kind contact");
  if (*flags.kind != "lcp" && *flags.kind != "contact")
    throw UsageError(fmt::format("--kind {}: must be lcp or contact", flags.kind->empty() ? "''" : *flags.kind));
  Report report;
  try {
    report = *flags.kind == "lcp" ? solve_lcp(flags) : solve_contact(flags);
  } catch (const FileError& error) {
    throw UsageError(error.what());
  }
  const auto write = [&](const char* key, const Text& file, const std::vector<double>& values) {
    if (!file || values.empty()) return;
    try {
      write_matrix_market(*file, values);
      report.json[key] = *file;
    } catch (const FileError& error) {
      report.status = Status::write_failed;
      report.json["status"] = name(report.status);
      report.json["reason"] = report.reason = error.what();
    }
  };
  write("out", flags.out, report.answer);
  write("velocities_out", flags.velocities, report.velocities);
  print(report.json, flags.json);
  if (answered(report.status)) return finished;
  print_error(fmt::format("contactbench solve: {}: {}\n", name(report.status),
                          report.reason.empty() ? explanation(report.status) : report.reason));
  return not_finished;
}

}  // namespace

void add_solve(CLI::App& program, Action& action) {
  CLI::App& command = *program.add_subcommand("solve", "solve one stored problem, no simulation");
  const auto flags = std::make_shared<SolveFlags>();
  const auto add = [&](const char* flag, Text& value, const char* type, const char* summary) {
    command.add_option(flag, value, summary)->type_name(type);
  };
  add("problem", flags->problem, "PROBLEM",
      "contact: FCLIB HDF5 (local or global) or Siconos friction text; lcp: Siconos LCP text");
  add("--kind", flags->kind, "lcp|contact", "what the problem is");
  add("--matrix", flags->matrix, "M.mtx", "lcp: the matrix, Matrix Market, array or coordinate");
  add("--vector", flags->vector, "q.mtx", "lcp: the vector");
  add("--method", flags->method, "METHOD", "contact: see contactbench list methods");
  add_method_flags(command, *flags, true);
  command.add_flag("--symmetrise", flags->symmetrise,
                   "contact: solve with the symmetric part of W where it is not symmetric (refused without)");
  add("--prune", flags->prune, "on|off", "contact: leave out what a run would (docs/performance.md) [off]");
  add("--tolerance", flags->tolerance, "RESIDUAL",
      "checked residual beyond which an answer counts as inaccurate [lcp 1e-10, contact 1e-9]");
  add("--time-limit", flags->time_limit, "S", "stop after S seconds, all repeats together [none]");
  add("--repeat", flags->repeat, "N", "solve N times for the times; several: after one that is not counted [1]");
  add("--out", flags->out, "FILE.mtx", "where the answer goes: z, or the impulses n, t1, t2 of each contact");
  add("--velocities", flags->velocities, "FILE.mtx",
      "contact: where u after the event goes, n, t1, t2 of each contact");
  command.add_flag("--json", flags->json, "as JSON");
  command.callback([flags, &action] { action = [flags] { return solve(*flags); }; });
}

}  // namespace cb
