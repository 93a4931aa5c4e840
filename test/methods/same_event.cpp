// What a warm start takes for the event before, and that it answers alike whether anybody counts or not.

#include "methods/same_event.h"

#include <catch2/catch.hpp>
#include <memory>
#include <utility>

#include "methods/registry.h"
#include "problems.h"

using namespace cb;
using namespace cb::test;

namespace {

/// Is the second problem answered as the first was?
bool is_taken_for(const ContactProblem& first, const ContactProblem& second) {
  const auto reused = std::make_shared<Counter>(0);
  const ContactMethod once =
      reuse_same_event([](const ContactProblem&, ContactSolution& solution) { solution.clear(); }, reused);
  ContactSolution solution;
  once(first, solution);
  once(second, solution);
  return *reused == 1;
}

}  // namespace

TEST_CASE("a robot's event is the one before to the last bit alone, by all of its rates", "[warm_start]") {
  constexpr int rates = 8;
  ContactProblem tree;
  tree.M.block(tree.M.add_block(rates)).setIdentity();
  tree.v_minus.assign(rates, -1.0);
  tree.J.add_band();
  tree.J.entry(tree.J.add_entry(0, rates)).setConstant(0.5);
  tree.offset.assign(3, 0.0);
  tree.mu = {0.5};
  tree.restitution = {0};
  CHECK(is_taken_for(tree, tree));
  constexpr double last_bit = 4e-16;
  for (const int rate : {0, rates - 1})
    for (const double change : {last_bit, 1.0}) {
      INFO("rate " << rate << ", by " << change);
      ContactProblem other = tree;
      other.M.block(0)(rate, rate) *= 1 + change;
      CHECK_FALSE(is_taken_for(tree, other));
      other = tree;
      other.J.entry(0)(0, rate) *= 1 + change;
      CHECK_FALSE(is_taken_for(tree, other));
    }
}

TEST_CASE("an event whose contacts join other bodies by the same numbers is not the one before", "[warm_start]") {
  const auto joined = [](bool by_first) {
    ContactProblem p;
    for (const double mass : {1.0, 2.0, 4.0}) add_body(p, mass, Vector3d::Constant(mass), {0, -1, 0});
    for (const int b : {0, 1, 2}) {
      if (b == 0 || b == (by_first ? 2 : 1)) {
        p.J.add_band();
        p.offset.insert(p.offset.end(), 3, 0.0);
        p.mu.push_back(0.5);
        p.restitution.push_back(0);
      }
      p.J.entry(p.J.add_entry(b, 6)).leftCols<3>() = ground_axes();
    }
    return p;
  };
  REQUIRE(joined(true).J.values == joined(false).J.values);
  CHECK(is_taken_for(joined(true), joined(true)));
  CHECK_FALSE(is_taken_for(joined(true), joined(false)));
}

TEST_CASE("starts from the event before that nobody counts lead to the answers of those that are", "[warm_start]") {
  for (const char* name : {"ap", "convex", "coulomb", "soft"}) {
    INFO(name);
    MethodOptions options;
    options.warm_start = true;
    const ContactMethod uncounted = find_method(name)->make(options);
    options.warm_starts = std::make_shared<Counter>(0);
    const ContactMethod counted = find_method(name)->make(options);
    // The box slides, comes to the same event again and again, and lies still.
    for (const auto& [push, fall] :
         {std::pair(1.0, 0.0098), std::pair(1.01, 0.0098), std::pair(1.01, 0.0098), std::pair(1.01, 0.0098),
          std::pair(1e-3, 0.0098), std::pair(1e-3, 0.0098 + 1e-7), std::pair(1e-3, 0.0098 + 2e-7)}) {
      const ContactProblem p = box(0.5, {push, -fall, 0});
      ContactSolution ours, theirs;
      counted(p, ours);
      uncounted(p, theirs);
      CHECK(ours.status == Status::ok);
      CHECK(theirs.impulse == ours.impulse);
    }
    CHECK(*options.warm_starts > 1);
  }
}
