// What a step leaves out changes nothing in the motion.

#include "simulation/left_out.h"

#include <array>
#include <catch2/catch.hpp>
#include <cmath>

#include "scenes.h"

using namespace cb;

namespace {

struct Outcome {
  double v[6];
  std::vector<LeftOutItem> items;
};

// The box on its grid of contact points, started with the velocity given, after some steps.
Outcome after(const char* method, bool prune, int n, const std::array<double, 6>& start, double restitution = 0,
              double mu = -1) {
  Scenario scenario = load_scenario(SOURCE_ROOT "/scenarios/stress/contact_grid.xml", {{"n", std::to_string(n)}});
  std::copy(start.begin(), start.end(), scenario.initial.v.begin());
  for (PairLaw& law : scenario.pairs.laws) {
    law.restitution = restitution;
    if (mu >= 0) law.mu = mu;
  }
  SimulationOptions options;
  options.step = 1e-3;
  PrunedRun run(scenario, options, *find_method(method), {}, prune);
  for (int i = 0; i < 20; ++i) CHECK(run.simulation.step().status == Status::ok);
  Outcome motion{};
  std::copy_n(run.simulation.state().v.begin(), 6, motion.v);
  motion.items = run.items();
  return motion;
}

long count(const Outcome& motion, std::string_view name) {
  for (const LeftOutItem& item : motion.items)
    if (item.name == name) return item.count;
  return -1;
}

void same(const Outcome& a, const Outcome& b) {
  for (int i = 0; i < 6; ++i) CHECK(a.v[i] == Approx(b.v[i]).margin(1e-10));
}

}  // namespace

TEST_CASE("a box that rests or slides on many points moves as on the corners of their hull", "[left_out]") {
  for (const char* method : {"ap", "convex"})
    for (const double vx : {0.0, 0.5}) {
      INFO(method << " at " << vx << " m/s");
      const Outcome all = after(method, false, 5, {vx, 0, 0, 0, 0, 0}),
                    corners = after(method, true, 5, {vx, 0, 0, 0, 0, 0});
      same(all, corners);
      CHECK(count(all, "coplanar contacts") == 0);
      CHECK(count(corners, "coplanar contacts") == 20 * (25 - 4));
    }
}

TEST_CASE("where the patch spins the polygon keeps all its points, and the cone needs the corners alone",
          "[left_out]") {
  const std::array<double, 6> spin = {0, 0, 0, 0, 2, 0};
  same(after("convex", false, 5, spin), after("convex", true, 5, spin));
  const Outcome all = after("ap", false, 4, spin), less = after("ap", true, 4, spin);
  for (int i = 0; i < 6; ++i) CHECK(all.v[i] == less.v[i]);  // to the last bit
  CHECK(count(less, "coplanar contacts") == 0);
}

TEST_CASE("contacts in a random order are all there in each step, whatever else is left out", "[left_out]") {
  const Scenario scenario = load_scenario(SOURCE_ROOT "/scenarios/stress/contact_grid.xml", {{"n", "5"}});
  for (const std::uint64_t shuffle : {0, 7}) {
    SimulationOptions options;
    options.step = 1e-3;
    options.shuffle = shuffle;
    PrunedRun run(scenario, options, *find_method("convex"), {}, true);
    for (int i = 0; i < 2; ++i) {
      const StepRecord& record = run.simulation.step();
      CHECK(record.status == Status::ok);
      CHECK(record.contacts == (shuffle == 0 ? 4 : 25));
    }
  }
}

TEST_CASE("points of a pair with restitution, and of methods that hit one after the other, stay", "[left_out]") {
  CHECK(count(after("ap", true, 4, {0, -1, 0, 0, 0, 0}, 0.5), "coplanar contacts") == 0);
  CHECK(count(after("newton", true, 4, {0, 0, 0, 0, 0, 0}), "coplanar contacts") == 0);
}

TEST_CASE("without friction the polygon has no unknowns of it, whatever else stays", "[left_out]") {
  for (const bool prune : {false, true}) {
    const Outcome smooth = after("ap", prune, 2, {0.5, 0, 0, 0, 0, 0}, 0, 0);
    CHECK(count(smooth, "unknowns of friction of contacts with mu = 0") == 20 * 4);
    CHECK(smooth.v[0] == Approx(0.5).margin(1e-12));
    CHECK(count(after("ap", prune, 2, {0.5, 0, 0, 0, 0, 0}), "unknowns of friction of contacts with mu = 0") == 0);
  }
}

