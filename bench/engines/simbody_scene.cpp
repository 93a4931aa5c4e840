#include "simbody_scene.h"

#include <Simbody.h>

#include <algorithm>
#include <set>

namespace simbody {

namespace {

SimTK::Vec3 vec(const double x[3]) { return {x[0], x[1], x[2]}; }
SimTK::Transform transform(const plain::Pose& pose) {
  return {SimTK::Rotation(SimTK::Quaternion(pose.q[0], pose.q[1], pose.q[2], pose.q[3])), vec(pose.p)};
}
SimTK::UnitVec3 normal(const plain::Shape& plane) { return transform(plane.at).y(); }

}  // namespace

class World final : public plain::World {
 public:
  World(const plain::Scene& scene, const Setting& setting);
  void load(int body, const double force[3]) override;
  void step(double h) override;
  void read(std::vector<plain::Body>& bodies) override;
  int contacts() const override;

 private:
  SimTK::MultibodySystem system_;
  SimTK::SimbodyMatterSubsystem matter_{system_};
  SimTK::GeneralForceSubsystem general_{system_};
  std::unique_ptr<SimTK::ContactTrackerSubsystem> tracker_;
  std::unique_ptr<SimTK::CompliantContactSubsystem> compliant_;
  std::unique_ptr<SimTK::Force::DiscreteForces> forces_;
  std::unique_ptr<SimTK::SemiExplicitEulerTimeStepper> stepper_;
  std::unique_ptr<SimTK::RungeKuttaMersonIntegrator> integrator_;
  std::vector<SimTK::MobilizedBody::Free> bodies_;
  long steps_ = 0;

  SimTK::State& state() { return stepper_ ? stepper_->updState() : integrator_->updAdvancedState(); }
  SimTK::MobilizedBody& body_of(const plain::Shape& shape) { return bodies_[static_cast<std::size_t>(shape.body)]; }
  void add_rigid(const plain::Scene& scene, const plain::Pair& pair);
  void add_compliant(const plain::Scene& scene, const Setting& setting);
};

/// Two spheres, a sphere on a plane, or each corner of a box.
void World::add_rigid(const plain::Scene& scene, const plain::Pair& pair) {
  const plain::Shape *shape = &scene.shapes[static_cast<std::size_t>(pair.a)],
                     *other = &scene.shapes[static_cast<std::size_t>(pair.b)];
  if (shape->kind == plain::Kind::half_space) std::swap(shape, other);
  SimTK::MobilizedBody& body = body_of(*shape);
  if (other->kind == plain::Kind::sphere) {
    matter_.adoptUnilateralContact(new SimTK::SphereSphereContact(body_of(*other), vec(other->at.p), other->radius,
                                                                  body, vec(shape->at.p), shape->radius,
                                                                  pair.restitution, pair.mu, pair.mu, 0));
    return;
  }
  const SimTK::UnitVec3 up = normal(*other);
  const double height = SimTK::dot(SimTK::Vec3(up), vec(other->at.p));
  if (shape->kind == plain::Kind::sphere) {
    matter_.adoptUnilateralContact(new SimTK::SpherePlaneContact(
        matter_.updGround(), up, height, body, vec(shape->at.p), shape->radius, pair.restitution, pair.mu, pair.mu, 0));
    return;
  }
  for (int corner = 0; corner < 8; ++corner) {
    const SimTK::Vec3 at((corner & 1 ? 1 : -1) * shape->half[0], (corner & 2 ? 1 : -1) * shape->half[1],
                         (corner & 4 ? 1 : -1) * shape->half[2]);
    matter_.adoptUnilateralContact(new SimTK::PointPlaneContact(
        matter_.updGround(), up, height, body, transform(shape->at) * at, pair.restitution, pair.mu, pair.mu, 0));
  }
}

void World::add_compliant(const plain::Scene& scene, const Setting& setting) {
  tracker_ = std::make_unique<SimTK::ContactTrackerSubsystem>(system_);
  compliant_ = std::make_unique<SimTK::CompliantContactSubsystem>(system_, *tracker_);
  compliant_->setTransitionVelocity(setting.transition_speed);
  const double mu = scene.pairs.empty() ? 0 : scene.pairs.front().mu;
  const SimTK::ContactMaterial material(setting.stiffness, setting.dissipation, mu, mu, 0);
  std::vector<SimTK::ContactSurface> surfaces;
  for (const plain::Shape& shape : scene.shapes) {
    if (shape.kind == plain::Kind::sphere)
      surfaces.emplace_back(SimTK::ContactGeometry::Sphere(shape.radius), material);
    else if (shape.kind == plain::Kind::box)
      surfaces.emplace_back(SimTK::ContactGeometry::Brick(vec(shape.half)), material);
    else
      surfaces.emplace_back(SimTK::ContactGeometry::HalfSpace(), material);
  }
  // Surfaces of one clique pass through each other: one for each two that are no pair.
  std::set<std::pair<int, int>> declared;
  for (const plain::Pair& pair : scene.pairs) declared.emplace(pair.a, pair.b);
  const auto n = static_cast<int>(surfaces.size());
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < i; ++j)
      if (declared.count({i, j}) == 0) {
        const SimTK::ContactCliqueId clique = SimTK::ContactSurface::createNewContactClique();
        for (const int k : {i, j}) surfaces[static_cast<std::size_t>(k)].joinClique(clique);
      }
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    const plain::Shape& shape = scene.shapes[i];
    if (shape.kind == plain::Kind::half_space) {
      // Simbody's half-space is x > 0: its normal is -x.
      const SimTK::Transform at(SimTK::Rotation(-normal(shape), SimTK::XAxis), vec(shape.at.p));
      matter_.updGround().updBody().addContactSurface(at, surfaces[i]);
    } else {
      body_of(shape).updBody().addContactSurface(transform(shape.at), surfaces[i]);
    }
  }
}

