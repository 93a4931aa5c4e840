#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <memory>
#include <random>
#include <string>

#include "contact/problem_files.h"
#include "contact/referee.h"
#include "methods/registry.h"
#include "methods/same_event.h"
#include "problems.h"

using namespace cb;
using namespace cb::test;

namespace {

/// A method with and without warm start, given the same events one after the other; the referee judges both.
struct Pair {
  explicit Pair(const std::string& name) : row(*find_method(name)) {
    MethodOptions options;
    if (!row.solvers.empty()) options.solver = row.solvers.front().name;
    cold = row.make(options);
    options.warm_start = true;
    options.warm_starts = accepted;
    warm = row.make(options);
  }
  void meets(const ContactProblem& problem) {
    std::vector<double> a, b;
    cold(problem, solution);
    REQUIRE(solution.status == Status::ok);
    referee.check(problem, solution, row.law, a);
    warm(problem, solution);
    CHECK(solution.status == Status::ok);
    CHECK(Referee::holds(referee.check(problem, solution, row.law, b), 1e-9));
    for (std::size_t i = 0; i < a.size(); ++i) CHECK(b[i] == Approx(a[i]).margin(1e-10));
  }
  const MethodRow& row;
  std::shared_ptr<Counter> accepted = std::make_shared<Counter>(0);
  ContactMethod cold, warm;
  ContactSolution solution;
  Referee referee;
};

// Every box of a stack falls for a step of 1 ms; the uppermost is pushed along x.
ContactProblem pushed_stack(int boxes, double mu, double push) {
  ContactProblem p = stack(boxes, mu, {0, -0.0098, 0});
  p.v_minus[6 * (boxes - 1)] = push;
  return p;
}

ContactProblem moving_sphere(double mu, double vx, double vy) { return sphere({vx, vy, 0}, {0, 0, 0}, mu); }

/// Of three events, one after another, the second goes on from the first, and the third, in which a slip
/// ends, from none: what held before does not hold there.
void last_begins_cold(const std::array<ContactProblem, 3>& events) {
  MethodOptions options;
  options.warm_start = true;
  options.warm_starts = std::make_shared<Counter>(0);
  const ContactMethod ap = find_method("ap")->make(options);
  ContactSolution solution;
  for (std::size_t i = 0; i < 3; ++i) {
    ap(events[i], solution);
    CHECK(solution.status == Status::ok);
    CHECK(*options.warm_starts == (i > 0 ? 1 : 0));
  }
}

}  // namespace

TEST_CASE("a box that goes on sliding starts warm and slides as it does from a cold start", "[warm_start]") {
  for (const char* name : {"ap", "convex", "soft"})
    for (const int boxes : {1, 3, 8}) {  // 8: beyond the dense kernel of ap
      Pair pair(name);
      for (int step = 0; step < 10; ++step) pair.meets(pushed_stack(boxes, 0.3, 1 + 0.01 * step));
      INFO(name << ", " << boxes << " boxes");
      CHECK(*pair.accepted == 9);
    }
}

TEST_CASE("a warm start gives way where the box changes from rest to slip and back", "[warm_start]") {
  for (const char* name : {"ap", "convex", "soft"})
    for (const int boxes : {1, 3}) {
      Pair pair(name);
      for (const double push : {0.0, 1.0, 1e-5, 1.0, -1.0, 0.0}) pair.meets(pushed_stack(boxes, 0.3, push));
    }
}

TEST_CASE("a warm start gives way where the box that lay still bounces", "[warm_start]") {
  for (const char* name : {"ap", "convex"})
    for (const int boxes : {1, 3}) {
      INFO(name << ", " << boxes << " boxes");
      Pair pair(name);
      for (const double e : {0.0, 0.0, 0.5, 0.0, 0.5}) {
        ContactProblem p = pushed_stack(boxes, 0.3, 0);
        std::fill(p.restitution.begin(), p.restitution.end(), e);
        pair.meets(p);
      }
    }
}

TEST_CASE("events of other sizes between leave nothing behind", "[warm_start]") {
  for (const char* name : {"ap", "convex", "soft"}) {
    Pair pair(name);
    for (const int boxes : {2, 1, 2, 3, 1}) pair.meets(pushed_stack(boxes, 0.3, 1));
  }
}

