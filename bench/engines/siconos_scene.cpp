#include "siconos_scene.h"

// Bullet's and the mechanics' classes must be known before the kernel's.
// clang-format off
#include <BulletSiconosFwd.hpp>
#include <MechanicsFwd.hpp>
#include <SiconosKernel.hpp>
// clang-format on
#include <Friction_cst.h>
#include <SolverOptions.h>

#include <RigidBodyDS.hpp>
#include <SiconosBulletCollisionManager.hpp>
#include <SiconosContactor.hpp>
#include <SiconosShape.hpp>
#include <algorithm>
#include <cmath>
#include <map>

namespace siconos_scene {

namespace {

constexpr double end_of_time = 1e9;  // s: Siconos asks for one

std::shared_ptr<SiconosVector> vector(const double* x, unsigned n) {
  auto out = std::make_shared<SiconosVector>(n);
  for (unsigned i = 0; i < n; ++i) (*out)(i) = x[i];
  return out;
}
std::shared_ptr<SiconosVector> vector(const plain::Pose& pose) {
  const double x[7] = {pose.p[0], pose.p[1], pose.p[2], pose.q[0], pose.q[1], pose.q[2], pose.q[3]};
  return vector(x, 7);
}

using Quaternion = double[4];
void multiply(const Quaternion& a, const Quaternion& b, Quaternion& out) {
  out[0] = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3];
  out[1] = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2];
  out[2] = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1];
  out[3] = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0];
}
/// x turned by q, or back.
void turn(const Quaternion& q, bool back, const double x[3], double out[3]) {
  const double s = back ? -1 : 1;
  const Quaternion to = {q[0], s * q[1], s * q[2], s * q[3]}, from = {q[0], -to[1], -to[2], -to[3]};
  const Quaternion at = {0, x[0], x[1], x[2]};
  Quaternion half, whole;
  multiply(to, at, half);
  multiply(half, from, whole);
  for (int k = 0; k < 3; ++k) out[k] = whole[k + 1];
}

/// Bullet finds contacts between shapes that are smaller by the margin, which is what it knows precisely.
std::shared_ptr<SiconosContactor> contactor(const plain::Shape& shape, const plain::Pose& pose, int group,
                                            double margin) {
  // m, of a half-space's box. Siconos' own plane is one of 2000 m, whose places single precision knows to 1e-4 m.
  constexpr double extent = 100;
  std::shared_ptr<SiconosShape> made;
  plain::Pose at = pose;
  const double* half = shape.half;
  const double down[3] = {0, -extent / 2, 0};
  double way[3], least = std::min({half[0], half[1], half[2]});
  switch (shape.kind) {
    case plain::Kind::sphere:
      made = std::make_shared<SiconosSphere>(shape.radius);
      least = shape.radius;
      break;
    case plain::Kind::box:
      made = std::make_shared<SiconosBox>(2 * half[0], 2 * half[1], 2 * half[2]);
      break;
    case plain::Kind::cylinder:
      made = std::make_shared<SiconosCylinder>(shape.radius, 2 * half[1]);
      least = std::min(shape.radius, half[1]);
      break;
    case plain::Kind::half_space:
      made = std::make_shared<SiconosBox>(extent, extent, extent);
      least = extent / 2;
      turn(pose.q, false, down, way);
      for (int k = 0; k < 3; ++k) at.p[k] += way[k];
  }
  made->setInsideMargin(margin * least);
  return std::make_shared<SiconosContactor>(made, vector(at), group);
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
  std::vector<std::shared_ptr<RigidBodyDS>> bodies_;
  std::vector<std::shared_ptr<SiconosVector>> forces_;
  std::shared_ptr<NonSmoothDynamicalSystem> system_;
  std::shared_ptr<TimeStepping> simulation_;
  bool stepped_ = false, keep_problems_ = false;
  double margin_ = 0;
  plain::Problem problem_;

  void add_bodies(const plain::Scene& scene, const double gravity[3]);
  std::shared_ptr<SiconosBulletCollisionManager> make_contacts(const plain::Scene& scene) const;
  void keep();
  void keep_contacts(const std::map<const DynamicalSystem*, int>& block);

  static World* stepping;  // Siconos' function to be called after a solve remembers nothing
};
World* World::stepping = nullptr;

