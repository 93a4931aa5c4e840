// What the search of ynl keeps: states, candidates, memory, and what it says at its end.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <set>
#include <vector>

#include "lcp/dense_basis.h"
#include "lcp/ynl_states.h"

using namespace cb;

namespace {

SearchState state(std::vector<std::uint64_t> basic, int out, bool z_enters, int second_choices) {
  SearchState s;
  s.basic = std::move(basic);
  s.out = out;
  s.z_enters = z_enters;
  s.second_choices = second_choices;
  return s;
}

}  // namespace

TEST_CASE("of states that wait the one with the fewest second choices comes first, then the youngest", "[ynl]") {
  WaitingStates waiting;
  waiting.clear(2);
  CHECK(waiting.empty());
  std::vector<SearchState> order;
  for (int k = 0; k < 12; ++k)
    waiting.push(state({std::uint64_t(k), std::uint64_t(100 + k)}, 10 + k, k % 2 == 0, k % 3));
  // Second choices 0: 9, 6, 3, 0; one: 10, 7, 4, 1; two: 11, 8, 5, 2.
  for (const int k : {9, 6, 3}) {
    SearchState s;
    waiting.pop(s);
    CHECK(s.out == 10 + k);
    CHECK(s.basic == std::vector<std::uint64_t>{std::uint64_t(k), std::uint64_t(100 + k)});
    CHECK(s.z_enters == (k % 2 == 0));
    CHECK(s.second_choices == 0);
  }
  waiting.push(state({77, 78}, 99, true, 1));
  for (const int out : {10, 99, 20, 17, 14, 11, 21, 18, 15, 12}) {
    REQUIRE_FALSE(waiting.empty());
    SearchState s;
    waiting.pop(s);
    CHECK(s.out == out);
    if (out == 99) CHECK(s.basic == std::vector<std::uint64_t>{77, 78});
    if (out != 99) CHECK(s.basic[1] == std::uint64_t(90 + out));
  }
  CHECK(waiting.empty());
}

TEST_CASE("a state is the same where its set, the pair that is out and what enters are, and else another", "[ynl]") {
  SearchState s = state({0, 0}, 3, true, 0);
  std::set<std::uint64_t> hashes{s.hash()};
  for (const int i : {0, 1, 63, 64, 127}) {
    CHECK_FALSE(s.has(i));
    s.flip(i);
    CHECK(s.has(i));
    CHECK(hashes.insert(s.hash()).second);
  }
  CHECK(s.basic == std::vector<std::uint64_t>{3 | std::uint64_t(1) << 63, 1 | std::uint64_t(1) << 63});
  s.z_enters = false;
  CHECK(hashes.insert(s.hash()).second);
  s.out = 4;
  CHECK(hashes.insert(s.hash()).second);
  s.out = 5;
  CHECK(hashes.insert(s.hash()).second);
  const std::uint64_t before = s.hash();
  s.second_choices = 9;  // how it was come to
  CHECK(s.hash() == before);
}

TEST_CASE("what was seen is known again, however much is seen besides, and zero too", "[ynl]") {
  SeenStates seen;
  seen.clear();
  const std::size_t empty = seen.bytes();
  // The same place for all of them, at first.
  for (std::uint64_t k = 0; k < 500; ++k) {
    CHECK(seen.insert(k << 20));
    CHECK_FALSE(seen.insert(k << 20));
  }
  for (std::uint64_t k = 0; k < 500; ++k) CHECK_FALSE(seen.insert(k << 20));
  CHECK(seen.bytes() > empty);
  seen.clear();
  CHECK(seen.bytes() == empty);
  CHECK(seen.insert(3 << 20));
  // Half of the places at most are taken.
  int count = 1;
  while (!seen.full()) seen.insert(std::uint64_t(++count) * 977);
  CHECK(count == static_cast<int>(empty / sizeof(std::uint64_t)) / 2);
}

