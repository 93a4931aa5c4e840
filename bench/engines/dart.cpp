// DART as an engine beside the methods.
//
// What is followed: DART 6.12's tutorials ("Collisions"), and the heads of BoxedLcpConstraintSolver.hpp,
// ContactConstraint.hpp and ShapeFrame.hpp (DynamicsAspect).
//   * A pair's friction is the lesser of both shapes', its restitution the product: a scene whose pairs cannot be had
//     so is unsupported.
//   * Friction is a pyramid: two directions, each at most mu times the normal force (findex of a boxed LCP), so that
//     at 45 degrees it has sqrt(2) mu.
//   * A half-space is a box of 200 m: DART's own detector knows boxes and spheres.
//   * Depth beyond 0 is taken away by a velocity (error reduction parameter 0.01), of at most 0.001 m/s; the library's
//     own values are kept.
//   * Impacts slower than 0.1 m/s do not bounce (DART_BOUNCING_VELOCITY_THRESHOLD).
//
// Its own contact problem: M and v- are the skeletons', J is made of the contacts that it found, impulses are the
// forces that it gives them, b is what its LCP solver is handed. The diagonal of the LCP's matrix is 1 + 1e-5 times
// that of J M^-1 J^T (constraint force mixing): a compliance.

#include <algorithm>
#include <cmath>

#include "dart_scene.h"
#include "frame/plain_world.h"

namespace cb {

namespace {

/// Numbers of shapes of which pairs' laws are the least (friction) and the product (restitution).
struct Surfaces {
  std::vector<double> mu, root_e;

  explicit Surfaces(const plain::Scene& scene) : mu(scene.shapes.size(), 0.0), root_e(mu) {
    for (const plain::Pair& pair : scene.pairs)
      for (const int i : {pair.a, pair.b}) {
        const auto at = static_cast<std::size_t>(i);
        mu[at] = std::max(mu[at], pair.mu);
        root_e[at] = std::max(root_e[at], std::sqrt(pair.restitution));
      }
    for (const plain::Pair& pair : scene.pairs) {
      const auto a = static_cast<std::size_t>(pair.a), b = static_cast<std::size_t>(pair.b);
      if (std::min(mu[a], mu[b]) != pair.mu)
        throw Unsupported("friction: DART takes the lesser of both shapes', which gives this scene's pairs no numbers");
      if (std::abs(root_e[a] * root_e[b] - pair.restitution) > 1e-12)
        throw Unsupported(
            "restitution: DART takes the product of both shapes', which gives this scene's pairs no numbers");
    }
  }
};

EngineWorld make(const Scenario& scenario, const EngineSetting& setting) {
  const plain::Scene scene = plain_scene(scenario, "DART");
  for (const Shape& shape : scenario.shapes)
    if (shape.kind == ShapeKind::cylinder)
      throw Unsupported("a cylinder (" + shape.name + "): DART's own detector knows boxes and spheres");
  const Surfaces surfaces(scene);
  const dart_scene::Setting of{setting.step,
                               setting.variant == "pgs",
                               setting.knobs.at("fall_back") != 0,
                               static_cast<int>(setting.knobs.at("iterations")),
                               surfaces.mu,
                               surfaces.root_e,
                               setting.keep_problems};
  const std::shared_ptr<plain::World> world = dart_scene::make_world(scene, of);
  EngineWorld out = engine_world(world, scene.bodies);
  out.problem = [world](OwnProblem& problem) {
    const bool any = own_problem(*world->problem(), problem);
    problem.law = "friction pyramid of two directions as a boxed LCP, Newton's restitution";
    problem.offset_means = "-(b + J v-): the velocity that DART wants back for depth and restitution";
    return any;
  };
  return out;
}

Engine dart_engine() {
  const double pyramid = std::sqrt(2.0);
  Engine engine;
  engine.name = "dart";
  engine.summary = "DART: friction pyramid as a boxed LCP, by Dantzig's pivots or Gauss and Seidel";
  engine.version = dart_scene::version();
  engine.precision = "double";
  engine.package = "libdart-dev";
  engine.documentation = {"DART 6.12 tutorials: Collisions",
                          "dart/constraint/BoxedLcpConstraintSolver.hpp, ContactConstraint.hpp of 6.12.1"};
  engine.shared = {"friction: lesser of both shapes', chosen so that each pair has its own",
                   "restitution: product of both shapes', the same",
                   "gravity, forces at the centre of mass, masses, principal inertias: as the scene's",
                   "sleep: 6.12 has none; damping: none"};
  engine.apart = {"contact points: of DART's own detector, of overlapping shapes; a half-space is a box of 200 m",
                  "depth is taken away by a velocity, slowly; impacts below 0.1 m/s do not bounce"};
  engine.variants = {{"dantzig", "Dantzig's algorithm after Baraff, by Gauss and Seidel where it fails", pyramid, {}},
                     {"pgs", "projected Gauss and Seidel", pyramid, {}}};
  engine.knobs = {{"iterations", 30, "", "of pgs a step at most", 1},
                  {"fall_back", 1, "", "of dantzig: 0 leaves a failure as it is", 0, 1}};
  engine.make = make;
  return engine;
}

}  // namespace

}  // namespace cb

int main(int argc, char** argv) { return cb::engine_main(cb::dart_engine(), argc, argv); }
