#include "dart_scene.h"

#include <algorithm>
#include <dart/collision/CollisionFilter.hpp>
#include <dart/collision/CollisionObject.hpp>
#include <dart/collision/dart/DARTCollisionDetector.hpp>
#include <dart/config.hpp>
#include <dart/constraint/BoxedLcpConstraintSolver.hpp>
#include <dart/constraint/ConstrainedGroup.hpp>
#include <dart/constraint/ContactConstraint.hpp>
#include <dart/constraint/DantzigBoxedLcpSolver.hpp>
#include <dart/constraint/PgsBoxedLcpSolver.hpp>
#include <dart/dynamics/BodyNode.hpp>
#include <dart/dynamics/BoxShape.hpp>
#include <dart/dynamics/FreeJoint.hpp>
#include <dart/dynamics/Skeleton.hpp>
#include <dart/dynamics/SphereShape.hpp>
#include <dart/dynamics/WeldJoint.hpp>
#include <dart/simulation/World.hpp>
#include <functional>
#include <map>
#include <set>

namespace dart_scene {

namespace {

namespace dd = dart::dynamics;

Eigen::Vector3d vec(const double x[3]) { return Eigen::Vector3d(x[0], x[1], x[2]); }
Eigen::Isometry3d isometry(const plain::Pose& pose) {
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  out.linear() = Eigen::Quaterniond(pose.q[0], pose.q[1], pose.q[2], pose.q[3]).toRotationMatrix();
  out.translation() = vec(pose.p);
  return out;
}

/// Velocity in a frame that it does not turn with: DART keeps that of the world while it moves a body.
void put(const dd::BodyNode& node, const Eigen::Isometry3d& frame, std::vector<double>& out) {
  for (const Eigen::Vector3d& x : {node.getLinearVelocity(), node.getAngularVelocity()}) {
    const Eigen::Vector3d turned = frame.linear().transpose() * x;
    out.insert(out.end(), turned.data(), turned.data() + 3);
  }
}

/// Passes LCPs on, and keeps the right side of the last one.
class Listening : public dart::constraint::BoxedLcpSolver {
 public:
  Listening(std::shared_ptr<dart::constraint::BoxedLcpSolver> to, std::vector<double>& b) : to_(std::move(to)), b_(b) {}
  const std::string& getType() const override { return to_->getType(); }
  bool solve(int n, double* A, double* x, double* b, int nub, double* lo, double* hi, int* findex,
             bool early) override {
    b_.assign(b, b + n);
    return to_->solve(n, A, x, b, nub, lo, hi, findex, early);
  }
  bool canSolve(int n, const double* A) override { return to_->canSolve(n, A); }

 private:
  std::shared_ptr<dart::constraint::BoxedLcpSolver> to_;
  std::vector<double>& b_;
};

/// A contact with the right side of its normal row.
struct Seen {
  const dart::collision::Contact* contact;
  double b;
};

/// Sees each group of bodies that is solved: their contacts, and the velocities before.
class Solver : public dart::constraint::BoxedLcpConstraintSolver {
 public:
  std::function<void()> before;
  std::vector<Seen> seen;
  std::vector<double> b;

 protected:
  void solveConstrainedGroup(dart::constraint::ConstrainedGroup& group) override {
    if (before) before();
    BoxedLcpConstraintSolver::solveConstrainedGroup(group);
    if (!before) return;
    std::map<const dart::constraint::ConstraintBase*, const dart::collision::Contact*> of;
    std::size_t next = 0;
    for (const dart::collision::Contact& contact : mCollisionResult.getContacts())
      if (!dart::collision::Contact::isZeroNormal(contact.normal) && contact.penetrationDepth >= 0 &&
          next < mContactConstraints.size())
        of[mContactConstraints[next++].get()] = &contact;
    std::size_t row = 0;
    for (std::size_t i = 0; i < group.getNumConstraints(); ++i) {
      const auto constraint = group.getConstraint(i);
      seen.push_back({of.at(constraint.get()), b.at(row)});
      row += constraint->getDimension();
    }
  }
};

std::unique_ptr<Solver> constraint_solver(const Setting& setting) {
  auto solver = std::make_unique<Solver>();
  std::shared_ptr<dart::constraint::BoxedLcpSolver> lcp;
  if (setting.pgs) {
    const auto pgs = std::make_shared<dart::constraint::PgsBoxedLcpSolver>();
    dart::constraint::PgsBoxedLcpSolver::Option option;
    option.mMaxIteration = setting.iterations;
    pgs->setOption(option);
    lcp = pgs;
  } else {
    lcp = std::make_shared<dart::constraint::DantzigBoxedLcpSolver>();
  }
  if (setting.keep_problems) lcp = std::make_shared<Listening>(lcp, solver->b);
  solver->setBoxedLcpSolver(lcp);
  if (setting.pgs || !setting.fall_back) solver->setSecondaryBoxedLcpSolver(nullptr);
  solver->setCollisionDetector(dart::collision::DARTCollisionDetector::create());
  return solver;
}

}  // namespace

class World final : public plain::World {
 public:
  World(const plain::Scene& scene, const Setting& setting);
  void load(int body, const double force[3]) override;
  void step(double h) override;
  void read(std::vector<plain::Body>& bodies) override;
  int contacts() const override;
  const plain::Problem* problem() override;

