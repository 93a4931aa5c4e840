// Runs of scenes: what `contactbench run` does, kept in arrays in place of files.
#include "run.h"

#include <fmt/format.h>
#include <pybind11/stl.h>

#include <chrono>
#include <cmath>
#include <deque>
#include <limits>

#include "../app/commands.h"
#include "../app/versions.h"
#include "answers.h"
#include "evaluation/references.h"
#include "evaluation/scene_errors.h"
#include "interrupt.h"
#include "linalg/stop.h"
#include "output/machine.h"
#include "output/summary.h"
#include "scenario/scenario.h"
#include "simulation/explicit_step.h"
#include "simulation/left_out.h"

namespace cb::python {

namespace {

/// A run that is known to be possible.
struct Plan {
  Scenario scenario;
  Chosen method;
  SimulationOptions simulation;
  std::optional<double> friction, restitution, time_limit_s;
  bool prune = true;
  long record_every = 1;
};

const std::vector<std::string> run_options = {"law",   "set",      "step",        "duration",     "friction",
                                              "prune", "stepping", "restitution", "record_every", "time_limit"};

std::optional<double> given(const py::dict& options, const char* name, double least, double most) {
  if (!options.contains(name) || options[name].is_none()) return {};
  const double x = number_option(name, options[name]);
  if (x < least || x > most)
    throw ArgumentError(fmt::format(
        "{}: is {:g}; it must be {}", name, x,
        std::isfinite(most) ? fmt::format("from {:g} to {:g}", least, most) : fmt::format("at least {:g}", least)));
  return x;
}

std::optional<double> positive(const py::dict& options, const char* name) {
  const auto x = given(options, name, 0, HUGE_VAL);
  if (x && *x == 0) throw ArgumentError(fmt::format("{}: must be positive", name));
  return x;
}

/// A switch as Python or as the flags of the program have it.
bool on_or_off(const char* name, const py::object& value) {
  if (!py::isinstance<py::str>(value)) return py::bool_(value);
  const auto word = value.cast<std::string>();
  if (word != "on" && word != "off")
    throw ArgumentError(fmt::format("{}: is '{}'; it must be True or False, or on or off", name, word));
  return word == "on";
}

Overrides overrides_of(const py::dict& options) {
  Overrides out;
  if (!options.contains("set") || options["set"].is_none()) return out;
  if (!py::isinstance<py::dict>(options["set"]))
    throw ArgumentError("set: must be a dict of the scene's parameters, as in set={'boxes': 8}");
  for (const auto& [key, value] : options["set"].cast<py::dict>())
    out.emplace_back(py::str(key).cast<std::string>(), py::str(value).cast<std::string>());
  return out;
}

Plan plan_of(const std::string& scene, const py::object& method, const py::dict& options) {
  Plan plan;
  plan.scenario = load_scenario(find_scenario(scene), overrides_of(options));
  check_reference(plan.scenario);
  plan.friction = given(options, "friction", 0, HUGE_VAL);
  plan.restitution = given(options, "restitution", 0, 1);
  for (PairLaw& law : plan.scenario.pairs.laws) {
    law.mu = plan.friction.value_or(law.mu);
    law.restitution = plan.restitution.value_or(law.restitution);
  }
  plan.time_limit_s = positive(options, "time_limit");
  take_from(plan.scenario, plan.simulation);
  plan.simulation.step = positive(options, "step").value_or(plan.simulation.step);
  plan.simulation.duration = positive(options, "duration").value_or(plan.simulation.duration);
  const double every = given(options, "record_every", 1, 1e15).value_or(1);
  if (every != std::floor(every)) throw ArgumentError(fmt::format("record_every: is {:g}; it must be whole", every));
  plan.record_every = std::lround(every);
  if (options.contains("prune") && !options["prune"].is_none()) {
    const py::object prune = options["prune"];
    plan.simulation.prune.repeats = py::isinstance<py::str>(prune) && prune.cast<std::string>() == "rest";
    plan.prune = plan.simulation.prune.repeats || on_or_off("prune", prune);
  }
  if (plan.simulation.duration / plan.simulation.step > 1e12)
    throw ArgumentError(fmt::format("step: is {:g} s; {:g} s would take more than 1e12 steps", plan.simulation.step,
                                    plan.simulation.duration));
  if (options.contains("stepping") && !options["stepping"].is_none()) {
    const auto stepping = py::str(options["stepping"]).cast<std::string>();
    if (stepping != "events" && stepping != "steps")
      throw ArgumentError(fmt::format("stepping: is '{}'; it must be 'events' or 'steps'", stepping));
    if (stepping == "steps") plan.simulation.stepping = Stepping::steps;
  }
  const py::object law = options.contains("law") ? options["law"].cast<py::object>() : py::none();
  plan.method = choose(method, law, options, run_options, plan.scenario.k, plan.scenario.compression_bound);
  return plan;
}

/// Rows of numbers as they come.
struct Table {
  std::vector<double> values;
  std::size_t rows = 0;
  py::array_t<double> array(std::vector<py::ssize_t> shape) const {
    shape.insert(shape.begin(), static_cast<py::ssize_t>(rows));
    return py::array_t<double>(shape, values.data());
  }
};

/// What is kept of a run.
class Recording {
 public:
  void state(const State& state) {
    const auto add = [&](Table& to, std::initializer_list<double> more) { to.values.insert(to.values.end(), more); };
    for (std::size_t b = 0; b < state.pose.size(); ++b) {
      const Pose& pose = state.pose[b];
      const double* v = &state.v[6 * b];
      add(position_, {pose.p.x(), pose.p.y(), pose.p.z()});
      add(orientation_, {pose.q.w(), pose.q.x(), pose.q.y(), pose.q.z()});
      add(velocity_, {v[0], v[1], v[2]});
      add(rotation_, {v[3], v[4], v[5]});
    }
    q_.values.insert(q_.values.end(), state.q.begin(), state.q.end());
    t_.values.push_back(state.t);
    for (Table* table : {&t_, &position_, &orientation_, &velocity_, &rotation_, &q_}) ++table->rows;
  }
  void step(const StepRecord& record) {
    const auto number = [](const std::optional<double>& x) {
      return x.value_or(std::numeric_limits<double>::quiet_NaN());
    };
    const bool event = record.events > 0;
    const double row[] = {record.t,
                          double(record.events),
                          double(record.contacts),
                          double(record.iterations),
                          event ? record.residual : number({}),
                          number(record.law_residual),
                          record.event_energy_gain,
                          record.max_penetration,
                          record.kinetic_energy,
                          record.potential_energy,
                          record.times.solve_s,
                          record.times.step_s};
    steps_.values.insert(steps_.values.end(), std::begin(row), std::end(row));
    ++steps_.rows;
    status_.append(std::string(name(record.status)));
  }
  py::dict arrays(const Model& model) const {
    py::dict out;
    py::list names, joints;
    for (const Body& body : model.bodies) names.append(body.name);
    for (const Tree& tree : model.trees)
      for (const Joint& joint : tree.joints)
        if (joint.q >= 0) joints.append(joint.name);
    const auto n = static_cast<py::ssize_t>(model.bodies.size());
    out["bodies"] = names;
    out["t"] = t_.array({});
    out["position"] = position_.array({n, 3});
    out["orientation"] = orientation_.array({n, 4});
    out["velocity"] = velocity_.array({n, 3});
    out["angular_velocity"] = rotation_.array({n, 3});
    out["joints"] = joints;
    out["q"] = q_.array({static_cast<py::ssize_t>(t_.rows > 0 ? q_.values.size() / t_.rows : 0)});
    py::dict steps;
    const char* columns[] = {"t",
                             "events",
                             "contacts",
                             "iterations",
                             "residual",
                             "law_residual",
                             "event_energy_gain",
                             "max_penetration",
                             "kinetic_energy",
                             "potential_energy",
                             "solve_s",
                             "step_s"};
    const py::array_t<double> table = steps_.array({static_cast<py::ssize_t>(std::size(columns))});
    for (std::size_t i = 0; i < std::size(columns); ++i)
      steps[columns[i]] = table[py::make_tuple(py::slice(py::none(), py::none(), py::none()), i)].cast<py::object>();
    steps["status"] = status_;
    out["steps"] = steps;
    return out;
  }

