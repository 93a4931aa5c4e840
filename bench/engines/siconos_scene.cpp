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
#include <map>

namespace siconos_scene {

namespace {

constexpr double end_of_time = 1e9;  // s: Siconos asks for one

std::shared_ptr<SiconosVector> vector(const double* x, unsigned n) {
  auto out = std::make_shared<SiconosVector>(n);
  for (unsigned i = 0; i < n; ++i) (*out)(i) = x[i];
  return out;
}
std::shared_ptr<SiconosVector> vector(const Pose& pose) {
  const double x[7] = {pose.p[0], pose.p[1], pose.p[2], pose.q[0], pose.q[1], pose.q[2], pose.q[3]};
  return vector(x, 7);
}

std::shared_ptr<SiconosContactor> contactor(const Shape& shape, const Pose& at) {
  std::shared_ptr<SiconosShape> made;
  if (shape.kind == Kind::sphere) made = std::make_shared<SiconosSphere>(shape.radius);
  if (shape.kind == Kind::box) made = std::make_shared<SiconosBox>(shape.size[0], shape.size[1], shape.size[2]);
  if (shape.kind == Kind::cylinder) made = std::make_shared<SiconosCylinder>(shape.radius, shape.size[1]);
  if (shape.kind == Kind::plane) made = std::make_shared<SiconosPlane>();
  made->setInsideMargin(0);
  made->setOutsideMargin(0);
  return std::make_shared<SiconosContactor>(made, vector(at), shape.group);
}

}  // namespace

struct World::Parts {
  std::vector<std::shared_ptr<RigidBodyDS>> bodies;
  std::vector<std::shared_ptr<SiconosVector>> forces;
  std::shared_ptr<NonSmoothDynamicalSystem> system;
  std::shared_ptr<TimeStepping> simulation;
  bool stepped = false;

  void add_bodies(const Scene& scene);
  std::shared_ptr<SiconosBulletCollisionManager> make_contacts(const Scene& scene) const;
};

void World::Parts::add_bodies(const Scene& scene) {
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    const Body& body = scene.bodies[b];
    const auto inertia = std::make_shared<SimpleMatrix>(3, 3);
    inertia->zero();
    for (unsigned k = 0; k < 3; ++k) (*inertia)(k, k) = body.inertia[k];
    const auto made = std::make_shared<RigidBodyDS>(vector(body.pose), vector(body.twist, 6), body.mass, inertia);
    made->setUseContactorInertia(false);
    const auto contactors = std::make_shared<SiconosContactorSet>();
    for (const Shape& shape : scene.shapes)
      if (shape.body == static_cast<int>(b)) contactors->append(contactor(shape, shape.at));
    made->setContactors(contactors);
    const double weight[3] = {body.mass * scene.gravity[0], body.mass * scene.gravity[1], body.mass * scene.gravity[2]};
    forces.push_back(vector(weight, 3));
    made->setFExtPtr(forces.back());
    system->insertDynamicalSystem(made);
    bodies.push_back(made);
  }
}

std::shared_ptr<SiconosBulletCollisionManager> World::Parts::make_contacts(const Scene& scene) const {
  const auto manager = std::make_shared<SiconosBulletCollisionManager>(SiconosBulletOptions());
  for (const Law& law : scene.laws)
    manager->insertNonSmoothLaw(std::make_shared<NewtonImpactFrictionNSL>(law.restitution, 0., law.mu, 3),
                                static_cast<unsigned long>(law.a), static_cast<unsigned long>(law.b));
  const Pose here{{0, 0, 0}, {1, 0, 0, 0}};
  for (const Shape& shape : scene.shapes) {
    if (shape.body >= 0) continue;
    const auto contactors = std::make_shared<SiconosContactorSet>();
    contactors->append(contactor(shape, here));
    manager->insertStaticContactorSet(contactors, vector(shape.at));
  }
  return manager;
}

