// Stepping by steps (simulation/stepping/steps.h): one problem a step, open contacts with their gap over h.
#include <catch2/catch.hpp>
#include <cmath>

#include "closed_forms.h"

using namespace cb;
using namespace cb::test;

namespace {

constexpr double g = 9.8;

/// Runs a scene by steps; `look` after each.
template <class Look>
State run(const Scenario& s, const std::string& method, const Look& look) {
  SimulationOptions options;
  options.stepping = Stepping::steps;
  options.step = s.step;
  options.duration = s.duration;
  MethodOptions with;
  with.k = 8;
  Simulation simulation(s, options, find_method(method)->make(with), find_method(method)->law);
  while (!simulation.done()) {
    const StepRecord& record = simulation.step();
    INFO(simulation.reason());
    REQUIRE(record.status == Status::ok);
    REQUIRE(record.solves <= 1);
    look(simulation.state(), record);
  }
  return simulation.state();
}

Scenario falling_sphere(double h, double duration, double mu, double restitution, double spin = 0) {
  Scenario s = empty_scene(h, duration);
  s.gravity.constant = {0, -g, 0};
  add_ground(s);
  add_sphere(s, 0.5, 1, {0, 0.6, 0}, {1, 0, 0}, {0, 0, spin});
  collide_all(s, mu, restitution);
  return s;
}

}  // namespace

TEST_CASE("by steps what falls lies on the ground when it lands, with every method that is rigid, and never in it") {
  for (const MethodRow& row : rigid_methods()) {
    INFO(row.name);
    const State end = run(falling_sphere(7e-3, 0.5, 0.5, 0), std::string(row.name),
                          [](const State& state, const StepRecord&) { CHECK(state.pose[0].p.y() >= 0.5 - 1e-9); });
    CHECK(end.pose[0].p.y() == Approx(0.5).margin(1e-9));
    CHECK(std::abs(end.v[1]) < 1e-12);
  }
}

TEST_CASE("by steps an open contact closes by its gap and no further, and pulls nothing") {
  // 0.01 m above the ground, let go: in one step of 0.1 s it would fall 0.098 m.
  Scenario s = falling_sphere(0.1, 0.1, 0, 0);
  s.initial.pose[0].p.y() = 0.51;
  const State end = run(s, "ap", [](const State&, const StepRecord& record) { CHECK(record.contacts == 1); });
  CHECK(end.v[1] == Approx(-0.1).epsilon(1e-12));
  CHECK(end.pose[0].p.y() == Approx(0.5).epsilon(1e-12));
  s.initial.pose[0].p.y() = 0.7;  // out of reach: free fall
  CHECK(run(s, "ap", [](const State&, const StepRecord& record) { CHECK(record.solves == 0); }).v[1] ==
        Approx(-0.98).epsilon(1e-12));
}

TEST_CASE("by steps an event says what of its problem's offset is gaps over the step, and by events there are none") {
  // One ball 0.01 m above the ground in a step of 0.1 s, another one on it.
  Scenario s = falling_sphere(0.1, 0.1, 0, 0);
  s.initial.pose[0].p.y() = 0.51;
  add_sphere(s, 0.5, 1, {5, 0.5, 0});
  collide_all(s, 0);
  for (const Stepping stepping : {Stepping::steps, Stepping::events}) {
    SimulationOptions options;
    options.stepping = stepping;
    options.step = s.step;
    options.duration = s.duration;
    MethodOptions with;
    with.k = 8;
    Simulation simulation(s, options, find_method("ap")->make(with), find_method("ap")->law);
    int seen = 0;
    simulation.on_event = [&](const EventRecord& event) {
      if (stepping == Stepping::events) {
        CHECK(event.gap_speed.empty());
        return;
      }
      REQUIRE(event.gap_speed.size() == event.contacts.size());
      for (std::size_t c = 0; c < event.contacts.size(); ++c) {
        ++seen;
        if (event.contacts[c].gap > 1e-3)
          CHECK(event.gap_speed[c] == Approx(0.1));
        else
          CHECK(event.gap_speed[c] == 0);
        CHECK(event.problem.offset[3 * c] == event.gap_speed[c]);
      }
    };
    simulation.step();
    CHECK(seen == (stepping == Stepping::steps ? 2 : 0));
  }
}

