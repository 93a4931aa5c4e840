// Every row of the methods table, with each of its solvers and variants, on the same ten small problems: what the
// contract of a method promises (docs/adding.md) holds for all of them.

#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "contact/referee.h"
#include "linalg/stop.h"
#include "methods/choices.h"
#include "problems.h"

using namespace cb;
using namespace cb::test;

namespace {

struct Case {
  const char* name;
  ContactProblem problem;
};

ContactProblem twice(double mu) {
  ContactProblem p = sphere({1, -1, 0}, {0, 0, 0}, mu);
  add_contact(p, 0, {0, -1, 0}, -1, {}, ground_axes(), mu);
  return p;
}

/// A ball of 1 kg in a groove with sides at 45 degrees.
ContactProblem groove(double mu) {
  ContactProblem p;
  add_body(p, 1, Vector3d::Constant(0.4), {0.1, -1, 0.3});
  for (const double side : {-1.0, 1.0}) {
    const Vector3d n = Vector3d(-side, 1, 0).normalized(), t1 = Vector3d(1, side, 0).normalized();
    Matrix3d axes;
    axes << n.transpose(), t1.transpose(), n.cross(t1).transpose();
    add_contact(p, 0, -n, -1, {}, axes, mu);
  }
  return p;
}

ContactProblem pair_of_balls(double light, double heavy) {
  ContactProblem p;
  add_body(p, heavy, Vector3d::Constant(0.4 * heavy), {0, 0, 0});
  add_body(p, light, Vector3d::Constant(0.4 * light), {0.2, -1, 0});
  add_contact(p, 1, {0, -1, 0}, 0, {0, 1, 0}, ground_axes(), 0.3);
  return p;
}

std::vector<Case> cases() {
  return {{"a sphere sticks", sphere({1, -10, 0}, {0, 0, 0})},
          {"a sphere slides", sphere({20, -3, 0}, {0, 0, 0})},
          {"a sphere leaves", sphere({1, 2, 0}, {0, 0, 0})},
          {"a sphere without friction", sphere({1, -1, 0}, {0, 0, 1}, 0)},
          {"a contact given twice", twice(0.4)},
          {"a ball in a groove", groove(0.2)},
          {"a ball on a ball a thousand times as heavy", pair_of_balls(1, 1000)},
          {"a box comes to rest", box(0.5, {0, -0.0098, 0})},
          {"a box slides", box(0.1, {0.5, -0.0098, 0.2})},
          {"two boxes on each other", stack(2, 0.5, {0, -0.0098, 0})}};
}

/// The same event as seen by who moves at -V: all that moves is faster by V, and the ground with it.
ContactProblem seen_moving(ContactProblem p, const Vector3d& V) {
  std::vector<double> all(p.v_minus.size(), 0.0), u(3 * static_cast<std::size_t>(p.nc()));
  for (std::size_t i = 0; i < all.size(); i += 6)
    for (int k = 0; k < 3; ++k) all[i + k] = V[k];
  multiply(p.J, p.M, all, u);
  for (std::size_t i = 0; i < all.size(); ++i) p.v_minus[i] += all[i];
  for (std::size_t i = 0; i < u.size(); ++i) p.offset[i] -= u[i];
  return p;
}

/// Both side by side, the second's bodies first and their contacts in turn.
ContactProblem in_turn(const ContactProblem& a, const ContactProblem& b) {
  ContactProblem out;
  for (const ContactProblem* p : {&b, &a}) {
    for (int i = 0; i < p->M.blocks(); ++i) out.M.block(out.M.add_block(p->M.block_size(i))) = p->M.block(i);
    out.v_minus.insert(out.v_minus.end(), p->v_minus.begin(), p->v_minus.end());
  }
  for (int c = 0; c < std::max(a.nc(), b.nc()); ++c)
    for (const ContactProblem* p : {&a, &b}) {
      if (c >= p->nc()) continue;
      out.J.add_band();
      for (int e = p->J.band[c]; e < p->J.band[c + 1]; ++e) {
        const int block = p->J.block[e] + (p == &a ? b.M.blocks() : 0);
        out.J.entry(out.J.add_entry(block, static_cast<int>(p->J.entry(e).cols()))) = p->J.entry(e);
      }
      out.offset.insert(out.offset.end(), p->offset.begin() + 3 * c, p->offset.begin() + 3 * c + 3);
      out.mu.push_back(p->mu[c]);
      out.restitution.push_back(p->restitution[c]);
    }
  return out;
}

std::vector<double> velocities_after(const ContactProblem& p, const ContactSolution& solution) {
  BlockCholesky factor;
  REQUIRE(factor.factor(p.M));
  std::vector<double> v;
  apply_impulse(p, factor, solution.impulse, v);
  return v;
}

double largest(const std::vector<double>& x) {
  double size = 0;
  for (const double value : x) size = std::max(size, std::abs(value));
  return size;
}

}  // namespace