TEST_CASE("a box that lies still starts warm with ap and stays", "[warm_start]") {
  Pair pair("ap");
  for (int step = 0; step < 5; ++step) pair.meets(pushed_stack(1, 0.5, 1e-4));
  CHECK(*pair.accepted == 4);
}

TEST_CASE("boxes that friction holds by two corners of four, the others on ice, start warm with ap", "[warm_start]") {
  for (const int boxes : {1, 4, 8}) {
    Pair pair("ap");
    for (int step = 0; step < 8; ++step) {
      ContactProblem p = turn_tangents(pushed_stack(boxes, 0.5, 1e-4 + 1e-6 * step), 0.3);
      for (int c = 0; c < p.nc(); c += 4) p.mu[c] = p.mu[c + 3] = 0;
      for (int b = 0; b < boxes; ++b) p.v_minus[6 * b + 2] = 1e-5 * (b + 1), p.v_minus[6 * b + 4] = 1e-5;
      pair.meets(p);
    }
    INFO(boxes << " boxes");
    CHECK(*pair.accepted == 7);
  }
}

TEST_CASE("a box on a ramp sticks with a warm start as without", "[warm_start]") {
  for (const char* name : {"ap", "convex", "soft"})
    for (const double turn : {0.0, 0.3}) {
      Pair pair(name);
      ContactProblem p = turn_tangents(stack(1, 0.7), turn);
      for (int step = 0; step < 5; ++step) {
        p.v_minus[0] = 0.0049;
        p.v_minus[1] = -0.0085 - 1e-7 * step;
        pair.meets(p);
      }
      if (pair.row.law == anitescu_potra_law()) CHECK(*pair.accepted == 4);
    }
}

TEST_CASE("a stack at rest starts warm at every event, whatever rounding does to its velocities", "[warm_start]") {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> noise(-1e-15, 1e-15);
  for (const char* name : {"ap", "convex", "soft"})
    for (const int boxes : {1, 4, 12}) {
      Pair pair(name);
      for (int step = 0; step < 8; ++step) {
        ContactProblem p = pushed_stack(boxes, 0.5, 0);
        for (double& v : p.v_minus) v += noise(random);
        pair.meets(p);
      }
      INFO(name << ", " << boxes << " boxes");
      CHECK(*pair.accepted == 7);
    }
}

// The impulses of the event before would hold it, but for friction.
TEST_CASE("a box at rest that is pushed too hard slides at once", "[warm_start]") {
  for (const char* name : {"ap", "convex", "soft"}) {
    Pair pair(name);
    for (const double push : {0.0, 0.0, 2e-3, 6e-3, 0.0}) pair.meets(pushed_stack(1, 0.5, push));
    // So little friction that it is no matter of who carries what: each corner holds more than it may.
    for (const double push : {0.0, 0.0, 1e-3, 2.5e-3, 0.0}) pair.meets(pushed_stack(1, 0.2, push));
  }
}

TEST_CASE("an event that is the one before gets its answer to the last bit", "[warm_start]") {
  for (const char* name : {"ap", "convex", "soft"}) {
    const MethodRow& row = *find_method(name);
    MethodOptions options;
    options.warm_start = true;
    options.warm_starts = std::make_shared<Counter>(0);
    const ContactMethod method = row.make(options);
    ContactSolution first, second, third;
    ContactProblem p = pushed_stack(3, 0.3, 1);
    method(p, first);
    method(p, second);
    CHECK(first.impulse == second.impulse);
    CHECK(second.iterations == 0);
    CHECK(*options.warm_starts == 1);
    p.v_minus[1] *= 1 + 1e-12;  // another event
    method(p, third);
    CHECK(third.impulse != first.impulse);
  }
}

TEST_CASE("a slip that ends a millionth early is not taken for one that goes on", "[warm_start]") {
  // A sphere slides on after friction has taken 3.5 mu v_n of its slip; at less slip than that it rolls.
  const double v_n = 0.5, mu = 0.2, ends = 3.5 * mu * v_n;
  for (const double part : {1e-3, 1e-6, 1e-8}) {
    Pair pair("ap");
    pair.meets(moving_sphere(mu, 2 * ends, -v_n));
    pair.meets(moving_sphere(mu, ends * (1 - part), -v_n));
    CHECK(*pair.accepted == 0);
  }
}

