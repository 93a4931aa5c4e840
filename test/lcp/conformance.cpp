// Every row of the table of LCP solvers on the same ten small problems (docs/adding.md).

#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>
#include <vector>

#include "lcp/lcp.h"

using namespace cb;

namespace {

struct Case {
  const char* name;
  Eigen::MatrixXd M;
  Eigen::VectorXd q;
  bool definite;  ///< every solver must solve it; else it may end in a typed status
};

Eigen::MatrixXd matrix(int n, std::initializer_list<double> rows) {
  Eigen::MatrixXd M(n, n);
  auto value = rows.begin();
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) M(i, j) = *value++;
  return M;
}
Eigen::VectorXd column(std::initializer_list<double> values) {
  return Eigen::Map<const Eigen::VectorXd>(values.begin(), static_cast<int>(values.size()));
}

std::vector<Case> cases() {
  const Eigen::MatrixXd tridiagonal = matrix(3, {2, -1, 0, -1, 2, -1, 0, -1, 2});
  Eigen::MatrixXd murty = Eigen::MatrixXd::Identity(4, 4);  // Murty's example that takes Lemke 2^n pivots
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < i; ++j) murty(i, j) = 2;
  return {{"nothing to do", matrix(2, {1, 0, 0, 1}), column({1, 2}), true},
          {"one unknown", matrix(1, {2}), column({-3}), true},
          {"all active", matrix(2, {2, 1, 1, 2}), column({-5, -6}), true},
          {"one of two active", matrix(2, {2, 1, 1, 2}), column({-5, 6}), true},
          {"a string over an obstacle", tridiagonal, column({-1, 2, -1}), true},
          {"a degenerate corner", tridiagonal, column({-1, 0, 0}), true},
          {"unsymmetric", matrix(2, {3, 1, -1, 2}), column({-1, -1}), true},
          {"Murty's example", murty, column({-1, -1, -1, -1}), true},
          {"semidefinite with many solutions", matrix(2, {1, 1, 1, 1}), column({-1, -1}), false},
          {"zero diagonal, as a slip bound has", matrix(2, {1, 1, -1, 0}), column({-1, 1}), false}};
}

}  // namespace

TEST_CASE("every solver of the table solves ten small problems or says why not", "[conformance]") {
  int available = 0;
  for (const LcpSolverRow& row : lcp_solvers()) {
    CHECK_FALSE(row.summary.empty());
    CHECK_FALSE(row.source.empty());
    if (!row.unavailable.empty()) continue;
    ++available;
    const LcpSolver used = row.make({});
    for (const Case& c : cases()) {
      INFO(row.name << ": " << c.name);
      LcpProblem problem;
      problem.M = c.M;
      problem.q = c.q;
      LcpSolution first, again;
      row.make({})(problem, first);
      used(problem, again);
      if (c.definite) REQUIRE(first.status == LcpStatus::solved);
      if (first.status == LcpStatus::solved) {
        REQUIRE(first.z.size() == c.q.size());
        CHECK(natural_residual(problem, first.z) <= 1e-10);
        CHECK(first.z.minCoeff() >= -1e-12);
        CHECK((c.M * first.z + c.q).minCoeff() >= -1e-9);
        CHECK(std::abs(first.z.dot(c.M * first.z + c.q)) <= 1e-8);
      } else {
        CHECK_FALSE(first.reason.empty());
      }
      // Nothing of an earlier problem is left behind.
      CHECK(first.status == again.status);
      CHECK(first.pivots == again.pivots);
      REQUIRE(first.z.size() == again.z.size());
      if (first.z.size() > 0) CHECK(std::memcmp(first.z.data(), again.z.data(), first.z.size() * sizeof(double)) == 0);
    }
  }
  CHECK(available >= 4);
}

TEST_CASE("data that are no numbers end in a typed status with every solver", "[conformance]") {
  for (const LcpSolverRow& row : lcp_solvers()) {
    if (!row.unavailable.empty()) continue;
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
      INFO(row.name << " with " << bad);
      LcpProblem problem;
      problem.M = matrix(2, {2, 1, 1, 2});
      problem.q = column({-1, bad});
      LcpSolution solution;
      row.make({})(problem, solution);
      CHECK(solution.status != LcpStatus::solved);
      CHECK_FALSE(solution.reason.empty());
    }
  }
}

// M = 1 - 1e60 1e60 / 1e-200.
TEST_CASE("data that overflow where the free unknowns are eliminated are not finite with any solver", "[conformance]") {
  LcpProblem problem;
  problem.expanded = true;
  problem.A = matrix(1, {1e-200}).sparseView();
  problem.B = problem.C = matrix(1, {1e60}).sparseView();
  problem.D = matrix(1, {1}).sparseView();
  problem.a = column({0});
  problem.q = column({-1});
  for (const LcpSolverRow& row : lcp_solvers()) {
    if (!row.unavailable.empty()) continue;
    INFO(row.name);
    LcpSolution solution;
    row.make({})(problem, solution);
    CHECK(solution.status == LcpStatus::not_finite);
    CHECK(solution.reason == "the data are not finite");
  }
}

// w_2 = z_2 - 1e-13: beside z_1 = 1 the error of z_2 = 0 is rounding, of a group of its own it is all there is.
TEST_CASE("a small pair is solved for as exactly as a large one where it is about something else", "[conformance]") {
  for (const char* name : {"lemke", "path", "ynl"}) {
    LcpProblem problem;
    problem.M = matrix(2, {1, 0, 0, 1});
    problem.q = column({-1, -1e-13});
    problem.groups = {{0, 1}, column({1, 1e-13}), column({1, 1}), {0, 0}, {0, 0}, {0, 1}, 2, {}, {}};
    LcpSolution found;
    find_lcp_solver(name)->make({})(problem, found);
    INFO(name << " " << found.reason);
    REQUIRE(found.status == LcpStatus::solved);
    CHECK(found.z[0] == 1);
    CHECK(found.z[1] == Approx(1e-13).epsilon(1e-12));
    CHECK(found.residual <= 1e-12);
  }
}

// Of three problems into one solution the first has none; the second leaves no residual.
TEST_CASE("a solution that is used again holds nothing of the problem before", "[conformance]") {
  const std::vector<std::pair<Eigen::MatrixXd, Eigen::VectorXd>> problems = {
      {matrix(1, {-1}), column({-1})}, {matrix(1, {2}), column({-3})}, {matrix(2, {2, 1, 1, 2}), column({-5, -6})}};
  for (const LcpSolverRow& row : lcp_solvers()) {
    if (!row.unavailable.empty()) continue;
    const LcpSolver solver = row.make({});
    LcpSolution used;
    for (std::size_t i = 0; i < problems.size(); ++i) {
      INFO(row.name << ", problem " << i);
      LcpProblem problem;
      problem.M = problems[i].first;
      problem.q = problems[i].second;
      LcpSolution fresh;
      row.make({})(problem, fresh);
      solver(problem, used);
      CHECK((fresh.status == LcpStatus::solved) == (i > 0));
      CHECK(used.status == fresh.status);
      CHECK(used.reason == fresh.reason);
      CHECK(used.residual == fresh.residual);
      CHECK(used.pivots == fresh.pivots);
      REQUIRE(used.z.size() == fresh.z.size());
      CHECK((used.z.array() == fresh.z.array()).all());
    }
  }
}
