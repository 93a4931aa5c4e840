// ODE, the Open Dynamics Engine, as an engine beside the methods.
//
// What is followed: the manual (ODE 0.16, chapters "Concepts" [ERP, CFM, friction approximation], "World", "Rigid
// bodies", "Joint types: contact", "Collision detection"), and the head of ode/contact.h.
//   * A pair's friction goes to each contact (dContact.surface.mu), with dContactApprox1: without it mu is a force in
//   N.
//   * Friction is a pyramid: two directions, each at most mu times the normal force; along axes that ODE chooses
//     (dPlaneSpace of the normal). With the knob slip_speed, where the slip is faster than that, friction acts along
//     the slip alone (dContactFDir1, mu2 = 0); slower, the pyramid has to be overcome first.
//   * The box of mu N and mu N is the same for both steppers; quick iterates (SOR), world is a direct LCP solver.
//   * The order of ODE's iterations is random: its seed is set, so that runs repeat.

#include <ode/ode.h>

#include <cmath>
#include <memory>
#include <utility>

#include "frame/engine.h"

namespace cb {

namespace {

class OdeScene {
 public:
  OdeScene(const Scenario& scenario, const EngineSetting& setting);
  ~OdeScene();
  OdeScene(const OdeScene&) = delete;
  OdeScene& operator=(const OdeScene&) = delete;

  void load(const Loads& loads);
  void step(double h);
  void read(State& state) const;
  int contacts() const { return contacts_; }

 private:
  dGeomID make_geom(const Shape& shape) const;
  void place(const Shape& shape, dGeomID geom) const;
  static void near(void* self, dGeomID a, dGeomID b) { static_cast<OdeScene*>(self)->collide(a, b); }
  void collide(dGeomID a, dGeomID b);
  void set_slip_direction(dContact& contact, dBodyID a, dBodyID b) const;

