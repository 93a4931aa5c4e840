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

/// Forces and gravity of the step that begins at index * h, as a method's run has them.
void loads_at(const Scenario& scenario, long index, double h, Loads& loads);

}  // namespace cb
