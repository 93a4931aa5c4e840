// At which time of a step what is taken: forces at its start, energies at its end, contacts where they are.
#include <catch2/catch.hpp>
#include <cmath>

#include "methods/registry.h"
#include "scenes.h"
#include "simulation/simulation.h"

using namespace cb;

namespace {

constexpr double h = 1e-2;

SimulationOptions of(const Scenario& s) {
  SimulationOptions options;
  options.step = s.step;
  options.duration = s.duration;
  return options;
}

Simulation simulation_of(const Scenario& s) {
  MethodOptions options;
  return {s, of(s), find_method("ap")->make(options), anitescu_potra_law()};
}

/// A sphere in flight under g(t) = -9.8 + 4 cos(7 t + 0.3) along y.
Scenario in_varying_gravity(int steps) {
  Scenario s = test::empty_scene(h, steps * h);
  s.gravity.harmonic[1] = {4, 7, 0.3};
  test::add_sphere(s, 0.1, 2, {0, 10, 0}, {1, 0, 0});
  test::collide_all(s, 0.5);
  return s;
}

}  // namespace

TEST_CASE("gravity that varies acts as it is at the start of each step") {
  constexpr int steps = 3;
  const Scenario s = in_varying_gravity(steps);
  Simulation simulation = simulation_of(s);
  double v = 0, y = 10;
  for (int n = 0; n < steps; ++n) {
    simulation.step();
    v += h * s.gravity.at(n * h).y();
    y += h * v;
    CHECK(simulation.state().v[1] == Approx(v).epsilon(1e-13));
    CHECK(simulation.state().pose[0].p[1] == Approx(y).epsilon(1e-13));
  }
  // The values at the start, in the middle and at the end of a step differ by far more than that.
  CHECK(std::abs(s.gravity.at(0).y() - s.gravity.at(h).y()) > 1e-2);
}

TEST_CASE("the energies of a step's record are those of its end") {
  const Scenario s = in_varying_gravity(5);
  Simulation simulation = simulation_of(s);
  for (int n = 1; n <= 5; ++n) {
    const StepRecord& record = simulation.step();
    const Vec3 v(simulation.state().v.data());
    CHECK(record.t == Approx(n * h).epsilon(1e-15));
    CHECK(record.kinetic_energy == Approx(0.5 * 2 * v.squaredNorm()).epsilon(1e-14));
    CHECK(record.potential_energy == Approx(-2 * s.gravity.at(n * h).dot(simulation.state().pose[0].p)).epsilon(1e-14));
  }
}

TEST_CASE("a sphere that starts inside the ground by a millimetre is said to penetrate by a millimetre") {
  for (const double depth : {1e-3, 2.5e-3}) {
    Scenario s = test::empty_scene(h, h);
    test::add_ground(s);
    test::add_sphere(s, 0.1, 1, {0, 0.1 - depth, 0});
    test::collide_all(s, 0.5);
    CHECK(simulation_of(s).step().penetration_inside == Approx(depth).epsilon(1e-12));
  }
}

TEST_CASE(
    "an event whose checked residual is a hundred times the accepted one is inaccurate, at a hundredth it is not") {
  // Newton's method in all but a part of the normal impulse: the sphere goes on into the ground at that part of 1 m/s.
  for (const auto& [part, status] : {std::pair(1e-7, Status::inaccurate), std::pair(1e-11, Status::ok)}) {
    Scenario s = test::empty_scene(h, h);
    s.gravity.constant.setZero();
    test::add_ground(s);
    test::add_sphere(s, 0.1, 1, {0, 0.1, 0}, {0, -1, 0});
    test::collide_all(s, 0);
    const auto falls_short = [&, short_of = part](const ContactProblem& problem, ContactSolution& solution) {
      solution.clear();
      solution.impulse.assign(3 * static_cast<std::size_t>(problem.nc()), 0.0);
      solution.impulse[0] = 1 - short_of;
    };
    Simulation simulation(s, of(s), falls_short, newton_law());
    CHECK(simulation.step().status == status);
  }
}

