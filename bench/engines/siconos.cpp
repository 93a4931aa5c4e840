// Siconos as an engine beside the methods: its own time stepping, after Moreau and Jean (siconos_scene.cpp speaks with
// its library).
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

#include <algorithm>
#include <memory>

#include "frame/engine.h"
#include "frame/own_problem.h"
#include "siconos_scene.h"

namespace cb {

namespace {

namespace plain = siconos_scene;

plain::Pose plain_pose(const Pose& pose) {
  return {{pose.p.x(), pose.p.y(), pose.p.z()}, {pose.q.w(), pose.q.x(), pose.q.y(), pose.q.z()}};
}

plain::Shape plain_shape(const Shape& shape, int group) {
  plain::Shape out{shape.body, plain::Kind::sphere, shape.radius, {}, {}, group};
  for (int k = 0; k < 3; ++k) out.size[k] = 2 * shape.half_extents[k];
  Pose at = shape.local;
  if (shape.kind == ShapeKind::box) out.kind = plain::Kind::box;
  if (shape.kind == ShapeKind::cylinder) out.kind = plain::Kind::cylinder;
  if (shape.kind == ShapeKind::half_space) {
    out.kind = plain::Kind::plane;  // its normal is z in Siconos, y here
    at.q = at.q * Quat::FromTwoVectors(Vec3::UnitZ(), Vec3::UnitY());
  }
  if (out.kind == plain::Kind::cylinder && out.size[1] == 0)
    throw Unsupported("a disc (" + shape.name + "): Siconos' cylinders have a length");
  out.at = plain_pose(at);
  return out;
}

plain::Scene scene_of(const Scenario& scenario) {
  plain::Scene out{};
  for (std::size_t b = 0; b < scenario.model.bodies.size(); ++b) {
    const Body& body = scenario.model.bodies[b];
    const Pose& pose = scenario.initial.pose[b];
    const double* v = &scenario.initial.v[6 * b];
    const Vec3 spin = pose.q.conjugate() * Vec3(v[3], v[4], v[5]);
    const Vec3& I = body.inertia;
    out.bodies.push_back(
        {body.mass, {I.x(), I.y(), I.z()}, plain_pose(pose), {v[0], v[1], v[2], spin.x(), spin.y(), spin.z()}});
  }
  const PairLaws& pairs = scenario.pairs;
  for (std::size_t i = 0; i < scenario.shapes.size(); ++i)
    out.shapes.push_back(plain_shape(scenario.shapes[i], pairs.group[i]));
  for (int i = 0; i < pairs.groups; ++i)
    for (int j = 0; j <= i; ++j)
      if (const int law = pairs.index[static_cast<std::size_t>(i * pairs.groups + j)]; law >= 0) {
        const PairLaw& of = pairs.laws[static_cast<std::size_t>(law)];
        out.laws.push_back({i, j, of.mu, of.restitution});
      }
  const Vec3 gravity = scenario.gravity.at(0);
  for (int k = 0; k < 3; ++k) out.gravity[k] = gravity[k];
  return out;
}

/// A world with what it has to remember.
struct Running {
  plain::World world;
  std::vector<plain::Body> bodies;
};

bool own_problem(const plain::World& world, OwnProblem& out) {
  plain::Problem of;
  world.problem(of);
  out = {};
  for (std::size_t at = 0; at < of.M.size(); at += 36)
    out.problem.M.block(out.problem.M.add_block(6)) = Eigen::Map<const Eigen::Matrix<double, 6, 6>>(&of.M[at]);
  out.problem.v_minus = of.v_minus;
  out.v_plus = of.v_plus;
  using Rows = Eigen::Matrix<double, 3, 6, Eigen::RowMajor>;
  for (const plain::Contact& contact : of.contacts) {
    out.problem.J.add_band();
    const int first = contact.body[1] >= 0 && contact.body[1] < contact.body[0] ? 1 : 0;
    for (const int e : {first, 1 - first})
      if (contact.body[e] >= 0)
        out.problem.J.entry(out.problem.J.add_entry(contact.body[e], 6)) = Eigen::Map<const Rows>(contact.J[e]);
    out.impulse.insert(out.impulse.end(), contact.impulse, contact.impulse + 3);
    out.problem.offset.insert(out.problem.offset.end(), 3, 0.0);
    out.problem.mu.push_back(contact.mu);
    out.problem.restitution.push_back(0);
  }
  out.law = "exact Coulomb friction, Newton's restitution";
  return out.problem.nc() > 0;
}

EngineWorld make(const Scenario& scenario, const EngineSetting& setting) {
  refuse_robots(scenario, "Siconos");
  const auto knob = [&](const char* name) { return setting.knobs.at(name); };
  const plain::Scene scene = scene_of(scenario);
  const plain::Setting of{setting.step,
                          knob("theta"),
                          knob("tolerance"),
                          knob("newton_tolerance"),
                          static_cast<int>(knob("iterations")),
                          static_cast<int>(knob("newton_iterations"))};
  const auto running = std::make_shared<Running>(Running{plain::World(scene, of), scene.bodies});
  EngineWorld world;
  world.load = [running](const Loads& loads) {
    for (std::size_t b = 0; b < running->bodies.size(); ++b) {
      const Vec3 force = running->bodies[b].mass * loads.gravity + loads.force[b];
      running->world.load(static_cast<int>(b), force.data());
    }
  };
  world.step = [running](double) { running->world.step(); };
  world.read = [running](State& state) {
    running->world.read(running->bodies);
    for (std::size_t b = 0; b < running->bodies.size(); ++b) {
      const plain::Body& body = running->bodies[b];
      const double *q = body.pose.q, *v = body.twist;
      state.pose[b] = {Vec3(body.pose.p), Quat(q[0], q[1], q[2], q[3])};
      const Vec3 spin = state.pose[b].q * Vec3(v + 3);
      for (int k = 0; k < 3; ++k) {
        state.v[6 * b + static_cast<std::size_t>(k)] = v[k];
        state.v[6 * b + 3 + static_cast<std::size_t>(k)] = spin[k];
      }
    }
  };
  world.contacts = [running] { return running->world.contacts(); };
  world.problem = [running](OwnProblem& out) { return own_problem(running->world, out); };
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