TEST_CASE("by steps each comes to its own stop, in whatever order contacts are handed over and beside what parts") {
  // Balls come down 1, 2 and 3 cm; the first, no further from the ground, goes up. Of two carriages the first goes away
  // from its stop, and the second one's is 2 cm ahead.
  const double h = 0.1;
  for (const std::uint64_t shuffle : {0, 1, 2, 3}) {
    INFO("order " << shuffle);
    Scenario s = empty_scene(h, h);
    s.gravity.constant = {0, -g, 0};
    add_ground(s);
    add_sphere(s, 0.5, 1, {0, 0.505, 0}, {0, 2 * g * h, 0});
    for (int i = 1; i < 4; ++i) add_sphere(s, 0.5, 1, {3.0 * i, 0.5 + 0.01 * i, 0});
    for (const double speed : {-1.0, 1.0}) {
      add_on_rail(s, sphere_shape(0.5), 1, {0, 50, 10 * speed}, speed);
      s.model.trees.back().joints[0].upper = speed > 0 ? 0.02 : 0.005;
    }
    collide_all(s, 0);
    SimulationOptions options;
    options.stepping = Stepping::steps;
    options.step = options.duration = h;
    options.shuffle = shuffle;
    MethodOptions with;
    with.k = 8;
    Simulation simulation(s, options, find_method("ap")->make(with), find_method("ap")->law);
    const StepRecord& record = simulation.step();
    INFO(simulation.reason());
    REQUIRE(record.status == Status::ok);
    const State& end = simulation.state();
    CHECK(end.v[1] == Approx(g * h).epsilon(1e-12));
    for (std::size_t i = 1; i < 4; ++i) {
      CHECK(end.v[6 * i + 1] == Approx(-0.01 * static_cast<double>(i) / h).epsilon(1e-9));
      CHECK(end.pose[i].p.y() == Approx(0.5).epsilon(1e-9));
    }
    CHECK(end.qd[0] == Approx(-1).epsilon(1e-9));
    CHECK(end.qd[1] == Approx(0.02 / h).epsilon(1e-9));
  }
}

TEST_CASE("by steps a ball parts with e times the speed it comes with, at most a step early") {
  for (const std::string method : {"ap", "convex"}) {
    double before = 0, after = 0, parted = 0;
    Scenario s = falling_sphere(1e-3, 0.2, 0, 0.5);
    double last = 0;
    run(s, method, [&](const State& state, const StepRecord&) {
      const double v = state.v[1];
      if (after == 0 && v > 0) {
        before = last - g * s.step;
        after = v;
        parted = state.t;
      }
      last = v;
    });
    INFO(method);
    CHECK(after == Approx(-0.5 * before).epsilon(1e-9));
    CHECK(parted == Approx(std::sqrt(2 * 0.1 / g)).margin(2 * s.step));
  }
}

TEST_CASE("by steps the error of a sphere that lands and begins to roll is of first order") {
  // With mu = 1 it sticks at once: rolls with v (5 + 2 w r / v) / 7 along the plane from the landing on; w = 0.
  const double landing = std::sqrt(2 * 0.1 / g), x = landing + (1 - landing) * 5 / 7;
  double worst = 0;
  for (const double h : {4e-3, 2e-3, 1e-3, 5e-4}) {
    const State end = run(falling_sphere(h, 1, 1, 0), "convex", [](const State&, const StepRecord&) {});
    worst = std::max(worst, std::abs(end.pose[0].p.x() - x) / h);
  }
  CHECK(worst < 1);
}

TEST_CASE("by steps a box slides and stops as by events, and a tower stands") {
  Scenario s = empty_scene(1e-3, 0.5);
  s.gravity.constant = {0, -g, 0};
  add_ground(s);
  add_box(s, Vec3::Ones(), 1, {{0, 0.5, 0}, Quat::Identity()}, {1, 0, 0});
  collide_all(s, 0.5);
  CHECK(run(s, "convex", [](const State&, const StepRecord&) {}).pose[0].p.x() == Approx(1 / g).margin(1e-3));

  Scenario tower = empty_scene(1e-3, 0.1);
  tower.gravity.constant = {0, -g, 0};
  add_ground(tower);
  for (int i = 0; i < 4; ++i) add_box(tower, Vec3::Ones(), 1, {{0, 0.5 + i, 0}, Quat::Identity()});
  collide_all(tower, 0.5);
  for (const std::string method : {"ap", "convex"}) {
    const State end = run(tower, method, [](const State&, const StepRecord&) {});
    for (int i = 0; i < 4; ++i) CHECK((end.pose[static_cast<std::size_t>(i)].p - Vec3(0, 0.5 + i, 0)).norm() < 1e-9);
  }
}

