// Bullet as an engine beside the methods; compiled twice, with its double and its single precision libraries.
//
// What is followed: the Bullet User Manual 2.83 ("Rigid Body Dynamics"; "Friction, restitution"; "Simulation tick"),
// and the heads of btContactSolverInfo.h, btManifoldResult.h, btDiscreteDynamicsWorld.h of 3.24.
//   * A pair's friction and restitution replace the product of the two objects' own: gCalculateCombined*Callback.
//   * stepSimulation(h, 0): one step of h, no interpolation.
//   * Friction acts along the slip, one direction a contact; with friction_directions = 2 along two,
//     which sequential impulses clip to a cone.
//   * Contacts begin at a distance (breaking_threshold) and stop what would close it within the step, so that at small
//     steps most of a bounce is lost: m_restitutionVelocityThreshold and restitution act on what is left.

#include <BulletDynamics/ConstraintSolver/btNNCGConstraintSolver.h>
#include <BulletDynamics/MLCPSolvers/btDantzigSolver.h>
#include <BulletDynamics/MLCPSolvers/btMLCPSolver.h>
#include <BulletDynamics/MLCPSolvers/btSolveProjectedGaussSeidel.h>
#include <btBulletDynamicsCommon.h>
#include <fmt/format.h>

#include <memory>

#include "frame/engine.h"

namespace cb {

namespace {

btScalar scalar(double x) { return static_cast<btScalar>(x); }
btVector3 vector(const Vec3& v) { return {scalar(v.x()), scalar(v.y()), scalar(v.z())}; }
btQuaternion quaternion(const Quat& q) { return {scalar(q.x()), scalar(q.y()), scalar(q.z()), scalar(q.w())}; }
btTransform transform(const Pose& pose) { return btTransform(quaternion(pose.q), vector(pose.p)); }

/// The scene at work: Bullet's callbacks are plain functions.
const Scenario* scene_of_callbacks = nullptr;

/// Shapes of one object share a law with any other shape, or the scene is refused: its first shape stands for it.
const PairLaw* law_of(const btCollisionObject* a, const btCollisionObject* b) {
  const int i = a->getUserIndex(), j = b->getUserIndex();
  return i < 0 || j < 0 ? nullptr : scene_of_callbacks->pairs.find(i, j);
}
btScalar pair_friction(const btCollisionObject* a, const btCollisionObject* b) {
  const PairLaw* law = law_of(a, b);
  return law != nullptr ? scalar(law->mu) : 0;
}
btScalar pair_restitution(const btCollisionObject* a, const btCollisionObject* b) {
  const PairLaw* law = law_of(a, b);
  return law != nullptr ? scalar(law->restitution) : 0;
}

/// Pairs that the scene does not declare pass through each other.
struct Declared : btOverlapFilterCallback {
  bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override {
    const auto* x = static_cast<const btCollisionObject*>(a->m_clientObject);
    const auto* y = static_cast<const btCollisionObject*>(b->m_clientObject);
    return law_of(x, y) != nullptr;
  }
};

class BulletScene {
 public:
  BulletScene(const Scenario& scenario, const EngineSetting& setting);
  ~BulletScene();
  BulletScene(const BulletScene&) = delete;
  BulletScene& operator=(const BulletScene&) = delete;

  void load(const Loads& loads);
  void step(double h) { world_->stepSimulation(scalar(h), 0); }
  void read(State& state) const;
  int contacts() const;

 private:
  void make_solver(const std::string& variant);
  void set_solver(const Knobs& knobs);
  btCollisionShape* make_shape(const Shape& shape, double margin);
  /// The shape of an object with these shapes, in its frame.
  btCollisionShape* joined(const std::vector<int>& shapes, double margin);
  void add(const std::vector<int>& shapes, int body, const Pose& pose, const Knobs& knobs);