 private:
  Table t_, position_, orientation_, velocity_, rotation_, q_, steps_;
  py::list status_;
};

RunSummary summary_of(const Plan& plan) {
  RunSummary summary;
  describe(plan.scenario, summary);
  describe(*plan.method.row, plan.method.options, summary);
  summary.simulation = plan.simulation;
  summary.friction = plan.friction;
  summary.restitution = plan.restitution;
  summary.record_every = plan.record_every;
  summary.prune = plan.prune;
  summary.time_limit_s = plan.time_limit_s;
  summary.versions = versions();
  const SimulationOptions& simulation = plan.simulation;
  summary.control_eigenvalue = largest_eigenvalue(plan.scenario, simulation.step, simulation.joint_forces);
  summary.largest_stable_step = largest_stable_step(plan.scenario, simulation.joint_forces);
  return summary;
}

bool goes_on(Status status) { return status == Status::ok || status == Status::inaccurate; }

/// Steps to the end, or to a status that ends the run.
void go(const Plan& plan, PrunedRun& run, SceneErrors& errors, Recording& recording, RunSummary& summary) {
  Simulation& simulation = run.simulation;
  const double accepted = plan.simulation.accepted_residual;
  simulation.on_event = [&](const EventRecord& event) {
    errors.observe_event(event);
    const bool holds = Referee::holds(event.residuals, accepted);
    summary.tally.observe_event(event, holds);
    if (!holds && summary.worst_refusal.empty())
      summary.worst_refusal = fmt::format("{}, at t = {:.9g} s", Referee::refusal(event.residuals, accepted), event.t);
  };
  errors.observe_start(simulation.state());
  recording.state(simulation.state());
  while (!simulation.done()) {
    const StepRecord& record = simulation.step();
    const bool last = !goes_on(record.status);
    summary.tally.observe_step(record, !last);
    if (!last) errors.observe_step(simulation.state(), record);
    const bool wanted = record.step % plan.record_every == 0;
    if (wanted && !last) recording.state(simulation.state());
    if (wanted || last) recording.step(record);
    if (!last) continue;
    summary.status = record.status;
    summary.reason = simulation.reason();
    return;
  }
  summary.finished = true;
  if (summary.tally.inaccurate_events == 0) return;
  summary.status = Status::inaccurate;
  summary.reason = fmt::format("{} of {} events beyond what is accepted; the first: {}",
                               summary.tally.inaccurate_events, summary.tally.events, summary.worst_refusal);
}

py::dict simulate(const std::string& scene, const py::object& method, const py::dict& options) {
  const Plan plan = plan_of(scene, method, options);
  RunSummary summary = summary_of(plan);
  const auto start = std::chrono::steady_clock::now();
  Recording recording;
  if (!plan.method.unavailable.empty()) {
    recording.state(plan.scenario.initial);
    summary.status = Status::unavailable;
    summary.reason = plan.method.unavailable;
  } else {
    const bool polygon = plan.method.row->law.polygon_edges != nullptr;
    SceneErrors errors(plan.scenario, plan.simulation, polygon ? plan.method.options.k : 0);
    PrunedRun run(plan.scenario, plan.simulation, *plan.method.row, plan.method.options, plan.prune);
    Interruptible interruptible(plan.time_limit_s);
    try {
      go(plan, run, errors, recording, summary);
    } catch (const Stopped&) {
      summary.status = interruptible.stopped();
      summary.reason = interruptible.reason();
    }
    for (const LeftOutItem& item : run.items())
      if (item.count > 0) summary.left_out.emplace_back(item.name, item.count);
    for (const auto& [who, count] : run.answered_by->counts) summary.answered_by.emplace_back(who, count);
    summary.errors = errors.finish();
  }
  summary.peak_memory_mb = peak_memory_mb();
  summary.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  py::dict out = recording.arrays(plan.scenario.model);
  out["summary"] = to_json(summary);
  return out;
}

/// The problems that a run meets, one by one.
class Events {
 public:
  Events(const std::string& scene, const py::object& method, const py::dict& options)
      : plan_(plan_of(scene, method, options)), left_s_(plan_.time_limit_s) {
    if (!plan_.method.unavailable.empty()) throw ArgumentError(plan_.method.unavailable);
    run_.emplace(plan_.scenario, plan_.simulation, *plan_.method.row, plan_.method.options, plan_.prune);
    run_->simulation.on_event = [this](const EventRecord& event) {
      auto problem = std::make_unique<Problem>();
      problem->stored.problem = event.problem;
      problem->t = event.t;
      met_.push_back(std::move(problem));
    };
  }
  std::unique_ptr<Problem> next() {
    if (left_s_ && !(*left_s_ > 0)) ended_ = true;
    if (met_.empty() && !ended_) {
      const auto start = std::chrono::steady_clock::now();
      Interruptible interruptible(left_s_);
      try {
        while (met_.empty() && !ended_) ended_ = run_->simulation.done() || !goes_on(run_->simulation.step().status);
      } catch (const Stopped&) {
        interruptible.stopped();
        ended_ = true;
      }
      if (left_s_) *left_s_ -= std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    }
    if (met_.empty()) throw py::stop_iteration();
    std::unique_ptr<Problem> first = std::move(met_.front());
    met_.pop_front();
    return first;
  }

 private:
  Plan plan_;
  std::optional<double> left_s_;  // of the limit: what whoever takes the problems does in between does not count
  std::optional<PrunedRun> run_;
  std::deque<std::unique_ptr<Problem>> met_;
  bool ended_ = false;
};

}  // namespace

void add_run(py::module_& module) {
  module.def("simulate", &simulate, py::arg("scene"), py::arg("method"), py::arg("options"));
  module.def("bundled", &bundled_scenarios);
  py::class_<Events>(module, "Events")
      .def(py::init<const std::string&, const py::object&, const py::dict&>())
      .def("__iter__", [](py::object self) { return self; })
      .def("__next__", &Events::next);
}

}  // namespace cb::python
