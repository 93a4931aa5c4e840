// What becomes of the parts of an event in the whole: sums, the worst, and what is counted as left out.

#include <catch2/catch.hpp>
#include <cmath>
#include <memory>

#include "contact/referee.h"
#include "methods/pruned.h"
#include "problems.h"

using namespace cb;
using namespace cb::test;

namespace {

/// What a method says of the island whose body has this mass.
struct Said {
  double mass;
  Status status;
  const char* reason;
  int iterations, size;
  double claimed, scale;
};

/// A method that says so, of a law whose claims add up or do not.
MethodRow says(const std::vector<Said>& all, bool add_up, int& calls) {
  MethodRow row;
  row.name = "says";
  row.law = newton_law();
  row.law.claims_add_up = add_up;
  row.make = [&all, &calls](const MethodOptions&) -> ContactMethod {
    return [&all, &calls](const ContactProblem& p, ContactSolution& out) {
      ++calls;
      out.clear();
      out.impulse.assign(3 * static_cast<std::size_t>(p.nc()), p.M.block(0)(0, 0));
      for (const Said& said : all)
        if (said.mass == p.M.block(0)(0, 0)) {
          out.status = said.status;
          out.reason = said.reason;
          out.iterations = said.iterations;
          out.size = said.size;
          out.claimed_residual = said.claimed;
          out.restitution_scale = said.scale;
        }
    };
  };
  return row;
}

/// Balls of these masses on the ground; the contacts of each in turn: two a ball.
ContactProblem balls(const std::vector<double>& masses) {
  ContactProblem p;
  for (const double m : masses) add_body(p, m, Vector3d::Constant(0.4 * m), {0, -1, 0});
  for (const double x : {-0.1, 0.1})
    for (std::size_t b = 0; b < masses.size(); ++b)
      add_contact(p, static_cast<int>(b), {x, -1, 0}, -1, {}, ground_axes(), 0.5);
  return p;
}

}  // namespace

TEST_CASE("of islands solved apart iterations and sizes add up, the worst ending counts, and claims as the law says",
          "[pruned]") {
  const std::vector<Said> all = {{1, Status::inaccurate, "the first", 3, 10, 0.25, 0.75},
                                 {2, Status::ray, "the second", 5, 20, 0.0625, 0.5},
                                 {3, Status::nonconverged, "the third", 7, 40, 0.125, 1}};
  for (const bool add_up : {true, false}) {
    int calls = 0;
    const MethodRow row = says(all, add_up, calls);
    for (const std::vector<double>& order : {std::vector<double>{1, 2, 3}, {3, 2, 1}, {2, 3, 1}}) {
      const auto left_out = std::make_shared<LeftOut>();
      ContactSolution whole;
      calls = 0;
      pruned(row, {}, left_out)(balls(order), whole);
      CHECK(calls == 3);
      CHECK(whole.iterations == 15);
      CHECK(whole.size == 70);
      CHECK(whole.status == Status::ray);
      CHECK(whole.reason == "the second");
      CHECK(whole.claimed_residual == (add_up ? 0.4375 : 0.25));
      CHECK(whole.restitution_scale == 0.5);
      for (std::size_t c = 0; c < 6; ++c)
        for (std::size_t i = 0; i < 3; ++i) CHECK(whole.impulse[3 * c + i] == order[c % 3]);
      CHECK(left_out->islands == 3);
      CHECK(left_out->closed_forms == 0);
      CHECK(left_out->repeats == 0);
      REQUIRE(left_out->failed.has_value());  // the last that failed, as it was handed over
      const double last = order[2] == 1 ? order[1] : order[2];
      CHECK(left_out->failed->M.block(0)(0, 0) == last);
      CHECK(left_out->failed->nc() == 2);
    }
  }
}

TEST_CASE("where nothing failed nothing is kept of an event, and what goes on with doubts has not failed", "[pruned]") {
  const std::vector<Said> all = {{1, Status::inaccurate, "doubts", 3, 10, 0.25, 1}, {2, Status::ok, "", 5, 20, 0, 1}};
  int calls = 0;
  const MethodRow row = says(all, false, calls);
  const auto left_out = std::make_shared<LeftOut>();
  left_out->failed = balls({1});
  ContactSolution whole;
  pruned(row, {}, left_out)(balls({1, 2}), whole);
  CHECK(whole.status == Status::inaccurate);
  CHECK(whole.reason == "doubts");
  CHECK_FALSE(left_out->failed.has_value());
  // A lone island is the event itself, and is no island that was parted.
  pruned(row, {}, left_out)(balls({2}), whole);
  CHECK(whole.iterations == 5);
  CHECK(left_out->islands == 2);
  PruneOptions together;
  together.islands = false;
  calls = 0;
  pruned(row, {}, left_out, together)(balls({2, 1}), whole);
  CHECK(calls == 1);
  CHECK(left_out->islands == 2);
}

