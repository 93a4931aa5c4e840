#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>

#include "scenes.h"
#include "simulation/simulation.h"

using namespace cb;

namespace {

ContactMethod method(const std::string& name, int k = 8) {
  MethodOptions options;
  options.k = k;
  return find_method(name)->make(options);
}

struct Run {
  State state;
  Status status = Status::ok;
  long events = 0;
  double max_residual = 0, max_gain = 0, max_penetration = 0;
  int false_claims = 0;
};

Run run(const Scenario& s, const std::string& name, int k = 8) {
  SimulationOptions options;
  options.step = s.step;
  options.duration = s.duration;
  Simulation simulation(s, options, method(name, k), find_method(name)->law);
  Run out;
  while (simulation.step_index() < simulation.steps_total()) {
    const StepRecord& record = simulation.step();
    out.events += record.events;
    out.max_residual = std::max(out.max_residual, record.residual);
    out.max_gain = std::max(out.max_gain, record.event_energy_gain);
    out.max_penetration = std::max(out.max_penetration, record.max_penetration);
    out.false_claims += record.false_claims;
    if (record.status != Status::ok) out.status = record.status;
    if (record.status != Status::ok && record.status != Status::inaccurate) break;
  }
  out.state = simulation.state();
  return out;
}

Scenario box_on_ground(double mu, const Vec3& v, double h = 1e-3, double duration = 0.5) {
  Scenario s = test::empty_scene(h, duration);
  test::add_ground(s);
  test::add_box(s, Vec3::Ones(), 1, {{0, 0.5, 0}, Quat::Identity()}, v);
  test::collide_all(s, mu);
  return s;
}

}  // namespace

TEST_CASE("free fall is explicit Euler: after n steps v = -n g h and y = y0 - g h^2 n (n + 1) / 2") {
  Scenario s = test::empty_scene(1e-2, 1);
  test::add_sphere(s, 0.1, 2, {0, 10, 0}, {1, 0, 0});
  test::collide_all(s, 0.5);
  const Run out = run(s, "ap");
  CHECK(out.events == 0);
  CHECK(out.state.t == 1.0);
  CHECK(out.state.v[1] == Approx(-9.8).epsilon(1e-13));
  CHECK(out.state.pose[0].p[1] == Approx(10 - 9.8e-4 * 100 * 101 / 2).epsilon(1e-13));
  CHECK(out.state.pose[0].p[0] == Approx(1).epsilon(1e-13));
}

TEST_CASE("a torque-free body about a principal axis turns by w t, and its quaternion stays unit") {
  Scenario s = test::empty_scene(1e-3, 2);
  s.gravity.constant.setZero();
  test::add_box(s, {1, 2, 3}, 1, {}, Vec3::Zero(), {0, 0, 1.5});
  test::collide_all(s, 0);
  const Run out = run(s, "ap");
  const Quat expected(Eigen::AngleAxisd(3.0, Vec3::UnitZ()));
  CHECK(out.state.pose[0].q.angularDistance(expected) < 1e-11);
  CHECK(std::abs(out.state.pose[0].q.norm() - 1) < 1e-12);
}

TEST_CASE("tumbling without torque keeps angular momentum to first order in the step") {
  double error[2];
  for (int i = 0; i < 2; ++i) {
    Scenario s = test::empty_scene(i == 0 ? 1e-3 : 5e-4, 1);
    s.gravity.constant.setZero();
    test::add_box(s, {1, 2, 3}, 1, {}, Vec3::Zero(), {1, 2, -1});
    test::collide_all(s, 0);
    const Run out = run(s, "ap");
    const auto momentum = [&](const Pose& pose, const double* v) -> Vec3 {
      const Vec3 w_B = pose.q.conjugate() * Vec3(v[3], v[4], v[5]);
      return pose.q * s.model.bodies[0].inertia.cwiseProduct(w_B);
    };
    error[i] =
        (momentum(out.state.pose[0], out.state.v.data()) - momentum(s.initial.pose[0], s.initial.v.data())).norm();
  }
  CHECK(error[0] < 1e-2);
  CHECK(error[0] / error[1] == Approx(2).epsilon(0.1));
}

TEST_CASE("a force with a window acts in the steps that start inside it") {
  for (double h : {1e-2, 1e-3}) {
    Scenario s = test::empty_scene(h, 3);
    s.gravity.constant.setZero();
    test::add_sphere(s, 0.1, 2, {0, 0, 0});
    test::collide_all(s, 0);
    s.forces.push_back({0, {4, 0, 0}, 1, 2});
    CHECK(run(s, "ap").state.v[0] == Approx(2).epsilon(1e-12));
  }
}

