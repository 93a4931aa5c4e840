// What the record of a step says where the step has several events, and which law each contact of an event has.

#include <algorithm>
#include <catch2/catch.hpp>
#include <chrono>
#include <cmath>
#include <set>

#include "scenes.h"
#include "simulation/simulation.h"

using namespace cb;

namespace {

/// Pairs of the ground (shape 0) with each other shape, a law each; these do not meet each other.
void meet_ground(Scenario& s, const std::vector<PairLaw>& laws) {
  const int n = static_cast<int>(s.shapes.size());
  s.pairs.groups = n;
  s.pairs.group.clear();
  s.pairs.index.assign(n * n, -1);
  s.pairs.laws = laws;
  for (int i = 0; i < n; ++i) s.pairs.group.push_back(i);
  for (int i = 1; i < n; ++i) s.pairs.index[i] = s.pairs.index[i * n] = i - 1;
}

SimulationOptions options_of(const Scenario& s) {
  SimulationOptions options;
  options.step = s.step;
  options.duration = s.duration;
  return options;
}

/// Balls of 2 and 3 kg that are 0.02 and 0.05 m above the ground and come down with 1 m/s each: two events in 0.1 s.
Scenario two_landings() {
  Scenario s = test::empty_scene(0.1, 0.1);
  s.gravity.constant = Vec3(0, -10, 0);
  test::add_ground(s);
  test::add_sphere(s, 0.1, 2, {0, 0.12, 0});
  test::add_sphere(s, 0.1, 3, {5, 0.15, 0});
  meet_ground(s, {{0, 0}, {0, 0}});
  return s;
}

struct Told {
  Status status;
  double normal_speed;  ///< m/s after the event
  int size, iterations;
  double claimed;
};

}  // namespace

TEST_CASE("of the events of a step counts and energies add up, and the worst of each residual stays") {
  const Scenario s = two_landings();
  const double mass[] = {2, 3};
  // One answer throws its ball up with 2 m/s, 3/2 of its mass in J more than before; the other's stops.
  for (const int wrong : {0, 1}) {
    const Told told[] = {
        {wrong == 0 ? Status::ok : Status::inaccurate, wrong == 0 ? 2.0 : 0.0, 10, 3, 5},
        {wrong == 1 ? Status::ok : Status::inaccurate, wrong == 1 ? 2.0 : 0.0, 20, 4, wrong ? 6.0 : 4.0}};
    int events = 0;
    const ContactMethod method = [&](const ContactProblem& problem, ContactSolution& solution) {
      REQUIRE(problem.nc() == 1);
      REQUIRE(events < 2);
      const Told& says = told[events];
      solution.status = says.status;
      solution.reason = "told";
      solution.size = says.size;
      solution.iterations = says.iterations;
      solution.claimed_residual = says.claimed;
      solution.impulse = {mass[events] * (says.normal_speed + 1), 0, 0};
      ++events;
    };
    Simulation simulation(s, options_of(s), method, newton_law());
    std::vector<Residuals> seen;
    std::vector<double> times;
    simulation.on_event = [&](const EventRecord& event) {
      seen.push_back(event.residuals);
      times.push_back(event.t);
    };
    const StepRecord& record = simulation.step();
    REQUIRE(seen.size() == 2);
    CHECK(times[0] == Approx(0.02).margin(1e-8));
    CHECK(times[1] == Approx(0.05).margin(1e-8));
    CHECK(record.events == 2);
    CHECK(record.solves == 2);
    CHECK(record.contacts == 2);
    CHECK(record.size == 30);
    CHECK(record.iterations == 7);
    CHECK(record.claimed_residual == (wrong ? 6 : 5));
    CHECK(record.event_energy_gain == Approx(wrong == 0 ? 3 - 1.5 : 4.5 - 1));
    CHECK(record.event_energy_gain_relative == Approx(3));  // of what the ball had
    CHECK(seen[wrong].model > 1e-3);
    CHECK(seen[1 - wrong].model < 1e-9);
    CHECK(record.residual == seen[wrong].model);
    CHECK(record.law_residual == seen[wrong].law);
    CHECK(record.status == Status::inaccurate);
    CHECK(record.false_claims == 1);  // the wrong one is called ok
    CHECK(record.doubted == 1);       // and the right one is not
    CHECK_FALSE(record.gap.has_value());
    CHECK(record.t == 0.1);
    CHECK(record.step == 1);
  }
}

