// Siconos as an engine beside the methods: its own time stepping, after Moreau and Jean.
//
// What is followed: Siconos 4.4, users' guide ("Time integration of the dynamics", "Friction-contact problems"), the
// heads of MoreauJeanOSI.hpp, TimeStepping.hpp, FrictionContact.hpp and SiconosBulletCollisionManager.hpp, and what
// siconos.io.mechanics_run sets up.
//   * Exact Coulomb friction and Newton's restitution (NewtonImpactFrictionNSL), a law a pair of groups of shapes.
//   * Contacts come from Bullet in single precision, by Siconos' own manager: gaps are known to about 1e-7 m.
//   * A contact takes part in a step where its gap, predicted to the middle of the step, is closed.
//   * Forces are theta times those of this step and 1 - theta times those of the step before, theta = 0.5.
//
// Its own contact problem: M (with theta h times the gyroscopic forces' derivative, zero without spin), J and the
// velocity without contact are what the integrator keeps; nothing stabilises the gap, so that the offset is zero.

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
#include <cmath>
#include <map>
#include <memory>

#include "frame/engine.h"
#include "frame/own_problem.h"

namespace cb {

namespace {

constexpr double end_of_time = 1e9;  // s: Siconos asks for one

std::shared_ptr<SiconosVector> vector(std::initializer_list<double> x) {
  auto out = std::make_shared<SiconosVector>(static_cast<unsigned>(x.size()));
  unsigned i = 0;
  for (const double value : x) (*out)(i++) = value;
  return out;
}
std::shared_ptr<SiconosVector> vector(const Pose& pose) {
  const Quat& q = pose.q;
  return vector({pose.p.x(), pose.p.y(), pose.p.z(), q.w(), q.x(), q.y(), q.z()});
}

class SiconosScene {
 public:
  SiconosScene(const Scenario& scenario, const EngineSetting& setting);

  void load(const Loads& loads) {
    for (std::size_t b = 0; b < bodies_.size(); ++b)
      for (unsigned k = 0; k < 3; ++k) (*forces_[b])(k) = masses_[b] * loads.gravity[k] + loads.force[b][k];
  }
  void step(double) {
    if (stepped_) simulation_->nextStep();
    simulation_->computeOneStep();
    stepped_ = true;
  }
  void read(State& state) const {
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      const SiconosVector &q = *bodies_[b]->q(), &v = *bodies_[b]->twist();
      Pose& pose = state.pose[b];
      pose = {Vec3(q(0), q(1), q(2)), Quat(q(3), q(4), q(5), q(6))};
      const Vec3 spin = pose.q * Vec3(v(3), v(4), v(5));  // in the body's frame
      for (unsigned k = 0; k < 3; ++k) {
        state.v[6 * b + k] = v(k);
        state.v[6 * b + 3 + k] = spin[k];
      }
    }
  }
  int contacts() const { return static_cast<int>(simulation_->indexSet(1)->size()); }
  bool problem(OwnProblem& out) const;

 private:
  std::shared_ptr<SiconosShape> make_shape(const Shape& shape) const;
  void add_laws(const Scenario& scenario, SiconosBulletCollisionManager& manager) const;

