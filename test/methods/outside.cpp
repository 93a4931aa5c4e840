// Answers that come from outside: whatever the solver says of itself, the referee judges what it gave.

#include "methods/outside.h"

#include <catch2/catch.hpp>

#include "contact/referee.h"
#include "problems.h"

using namespace cb;
using namespace cb::test;

TEST_CASE("an answer that its solver doubts is judged by what the law was asked for", "[outside]") {
  const ContactProblem p = box(0.3, {1, -0.5, 0.2});
  MethodOptions asked;
  asked.sigma = 0.1;
  const MethodRow& soft = *find_method("soft");
  ContactSolution own, answer;
  soft.make(asked)(p, own);
  REQUIRE(own.status == Status::ok);
  const MethodRow row = outside_row("doubting", "", soft.law, [&](const MethodOptions&) -> OutsideSolver {
    return [&](const ContactProblem&, ContactSolution& solution) {
      solution.impulse = own.impulse;
      solution.status = Status::inaccurate;
      solution.reason = "does not trust itself";
    };
  });
  row.make(asked)(p, answer);
  CHECK(answer.status == Status::inaccurate);
  CHECK(answer.reason == "does not trust itself");
  std::vector<double> v_plus;
  CHECK(Referee::holds(Referee().check(p, answer, soft.law, v_plus), 1e-9));
}

// Works of several contacts of an island: any that add up to its own.
TEST_CASE("impulses alone are answers of mirtich where its own are, with their works or without", "[outside]") {
  for (const ContactProblem& p : {box(0.3, {1, -0.5, 0.2}), stack(2, 0.5, {0.1, -1, 0})}) {
    const MethodRow& mirtich = *find_method("mirtich");
    ContactSolution own, answer;
    mirtich.make({})(p, own);
    REQUIRE(own.status == Status::ok);
    const MethodRow row = outside_row("impulses", "", mirtich.law, [&](const MethodOptions&) -> OutsideSolver {
      return [&](const ContactProblem&, ContactSolution& solution) { solution.impulse = own.impulse; };
    });
    row.make({})(p, answer);
    CHECK(answer.status == Status::ok);
    std::vector<double> v_plus;
    CHECK(Referee::holds(Referee().check(p, own, mirtich.law, v_plus), 1e-9));
    CHECK(Referee::holds(Referee().check(p, answer, mirtich.law, v_plus), 1e-9));
  }
}