World::World(const plain::Scene& scene, const Setting& setting) {
  for (const plain::Body& body : scene.bodies) {
    const SimTK::Body::Rigid rigid(SimTK::MassProperties(
        body.mass, SimTK::Vec3(0), SimTK::Inertia(body.inertia[0], body.inertia[1], body.inertia[2])));
    bodies_.emplace_back(matter_.updGround(), SimTK::Transform(), rigid, SimTK::Transform());
  }
  if (setting.rigid)
    for (const plain::Pair& pair : scene.pairs) add_rigid(scene, pair);
  else
    add_compliant(scene, setting);
  forces_ = std::make_unique<SimTK::Force::DiscreteForces>(general_, matter_);
  SimTK::State start = system_.realizeTopology();
  system_.realizeModel(start);
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    const plain::Body& body = scene.bodies[b];
    bodies_[b].setQToFitTransform(start, transform(body.pose));
    bodies_[b].setUToFitVelocity(start, SimTK::SpatialVec(vec(body.w), vec(body.v)));
  }
  if (setting.rigid) {
    stepper_ = std::make_unique<SimTK::SemiExplicitEulerTimeStepper>(system_);
    if (setting.pgs) stepper_->setImpulseSolverType(SimTK::SemiExplicitEulerTimeStepper::PGS);
    stepper_->setConstraintTolerance(setting.constraint_tolerance);
    stepper_->initialize(start);
  } else {
    integrator_ = std::make_unique<SimTK::RungeKuttaMersonIntegrator>(system_);
    integrator_->setAccuracy(setting.accuracy);
    integrator_->initialize(start);
  }
}

void World::load(int body, const double force[3]) {
  forces_->setOneBodyForce(state(), bodies_[static_cast<std::size_t>(body)],
                           SimTK::SpatialVec(SimTK::Vec3(0), vec(force)));
}

void World::step(double h) {
  const double t = static_cast<double>(++steps_) * h;
  if (stepper_) {
    stepper_->stepTo(t);
    return;
  }
  // New forces are an event: what the integrator knows of its next step is no more, and none may go beyond t.
  integrator_->reinitialize(SimTK::Stage::Dynamics, false);
  while (integrator_->getTime() < t) integrator_->stepTo(t, t);
}

void World::read(std::vector<plain::Body>& bodies) {
  const SimTK::State& at = state();
  system_.realize(at, SimTK::Stage::Velocity);
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const SimTK::Transform& pose = bodies_[b].getBodyTransform(at);
    const SimTK::Quaternion q = pose.R().convertRotationToQuaternion();
    const SimTK::SpatialVec& v = bodies_[b].getBodyVelocity(at);
    for (int k = 0; k < 4; ++k) bodies[b].pose.q[k] = q[k];
    for (int k = 0; k < 3; ++k) {
      bodies[b].pose.p[k] = pose.p()[k];
      bodies[b].v[k] = v[1][k];
      bodies[b].w[k] = v[0][k];
    }
  }
}

int World::contacts() const { return -1; }

std::string version() {
  int major = 0, minor = 0, build = 0;
  SimTK_version_simbody(&major, &minor, &build);
  return std::to_string(major) + "." + std::to_string(minor) + "." + std::to_string(build);
}

std::unique_ptr<plain::World> make_world(const plain::Scene& scene, const Setting& setting) {
  return std::make_unique<World>(scene, setting);
}

}  // namespace simbody
