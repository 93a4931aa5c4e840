#pragma once

#include <memory>

#include "engine.h"
#include "own_problem.h"
#include "plain_scene.h"

namespace cb {

/// What an engine can have of a scene of free bodies. Throws Unsupported where there are robots.
plain::Scene plain_scene(const Scenario& scenario, std::string_view engine);
/// Poses and velocities as they are in `bodies`.
void read_plain(const std::vector<plain::Body>& bodies, State& state);
/// M, J, velocities and impulses; the law's words are the caller's. False: no contact.
bool own_problem(const plain::Problem& plain, OwnProblem& out);

/// All of it but its problems.
EngineWorld engine_world(std::shared_ptr<plain::World> world, std::vector<plain::Body> bodies);

}  // namespace cb