TEST_CASE("a box at rest stays where it is for both methods") {
  for (const std::string name : {"ap", "convex"}) {
    const Run out = run(box_on_ground(0.5, Vec3::Zero()), name);
    CHECK(out.status == Status::ok);
    CHECK(out.events == 500);
    CHECK((out.state.pose[0].p - Vec3(0, 0.5, 0)).norm() < 1e-14);
    CHECK(out.false_claims == 0);
  }
}

TEST_CASE("a sliding box decelerates by mu g for both methods") {
  // After n steps v = v0 - mu g n h and x = sum of h v.
  for (const std::string name : {"ap", "convex"}) {
    const Run out = run(box_on_ground(0.2, {2, 0, 0}), name);
    CHECK(out.status == Status::ok);
    CHECK(out.state.v[0] == Approx(2 - 0.2 * 9.8 * 0.5).epsilon(1e-12));
    CHECK(out.state.pose[0].p[0] == Approx(2 * 0.5 - 0.2 * 9.8e-6 * 500 * 501 / 2).epsilon(1e-12));
    CHECK(std::abs(out.state.pose[0].p[1] - 0.5) < 1e-12);
    CHECK(out.max_gain < 1e-14);
  }
}

TEST_CASE("a box dropped flat lands with its four corners in one event") {
  Scenario s = test::empty_scene(1e-3, 0.3);
  test::add_ground(s);
  test::add_box(s, Vec3::Ones(), 1, {{0, 0.6, 0}, Quat::Identity()});
  test::collide_all(s, 0.5);
  SimulationOptions options;
  options.step = s.step;
  options.duration = s.duration;
  Simulation simulation(s, options, method("ap"), anitescu_potra_law());
  int first_contacts = 0;
  simulation.on_event = [&](const EventRecord& event) {
    if (first_contacts == 0) first_contacts = event.problem.nc();
  };
  for (int i = 0; i < 300; ++i) REQUIRE(simulation.step().status == Status::ok);
  CHECK(first_contacts == 4);
  CHECK(std::abs(simulation.state().pose[0].p[1] - 0.5) < 2e-9);
  CHECK(std::abs(simulation.state().v[1]) < 1e-12);
}

TEST_CASE("a box dropped on an edge finds its other edge and ends flat, without interpenetration") {
  Scenario s = test::empty_scene(1e-3, 2);
  test::add_ground(s);
  const Quat tilt(Eigen::AngleAxisd(0.2, Vec3::UnitZ()));
  test::add_box(s, Vec3::Ones(), 1, {{0, 1, 0}, tilt});
  test::collide_all(s, 0.5);
  for (const std::string name : {"ap", "convex"}) {
    const Run out = run(s, name);
    CHECK(out.status == Status::ok);
    CHECK(out.max_penetration < 1e-6);
    CHECK(std::abs(out.state.pose[0].p[1] - 0.5) < 1e-5);
    CHECK((out.state.pose[0].q * Vec3::UnitY()).dot(Vec3::UnitY()) > 1 - 1e-9);
  }
}

TEST_CASE("a fast body does not tunnel through a thin plate") {
  for (double speed : {1.0, 1e3, 1e5}) {
    Scenario s = test::empty_scene(1e-3, 5e-3);
    s.gravity.constant.setZero();
    Shape plate;
    plate.kind = ShapeKind::box;
    plate.half_extents = {1, 5e-4, 1};
    plate.name = "plate";
    s.shapes.push_back(plate);
    test::add_sphere(s, 0.1, 1, {0, 0.1 + 5e-4 + 2e-3 * speed, 0}, {0, -speed, 0});
    test::collide_all(s, 0.5);
    const Run out = run(s, "ap");
    CHECK(out.status == Status::ok);
    CHECK(out.state.pose[0].p[1] > 0.1);
  }
}

TEST_CASE("turning the world turns the motion") {
  Scenario s = box_on_ground(0.2, {1, 0, 0.5}, 1e-3, 0.2);
  const Run plain = run(s, "convex");
  const Quat turn(Eigen::AngleAxisd(0.7, Vec3(1, 2, -1).normalized()));
  Scenario turned = s;
  turned.gravity.constant = turn * s.gravity.constant;
  turned.shapes[0].local.q = turn;
  turned.initial.pose[0] = {turn * s.initial.pose[0].p, turn};
  const Vec3 v = turn * Vec3(1, 0, 0.5);
  for (int i = 0; i < 3; ++i) turned.initial.v[i] = v[i];
  const Run out = run(turned, "convex");
  CHECK((out.state.pose[0].p - turn * plain.state.pose[0].p).norm() < 1e-10);
}

