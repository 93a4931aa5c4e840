#pragma once

#include <functional>
#include <nlohmann/json.hpp>

#include "engine.h"
#include "output/engine_request.h"

namespace cb {

/// The scene of a request with its overrides. Throws InputError.
Scenario scene_of(const EngineRequest& request);
/// Steps the request's scene in the engine, writes its files, keeps `pulse` up to date, and says what came of it
/// (docs/engines.md). Throws InputError.
nlohmann::json run_scene(const Engine& engine, const EngineRequest& request, Pulse& pulse);

/// Steps a scene and shows each state, the first one too; for preflights. Throws Unsupported.
void step_through(const Engine& engine, const Scenario& scenario, const EngineSetting& setting, double duration,
                  const std::function<void(const State&, int contacts)>& see);

/// What an engine's preflight measures with a setting: a list of lines (docs/engines.md, "Preflight").
nlohmann::json preflight(const Engine& engine, const EngineRequest& request);

/// The row of the engine as JSON.
nlohmann::json describe(const Engine& engine);

/// What acts on a scene, as a method's run has it.
class Acting {
 public:
  explicit Acting(const Scenario& scenario);
  /// Of the step that begins in `state` at index * h.
  const Loads& at(const State& state, long index, double h);

 private:
  const Scenario& scenario_;
  std::vector<Controller> controllers_;
  Loads loads_;
};

}  // namespace cb
