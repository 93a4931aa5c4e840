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

#include <cmath>
#include <dart/collision/CollisionFilter.hpp>
#include <dart/collision/dart/DARTCollisionDetector.hpp>
#include <dart/config.hpp>
#include <dart/constraint/BoxedLcpConstraintSolver.hpp>
#include <dart/constraint/DantzigBoxedLcpSolver.hpp>
#include <dart/constraint/PgsBoxedLcpSolver.hpp>
#include <dart/dynamics/BodyNode.hpp>
#include <dart/dynamics/BoxShape.hpp>
#include <dart/dynamics/FreeJoint.hpp>
#include <dart/dynamics/Skeleton.hpp>
#include <dart/dynamics/SphereShape.hpp>
#include <dart/dynamics/WeldJoint.hpp>
#include <dart/simulation/World.hpp>
#include <memory>

#include "frame/engine.h"

namespace cb {

namespace {

namespace dd = dart::dynamics;

/// Numbers of shapes of which pairs' laws are the least (friction) and the product (restitution).
struct Surfaces {
  std::vector<double> mu, root_e;

  explicit Surfaces(const Scenario& scenario) : mu(scenario.shapes.size(), 0.0), root_e(mu) {
    const auto n = static_cast<int>(scenario.shapes.size());
    const auto each = [&](const auto& see) {
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < i; ++j)
          if (const PairLaw* law = scenario.pairs.find(i, j);
              law != nullptr && scenario.shapes[i].body != scenario.shapes[j].body)
            see(static_cast<std::size_t>(i), static_cast<std::size_t>(j), *law);
    };
    each([&](std::size_t i, std::size_t j, const PairLaw& law) {
      for (const std::size_t at : {i, j}) {
        mu[at] = std::max(mu[at], law.mu);
        root_e[at] = std::max(root_e[at], std::sqrt(law.restitution));
      }
    });
    each([&](std::size_t i, std::size_t j, const PairLaw& law) {
      if (std::min(mu[i], mu[j]) != law.mu)
        throw Unsupported("friction: DART takes the lesser of both shapes', which gives this scene's pairs no numbers");
      if (std::abs(root_e[i] * root_e[j] - law.restitution) > 1e-12)
        throw Unsupported(
            "restitution: DART takes the product of both shapes', which gives this scene's pairs no numbers");
    });
  }
};

class DartScene {
 public:
  DartScene(const Scenario& scenario, const EngineSetting& setting);

  void load(const Loads& loads) {
    world_->setGravity(loads.gravity);
    for (std::size_t b = 0; b < bodies_.size(); ++b)
      if (!loads.force[b].isZero()) bodies_[b]->addExtForce(loads.force[b]);
  }
  void step(double) { world_->step(true); }
  void read(State& state) const {
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      const Eigen::Isometry3d& at = bodies_[b]->getWorldTransform();
      state.pose[b] = {at.translation(), Quat(at.linear())};
      const Vec3 v = bodies_[b]->getLinearVelocity(), w = bodies_[b]->getAngularVelocity();
      for (int k = 0; k < 3; ++k) {
        state.v[6 * b + static_cast<std::size_t>(k)] = v[k];
        state.v[6 * b + 3 + static_cast<std::size_t>(k)] = w[k];
      }
    }
  }
  int contacts() const { return static_cast<int>(world_->getLastCollisionResult().getNumContacts()); }

 private:
  void add_shape(dd::BodyNode& node, const Shape& shape, std::size_t index, const Pose& at, const Surfaces& surfaces);
  void filter(const Scenario& scenario);

  std::shared_ptr<dart::simulation::World> world_;
  std::vector<dd::BodyNode*> bodies_;
  std::vector<dd::BodyNode*> node_of_shape_;
};

void DartScene::add_shape(dd::BodyNode& node, const Shape& shape, std::size_t index, const Pose& at,
                          const Surfaces& surfaces) {
  constexpr double extent = 200;  // m, of a half-space's box
  dd::ShapePtr made;
  Pose pose = at;
  if (shape.kind == ShapeKind::sphere) {
    made = std::make_shared<dd::SphereShape>(shape.radius);
  } else if (shape.kind == ShapeKind::box) {
    made = std::make_shared<dd::BoxShape>(2 * shape.half_extents);
  } else if (shape.kind == ShapeKind::half_space) {
    made = std::make_shared<dd::BoxShape>(Vec3::Constant(extent));
    pose.p -= pose.q * Vec3::UnitY() * extent / 2;
  } else {
    throw Unsupported("a cylinder (" + shape.name + "): DART's own detector knows boxes and spheres");
  }
  auto* added = node.createShapeNodeWith<dd::CollisionAspect, dd::DynamicsAspect>(made);
  Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
  transform.linear() = pose.q.toRotationMatrix();
  transform.translation() = pose.p;
  added->setRelativeTransform(transform);
  added->getDynamicsAspect()->setFrictionCoeff(surfaces.mu[index]);
  added->getDynamicsAspect()->setRestitutionCoeff(surfaces.root_e[index]);
  node_of_shape_[index] = &node;
}

