#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <new>

#include "commands.h"
#include "contact/conditioning.h"
#include "contact/islands.h"
#include "contact/laws.h"
#include "contact/problem_files.h"
#include "evaluation/references.h"
#include "evaluation/scene_errors.h"
#include "flags.h"
#include "folder_lock.h"
#include "limits.h"
#include "linalg/stop.h"
#include "method_flags.h"
#include "output/contact_file.h"
#include "output/npz.h"
#include "output/number.h"
#include "output/progress.h"
#include "output/run_files.h"
#include "output/summary.h"
#include "problem_folder.h"
#include "run_engine.h"
#include "scenario/near_name.h"
#include "scenario/perturb.h"
#include "simulation/explicit_step.h"
#include "simulation/left_out.h"
#include "versions.h"

namespace cb {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

/// The command line of `run`, as text.
struct RunFlags : MethodFlags {
  std::string scenario, method;
  Text restitution, friction, step, duration, record_every, save_problems, save_every, time_limit, memory_limit, out,
      prune, perturb, seed, shuffle, gyroscopic, joint_forces, stepping, accuracy, order, record_interval, engine,
      setting, format, jobs;
  std::vector<std::string> set, knob;
  bool quiet = false, json = false, conditioning = false, record_contacts = false;
};

/// A run that is known to be possible, but for what the disk and the solvers say.
struct RunPlan {
  Scenario scenario;
  std::shared_ptr<const MethodRow> method;
  MethodOptions options;
  std::string unavailable;  ///< why the solver cannot be used here; empty where it can
  std::string unsupported;  ///< why the method cannot step in the way that was asked for; empty where it can
  SimulationOptions simulation;
  bool prune = true;  ///< leave out what the scene does not need
  long record_every = 1;
  bool record_contacts = false;
  fs::path save_problems;  ///< empty: none
  long save_every = 1;
  std::optional<double> time_limit_s, memory_limit_mb;
  fs::path out;
  bool npz = false;  ///< the trajectory as arrays in place of rows
  bool quiet = false, json = false;
  bool conditioning = false;  ///< measure rank and condition of the problems met
  RunSummary summary;         ///< what is known before the run
};

/// results/runs/<scenario>__<method>[__<solver>][__<variant>][__k8][__eps1e-12][__<overrides>]
fs::path default_directory(const RunFlags& flags, const RunPlan& plan) {
  const MethodOptions& options = plan.options;
  std::string name = plan.scenario.name + "__" + std::string(plan.method->name);
  const auto add = [&](const std::string& part) { name += "__" + file_name_part(part); };
  if (!options.solver.empty()) add(options.solver);
  if (!options.variant.empty()) add(options.variant);
  for (const OptionRow& row : plan.method->options) {
    const std::string value = text_of(value_of(row, plan.method->options, options));
    if (!value.empty() && (row.always_named || flags.asked(row.flag))) add(std::string(row.short_name) + value);
  }
  if (plan.simulation.stepping == Stepping::steps) add("steps");
  if (flags.accuracy) add("A" + number_text(plan.simulation.accuracy));
  if (flags.order) add(fmt::format("p{}", plan.simulation.order));
  if (flags.record_interval) add("dt" + number_text(plan.simulation.record_interval));
  if (flags.step) add("h" + number_text(plan.simulation.step));
  if (flags.duration) add("T" + number_text(plan.simulation.duration));
  if (plan.summary.friction) add("mu" + number_text(*plan.summary.friction));
  if (plan.summary.restitution) add("e" + number_text(*plan.summary.restitution));
  for (const auto& [key, value] : set_flags(flags.set)) add(key + value);
  if (flags.record_every) add(fmt::format("every{}", plan.record_every));
  if (!plan.prune) add("prune-off");
  if (plan.simulation.prune.repeats) add("prune-rest");
  if (flags.perturb) add(fmt::format("perturb{}seed{}", number_text(plan.summary.perturb), plan.summary.seed));
  if (flags.shuffle) add(fmt::format("shuffle{}", plan.simulation.shuffle));
  if (plan.simulation.gyroscopic == Gyroscopic::explicit_euler) add("gyroscopic-explicit");
  if (flags.joint_forces) add("joints-" + *flags.joint_forces);
  return fs::path("results") / "runs" / name;
}

/// What is true of the run before it starts, and of one that is killed.
RunSummary provisional_summary(const RunFlags& flags, const RunPlan& plan) {
  RunSummary summary = plan.summary;
  describe(plan.scenario, summary);
  describe(*plan.method, plan.options, summary);
  summary.requested = {flags.method, flags.solver.value_or(""), flags.variant.value_or("")};
  summary.simulation = with_closed_gap(plan.simulation, plan.scenario);
  summary.record_every = plan.record_every;
  summary.prune = plan.prune;
  summary.time_limit_s = plan.time_limit_s;
  summary.memory_limit_mb = plan.memory_limit_mb;
  summary.versions = versions();
  summary.status = Status::crash;
  summary.reason = "did not finish: the program was killed, or the machine stopped";
  return summary;
}

/// How time goes on. `--accuracy` asks for its way of stepping by itself, in place of a step.
void stepping_flags(const RunFlags& flags, SimulationOptions& simulation) {
  constexpr const char* lengths = "a positive length in m, as in --accuracy 1e-6";
  if (flags.accuracy) {
    if (flags.step)
      throw UsageError(fmt::format("--step {}: --accuracy finds its own steps; leave one out", *flags.step));
    if (flags.stepping && *flags.stepping != "accuracy")
      throw UsageError(fmt::format("--stepping {}: has no --accuracy; leave one out", *flags.stepping));
    simulation.stepping = Stepping::accuracy;
    simulation.accuracy = positive_flag("accuracy", *flags.accuracy, lengths);
    if (flags.order)
      simulation.order = static_cast<int>(whole_flag("order", *flags.order, 2, 8, "a whole number from 2 to 8"));
    if (flags.record_interval)
      simulation.record_interval =
          positive_flag("record-interval", *flags.record_interval, "a positive number of seconds");
    return;
  }
  for (const auto& [name, flag] :
       {std::pair("order", &flags.order), std::pair("record-interval", &flags.record_interval)})
    if (*flag) throw UsageError(fmt::format("--{} {}: belongs to --accuracy A; give that too", name, **flag));
  if (!flags.stepping || *flags.stepping == "events") return;
  if (*flags.stepping == "steps") {
    simulation.stepping = Stepping::steps;
    return;
  }
  if (*flags.stepping == "accuracy") throw UsageError("--stepping accuracy: give the accuracy, as in --accuracy 1e-6");
  throw UsageError(fmt::format("--stepping {}: must be events or steps; or give --accuracy A", *flags.stepping));
}

/// What is left out.
void prune_flag(const RunFlags& flags, RunPlan& plan) {
  plan.simulation.prune.repeats = *flags.prune == "rest";
  if (!plan.simulation.prune.repeats) {
    plan.prune = on_off_flag("prune", *flags.prune, "on, off or rest");
    return;
  }
  if (flags.accuracy)
    throw UsageError("--prune rest: --accuracy compares steps, and makes each of them; leave one out");
  if (flags.shuffle) throw UsageError("--prune rest: --shuffle-contacts makes each event another one; leave one out");
}

/// --format: is the trajectory to be npz?
bool npz_flag(const std::string& format, long record_every) {
  if (format == "parquet")
    throw UsageError("--format parquet: unavailable: Debian 12 has no library that writes it; there are csv and npz");
  if (format != "csv" && format != "npz") throw UsageError(fmt::format("--format {}: must be csv or npz", format));
  if (format == "npz" && record_every == 0)
    throw UsageError("--format npz: --record-every 0 keeps no trajectory; leave one out");
  return format == "npz";
}

/// Flags, then the scenario, then both together: nothing is written before all of it is known to be right.
RunPlan make_plan(const RunFlags& flags) {
  RunPlan plan;
  plan.method = method_flag(flags.method, flags);
  constexpr const char* seconds = "a positive number of seconds";
  const Overrides overrides = set_flags(flags.set);
  std::optional<double> step, duration;
  if (flags.step) step = positive_flag("step", *flags.step, seconds);
  if (flags.duration) duration = positive_flag("duration", *flags.duration, seconds);
  if (flags.friction)
    plan.summary.friction = number_flag("friction", *flags.friction, 0, HUGE_VAL, "a coefficient of at least 0");
  if (flags.restitution)
    plan.summary.restitution = number_flag("restitution", *flags.restitution, 0, 1, "a number from 0 to 1");
  if (flags.record_every)
    plan.record_every = whole_flag("record-every", *flags.record_every, 0, 1L << 60,
                                   "a whole number of steps: 1 keeps every step, 0 none");
  if (flags.format) plan.npz = npz_flag(*flags.format, plan.record_every);
  if (flags.setting) throw UsageError(fmt::format("--setting {}: belongs to --engine; give that too", *flags.setting));
  if (!flags.knob.empty())
    throw UsageError(fmt::format("--knob {}: belongs to --engine; give that too", flags.knob[0]));
  plan.record_contacts = flags.record_contacts;
  if (plan.record_contacts && plan.record_every == 0)
    throw UsageError("--record-contacts: --record-every 0 keeps no steps; leave one out");
  if (flags.prune) prune_flag(flags, plan);
  const int jobs =
      flags.jobs ? static_cast<int>(whole_flag("jobs", *flags.jobs, 1, 1024, "a number of cores, at least 1")) : 1;
  if (flags.perturb)
    plan.summary.perturb =
        number_flag("perturb", *flags.perturb, 0, HUGE_VAL, "a length in m of at least 0, as in --perturb 1e-6");
  constexpr const char* seeds = "a whole number of at least 0";
  if (flags.seed) {
    if (!flags.perturb)
      throw UsageError(fmt::format("--seed {}: belongs to --perturb SIZE; give that too", *flags.seed));
    plan.summary.seed = whole_flag("seed", *flags.seed, 0, 1L << 60, seeds);
  }
  if (flags.shuffle) plan.simulation.shuffle = whole_flag("shuffle-contacts", *flags.shuffle, 0, 1L << 60, seeds);
  if (flags.gyroscopic) {
    if (*flags.gyroscopic != "implicit" && *flags.gyroscopic != "explicit")
      throw UsageError(fmt::format("--gyroscopic {}: must be implicit or explicit", *flags.gyroscopic));
    if (*flags.gyroscopic == "explicit") plan.simulation.gyroscopic = Gyroscopic::explicit_euler;
  }
  if (flags.joint_forces && *flags.joint_forces != "implicit" && *flags.joint_forces != "explicit")
    throw UsageError(fmt::format("--joint-forces {}: must be implicit or explicit", *flags.joint_forces));
  stepping_flags(flags, plan.simulation);
  plan.conditioning = flags.conditioning;
  if (flags.time_limit) plan.time_limit_s = positive_flag("time-limit", *flags.time_limit, seconds);
  if (flags.memory_limit)
    plan.memory_limit_mb = positive_flag("memory-limit", *flags.memory_limit, "a positive number of MB");
  if (flags.save_problems) {
    if (!fclib_available()) throw UsageError(fmt::format("--save-problems: {}", fclib_unavailable_reason()));
    if (flags.save_problems->empty()) throw UsageError("--save-problems '': must name a directory");
    plan.save_problems = *flags.save_problems;
  }
  if (flags.save_every) {
    if (!flags.save_problems)
      throw UsageError(
          fmt::format("--save-every {}: says how often --save-problems DIR stores; give that too", *flags.save_every));
    plan.save_every = whole_flag("save-every", *flags.save_every, 1, 1L << 60, "a whole number of events, at least 1");
  }
  if (flags.out && flags.out->empty()) throw UsageError("--out '': must name a directory");
  method_options(flags, *plan.method, {}, {});  // the flags by themselves

  plan.scenario = load_scenario(find_scenario(flags.scenario), overrides);
  check_reference(plan.scenario);
  for (PairLaw& law : plan.scenario.pairs.laws) {
    if (plan.summary.friction) law.mu = *plan.summary.friction;
    if (plan.summary.restitution) law.restitution = *plan.summary.restitution;
  }
  if (plan.summary.perturb > 0) perturb(plan.scenario, plan.summary.perturb, plan.summary.seed);
  plan.options = method_options(flags, *plan.method, plan.scenario.k, plan.scenario.compression_bound);
  if (jobs > 1 && flags.method == "external")
    throw UsageError(fmt::format(
        "--jobs {}: --method external is one program, which is asked about one island after the other; leave one out",
        jobs));
  plan.options.threads = jobs;
  // What a solver leaves open is multiplied by the extrapolation's weights: epsilon leaves 1 kg sqrt(2 epsilon) m/s,
  // a thousandth of A a second. Below the floor doubles have nothing to give.
  constexpr double share = 1e-6, floor = 1e-22;  // J/m^2, J
  const double A = plan.simulation.accuracy;
  if (plan.simulation.stepping == Stepping::accuracy && !flags.asked("epsilon") && !flags.asked("epsilon-relative"))
    plan.options.epsilon = std::min(plan.options.epsilon, std::max(floor, share * A * A));
  plan.unavailable = unavailable_reason(*plan.method, plan.options);
  if (const std::string_view why = plan.method->law.no_expansion;
      plan.simulation.stepping == Stepping::accuracy && !why.empty())
    plan.unsupported = fmt::format("--accuracy with {}: {}; give a --step in its place", plan.method->name, why);
  take_from(plan.scenario, plan.simulation);
  if (step) plan.simulation.step = *step;
  if (duration) plan.simulation.duration = *duration;
  if (flags.joint_forces)
    plan.simulation.joint_forces =
        *flags.joint_forces == "implicit" ? JointForces::implicit : JointForces::explicit_euler;
  if (plan.simulation.stepping != Stepping::accuracy)
    check_steps(plan.simulation.step, plan.simulation.duration, plan.time_limit_s.has_value());
  plan.out = flags.out ? fs::path(*flags.out) : default_directory(flags, plan);
  plan.summary.control_eigenvalue =
      largest_eigenvalue(plan.scenario, plan.simulation.step, plan.simulation.joint_forces);
  plan.summary.largest_stable_step = largest_stable_step(plan.scenario, plan.simulation.joint_forces);
  plan.quiet = flags.quiet;
  plan.json = flags.json;
  plan.summary = provisional_summary(flags, plan);
  return plan;
}

/// Has the disk no room (which a run reports in its summary), rather than the user no right to write here?
bool is_full(int error) { return error == ENOSPC || error == EDQUOT || error == EFBIG || error == EIO; }

[[noreturn]] void refuse_directory(const fs::path& what, const std::string& why) {
  throw UsageError(fmt::format("--out: {} cannot be written: {}; name a directory that can, as in --out runs/mine",
                               what.string(), why));
}

/// Ends a run with the status that a full disk or another failure of writing has.
void fail_writing(RunSummary& summary, const std::string& path, int error) {
  summary.status = Status::write_failed;
  summary.reason = fmt::format("{} could not be written: {}", path, std::strerror(error));
  summary.finished = false;
}

bool ends_run(Status status) { return status != Status::ok && status != Status::inaccurate; }

void store_problem(const RunPlan& plan, const ContactProblem& problem, const fs::path& path, double t) {
  write_contact_problem(path.string(), problem, fmt::format("{}, t = {} s", plan.scenario.name, number_text(t)));
}

/// The contact problem that a run stumbled over: the one that ended it, or the worst that was answered beyond what is
/// accepted. First what the method was handed, or the island of the worst contact, then the whole event.
struct HardProblem {
  std::vector<ContactProblem> candidates;
  Status status = Status::ok;  ///< what came of it in the run
  double excess = 0;           ///< how far beyond what is accepted, -
  double t = 0;                ///< s
  std::string reason;
};
/// The one that a run keeps; and that of the step at hand as it is tried.
struct HardProblems {
  std::optional<HardProblem> kept, tried;
  /// The step is over: what has been tried and not forgiven is part of it.
  void take_tried() {
    if (tried && !(kept && kept->excess >= tried->excess)) kept = std::move(tried);
    tried.reset();
  }
};
constexpr const char* hard_problem_file = "hard_problem.hdf5";

/// What `solve` makes of a problem with `--prune`: status of the run's method where it knows of nothing before.
Status solve_afresh(const RunPlan& plan, const ContactProblem& problem, bool prune) {
  MethodOptions options = plan.options;
  options.warm_start = false;
  ContactSolution solution;
  const ContactMethod method =
      prune ? pruned(*plan.method, options, std::make_shared<LeftOut>()) : plan.method->make(options);
  method(problem, solution);
  std::vector<double> v_plus;
  const Residuals residuals = Referee().check(problem, solution, plan.method->law, v_plus);
  if (Referee::holds(residuals, plan.simulation.accepted_residual)) return Status::ok;
  if (solution.status != Status::ok) return solution.status;
  return residuals.finite ? Status::inaccurate : Status::not_finite;
}

/// A word as a shell takes it.
std::string quoted(const std::string& word) {
  const auto plain = [](unsigned char c) { return std::isalnum(c) != 0 || std::strchr("%+,-./:@_", c) != nullptr; };
  if (std::all_of(word.begin(), word.end(), plain)) return word;
  std::string out = "'";
  for (const char c : word) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

/// The command that solves the kept problem with the run's options and `--prune`.
std::string solve_command(const RunPlan& plan, bool prune) {
  const MethodOptions& options = plan.options;
  std::string command = fmt::format("contactbench solve {} --kind contact --method {}",
                                    quoted((plan.out / hard_problem_file).string()), plan.method->name);
  if (!options.solver.empty()) command += " --solver " + options.solver;
  if (!options.variant.empty()) command += " --variant " + options.variant;
  for (const OptionRow& row : plan.method->options) {
    const OptionValue value = value_of(row, plan.method->options, options);
    const bool asked = row.always_named || value != value_of(row, plan.method->options, MethodOptions());
    if (asked && !row.between_events && !text_of(value).empty())
      command += fmt::format(" --{} {}", row.flag, quoted(text_of(value)));
  }
  if (prune) command += " --prune on";
  return command;
}

/// A problem to keep, and the command by which it ends as it did in the run; none is known where that is empty.
struct KeptProblem {
  const ContactProblem* problem;
  std::string command;
};

/// The candidate that ends afresh as it did in the run, the last where none does: the run's method started from the
/// event before, or there was no time to try. A run leaves out islands and idle friction in any case (PrunedRun).
KeptProblem ends_so_again(const RunPlan& plan, const HardProblem& hard) {
  try {
    for (const ContactProblem& problem : hard.candidates)
      for (const bool prune : {true, false})
        if (solve_afresh(plan, problem, prune) == hard.status) return {&problem, solve_command(plan, prune)};
  } catch (const Stopped&) {  // nothing can be said of what a limit cuts short
  }
  return {&hard.candidates.back(), ""};
}

/// Keeps it beside the run's other files, for `solve`, with the command where one ends as the run did. `try_again`: is
/// there time to find out? That it cannot be written does not hide how the run ended.
void store_hard_problem(const RunPlan& plan, const HardProblem& hard, bool try_again, RunSummary& summary) {
  const KeptProblem kept = try_again ? ends_so_again(plan, hard) : KeptProblem{&hard.candidates.back(), ""};
  try {
    store_problem(plan, *kept.problem, plan.out / hard_problem_file, hard.t);
    summary.hard_problem = hard_problem_file;
    summary.hard_problem_command = kept.command;
  } catch (const FileError& error) {
    print_error(fmt::format("contactbench run: warning: {}\n", error.what()));
  }
}

/// How far beyond what is accepted an answer is, -: above 1 where the check does not hold.
double excess(const Residuals& residuals, double accepted) {
  if (!residuals.gap) return residuals.model / accepted;
  const double gap = residuals.allowed_gap > 0 ? std::abs(residuals.island_gap) / residuals.allowed_gap : HUGE_VAL;
  return std::max(gap, residuals.infeasibility.value_or(HUGE_VAL) / Referee::accepted);
}

/// Keeps the event's problem if its answer is the worst so far of those that do not hold.
void keep_worst(const RunPlan& plan, const EventRecord& event, std::optional<HardProblem>& hard) {
  const double beyond = excess(event.residuals, plan.simulation.accepted_residual);
  if (hard && !(beyond > hard->excess)) return;
  hard = {
      {}, Status::inaccurate, beyond, event.t, Referee::refusal(event.residuals, plan.simulation.accepted_residual)};
  if (event.residuals.worst_contact >= 0)
    hard->candidates.push_back(island_of(event.problem, event.residuals.worst_contact));
  hard->candidates.push_back(event.problem);
}

/// Keeps the problem that ended the run.
void keep_last(const Simulation& simulation, const LeftOut& left_out, const StepRecord& record,
               std::optional<HardProblem>& hard) {
  if (simulation.problem().nc() == 0) return;
  hard = {{}, record.status, HUGE_VAL, record.t, ""};
  if (left_out.failed) hard->candidates.push_back(*left_out.failed);
  hard->candidates.push_back(simulation.problem());
}

/// Steps to the end, to a status that ends the run, or to a stop (throws Stopped).
void go(const RunPlan& plan, Simulation& simulation, RunFiles& files, ContactFile& contacts, Limits& limits,
        SceneErrors& errors, RunSummary& summary, Progress& progress, const LeftOut& left_out, HardProblems& hard) {
  constexpr std::chrono::milliseconds between_flushes{500};
  Clock::time_point now = Clock::now(), flushed = now;
  while (!simulation.done()) {
    limits.look_at_memory(now);
    const StepRecord& record = simulation.step();
    const bool last = ends_run(record.status);
    summary.tally.observe_step(record, !last);
    hard.take_tried();
    if (!last) errors.observe_step(simulation.state(), record);

    const Clock::time_point before_writing = Clock::now();
    if (last)
      files.last_step(record);
    else
      files.step(simulation.state(), record, simulation.torque());
    contacts.step(record);
    if (before_writing - flushed > between_flushes) {
      files.flush();
      contacts.flush();
      flushed = before_writing;
    }
    now = Clock::now();
    summary.write_s += std::chrono::duration<double>(now - before_writing).count();

    if (last) {
      summary.status = record.status;
      summary.reason = simulation.reason();
      if (record.unsolved) keep_last(simulation, left_out, record, hard.kept);
      break;
    }
    if (!files.ok() || !contacts.ok()) break;
    progress.update(now, record.t, plan.simulation.duration, record.contacts);
  }
}

/// The run itself. Fills in what came of it; may throw.
void simulate(const RunPlan& plan, RunFiles& files, ContactFile& contacts, Limits& limits, SceneErrors& errors,
              RunSummary& summary) {
  RunTally& tally = summary.tally;
  PrunedRun pruned_run(plan.scenario, plan.simulation, *plan.method, plan.options, plan.prune);
  Simulation& simulation = pruned_run.simulation;
  long events = 0;
  HardProblems hard;
  bool stopped = false;
  ConditioningEstimate estimate;
  simulation.on_event = [&](const EventRecord& event) {
    if (plan.conditioning) {
      const Clock::time_point before = Clock::now();
      tally.observe_conditioning(event, estimate);
      summary.write_s += std::chrono::duration<double>(Clock::now() - before).count();
    }
    if (!plan.save_problems.empty() && events++ % plan.save_every == 0) {
      const Clock::time_point before_writing = Clock::now();
      store_problem(plan, event.problem, plan.save_problems / fmt::format("event_{:09}.hdf5", events), event.t);
      summary.write_s += std::chrono::duration<double>(Clock::now() - before_writing).count();
    }
    if (!event.trial) errors.observe_event(event);
    if (!event.trial) {
      files.event(event);
      contacts.event(event);
    }
    const bool holds = Referee::holds(event.residuals, plan.simulation.accepted_residual);
    tally.observe_event(event, holds);
    if (!holds) keep_worst(plan, event, event.trial ? hard.tried : hard.kept);
  };
  simulation.on_forgive = [&] {
    tally.forget_tried();
    hard.tried.reset();
  };
  Progress progress(!plan.quiet);
  errors.observe_start(simulation.state());
  files.start(simulation.state());

  summary.status = Status::ok;
  summary.reason.clear();
  try {
    go(plan, simulation, files, contacts, limits, errors, summary, progress, *pruned_run.left_out, hard);
  } catch (const Stopped&) {
    stopped = true;
    summary.status = limits.status();
    summary.reason = limits.reason(summary.status);
    limits.lift();
  }
  files.flush();
  contacts.flush();
  progress.clear();
  if (hard.kept) {
    summary.worst_refusal = fmt::format("{}, at t = {:.9g} s", hard.kept->reason, hard.kept->t);
    if (fclib_available()) store_hard_problem(plan, *hard.kept, !stopped, summary);
  }
  for (const LeftOutItem& item : pruned_run.items())
    if (item.count > 0) summary.left_out.emplace_back(item.name, item.count);
  for (const auto& [who, count] : pruned_run.answered_by->counts) summary.answered_by.emplace_back(who, count);
  summary.finished = simulation.done() && summary.status == Status::ok;
  if (simulation.accuracy()) summary.accuracy = *simulation.accuracy();
}

/// Says so where controllers, springs or damping cannot be stable at this step.
void warn_of_control(const RunPlan& plan) {
  const std::optional<double>& limit = plan.summary.largest_stable_step;
  if (plan.simulation.stepping == Stepping::accuracy || !limit || plan.simulation.step <= *limit) return;
  const bool implicit = plan.simulation.joint_forces == JointForces::implicit;
  print_error(
      fmt::format("contactbench run: warning: out of contact the {} step of the robots' torques is unstable at "
                  "h = {:g} s; it is stable up to --step {:.3g}{}\n",
                  implicit ? "implicit" : "explicit", plan.simulation.step, *limit,
                  implicit ? "" : ", or with --joint-forces implicit"));
}

/// From a plan to an exit code. Whatever happens on the way, there is a summary.
int execute(const RunPlan& plan) {
  warn_of_control(plan);
  Limits limits(plan.time_limit_s, plan.memory_limit_mb);
  RunSummary summary = plan.summary;

  const ProblemFolder problems(plan.save_problems);

  // The place of the summary first; then the other files, whose failure leaves no half-made run behind.
  std::error_code refused;
  fs::create_directories(plan.out, refused);
  if (refused && !is_full(refused.value())) refuse_directory(plan.out, refused.message());
  const FolderLock lock(plan.out);
  if (lock.taken() && !problems.is(plan.out)) refuse_taken("out", plan.out);
  const fs::path summary_path = plan.out / "summary.json";
  SummaryFile summary_file(summary_path, to_json(summary));
  if (!summary_file.ok() && !refused && !is_full(summary_file.error()))
    refuse_directory(summary_path, std::strerror(summary_file.error()));
  RunFiles files(plan.out, plan.scenario.model, plan.record_every, plan.scenario.shapes, plan.scenario.rotate_cone,
                 plan.simulation.stepping == Stepping::accuracy);
  if (!files.ok() && !refused && !is_full(files.error())) {
    fs::remove(summary_path, refused);
    refuse_directory(files.failed_path(), std::strerror(files.error()));
  }
  ContactFile contacts(plan.out, plan.scenario, plan.record_contacts, plan.record_every);
  if (!contacts.ok() && !is_full(contacts.error())) {
    fs::remove(summary_path, refused);
    refuse_directory(contacts.failed_path(), std::strerror(contacts.error()));
  }
  // Nothing is refused from here on: what earlier runs left may go.
  problems.clear();
  for (const char* earlier : {hard_problem_file, "trajectory.npz"}) fs::remove(plan.out / earlier, refused);

  const bool polygon = std::any_of(plan.method->options.begin(), plan.method->options.end(),
                                   [](const OptionRow& row) { return row.flag == "k"; });
  std::optional<SceneErrors> errors;
  int code = not_finished;
  try {
    errors.emplace(plan.scenario, plan.simulation, polygon ? plan.options.k : 0);
    if (!summary_file.ok()) {
      fail_writing(summary, summary_path.string(), summary_file.error());
    } else if (!plan.unavailable.empty()) {
      files.start(plan.scenario.initial);
      summary.status = Status::unavailable;
      summary.reason = plan.unavailable;
    } else if (!plan.unsupported.empty()) {
      files.start(plan.scenario.initial);
      summary.status = Status::unsupported;
      summary.reason = plan.unsupported;
    } else {
      limits.bound_memory();
      simulate(plan, files, contacts, limits, *errors, summary);
    }
  } catch (const FileError& error) {
    summary.status = Status::write_failed;
    summary.reason = error.what();
  } catch (const std::bad_alloc&) {
    summary.status = Status::memory_limit;
    summary.reason = limits.reason(Status::memory_limit);
  } catch (const std::exception& error) {
    summary.status = Status::crash;
    summary.reason = error.what();
    code = program_fault;
  }
  limits.lift();
  files.flush();
  contacts.flush();
  if (!files.ok() && summary_file.ok()) fail_writing(summary, files.failed_path(), files.error());
  if (int error = 0;
      plan.npz && files.ok() && !trajectory_as_npz(plan.out.string(), plan.scenario.model.bodies.size(), error))
    fail_writing(summary, (plan.out / "trajectory.npz").string(), error);
  if (!contacts.ok() && files.ok() && summary_file.ok())
    fail_writing(summary, contacts.failed_path(), contacts.error());
  if (summary.finished) {
    code = finished;
    if (summary.tally.inaccurate_events > 0) {
      summary.status = Status::inaccurate;
      summary.reason = fmt::format("{} of {} events beyond what is accepted; the worst: {}",
                                   summary.tally.inaccurate_events, summary.tally.events, summary.worst_refusal);
    }
  }
  if (errors) summary.errors = errors->finish();
  summary.peak_memory_mb = peak_memory_mb();
  summary.wall_s = std::chrono::duration<double>(Clock::now() - limits.start()).count();

  const std::string json = to_json(summary);
  if (!summary_file.replace(json)) {
    if (code == finished) code = not_finished;
    print_error(json);
  }
  if (code != finished)
    print_error(fmt::format("contactbench run: {}: {} (at t = {:g} s; {})\n", name(summary.status), summary.reason,
                            summary.tally.t_reached, summary_file.ok() ? plan.out.string() : "the summary is above"));
  if (summary.accuracy && summary.accuracy->estimated_error > summary.simulation.accuracy)
    print_error(
        fmt::format("contactbench run: warning: the error is estimated to be up to {:.3g} m, of {:g} m wanted\n",
                    summary.accuracy->estimated_error, summary.simulation.accuracy));
  if (plan.json)
    fmt::print("{}", json);
  else if (!plan.quiet)
    fmt::print("{}  files       {}\n", to_text(summary), plan.out.string());
  return code;
}

/// The flags of a run of an engine. Throws UsageError for those that only methods have.
EngineRunFlags engine_flags(const RunFlags& flags) {
  const std::vector<std::pair<const char*, bool>> of_methods = {
      {"method", !flags.method.empty()},        {"solver", flags.solver.has_value()},
      {"prune", flags.prune.has_value()},       {"shuffle-contacts", flags.shuffle.has_value()},
      {"order", flags.order.has_value()},       {"gyroscopic", flags.gyroscopic.has_value()},
      {"stepping", flags.stepping.has_value()}, {"accuracy", flags.accuracy.has_value()},
      {"conditioning", flags.conditioning},     {"record-interval", flags.record_interval.has_value()},
      {"format", flags.format.has_value()},     {"joint-forces", flags.joint_forces.has_value()},
      {"jobs", flags.jobs.has_value()},         {"record-contacts", flags.record_contacts}};
  const auto refuse = [&](std::string_view flag) {
    throw UsageError(fmt::format("--{}: belongs to methods; leave it or --engine {} out", flag, *flags.engine));
  };
  for (const auto& [flag, given] : of_methods)
    if (given) refuse(flag);
  for (const auto& [flag, value] : flags.own)
    if (value) refuse(flag);
  if (flags.seed && !flags.perturb)
    throw UsageError(fmt::format("--seed {}: belongs to --perturb SIZE; give that too", *flags.seed));
  return {flags.scenario,   *flags.engine,    flags.variant,      flags.setting,      flags.restitution,
          flags.friction,   flags.step,       flags.duration,     flags.record_every, flags.perturb,
          flags.seed,       flags.time_limit, flags.memory_limit, flags.out,          flags.save_problems,
          flags.save_every, flags.set,        flags.knob,         flags.quiet,        flags.json};
}

}  // namespace

void add_run(CLI::App& program, Action& action) {
  CLI::App& run = *program.add_subcommand("run", "simulate one scene with one method");
  const auto flags = std::make_shared<RunFlags>();
  const auto add = [&](const char* flag, Text& value, const char* type, const char* summary) {
    run.add_option(flag, value, summary)->type_name(type);
  };
  run.add_option("scenario", flags->scenario, "a scenario's XML file, or the name of one that comes with the program")
      ->required()
      ->type_name("SCENARIO.xml");
  CLI::Option* method = run.add_option("--method", flags->method, "contact model: see contactbench list methods");
  method->type_name("METHOD");
  add("--engine", flags->engine, "ENGINE",
      "in place of --method: another program's engine, see contactbench list engines");
  add("--setting", flags->setting, "default|tuned", "of --engine: which values of its knobs [default]");
  run.add_option("--knob", flags->knob, "of --engine: a value for one of its knobs; may be repeated")
      ->type_name("NAME=VALUE")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  add_method_flags(run, *flags, false);
  add("--restitution", flags->restitution, "E", "override every contact pair, 0 to 1 [scenario]");
  add("--friction", flags->friction, "MU", "override every contact pair, at least 0 [scenario]");
  add("--step", flags->step, "S", "step size in s [scenario]");
  add("--stepping", flags->stepping, "events|steps|accuracy", "how time goes on: docs/stepping.md [events]");
  add("--accuracy", flags->accuracy, "M",
      "in place of --step: steps by which no body is off by more than M metres at any time [none]");
  add("--order", flags->order, "P", "of --accuracy: base steps of the finest sequence, 2 to 8 [by the accuracy]");
  add("--record-interval", flags->record_interval, "S",
      "of --accuracy: steps end at multiples of S seconds [wherever they end]");
  add("--duration", flags->duration, "S", "simulated time in s [scenario]");
  run.add_option("--set", flags->set, "a parameter that the scenario declares; may be repeated")
      ->type_name("NAME=VALUE")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  add("--perturb", flags->perturb, "M", "move and turn each free body at the start by M metres, at random [0]");
  add("--seed", flags->seed, "N", "of --perturb [0]");
  add("--shuffle-contacts", flags->shuffle, "SEED",
      "hand the contacts of each event over in a random order; 0: do not [0]");
  add("--gyroscopic", flags->gyroscopic, "implicit|explicit",
      "how a free body's tumbling is stepped; explicit gains energy, as in the paper [implicit]");
  run.add_flag("--conditioning", flags->conditioning,
               "measure rank and condition of the contact problems (slow; the worst is in the summary)");
  add("--joint-forces", flags->joint_forces, "explicit|implicit",
      "springs, dampers and gains of robots: of the start of a step, or of its end to first order [scenario]");
  add("--prune", flags->prune, "on|off|rest",
      "leave out what the scene does not need; rest: solving what rests again, too (docs/performance.md) [on]");
  add("--jobs", flags->jobs, "N", "solve the islands of an event on N cores at once: the same numbers [1]");
  add("--record-every", flags->record_every, "N",
      "keep each N-th step in trajectory.csv and steps.csv; 0: neither file [1]");
  add("--format", flags->format, "csv|npz",
      "of the trajectory: trajectory.csv, or trajectory.npz, made of it at the end [csv]");
  run.add_flag("--record-contacts", flags->record_contacts,
               "contacts.csv and shapes.csv besides: each contact of the steps that are kept, for scripts/view.py");
  add("--save-problems", flags->save_problems, "DIR",
      "store the contact problems of the events as FCLIB files, for solve [none]");
  add("--save-every", flags->save_every, "N", "store each N-th event's problem only [1]");
  add("--time-limit", flags->time_limit, "S", "stop after S seconds of waiting, keep what there is [none]");
  add("--memory-limit", flags->memory_limit, "MB", "stop beyond MB of memory, keep what there is [none]");
  add("--out", flags->out, "DIR", "where the files go [results/runs/<scenario>__<method>...]");
  run.add_flag("--quiet", flags->quiet, "no progress and no summary");
  run.add_flag("--json", flags->json, "the summary as JSON on standard output");
  run.callback([flags, method, &action] {
    if (method->count() == 0 && !flags->engine) throw CLI::RequiredError("--method");
    action = [flags] { return flags->engine ? run_engine(engine_flags(*flags)) : execute(make_plan(*flags)); };
  });
}

}  // namespace cb