TEST_CASE("a box on its edge keeps the ends of the edge, and one that flies has no contact", "[left_out]") {
  const Scenario scenario = load_scenario(SOURCE_ROOT "/scenarios/stress/contact_grid.xml", {{"n", "6"}});
  const Shape &ground = scenario.shapes[0], &box = scenario.shapes[1];
  Pose pose;
  const auto corners = [&](std::vector<ContactPoint>& out) {
    out.clear();
    return contact_points(box, pose, 1, ground, ground.local, 0, 1e-9, out, true);
  };
  std::vector<ContactPoint> points;
  pose.p = {0, 0.5, 0};
  CHECK(corners(points) == 36 - 4);
  CHECK(points.size() == 4);
  pose.q = Quat(Eigen::AngleAxisd(M_PI / 4, Vec3(0, 0, 1)));
  pose.p = {0, std::sqrt(0.5), 0};
  CHECK(corners(points) == 6 - 2);
  CHECK(points.size() == 2);
  pose.p.y() += 1e-6;
  CHECK(corners(points) == 0);
  CHECK(points.empty());
  // Tilted so little that some points beside the edge touch too, but no other corner: all of them stay.
  pose.q = Quat(Eigen::AngleAxisd(1e-9, Vec3(0, 0, 1)));
  pose.p = {0, 0.5 + 0.5e-9 * 0.999, 0};
  std::vector<ContactPoint> all;
  contact_points(box, pose, 1, ground, ground.local, 0, 0.5e-9, all);
  points.clear();
  CHECK(contact_points(box, pose, 1, ground, ground.local, 0, 0.5e-9, points, true) == 0);
  CHECK(points.size() == all.size());
  CHECK(points.size() > 6);
}

TEST_CASE("pairs that can meet are sought once for a box at rest, and in each step of one that moves", "[left_out]") {
  const std::array<double, 6> rest = {};
  CHECK(count(after("ap", true, 2, rest), "searches for pairs that can meet") == 20);
  CHECK(count(after("ap", false, 2, rest), "searches for pairs that can meet") == 0);
  CHECK(count(after("ap", true, 2, {0.5, 0, 0, 0, 0, 0}), "searches for pairs that can meet") == 0);
}

// Without gravity, at 2e-8 m a step: pairs are sought again every few steps only, with 1e-6 m to spare. At rest, each
// answer leaves the last bits of the velocity before, down to numbers whose squares are none.
TEST_CASE("a slow box finds the ground though pairs are sought in few steps", "[left_out]") {
  Scenario scenario = load_scenario(SOURCE_ROOT "/scenarios/stress/contact_grid.xml", {{"n", "2"}});
  scenario.gravity.constant = Vec3::Zero();
  scenario.initial.v[1] = -2e-5;
  scenario.initial.pose[0].p[1] += 1.5e-6;
  SimulationOptions options;
  options.step = 1e-3;
  std::array<double, 2> height{};
  const std::string method = GENERATE("ap", "convex", "coulomb", "mirtich");
  CAPTURE(method);
  for (const bool prune : {false, true}) {
    PrunedRun run(scenario, options, *find_method(method), {}, prune);
    for (int i = 0; i < 100; ++i) CHECK(run.simulation.step().status == Status::ok);
    CHECK(run.simulation.state().v[1] == Approx(0).margin(1e-12));  // 75 steps to the ground, where it stays
    height[prune ? 1 : 0] = run.simulation.state().pose[0].p[1];
    Outcome told{};
    told.items = run.items();
    // Either of its own: pairs while it comes down, times of contact once it rests.
    const long pairs = count(told, "searches for pairs that can meet");
    const long times = count(told, "searches for times of contact");
    CHECK((pairs > 50) == prune);
    CHECK((times > 0) == prune);
    CHECK(times < 50);
  }
  CHECK(height[0] == height[1]);
}

TEST_CASE("a box at rest needs no search for times of contact, one that falls does", "[left_out]") {
  CHECK(count(after("ap", true, 2, {0, 0, 0, 0, 0, 0}), "searches for times of contact") == 20);
  CHECK(count(after("ap", true, 2, {0.5, 0, 0, 0, 0, 0}), "searches for times of contact") == 0);
}