TEST_CASE("what is left out of one event after the other adds up", "[pruned]") {
  ContactProblem two;  // balls apart, each alone with its contact
  for (const int b : {0, 1}) {
    add_body(two, 1, Vector3d::Constant(0.4), {1, -1, 0});
    add_contact(two, b, {0, -1, 0}, -1, {}, ground_axes(), 0.5);
  }
  const auto left_out = std::make_shared<LeftOut>();
  const ContactMethod method = pruned(*find_method("ap"), {}, left_out);
  ContactSolution solution;
  for (long event = 1; event <= 3; ++event) {
    method(two, solution);
    CHECK(solution.status == Status::ok);
    CHECK(left_out->islands == 2 * event);
    CHECK(left_out->closed_forms == 2 * event);
  }
}

TEST_CASE("items of what was left out have their own counts and names", "[pruned]") {
  LeftOut left_out;
  left_out.islands = 11;
  left_out.closed_forms = 12;
  left_out.idle_friction = 13;
  left_out.repeats = 14;
  const std::vector<LeftOutItem> all = items(left_out);
  const std::pair<const char*, long> expected[] = {
      {"islands", 11}, {"closed form", 12}, {"friction", 13}, {"rest", 14}};
  REQUIRE(all.size() == std::size(expected));
  for (std::size_t i = 0; i < all.size(); ++i) {
    CHECK_THAT(std::string(all[i].name), Catch::Contains(expected[i].first));
    CHECK(all[i].count == expected[i].second);
    CHECK_FALSE(all[i].why.empty());
  }
}

// A ball of radius 1: 3.5 times as easily moved along the ground as off it.
TEST_CASE("a lone ball's answer by exact friction is its formula, on ground that moves and in any direction",
          "[pruned]") {
  const MethodRow& row = *find_method("coulomb");
  for (const double mu : {0.0, 0.1, 5.0})
    for (int i = 0; i < 12; ++i) {
      const double angle = 2 * M_PI * i / 12;
      INFO(mu << ", " << angle);
      ContactProblem p = sphere({2 * std::cos(angle), -3, 2 * std::sin(angle)}, {0.5, 1, -0.25}, mu);
      p.offset = {-0.5, 0.25, 0.125};
      const auto left_out = std::make_shared<LeftOut>();
      ContactSolution lone, solved;
      pruned(row, {}, left_out)(p, lone);
      row.make({})(p, solved);
      CHECK(left_out->closed_forms == 1);
      CHECK(left_out->islands == 0);
      CHECK(lone.status == Status::ok);
      CHECK(lone.iterations == 0);
      CHECK(lone.size == 3);
      std::vector<double> u;
      contact_velocity(p, p.v_minus, u);
      const double m = 4. / 3 * M_PI, r_n = -u[0] * m, stick = std::hypot(u[1], u[2]) * m / 3.5;
      CHECK(lone.impulse[0] == Approx(r_n));
      CHECK(std::hypot(lone.impulse[1], lone.impulse[2]) == Approx(std::min(stick, mu * r_n)).margin(1e-14));
      CHECK(lone.impulse[1] * u[1] + lone.impulse[2] * u[2] <= 0);
      for (int k = 0; k < 3; ++k) CHECK(lone.impulse[k] == Approx(solved.impulse[k]).margin(1e-10));
    }
}

// W_nt1 = 0.12 / I_z with W_t1 = W_t2, or turned so that it is W_nt2; moments that differ along t1 and t2, or turned by
// 45 degrees couple them.
TEST_CASE("a lone contact has no formula where any two of its directions couple or differ, or where it bounces",
          "[pruned]") {
  struct Case {
    const char* what;
    Vector3d inertia, arm;
    double turn, e;
    long closed;
  };
  const Vector3d even(0.2, 0.2, 0.2), leaning(0.2, 0.2, 0.072), long_one(0.1, 0.2, 0.3), below(0, -1, 0),
      aside(0.4, -0.3, 0);
  for (const Case& known :
       {Case{"a ball", even, below, 0.3, 0, 1}, Case{"n and t1", leaning, aside, 0, 0, 0},
        Case{"n and t2", leaning, aside, M_PI / 2, 0, 0}, Case{"t1 and t2", long_one, below, M_PI / 4, 0, 0},
        Case{"t1 and t2 differ", long_one, below, 0, 0, 0}, Case{"it bounces", even, below, 0.3, 0.5, 0}}) {
    ContactProblem p;
    add_body(p, 1, known.inertia, {1, -2, 0.5});
    add_contact(p, 0, known.arm, -1, {}, ground_axes(known.turn), 0.5, known.e);
    for (const char* method : {"ap", "convex", "coulomb", "soft"}) {
      INFO(known.what << ": " << method);
      const MethodRow& row = *find_method(method);
      const auto left_out = std::make_shared<LeftOut>();
      ContactSolution solution;
      pruned(row, {}, left_out)(p, solution);
      CHECK(left_out->closed_forms == known.closed);
      CHECK(solution.status == Status::ok);
      std::vector<double> v_plus;
      CHECK(Referee::holds(Referee().check(p, solution, row.law, v_plus), 1e-9));
    }
  }
}

