#include "linalg/sparse_cholesky.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

using namespace cb;

// [2 1; 1 -3] coupled to [4]: x = (1, 2, 3) gives b = (2 + 2 + 3, 1 - 6, 3 + 12).
TEST_CASE("a quasi-definite matrix is solved with negative pivots", "[sparse_cholesky]") {
  SymmetricPattern pattern;
  pattern.column = {0, 3, 4, 5};
  pattern.row = {0, 1, 2, 1, 2};
  SparseCholesky cholesky;
  REQUIRE(cholesky.analyse(pattern));
  for (int repeat = 0; repeat < 2; ++repeat) {
    std::vector<double> values{2, 1, 1, -3, 4}, x{7, -5, 13};
    values[0] = 2 + repeat;
    x[0] = 7 + repeat;
    REQUIRE(cholesky.factor(values));
    cholesky.solve_in_place(x);
    CHECK(x[0] == Approx(1).epsilon(1e-14));
    CHECK(x[1] == Approx(2).epsilon(1e-14));
    CHECK(x[2] == Approx(3).epsilon(1e-14));
  }
  CHECK(cholesky.factor_entries() >= 5);
}

TEST_CASE("a zero pivot or NaN is no factorisation", "[sparse_cholesky]") {
  SymmetricPattern pattern;
  pattern.column = {0, 2, 3};
  pattern.row = {0, 1, 1};
  SparseCholesky cholesky;
  REQUIRE(cholesky.analyse(pattern));
  std::vector<double> singular{1, 1, 1}, broken{std::nan(""), 1, 1};
  CHECK(!cholesky.factor(singular));
  CHECK(!cholesky.factor(broken));
}

TEST_CASE("the order of elimination of a chain is a permutation of it", "[sparse_cholesky]") {
  SymmetricPattern graph;
  const int n = 50;
  for (int i = 0; i < n; ++i) {
    if (i > 0) graph.row.push_back(i - 1);
    if (i + 1 < n) graph.row.push_back(i + 1);
    graph.column.push_back(static_cast<int>(graph.row.size()));
  }
  std::vector<int> order;
  block_order(graph, order);
  std::sort(order.begin(), order.end());
  for (int i = 0; i < n; ++i) CHECK(order[i] == i);
}

TEST_CASE("the hub of a star is eliminated when all or all but one of its rays are", "[sparse_cholesky]") {
  // Earlier it would couple all that are left.
  SymmetricPattern star;
  const int n = 20, hub = 3;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j)
      if (i != j && (i == hub || j == hub)) star.row.push_back(j);
    star.column.push_back(static_cast<int>(star.row.size()));
  }
  std::vector<int> order;
  block_order(star, order);
  CHECK((order[n - 1] == hub || order[n - 2] == hub));
}
