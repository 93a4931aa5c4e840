// A scene stepped by an engine: the same loads, files and errors as a run of a method has.
#include "run.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <new>

#include "dynamics/free_bodies.h"
#include "evaluation/scene_errors.h"
#include "geometry/broad_phase.h"
#include "linalg/file_error.h"
#include "observed_impact.h"
#include "output/machine.h"
#include "output/run_files.h"
#include "own_problem.h"
#include "scenario/perturb.h"
#include "simulation/options.h"

namespace cb {

namespace {

using Clock = std::chrono::steady_clock;
using Json = nlohmann::json;

volatile std::sig_atomic_t asked_to_stop = 0;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// Deepest overlap of two shapes that are a pair, m.
class Depth {
 public:
  explicit Depth(const Scenario& scenario) : scenario_(scenario), motions_(scenario.shapes.size()) {}
  double operator()(const State& state) {
    for (std::size_t i = 0; i < motions_.size(); ++i) motions_[i].pose = shape_pose(state, scenario_.shapes[i]);
    const auto declared = [&](int i, int j) { return scenario_.can_touch(i, j); };
    double depth = 0;
    for (const auto& [i, j] : broad_phase_.pairs(scenario_.shapes, motions_, 0, 0, declared))
      depth =
          std::max(depth, -separation(scenario_.shapes[i], motions_[i].pose, scenario_.shapes[j], motions_[j].pose));
    return depth;
  }

 private:
  const Scenario& scenario_;
  BroadPhase broad_phase_;
  std::vector<Motion> motions_;
};

bool finite(const State& state) {
  double sum = 0;
  for (const Pose& pose : state.pose) sum += pose.p.sum() + pose.q.coeffs().sum();
  for (const double v : state.v) sum += v;
  return std::isfinite(sum);
}

/// What a run gathers as it goes.
struct Run {
  StepRecord record;
  int contacts_max = -1;
  double penetration_max = 0, write_s = 0;
  std::string status = "ok", reason;

