#include "simbody_scene.h"

#include <Simbody.h>

#include <algorithm>

namespace simbody {

namespace {

SimTK::Vec3 vec(const double x[3]) { return {x[0], x[1], x[2]}; }
SimTK::Transform transform(const Pose& pose) {
  return {SimTK::Rotation(SimTK::Quaternion(pose.q[0], pose.q[1], pose.q[2], pose.q[3])), vec(pose.p)};
}

}  // namespace

struct World::Parts {
  SimTK::MultibodySystem system;
  SimTK::SimbodyMatterSubsystem matter{system};
  SimTK::GeneralForceSubsystem general{system};
  std::unique_ptr<SimTK::ContactTrackerSubsystem> tracker;
  std::unique_ptr<SimTK::CompliantContactSubsystem> compliant;
  std::unique_ptr<SimTK::Force::DiscreteForces> forces;
  std::unique_ptr<SimTK::SemiExplicitEulerTimeStepper> stepper;
  std::unique_ptr<SimTK::RungeKuttaMersonIntegrator> integrator;
  std::vector<SimTK::MobilizedBody::Free> bodies;

  SimTK::State& state() { return stepper ? stepper->updState() : integrator->updAdvancedState(); }
  void add_rigid(const Scene& scene, const Pair& pair);
  void add_compliant(const Scene& scene, const Setting& setting);
};

/// A sphere on a plane, or each corner of a box.
void World::Parts::add_rigid(const Scene& scene, const Pair& pair) {
  const Shape& shape = scene.shapes[static_cast<std::size_t>(pair.shape)];
  const Plane& plane = scene.planes[static_cast<std::size_t>(pair.plane)];
  const SimTK::UnitVec3 normal(vec(plane.normal));
  SimTK::MobilizedBody& body = bodies[static_cast<std::size_t>(shape.body)];
  if (shape.sphere) {
    matter.adoptUnilateralContact(new SimTK::SpherePlaneContact(matter.updGround(), normal, plane.height, body,
                                                                vec(shape.local.p), shape.radius, pair.restitution,
                                                                pair.mu, pair.mu, 0));
    return;
  }
  for (int corner = 0; corner < 8; ++corner) {
    const SimTK::Vec3 at((corner & 1 ? 1 : -1) * shape.half[0], (corner & 2 ? 1 : -1) * shape.half[1],
                         (corner & 4 ? 1 : -1) * shape.half[2]);
    matter.adoptUnilateralContact(new SimTK::PointPlaneContact(matter.updGround(), normal, plane.height, body,
                                                               transform(shape.local) * at, pair.restitution, pair.mu,
                                                               pair.mu, 0));
  }
}

void World::Parts::add_compliant(const Scene& scene, const Setting& setting) {
  tracker = std::make_unique<SimTK::ContactTrackerSubsystem>(system);
  compliant = std::make_unique<SimTK::CompliantContactSubsystem>(system, *tracker);
  compliant->setTransitionVelocity(setting.transition_speed);
  const double mu = scene.pairs.empty() ? 0 : scene.pairs.front().mu;
  const SimTK::ContactMaterial material(setting.stiffness, setting.dissipation, mu, mu, 0);
  for (const Plane& plane : scene.planes) {
    // Simbody's half-space is x > 0: its normal is -x.
    const SimTK::UnitVec3 normal(vec(plane.normal));
    const SimTK::Transform at(SimTK::Rotation(-normal, SimTK::XAxis), plane.height * SimTK::Vec3(normal));
    matter.updGround().updBody().addContactSurface(
        at, SimTK::ContactSurface(SimTK::ContactGeometry::HalfSpace(), material));
  }
  for (const Shape& shape : scene.shapes) {
    SimTK::Body& body = bodies[static_cast<std::size_t>(shape.body)].updBody();
    if (shape.sphere)
      body.addContactSurface(transform(shape.local),
                             SimTK::ContactSurface(SimTK::ContactGeometry::Sphere(shape.radius), material));
    else
      body.addContactSurface(transform(shape.local),
                             SimTK::ContactSurface(SimTK::ContactGeometry::Brick(vec(shape.half)), material));
  }
}

World::World(const Scene& scene, const Setting& setting) : parts_(std::make_unique<Parts>()) {
  Parts& of = *parts_;
  for (const Body& body : scene.bodies) {
    const SimTK::Body::Rigid rigid(SimTK::MassProperties(
        body.mass, SimTK::Vec3(0), SimTK::Inertia(body.inertia[0], body.inertia[1], body.inertia[2])));
    of.bodies.emplace_back(of.matter.updGround(), SimTK::Transform(), rigid, SimTK::Transform());
  }
  if (setting.rigid)
    for (const Pair& pair : scene.pairs) of.add_rigid(scene, pair);
  else
    of.add_compliant(scene, setting);
  of.forces = std::make_unique<SimTK::Force::DiscreteForces>(of.general, of.matter);
  SimTK::State start = of.system.realizeTopology();
  of.system.realizeModel(start);
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    const Body& body = scene.bodies[b];
    of.bodies[b].setQToFitTransform(start, transform(body.pose));
    of.bodies[b].setUToFitVelocity(start, SimTK::SpatialVec(vec(body.w), vec(body.v)));
  }
  if (setting.rigid) {
    of.stepper = std::make_unique<SimTK::SemiExplicitEulerTimeStepper>(of.system);
    if (setting.pgs) of.stepper->setImpulseSolverType(SimTK::SemiExplicitEulerTimeStepper::PGS);
    of.stepper->setConstraintTolerance(setting.constraint_tolerance);
    of.stepper->initialize(start);
  } else {
    of.integrator = std::make_unique<SimTK::RungeKuttaMersonIntegrator>(of.system);
    of.integrator->setAccuracy(setting.accuracy);
    of.integrator->initialize(start);
  }
}

World::World(World&&) noexcept = default;
World::~World() = default;

void World::load(int body, const double force[3]) {
  parts_->forces->setOneBodyForce(parts_->state(), parts_->bodies[static_cast<std::size_t>(body)],
                                  SimTK::SpatialVec(SimTK::Vec3(0), vec(force)));
}

void World::step_to(double t) {
  if (parts_->stepper)
    parts_->stepper->stepTo(t);
  else
    while (parts_->integrator->getTime() < t) parts_->integrator->stepTo(t);
}

void World::read(std::vector<Body>& bodies) const {
  const SimTK::State& at = parts_->state();
  parts_->system.realize(at, SimTK::Stage::Velocity);
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const SimTK::Transform& pose = parts_->bodies[b].getBodyTransform(at);
    const SimTK::Quaternion q = pose.R().convertRotationToQuaternion();
    const SimTK::SpatialVec& v = parts_->bodies[b].getBodyVelocity(at);
    for (int k = 0; k < 4; ++k) bodies[b].pose.q[k] = q[k];
    for (int k = 0; k < 3; ++k) {
      bodies[b].pose.p[k] = pose.p()[k];
      bodies[b].v[k] = v[1][k];
      bodies[b].w[k] = v[0][k];
    }
  }
}

std::string version() {
  int major = 0, minor = 0, build = 0;
  SimTK_version_simbody(&major, &minor, &build);
  return std::to_string(major) + "." + std::to_string(minor) + "." + std::to_string(build);
}

}  // namespace simbody