TEST_CASE("by steps a box that falls on a corner is never deeper than a closed gap at the end of a step") {
  Scenario s = empty_scene(2e-3, 1);
  s.gravity.constant = {0, -g, 0};
  add_ground(s);
  const Quat tilt(Eigen::AngleAxisd(0.6, Vec3(1, 0.3, 0.2).normalized()));
  add_box(s, {1, 0.6, 0.8}, 1, {{0, 1.2, 0}, tilt}, {0.5, 0, 0}, {1, 2, 3});
  collide_all(s, 0.4);
  for (const std::string method : {"ap", "convex"})
    run(s, method, [](const State&, const StepRecord& record) { CHECK(record.max_penetration <= 1e-9); });
}

TEST_CASE("by steps a beam that leans out over a rim slides off along its own edge where there is no friction") {
  const double lean = 0.12, half_diagonal = 0.05 * std::sqrt(2.0);
  Scenario s = empty_scene(1e-3, 0.05);
  s.gravity.constant = {0, -g, 0};
  s.shapes.push_back(box_shape({2, 0.1, 2}));
  const Quat tilt(Eigen::AngleAxisd(-lean, Vec3::UnitZ()));
  const Quat on_edge(Eigen::AngleAxisd(M_PI / 4, Vec3::UnitX()));
  const Vec3 middle = Vec3(1, 0.05, 0) + tilt * Vec3(0, half_diagonal, 0);
  add_box(s, {3, 0.1, 0.1}, 1, {middle, tilt * on_edge});
  collide_all(s, 0);
  for (const std::string method : {"ap", "convex"}) {
    INFO(method);
    const State end = run(s, method, [](const State&, const StepRecord&) {});
    CHECK(end.v[0] == Approx(g * std::sin(lean) * std::cos(lean) * s.duration).epsilon(0.02));
  }
}

TEST_CASE("by steps a cube that will miss another one, corner past corner, goes on as it was") {
  // Within a millimetre of each other along x, 0.4 mm, as along y, 0.8 mm, of which a step takes it 1 mm.
  Scenario s = empty_scene(1e-3, 0.01);
  s.gravity.constant = Vec3::Zero();
  s.shapes.push_back(box_shape({1, 1, 1}));
  add_box(s, {1, 1, 1}, 1, {{1.0004, 1.0008, 0}, Quat::Identity()}, {0, -1, 0});
  collide_all(s, 0.5);
  const State end = run(s, "ap", [](const State&, const StepRecord& record) { CHECK(record.solves == 0); });
  CHECK(end.v[1] == -1);
  CHECK(end.pose[0].p.y() == Approx(0.9908).epsilon(1e-12));
}

// The second and third ball are at rest, and so near to nothing until the first one strikes.
TEST_CASE("by steps a ball that is struck goes through no other one that it would not have come to") {
  const double h = 0.01, r = 0.1;
  Scenario s = empty_scene(h, h);
  add_sphere(s, r, 10, {0, 0, 0}, {20, 0, 0});
  add_sphere(s, r, 1, {2 * r + 0.01, 0, 0});
  add_sphere(s, r, 1, {4 * r + 0.011, 0, 0});
  collide_all(s, 0);
  for (const MethodRow& row : rigid_methods()) {
    INFO(row.name);
    const State end = run(s, std::string(row.name), [](const State&, const StepRecord& record) {
      CHECK(record.contacts == 2);
      CHECK(record.penetration_displacement == 0);
    });
    // Both gaps close: 10 (v + 1) + v + v - 0.1 = 200.
    const double v = 190.1 / 12;
    CHECK(end.v[0] == Approx(v + 1).epsilon(1e-9));
    CHECK(end.v[6] == Approx(v).epsilon(1e-9));
    CHECK(end.v[12] == Approx(v - 0.1).epsilon(1e-9));
  }
  // Out of its reach, though not of the first ball's, were there no second: one contact, and free flight behind it.
  s.initial.pose[2].p.x() += 0.2;
  const State end = run(s, "ap", [](const State&, const StepRecord& record) { CHECK(record.contacts == 1); });
  CHECK(end.v[12] == 0);
}