  const Scenario& scenario_;
  bool quick_;
  double slip_speed_, bounce_speed_;
  dWorldID world_;
  dSpaceID space_;
  dJointGroupID joints_;
  std::vector<dBodyID> bodies_;
  std::vector<dContact> found_;  // of one pair
  int contacts_ = 0;
};

OdeScene::OdeScene(const Scenario& scenario, const EngineSetting& setting)
    : scenario_(scenario),
      quick_(setting.variant.starts_with("quick")),
      slip_speed_(setting.knobs.at("slip_speed")),
      bounce_speed_(setting.knobs.at("bounce_speed")) {
  refuse_robots(scenario, "ODE");
  dInitODE2(0);
  dRandSetSeed(0);
  const auto knob = [&](const char* name) { return setting.knobs.at(name); };
  world_ = dWorldCreate();
  space_ = dHashSpaceCreate(nullptr);
  joints_ = dJointGroupCreate(0);
  found_.resize(static_cast<std::size_t>(knob("max_contacts")));
  dWorldSetERP(world_, knob("erp"));
  dWorldSetCFM(world_, knob("cfm"));
  dWorldSetQuickStepNumIterations(world_, static_cast<int>(knob("iterations")));
  dWorldSetQuickStepW(world_, knob("relaxation"));
  dWorldSetContactSurfaceLayer(world_, knob("surface_layer"));
  dWorldSetContactMaxCorrectingVel(world_, knob("max_correcting_speed") > 0 ? knob("max_correcting_speed") : dInfinity);
  dWorldSetAutoDisableFlag(world_, 0);  // nothing falls asleep
  dWorldSetDamping(world_, 0, 0);

  const State& start = scenario.initial;
  for (std::size_t i = 0; i < scenario.model.bodies.size(); ++i) {
    const Body& body = scenario.model.bodies[i];
    const Pose& pose = start.pose[i];
    dBodyID made = dBodyCreate(world_);
    dMass mass;
    dMassSetParameters(&mass, body.mass, 0, 0, 0, body.inertia.x(), body.inertia.y(), body.inertia.z(), 0, 0, 0);
    dBodySetMass(made, &mass);
    dBodySetPosition(made, pose.p.x(), pose.p.y(), pose.p.z());
    const dQuaternion q = {pose.q.w(), pose.q.x(), pose.q.y(), pose.q.z()};
    dBodySetQuaternion(made, q);
    const double* v = &start.v[6 * i];
    dBodySetLinearVel(made, v[0], v[1], v[2]);
    dBodySetAngularVel(made, v[3], v[4], v[5]);
    dBodySetFiniteRotationMode(made, knob("finite_rotation") != 0);
    bodies_.push_back(made);
  }
  for (std::size_t i = 0; i < scenario.shapes.size(); ++i) {
    dGeomID geom = make_geom(scenario.shapes[i]);
    dGeomSetData(geom, reinterpret_cast<void*>(i));
    if (scenario.shapes[i].kind != ShapeKind::half_space) place(scenario.shapes[i], geom);
  }
}

OdeScene::~OdeScene() {
  dJointGroupDestroy(joints_);
  dSpaceDestroy(space_);
  dWorldDestroy(world_);
  dCloseODE();
}

dGeomID OdeScene::make_geom(const Shape& shape) const {
  const Vec3 size = 2 * shape.half_extents;
  switch (shape.kind) {
    case ShapeKind::sphere:
      return dCreateSphere(space_, shape.radius);
    case ShapeKind::box:
      return dCreateBox(space_, size.x(), size.y(), size.z());
    case ShapeKind::cylinder:
      if (size.y() == 0) throw Unsupported("a disc (" + shape.name + "): ODE's cylinders have a length");
      return dCreateCylinder(space_, shape.radius, size.y());
    case ShapeKind::capsule:
      return dCreateCapsule(space_, shape.radius, size.y());
    case ShapeKind::hull:
      throw Unsupported("a hull (" + shape.name + "): the adapter has no planes and polygons for ODE's");
    case ShapeKind::half_space:
      break;
  }
  const Vec3 n = shape.local.q * Vec3::UnitY();
  return dCreatePlane(space_, n.x(), n.y(), n.z(), n.dot(shape.local.p));
}

/// ODE's cylinders and capsules lie along z, the scene's along y.
void OdeScene::place(const Shape& shape, dGeomID geom) const {
  Quat turn = shape.local.q;
  if (shape.kind == ShapeKind::cylinder || shape.kind == ShapeKind::capsule)
    turn = turn * Quat::FromTwoVectors(Vec3::UnitZ(), Vec3::UnitY());
  const Vec3& p = shape.local.p;
  const dQuaternion q = {turn.w(), turn.x(), turn.y(), turn.z()};
  if (shape.body < 0) {
    dGeomSetPosition(geom, p.x(), p.y(), p.z());
    dGeomSetQuaternion(geom, q);
    return;
  }
  dGeomSetBody(geom, bodies_[static_cast<std::size_t>(shape.body)]);
  if (p.isZero() && std::abs(turn.w()) == 1) return;
  dGeomSetOffsetPosition(geom, p.x(), p.y(), p.z());
  dGeomSetOffsetQuaternion(geom, q);
}

void OdeScene::load(const Loads& loads) {
  dWorldSetGravity(world_, loads.gravity.x(), loads.gravity.y(), loads.gravity.z());
  for (std::size_t i = 0; i < bodies_.size(); ++i)
    if (const Vec3& f = loads.force[i]; !f.isZero()) dBodyAddForce(bodies_[i], f.x(), f.y(), f.z());
}

void OdeScene::step(double h) {
  contacts_ = 0;
  dSpaceCollide(space_, this, near);
  if (quick_)
    dWorldQuickStep(world_, h);
  else
    dWorldStep(world_, h);
  dJointGroupEmpty(joints_);
}

void OdeScene::collide(dGeomID a, dGeomID b) {
  dBodyID body_a = dGeomGetBody(a), body_b = dGeomGetBody(b);
  if (body_a == body_b) return;
  const auto i = reinterpret_cast<std::size_t>(dGeomGetData(a)), j = reinterpret_cast<std::size_t>(dGeomGetData(b));
  const PairLaw* law = scenario_.pairs.find(static_cast<int>(i), static_cast<int>(j));
  if (law == nullptr) return;
  const int count = dCollide(a, b, static_cast<int>(found_.size()), &found_[0].geom, sizeof(dContact));
  for (int c = 0; c < count; ++c) {
    dContact& contact = found_[static_cast<std::size_t>(c)];
    contact.surface = {};
    contact.surface.mode = dContactApprox1;
    contact.surface.mu = law->mu;
    if (law->restitution > 0) {
      contact.surface.mode |= dContactBounce;
      contact.surface.bounce = law->restitution;
      contact.surface.bounce_vel = bounce_speed_;
    }
    if (slip_speed_ > 0) set_slip_direction(contact, body_a, body_b);
    dJointAttach(dJointCreateContact(world_, joints_, &contact), body_a, body_b);
  }
  contacts_ += count;
}

void OdeScene::set_slip_direction(dContact& contact, dBodyID a, dBodyID b) const {
  const Vec3 n(contact.geom.normal[0], contact.geom.normal[1], contact.geom.normal[2]);
  Vec3 slip = Vec3::Zero();
  for (const auto& [body, sign] : {std::pair(a, 1.0), std::pair(b, -1.0)}) {
    if (body == nullptr) continue;
    dVector3 v;
    dBodyGetPointVel(body, contact.geom.pos[0], contact.geom.pos[1], contact.geom.pos[2], v);
    slip += sign * Vec3(v[0], v[1], v[2]);
  }
  slip -= n.dot(slip) * n;
  const double speed = slip.norm();
  if (speed < slip_speed_) return;
  contact.surface.mode |= dContactFDir1 | dContactMu2;
  contact.surface.mu2 = 0;  // across, it would hold the motion to a straight line
  for (int i = 0; i < 3; ++i) contact.fdir1[i] = slip[i] / speed;
}

void OdeScene::read(State& state) const {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const double *p = dBodyGetPosition(bodies_[i]), *q = dBodyGetQuaternion(bodies_[i]);
    const double *v = dBodyGetLinearVel(bodies_[i]), *w = dBodyGetAngularVel(bodies_[i]);
    state.pose[i] = {Vec3(p[0], p[1], p[2]), Quat(q[0], q[1], q[2], q[3])};
    for (std::size_t k = 0; k < 3; ++k) {
      state.v[6 * i + k] = v[k];
      state.v[6 * i + 3 + k] = w[k];
    }
  }
}

EngineWorld make(const Scenario& scenario, const EngineSetting& setting) {
  const auto scene = std::make_shared<OdeScene>(scenario, setting);
  return {[scene](const Loads& loads) { scene->load(loads); }, [scene](double h) { scene->step(h); },
          [scene](State& state) { scene->read(state); }, [scene] { return scene->contacts(); }};
}

Engine ode() {
  const double pyramid = std::sqrt(2.0);
  Engine engine;
  engine.name = "ode";
  engine.summary = "Open Dynamics Engine: friction pyramid, iterated or by a direct LCP solver";
  engine.version = dODE_VERSION;
  engine.precision = "double";
  engine.package = "libode-dev";
  engine.documentation = {"ODE manual 0.16: Concepts; World; Joint types, contact; Collision detection",
                          "ode/contact.h, ode/objects.h of 0.16.2"};
  engine.shared = {"friction: mu of the pair in each contact, with dContactApprox1",
                   "restitution: bounce of the pair in each contact (dContactBounce)",
                   "gravity, forces at the centre of mass, masses, principal inertias: as the scene's",
                   "sleep (auto-disable) off, damping off, seed of the random order of iterations 0"};
  engine.apart = {"contact points: ODE's own, of overlapping shapes only",
                  "penetration is taken away by a velocity, erp / h times the depth, which stays in the motion",
                  "cfm: contacts give way by cfm times their force a step"};
  engine.variants = {
      {"quick", "dWorldQuickStep: successive over-relaxation, 20 iterations", pyramid, {}},
      {"world", "dWorldStep: direct LCP solver (Dantzig's algorithm after Baraff)", pyramid, {}},
      {"quick-slip", "quick, with friction along the slip where it slips", pyramid, {{"slip_speed", 1e-4}}},
      {"world-slip", "world, with friction along the slip where it slips", pyramid, {{"slip_speed", 1e-4}}}};
  engine.knobs = {{"iterations", 20, "", "of quick a step", 1},
                  {"relaxation", 1.3, "", "of quick: over-relaxation"},
                  {"erp", 0.2, "", "share of the depth that a step takes away"},
                  {"cfm", 1e-10, "m/(N s)", "by which a contact's velocity gives way to its force"},
                  {"surface_layer", 0, "m", "depth that is left in"},
                  {"max_correcting_speed", 0, "m/s", "with which depth is taken away at most; 0: any"},
                  {"bounce_speed", 0, "m/s", "below which nothing bounces"},
                  {"max_contacts", 8, "", "of a pair of shapes at most", 1},
                  {"slip_speed", 0, "m/s", "beyond which friction acts along the slip alone; 0: never"},
                  {"finite_rotation", 0, "", "1: orientations by finite rotations", 0, 1}};
  engine.slip_knob = "slip_speed";
  engine.make = make;
  return engine;
}

}  // namespace

}  // namespace cb

int main(int argc, char** argv) { return cb::engine_main(cb::ode(), argc, argv); }