World::World(const Scene& scene, const Setting& setting) : parts_(std::make_unique<Parts>()) {
  Parts& of = *parts_;
  of.system = std::make_shared<NonSmoothDynamicalSystem>(0, end_of_time);
  of.add_bodies(scene);
  const auto problem = std::make_shared<FrictionContact>(3, SICONOS_FRICTION_3D_NSGS);
  problem->numericsSolverOptions()->iparam[SICONOS_IPARAM_MAX_ITER] = setting.iterations;
  problem->numericsSolverOptions()->dparam[SICONOS_DPARAM_TOL] = setting.tolerance;
  problem->setMStorageType(NM_SPARSE_BLOCK);
  of.simulation = std::make_shared<TimeStepping>(of.system, std::make_shared<TimeDiscretisation>(0, setting.step));
  of.simulation->insertIntegrator(std::make_shared<MoreauJeanOSI>(setting.theta));
  of.simulation->insertNonSmoothProblem(problem);
  of.simulation->setNewtonMaxIteration(static_cast<unsigned>(setting.newton_iterations));
  of.simulation->setNewtonTolerance(setting.newton_tolerance);
  of.simulation->setCheckSolverFunction([](int, Simulation*) {});  // without its message on standard output
  of.simulation->insertInteractionManager(of.make_contacts(scene));
}

World::World(World&&) noexcept = default;
World::~World() = default;

void World::load(int body, const double force[3]) {
  for (unsigned k = 0; k < 3; ++k) (*parts_->forces[static_cast<std::size_t>(body)])(k) = force[k];
}

void World::step() {
  if (parts_->stepped) parts_->simulation->nextStep();
  parts_->simulation->computeOneStep();
  parts_->stepped = true;
}

void World::read(std::vector<Body>& bodies) const {
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const SiconosVector &q = *parts_->bodies[b]->q(), &v = *parts_->bodies[b]->twist();
    for (unsigned k = 0; k < 3; ++k) bodies[b].pose.p[k] = q(k);
    for (unsigned k = 0; k < 4; ++k) bodies[b].pose.q[k] = q(3 + k);
    for (unsigned k = 0; k < 6; ++k) bodies[b].twist[k] = v(k);
  }
}

int World::contacts() const { return static_cast<int>(parts_->simulation->indexSet(1)->size()); }

void World::problem(Problem& out) const {
  out = {};
  std::map<const DynamicalSystem*, int> block;
  DynamicalSystemsGraph& systems = *parts_->system->topology()->dSG(0);
  for (const auto& body : parts_->bodies) {
    const int b = static_cast<int>(block.size());
    block[body.get()] = b;
    auto& kept = systems.properties(systems.descriptor(body));
    const SiconosVector& free = *(*kept.workVectors)[MoreauJeanOSI::VFREE];
    for (unsigned j = 0; j < 6; ++j) {
      for (unsigned i = 0; i < 6; ++i) out.M.push_back((*kept.W)(i, j));
      out.v_minus.push_back(free(j));
      out.v_plus.push_back((*body->twist())(j));
    }
  }
  const auto active = parts_->simulation->indexSet(1);
  InteractionsGraph::VIterator at, end;
  for (std::tie(at, end) = active->vertices(); at != end; ++at) {
    const auto interaction = active->bundle(*at);
    auto& between = active->properties(*at);
    const SimpleMatrix& J = *std::static_pointer_cast<NewtonEulerR>(interaction->relation())->jachqT();
    Contact contact{};
    const bool two = between.target != between.source;
    contact.body[0] = block.at(between.source.get());
    contact.body[1] = two ? block.at(between.target.get()) : -1;
    for (unsigned e = 0; e < (two ? 2u : 1u); ++e)
      for (unsigned r = 0; r < 3; ++r)
        for (unsigned k = 0; k < 6; ++k) contact.J[e][6 * r + k] = J(r, 6 * e + k);
    for (unsigned r = 0; r < 3; ++r) contact.impulse[r] = (*interaction->lambda(1))(r);
    contact.mu = std::static_pointer_cast<NewtonImpactFrictionNSL>(interaction->nonSmoothLaw())->mu();
    out.contacts.push_back(contact);
  }
}

}  // namespace siconos_scene