TEST_CASE("by steps what impulses turn round is looked ahead at whichever way it goes") {
  const double h = 0.01, r = 0.1;
  SECTION("two light balls that part, each before a heavy one that drives it back") {
    // Each comes back by more than half of the way between the two, and none is ever faster than the heavy ones.
    const double apart = 0.205, gap = 0.05, x = r + apart / 2;
    Scenario s = empty_scene(h, h);
    for (const double side : {-1.0, 1.0}) {
      add_sphere(s, r, 1, {side * x, 0, 0}, {side * 20, 0, 0});
      add_sphere(s, r, 10, {side * (x + 2 * r + gap), 0, 0}, {-side * 20, 0, 0});
    }
    collide_all(s, 0);
    for (const std::string method : {"ap", "convex", "coulomb"}) {
      INFO(method);
      const State end = run(s, method, [](const State&, const StepRecord& record) {
        CHECK(record.contacts == 3);
        CHECK(record.penetration_displacement == 0);
      });
      // All gaps close.
      const double v = apart / 2 / h;
      CHECK(end.v[0] == Approx(v).epsilon(1e-9));
      CHECK(end.v[6] == Approx(v + gap / h).epsilon(1e-9));
      CHECK(end.v[12] == Approx(-v).epsilon(1e-9));
      CHECK(end.v[18] == Approx(-v - gap / h).epsilon(1e-9));
    }
  }
  SECTION("two balls that have met, where elsewhere one is sent on through a third") {
    // The first pair parts with half of the 40 m/s with which it comes; that is found again with the row of three.
    Scenario s = empty_scene(h, h);
    add_sphere(s, r, 1, {-(r + 0.175), 10, 0}, {20, 0, 0});
    add_sphere(s, r, 1, {r + 0.175, 10, 0}, {-20, 0, 0});
    add_sphere(s, r, 10, {0, 0, 0}, {20, 0, 0});
    add_sphere(s, r, 1, {2 * r + 0.01, 0, 0});
    add_sphere(s, r, 1, {4 * r + 0.011, 0, 0});
    collide_all(s, 0, 0.5);
    const State end = run(s, "ap", [](const State&, const StepRecord& record) {
      CHECK(record.contacts == 3);
      CHECK(record.penetration_displacement == 0);
    });
    CHECK(end.v[0] == Approx(-10).epsilon(1e-9));
    CHECK(end.v[6] == Approx(10).epsilon(1e-9));
  }
}

TEST_CASE("by steps what is driven is looked ahead at as far as its rate takes it, from rest, too") {
  // A ram that has had no rate yet goes 0.1 m in the step; the ball is 0.05 m before it.
  const double h = 0.01, rate = 10;
  Scenario s = empty_scene(h, h);
  s.gravity.constant.setZero();
  add_on_rail(s, sphere_shape(0.1), 1, {0, 0, 0});
  Joint& rail = s.model.trees[0].joints[0];
  rail.lower = rail.upper = 0;
  rail.limit_rate = rate;
  add_sphere(s, 0.1, 1, {0.25, 0, 0});
  collide_all(s, 0);
  const State end = run(s, "ap", [](const State&, const StepRecord& record) { CHECK(record.contacts == 1); });
  CHECK(end.v[6] == Approx(rate - 0.05 / h).epsilon(1e-9));
  CHECK(end.pose[1].p.x() == Approx(0.3).epsilon(1e-9));
}

// Barrels that whirl between others of a thousand times their mass. One is sent through a face of another that it would
// not have come to; one past rims that are beside each other: with points in its problem that no surface is above it is
// turned by half a radian in the step, into what stands beside it.
TEST_CASE("by steps what is struck passes points that it comes to, and none that no surface is above") {
  for (const auto& [name, method] : {std::pair("barrel_struck", "ap"),
                                     {"barrel_struck", "coulomb"},
                                     {"barrel_thrown", "ap"},
                                     {"barrel_thrown", "convex"},
                                     {"barrel_thrown", "coulomb"}}) {
    INFO(name << " by " << method);
    const Scenario s = load_scenario(std::string(TEST_DATA "/scenes/") + name + ".xml", {});
    const State end = run(s, method, [](const State&, const StepRecord&) {});
    CHECK(end.t == Approx(s.duration).margin(s.step));
  }
}

