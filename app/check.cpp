#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "bound_notes.h"
#include "commands.h"
#include "contact/feasibility.h"
#include "evaluation/references.h"
#include "flags.h"
#include "geometry/broad_phase.h"
#include "method_flags.h"
#include "output/summary.h"
#include "print_json.h"
#include "run_engine.h"
#include "scenario/scenario.h"
#include "simulation/explicit_step.h"
#include "simulation/left_out.h"

namespace cb {

namespace {

using Json = nlohmann::ordered_json;

std::string vector_text(const Vec3& v) { return fmt::format("({:g}, {:g}, {:g})", v[0], v[1], v[2]); }

/// "2 box, 1 half_space, 3 hull (8 to 20 vertices)"
std::string shapes_text(const std::vector<Shape>& shapes) {
  std::map<std::string_view, int> counts;
  std::size_t least = std::numeric_limits<std::size_t>::max(), most = 0;
  for (const Shape& shape : shapes) {
    ++counts[cb::name(shape.kind)];
    if (shape.kind != ShapeKind::hull) continue;
    least = std::min(least, shape.hull->polytope.vertices.size());
    most = std::max(most, shape.hull->polytope.vertices.size());
  }
  std::string text;
  for (const auto& [kind, count] : counts) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, kind);
  if (most > 0)
    text.insert(text.find("hull") + 4,
                least == most ? fmt::format(" ({} vertices)", most) : fmt::format(" ({} to {} vertices)", least, most));
  return text;
}

/// Contact points of the initial state, and how many pairs of shapes they are on.
std::pair<std::size_t, int> contacts_at_start(const Scenario& scenario) {
  std::vector<Motion> motions;
  for (const Shape& shape : scenario.shapes) {
    Motion motion;
    motion.pose = shape.local;
    if (shape.body >= 0) {
      const Pose& body = scenario.initial.pose[static_cast<std::size_t>(shape.body)];
      motion.pose = {body * shape.local.p, body.q * shape.local.q};
    }
    motions.push_back(motion);
  }
  const double closed = SimulationOptions().closed_gap;
  BroadPhase broad_phase;
  std::vector<ContactPoint> points;
  int pairs = 0;
  const auto declared = [&](int i, int j) { return scenario.can_touch(i, j); };
  for (const auto& [i, j] : broad_phase.pairs(scenario.shapes, motions, 1e-6, 0, declared)) {
    const Shape& a = scenario.shapes[static_cast<std::size_t>(i)];
    const Shape& b = scenario.shapes[static_cast<std::size_t>(j)];
    const std::size_t before = points.size();
    contact_points(a, motions[static_cast<std::size_t>(i)].pose, i, b, motions[static_cast<std::size_t>(j)].pose, j,
                   closed * std::min(a.size(), b.size()), points);
    if (points.size() > before) ++pairs;
  }
  return {points.size(), pairs};
}

std::string gravity_text(const Gravity& gravity) {
  std::string text = vector_text(gravity.constant) + " m/s^2";
  for (int axis = 0; axis < 3; ++axis) {
    const Harmonic& wave = gravity.harmonic[axis];
    if (wave.amplitude != 0)
      text += fmt::format(" + {} {:g} cos({:g} t + {:g})", "xyz"[axis], wave.amplitude, wave.frequency, wave.phase);
  }
  return text;
}

/// Which ways of stepping fit the scene (docs/stepping.md), a line each. `row`: the method, or nullptr.
std::vector<std::string> stepping_notes(const Scenario& scenario, const MethodRow* row) {
  constexpr int many = 8;  // bodies that can meet each other: their impacts come one by one
  std::vector<std::string> notes;
  if (row != nullptr && !row->law.no_expansion.empty()) {
    notes.push_back(fmt::format("--accuracy is none of {}'s: {}", row->name, row->law.no_expansion));
  } else {
    const bool bounces = std::any_of(scenario.pairs.laws.begin(), scenario.pairs.laws.end(),
                                     [](const PairLaw& law) { return law.restitution > 0; });
    const bool polygon = row != nullptr && row->law.polygon_edges;
    notes.push_back(
        fmt::format("--accuracy A (m): steps as long as the error lets them be{}{}",
                    polygon ? "; slip that turns switches from facet to facet" : "",
                    bounces ? "; impacts are located, bounces too low to matter at A are left out and counted" : ""));
  }
  std::vector<char> meets(scenario.model.bodies.size(), 0);
  std::vector<int> free;
  for (int i = 0; i < static_cast<int>(scenario.shapes.size()); ++i)
    if (scenario.shapes[static_cast<std::size_t>(i)].body >= 0) free.push_back(i);
  for (const int i : free)
    for (const int j : free) {
      if (j >= i) break;
      const int a = scenario.shapes[static_cast<std::size_t>(i)].body;
      const int b = scenario.shapes[static_cast<std::size_t>(j)].body;
      if (a != b && scenario.pairs.find(i, j) != nullptr)
        meets[static_cast<std::size_t>(a)] = meets[static_cast<std::size_t>(b)] = 1;
    }
  if (const auto bodies = std::count(meets.begin(), meets.end(), 1); bodies >= many)
    notes.push_back(
        fmt::format("--stepping steps: {} bodies can meet each other; one problem a step, first order", bodies));
  return notes;
}

/// What no run of the scene needs, and why.
std::vector<std::string> left_out(const Scenario& scenario) {
  std::vector<std::string> all = scenario.left_out;
  if (scenario.model.trees.empty()) all.emplace_back("articulated bodies, joints.csv: no robot");
  if (scenario.controllers.empty()) all.emplace_back("controllers: none");
  const auto fixed =
      std::count_if(scenario.shapes.begin(), scenario.shapes.end(), [](const Shape& shape) { return shape.body < 0; });
  if (fixed > 0) all.push_back(fmt::format("{} fixed shapes from contact problems: they do not move", fixed));
  return all;
}

/// What the first steps of a run leave out.
struct Trial {
  long steps = 0;
  std::string ending;  ///< ", then ..." where the run stops before
  std::string failed;  ///< the same without the "then"
  std::vector<std::string> left_out;
};
Trial try_steps(const Scenario& scenario, const MethodRow& row, long steps) {
  Trial trial;
  const MethodOptions options = method_options({}, row, scenario.k, scenario.compression_bound);
  if (const std::string reason = unavailable_reason(row, options); !reason.empty()) {
    trial.failed = reason;
    trial.ending = ": " + reason;
    return trial;
  }
  SimulationOptions simulation;
  take_from(scenario, simulation);
  PrunedRun run(scenario, simulation, row, options, true);
  for (steps = std::min(steps, run.simulation.steps_total()); trial.steps < steps; ++trial.steps) {
    const Status status = run.simulation.step().status;
    if (status == Status::ok || status == Status::inaccurate) continue;
    trial.failed = fmt::format("{}: {}", cb::name(status), run.simulation.reason());
    trial.ending = ", then " + trial.failed;
    break;
  }
  for (const LeftOutItem& item : run.items())
    if (item.count > 0) trial.left_out.push_back(fmt::format("{} {}: {}", item.count, item.name, item.why));
  return trial;
}

/// Why a run ends in its first step whatever its method: what the simulation refuses by itself, or contacts that no
/// velocity satisfies. Empty where nothing of it is so.
std::string fault_at_start(const Scenario& scenario) {
  SimulationOptions options;
  take_from(scenario, options);
  // Looks at the first event and ends the step there.
  std::string impossible;
  const ContactMethod look = [&](const ContactProblem& problem, ContactSolution& solution) {
    if (!feasible(problem)) impossible = "infeasible: no velocity lets none of the contacts approach";
    solution.impulse.assign(3 * static_cast<std::size_t>(problem.nc()), 0.0);
    solution.status = Status::unavailable;
  };
  Simulation simulation(scenario, options, look, newton_law());
  const Status status = simulation.step().status;
  if (!impossible.empty()) return impossible;
  if (status == Status::ok || status == Status::inaccurate || status == Status::unavailable) return {};
  return fmt::format("{}: {}", cb::name(status), simulation.reason());
}

/// --files: what a change of changes the scene, for programs that keep results.
int print_files(const Scenario& scenario) {
  for (const std::string& file : scenario.files) fmt::print("{}\n", file);
  return finished;
}

/// The command line of `check`.
struct CheckFlags {
  std::string scenario;
  Text method, steps;
  std::vector<std::string> set;
  bool files = false, json = false;
  // Of the preflight of an engine.
  Text engine, variant, setting, step;
};

/// What is in the scene, and what was found of it, for programs. `trial`: null where no method was tried.
Json as_json(const Scenario& scenario, const MethodRow* row, const std::vector<std::string>& notes, const Trial* trial,
             const std::string& fault) {
  Json json = {{"name", scenario.name}, {"title", scenario.title}, {"file", scenario.file}, {"files", scenario.files}};
  double mass = 0;
  for (const Body& body : scenario.model.bodies) mass += body.mass;
  json["bodies"] = scenario.model.bodies.size();
  json["mass_kg"] = mass;
  json["shapes"] = Json::object();
  for (const Shape& shape : scenario.shapes) {
    Json& count = json["shapes"][std::string(cb::name(shape.kind))];
    count = count.is_null() ? 1 : count.get<int>() + 1;
  }
  json["pairs"] = Json::array();
  for (const PairLaw& law : scenario.pairs.laws)
    json["pairs"].push_back({{"friction", law.mu}, {"restitution", law.restitution}});
  const Vec3& g = scenario.gravity.constant;
  json["gravity_m_per_s2"] = {g[0], g[1], g[2]};
  json["gravity"] = gravity_text(scenario.gravity);
  json["forces"] = scenario.forces.size();
  json["step_s"] = scenario.step;
  json["duration_s"] = scenario.duration;
  json["k"] = scenario.k ? Json(*scenario.k) : Json();
  json["rotate_cone_rad"] = scenario.rotate_cone;
  json["compression_bound"] = scenario.compression_bound ? Json(*scenario.compression_bound) : Json();
  json["parameters"] = Json::object();
  for (const auto& [key, value] : scenario.parameters) json["parameters"][key] = value;
  json["reference"] = {{"kind", cb::name(scenario.reference.kind)}, {"name", scenario.reference.name}};
  json["robots"] = Json::array();
  for (const Tree& tree : scenario.model.trees)
    json["robots"].push_back({{"name", tree.name}, {"links", tree.joints.size()}, {"freedoms", tree.nv}});
  json["controllers"] = Json::array();
  for (const ControllerSpec& controller : scenario.controllers) json["controllers"].push_back(controller.row->name);
  json["joint_forces"] = scenario.implicit_joints ? "implicit" : "explicit";
  const auto limit =
      largest_stable_step(scenario, scenario.implicit_joints ? JointForces::implicit : JointForces::explicit_euler);
  json["largest_stable_step_s"] = limit ? Json(*limit) : Json();
  const auto [points, pairs] = contacts_at_start(scenario);
  json["contacts_at_start"] = points;
  json["pairs_at_start"] = pairs;
  json["method"] = row ? Json(row->name) : Json();
  json["notes"] = notes;
  json["stepping"] = stepping_notes(scenario, row);
  json["left_out"] = left_out(scenario);
  json["trial"] =
      trial ? Json({{"steps", trial->steps}, {"left_out", trial->left_out}, {"failed", trial->failed}}) : Json();
  json["fault"] = fault;
  return json;
}

/// What is known of the method with this scene, before it is tried.
std::vector<std::string> notes_for(const Scenario& scenario, const MethodRow* row) {
  const auto bounds = [](const OptionRow& option) { return option.flag == "compression-bound"; };
  const bool bounded = row && std::any_of(row->options.begin(), row->options.end(), bounds) &&
                       scenario.compression_bound.value_or(MethodOptions().compression_bound);
  return bounded ? bound_notes(scenario) : std::vector<std::string>();
}

int end_of_check(const Scenario& scenario, const std::string& fault) {
  if (fault.empty()) return finished;
  print_error(fmt::format("contactbench check: a run of {} does not finish: {}\n", scenario.name, fault));
  return not_finished;
}

int check_as_json(const Scenario& scenario, const MethodRow* row, long steps) {
  std::string fault = fault_at_start(scenario);
  std::optional<Trial> trial;
  if (row) trial = try_steps(scenario, *row, steps);
  if (trial && !trial->failed.empty()) fault = trial->failed;
  print(as_json(scenario, row, notes_for(scenario, row), trial ? &*trial : nullptr, fault), true);
  return end_of_check(scenario, fault);
}

/// "boxes = 5: number of boxes (a whole number of at least 1) [3]"
std::string parameter_text(const Scenario& scenario, std::size_t i) {
  const auto& [key, value] = scenario.parameters[i];
  const ParameterNote& note = scenario.parameter_notes[i];
  return fmt::format("{} = {}{}{} ({}{}{}) [{}]", key, value, note.description.empty() ? "" : ": ", note.description,
                     note.takes, note.unit.empty() ? "" : ", ", note.unit, note.default_value);
}

/// Flags of the other kind of check are no use: of an engine's, or of a scene's.
void refuse_others(const CheckFlags& flags) {
  const std::vector<std::pair<std::string_view, bool>> of_scene = {{"--method", flags.method.has_value()},
                                                                   {"--steps", flags.steps.has_value()},
                                                                   {"--set", !flags.set.empty()},
                                                                   {"--files", flags.files}},
                                                       of_engine = {{"--variant", flags.variant.has_value()},
                                                                    {"--setting", flags.setting.has_value()},
                                                                    {"--step", flags.step.has_value()}};
  for (const auto& [flag, given] : flags.engine ? of_scene : of_engine) {
    if (given && flags.engine)
      throw UsageError(fmt::format("{}: belongs to a scene; --engine {} is checked without one", flag, *flags.engine));
    if (given) throw UsageError(fmt::format("{}: belongs to --engine; give that too", flag));
  }
}

int check(const CheckFlags& flags) {
  const std::string& name = flags.scenario;
  const auto& [method, trial_steps, set, files] = std::tie(flags.method, flags.steps, flags.set, flags.files);
  const Overrides overrides = set_flags(set);
  if (method == "external")  // check has no --command to ask for
    throw UsageError("--method external: check tries the program's own methods; leave it out, and run the scene by it");
  const std::shared_ptr<const MethodRow> row = method ? method_flag(*method, {}) : nullptr;
  if (trial_steps && !row)
    throw UsageError(fmt::format("--steps {}: says how long --method METHOD is tried; give that too", *trial_steps));
  const long steps = trial_steps ? whole_flag("steps", *trial_steps, 0, 1L << 60, "a whole number of steps") : 100;
  const Scenario scenario = load_scenario(find_scenario(name), overrides);
  check_reference(scenario);
  if (files) return print_files(scenario);
  if (flags.json) return check_as_json(scenario, row.get(), steps);

  const auto line = [](std::string_view key, const std::string& value) { fmt::print("  {:<12}{}\n", key, value); };
  fmt::print("{}: {}\n", scenario.name, scenario.title);
  line("file", scenario.file);
  double mass = 0;
  for (const Body& body : scenario.model.bodies) mass += body.mass;
  line("bodies", fmt::format("{} that move, {:g} kg together", scenario.model.bodies.size(), mass));
  line("shapes", shapes_text(scenario.shapes));
  for (const PairLaw& law : scenario.pairs.laws)
    line("pairs", fmt::format("friction {:g}, restitution {:g}", law.mu, law.restitution));
  line("gravity", gravity_text(scenario.gravity));
  for (const Force& force : scenario.forces)
    line("force", fmt::format("{} N on {} from {:g} to {:g} s", vector_text(force.force),
                              scenario.model.bodies[static_cast<std::size_t>(force.body)].name, force.from, force.to));
  line("step", fmt::format("{:g} s, {:g} s in all", scenario.step, scenario.duration));
  if (scenario.k) line("k", fmt::format("{} edges of the friction polygon (ap)", *scenario.k));
  if (scenario.rotate_cone != 0)
    line("rotate_cone", fmt::format("friction directions turned by {:g} rad", scenario.rotate_cone));
  if (scenario.compression_bound) line("bound", *scenario.compression_bound ? "on (convex)" : "off (convex)");
  for (std::size_t i = 0; i < scenario.parameters.size(); ++i) line("parameter", parameter_text(scenario, i));
  line("reference", fmt::format("{}{}{}", cb::name(scenario.reference.kind),
                                scenario.reference.name.empty() ? "" : ", ", scenario.reference.name));
  for (const Tree& tree : scenario.model.trees)
    line("robot", fmt::format("{}: {} links, {} degrees of freedom", tree.name, tree.joints.size(), tree.nv));
  for (const ControllerSpec& controller : scenario.controllers)
    line("controller",
         fmt::format("{} of {}: {}", controller.row->name,
                     scenario.model.trees[static_cast<std::size_t>(controller.tree)].name, controller.row->summary));
  const auto forces = scenario.implicit_joints ? JointForces::implicit : JointForces::explicit_euler;
  if (const auto limit = largest_stable_step(scenario, forces))
    line("control",
         fmt::format("out of contact the {} step of the robots' torques is stable up to h = {:.3g} s{}",
                     scenario.implicit_joints ? "implicit" : "explicit", *limit,
                     scenario.step > *limit ? ": at the scene's own it is not (--joint-forces implicit)" : ""));
  for (const std::string& note : stepping_notes(scenario, row.get())) line("stepping", note);
  const auto [points, pairs] = contacts_at_start(scenario);
  line("contacts", fmt::format("{} at the start, on {} pairs of shapes", points, pairs));
  if (row) line("method", fmt::format("{}: {}", row->name, row->summary));
  for (const std::string& note : notes_for(scenario, row.get())) line("note", note);
  for (const std::string& what : left_out(scenario)) line("left out", what);
  std::string fault = fault_at_start(scenario);
  if (row) {
    const Trial trial = try_steps(scenario, *row, steps);
    line("trial", fmt::format("{} steps{}", trial.steps, trial.ending));
    for (const std::string& what : trial.left_out) line("left out", what);
    if (trial.left_out.empty()) line("left out", "nothing else in these steps");
    if (!trial.failed.empty()) fault = trial.failed;
  }
  return end_of_check(scenario, fault);
}

}  // namespace

