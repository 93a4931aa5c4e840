// Simbody as an engine beside the methods.
//
// What is followed: Simbody 3.7's headers (ConditionalConstraint.h, SemiExplicitEulerTimeStepper.h,
// CompliantContactSubsystem.h, ContactGeometry.h) and its theory manual, "Compliant contact".
//   * `compliant`: elastic contact of a box's corners or a sphere with a half-space (Hertz for spheres, a penalty for
//     corners), friction as a smooth function of slip with a transition velocity; integrated with error control, as
//     many internal steps as that takes.
//   * `rigid`: unilateral contact with Coulomb friction of corners and spheres on half-spaces, a first-order time
//     stepper with an impulse solver. Which pairs there are is said before the run.
//   * Neither knows two boxes: such a scene is unsupported.

#include <Simbody.h>

#include <cmath>
#include <memory>

#include "frame/engine.h"

namespace cb {

namespace {

SimTK::Vec3 vec(const Vec3& x) { return {x.x(), x.y(), x.z()}; }
Vec3 vec(const SimTK::Vec3& x) { return {x[0], x[1], x[2]}; }
SimTK::Rotation rotation(const Quat& q) { return SimTK::Rotation(SimTK::Quaternion(q.w(), q.x(), q.y(), q.z())); }
SimTK::Transform transform(const Pose& pose) { return {rotation(pose.q), vec(pose.p)}; }

class SimbodyScene {
 public:
  SimbodyScene(const Scenario& scenario, const EngineSetting& setting);

  void load(const Loads& loads) {
    SimTK::State& state = advanced();
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      const Vec3 force = masses_[b] * loads.gravity + loads.force[b];
      forces_->setOneBodyForce(state, bodies_[b], SimTK::SpatialVec(SimTK::Vec3(0), vec(force)));
    }
  }
  void step(double h) {
    const double t = static_cast<double>(++steps_) * h;
    if (rigid_)
      stepper_->stepTo(t);
    else
      while (integrator_->getTime() < t) integrator_->stepTo(t);
  }
  void read(State& state) {
    const SimTK::State& at = advanced();
    system_.realize(at, SimTK::Stage::Velocity);
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      const SimTK::Transform& pose = bodies_[b].getBodyTransform(at);
      const SimTK::Quaternion q = pose.R().convertRotationToQuaternion();
      state.pose[b] = {vec(pose.p()), Quat(q[0], q[1], q[2], q[3])};
      const SimTK::SpatialVec& v = bodies_[b].getBodyVelocity(at);
      for (int k = 0; k < 3; ++k) {
        state.v[6 * b + static_cast<std::size_t>(k)] = v[1][k];
        state.v[6 * b + 3 + static_cast<std::size_t>(k)] = v[0][k];
      }
    }
  }

 private:
  SimTK::State& advanced() { return rigid_ ? stepper_->updState() : integrator_->updAdvancedState(); }
  void add_rigid(const Scenario& scenario, const Shape& moving, const Shape& plane, const PairLaw& law);
  void add_compliant(const Scenario& scenario, const EngineSetting& setting);
  void add_pairs(const Scenario& scenario);

  bool rigid_;
  SimTK::MultibodySystem system_;
  SimTK::SimbodyMatterSubsystem matter_{system_};
  SimTK::GeneralForceSubsystem general_{system_};
  std::unique_ptr<SimTK::ContactTrackerSubsystem> tracker_;
  std::unique_ptr<SimTK::CompliantContactSubsystem> compliant_;
  std::unique_ptr<SimTK::Force::DiscreteForces> forces_;
  std::unique_ptr<SimTK::SemiExplicitEulerTimeStepper> stepper_;
  std::unique_ptr<SimTK::RungeKuttaMersonIntegrator> integrator_;
  std::vector<SimTK::MobilizedBody::Free> bodies_;
  std::vector<double> masses_;
  long steps_ = 0;
};