TEST_CASE("a claim is false where what is called ok does not hold, and nowhere else") {
  const Scenario s = two_landings();
  const double mass[] = {2, 3};
  for (const bool right : {true, false})
    for (const Status status : {Status::ok, Status::inaccurate}) {
      int events = 0;
      const ContactMethod method = [&](const ContactProblem&, ContactSolution& solution) {
        solution.status = status;
        solution.impulse = {mass[events++] * (right ? 1.0 : 1.5), 0, 0};
      };
      Simulation simulation(s, options_of(s), method, newton_law());
      const StepRecord& record = simulation.step();
      CHECK(events == 2);
      CHECK(record.false_claims == (!right && status == Status::ok ? 2 : 0));
      CHECK(record.doubted == (right && status != Status::ok ? 2 : 0));
      CHECK(record.status == (right ? Status::ok : Status::inaccurate));
    }
}

TEST_CASE("of duality gaps in a step the largest stays with its sign, wherever it was") {
  const Scenario s = two_landings();
  for (const int wrong : {0, 1}) {
    const ContactMethod convex = find_method("convex")->make({});
    int events = 0;
    const ContactMethod method = [&](const ContactProblem& problem, ContactSolution& solution) {
      convex(problem, solution);
      if (events++ == wrong) solution.impulse[0] *= 0.75;  // goes on into the ground
    };
    Simulation simulation(s, options_of(s), method, convex_law());
    std::vector<Residuals> seen;
    simulation.on_event = [&](const EventRecord& event) { seen.push_back(event.residuals); };
    const StepRecord& record = simulation.step();
    REQUIRE(seen.size() >= 2);
    REQUIRE(std::abs(*seen[wrong].gap) > std::abs(*seen[1 - wrong].gap));
    double gap = 0, infeasibility = 0;
    for (const Residuals& one : seen) {
      if (std::abs(*one.gap) > std::abs(gap)) gap = *one.gap;
      infeasibility = std::max(infeasibility, *one.infeasibility);
    }
    CHECK(record.gap == gap);
    CHECK(record.infeasibility == infeasibility);
    CHECK(infeasibility > 1e-3);
  }
}

TEST_CASE("forces on one body add up, each in the steps that start in its own time, and push no other") {
  Scenario s = test::empty_scene(0.25, 2);
  s.gravity.constant = Vec3::Zero();
  test::add_sphere(s, 0.1, 2, {0, 0, 0});
  test::add_sphere(s, 0.1, 4, {5, 0, 0});
  meet_ground(s, {{0, 0}});
  s.forces.push_back({0, {4, 0, 0}, 0.25, 1});     // steps 2 to 4
  s.forces.push_back({0, {0, 8, 0}, 0.5, 0.75});   // step 3
  s.forces.push_back({1, {0, 0, 16}, 0.75, 1.5});  // steps 4 to 6
  Simulation simulation(s, options_of(s), find_method("newton")->make({}), newton_law());
  const int first[] = {0, 1, 2, 3, 3, 3, 3, 3}, second[] = {0, 0, 1, 1, 1, 1, 1, 1}, third[] = {0, 0, 0, 1, 2, 3, 3, 3};
  for (int n = 0; n < 8; ++n) {
    simulation.step();
    const std::vector<double>& v = simulation.state().v;
    CHECK(v[0] == 0.5 * first[n]);  // 4 N on 2 kg for 0.25 s
    CHECK(v[1] == second[n]);
    CHECK(v[2] == 0);
    CHECK(v[6] == 0);
    CHECK(v[8] == third[n]);
  }
}