  std::vector<std::shared_ptr<RigidBodyDS>> bodies_;
  std::vector<std::shared_ptr<SiconosVector>> forces_;
  std::vector<double> masses_;
  std::shared_ptr<NonSmoothDynamicalSystem> system_;
  std::shared_ptr<TimeStepping> simulation_;
  bool stepped_ = false;
};

std::shared_ptr<SiconosShape> SiconosScene::make_shape(const Shape& shape) const {
  std::shared_ptr<SiconosShape> made;
  const Vec3 size = 2 * shape.half_extents;
  switch (shape.kind) {
    case ShapeKind::sphere:
      made = std::make_shared<SiconosSphere>(shape.radius);
      break;
    case ShapeKind::box:
      made = std::make_shared<SiconosBox>(size.x(), size.y(), size.z());
      break;
    case ShapeKind::cylinder:
      if (size.y() == 0) throw Unsupported("a disc (" + shape.name + "): Siconos' cylinders have a length");
      made = std::make_shared<SiconosCylinder>(shape.radius, size.y());
      break;
    case ShapeKind::half_space:
      made = std::make_shared<SiconosPlane>();
      break;
  }
  made->setInsideMargin(0);
  made->setOutsideMargin(0);
  return made;
}

void SiconosScene::add_laws(const Scenario& scenario, SiconosBulletCollisionManager& manager) const {
  const PairLaws& pairs = scenario.pairs;
  for (int i = 0; i < pairs.groups; ++i)
    for (int j = 0; j <= i; ++j) {
      const int law = pairs.index[static_cast<std::size_t>(i * pairs.groups + j)];
      if (law < 0) continue;
      const PairLaw& of = pairs.laws[static_cast<std::size_t>(law)];
      const auto made = std::make_shared<NewtonImpactFrictionNSL>(of.restitution, 0., of.mu, 3);
      manager.insertNonSmoothLaw(made, static_cast<unsigned long>(i), static_cast<unsigned long>(j));
    }
}

SiconosScene::SiconosScene(const Scenario& scenario, const EngineSetting& setting) {
  refuse_robots(scenario, "Siconos");
  const auto knob = [&](const char* name) { return setting.knobs.at(name); };
  system_ = std::make_shared<NonSmoothDynamicalSystem>(0, end_of_time);
  for (std::size_t b = 0; b < scenario.model.bodies.size(); ++b) {
    const Body& body = scenario.model.bodies[b];
    const Pose& pose = scenario.initial.pose[b];
    const double* v = &scenario.initial.v[6 * b];
    const Vec3 spin = pose.q.conjugate() * Vec3(v[3], v[4], v[5]);
    const auto inertia = std::make_shared<SimpleMatrix>(3, 3);
    inertia->zero();
    for (unsigned k = 0; k < 3; ++k) (*inertia)(k, k) = body.inertia[k];
    const auto made = std::make_shared<RigidBodyDS>(
        vector(pose), vector({v[0], v[1], v[2], spin.x(), spin.y(), spin.z()}), body.mass, inertia);
    made->setUseContactorInertia(false);
    const auto contactors = std::make_shared<SiconosContactorSet>();
    for (std::size_t i = 0; i < scenario.shapes.size(); ++i)
      if (scenario.shapes[i].body == static_cast<int>(b))
        contactors->append(std::make_shared<SiconosContactor>(
            make_shape(scenario.shapes[i]), vector(scenario.shapes[i].local), scenario.pairs.group[i]));
    made->setContactors(contactors);
    // Also of the step before the first: forces are a mean of two steps.
    const Vec3 weight = body.mass * scenario.gravity.at(0);
    forces_.push_back(vector({weight.x(), weight.y(), weight.z()}));
    made->setFExtPtr(forces_.back());
    masses_.push_back(body.mass);
    system_->insertDynamicalSystem(made);
    bodies_.push_back(made);
  }
  const auto problem = std::make_shared<FrictionContact>(3, SICONOS_FRICTION_3D_NSGS);
  problem->numericsSolverOptions()->iparam[SICONOS_IPARAM_MAX_ITER] = static_cast<int>(knob("iterations"));
  problem->numericsSolverOptions()->dparam[SICONOS_DPARAM_TOL] = knob("tolerance");
  problem->setMStorageType(NM_SPARSE_BLOCK);
  const auto clock = std::make_shared<TimeDiscretisation>(0, setting.step);
  simulation_ = std::make_shared<TimeStepping>(system_, clock);
  simulation_->insertIntegrator(std::make_shared<MoreauJeanOSI>(knob("theta")));
  simulation_->insertNonSmoothProblem(problem);
  simulation_->setNewtonMaxIteration(static_cast<unsigned>(knob("newton_iterations")));
  simulation_->setNewtonTolerance(knob("newton_tolerance"));
  simulation_->setCheckSolverFunction([](int, Simulation*) {});  // without its message on standard output
  const auto manager = std::make_shared<SiconosBulletCollisionManager>(SiconosBulletOptions());
  add_laws(scenario, *manager);
  for (std::size_t i = 0; i < scenario.shapes.size(); ++i) {
    const Shape& shape = scenario.shapes[i];
    if (shape.body >= 0) continue;
    const auto contactors = std::make_shared<SiconosContactorSet>();
    contactors->append(std::make_shared<SiconosContactor>(make_shape(shape), vector(Pose()), scenario.pairs.group[i]));
    Pose pose = shape.local;
    // A plane's normal is z in Siconos, y here.
    if (shape.kind == ShapeKind::half_space) pose.q = pose.q * Quat::FromTwoVectors(Vec3::UnitZ(), Vec3::UnitY());
    manager->insertStaticContactorSet(contactors, vector(pose));
  }
  simulation_->insertInteractionManager(manager);
}

bool SiconosScene::problem(OwnProblem& out) const {
  out = {};
  std::map<const DynamicalSystem*, int> block;
  const DynamicalSystemsGraph& systems = *system_->topology()->dSG(0);
  for (const auto& body : bodies_) {
    const int b = out.problem.M.add_block(6);
    block[body.get()] = b;
    const auto& kept = systems.properties(systems.descriptor(body));
    const SiconosVector& free = *(*kept.workVectors)[MoreauJeanOSI::VFREE];
    for (unsigned i = 0; i < 6; ++i) {
      for (unsigned j = 0; j < 6; ++j)
        out.problem.M.block(b)(static_cast<int>(i), static_cast<int>(j)) = (*kept.W)(i, j);
      out.problem.v_minus.push_back(free(i));
      out.v_plus.push_back((*body->twist())(i));
    }
  }
  const auto active = simulation_->indexSet(1);
  InteractionsGraph::VIterator at, end;
  for (std::tie(at, end) = active->vertices(); at != end; ++at) {
    const auto interaction = active->bundle(*at);
    const auto& between = active->properties(*at);
    const auto relation = std::static_pointer_cast<NewtonEulerR>(interaction->relation());
    const SimpleMatrix& J = *relation->jachqT();
    std::vector<std::pair<int, unsigned>> entries = {{block.at(between.source.get()), 0}};
    if (between.target != between.source) entries.emplace_back(block.at(between.target.get()), 6);
    std::sort(entries.begin(), entries.end());
    out.problem.J.add_band();
    for (const auto& [body, column] : entries) {
      const int entry = out.problem.J.add_entry(body, 6);
      for (unsigned r = 0; r < 3; ++r)
        for (unsigned k = 0; k < 6; ++k)
          out.problem.J.entry(entry)(static_cast<int>(r), static_cast<int>(k)) = J(r, column + k);
    }
    const SiconosVector& impulse = *interaction->lambda(1);
    const auto law = std::static_pointer_cast<NewtonImpactFrictionNSL>(interaction->nonSmoothLaw());
    for (unsigned r = 0; r < 3; ++r) {
      out.impulse.push_back(impulse(r));
      out.problem.offset.push_back(0);
    }
    out.problem.mu.push_back(law->mu());
    out.problem.restitution.push_back(0);
  }
  out.law = "exact Coulomb friction, Newton's restitution";
  return out.problem.nc() > 0;
}

EngineWorld make(const Scenario& scenario, const EngineSetting& setting) {
  const auto scene = std::make_shared<SiconosScene>(scenario, setting);
  EngineWorld world;
  world.load = [scene](const Loads& loads) { scene->load(loads); };
  world.step = [scene](double h) { scene->step(h); };
  world.read = [scene](State& state) { scene->read(state); };
  world.contacts = [scene] { return scene->contacts(); };
  world.problem = [scene](OwnProblem& out) { return scene->problem(out); };
  return world;
}

Engine siconos() {
  Engine engine;
  engine.name = "siconos";
  engine.summary = "Siconos: Moreau and Jean's time stepping, exact Coulomb friction by Gauss and Seidel";
  engine.version = SICONOS_PACKAGE;  // it does not say itself: what CMake found installed
  engine.precision = "double";
  engine.package = "libsiconos-mechanics-dev";
  engine.documentation = {
      "Siconos 4.4 users' guide: Time integration of the dynamics; Friction-contact problems",
      "MoreauJeanOSI.hpp, TimeStepping.hpp, FrictionContact.hpp, SiconosBulletCollisionManager.hpp"};
  engine.shared = {"friction and restitution: of the pair (NewtonImpactFrictionNSL)",
                   "gravity, forces at the centre of mass, masses, principal inertias: as the scene's",
                   "sleep, damping: none"};
  engine.apart = {"contact points: Bullet's in single precision", "depth is left in: nothing takes it away",
                  "forces: a mean of this step's and the one before (theta)"};
  engine.variants = {{"nsgs", "nonsmooth Gauss and Seidel, the library's tolerance", 1, {}},
                     {"nsgs-tight", "the same to 1e-10", 1, {{"tolerance", 1e-10}, {"iterations", 100000}}}};
  engine.knobs = {{"theta", 0.5, "", "of the theta method: 1 takes forces and velocity at the end of the step"},
                  {"tolerance", 1e-4, "", "of the solver, of the size of q"},
                  {"iterations", 1000, "", "of the solver at most"},
                  {"newton_iterations", 20, "", "of a step's Newton loop at most"},
                  {"newton_tolerance", 1e-10, "", "of a step's Newton loop"}};
  engine.make = make;
  return engine;
}

}  // namespace

}  // namespace cb

int main(int argc, char** argv) { return cb::engine_main(cb::siconos(), argc, argv); }