void SimbodyScene::add_rigid(const Scenario&, const Shape& moving, const Shape& plane, const PairLaw& law) {
  const SimTK::UnitVec3 normal(vec(plane.local.q * Vec3::UnitY()));
  const double height = (plane.local.q * Vec3::UnitY()).dot(plane.local.p);
  SimTK::MobilizedBody& body = bodies_[static_cast<std::size_t>(moving.body)];
  if (moving.kind == ShapeKind::sphere) {
    matter_.adoptUnilateralContact(new SimTK::SpherePlaneContact(matter_.updGround(), normal, height, body,
                                                                 vec(moving.local.p), moving.radius, law.restitution,
                                                                 law.mu, law.mu, 0));
    return;
  }
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 sign(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
    const Vec3 point = moving.local * sign.cwiseProduct(moving.half_extents);
    matter_.adoptUnilateralContact(new SimTK::PointPlaneContact(matter_.updGround(), normal, height, body, vec(point),
                                                                law.restitution, law.mu, law.mu, 0));
  }
}

/// Of the pairs that the scene declares, those that Simbody has; Unsupported for others.
void SimbodyScene::add_pairs(const Scenario& scenario) {
  const auto n = static_cast<int>(scenario.shapes.size());
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < i; ++j) {
      const Shape &a = scenario.shapes[i], &b = scenario.shapes[j];
      const PairLaw* law = scenario.pairs.find(i, j);
      if (law == nullptr || a.body == b.body) continue;
      const Shape& plane = a.kind == ShapeKind::half_space ? a : b;
      const Shape& moving = &plane == &a ? b : a;
      if (plane.kind != ShapeKind::half_space || moving.kind == ShapeKind::cylinder)
        throw Unsupported("contact of " + a.name + " and " + b.name +
                          ": Simbody has corners and spheres on half-spaces");
      if (rigid_) add_rigid(scenario, moving, plane, *law);
      if (!rigid_ && law->restitution > 0)
        throw Unsupported("restitution: Simbody's compliant contact has dissipation in its place");
    }
}

void SimbodyScene::add_compliant(const Scenario& scenario, const EngineSetting& setting) {
  tracker_ = std::make_unique<SimTK::ContactTrackerSubsystem>(system_);
  compliant_ = std::make_unique<SimTK::CompliantContactSubsystem>(system_, *tracker_);
  compliant_->setTransitionVelocity(setting.knobs.at("transition_speed"));
  double mu = -1;
  for (const PairLaw& law : scenario.pairs.laws) {
    if (mu >= 0 && law.mu != mu)
      throw Unsupported("friction: materials of one coefficient only, and this scene's pairs have several");
    mu = law.mu;
  }
  const SimTK::ContactMaterial material(setting.knobs.at("stiffness"), setting.knobs.at("dissipation"),
                                        std::max(0.0, mu), std::max(0.0, mu), 0);
  for (const Shape& shape : scenario.shapes) {
    if (shape.kind == ShapeKind::half_space) {
      // Simbody's half-space is x > 0: its normal is -x.
      const Vec3 normal = shape.local.q * Vec3::UnitY();
      const Pose pose{shape.local.p, Quat::FromTwoVectors(-Vec3::UnitX(), normal)};
      matter_.updGround().updBody().addContactSurface(
          transform(pose), SimTK::ContactSurface(SimTK::ContactGeometry::HalfSpace(), material));
      continue;
    }
    SimTK::MobilizedBody& body = bodies_[static_cast<std::size_t>(shape.body)];
    if (shape.kind == ShapeKind::sphere)
      body.updBody().addContactSurface(transform(shape.local),
                                       SimTK::ContactSurface(SimTK::ContactGeometry::Sphere(shape.radius), material));
    else
      body.updBody().addContactSurface(
          transform(shape.local),
          SimTK::ContactSurface(SimTK::ContactGeometry::Brick(vec(shape.half_extents)), material));
  }
}