// 0.1 g on 10 t that slide at 1 m/s on ice, both falling: friction can take more of its slip than there is, by 4e-9
// m/s. What the active set of a slip makes of that is all that moves it, and 1e-12 of what the event is about.
TEST_CASE("a slip that ends is seen beside something heavy", "[warm_start]") {
  const double heavy = 1e4, light = 1e-4, v_n = 1e-3, mu = 0.5, taken = 2 * mu * v_n;
  const auto slides = [&](double slip) {
    ContactProblem p;
    add_body(p, heavy, Vector3d::Constant(0.4 * heavy), {1, -v_n, 0});
    add_body(p, light, Vector3d::Constant(0.4 * light), {1 + slip, -2 * v_n, 0});
    add_contact(p, 0, {0, -1, 0}, -1, {}, ground_axes(), 0);
    add_contact(p, 1, {0, 0, 0}, 0, {0, 1, 0}, ground_axes(), mu);
    return p;
  };
  last_begins_cold({slides(10 * taken), slides(9 * taken), slides(taken * (1 - 4e-6))});
}

// Two spheres that no contact joins. Of one friction can take more of its slip than there is, by 7e-10 m/s; the other
// slides on at 2 km/s, beside which that is nothing.
TEST_CASE("a slip that ends is seen beside an island that is fast", "[warm_start]") {
  const double v_n = 0.5, mu = 0.2, ends = 3.5 * mu * v_n;
  const auto slide = [&](double slip, double fast) {
    ContactProblem p = moving_sphere(mu, slip, -v_n);
    const double m = p.M.block(0)(0, 0);
    add_body(p, m, Vector3d::Constant(0.4 * m), {fast, -v_n, 0});
    add_contact(p, 1, {0, -1, 0}, -1, {}, ground_axes(), mu);
    return p;
  };
  const double first = 10 * ends, second = 9 * ends;
  last_begins_cold({slide(first, 2000 + first), slide(second, 2000 + second), slide(ends * (1 - 2e-9), 2000)});
}

TEST_CASE("an event is the one before up to its last bits alone", "[warm_start]") {
  int solved = 0;
  const auto reused = std::make_shared<Counter>(0);
  const ContactMethod once = reuse_same_event(
      [&](const ContactProblem&, ContactSolution& solution) {
        solution.clear();
        ++solved;
      },
      reused);
  const ContactProblem first = moving_sphere(0.2, 1, -0.5);
  const auto again = [&](const auto& change) {
    ContactSolution solution;
    once(first, solution);
    const long before = *reused;
    ContactProblem p = first;
    change(p);
    once(p, solution);
    return *reused - before == 1;
  };
  constexpr double last_bit = 4e-16, more = 1e-12;
  CHECK(again([](ContactProblem&) {}));
  for (const double change : {last_bit, more}) {
    INFO(change);
    CHECK(again([&](ContactProblem& p) { p.M.block(0)(0, 0) *= 1 + change; }) == (change == last_bit));
    CHECK(again([&](ContactProblem& p) { p.M.block(0)(4, 4) *= 1 + change; }) == (change == last_bit));
    CHECK(again([&](ContactProblem& p) { p.J.entry(0)(0, 1) *= 1 + change; }) == (change == last_bit));
    CHECK(again([&](ContactProblem& p) { p.J.entry(0)(1, 5) *= 1 + change; }) == (change == last_bit));
    CHECK(again([&](ContactProblem& p) { p.v_minus[1] *= 1 + change; }) == (change == last_bit));
  }
  CHECK_FALSE(again([](ContactProblem& p) { p.mu[0] *= 1 + last_bit; }));
  CHECK_FALSE(again([](ContactProblem& p) { p.restitution[0] = 1e-300; }));
  CHECK_FALSE(again([](ContactProblem& p) { p.offset[2] = 1e-300; }));
  // A corner of the third box on the first.
  const ContactProblem three = stack(3, 0.5, {0, -0.0098, 0});
  ContactProblem joined = three;
  joined.J.block[joined.J.band[8]] = 0;
  ContactSolution solution;
  once(three, solution);
  const long before = *reused;
  once(joined, solution);
  CHECK(*reused == before);
  once(joined, solution);
  CHECK(*reused == before + 1);
  CHECK(solved > 0);
}

