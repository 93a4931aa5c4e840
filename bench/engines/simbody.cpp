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

#include <cmath>
#include <memory>

#include "frame/engine.h"
#include "simbody_scene.h"

namespace cb {

namespace {

void put(const Vec3& x, double out[3]) {
  for (int k = 0; k < 3; ++k) out[k] = x[k];
}
simbody::Pose plain(const Pose& pose) {
  simbody::Pose out{{}, {pose.q.w(), pose.q.x(), pose.q.y(), pose.q.z()}};
  put(pose.p, out.p);
  return out;
}

/// What Simbody can have of a scene; Unsupported for the rest.
simbody::Scene scene_of(const Scenario& scenario, bool rigid) {
  simbody::Scene out;
  for (std::size_t b = 0; b < scenario.model.bodies.size(); ++b) {
    const Body& body = scenario.model.bodies[b];
    const double* v = &scenario.initial.v[6 * b];
    simbody::Body made{body.mass, {}, plain(scenario.initial.pose[b]), {v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
    put(body.inertia, made.inertia);
    out.bodies.push_back(made);
  }
  std::vector<int> place(scenario.shapes.size(), -1);
  for (std::size_t i = 0; i < scenario.shapes.size(); ++i) {
    const Shape& shape = scenario.shapes[i];
    if (shape.kind == ShapeKind::half_space) {
      place[i] = static_cast<int>(out.planes.size());
      const Vec3 normal = shape.local.q * Vec3::UnitY();
      simbody::Plane plane{{}, normal.dot(shape.local.p)};
      put(normal, plane.normal);
      out.planes.push_back(plane);
    } else if (shape.body >= 0 && shape.kind != ShapeKind::cylinder) {
      place[i] = static_cast<int>(out.shapes.size());
      simbody::Shape made{shape.body, shape.kind == ShapeKind::sphere, shape.radius, {}, plain(shape.local)};
      put(shape.half_extents, made.half);
      out.shapes.push_back(made);
    }
  }
  const auto n = static_cast<int>(scenario.shapes.size());
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < i; ++j) {
      const Shape &a = scenario.shapes[i], &b = scenario.shapes[j];
      const PairLaw* law = scenario.pairs.find(i, j);
      if (law == nullptr || a.body == b.body) continue;
      const bool first = a.kind == ShapeKind::half_space;
      const int plane = first ? i : j, moving = first ? j : i;
      if (scenario.shapes[plane].kind != ShapeKind::half_space || place[moving] < 0)
        throw Unsupported("contact of " + a.name + " and " + b.name +
                          ": the adapter of Simbody has boxes and spheres on half-spaces");
      if (!rigid && law->restitution > 0)
        throw Unsupported("restitution: Simbody's compliant contact has dissipation in its place");
      if (!rigid && !out.pairs.empty() && law->mu != out.pairs.front().mu)
        throw Unsupported("friction: compliant materials have one coefficient here, and this scene's pairs several");
      out.pairs.push_back({place[moving], place[plane], law->mu, law->restitution});
    }
  return out;
}

/// A world with what it has to remember.
struct Running {
  simbody::World world;
  std::vector<simbody::Body> bodies;
  std::vector<double> mass;
  long steps = 0;
};

EngineWorld make(const Scenario& scenario, const EngineSetting& setting) {
  refuse_robots(scenario, "Simbody");
  const auto knob = [&](const char* name) { return setting.knobs.at(name); };
  const bool rigid = setting.variant.starts_with("rigid");
  const simbody::Scene scene = scene_of(scenario, rigid);
  const simbody::Setting of{rigid,
                            setting.variant == "rigid-pgs",
                            knob("stiffness"),
                            knob("dissipation"),
                            knob("transition_speed"),
                            knob("accuracy"),
                            knob("constraint_tolerance")};
  const auto running = std::make_shared<Running>(Running{simbody::World(scene, of), scene.bodies, {}});
  for (const Body& body : scenario.model.bodies) running->mass.push_back(body.mass);
  EngineWorld world;
  world.load = [running](const Loads& loads) {
    for (std::size_t b = 0; b < running->mass.size(); ++b) {
      const Vec3 force = running->mass[b] * loads.gravity + loads.force[b];
      running->world.load(static_cast<int>(b), force.data());
    }
  };
  world.step = [running](double h) { running->world.step_to(static_cast<double>(++running->steps) * h); };
  world.read = [running](State& state) {
    running->world.read(running->bodies);
    for (std::size_t b = 0; b < running->bodies.size(); ++b) {
      const simbody::Body& body = running->bodies[b];
      const double* q = body.pose.q;
      state.pose[b] = {Vec3(body.pose.p), Quat(q[0], q[1], q[2], q[3])};
      for (std::size_t k = 0; k < 3; ++k) {
        state.v[6 * b + k] = body.v[k];
        state.v[6 * b + 3 + k] = body.w[k];
      }
    }
  };
  world.contacts = [] { return -1; };
  return world;
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