TEST_CASE("memory counts what is aside, remembers its peak, and once full stays so", "[ynl]") {
  Memory memory{1000};
  CHECK(memory.room(400));
  CHECK(memory.peak == 400);
  CHECK(memory.room(300));
  CHECK(memory.peak == 400);
  memory.aside = 500;
  CHECK(memory.room(500));
  CHECK(memory.peak == 1000);
  CHECK_FALSE(memory.full);
  CHECK_FALSE(memory.room(501));
  CHECK(memory.full);
  CHECK(memory.peak == 1000);
  CHECK_FALSE(memory.room(1));
}

TEST_CASE("candidates are all rows within a tie of zero where the first blocks, z_0 first, then the largest pivot",
          "[ynl]") {
  const int n = 5;
  LcpProblem problem;
  problem.M = Eigen::MatrixXd::Identity(n, n);
  problem.q = Eigen::VectorXd{{2, 4, 1e-3, 6, 3}};
  PairScales scales;
  scales.rho = scales.rows = scales.columns = Eigen::VectorXd::Ones(n);
  DenseBasis basis;
  basis.start(problem, scales);
  basis.restart();
  basis.set_load(problem.q);
  basis.set_cover(Eigen::VectorXd::Ones(n));
  const auto found = [&](const std::vector<double>& change, double tie, double tolerance = 1e-9) {
    std::vector<Candidate> candidates;
    find_candidates(basis, change.data(), tolerance, tie, candidates);
    std::vector<int> rows;
    for (const Candidate& c : candidates) {
      CHECK(c.variable == basis.basic(c.row));
      if (c.variable != basis.artificial()) CHECK(c.pivot == -change[c.row]);
      rows.push_back(c.row);
    }
    return rows;
  };
  using Rows = std::vector<int>;
  CHECK(found({-1, -2, 0, -3, 1}, 0) == Rows{3, 1, 0});     // all at a step of 2
  CHECK(found({-1, -1, 0, -3, -1.5}, 0) == Rows{3, 4, 0});  // 3 / 1.5
  CHECK(found({-1, -1, 0, -1, -1}, 0.5) == Rows{0});
  CHECK(found({-1, -1, 0, -1, -1}, 1) == Rows{0, 4});         // alike: by variable; 3 - 2 is left
  CHECK(found({-1, -1.5, 0, -1, -1}, 1) == Rows{1, 0, 4});    // 4 - 3 is left
  CHECK(found({-1, -2, -1e-10, -3, 1}, 0) == Rows{3, 1, 0});  // no pivot
  CHECK(found({-1, -2, -1e-10, -3, 1}, 0, 1e-11).front() == 3);
  CHECK(found({0, 0, 0, 1, 2}, 1).empty());
  // z_0 in row 1, where it has the smallest pivot: first all the same.
  REQUIRE(basis.pivot(1, basis.artificial()));
  std::vector<double> change(n, -1.0);
  const double z0 = basis.rhs()[1];
  for (int i = 0; i < n; ++i) change[i] = i == 1 ? -0.5 : -1 - 0.1 * i;
  for (int i = 0; i < n; ++i) basis.rhs()[i] = change[i] * -2;
  CHECK(found(change, 1e-12) == Rows{1, 4, 3, 2, 0});
  CHECK(std::isfinite(z0));
  // What is below zero blocks at a step of 0.
  basis.rhs()[3] = -1e-9;
  CHECK(found(change, 0) == Rows{3});
  basis.rhs()[0] = 0;
  CHECK(found(change, 0) == Rows{3, 0});
}

