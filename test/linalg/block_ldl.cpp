#include "linalg/block_ldl.h"

#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <cmath>
#include <numeric>
#include <random>

using namespace cb;

namespace {

// Blocks of all sizes on a ring with chords, which fill in; quasi-definite: every third block is negative.
struct Ring {
  explicit Ring(unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    sizes = {1, 6, 2, 12, 5, 7, 3, 6, 4, 13};
    const int n = static_cast<int>(sizes.size());
    first.assign(1, 0);
    for (const int size : sizes) first.push_back(first.back() + size);
    A = Eigen::MatrixXd::Zero(first.back(), first.back());
    for (int j = 0; j < n; ++j) {
      for (const int i : {(j + 1) % n, (j + 4) % n, (j + n - 1) % n, (j + n - 4) % n}) {
        graph.row.push_back(i);
        for (int r = 0; r < sizes[i]; ++r)
          for (int c = 0; c < sizes[j]; ++c)
            if (i > j) A(first[i] + r, first[j] + c) = A(first[j] + c, first[i] + r) = 0.1 * normal(random);
      }
      graph.column.push_back(static_cast<int>(graph.row.size()));
      for (int r = 0; r < sizes[j]; ++r) A(first[j] + r, first[j] + r) = (j % 3 == 2 ? -1 : 1) * (5 + r);
    }
  }
  void put(BlockLdl& ldl) const {
    std::fill(ldl.values().begin(), ldl.values().end(), 0.0);
    const int n = static_cast<int>(sizes.size());
    for (int j = 0; j < n; ++j) {
      put(ldl, j, j);
      for (int e = graph.column[j]; e < graph.column[j + 1]; ++e) put(ldl, graph.row[e], j);
    }
  }
  void put(BlockLdl& ldl, int i, int j) const {
    const auto [at, stride, transposed] = ldl.place(i, j);
    for (int r = 0; r < sizes[i]; ++r)
      for (int c = 0; c < sizes[j]; ++c)
        ldl.values()[at + (transposed ? r * stride + c : c * stride + r)] = A(first[i] + r, first[j] + c);
  }
  std::vector<int> sizes, first;
  SymmetricPattern graph;
  Eigen::MatrixXd A;
};

}  // namespace

TEST_CASE("blocks of any size on a graph that fills in are solved as the whole matrix is", "[block_ldl]") {
  BlockLdl ldl;
  for (unsigned seed = 0; seed < 5; ++seed) {
    const Ring ring(seed);
    ldl.analyse(ring.sizes, ring.graph);
    ring.put(ldl);
    REQUIRE(ldl.factor());
    for (int repeat = 0; repeat < 2; ++repeat) {  // the padding must still be zero the second time
      const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(ring.A.rows(), -1, 2 + repeat), b = ring.A * x;
      for (int i = 0; i < ldl.blocks(); ++i)
        for (int r = 0; r < ring.sizes[i]; ++r) ldl.part(i)[r] = b[ring.first[i] + r];
      ldl.solve();
      for (int i = 0; i < ldl.blocks(); ++i)
        for (int r = 0; r < ring.sizes[i]; ++r)
          CHECK(ldl.part(i)[r] == Approx(x[ring.first[i] + r]).epsilon(1e-11).margin(1e-11));
    }
  }
}

TEST_CASE("a block without an inverse, or with NaN, is no factorisation by blocks", "[block_ldl]") {
  BlockLdl ldl;
  Ring ring(1);
  ldl.analyse(ring.sizes, ring.graph);
  ring.put(ldl);
  CHECK(ldl.factor());
  ring.A(20, 20) = std::nan("");
  ring.put(ldl);
  CHECK(!ldl.factor());

  const std::vector<int> sizes{2};
  ldl.analyse(sizes, SymmetricPattern{{0, 0}, {}});
  const int stride = ldl.place(0, 0).stride;
  for (const double d : {4.0, 5.0}) {  // [1 2; 2 d]
    std::fill(ldl.values().begin(), ldl.values().end(), 0.0);
    ldl.values()[0] = 1;
    ldl.values()[1] = ldl.values()[stride] = 2;
    ldl.values()[stride + 1] = d;
    CHECK(ldl.factor() == (d == 5));
  }
  for (const double d : {0.0, 1e-310, HUGE_VAL, 1.0}) {  // the last pivot of all
    std::fill(ldl.values().begin(), ldl.values().end(), 0.0);
    ldl.values()[0] = 1;
    ldl.values()[stride + 1] = d;
    INFO(d);
    CHECK(ldl.factor() == (d == 1));
  }
}

TEST_CASE("a right-hand side that is not finite leaves nothing for the next", "[block_ldl]") {
  BlockLdl ldl;
  const Ring ring(1);
  ldl.analyse(ring.sizes, ring.graph);
  ring.put(ldl);
  REQUIRE(ldl.factor());
  const auto solve = [&](double first) {
    for (int i = 0; i < ldl.blocks(); ++i) std::fill_n(ldl.part(i), ring.sizes[i], i == 0 ? first : 1.0);
    ldl.solve();
    double sum = 0;
    for (int i = 0; i < ldl.blocks(); ++i) sum = std::accumulate(ldl.part(i), ldl.part(i) + ring.sizes[i], sum);
    return sum;
  };
  const double before = solve(1);
  CHECK_FALSE(std::isfinite(solve(HUGE_VAL)));
  CHECK(solve(1) == before);
}