TEST_CASE("the contacts of an event have the laws of their own pairs, where others that rest are no part of it") {
  Scenario s = test::empty_scene(1e-3, 1e-3);
  s.gravity.constant = Vec3::Zero();
  test::add_ground(s);
  for (int i = 0; i < 4; ++i)  // the second and the last come down
    test::add_sphere(s, 0.1, 1, {2.0 * i, 0.1, 0}, {0, i % 2 == 1 ? -1.0 : 0.0, 0});
  meet_ground(s, {{0.1, 0.5}, {0.2, 0.25}, {0.3, 0.125}, {0.4, 0.75}});
  Simulation simulation(s, options_of(s), find_method("newton")->make({}), newton_law());
  int events = 0;
  simulation.on_event = [&](const EventRecord& event) {
    ++events;
    CHECK(event.problem.mu == std::vector<double>{0.2, 0.4});
    CHECK(event.problem.restitution == std::vector<double>{0.25, 0.75});
  };
  simulation.step();
  CHECK(events == 1);
  CHECK(simulation.state().v[7] == Approx(0.25));
  CHECK(simulation.state().v[19] == Approx(0.75));
}

TEST_CASE("contacts in a random order keep the laws of their pairs, and orders differ") {
  Scenario s = test::empty_scene(1e-3, 1e-3);
  s.gravity.constant = Vec3::Zero();
  test::add_ground(s);
  for (int i = 0; i < 4; ++i) test::add_sphere(s, 0.1, 1, {2.0 * i, 0.1, 0}, {0, -1, 0});
  meet_ground(s, {{0.1, 0.5}, {0.2, 0.25}, {0.3, 0.125}, {0.4, 0.75}});
  std::set<std::vector<double>> orders;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    SimulationOptions options = options_of(s);
    options.shuffle = seed;
    Simulation simulation(s, options, find_method("newton")->make({}), newton_law());
    simulation.on_event = [&](const EventRecord& event) {
      REQUIRE(event.problem.nc() == 4);
      for (std::size_t c = 0; c < 4; ++c) {
        const PairLaw& law = *s.pairs.find(event.contacts[c].shape_a, event.contacts[c].shape_b);
        CHECK(event.problem.mu[c] == law.mu);
        CHECK(event.problem.restitution[c] == law.restitution);
      }
      orders.insert(event.problem.mu);
    };
    simulation.step();
    for (std::size_t b = 0; b < 4; ++b)
      CHECK(simulation.state().v[6 * b + 1] == Approx(s.pairs.laws[b].restitution).epsilon(1e-12));
  }
  CHECK(orders.size() > 2);
}

TEST_CASE("what overlaps by a tenth of the smaller shape ends the run, a little less is taken away and told") {
  // A ball of 0.2 m across in a crate of 2 m: 0.02 m are a tenth.
  for (const double depth : {0.0199, 0.0201}) {
    Scenario s = test::empty_scene(1e-3, 2e-3);
    s.gravity.constant = Vec3::Zero();
    test::add_box(s, {2, 2, 2}, 8, {{0, -1, 0}, Quat::Identity()});
    test::add_sphere(s, 0.1, 8, {0, 0.1 - depth, 0});
    test::collide_all(s, 0);
    Simulation simulation(s, options_of(s), find_method("newton")->make({}), newton_law());
    const StepRecord record = simulation.step();
    CHECK(record.penetration_inside == Approx(depth));
    if (depth > 0.02) {
      CHECK(record.status == Status::penetration);
      CHECK(simulation.reason().find("interpenetrate by 0.0201 m") != std::string::npos);
      continue;
    }
    CHECK(record.status == Status::ok);
    CHECK(record.max_penetration < 1e-9);
    CHECK(record.penetration_displacement == Approx(depth / 2).epsilon(1e-3));  // equal masses
    CHECK(simulation.state().pose[1].p.y() == Approx(0.1 - depth / 2).epsilon(1e-6));
    const StepRecord& next = simulation.step();
    CHECK(next.penetration_inside < 1e-9);
    CHECK(next.penetration_displacement == 0);
  }
}

