#pragma once

#include <functional>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "scenario/scenario.h"

namespace cb {

/// Values of an engine's knobs by name.
using Knobs = std::map<std::string, double, std::less<>>;

/// A number that changes how the engine computes, not what the scene is. Settings are written with each run.
struct EngineKnob {
  std::string name;
  double value = 0;  ///< the engine's own default
  std::string unit;  ///< empty: none
  std::string meaning;
  /// The least and the most of it where it is whole; no most: what an int holds.
  std::optional<int> count_from = std::nullopt, count_to = std::nullopt;
};

/// A way in which the engine solves: a solver, a friction model.
struct EngineVariant {
  std::string name, summary;
  /// Friction at 45 degrees to its directions over mu, by its law: 1 for a cone, sqrt(2) for a pyramid whose sides are
  /// mu times the normal force.
  double diagonal = 1;
  Knobs knobs = {};  ///< other values than the knobs' defaults
};

struct OwnProblem;

/// What acts on the scene in the step that begins now.
struct Loads {
  Vec3 gravity = Vec3::Zero();  ///< m/s^2
  std::vector<Vec3> force;      ///< per body, at its centre of mass, N, world
  std::vector<double> torque;   ///< of the robots' motors, as State::qd, N m or N; without damping and springs
};

/// A scene inside the engine. Destroyed with the last of its callables.
struct EngineWorld {
  std::function<void(const Loads&)> load;  ///< takes the loads of the next step; not timed
  std::function<void(double h)> step;      ///< collision, solve and integration over h seconds; what is timed
  std::function<void(State&)> read;        ///< fills pose and v of every body, q and qd (State's conventions)
  std::function<int()> contacts;           ///< points that the last step had; negative where the engine does not say
  /// The contact problem of the last step with the engine's answer; false: it had none. Empty: the engine keeps it.
  std::function<bool(OwnProblem&)> problem = {};
};

/// What cannot be expressed in this engine: what() is the reason. Ends the run as `unsupported`.
struct Unsupported : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct EngineSetting {
  std::string variant;
  Knobs knobs;                 ///< all of the engine's
  double step = 0;             ///< s, of every step
  bool keep_problems = false;  ///< will EngineWorld::problem be asked for?
};

/// An engine: everything that its program knows of it (bench/engines/<name>.cpp).
struct Engine {
  std::string name, summary;
  std::string version;                     ///< of the library in use, as it says itself where it can
  std::string precision;                   ///< double or single
  std::string package;                     ///< Debian's
  std::vector<std::string> documentation;  ///< what the adapter follows, chapter and verse
  std::vector<std::string> shared;         ///< what is made equal to the scene's, and how
  std::vector<std::string> apart;          ///< what is not
  std::vector<EngineVariant> variants;     ///< the first is the default
  std::vector<EngineKnob> knobs;
  std::string slip_knob;  ///< the knob that, above 0, makes friction act along the slip, as a cone's does; empty: none
  /// Makes the scene at its initial state. Throws Unsupported.
  std::function<EngineWorld(const Scenario&, const EngineSetting&)> make;

  const EngineVariant* find(std::string_view variant) const;
  /// All knobs of a variant: the engine's defaults, then the variant's own.
  Knobs knobs_of(const EngineVariant& variant) const;
  /// Friction at 45 degrees over mu, by the law of a variant at these knobs.
  double diagonal(const EngineVariant& variant, const Knobs& all) const;
};

/// The program of an engine: `--describe`, `--run REQUEST`, `--preflight REQUEST` (lib/output/engine_request.h).
/// Returns its exit code.
int engine_main(const Engine& engine, int argc, char** argv);

/// What adapters share.
/// Pose of a shape in the world.
Pose shape_pose(const State& state, const Shape& shape);
/// Throws Unsupported where the scene has robots.
void refuse_robots(const Scenario& scenario, std::string_view engine);

}  // namespace cb
