// One object of each method over a chain of events that have little in common: arms and bodies, few contacts and many,
// what bounces, what no method can answer and what all can. It answers each as one does that has seen nothing.

#include <catch2/catch.hpp>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "methods/choices.h"
#include "methods/pruned.h"
#include "problems.h"

using namespace cb;
using namespace cb::test;

namespace {

struct Case {
  const char* name;
  ContactProblem problem;
};

/// Balls of 1, 2, ... kg, each faster than the one before. Contacts: a ball, and the one that it comes down on; -1: the
/// ground.
ContactProblem balls(int count, const std::vector<std::pair<int, int>>& contacts, double e = 0) {
  ContactProblem p;
  for (int b = 0; b < count; ++b)
    add_body(p, 1.0 + b, Vector3d::Constant(0.4 * (1 + b)), Vector3d(0.3 * b, -1 - 0.5 * b, 0.2));
  double aside = -0.1;
  for (const auto& [upper, lower] : contacts) {
    add_contact(p, upper, Vector3d(aside, -1, 0), lower, Vector3d(aside, 1, 0), ground_axes(), 0.3, e);
    aside += 0.2;
  }
  return p;
}

/// Two arms of eight joints each that run into each other.
ContactProblem arms() {
  constexpr int joints = 8;
  ContactProblem p;
  double number = 0;
  p.J.add_band();
  for (int a = 0; a < 2; ++a) {
    auto M = p.M.block(p.M.add_block(joints));
    M.setConstant(0.2);
    M.diagonal().array() += 1.0 + a;
    auto J = p.J.entry(p.J.add_entry(a, joints));
    for (int j = 0; j < joints; ++j) {
      for (int row = 0; row < 3; ++row) J(row, j) = std::sin(++number);
      p.v_minus.push_back(-J(0, j));
    }
  }
  p.offset.assign(3, 0.0);
  p.mu = {0.3};
  p.restitution = {0};
  return p;
}

/// A ball on a plate, which is on another one, which is at its stop; the plates move up and down alone. Blocks so small
/// that systems are factored as sparse matrices.
ContactProblem ball_on_plates(bool ball_first) {
  ContactProblem p;
  const auto add_ball = [&] { return add_body(p, 1, Vector3d::Constant(0.4), Vector3d(0.3, -1, 0.2)); };
  int ball = ball_first ? add_ball() : -1;
  const int upper = p.M.add_block(1), lower = p.M.add_block(1);
  p.M.block(upper)(0, 0) = 2;
  p.M.block(lower)(0, 0) = 3;
  p.v_minus.insert(p.v_minus.end(), {-0.5, -0.2});
  if (!ball_first) ball = add_ball();
  const auto moves = [&](int plate, double sign) { p.J.entry(p.J.add_entry(plate, 1))(0, 0) = sign; };
  const auto rolls = [&] {
    auto J = p.J.entry(p.J.add_entry(ball, 6));
    for (int row = 0; row < 3; ++row) {
      const Vector3d d = ground_axes().row(row);
      J.row(row).head<3>() = d;
      J.row(row).tail<3>() = Vector3d(0, -1, 0).cross(d);
    }
  };
  p.J.add_band();
  if (ball_first) rolls();
  moves(upper, -1);
  if (!ball_first) rolls();
  p.J.add_band();
  moves(upper, 1);
  moves(lower, -1);
  p.J.add_band();
  moves(lower, 1);
  p.offset.assign(9, 0.0);
  p.mu = {0.3, 0, 0};
  p.restitution = {0, 0, 0};
  return p;
}

/// A ball that lands under another one, both at 2 m/s: what the ground gives back, by e, goes on to the other.
void add_landing(ContactProblem& p, double e) {
  const int lower = add_body(p, 1, Vector3d::Constant(0.4), {0, -2, 0});
  const int upper = add_body(p, 3, Vector3d::Constant(1.2), {0, -2, 0});
  add_contact(p, lower, {0, -1, 0}, -1, {}, ground_axes(), 0, e);
  add_contact(p, upper, {0, -1, 0}, lower, {0, 1, 0}, ground_axes(), 0, 0);
}

std::vector<Case> chain() {
  ContactProblem landing, no_number = box(0.5, {0, -1, 0}), no_mass = stack(2, 0.3, {0.1, -1, 0}),
                          on_belt = balls(2, {{0, -1}, {1, 0}});
  add_landing(landing, 1);
  no_number.v_minus[1] = std::nan("");
  no_mass.M.block(1)(2, 2) = -1;
  for (std::size_t i = 0; i < on_belt.offset.size(); i += 3) on_belt.offset[i + 1] = -0.7;
  return {{"two arms meet", arms()},
          {"a ball comes down on another", balls(2, {{1, 0}})},
          {"two balls meet at two points", balls(2, {{1, 0}, {1, 0}})},
          {"two balls meet each other and the ground", balls(2, {{0, -1}, {1, -1}, {1, 0}})},
          {"three balls on each other", balls(3, {{0, -1}, {1, 0}, {2, 1}})},
          {"two balls on one", balls(3, {{0, -1}, {1, 0}, {2, 0}})},
          {"a ball on plates", ball_on_plates(true)},
          {"plates and a ball on them", ball_on_plates(false)},
          {"five boxes are shaken", stack(5, 0.4, {0.3, -1, 0.1}, 0.2)},
          {"a velocity is no number", no_number},
          {"a box comes to rest", box(0.5, {0.1, -0.5, 0.2})},
          {"a mass is negative", no_mass},
          {"three balls bounce", balls(3, {{0, -1}, {1, 0}, {2, 1}}, 0.5)},
          {"a ball bounces below another", landing},
          {"three balls do not bounce", balls(3, {{0, -1}, {1, 0}, {2, 1}})},
          {"two balls beside each other", balls(2, {{0, -1}, {1, -1}})},
          {"one ball on the other", balls(2, {{1, 0}})},
          {"two pairs of balls", balls(4, {{1, 0}, {3, 2}})},
          {"three of four balls", balls(4, {{1, 0}, {2, 1}})},
          {"boxes on ice", stack(2, 0, {0.1, -0.5, 0})},
          {"balls on a belt", on_belt},
          {"a box slides", box(0.1, {0.5, -0.0098, 0.2})}};
}

void check_same(const ContactSolution& used, const ContactSolution& fresh) {
  CHECK(used.status == fresh.status);
  CHECK(used.reason == fresh.reason);
  CHECK(used.iterations == fresh.iterations);
  CHECK(used.size == fresh.size);
  CHECK(used.restitution_scale == fresh.restitution_scale);
  CHECK(used.impulse == fresh.impulse);
}

}  // namespace