TEST_CASE("the candidate that is followed becomes the state, and the others wait as second choices", "[ynl]") {
  const int n = 70;  // two words
  Search search;
  SearchState s;
  search.start(n, 1e-5, s);
  CHECK(search.near_tie == 1e-5);
  CHECK(s.basic == std::vector<std::uint64_t>{0, 0});
  s.flip(65);
  s.second_choices = 2;
  // z_65 leaves: w_65 enters next. w_3 leaves: z_3 enters. z_0 before both is passed over.
  search.candidates = {{2 * n, 9, HUGE_VAL}, {n + 65, 4, 3.0}, {3, 1, 2.0}, {5, 7, 1.0}};
  Memory memory{1e6};
  SearchState followed = s;
  REQUIRE(search.branch(followed, 1, n, memory));
  CHECK_FALSE(followed.has(65));
  CHECK(followed.out == 65);
  CHECK_FALSE(followed.z_enters);
  CHECK(followed.second_choices == 2);
  for (const int pair : {3, 5}) {
    SearchState other;
    search.waiting.pop(other);
    CHECK(other.out == pair);
    CHECK(other.z_enters);
    CHECK(other.basic == s.basic);
    CHECK(other.second_choices == 3);
  }
  CHECK(search.waiting.empty());
  Memory none{1};
  followed = s;
  CHECK_FALSE(search.branch(followed, 1, n, none));
  CHECK(none.full);
  CHECK_FALSE(search.make_room_to_see(none));
}

TEST_CASE("dead ends are counted by kind, and named where there are any", "[ynl]") {
  DeadEnds dead;
  CHECK(dead.text().empty());
  for (const Look look : {Look::on, Look::ray, Look::ray, Look::doubtful_ray, Look::singular, Look::singular,
                          Look::singular, Look::infeasible})
    dead.note(look);
  CHECK(dead.text() ==
        "2 rays, 1 rays that the original data refute, 3 singular bases, 1 bases out of the feasible region");
  dead = {};
  dead.seen = 4;
  dead.refused = 5;
  CHECK(dead.text() == "4 states seen before, 5 ends refused by the check");
  CHECK(CoversUsed{0, false}.text().empty());
  CHECK(CoversUsed{1, false}.text() == "; then 1 other cover");
  CHECK(CoversUsed{2, true}.text() == "; then 2 other covers, an end's own cover");
  CHECK(CoversUsed{0, true}.text() == "; then an end's own cover");
}

TEST_CASE("how a search ends is its status: cut off, or by what its sequences came to", "[ynl]") {
  const auto concluded = [](SearchEnd end, const DeadEnds& dead, double residual, const CoversUsed& covers = {}) {
    LcpSolution solution;
    solution.residual = residual;
    conclude(end, dead, covers, solution);
    return solution;
  };
  DeadEnds rays, singular, infeasible, doubtful, seen, refused;
  rays.rays = rays.singular = 1;
  singular.singular = 1;
  infeasible.infeasible = 1;
  doubtful.doubtful_rays = 1;
  seen.seen = 2;
  refused.refused = 1;
  CHECK(concluded(SearchEnd::solved, {}, 1e-16).status == LcpStatus::solved);
  CHECK(concluded(SearchEnd::solved, {}, 1e-16).reason.empty());
  CHECK(concluded(SearchEnd::solved, rays, 1e-16).reason == "dead ends: 1 rays, 1 singular bases");
  CHECK(concluded(SearchEnd::solved, {}, 1e-16, {0, true}).reason == "dead ends: none; then an end's own cover");
  CHECK(concluded(SearchEnd::pivot_limit, rays, 1e-3).status == LcpStatus::nonconverged);
  CHECK(concluded(SearchEnd::pivot_limit, {}, 1e-3).reason == "pivot limit");
  CHECK(concluded(SearchEnd::memory_limit, rays, 1e-3).status == LcpStatus::memory_limit);
  CHECK(concluded(SearchEnd::exhausted, refused, 1e-3).status == LcpStatus::inaccurate);
  CHECK(concluded(SearchEnd::exhausted, rays, 1e-3).status == LcpStatus::inaccurate);
  CHECK(concluded(SearchEnd::exhausted, rays, HUGE_VAL).status == LcpStatus::ray);
  CHECK(concluded(SearchEnd::exhausted, rays, HUGE_VAL).reason ==
        "no sequence ends in a solution; dead ends: 1 rays, 1 singular bases");
  for (const DeadEnds& dead : {singular, infeasible, doubtful})
    CHECK(concluded(SearchEnd::exhausted, dead, HUGE_VAL).status == LcpStatus::singular);
  CHECK(concluded(SearchEnd::exhausted, seen, HUGE_VAL).status == LcpStatus::cycling);
}