TEST_CASE("of what overlaps the deepest is told, and what is moved furthest, wherever it is listed") {
  for (const bool deepest_first : {true, false}) {
    INFO((deepest_first ? "deepest first" : "deepest last"));
    Scenario s = test::empty_scene(1e-3, 1e-3);
    s.gravity.constant = Vec3::Zero();
    test::add_ground(s);
    test::add_sphere(s, 0.1, 2, {0, 0.1 - (deepest_first ? 3e-3 : 1e-3), 0});
    test::add_sphere(s, 0.1, 2, {5, 0.1 - (deepest_first ? 1e-3 : 3e-3), 0});
    test::collide_all(s, 0);
    Simulation simulation(s, options_of(s), find_method("newton")->make({}), newton_law());
    const StepRecord& record = simulation.step();
    REQUIRE(record.status == Status::ok);
    CHECK(record.penetration_inside == Approx(3e-3));
    CHECK(record.penetration_displacement == Approx(3e-3).epsilon(1e-3));
    CHECK(record.max_penetration < 1e-9);
  }
}

TEST_CASE("what goes wrong first in a step is what ended the run, whatever its energy is then") {
  // The first ball is thrown up with 1e5 m/s, which is inaccurate; of the second no answer is found.
  const Scenario s = two_landings();
  int events = 0;
  const ContactMethod method = [&](const ContactProblem&, ContactSolution& solution) {
    const bool first = events++ == 0;
    solution.impulse = {first ? 2e5 : 0.0, 0, 0};
    if (first) return;
    solution.status = Status::ray;
    solution.reason = "made to fail";
  };
  Simulation simulation(s, options_of(s), method, newton_law());
  const StepRecord& record = simulation.step();
  CHECK(events == 2);
  CHECK(record.kinetic_energy > 9e9);
  CHECK(record.status == Status::ray);
  CHECK(simulation.reason() == "made to fail");
}

TEST_CASE("the time in which a method answers is that of the solve, and what looks on at an event is in no part") {
  const auto wait = [](double time) {
    const auto begin = std::chrono::steady_clock::now();
    while (std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() < time) {
    }
  };
  Scenario s = test::empty_scene(1e-3, 1e-3);
  s.gravity.constant.setZero();
  test::add_ground(s);
  test::add_sphere(s, 0.1, 1, {0, 0.1, 0}, {0, -1, 0});
  test::collide_all(s, 0);
  const auto slow = [&](const ContactProblem&, ContactSolution& solution) {
    wait(0.02);
    solution.impulse = {1, 0, 0};
  };
  Simulation simulation(s, options_of(s), slow, newton_law());
  simulation.on_event = [&](const EventRecord&) { wait(0.04); };
  const StepRecord& record = simulation.step();
  REQUIRE(record.events == 1);
  const StepTimes& times = record.times;
  const double others = times.dynamics_s + times.collision_s + times.assembly_s;
  CHECK(times.solve_s >= 0.0199);
  CHECK(others < times.solve_s);
  CHECK(others + times.solve_s <= times.step_s - 0.039);
}

// A carriage meets its stop halfway through the first step, beside a ball that rests; from then on both rest, and the
// weight of the ball alone makes events.
TEST_CASE("a stop that a joint has met is no contact of what is about another body later") {
  Scenario s = test::empty_scene(0.01, 0.05);
  test::add_carriage(s, -1);
  s.model.trees[0].joints[0].limit_rate = 0;
  s.model.bodies[0].mass = 4;  // an answer without rounding
  s.initial.q = {0.005};
  test::add_ground(s);
  test::add_sphere(s, 0.1, 1, {0, 0.1, 0});
  test::collide_all(s, 0);
  Simulation simulation(s, options_of(s), find_method("newton")->make({}), newton_law());
  const StepRecord& first = simulation.step();
  REQUIRE(first.status == Status::ok);
  CHECK(first.events == 2);
  CHECK(first.contacts == 2);
  for (int n = 1; n < 5; ++n) {
    const StepRecord& record = simulation.step();
    REQUIRE(record.status == Status::ok);
    CHECK(record.events == 1);
    CHECK(record.contacts == 1);
    CHECK(simulation.state().qd[0] == 0);
  }
}