TEST_CASE("other units give the same dimensionless motion") {
  // Lengths in mm, masses in g: g = 9800 mm/s^2.
  Scenario s = box_on_ground(0.2, {1, 0, 0.5}, 1e-3, 0.2);
  const Run metres = run(s, "ap");
  Scenario t = test::empty_scene(1e-3, 0.2);
  t.gravity.constant *= 1000;
  test::add_ground(t);
  test::add_box(t, Vec3::Constant(1000), 1000, {{0, 500, 0}, Quat::Identity()}, {1000, 0, 500});
  test::collide_all(t, 0.2);
  const Run millimetres = run(t, "ap");
  CHECK((millimetres.state.pose[0].p / 1000 - metres.state.pose[0].p).norm() < 1e-10);
}

TEST_CASE("the same run twice gives the same bytes") {
  Scenario s = box_on_ground(0.3, {1, 0, 0.5});
  for (const std::string name : {"ap", "convex"}) {
    const Run a = run(s, name), b = run(s, name);
    CHECK(std::memcmp(a.state.v.data(), b.state.v.data(), a.state.v.size() * sizeof(double)) == 0);
    CHECK(std::memcmp(&a.state.pose[0].p, &b.state.pose[0].p, sizeof(Vec3)) == 0);
  }
}

TEST_CASE("a stack carries (n - j + 1) m g h at interface j") {
  Scenario s = test::empty_scene(1e-3, 0.05);
  test::add_ground(s);
  const int n = 6;
  for (int i = 0; i < n; ++i) test::add_box(s, Vec3::Ones(), 1, {{0, 0.5 + i, 0}, Quat::Identity()});
  test::collide_all(s, 0.5);
  for (const std::string name : {"ap", "convex"}) {
    SimulationOptions options;
    options.step = s.step;
    options.duration = s.duration;
    Simulation simulation(s, options, method(name, 4), find_method(name)->law);
    std::vector<double> sums;
    simulation.on_event = [&](const EventRecord& event) {
      sums.assign(n, 0.0);
      for (int c = 0; c < event.problem.nc(); ++c) {
        const int interface = static_cast<int>(std::lround(event.contacts[c].position[1]));
        sums[interface] += event.solution.impulse[3 * c];
      }
    };
    for (int i = 0; i < 50; ++i) REQUIRE(simulation.step().status == Status::ok);
    for (int j = 0; j < n; ++j) CHECK(sums[j] == Approx((n - j) * 9.8e-3).epsilon(1e-9));
    for (int i = 0; i < n; ++i) CHECK((simulation.state().pose[i].p - Vec3(0, 0.5 + i, 0)).norm() < 1e-11);
  }
}

TEST_CASE("a method that fails ends the run with its status, and a false claim is counted") {
  const Scenario s = box_on_ground(0.5, Vec3::Zero());
  SimulationOptions options;
  Simulation failing(
      s, options,
      [](const ContactProblem& p, ContactSolution& out) {
        out.status = Status::ray;
        out.reason = "made to fail";
        out.impulse.assign(3 * p.nc(), 0.0);
      },
      anitescu_potra_law());
  CHECK(failing.step().status == Status::ray);
  CHECK(failing.reason() == "made to fail");

  Simulation lying(
      s, options,
      [](const ContactProblem& p, ContactSolution& out) {
        out.impulse.assign(3 * p.nc(), 0.0);
        out.witness = PolygonWitness{4, 0, std::vector<double>(6 * static_cast<std::size_t>(p.nc()), 0.0)};
      },
      anitescu_potra_law());
  const StepRecord& record = lying.step();
  CHECK(record.status == Status::inaccurate);
  CHECK(record.false_claims == 1);
  lying.step();
  lying.step();
  CHECK(lying.reason().ends_with(", at t = 0.002 s"));

  Simulation broken(
      s, options, [](const ContactProblem& p, ContactSolution& out) { out.impulse.assign(3 * p.nc(), std::nan("")); },
      convex_law());
  CHECK(broken.step().status == Status::not_finite);
  CHECK(broken.reason() == "the method's impulses are not finite");
}

TEST_CASE(
    "an event is made of the islands in which something approaches: a body that rests beside one that lands is not in "
    "it") {
  // The sphere lands in the middle of a step, whose start has put both boxes at rest.
  Scenario s = test::empty_scene(1e-2, 0.1);
  test::add_ground(s);
  test::add_box(s, Vec3::Ones(), 1, {{0, 0.5, 0}, Quat::Identity()}, {1, 0, 0});
  test::add_box(s, Vec3::Ones(), 2, {{3, 0.5, 0}, Quat::Identity()}, Vec3::Zero());
  test::add_sphere(s, 0.5, 3, {6, 0.5 + 1e-2, 0}, {0, -2, 0});
  test::collide_all(s, 0.5);
  SimulationOptions options;
  options.step = s.step;
  for (const char* name : {"ap", "convex"}) {
    Simulation simulation(s, options, method(name), find_method(name)->law);
    std::vector<int> contacts;
    simulation.on_event = [&](const EventRecord& event) {
      contacts.push_back(event.problem.nc());
      CHECK(static_cast<int>(event.contacts.size()) == event.problem.nc());
      CHECK(event.problem.M.blocks() == (event.problem.nc() == 1 ? 1 : 2));
    };
    CHECK(simulation.step().status == Status::ok);
    REQUIRE(contacts.size() == 2);
    CHECK(contacts[0] > 1);   // both boxes, which gravity sets in motion,
    CHECK(contacts[1] == 1);  // and the sphere alone
  }
}