namespace {

struct Resting {
  State state;
  long repeats;
};

// A cube on the ground after some steps, with `change` made to the scene.
template <class Change>
Resting cube(const char* method, bool rest, Stepping stepping, int steps, const Change& change) {
  Scenario scenario = load_scenario(SOURCE_ROOT "/scenarios/stress/contact_grid.xml", {{"n", "2"}});
  change(scenario);
  SimulationOptions options;
  options.step = 1e-3;
  options.stepping = stepping;
  options.prune.repeats = rest;
  PrunedRun run(scenario, options, *find_method(method), {}, true);
  for (int i = 0; i < steps; ++i) {
    CHECK(run.simulation.step().status == Status::ok);
    CHECK(run.simulation.state().t == Approx((i + 1) * 1e-3));
  }
  return {run.simulation.state(), run.simulation.left_out().repeats};
}

// N, along x on the cube, from step 40 to step 60, against friction of at most 4.9 N.
void push(Scenario& scenario, double force) {
  for (PairLaw& law : scenario.pairs.laws) law.mu = 0.5;
  scenario.forces.push_back({.body = 0, .force = {force, 0, 0}, .from = 0.04, .to = 0.06});
}

}  // namespace

TEST_CASE("a box that rests is asked about once, and rests to the last bit", "[left_out]") {
  const std::string method = GENERATE("ap", "convex", "coulomb");
  const Stepping stepping = GENERATE(Stepping::events, Stepping::steps);
  CAPTURE(method, stepping);
  const auto nothing = [](Scenario&) {};
  const Resting rests = cube(method.c_str(), true, stepping, 20, nothing);
  CHECK(rests.repeats == 19);
  for (const double v : rests.state.v) CHECK(v == 0);
  CHECK(rests.state.pose[0].p.y() == 0.5);
  CHECK(cube(method.c_str(), false, stepping, 20, nothing).repeats == 0);
}

TEST_CASE("steps of what rests are told the overlap that counts as closed, those that repeat the first one too",
          "[left_out]") {
  const Stepping stepping = GENERATE(Stepping::events, Stepping::steps);
  CAPTURE(stepping);
  constexpr double depth = 4e-10;  // m, of a cube of 1 m
  Scenario scenario = load_scenario(SOURCE_ROOT "/scenarios/stress/contact_grid.xml", {{"n", "2"}});
  scenario.initial.pose[0].p[1] -= depth;
  SimulationOptions options;
  options.step = 1e-3;
  options.stepping = stepping;
  options.prune.repeats = true;
  PrunedRun run(scenario, options, *find_method("coulomb"), {}, true);
  for (int i = 0; i < 5; ++i) {
    const StepRecord& record = run.simulation.step();
    CHECK(record.status == Status::ok);
    CHECK(record.max_penetration == Approx(depth).epsilon(1e-3));
    CHECK(record.penetration_inside == Approx(depth).epsilon(1e-3));
  }
  CHECK(run.simulation.left_out().repeats == 4);
}

TEST_CASE("a box that rests goes when it is pushed, and is asked about anew where it rests then", "[left_out]") {
  const std::string method = GENERATE("ap", "convex", "coulomb");
  const Stepping stepping = GENERATE(Stepping::events, Stepping::steps);
  CAPTURE(method, stepping);
  // 0.102 m/s at 0.06 s, which 0.021 s take away again.
  const auto go = [](Scenario& scenario) { push(scenario, 10); };
  for (const int steps : {45, 60, 70, 100}) {
    INFO(steps << " steps");
    const Resting less = cube(method.c_str(), true, stepping, steps, go),
                  all = cube(method.c_str(), false, stepping, steps, go);
    for (int i = 0; i < 3; ++i) CHECK(less.state.pose[0].p[i] == Approx(all.state.pose[0].p[i]).margin(1e-13));
    for (int i = 0; i < 6; ++i) CHECK(less.state.v[i] == Approx(all.state.v[i]).margin(1e-13));
    const long repeats = less.repeats;
    CHECK(repeats == (steps == 100 ? 39 + 18 : 39));
  }
  // One that friction holds is another event while it lasts: asked about at its first step and at the first after it.
  const auto lean = [](Scenario& scenario) { push(scenario, 1); };
  const Resting held = cube(method.c_str(), true, stepping, 100, lean);
  CHECK(held.repeats == 100 - 3);
  CHECK(held.state.pose[0].p.x() == 0);
}