  const Scenario& scenario_;
  Declared declared_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  std::unique_ptr<btMLCPSolverInterface> mlcp_;
  std::unique_ptr<btConstraintSolver> solver_;
  std::unique_ptr<btDiscreteDynamicsWorld> world_;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btRigidBody>> objects_;  // bodies first, in their order; then what is fixed
};

BulletScene::BulletScene(const Scenario& scenario, const EngineSetting& setting) : scenario_(scenario) {
  refuse_robots(scenario, "Bullet");
  scene_of_callbacks = &scenario_;
  gCalculateCombinedFrictionCallback = pair_friction;
  gCalculateCombinedRestitutionCallback = pair_restitution;
  gContactBreakingThreshold = scalar(setting.knobs.at("breaking_threshold"));
  make_solver(setting.variant);
  world_ = std::make_unique<btDiscreteDynamicsWorld>(&dispatcher_, &broadphase_, solver_.get(), &configuration_);
  broadphase_.getOverlappingPairCache()->setOverlapFilterCallback(&declared_);
  set_solver(setting.knobs);

  std::vector<std::vector<int>> of_body(scenario.model.bodies.size());
  std::vector<int> fixed;
  for (std::size_t i = 0; i < scenario.shapes.size(); ++i) {
    const int body = scenario.shapes[i].body;
    (body < 0 ? fixed : of_body[static_cast<std::size_t>(body)]).push_back(static_cast<int>(i));
  }
  for (std::size_t body = 0; body < of_body.size(); ++body)
    add(of_body[body], static_cast<int>(body), scenario.initial.pose[body], setting.knobs);
  for (const int shape : fixed) add({shape}, -1, {}, setting.knobs);
}

BulletScene::~BulletScene() {
  for (auto object = objects_.rbegin(); object != objects_.rend(); ++object) world_->removeRigidBody(object->get());
}

void BulletScene::make_solver(const std::string& variant) {
  if (variant.starts_with("si")) {
    solver_ = std::make_unique<btSequentialImpulseConstraintSolver>();
    return;
  }
  if (variant == "nncg") {
    solver_ = std::make_unique<btNNCGConstraintSolver>();
    return;
  }
  if (variant == "dantzig")
    mlcp_ = std::make_unique<btDantzigSolver>();
  else
    mlcp_ = std::make_unique<btSolveProjectedGaussSeidel>();
  solver_ = std::make_unique<btMLCPSolver>(mlcp_.get());
}

void BulletScene::set_solver(const Knobs& knobs) {
  btContactSolverInfo& info = world_->getSolverInfo();
  info.m_numIterations = static_cast<int>(knobs.at("iterations"));
  info.m_erp2 = scalar(knobs.at("erp2"));
  info.m_globalCfm = scalar(knobs.at("cfm"));
  info.m_splitImpulse = knobs.at("split_impulse") != 0;
  info.m_warmstartingFactor = scalar(knobs.at("warm_start"));
  info.m_restitutionVelocityThreshold = scalar(knobs.at("bounce_speed"));
  info.m_minimumSolverBatchSize = static_cast<int>(knobs.at("batch"));
  if (knobs.at("friction_directions") == 2) info.m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
  if (knobs.at("warm_start") == 0) info.m_solverMode &= ~SOLVER_USE_WARMSTARTING;
  // Its own default dates from before there were such solvers: they want islands one by one.
  if (mlcp_) info.m_minimumSolverBatchSize = 1;
}

btCollisionShape* BulletScene::make_shape(const Shape& shape, double margin) {
  std::unique_ptr<btCollisionShape> made;
  switch (shape.kind) {
    case ShapeKind::sphere:
      made = std::make_unique<btSphereShape>(scalar(shape.radius));
      break;
    case ShapeKind::box:
      made = std::make_unique<btBoxShape>(vector(shape.half_extents));
      break;
    case ShapeKind::cylinder:
      if (shape.half_extents.y() == 0)
        throw Unsupported("a disc (" + shape.name + "): Bullet's cylinders have a length");
      made = std::make_unique<btCylinderShape>(vector(shape.half_extents));
      break;
    case ShapeKind::capsule:
      made = std::make_unique<btCapsuleShape>(scalar(shape.radius), scalar(2 * shape.half_extents.y()));
      break;
    case ShapeKind::hull:
      throw Unsupported("a hull (" + shape.name + "): Bullet's are larger than their points by a margin");
    case ShapeKind::half_space: {
      const Vec3 n = shape.local.q * Vec3::UnitY();
      made = std::make_unique<btStaticPlaneShape>(vector(n), scalar(n.dot(shape.local.p)));
      break;
    }
  }
  if (margin >= 0 && shape.kind != ShapeKind::sphere && shape.kind != ShapeKind::capsule)
    made->setMargin(scalar(margin));
  shapes_.push_back(std::move(made));
  return shapes_.back().get();
}

btCollisionShape* BulletScene::joined(const std::vector<int>& of, double margin) {
  const auto shape = [&](int i) -> const Shape& { return scenario_.shapes[static_cast<std::size_t>(i)]; };
  const Shape& first = shape(of.front());
  const bool plain =
      first.kind == ShapeKind::half_space || (first.local.p.isZero() && std::abs(first.local.q.w()) == 1);
  if (of.size() == 1 && plain) return make_shape(first, margin);
  auto compound = std::make_unique<btCompoundShape>();
  for (const int i : of) {
    if (scenario_.pairs.group[static_cast<std::size_t>(i)] !=
        scenario_.pairs.group[static_cast<std::size_t>(of.front())])
      throw Unsupported(fmt::format("shapes of one body with other laws ({}, {}): the adapter has one law an object",
                                    first.name, shape(i).name));
    compound->addChildShape(transform(shape(i).local), make_shape(shape(i), margin));
  }
  shapes_.push_back(std::move(compound));
  return shapes_.back().get();
}

/// `body` -1: fixed.
void BulletScene::add(const std::vector<int>& of, int body, const Pose& pose, const Knobs& knobs) {
  btCollisionShape* shape = nullptr;
  if (of.empty()) {
    shapes_.push_back(std::make_unique<btEmptyShape>());
    shape = shapes_.back().get();
  } else {
    shape = joined(of, knobs.at("margin"));
  }
  const Body* moving = body < 0 ? nullptr : &scenario_.model.bodies[static_cast<std::size_t>(body)];
  btRigidBody::btRigidBodyConstructionInfo info(moving ? scalar(moving->mass) : 0, nullptr, shape,
                                                moving ? vector(moving->inertia) : btVector3(0, 0, 0));
  info.m_startWorldTransform = transform(pose);
  objects_.push_back(std::make_unique<btRigidBody>(info));
  btRigidBody& object = *objects_.back();
  object.setUserIndex(of.empty() ? -1 : of.front());
  object.setActivationState(DISABLE_DEACTIVATION);  // nothing falls asleep
  if (moving) {
    const double* v = &scenario_.initial.v[6 * static_cast<std::size_t>(body)];
    object.setLinearVelocity(vector({v[0], v[1], v[2]}));
    object.setAngularVelocity(vector({v[3], v[4], v[5]}));
  }
  world_->addRigidBody(&object);
}

void BulletScene::load(const Loads& loads) {
  world_->setGravity(vector(loads.gravity));
  for (std::size_t i = 0; i < loads.force.size(); ++i)
    if (!loads.force[i].isZero()) objects_[i]->applyCentralForce(vector(loads.force[i]));
}

void BulletScene::read(State& state) const {
  for (std::size_t i = 0; i < state.pose.size(); ++i) {
    const btTransform& at = objects_[i]->getWorldTransform();
    const btQuaternion q = at.getRotation();
    const btVector3 &p = at.getOrigin(), &v = objects_[i]->getLinearVelocity(), &w = objects_[i]->getAngularVelocity();
    state.pose[i].p = Vec3(p.x(), p.y(), p.z());
    state.pose[i].q = Quat(q.w(), q.x(), q.y(), q.z()).normalized();
    for (int k = 0; k < 3; ++k) {
      state.v[6 * i + k] = v[k];
      state.v[6 * i + 3 + k] = w[k];
    }
  }
}

int BulletScene::contacts() const {
  int count = 0;
  for (int i = 0; i < dispatcher_.getNumManifolds(); ++i)
    count += const_cast<btCollisionDispatcher&>(dispatcher_).getManifoldByIndexInternal(i)->getNumContacts();
  return count;
}

EngineWorld make(const Scenario& scenario, const EngineSetting& setting) {
  const auto scene = std::make_shared<BulletScene>(scenario, setting);
  return {[scene](const Loads& loads) { scene->load(loads); }, [scene](double h) { scene->step(h); },
          [scene](State& state) { scene->read(state); }, [scene] { return scene->contacts(); }};
}

Engine bullet() {
  const bool single = sizeof(btScalar) == sizeof(float);
  Engine engine;
  engine.name = single ? "bullet-float" : "bullet";
  engine.summary =
      fmt::format("Bullet, {} precision: sequential impulses, or an MLCP solver", single ? "single" : "double");
  engine.version = fmt::format("{}.{:02}", btGetVersion() / 100, btGetVersion() % 100);
  engine.precision = single ? "single" : "double";
  engine.package = "libbullet-dev";
  engine.documentation = {"Bullet User Manual 2.83: Rigid Body Dynamics",
                          "btContactSolverInfo.h, btManifoldResult.h, btDiscreteDynamicsWorld.h of 3.24"};
  engine.shared = {"friction and restitution: of the pair, in place of the product of the two objects' own",
                   "gravity, forces at the centre of mass, masses, principal inertias: as the scene's",
                   "sleep (deactivation) off, damping 0"};
  engine.apart = {"contact points: up to four a pair, kept from step to step; those within 0.02 m of touching count",
                  "shapes have a margin, inside for boxes and cylinders",
                  "penetration is taken away beside the velocities (split impulse) or in them, erp2 a step"};
  engine.variants = {{"si10", "sequential impulses, 10 iterations", 1, {}},
                     {"si50",
                      "sequential impulses, 50 iterations, two directions of friction, clipped to a cone",
                      1,
                      {{"iterations", 50}, {"friction_directions", 2}}},
                     {"nncg", "nonlinear nonsmooth conjugate gradients, 10 iterations", 1, {}},
                     {"dantzig", "MLCP solver of Dantzig", 1, {}},
                     {"pgs", "MLCP solver by projected Gauss-Seidel", 1, {}}};
  engine.knobs = {
      {"iterations", 10, "", "of a step", 1},
      {"erp2", 0.2, "", "share of a depth that a step takes away, by the split impulse or in the velocities"},
      {"cfm", 0, "m/(N s)", "by which a contact's velocity gives way to its force"},
      {"split_impulse", 1, "", "0: depth is taken away in the velocities", 0, 1},
      {"warm_start", 0.85, "", "share of the last step's impulses that a step begins with"},
      {"friction_directions", 1, "", "1: along the slip; 2: and across", 1, 2},
      {"bounce_speed", 0.2, "m/s", "below which nothing bounces"},
      {"breaking_threshold", 0.02, "m", "beyond which a kept contact point is given up"},
      {"margin", 0.04, "m", "of boxes, cylinders and planes; negative: as each shape has it"},
      {"batch", 128, "", "islands are solved together up to so many constraints", 0}};
  engine.make = make;
  return engine;
}

}  // namespace

}  // namespace cb

int main(int argc, char** argv) { return cb::engine_main(cb::bullet(), argc, argv); }