TEST_CASE("every method of the table ends ten small problems with an answer that the referee confirms",
          "[conformance]") {
  REQUIRE(choices().size() >= 7);
  for (const Choice& choice : choices()) {
    const ContactMethod method = choice.row->make(choice.options);
    for (const Case& c : cases()) {
      INFO(choice.label << ": " << c.name);
      ContactSolution solution;
      method(c.problem, solution);
      Referee referee;
      std::vector<double> v_plus, u;
      if (choice.options.solver == "pgs") {  // A-P's slip bounds have no diagonal to divide by: typed, not answered
        CHECK(solution.status == Status::singular);
        CHECK_FALSE(solution.reason.empty());
        continue;
      }
      const Residuals residuals = referee.check(c.problem, solution, choice.row->law, v_plus);
      if (choice.options.solver == "bisection" && residuals.model > 1e-9) {  // another law where it slips: said so
        CHECK(solution.status == Status::inaccurate);
        CHECK_FALSE(solution.reason.empty());
        continue;
      }
      CHECK(solution.status == Status::ok);
      CHECK(Referee::holds(residuals, 1e-9));
      if (choice.row->law != soft_law())  // whose contacts give way
        CHECK(residuals.approach <= 1e-9 * (1 + largest(c.problem.v_minus)));
      if (choice.options.variant != "uncapped")  // that reading may gain: spec methods.md
        CHECK(residuals.energy_gain <= 1e-12 * residuals.energy_before);

      // An answer that stops the approach but for a thousandth is refused.
      if (largest(solution.impulse) > 0) {
        ContactSolution wrong = solution;
        for (double& r : wrong.impulse) r *= 0.999;
        if (auto* polygon = std::get_if<PolygonWitness>(&wrong.witness))
          for (double& z : polygon->z) z *= 0.999;
        CHECK_FALSE(Referee::holds(referee.check(c.problem, wrong, choice.row->law, v_plus), 1e-9));
      }
    }
  }
}

// Islands with restitution are answered in two phases, by methods that are not asked island by island, too.
TEST_CASE("an island without restitution moves beside one that has some as it does alone", "[conformance]") {
  for (const Choice& choice : choices()) {
    const ContactMethod method = choice.row->make(choice.options);
    for (const Case& c : cases()) {
      INFO(choice.label << ": " << c.name);
      ContactSolution alone;
      method(c.problem, alone);
      if (alone.status != Status::ok) continue;
      ContactProblem beside = c.problem;
      add_body(beside, 2, Vector3d::Constant(0.8), {0.5, -1, 0});
      add_contact(beside, c.problem.M.blocks(), {0, -1, 0}, -1, {}, ground_axes(), 0.5, 0.5);
      ContactSolution solution;
      method(beside, solution);
      CHECK(solution.status == Status::ok);
      Referee referee;
      std::vector<double> v_alone, v_plus;
      referee.check(c.problem, alone, choice.row->law, v_alone);
      CHECK(Referee::holds(referee.check(beside, solution, choice.row->law, v_plus), 1e-9));
      for (int i = 0; i < c.problem.nv(); ++i)
        CHECK(v_plus[i] == Approx(v_alone[i]).margin(1e-9 * (1 + largest(c.problem.v_minus))));
    }
  }
}

TEST_CASE("a method's answer does not depend on what it solved before", "[conformance]") {
  for (const Choice& choice : choices()) {
    const ContactMethod used = choice.row->make(choice.options);
    ContactSolution again;
    used(stack(3, 0.5, {0.3, -1, 0.1}, 0.5), again);
    for (const Case& c : cases()) {
      INFO(choice.label << ": " << c.name);
      const ContactMethod fresh = choice.row->make(choice.options);
      ContactSolution first;
      fresh(c.problem, first);
      used(c.problem, again);
      CHECK(first.status == again.status);
      CHECK(first.iterations == again.iterations);
      REQUIRE(first.impulse.size() == again.impulse.size());
      if (!first.impulse.empty())
        CHECK(std::memcmp(first.impulse.data(), again.impulse.data(), first.impulse.size() * sizeof(double)) == 0);
    }
  }
}

TEST_CASE("a velocity that is not a number ends in a typed status and no method calls it solved", "[conformance]") {
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    for (const Choice& choice : choices()) {
      INFO(choice.label << " with " << bad);
      ContactProblem p = box(0.5, {0, -1, 0});
      p.v_minus[1] = bad;
      ContactSolution solution;
      choice.row->make(choice.options)(p, solution);
      CHECK(solution.status != Status::ok);
      CHECK(solution.status != Status::inaccurate);
      CHECK_FALSE(solution.reason.empty());
    }
}

