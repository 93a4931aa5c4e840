// Siconos as an engine beside the methods: its own time stepping, after Moreau and Jean (siconos_scene.cpp speaks with
// its library).
//
// What is followed: Siconos 4.4, users' guide ("Time integration of the dynamics", "Friction-contact problems"), the
// heads of MoreauJeanOSI.hpp, TimeStepping.hpp, FrictionContact.hpp and SiconosBulletCollisionManager.hpp, and what
// siconos.io.mechanics_run sets up.
//   * Exact Coulomb friction and Newton's restitution (NewtonImpactFrictionNSL), a law a pair of groups of shapes.
//   * Contacts come from Bullet in single precision, by Siconos' own manager. Bullet finds them between shapes that are
//     smaller by their inside margin, and normals with it; without one they are off by degrees. A half-space is a box
//     of 100 m.
//   * A contact takes part in a step where its gap, predicted to the middle of the step, is closed.
//   * Forces are theta times those of this step and 1 - theta times those of the step before, theta = 0.5.
//
// Its own contact problem: J and impulses of the last Newton iteration; the velocity without contact is v+ less M^-1
// times the integrator's residual, in which forces of spin are those at v+; nothing stabilises the gap, so that the
// offset is zero.

#include "frame/plain_world.h"
#include "siconos_scene.h"

namespace cb {

namespace {

EngineWorld make(const Scenario& scenario, const EngineSetting& setting) {
  const plain::Scene scene = plain_scene(scenario, "Siconos");
  for (const Shape& shape : scenario.shapes)
    if (shape.kind == ShapeKind::cylinder && shape.half_extents.y() == 0)
      throw Unsupported("a disc (" + shape.name + "): Siconos' cylinders have a length");
  const auto knob = [&](const char* name) { return setting.knobs.at(name); };
  const Vec3 gravity = scenario.gravity.at(0);
  const siconos_scene::Setting of{setting.step,
                                  knob("theta"),
                                  knob("tolerance"),
                                  knob("newton_tolerance"),
                                  knob("margin"),
                                  static_cast<int>(knob("iterations")),
                                  static_cast<int>(knob("newton_iterations")),
                                  {gravity.x(), gravity.y(), gravity.z()},
                                  setting.keep_problems};
  const std::shared_ptr<plain::World> world = siconos_scene::make_world(scene, of);
  EngineWorld out = engine_world(world, scene.bodies);
  out.problem = [world](OwnProblem& problem) {
    const bool any = own_problem(*world->problem(), problem);
    problem.law = "exact Coulomb friction, Newton's restitution";
    return any;
  };
  return out;
}

Engine siconos() {
  Engine engine;
  engine.name = "siconos";
  engine.summary = "Siconos: Moreau and Jean's time stepping, exact Coulomb friction by Gauss and Seidel";
  engine.version = SICONOS_PACKAGE;  // it does not say itself: what CMake found installed
  engine.precision = "double";
  engine.package = "libsiconos-mechanics-dev";
  engine.documentation = {
      "Siconos 4.4 users' guide: Time integration of the dynamics; Friction-contact problems",
      "MoreauJeanOSI.hpp, TimeStepping.hpp, FrictionContact.hpp, SiconosBulletCollisionManager.hpp"};
  engine.shared = {"friction and restitution: of the pair (NewtonImpactFrictionNSL)",
                   "gravity, forces at the centre of mass, masses, principal inertias: as the scene's",
                   "sleep, damping: none"};
  engine.apart = {"contact points: Bullet's in single precision, some 1e-5 m; a half-space is a box of 100 m",
                  "depth is left in: nothing takes it away",
                  "forces: a mean of this step's and the one before (theta)"};
  engine.variants = {{"nsgs", "nonsmooth Gauss and Seidel, the library's tolerance", 1, {}},
                     {"nsgs-tight", "the same to 1e-10", 1, {{"tolerance", 1e-10}, {"iterations", 100000}}}};
  engine.knobs = {{"theta", 0.5, "", "of the theta method: 1 takes forces and velocity at the end of the step"},
                  {"tolerance", 1e-4, "", "of the solver, of the size of q"},
                  {"iterations", 1000, "", "of the solver at most", 1},
                  {"newton_iterations", 20, "", "of a step's Newton loop at most", 1},
                  {"newton_tolerance", 1e-10, "", "of a step's Newton loop"},
                  {"margin", 0.05, "", "share of a shape's least half length that Bullet finds contacts within"}};
  engine.make = make;
  return engine;
}

}  // namespace

}  // namespace cb

int main(int argc, char** argv) { return cb::engine_main(cb::siconos(), argc, argv); }
