// Simbody as an engine beside the methods (simbody_scene.cpp speaks with its library).
//
// What is followed: Simbody 3.7's headers (ConditionalConstraint.h, SemiExplicitEulerTimeStepper.h,
// CompliantContactSubsystem.h, ContactGeometry.h) and its theory manual, "Compliant contact".
//   * `compliant`: elastic contact of a box (Brick) or a sphere with a half-space, friction as a smooth function of
//   slip
//     with a transition velocity; integrated with error control, as many internal steps as that takes.
//   * `rigid`: unilateral contact with Coulomb friction of corners and spheres on half-spaces, a first-order time
//     stepper with an impulse solver.
//   * Neither knows two boxes, or a box and a sphere: such a scene is unsupported.

#include "frame/plain_world.h"
#include "simbody_scene.h"

namespace cb {

namespace {

/// What Simbody's contacts cannot express.
void refuse(const Scenario& scenario, const plain::Scene& scene, bool rigid) {
  for (const plain::Pair& pair : scene.pairs) {
    const Shape &a = scenario.shapes[static_cast<std::size_t>(pair.a)],
                &b = scenario.shapes[static_cast<std::size_t>(pair.b)];
    const auto on_plane = [](const Shape& plane, const Shape& other) {
      return plane.kind == ShapeKind::half_space && (other.kind == ShapeKind::sphere || other.kind == ShapeKind::box);
    };
    const bool spheres = a.kind == ShapeKind::sphere && b.kind == ShapeKind::sphere && a.body >= 0 && b.body >= 0;
    if (!spheres && !on_plane(a, b) && !on_plane(b, a))
      throw Unsupported("contact of " + a.name + " and " + b.name +
                        ": Simbody knows two spheres, and boxes and spheres on half-spaces");
    if (!rigid && pair.restitution > 0)
      throw Unsupported("restitution: Simbody's compliant contact has dissipation in its place");
    if (!rigid && pair.mu != scene.pairs.front().mu)
      throw Unsupported("friction: compliant materials have one coefficient here, and this scene's pairs several");
  }
}

EngineWorld make(const Scenario& scenario, const EngineSetting& setting) {
  const plain::Scene scene = plain_scene(scenario, "Simbody");
  const auto knob = [&](const char* name) { return setting.knobs.at(name); };
  const bool rigid = setting.variant.starts_with("rigid");
  refuse(scenario, scene, rigid);
  const simbody::Setting of{rigid,
                            setting.variant == "rigid-pgs",
                            knob("stiffness"),
                            knob("dissipation"),
                            knob("transition_speed"),
                            knob("accuracy"),
                            knob("constraint_tolerance")};
  return engine_world(simbody::make_world(scene, of), scene.bodies);
}

Engine engine() {
  Engine out;
  out.name = "simbody";
  out.summary = "Simbody: elastic contact under error control, or rigid contact of corners and spheres on planes";
  out.version = simbody::version();
  out.precision = "double";
  out.package = "libsimbody-dev";
  out.documentation = {"Simbody 3.7 theory manual: compliant contact",
                       "ConditionalConstraint.h, SemiExplicitEulerTimeStepper.h, CompliantContactSubsystem.h of 3.7"};
  out.shared = {"friction: static and dynamic coefficient of the pair (rigid), of all materials (compliant)",
                "gravity, forces at the centre of mass, masses, principal inertias: as the scene's",
                "sleep, damping: none"};
  out.apart = {"compliant: friction grows with slip up to transition_speed, so that nothing sticks",
               "compliant: as many internal steps in a step as the accuracy takes",
               "contacts of boxes and spheres with half-spaces only"};
  out.variants = {{"compliant", "elastic contact, Runge, Kutta and Merson's method under error control", 1, {}},
                  {"rigid", "rigid contact, Simbody's PLUS impulse solver", 1, {}},
                  {"rigid-pgs", "rigid contact, projected Gauss and Seidel", 1, {}}};
  out.knobs = {{"stiffness", 1e6, "Pa", "of compliant materials (plane strain)"},
               {"dissipation", 0.5, "s/m", "of compliant materials"},
               {"transition_speed", 0.01, "m/s", "slip at which compliant friction is full"},
               {"accuracy", 1e-3, "", "relative, of the integration of compliant contact"},
               {"constraint_tolerance", 1e-3, "", "of rigid contact"}};
  out.make = make;
  return out;
}

}  // namespace

}  // namespace cb

int main(int argc, char** argv) { return cb::engine_main(cb::engine(), argc, argv); }