 private:
  std::shared_ptr<dart::simulation::World> world_ = dart::simulation::World::create();
  std::vector<dd::BodyNode*> bodies_, node_of_shape_;
  Solver* solver_ = nullptr;
  plain::Problem problem_;
  std::vector<Eigen::Isometry3d> frame_;  // of the bodies at their contacts, before the step moves them

  void add_body(const plain::Scene& scene, std::size_t index, const Setting& setting);
  void add_fixed(const plain::Scene& scene, std::size_t index, const Setting& setting);
  void add_shape(dd::BodyNode& node, const plain::Shape& shape, std::size_t index, const Setting& setting);
  void filter(const plain::Scene& scene) const;
  void keep_before();
  void keep_contact(const Seen& seen);
};

void World::add_shape(dd::BodyNode& node, const plain::Shape& shape, std::size_t index, const Setting& setting) {
  constexpr double extent = 200;  // m, of a half-space's box
  Eigen::Isometry3d at = isometry(shape.at);
  dd::ShapePtr made;
  if (shape.kind == plain::Kind::sphere) {
    made = std::make_shared<dd::SphereShape>(shape.radius);
  } else if (shape.kind == plain::Kind::box) {
    made = std::make_shared<dd::BoxShape>(2 * vec(shape.half));
  } else {
    made = std::make_shared<dd::BoxShape>(Eigen::Vector3d::Constant(extent));
    at.translation() -= at.linear().col(1) * extent / 2;
  }
  auto* added = node.createShapeNodeWith<dd::CollisionAspect, dd::DynamicsAspect>(made);
  added->setRelativeTransform(at);
  added->getDynamicsAspect()->setFrictionCoeff(setting.mu[index]);
  added->getDynamicsAspect()->setRestitutionCoeff(setting.restitution[index]);
  node_of_shape_[index] = &node;
}

void World::add_body(const plain::Scene& scene, std::size_t index, const Setting& setting) {
  const plain::Body& body = scene.bodies[index];
  const auto skeleton = dd::Skeleton::create("body " + std::to_string(index));
  dd::BodyNode::Properties properties;
  properties.mInertia.setMass(body.mass);
  properties.mInertia.setMoment(body.inertia[0], body.inertia[1], body.inertia[2], 0, 0, 0);
  const auto [joint, node] =
      skeleton->createJointAndBodyNodePair<dd::FreeJoint>(nullptr, dd::FreeJoint::Properties(), properties);
  for (std::size_t i = 0; i < scene.shapes.size(); ++i)
    if (scene.shapes[i].body == static_cast<int>(index)) add_shape(*node, scene.shapes[i], i, setting);
  joint->setTransform(isometry(body.pose));
  joint->setLinearVelocity(vec(body.v));
  joint->setAngularVelocity(vec(body.w));
  world_->addSkeleton(skeleton);
  bodies_.push_back(node);
}

void World::add_fixed(const plain::Scene& scene, std::size_t index, const Setting& setting) {
  const auto fixed = dd::Skeleton::create("fixed " + std::to_string(index));
  const auto [joint, node] = fixed->createJointAndBodyNodePair<dd::WeldJoint>(nullptr);
  add_shape(*node, scene.shapes[index], index, setting);
  world_->addSkeleton(fixed);
}

/// Shapes that are no pair pass through each other.
void World::filter(const plain::Scene& scene) const {
  std::set<std::pair<int, int>> declared;
  for (const plain::Pair& pair : scene.pairs) declared.emplace(pair.a, pair.b);
  const auto pairs = std::make_shared<dart::collision::BodyNodeCollisionFilter>();
  const auto n = static_cast<int>(scene.shapes.size());
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < i; ++j)
      if (scene.shapes[i].body != scene.shapes[j].body && declared.count({i, j}) == 0)
        pairs->addBodyNodePairToBlackList(node_of_shape_[i], node_of_shape_[j]);
  world_->getConstraintSolver()->getCollisionOption().collisionFilter = pairs;
}

/// Mass and velocity, in each body's frame, that the step has come to before its first group is solved.
void World::keep_before() {
  if (!problem_.M.empty()) return;
  frame_.clear();
  for (const dd::BodyNode* node : bodies_) {
    frame_.push_back(node->getWorldTransform());
    const double mass = node->getInertia().getMass();
    const Eigen::Vector3d inertia = node->getInertia().getMoment().diagonal();
    for (int j = 0; j < 6; ++j)
      for (int i = 0; i < 6; ++i) problem_.M.push_back(i != j ? 0 : i < 3 ? mass : inertia[i - 3]);
    put(*node, frame_.back(), problem_.v_minus);
  }
}