TEST_CASE("by steps a joint that is struck goes no further than its limit") {
  // A carriage at rest, 0.05 m before its stop, and a ball of 10 kg that comes at 20 m/s: in a step of 0.01 s both
  // would go 0.18 m. They come to the stop together, and stay there.
  for (const double side : {1.0, -1.0}) {
    Scenario s = empty_scene(1e-2, 3e-2);
    s.gravity.constant.setZero();
    add_on_rail(s, sphere_shape(0.5), 1, {0, 0, 0});
    (side > 0 ? s.model.trees[0].joints[0].upper : s.model.trees[0].joints[0].lower) = side * 0.05;
    add_sphere(s, 0.5, 10, {-side, 0, 0}, {side * 20, 0, 0});
    collide_all(s, 0);
    for (const std::string method : {"ap", "convex", "coulomb"}) {
      INFO(method << (side > 0 ? ", upper" : ", lower"));
      double furthest = 0;
      const State end = run(
          s, method, [&](const State& state, const StepRecord&) { furthest = std::max(furthest, side * state.q[0]); });
      CHECK(furthest <= 0.05 + 1e-8);
      CHECK(std::abs(end.q[0] - side * 0.05) <= 1e-8);
      CHECK(std::abs(end.qd[0]) <= 1e-8);
      CHECK(std::abs(end.pose[1].p.x() + side * 0.95) <= 1e-8);
    }
  }
}

TEST_CASE("by steps a joint that is struck goes no further than where a limit comes to meanwhile") {
  // The stop, 0.05 m before the carriage, comes at 2 m/s; a ball of 10 kg would take that along at 4 m/s. They meet the
  // stop 0.03 m from where they were, and go back with it.
  Scenario s = empty_scene(1e-2, 3e-2);
  s.gravity.constant.setZero();
  add_on_rail(s, sphere_shape(0.5), 1, {0, 0, 0});
  s.model.trees[0].joints[0].upper = 0.05;
  s.model.trees[0].joints[0].limit_rate = -2;
  add_sphere(s, 0.5, 10, {-1, 0, 0}, {4.4, 0, 0});
  collide_all(s, 0);
  for (const std::string method : {"ap", "convex", "coulomb"}) {
    INFO(method);
    const State end =
        run(s, method, [](const State& state, const StepRecord&) { CHECK(state.q[0] <= 0.05 - 2 * state.t + 1e-8); });
    CHECK(end.q[0] == Approx(-0.01).margin(1e-8));
    CHECK(end.qd[0] == Approx(-2).epsilon(1e-8));
    CHECK(end.pose[1].p.x() == Approx(-1.01).margin(1e-8));
  }
}

TEST_CASE("by steps each of two joints that are struck is looked at by its own rate") {
  // As above, by balls of 10 kg: one at 2 m/s, which takes its carriage along by 2/1.1 cm a step, and one at 20 m/s.
  Scenario s = empty_scene(1e-2, 2e-2);
  s.gravity.constant.setZero();
  for (const double z : {0.0, 10.0}) {
    add_on_rail(s, sphere_shape(0.5), 1, {0, 0, z});
    add_sphere(s, 0.5, 10, {-1, 0, z}, {z > 0 ? 20.0 : 2.0, 0, 0});
  }
  s.model.trees[0].joints[0].upper = 0.05;
  s.model.trees[1].joints[0].upper = 0.08;
  collide_all(s, 0);
  for (const std::string method : {"ap", "coulomb"}) {
    INFO(method);
    const State end = run(s, method, [](const State& state, const StepRecord&) { CHECK(state.q[1] <= 0.08 + 1e-8); });
    CHECK(end.q[0] == Approx(0.04 / 1.1).epsilon(1e-6));
    CHECK(end.q[1] == Approx(0.08).margin(1e-8));
    CHECK(std::abs(end.qd[1]) <= 1e-8);
  }
}