TEST_CASE("what rests beside another that is pressed is asked about by its own law", "[left_out]") {
  const Stepping stepping = GENERATE(Stepping::events, Stepping::steps);
  CAPTURE(stepping);
  const Scenario scenario = load_scenario(TEST_DATA "/scenes/pressed_one_by_one.xml", {});
  SimulationOptions options;
  options.step = scenario.step;
  options.stepping = stepping;
  options.prune.repeats = true;
  PrunedRun run(scenario, options, *find_method("convex"), {}, true);
  for (int i = 0; i < 80; ++i) CHECK(run.simulation.step().status == Status::ok);
  CHECK(run.simulation.left_out().repeats == 2 * 29);
  const std::vector<double>& v = run.simulation.state().v;
  for (int i = 0; i < 6; ++i) CHECK(v[i] == 0);
  CHECK(v[6] == Approx(0.03));
}

TEST_CASE("a wall at rest is not solved again while a ball flies towards it", "[left_out]") {
  const Scenario scenario = load_scenario(SOURCE_ROOT "/scenarios/brick_wall.xml", {{"bricks", "20"}});
  std::array<State, 2> end;
  for (const bool rest : {false, true}) {
    SimulationOptions options;
    options.step = scenario.step;
    options.prune.repeats = rest;
    PrunedRun run(scenario, options, *find_method("coulomb"), {}, true);
    for (int i = 0; i < 90; ++i) CHECK(run.simulation.step().status == Status::ok);
    CHECK(run.simulation.left_out().repeats == 0);  // the ball does not rest
    CHECK(run.left_out->repeats == (rest ? 90 - 2 : 0));
    end[rest ? 1 : 0] = run.simulation.state();
  }
  for (std::size_t i = 0; i < end[0].pose.size(); ++i) CHECK((end[0].pose[i].p - end[1].pose[i].p).norm() < 1e-13);
}

TEST_CASE("a box that turns about its middle does not rest", "[left_out]") {
  const auto turn = [](Scenario& scenario) { scenario.initial.v[4] = 2; };
  const Resting less = cube("coulomb", true, Stepping::events, 20, turn),
                all = cube("coulomb", false, Stepping::events, 20, turn);
  CHECK(less.repeats == 0);
  CHECK(less.state.v[4] > 1);
  CHECK(less.state.v[4] == Approx(all.state.v[4]).epsilon(1e-12));
}

// Forces that friction falls short of by 1e-9 of the box's weight: 1e-11 m/s in a step of 1e-3 s.
TEST_CASE("what hardly moves is not put at rest", "[left_out]") {
  const auto creep = [](Scenario& scenario) {
    push(scenario, 0.5 * 9.8 * (1 + 2e-9));
    scenario.forces[0].from = 0;
  };
  for (const bool rest : {false, true}) {
    const Resting crept = cube("coulomb", rest, Stepping::events, 50, creep);
    CHECK(crept.repeats == 0);
    CHECK(crept.state.v[0] == Approx(9.8e-9 * 0.05).epsilon(1e-3));
  }
}

TEST_CASE("a patch that has spun needs its corners alone again once it rests", "[left_out]") {
  const std::array<double, 6> spin = {0, 0, 0, 0, 0.03, 0};  // friction takes 0.005 to 0.015 rad/s a step
  const Outcome all = after("ap", false, 4, spin), less = after("ap", true, 4, spin);
  same(all, less);
  CHECK(std::abs(less.v[4]) < 1e-12);
  CHECK(count(less, "coplanar contacts") >= 10 * (16 - 4));
  CHECK(count(less, "coplanar contacts") < 20 * (16 - 4));
}

// Without friction it slides at 1 m/s, and begins each step with the same velocity to the last bit.
TEST_CASE("a ball that rested on a table, and is pushed, falls where the table ends", "[left_out]") {
  const Stepping stepping = GENERATE(Stepping::events, Stepping::steps);
  CAPTURE(stepping);
  Scenario scenario = test::empty_scene(0.01, 0.5);
  Shape table;
  table.kind = ShapeKind::box;
  table.name = "table";
  table.half_extents = Vec3(0.0625, 0.125, 0.0625);
  scenario.shapes.push_back(table);
  test::add_sphere(scenario, 0.125, 1, {0, 0.25, 0});
  test::collide_all(scenario, 0);
  scenario.forces.push_back({0, {100, 0, 0}, 0.02, 0.03});
  SimulationOptions options;
  options.step = scenario.step;
  options.duration = scenario.duration;
  options.stepping = stepping;
  options.prune.repeats = true;
  Simulation simulation(scenario, options, find_method("newton")->make({}), newton_law());
  while (!simulation.done()) REQUIRE(simulation.step().status == Status::ok);
  CHECK(simulation.left_out().repeats == 1);
  CHECK(simulation.state().pose[0].p.x() > 0.4);
  CHECK(simulation.state().pose[0].p.y() < 0);
}