void World::add_bodies(const plain::Scene& scene, const double gravity[3]) {
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    const plain::Body& body = scene.bodies[b];
    const auto inertia = std::make_shared<SimpleMatrix>(3, 3);
    inertia->zero();
    for (unsigned k = 0; k < 3; ++k) (*inertia)(k, k) = body.inertia[k];
    double twist[6] = {body.v[0], body.v[1], body.v[2]};
    turn(body.pose.q, true, body.w, twist + 3);
    const auto made = std::make_shared<RigidBodyDS>(vector(body.pose), vector(twist, 6), body.mass, inertia);
    made->setUseContactorInertia(false);
    const auto contactors = std::make_shared<SiconosContactorSet>();
    for (std::size_t i = 0; i < scene.shapes.size(); ++i)
      if (scene.shapes[i].body == static_cast<int>(b))
        contactors->append(contactor(scene.shapes[i], scene.shapes[i].at, static_cast<int>(i), margin_));
    made->setContactors(contactors);
    const double weight[3] = {body.mass * gravity[0], body.mass * gravity[1], body.mass * gravity[2]};
    forces_.push_back(vector(weight, 3));
    made->setFExtPtr(forces_.back());
    system_->insertDynamicalSystem(made);
    bodies_.push_back(made);
  }
}

/// Each shape is a group of its own: laws are between groups.
std::shared_ptr<SiconosBulletCollisionManager> World::make_contacts(const plain::Scene& scene) const {
  const auto manager = std::make_shared<SiconosBulletCollisionManager>(SiconosBulletOptions());
  for (const plain::Pair& pair : scene.pairs)
    manager->insertNonSmoothLaw(std::make_shared<NewtonImpactFrictionNSL>(pair.restitution, 0., pair.mu, 3),
                                static_cast<unsigned long>(pair.b), static_cast<unsigned long>(pair.a));
  const plain::Pose here{{0, 0, 0}, {1, 0, 0, 0}};
  for (std::size_t i = 0; i < scene.shapes.size(); ++i) {
    const plain::Shape& shape = scene.shapes[i];
    if (shape.body >= 0) continue;
    const auto contactors = std::make_shared<SiconosContactorSet>();
    contactors->append(contactor(shape, here, static_cast<int>(i), margin_));
    manager->insertStaticContactorSet(contactors, vector(shape.at));
  }
  return manager;
}

/// Contact frames are those of the bodies' places before the Newton iteration: kept before it moves them.
void World::keep() {
  problem_ = {};
  std::map<const DynamicalSystem*, int> block;
  for (const auto& body : bodies_) block.emplace(body.get(), static_cast<int>(block.size()));
  keep_contacts(block);
}

void World::keep_contacts(const std::map<const DynamicalSystem*, int>& block) {
  const auto active = simulation_->indexSet(1);
  InteractionsGraph::VIterator at, end;
  for (std::tie(at, end) = active->vertices(); at != end; ++at) {
    const auto interaction = active->bundle(*at);
    auto& between = active->properties(*at);
    const SimpleMatrix& J = *std::static_pointer_cast<NewtonEulerR>(interaction->relation())->jachqT();
    plain::Contact contact{};
    const bool two = between.target != between.source;
    contact.body[0] = block.at(between.source.get());
    contact.body[1] = two ? block.at(between.target.get()) : -1;
    const unsigned column[2] = {between.source_pos, between.target_pos};
    for (unsigned e = 0; e < (two ? 2u : 1u); ++e)
      for (unsigned r = 0; r < 3; ++r)
        for (unsigned k = 0; k < 6; ++k) contact.J[e][6 * r + k] = J(r, column[e] + k);
    for (unsigned r = 0; r < 3; ++r) contact.impulse[r] = (*interaction->lambda(1))(r);
    contact.mu = std::static_pointer_cast<NewtonImpactFrictionNSL>(interaction->nonSmoothLaw())->mu();
    problem_.contacts.push_back(contact);
  }
}

