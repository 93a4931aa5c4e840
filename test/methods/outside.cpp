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