void World::keep_contact(const Seen& seen) {
  const dart::collision::Contact& contact = *seen.contact;
  const dd::ShapeNode* shapes[2] = {contact.collisionObject1->getShapeFrame()->asShapeNode(),
                                    contact.collisionObject2->getShapeFrame()->asShapeNode()};
  Eigen::Matrix3d rows;
  const Eigen::Vector3d& n = contact.normal;
  rows.row(0) = n;
  rows.row(1) = n.unitOrthogonal();
  rows.row(2) = n.cross(Eigen::Vector3d(rows.row(1)));
  plain::Contact out{};
  double weight[3] = {0, 0, 0}, along = 0;
  for (int e = 0; e < 2; ++e) {
    const auto node = shapes[e]->getBodyNodePtr();
    const auto at = std::find(bodies_.begin(), bodies_.end(), node.get());
    out.body[e] = at == bodies_.end() ? -1 : static_cast<int>(at - bodies_.begin());
    if (out.body[e] < 0) continue;
    const auto b = static_cast<std::size_t>(out.body[e]);
    for (int r = 0; r < 3; ++r) {
      const Eigen::Vector3d d = (e == 0 ? 1 : -1) * rows.row(r).transpose(), force = frame_[b].linear().transpose() * d,
                            torque =
                                frame_[b].linear().transpose() * (contact.point - frame_[b].translation()).cross(d);
      for (int k = 0; k < 6; ++k) {
        const double entry = k < 3 ? force[k] : torque[k - 3];
        out.J[e][6 * r + k] = entry;
        weight[r] += entry * entry / problem_.M[36 * b + 7 * static_cast<std::size_t>(k)];
        if (r == 0) along += entry * problem_.v_minus[6 * b + static_cast<std::size_t>(k)];
      }
    }
  }
  const Eigen::Vector3d impulse = rows * contact.force * world_->getTimeStep();
  for (int r = 0; r < 3; ++r) {
    out.impulse[r] = impulse[r];
    out.compliance[r] = dart::constraint::ContactConstraint::getConstraintForceMixing() * weight[r];
  }
  out.offset[0] = -(seen.b + along);
  out.mu =
      std::min(shapes[0]->getDynamicsAspect()->getFrictionCoeff(), shapes[1]->getDynamicsAspect()->getFrictionCoeff());
  if (out.body[0] < 0) {
    std::swap(out.body[0], out.body[1]);
    std::swap(out.J[0], out.J[1]);
  }
  problem_.contacts.push_back(out);
}

World::World(const plain::Scene& scene, const Setting& setting) {
  node_of_shape_.resize(scene.shapes.size());
  world_->setGravity(Eigen::Vector3d::Zero());  // it comes with the forces of each step
  world_->setTimeStep(setting.step);
  auto solver = constraint_solver(setting);
  solver_ = solver.get();
  if (setting.keep_problems) solver->before = [this] { keep_before(); };
  world_->setConstraintSolver(std::move(solver));
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) add_body(scene, b, setting);
  for (std::size_t i = 0; i < scene.shapes.size(); ++i)
    if (scene.shapes[i].body < 0) add_fixed(scene, i, setting);
  filter(scene);
}

void World::load(int body, const double force[3]) { bodies_[static_cast<std::size_t>(body)]->setExtForce(vec(force)); }

void World::step(double) {
  problem_ = {};
  solver_->seen.clear();
  world_->step(true);
}

void World::read(std::vector<plain::Body>& bodies) {
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const dd::BodyNode& node = *bodies_[b];
    const Eigen::Isometry3d& at = node.getWorldTransform();
    const Eigen::Quaterniond q(at.linear());
    const Eigen::Vector3d v = node.getLinearVelocity(), w = node.getAngularVelocity(), p = at.translation();
    plain::Body& out = bodies[b];
    out.pose.q[0] = q.w();
    for (int k = 0; k < 3; ++k) {
      out.pose.p[k] = p[k];
      out.pose.q[k + 1] = q.vec()[k];
      out.v[k] = v[k];
      out.w[k] = w[k];
    }
  }
}

int World::contacts() const { return static_cast<int>(world_->getLastCollisionResult().getNumContacts()); }

const plain::Problem* World::problem() {
  plain::Problem& out = problem_;
  for (const Seen& seen : solver_->seen) keep_contact(seen);
  solver_->seen.clear();
  for (std::size_t b = 0; b < frame_.size(); ++b) put(*bodies_[b], frame_[b], out.v_plus);
  return &out;
}

std::string version() { return DART_VERSION; }

std::unique_ptr<plain::World> make_world(const plain::Scene& scene, const Setting& setting) {
  return std::make_unique<World>(scene, setting);
}

}  // namespace dart_scene