/// Pairs that the scene does not declare pass through each other.
void DartScene::filter(const Scenario& scenario) {
  const auto pairs = std::make_shared<dart::collision::BodyNodeCollisionFilter>();
  const auto n = static_cast<int>(scenario.shapes.size());
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < i; ++j)
      if (scenario.shapes[i].body != scenario.shapes[j].body && scenario.pairs.find(i, j) == nullptr)
        pairs->addBodyNodePairToBlackList(node_of_shape_[static_cast<std::size_t>(i)],
                                          node_of_shape_[static_cast<std::size_t>(j)]);
  world_->getConstraintSolver()->getCollisionOption().collisionFilter = pairs;
}

DartScene::DartScene(const Scenario& scenario, const EngineSetting& setting)
    : world_(dart::simulation::World::create()), node_of_shape_(scenario.shapes.size()) {
  refuse_robots(scenario, "DART");
  const Surfaces surfaces(scenario);
  world_->setTimeStep(setting.step);
  auto solver = std::make_unique<dart::constraint::BoxedLcpConstraintSolver>();
  if (setting.variant == "pgs") {
    const auto pgs = std::make_shared<dart::constraint::PgsBoxedLcpSolver>();
    dart::constraint::PgsBoxedLcpSolver::Option option;
    option.mMaxIteration = static_cast<int>(setting.knobs.at("iterations"));
    pgs->setOption(option);
    solver->setBoxedLcpSolver(pgs);
    solver->setSecondaryBoxedLcpSolver(nullptr);
  } else {
    solver->setBoxedLcpSolver(std::make_shared<dart::constraint::DantzigBoxedLcpSolver>());
    if (setting.knobs.at("fall_back") == 0) solver->setSecondaryBoxedLcpSolver(nullptr);
  }
  solver->setCollisionDetector(dart::collision::DARTCollisionDetector::create());
  world_->setConstraintSolver(std::move(solver));
  for (std::size_t b = 0; b < scenario.model.bodies.size(); ++b) {
    const Body& body = scenario.model.bodies[b];
    const auto skeleton = dd::Skeleton::create(body.name);
    dd::BodyNode::Properties properties;
    properties.mInertia.setMass(body.mass);
    properties.mInertia.setMoment(body.inertia.x(), body.inertia.y(), body.inertia.z(), 0, 0, 0);
    const auto [joint, node] =
        skeleton->createJointAndBodyNodePair<dd::FreeJoint>(nullptr, dd::FreeJoint::Properties(), properties);
    for (std::size_t i = 0; i < scenario.shapes.size(); ++i)
      if (scenario.shapes[i].body == static_cast<int>(b))
        add_shape(*node, scenario.shapes[i], i, scenario.shapes[i].local, surfaces);
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = scenario.initial.pose[b].q.toRotationMatrix();
    pose.translation() = scenario.initial.pose[b].p;
    joint->setTransform(pose);
    const double* v = &scenario.initial.v[6 * b];
    joint->setLinearVelocity(Vec3(v[0], v[1], v[2]));
    joint->setAngularVelocity(Vec3(v[3], v[4], v[5]));
    world_->addSkeleton(skeleton);
    bodies_.push_back(node);
  }
  for (std::size_t i = 0; i < scenario.shapes.size(); ++i) {
    if (scenario.shapes[i].body >= 0) continue;
    const auto fixed = dd::Skeleton::create(scenario.shapes[i].name);
    const auto [joint, node] = fixed->createJointAndBodyNodePair<dd::WeldJoint>(nullptr);
    add_shape(*node, scenario.shapes[i], i, scenario.shapes[i].local, surfaces);
    world_->addSkeleton(fixed);
  }
  filter(scenario);
}

EngineWorld make(const Scenario& scenario, const EngineSetting& setting) {
  const auto scene = std::make_shared<DartScene>(scenario, setting);
  EngineWorld world;
  world.load = [scene](const Loads& loads) { scene->load(loads); };
  world.step = [scene](double h) { scene->step(h); };
  world.read = [scene](State& state) { scene->read(state); };
  world.contacts = [scene] { return scene->contacts(); };
  return world;
}

Engine dart_engine() {
  const double pyramid = std::sqrt(2.0);
  Engine engine;
  engine.name = "dart";
  engine.summary = "DART: friction pyramid as a boxed LCP, by Dantzig's pivots or Gauss and Seidel";
  engine.version = DART_VERSION;
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
  engine.knobs = {{"iterations", 30, "", "of pgs a step at most"},
                  {"fall_back", 1, "", "of dantzig: 0 leaves a failure as it is"}};
  engine.make = make;
  return engine;
}

}  // namespace

}  // namespace cb

int main(int argc, char** argv) { return cb::engine_main(cb::dart_engine(), argc, argv); }
