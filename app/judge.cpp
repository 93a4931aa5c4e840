#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "contact/answer_files.h"
#include "contact/problem_files.h"
#include "contact/referee.h"
#include "flags.h"
#include "linalg/finite.h"
#include "method_flags.h"
#include "methods/outside.h"
#include "print_json.h"
#include "simulation/options.h"

namespace cb {

namespace {

using Json = nlohmann::ordered_json;

/// The command line of `judge`, as text.
struct JudgeFlags : MethodFlags {
  std::string problem, answer;
  Text tolerance;
  bool symmetrise = false, json = false;
};

Json three(const std::vector<double>& x, int contact) {
  const std::size_t at = 3 * static_cast<std::size_t>(contact);
  return {x[at], x[at + 1], x[at + 2]};
}

/// The contact that the verdict is about, with all that can be looked at there.
Json worst(const ContactProblem& problem, const std::vector<double>& impulse, const std::vector<double>& v_plus,
           const Residuals& residuals) {
  Json out = {{"island", residuals.worst_island < 0 ? Json() : Json(residuals.worst_island)}};
  const int c = residuals.worst_contact;
  if (c < 0) return residuals.worst_island < 0 ? Json() : out;
  std::vector<double> before, after;
  contact_velocity(problem, problem.v_minus, before);
  contact_velocity(problem, v_plus, after);
  out.update({{"contact", c},
              {"mu", problem.mu[static_cast<std::size_t>(c)]},
              {"restitution", problem.restitution[static_cast<std::size_t>(c)]},
              {"impulse_n_s", three(impulse, c)},
              {"velocity_before_m_per_s", three(before, c)},
              {"velocity_after_m_per_s", three(after, c)}});
  return out;
}

int judge(const JudgeFlags& flags) {
  const Law& law = law_flag(flags);
  const MethodOptions options = law_options(flags, law);
  const double tolerance =
      flags.tolerance ? positive_flag("tolerance", *flags.tolerance, "a positive residual, as in --tolerance 1e-6")
                      : SimulationOptions().accepted_residual;
  StoredProblem stored;
  ContactSolution solution;
  try {
    stored = read_contact_problem(flags.problem, {.symmetrise = flags.symmetrise});
    solution.impulse = read_impulses(flags.answer, stored.problem.nc());
  } catch (const FileError& error) {
    throw UsageError(error.what());
  }
  const ContactProblem& problem = stored.problem;

  Residuals residuals;
  std::vector<double> v_plus;
  std::string why;  // it cannot be judged
  if (all_finite(solution.impulse)) why = WitnessFinder(law, options)(problem, solution);
  if (why.empty()) residuals = Referee().check(problem, solution, law, v_plus);
  const bool holds = why.empty() && Referee::holds(residuals, tolerance);
  const bool checked = why.empty() && residuals.finite;

  Json json = {{"problem", flags.problem}, {"answer", flags.answer}, {"law", law.name}};
  const std::vector<OptionRow> asked = options_of_law(law);
  put_options(json, asked, options);
  json["tolerance"] = tolerance;
  json["verdict"] = !why.empty() ? "not judged" : holds ? "holds" : "does not hold";
  json["reason"] = !why.empty() ? why : holds ? "" : Referee::refusal(residuals, tolerance);
  json["notes"] = stored.notes;
  if (!law.unseen_in_impulses.empty()) json["notes"].push_back(law.unseen_in_impulses);
  const auto put = [&](const char* key, const std::optional<double>& x) {
    json[key] = checked ? finite_or_null(x) : Json();
  };
  put("residual", residuals.model);
  put("law_residual", residuals.law);
  put("gap_j", residuals.gap);
  put("infeasibility", residuals.infeasibility);
  put("approach_m_per_s", residuals.approach);
  put("cone_violation_n_s", residuals.cone_violation);
  put("dissipation_gap_j", residuals.dissipation_gap);
  put("energy_change_j", residuals.energy_gain);
  put("energy_before_j", residuals.energy_before);
  put("momentum", residuals.momentum);
  json["worst"] = checked ? worst(problem, solution.impulse, v_plus, residuals) : Json();
  json["contacts"] = problem.nc();
  json["velocities"] = problem.nv();
  print(json, flags.json);
  if (holds) return finished;
  print_error(fmt::format("contactbench judge: {}: {}\n", json["verdict"].get<std::string>(),
                          json["reason"].get<std::string>()));
  return not_finished;
}

}  // namespace

void add_judge(CLI::App& program, Action& action) {
  CLI::App& command = *program.add_subcommand("judge", "the referee on an answer from elsewhere, under any law");
  const auto flags = std::make_shared<JudgeFlags>();
  command.add_option("problem", flags->problem, "FCLIB HDF5 (local or global) or Siconos friction text")
      ->required()
      ->type_name("PROBLEM");
  command
      .add_option(
          "answer", flags->answer,
          "impulses n, t1, t2 of each contact: FCLIB HDF5 (/solution), a Matrix Market vector, or plain numbers")
      ->required()
      ->type_name("ANSWER");
  add_law_flags(command, *flags);
  command.add_flag("--symmetrise", flags->symmetrise, "judge with the symmetric part of W where it is not symmetric");
  command.add_option("--tolerance", flags->tolerance, "residual up to which the answer holds [1e-9]")
      ->type_name("RESIDUAL");
  command.add_flag("--json", flags->json, "as JSON");
  command.callback([flags, &action] { action = [flags] { return judge(*flags); }; });
}

}  // namespace cb