TEST_CASE("of what moves from event to event none is kept, of what comes to rest its second", "[warm_start]") {
  const auto reused = std::make_shared<Counter>(0);
  const ContactMethod once =
      reuse_same_event([](const ContactProblem&, ContactSolution& solution) { solution.clear(); }, reused);
  const auto is_reused = [&](double vx) {
    ContactSolution solution;
    const long before = *reused;
    once(moving_sphere(0.2, vx, -0.5), solution);
    return *reused > before;
  };
  CHECK_FALSE(is_reused(1));
  CHECK(is_reused(1));
  CHECK_FALSE(is_reused(0.9));
  CHECK_FALSE(is_reused(0.8));
  CHECK_FALSE(is_reused(0.8));
  CHECK(is_reused(0.8));
  CHECK_FALSE(is_reused(0.8 + 1e-8));  // as good as at rest
  CHECK(is_reused(0.8 + 1e-8));
}

// A body slides on two points; then both are the same point, and the matrix of those that carried is singular: to the
// last bit, as all numbers are sums of powers of two.
TEST_CASE("contacts that carried each its share and are redundant now get a cold start", "[warm_start]") {
  const auto on_points = [](double arm) {
    ContactProblem p;
    add_body(p, 1, {0.25, 0.25, 0.25}, {3, -1, 0});
    for (const double x : {-arm, arm}) add_contact(p, 0, {x, -0.5, 0}, -1, {}, ground_axes(), 0.5);
    return p;
  };
  Pair ap("ap");
  ap.meets(on_points(0.5));
  ap.meets(on_points(0));
  CHECK(*ap.accepted == 0);
}

// Events that cascade and nsgs answer, and do not answer from the impulses of what went before.
TEST_CASE("a start that leads astray costs coulomb no answer", "[warm_start]") {
  if (!fclib_available()) {
    WARN(fclib_unavailable_reason());
    return;
  }
  for (const char* name : {"grasp_n1_mu1_grip2", "gen_mixmu_b3_c6_s3", "gen_squeeze_b1_c8_s1"}) {
    const ContactProblem event = read_contact_problem(TEST_DATA "/problems/" + std::string(name) + ".hdf5").problem;
    for (const double faster : {1e6, 1.5})
      for (const char* solver : {"newton", "nsgs", "admm", "cascade"}) {
        INFO(name << " by " << solver << ", after an event " << faster << " times as fast");
        ContactProblem before = event;
        for (double& v : before.v_minus) v *= faster;
        MethodOptions options;
        options.solver = solver;
        ContactSolution cold, warm;
        find_method("coulomb")->make(options)(event, cold);
        options.warm_start = true;
        const ContactMethod method = find_method("coulomb")->make(options);
        method(before, warm);
        method(event, warm);
        CHECK(warm.status <= cold.status);
      }
  }
}

TEST_CASE("coulomb begins with the event before, and not with one before an event with restitution", "[warm_start]") {
  MethodOptions options;
  options.warm_start = true;
  options.warm_starts = std::make_shared<Counter>(0);
  const ContactMethod method = find_method("coulomb")->make(options);
  ContactSolution solution;
  const auto meets = [&](double slip, double e) {
    ContactProblem p = moving_sphere(0.2, slip, -0.5);
    p.restitution[0] = e;
    method(p, solution);
    CHECK(solution.status == Status::ok);
    return *options.warm_starts == 1;
  };
  CHECK_FALSE(meets(2, 0));
  CHECK_FALSE(meets(1.9, 0.5));
  CHECK_FALSE(meets(1.8, 0));
  CHECK(meets(1.7, 0));
}

// Rest is that of the contacts: on a belt that goes on with the box, and not on one that goes on below it.
TEST_CASE("a box that goes with its belt starts warm as one at rest does, and a belt that sets out is seen",
          "[warm_start]") {
  for (const char* name : {"ap", "convex"}) {
    INFO(name);
    Pair pair(name);
    const auto on_belt = [](double box_speed, double belt_speed, double fall) {
      ContactProblem p = stack(1, 0.5, {box_speed, -fall, 0});
      for (int c = 0; c < 4; ++c) p.offset[3 * c + 1] = -belt_speed;
      return p;
    };
    for (int step = 0; step < 5; ++step) pair.meets(on_belt(0.3, 0.3, 0.0098 + 1e-15 * step));
    CHECK(*pair.accepted == 4);
    pair.meets(on_belt(0.3, 0.5, 0.0098));
    pair.meets(on_belt(0.3, 0.3, 0.0098));
    pair.meets(on_belt(0, 0.5, 0.0098));
  }
}
