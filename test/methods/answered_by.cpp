// Who answers which kind of event, where a method tries several ways: what a summary counts.

#include <algorithm>
#include <catch2/catch.hpp>
#include <map>

#include "impacts.h"
#include "methods/registry.h"
#include "problems.h"

using namespace cb;
using namespace cb::test;

namespace {

using Counts = std::map<std::string, long>;

/// Whose answers to these events, one after the other, were taken.
Counts answers(const std::vector<ContactProblem>& events, bool warm = false, bool bound = true) {
  MethodOptions options;
  options.warm_start = warm;
  options.compression_bound = bound;
  options.answered_by = std::make_shared<AnsweredBy>();
  const ContactMethod method = find_method("convex")->make(options);
  ContactSolution solution;
  for (const ContactProblem& event : events) {
    method(event, solution);
    CHECK(solution.status == Status::ok);
  }
  return {options.answered_by->counts.begin(), options.answered_by->counts.end()};
}

}  // namespace

TEST_CASE("convex is answered by the first way that serves: no friction, all sticks, one guess, and then the rest",
          "[convex]") {
  for (const bool bound : {true, false}) {
    INFO("bound " << bound);
    CHECK(answers({box(0, {1, -0.0098, 0})}, false, bound) == Counts{{"frictionless", 1}});
    CHECK(answers({box(0.5, {1e-3, -0.0098, 2e-3})}, false, bound) == Counts{{"sticking", 1}});
    CHECK(answers({stack(4, 0.5, {0, -0.0098, 0})}, false, bound) == Counts{{"frictionless", 1}});  // it needs none
  }
  CHECK(answers({box(0.3, {1, -0.0098, 0})}) == Counts{{"guess", 1}});
  CHECK(answers({stack(3, 0.4, {0.5, -1, 0}, 0.5)}) == Counts{{"interior point", 1}});
  // Bodies that are one tree, as a robot's links.
  CHECK(answers({one_block(stack(2, 0.5, {1e-3, -0.0098, 0}))}) == Counts{{"stopping", 1}});
}

TEST_CASE("convex: what slides on without friction does not keep others on its island from sticking", "[convex]") {
  // A box that stops on the ground, and one that goes on across it.
  ContactProblem p = stack(2, 0.5, {1e-3, -0.0098, 0});
  std::fill(p.mu.begin() + 4, p.mu.end(), 0.0);
  for (const bool bound : {true, false}) CHECK(answers({p}, false, bound) == Counts{{"sticking", 1}});
}

TEST_CASE("with a warm start what slides on is answered from before, and what rests rests again", "[convex]") {
  const auto sliding = [](double speed) { return box(0.3, {speed, -0.0098, 0}); };
  CHECK(answers({sliding(1), sliding(0.99), sliding(0.98)}, true) == Counts{{"guess", 1}, {"previous answer", 2}});
  CHECK(answers({sliding(1), sliding(0.99), sliding(0.98)}) == Counts{{"guess", 3}});
  const auto resting = [](double fall) { return box(0.5, {1e-3, -fall, 0}); };
  CHECK(answers({resting(0.0098), resting(0.0098 + 1e-15), resting(0.0098 - 1e-15)}, true) ==
        Counts{{"sticking", 1}, {"rest, again", 2}});
}

TEST_CASE("each island of an event has an answer of its own, and each phase of one with restitution", "[convex]") {
  ContactProblem two = box(0.3, {1, -0.0098, 0});
  add_body(two, 2, Vector3d::Constant(0.8), {0.1, -1, 0});
  add_contact(two, 1, {0, -1, 0}, -1, {}, ground_axes(), 0.5);
  const Counts counts = answers({two});
  CHECK(counts == Counts{{"guess", 1}, {"sticking", 1}});
}