TEST_CASE("a method answers each event of a chain as if it were its first, whatever came before", "[conformance]") {
  const std::vector<Case> events = chain();
  std::vector<Choice> all = choices();
  MethodOptions unbounded;
  unbounded.compression_bound = false;
  all.push_back({find_method("convex"), unbounded, "convex without the bound"});
  for (const Choice& choice : all) {
    const ContactMethod method = choice.row->make(choice.options);
    ContactSolution used;
    for (const Case& event : events) {
      INFO(choice.label << ": " << event.name);
      ContactSolution fresh;
      method(event.problem, used);
      choice.row->make(choice.options)(event.problem, fresh);
      check_same(used, fresh);
    }
  }
}

TEST_CASE("what an event does not need is left out as if it were the first, whatever came before", "[pruned]") {
  const std::vector<Case> events = chain();
  for (const MethodRow& row : methods()) {
    const ContactMethod method = pruned(row, {}, std::make_shared<LeftOut>());
    ContactSolution used;
    for (const Case& event : events) {
      INFO(row.name << ": " << event.name);
      ContactSolution fresh;
      method(event.problem, used);
      pruned(row, {}, std::make_shared<LeftOut>())(event.problem, fresh);
      check_same(used, fresh);
    }
  }
}

TEST_CASE("an island without restitution is counted once, however often the one beside it is solved") {
  const ContactProblem slides = box(0.1, {0.5, -0.0098, 0.2});
  ContactProblem lands, both = slides;
  add_landing(lands, 0.25);
  add_landing(both, 0.25);
  for (const char* name : {"convex", "coulomb"}) {
    INFO(name);
    const auto size = [&](const ContactProblem& p) {
      ContactSolution solution;
      find_method(name)->make({})(p, solution);
      CHECK(solution.status == Status::ok);
      return solution.size;
    };
    CHECK(size(both) == size(slides) + size(lands));
  }
}