TEST_CASE("a stop that is asked for ends an event from within, so that no word of success can follow",
          "[conformance]") {
  struct Ask {
    Ask() { stop_asked = true; }
    ~Ask() { stop_asked = false; }
  };
  for (const Choice& choice : choices()) {
    if (choice.options.solver == "pgs") continue;  // refuses such a problem before it begins
    INFO(choice.label);
    const ContactProblem problem = stack(8, 0.3, {0.02, -1, 0.01}, 0.2);
    const ContactMethod method = choice.row->make(choice.options);
    ContactSolution solution;
    {
      const Ask ask;
      CHECK_THROWS_AS(method(problem, solution), Stopped);
    }
    CHECK_NOTHROW(choice.row->make(choice.options)(problem, solution));
  }
}

TEST_CASE("a method says how many unknowns it handed to its solver") {
  const ContactProblem p = test::box(0.3, {0.5, -0.1, 0});  // four contacts; lands and slides
  const auto size = [&](const char* name, bool bound, int k) {
    MethodOptions options;
    options.compression_bound = bound;
    options.k = k;
    ContactSolution solution;
    find_method(name)->make(options)(p, solution);
    CHECK(solution.status == Status::ok);
    return solution.size;
  };
  CHECK(size("newton", true, 4) == 12);
  CHECK(size("mirtich", true, 4) == 12);
  CHECK(size("coulomb", true, 4) == 12);
  CHECK(size("soft", true, 4) == 6);  // velocities of one body
  CHECK(size("convex", false, 4) == 12);
  CHECK(size("convex", true, 4) == 12 + 4 + 1);  // impulses, multipliers of the normal velocities, and of the bound
  for (const int k : {4, 8}) CHECK(size("ap", true, k) == 4 * (k + 2));
}

TEST_CASE("a negative coefficient of friction is a fault of the data to who weighs contacts") {
  for (const char* method : {"convex", "coulomb", "soft"}) {
    INFO(method);
    ContactProblem p = box(0.5, {0.1, -0.0098, 0});
    p.mu[2] = -1e-3;
    ContactSolution s;
    find_method(method)->make({})(p, s);
    CHECK(s.status == Status::input_error);
    CHECK(s.reason == "contact 2 has a negative coefficient of friction");
  }
}

TEST_CASE("no method tells a body that moves over the ground from ground that moves below it", "[conformance]") {
  const Vector3d V(0.3, -0.2, 0.5);
  std::vector<Case> all = cases();
  all.push_back({"a sphere bounces", sphere({1, -2, 0.5}, {0, 0, 1}, 0.2, 0.5)});
  all.push_back({"two boxes are shaken", stack(2, 0.4, {0.5, -1, 0.2}, 0.3)});
  for (const Choice& choice : choices()) {
    if (choice.options.solver == "pgs") continue;
    const ContactMethod method = choice.row->make(choice.options);
    for (const Case& c : all) {
      INFO(choice.label << ": " << c.name);
      const ContactProblem moving = seen_moving(c.problem, V);
      ContactSolution here, there;
      method(c.problem, here);
      method(moving, there);
      CHECK(here.status == there.status);
      const std::vector<double> v = velocities_after(c.problem, here), seen = velocities_after(moving, there);
      for (std::size_t i = 0; i < v.size(); ++i)
        CHECK(seen[i] - (i % 6 < 3 ? V[static_cast<int>(i % 6)] : 0) ==
              Approx(v[i]).margin(1e-8 * (1 + largest(c.problem.v_minus))));
    }
  }
}

TEST_CASE("islands whose contacts stand in turn move as each does alone, and are counted together", "[conformance]") {
  const ContactProblem slides = seen_moving(box(0.1, {0.5, -0.0098, 0.2}), {0, 0, 0.1}),
                       lands = stack(2, 0.5, {0.1, -1, 0});
  const ContactProblem both = in_turn(slides, lands);
  for (const Choice& choice : choices()) {
    if (choice.options.solver == "pgs" || choice.options.solver == "bisection") continue;
    INFO(choice.label);
    ContactSolution first, second, together;
    choice.row->make(choice.options)(slides, first);
    choice.row->make(choice.options)(lands, second);
    choice.row->make(choice.options)(both, together);
    CHECK(first.status == Status::ok);
    CHECK(second.status == Status::ok);
    CHECK(together.status == Status::ok);
    CHECK(together.size == first.size + second.size);
    if (choice.row->law == convex_law() || choice.row->law == coulomb_law())  // that part islands themselves
      CHECK(together.iterations > std::max(first.iterations, second.iterations));
    std::vector<double> v_plus;
    CHECK(Referee::holds(Referee().check(both, together, choice.row->law, v_plus), 1e-9));
    const std::vector<double> of_first = velocities_after(slides, first), of_second = velocities_after(lands, second);
    for (std::size_t i = 0; i < of_second.size(); ++i) CHECK(v_plus[i] == Approx(of_second[i]).margin(1e-8));
    for (std::size_t i = 0; i < of_first.size(); ++i)
      CHECK(v_plus[of_second.size() + i] == Approx(of_first[i]).margin(1e-8));
  }
}