SimbodyScene::SimbodyScene(const Scenario& scenario, const EngineSetting& setting)
    : rigid_(setting.variant.starts_with("rigid")) {
  refuse_robots(scenario, "Simbody");
  for (const Body& body : scenario.model.bodies) {
    const SimTK::Body::Rigid rigid(SimTK::MassProperties(
        body.mass, SimTK::Vec3(0), SimTK::Inertia(body.inertia.x(), body.inertia.y(), body.inertia.z())));
    bodies_.emplace_back(matter_.updGround(), SimTK::Transform(), rigid, SimTK::Transform());
    masses_.push_back(body.mass);
  }
  add_pairs(scenario);
  if (!rigid_) add_compliant(scenario, setting);
  forces_ = std::make_unique<SimTK::Force::DiscreteForces>(general_, matter_);
  SimTK::State start = system_.realizeTopology();
  system_.realizeModel(start);
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const double* v = &scenario.initial.v[6 * b];
    bodies_[b].setQToFitTransform(start, transform(scenario.initial.pose[b]));
    bodies_[b].setUToFitVelocity(start,
                                 SimTK::SpatialVec(SimTK::Vec3(v[3], v[4], v[5]), SimTK::Vec3(v[0], v[1], v[2])));
  }
  if (rigid_) {
    stepper_ = std::make_unique<SimTK::SemiExplicitEulerTimeStepper>(system_);
    if (setting.variant == "rigid-pgs") stepper_->setImpulseSolverType(SimTK::SemiExplicitEulerTimeStepper::PGS);
    stepper_->setConstraintTolerance(setting.knobs.at("constraint_tolerance"));
    stepper_->initialize(start);
  } else {
    integrator_ = std::make_unique<SimTK::RungeKuttaMersonIntegrator>(system_);
    integrator_->setAccuracy(setting.knobs.at("accuracy"));
    integrator_->initialize(start);
  }
}

EngineWorld make(const Scenario& scenario, const EngineSetting& setting) {
  const auto scene = std::make_shared<SimbodyScene>(scenario, setting);
  EngineWorld world;
  world.load = [scene](const Loads& loads) { scene->load(loads); };
  world.step = [scene](double h) { scene->step(h); };
  world.read = [scene](State& state) { scene->read(state); };
  world.contacts = [] { return -1; };
  return world;
}

Engine simbody() {
  Engine engine;
  engine.name = "simbody";
  engine.summary = "Simbody: elastic contact under error control, or rigid contact of corners and spheres on planes";
  int major = 0, minor = 0, build = 0;
  SimTK_version_simbody(&major, &minor, &build);
  engine.version = std::to_string(major) + "." + std::to_string(minor) + "." + std::to_string(build);
  engine.precision = "double";
  engine.package = "libsimbody-dev";
  engine.documentation = {
      "Simbody 3.7 theory manual: compliant contact",
      "ConditionalConstraint.h, SemiExplicitEulerTimeStepper.h, CompliantContactSubsystem.h of 3.7"};
  engine.shared = {"friction: static and dynamic coefficient of the pair (rigid), of all materials (compliant)",
                   "gravity, forces at the centre of mass, masses, principal inertias: as the scene's",
                   "sleep, damping: none"};
  engine.apart = {"compliant: friction grows with slip up to transition_speed, so that nothing sticks",
                  "compliant: as many internal steps in a step as the accuracy takes",
                  "no contact of boxes with boxes"};
  engine.variants = {{"compliant", "elastic contact, Runge, Kutta and Merson's method under error control", 1, {}},
                     {"rigid", "rigid contact, Simbody's PLUS impulse solver", 1, {}},
                     {"rigid-pgs", "rigid contact, projected Gauss and Seidel", 1, {}}};
  engine.knobs = {{"stiffness", 1e6, "Pa", "of compliant materials (plane strain)"},
                  {"dissipation", 0.5, "s/m", "of compliant materials"},
                  {"transition_speed", 0.01, "m/s", "slip at which compliant friction is full"},
                  {"accuracy", 1e-3, "", "relative, of the integration of compliant contact"},
                  {"constraint_tolerance", 1e-3, "", "of rigid contact"}};
  engine.make = make;
  return engine;
}

}  // namespace

}  // namespace cb

int main(int argc, char** argv) { return cb::engine_main(cb::simbody(), argc, argv); }