void add_check(CLI::App& program, Action& action) {
  CLI::App& check_app = *program.add_subcommand("check", "validate a scenario; say what it has");
  const auto flags = std::make_shared<CheckFlags>();
  CLI::Option* scene = check_app
                           .add_option("scenario", flags->scenario,
                                       "a scenario's XML file, or the name of one that comes with the program")
                           ->type_name("SCENARIO.xml");
  check_app
      .add_option("--method", flags->method,
                  "the contact model that a run would use: tries some steps and tells what they leave out")
      ->type_name("METHOD");
  check_app.add_option("--steps", flags->steps, "steps that are tried with --method [100]")->type_name("N");
  check_app.add_option("--set", flags->set, "a parameter that the scenario declares; may be repeated")
      ->type_name("NAME=VALUE")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  check_app.add_flag("--files", flags->files, "print the files that the scene reads, one a line, and nothing else");
  const auto add = [&](const char* flag, Text& value, const char* type, const char* summary) {
    check_app.add_option(flag, value, summary)->type_name(type);
  };
  add("--engine", flags->engine, "ENGINE",
      "in place of a scene: what an engine does with the simplest scenes, measured");
  add("--variant", flags->variant, "VARIANT", "of --engine [all]");
  add("--setting", flags->setting, "default|tuned", "of --engine [default]");
  add("--step", flags->step, "S", "of --engine: step in s [1e-3]");
  check_app.add_flag("--json", flags->json, "as JSON");
  check_app.callback([flags, scene, &action] {
    if (scene->count() == 0 && !flags->engine) throw CLI::RequiredError("scenario");
    action = [flags] {
      refuse_others(*flags);
      if (!flags->engine) return check(*flags);
      if (!flags->scenario.empty())
        throw UsageError(
            fmt::format("{}: --engine {} is checked without a scene; leave it out", flags->scenario, *flags->engine));
      return check_engine(*flags->engine, flags->variant, flags->setting, flags->step, flags->json);
    };
  });
}

}  // namespace cb