  void end(Status with, std::string why) {
    status = name(with);
    reason = std::move(why);
  }
};

/// Whole steps to the end, or to what ends the run before.
void go(const Engine& engine, const EngineRequest& request, const Scenario& scenario, const EngineWorld& world,
        SceneErrors& errors, RunFiles& files, OwnProblems& problems, Pulse& pulse, Run& run) {
  const double h = request.step;
  const long steps = step_at(request.duration, h);  // as many as a method has
  State state = scenario.initial, before = state;
  Acting acting(scenario);
  ObservedImpact impacts(scenario, engine.precision == "single");
  Depth depth(scenario);
  const Clock::time_point start = Clock::now();
  Clock::time_point flushed = start;
  errors.observe_start(state);
  files.start(state);
  for (long index = 0; index < steps; ++index) {
    const Loads& loads = acting.at(state, index, h);
    world.load(loads);
    const Clock::time_point begin = Clock::now();
    world.step(h);
    const double took = seconds_since(begin);

    std::swap(before, state);
    state.pose.resize(before.pose.size());
    state.v.resize(before.v.size());
    world.read(state);
    state.t = static_cast<double>(index + 1) * h;
    if (!finite(state))
      return run.end(Status::not_finite, fmt::format("the engine's state at t = {:g} s holds no number", state.t));

    StepRecord& record = run.record;
    record = {};
    record.step = index + 1;
    record.t = state.t;
    record.contacts = std::max(0, world.contacts());
    record.times.solve_s = record.times.step_s = took;
    run.contacts_max = std::max(run.contacts_max, world.contacts());
    const bool recorded = request.record_every > 0 && record.step % request.record_every == 0;
    const bool last = index + 1 == steps;
    const Clock::time_point before_writing = Clock::now();
    problems.keep(world, record.step, state.t);
    if (recorded || last) {
      record.max_penetration = depth(state);
      record.kinetic_energy = kinetic_energy(scenario.model, state);
      record.potential_energy = potential_energy(scenario.model, state, scenario.gravity.at(state.t));
      run.penetration_max = std::max(run.penetration_max, record.max_penetration);
    }
    impacts.observe(before, state, loads, h, errors);
    errors.observe_step(state, record);
    if (recorded) files.step(state, record, loads.torque);
    if (std::chrono::duration<double>(before_writing - flushed).count() > 0.5) {
      files.flush();
      flushed = before_writing;
    }
    run.write_s += seconds_since(before_writing);
    pulse.steps = record.step;
    pulse.step_s += took;
    pulse.t = state.t;
    if (last) return;
    if (!files.ok()) return run.end(Status::write_failed, files.failed_path() + " could not be written");
    if (asked_to_stop) return run.end(Status::interrupted, "stopped by a signal");
    if (request.time_limit_s && seconds_since(start) > *request.time_limit_s)
      return run.end(Status::time_limit, fmt::format("the time limit of {:g} s was reached", *request.time_limit_s));
  }
}

}  // namespace

Acting::Acting(const Scenario& scenario) : scenario_(scenario) {
  loads_.force.resize(scenario.model.bodies.size());
  loads_.torque.resize(scenario.initial.qd.size());
  for (const ControllerSpec& spec : scenario.controllers) controllers_.push_back(spec.row->make(scenario.model, spec));
}

const Loads& Acting::at(const State& state, long index, double h) {
  loads_.gravity = scenario_.gravity.at(static_cast<double>(index) * h);
  for (Vec3& force : loads_.force) force.setZero();
  for (const Force& force : scenario_.forces)
    if (step_at(force.from, h) <= index && index < step_at(force.to, h)) loads_.force[force.body] += force.force;
  std::fill(loads_.torque.begin(), loads_.torque.end(), 0.0);
  for (const Controller& controller : controllers_) controller(scenario_.model, state, loads_.gravity, loads_.torque);
  for (const Tree& tree : scenario_.model.trees)
    for (const Joint& joint : tree.joints)
      if (joint.nv() == 1)
        loads_.torque[joint.v] = std::clamp(loads_.torque[joint.v], -joint.torque_limit, joint.torque_limit);
  return loads_;
}

Scenario scene_of(const EngineRequest& request) {
  Scenario scenario = load_scenario(request.scene, request.set);
  for (PairLaw& law : scenario.pairs.laws) {
    if (request.friction) law.mu = *request.friction;
    if (request.restitution) law.restitution = *request.restitution;
  }
  if (request.perturb > 0) perturb(scenario, request.perturb, static_cast<std::uint64_t>(request.seed));
  return scenario;
}

Json run_scene(const Engine& engine, const EngineRequest& request, Pulse& pulse) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, [](int) { asked_to_stop = 1; });
  std::signal(SIGXFSZ, SIG_IGN);  // a file that may not grow is one that cannot be written
  const Scenario scenario = scene_of(request);
  SimulationOptions options;
  options.step = request.step;
  options.duration = request.duration;
  SceneErrors errors(scenario, options, 0);
  RunFiles files(request.out, scenario.model, request.record_every, scenario.shapes, scenario.rotate_cone);
  Run run;
  try {
    const EngineSetting setting{request.variant, request.knobs, request.step, !request.save_problems.empty()};
    OwnProblems problems(engine, setting, request.save_problems, request.save_every);
    const EngineWorld world = engine.make(scenario, setting);
    go(engine, request, scenario, world, errors, files, problems, pulse, run);
  } catch (const FileError& what) {
    run.end(Status::write_failed, what.what());
  } catch (const Unsupported& what) {
    files.start(scenario.initial);
    run.end(Status::unsupported, what.what());
  } catch (const std::bad_alloc&) {
    run.end(Status::memory_limit, "out of memory");
  }
  files.flush();
  if (!files.ok() && run.status == "ok") run.end(Status::write_failed, files.failed_path() + " could not be written");
  Json measured = Json::array();
  for (const auto& [name, value] : errors.finish()) measured.push_back({name, value});
  return {{"status", run.status},
          {"reason", run.reason},
          {"contacts_max", run.contacts_max},
          {"penetration_max", run.penetration_max},
          {"write_s", run.write_s},
          {"errors", measured}};
}

void step_through(const Engine& engine, const Scenario& scenario, const EngineSetting& setting, double duration,
                  const std::function<void(const State&, int)>& see) {
  const EngineWorld world = engine.make(scenario, setting);
  State state = scenario.initial;
  Acting acting(scenario);
  see(state, 0);
  const long steps = std::lround(duration / setting.step);
  for (long index = 0; index < steps; ++index) {
    world.load(acting.at(state, index, setting.step));
    world.step(setting.step);
    world.read(state);
    state.t = static_cast<double>(index + 1) * setting.step;
    see(state, world.contacts());
  }
}

}  // namespace cb