// Two boxes that slide at 0.05 m/s: an epsilon of 1e-2 J lets each go on without friction, which leaves mu v g h =
// 4.9e-5 J (drumwright_shell.cpp). And a stack that a sweep does not answer, before a sphere that it does.
TEST_CASE("what methods claim that part islands themselves is the sum of gaps, or the worst island's residual",
          "[pruned]") {
  ContactProblem boxes;
  for (int b = 0; b < 2; ++b) {
    add_body(boxes, 1, Vector3d::Constant(1. / 6), {0.05, -0.0098, 0});
    for (const double x : {-0.5, 0.5})
      for (const double z : {-0.5, 0.5}) add_contact(boxes, b, {x, -0.5, z}, -1, {}, ground_axes(), 0.1);
  }
  MethodOptions options;
  options.epsilon = 1e-2;
  ContactSolution solution;
  find_method("convex")->make(options)(boxes, solution);
  CHECK(solution.status == Status::ok);
  CHECK(solution.claimed_residual == Approx(2 * 4.9e-5).epsilon(1e-6));

  const ContactProblem alone = stack(2, 0.5, {0.3, -1, 0.1});
  ContactProblem beside = alone;
  const double m = 4. / 3 * M_PI;
  const int ball = add_body(beside, m, Vector3d::Constant(0.4 * m), {0, -1, 0});
  add_contact(beside, ball, {0, -1, 0}, -1, {}, ground_axes(), 0.5);
  options.solver = "nsgs";
  options.sweeps = 1;
  ContactSolution first;
  find_method("coulomb")->make(options)(alone, first);
  find_method("coulomb")->make(options)(beside, solution);
  CHECK(first.status == Status::inaccurate);
  CHECK(first.claimed_residual > 1e-6);
  CHECK(solution.status == Status::inaccurate);
  CHECK(solution.claimed_residual == Approx(first.claimed_residual));
}

TEST_CASE("islands that are to be solved together are, though each of them has a closed form", "[pruned]") {
  ContactProblem p = sphere({1, -2, 0}, {0, 0, 0});
  add_body(p, 3, Vector3d::Constant(1.2), {0, -1, 5});
  add_contact(p, 1, {0, -1, 0}, -1, {}, ground_axes(), 0.3);
  for (const bool apart : {true, false}) {
    const auto left_out = std::make_shared<LeftOut>();
    ContactSolution s;
    pruned(*find_method("coulomb"), {}, left_out, {.islands = apart})(p, s);
    CHECK(s.status == Status::ok);
    CHECK(left_out->islands == (apart ? 2 : 0));
    CHECK(left_out->closed_forms == (apart ? 2 : 0));
  }
}

TEST_CASE("what is no problem for a method is none for a closed form either", "[pruned]") {
  const double no_number = std::nan("");
  for (const char* name : {"convex", "coulomb", "soft"})
    for (int part = 0; part < 7; ++part) {
      INFO(name << ", part " << part);
      ContactProblem p = sphere({1, -2, 0}, {0, 0, 0});
      if (part < 3) p.mu[0] = part == 0 ? -0.1 : part == 1 ? HUGE_VAL : no_number;
      if (part == 3) p.v_minus[1] = no_number;
      if (part == 4) p.v_minus[1] = -HUGE_VAL;
      if (part == 5) p.restitution[0] = no_number;
      if (part == 6) p.M.block(0)(0, 0) = -1;
      const MethodRow& row = *find_method(name);
      ContactSolution plain, less;
      row.make({})(p, plain);
      pruned(row, {}, std::make_shared<LeftOut>())(p, less);
      CHECK(plain.status != Status::ok);
      CHECK(less.status == plain.status);
      CHECK(less.reason == plain.reason);
      CHECK(less.impulse == std::vector<double>(3, 0.0));
    }
}