TEST_CASE("a sphere that creeps a thousand margins towards another meets it, though pairs are sought rarely") {
  // Pairs found in one step serve later ones only while nothing has moved by a fraction of the margin, 1e-6 of the
  // smallest shape. At 1e-8 m a step the pair is out of the margin for long; a search that came too late would let the
  // spheres pass into each other.
  Scenario s = test::empty_scene(1e-3, 0.2);
  s.gravity.constant.setZero();
  test::add_sphere(s, 0.5, 1, {0, 0, 0});
  test::add_sphere(s, 0.5, 1, {1 + 1.5e-6, 0, 0}, {-2e-5, 0, 0});
  test::collide_all(s, 0);
  SimulationOptions options = of(s);
  options.prune.pair_searches = options.prune.contact_times = true;
  MethodOptions flags;
  Simulation simulation(s, options, find_method("ap")->make(flags), anitescu_potra_law());
  while (simulation.step_index() < simulation.steps_total()) CHECK(simulation.step().max_penetration == 0);
  CHECK(simulation.left_out().pair_searches > 10);
  CHECK(simulation.state().v[0] == Approx(-1e-5).epsilon(1e-12));  // e = 0, equal masses: both at half the speed
  CHECK(simulation.state().v[6] == Approx(-1e-5).epsilon(1e-12));
}

TEST_CASE("shapes that overlap by more than a tenth of the smaller one end the run, and by less they do not") {
  for (const double part : {0.09, 0.11}) {
    Scenario s = test::empty_scene(h, h);
    test::add_ground(s);
    test::add_sphere(s, 0.1, 1, {0, 0.1 - part * 0.2, 0});
    test::collide_all(s, 0.5);
    CHECK((simulation_of(s).step().status == Status::penetration) == (part > 0.1));
  }
}

TEST_CASE("an approach of 1e-12 of a contact's velocity is an event, and one of 1e-14 is none") {
  for (const double part : {1e-12, 1e-14}) {
    Scenario s = test::empty_scene(h, h);
    s.gravity.constant.setZero();
    test::add_ground(s);
    test::add_sphere(s, 0.1, 1, {0, 0.1, 0}, {1, -part, 0});
    test::collide_all(s, 0);
    Simulation simulation = simulation_of(s);
    CHECK(simulation.step().events == (part > 1e-13 ? 1 : 0));
  }
}

TEST_CASE("kinetic energy beyond a million times what was put in ends the run, and below it does not") {
  for (const double speed : {500.0, 2000.0}) {
    Scenario s = test::empty_scene(h, h);
    s.gravity.constant.setZero();
    test::add_ground(s);
    test::add_sphere(s, 0.1, 1, {0, 0.1, 0}, {0, -1, 0});
    test::collide_all(s, 0);
    const auto kicks = [&](const ContactProblem& problem, ContactSolution& solution) {
      solution.clear();
      solution.impulse.assign(3 * static_cast<std::size_t>(problem.nc()), 0.0);
      solution.impulse[0] = 1 + speed;
    };
    Simulation simulation(s, of(s), kicks, newton_law());
    CHECK((simulation.step().status == Status::energy_blowup) == (speed * speed > 1e6));
    if (speed > 1e3) CHECK(simulation.reason() == "kinetic energy 2e+06 J, of which 0.5 J were put in");
  }
}

TEST_CASE("kinetic energy far beyond that of any scene ends the run, whoever put it in") {
  // 2 kg: v^2 J, which it has from the start.
  for (const double speed : {1e29, 1e31}) {
    Scenario s = test::empty_scene(h, h);
    s.gravity.constant.setZero();
    test::add_sphere(s, 0.1, 2, {0, 0, 0}, {0, 0, speed});
    test::collide_all(s, 0);
    Simulation simulation = simulation_of(s);
    const Status status = simulation.step().status;
    CHECK(status == (speed > 1e30 ? Status::energy_blowup : Status::ok));
    if (speed > 1e30)
      CHECK(simulation.reason() == "kinetic energy 1e+62 J: a spring's or motor's explicit step is unstable");
  }
}