World::World(const plain::Scene& scene, const Setting& setting) {
  keep_problems_ = setting.keep_problems;
  margin_ = setting.margin;
  system_ = std::make_shared<NonSmoothDynamicalSystem>(0, end_of_time);
  add_bodies(scene, setting.gravity);
  const auto problem = std::make_shared<FrictionContact>(3, SICONOS_FRICTION_3D_NSGS);
  problem->numericsSolverOptions()->iparam[SICONOS_IPARAM_MAX_ITER] = setting.iterations;
  problem->numericsSolverOptions()->dparam[SICONOS_DPARAM_TOL] = setting.tolerance;
  problem->setMStorageType(NM_SPARSE_BLOCK);
  simulation_ = std::make_shared<TimeStepping>(system_, std::make_shared<TimeDiscretisation>(0, setting.step));
  simulation_->insertIntegrator(std::make_shared<MoreauJeanOSI>(setting.theta));
  simulation_->insertNonSmoothProblem(problem);
  simulation_->setNewtonMaxIteration(static_cast<unsigned>(setting.newton_iterations));
  simulation_->setNewtonTolerance(setting.newton_tolerance);
  // In the place of its message on standard output.
  simulation_->setCheckSolverFunction([](int, Simulation*) {
    if (stepping->keep_problems_) stepping->keep();
  });
  simulation_->insertInteractionManager(make_contacts(scene));
}

void World::load(int body, const double force[3]) {
  for (unsigned k = 0; k < 3; ++k) (*forces_[static_cast<std::size_t>(body)])(k) = force[k];
}

void World::step(double) {
  stepping = this;
  if (stepped_) simulation_->nextStep();
  simulation_->computeOneStep();
  stepped_ = true;
}

void World::read(std::vector<plain::Body>& bodies) {
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const SiconosVector &q = *bodies_[b]->q(), &v = *bodies_[b]->twist();
    plain::Body& out = bodies[b];
    for (unsigned k = 0; k < 3; ++k) out.pose.p[k] = q(k);
    for (unsigned k = 0; k < 4; ++k) out.pose.q[k] = q(3 + k);
    for (unsigned k = 0; k < 3; ++k) out.v[k] = v(k);
    const double spin[3] = {v(3), v(4), v(5)};
    turn(out.pose.q, false, spin, out.w);
  }
}

int World::contacts() const { return static_cast<int>(simulation_->indexSet(1)->size()); }

/// The integrator's residual is M (v+ - v_old) - h f with its mean f of the forces, those of spin at v+ too: M (v+ -
/// v-).
const plain::Problem* World::problem() {
  plain::Problem& out = problem_;
  for (std::vector<double>* of : {&out.M, &out.v_minus, &out.v_plus}) of->clear();
  DynamicalSystemsGraph& systems = *system_->topology()->dSG(0);
  for (const auto& body : bodies_) {
    const auto& kept = systems.properties(systems.descriptor(body));
    const SiconosVector& residual = *(*kept.workVectors)[MoreauJeanOSI::RESIDU_FREE];
    for (unsigned j = 0; j < 6; ++j) {
      for (unsigned i = 0; i < 6; ++i) out.M.push_back((*body->mass())(i, j));
      const double v = (*body->twist())(j);
      out.v_plus.push_back(v);
      out.v_minus.push_back(v - residual(j) / (*body->mass())(j, j));
    }
  }
  return &out;
}

std::unique_ptr<plain::World> make_world(const plain::Scene& scene, const Setting& setting) {
  return std::make_unique<World>(scene, setting);
}

}  // namespace siconos_scene