TEST_CASE("an answer that the check confirms is taken, whatever the method says of itself") {
  const Scenario s = box_on_ground(0.5, Vec3::Zero());
  SimulationOptions options;
  options.step = s.step;
  Simulation doubting(
      s, options,
      [right = method("convex")](const ContactProblem& p, ContactSolution& out) {
        right(p, out);
        out.status = Status::nonconverged;
        out.reason = "does not trust itself";
      },
      convex_law());
  const StepRecord& record = doubting.step();
  CHECK(record.status == Status::ok);
  CHECK(record.doubted == 1);
  CHECK(record.false_claims == 0);
}

TEST_CASE("the order in which contacts are handed over changes no motion that is unique") {
  double x[3];
  for (const std::uint64_t seed : {0, 1, 2}) {
    Scenario s = box_on_ground(0.3, {1, 0, 0.5}, 1e-3, 0.2);
    SimulationOptions options;
    options.step = s.step;
    options.duration = s.duration;
    options.shuffle = seed;
    Simulation simulation(s, options, method("convex"), convex_law());
    while (simulation.step_index() < simulation.steps_total()) REQUIRE(simulation.step().status == Status::ok);
    x[seed] = simulation.state().pose[0].p[0];
  }
  CHECK(x[1] == Approx(x[0]).epsilon(1e-12));
  CHECK(x[2] == Approx(x[0]).epsilon(1e-12));
}

TEST_CASE("contacts keep their friction and restitution in whatever order they are handed over") {
  // Four spheres on the ground, each with a law of its own: smooth to rough slide with mu g, the last two rebound.
  constexpr double step = 1e-3, mus[] = {0, 0.1, 0.2, 0.3}, es[] = {0, 0, 0.5, 1};
  for (const std::uint64_t shuffle : {0, 1, 2, 3, 4, 5}) {
    Scenario s = test::empty_scene(step, step);
    s.gravity.constant.setZero();
    test::add_ground(s);
    for (int i = 0; i < 4; ++i) test::add_sphere(s, 0.1, 1, {1.0 * i, 0.1, 0}, {5, -1, 0});
    test::collide_all(s, 0);
    s.pairs.groups = 5;
    s.pairs.group = {0, 1, 2, 3, 4};
    s.pairs.index.assign(25, -1);
    s.pairs.laws.clear();
    for (int i = 0; i < 4; ++i) {
      s.pairs.index[i + 1] = s.pairs.index[5 * (i + 1)] = i;
      s.pairs.laws.push_back({mus[i], es[i]});
    }
    SimulationOptions options;
    options.step = options.duration = step;
    options.shuffle = shuffle;
    Simulation simulation(s, options, find_method("newton")->make({}), newton_law());
    CHECK(simulation.step().status == Status::ok);
    for (int i = 0; i < 4; ++i) {
      INFO("sphere " << i << ", order " << shuffle);
      CHECK(simulation.state().v[6 * i + 1] == Approx(es[i]).margin(1e-9));
      CHECK(simulation.state().v[6 * i] == Approx(5 - mus[i] * (1 + es[i])).epsilon(1e-9));
    }
  }
}

TEST_CASE("a force that never ends acts, however far off its end is written") {
  CHECK(step_at(0.25, 0.1) == 3);
  for (const double never : {1e16, 1e30, 1e300}) {
    Scenario s = test::empty_scene(1e-3, 0.01);
    s.gravity.constant.setZero();
    test::add_sphere(s, 0.1, 1, {0, 1, 0});
    test::collide_all(s, 0);
    s.forces.push_back({.body = 0, .force = {1, 0, 0}, .from = 0, .to = never});
    SimulationOptions options;
    options.step = s.step;
    options.duration = s.duration;
    Simulation simulation(s, options, find_method("newton")->make({}), newton_law());
    while (simulation.step_index() < simulation.steps_total()) REQUIRE(simulation.step().status == Status::ok);
    CHECK(simulation.state().v[0] == Approx(0.01));
  }
}
