// Factors of matrices of dense blocks whose numbers are not symmetric, against Eigen's dense solver.

#include "linalg/block_lu.h"

#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

using namespace cb;

namespace {

/// Random blocks on a graph, and the dense matrix of them.
struct Blocks {
  std::vector<int> sizes;
  std::vector<std::pair<int, int>> edges;
  std::vector<int> first{0};
  Eigen::MatrixXd A;

  Blocks(std::vector<int> of_sizes, std::vector<std::pair<int, int>> of_edges, unsigned seed)
      : sizes(std::move(of_sizes)), edges(std::move(of_edges)) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(-1, 1);
    for (const int size : sizes) first.push_back(first.back() + size);
    A.setZero(first.back(), first.back());
    const auto fill = [&](int i, int j) {
      for (int a = first[i]; a < first[i + 1]; ++a)
        for (int b = first[j]; b < first[j + 1]; ++b) A(a, b) = unit(random);
    };
    for (std::size_t b = 0; b < sizes.size(); ++b) fill(static_cast<int>(b), static_cast<int>(b));
    for (const auto& [i, j] : edges) fill(i, j), fill(j, i);
  }

  void put(BlockLu& lu) const {
    SymmetricPattern graph;
    for (std::size_t j = 0; j < sizes.size(); ++j) {
      for (const auto& [a, b] : edges) {
        if (a == static_cast<int>(j)) graph.row.push_back(b);
        if (b == static_cast<int>(j)) graph.row.push_back(a);
      }
      std::sort(graph.row.begin() + graph.column.back(), graph.row.end());
      graph.column.push_back(static_cast<int>(graph.row.size()));
    }
    lu.analyse(sizes, graph);
    const auto write = [&](std::span<double> values, const BlockPattern::Place& place, const Eigen::MatrixXd& block) {
      for (int j = 0; j < block.cols(); ++j)
        for (int i = 0; i < block.rows(); ++i) values[place.at + j * place.stride + i] = block(i, j);
    };
    const auto block = [&](int i, int j) { return A.block(first[i], first[j], sizes[i], sizes[j]); };
    for (int b = 0; b < static_cast<int>(sizes.size()); ++b) write(lu.lower(), lu.place(b, b), block(b, b));
    for (const auto& [i, j] : edges) {
      const auto place = lu.place(i, j);
      const int row = place.transposed ? j : i, column = place.transposed ? i : j;
      write(lu.lower(), place, block(row, column));
      write(lu.upper(), place, block(column, row).transpose());
    }
  }
};

Eigen::VectorXd solve(BlockLu& lu, const Blocks& blocks, const Eigen::VectorXd& b) {
  Eigen::VectorXd x(b.size());
  for (std::size_t k = 0; k < blocks.sizes.size(); ++k)
    std::copy_n(b.data() + blocks.first[k], blocks.sizes[k], lu.part(static_cast<int>(k)));
  lu.solve();
  for (std::size_t k = 0; k < blocks.sizes.size(); ++k)
    std::copy_n(lu.part(static_cast<int>(k)), blocks.sizes[k], x.data() + blocks.first[k]);
  return x;
}

}  // namespace

TEST_CASE("a matrix of blocks that is not symmetric times the solution is the right-hand side") {
  unsigned seed = 1;
  for (const std::vector<int>& sizes : {std::vector<int>{6}, std::vector<int>{1, 2, 3}, std::vector<int>{6, 6, 6, 6, 6},
                                        std::vector<int>{6, 13, 1, 4, 9}})
    for (int closed = 0; closed < 2; ++closed) {
      std::vector<std::pair<int, int>> edges;
      for (int b = 1; b < static_cast<int>(sizes.size()); ++b) edges.emplace_back(b, b - 1);
      if (closed && sizes.size() > 2) edges.emplace_back(0, static_cast<int>(sizes.size()) - 1);
      const Blocks blocks(sizes, edges, seed++);
      BlockLu lu;
      blocks.put(lu);
      REQUIRE(lu.factor());
      const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(blocks.A.rows(), -1, 2);
      const Eigen::VectorXd x = solve(lu, blocks, b);
      CHECK((blocks.A * x - b).norm() <= 1e-11 * (blocks.A.norm() * x.norm() + b.norm()));
      CHECK(lu.sign() == (blocks.A.determinant() > 0 ? 1 : -1));
    }
}

TEST_CASE("a zero on the diagonal of a block needs an exchange of rows, and a block of rank one is refused") {
  Blocks blocks({2, 2}, {{1, 0}}, 5);
  blocks.A.topLeftCorner<2, 2>() << 0, 1, 1, 0;
  BlockLu lu;
  blocks.put(lu);
  REQUIRE(lu.factor());
  const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(4, 1, 2);
  CHECK((blocks.A * solve(lu, blocks, b) - b).norm() <= 1e-13);
  blocks.A.topLeftCorner<2, 2>() << 1, 1, 1, 1;
  blocks.put(lu);
  CHECK_FALSE(lu.factor());
  Blocks alone({2}, {}, 5);
  for (const double last : {1e-310, HUGE_VAL, 1.0}) {
    INFO(last);
    alone.A << 1, 0, 0, last;
    alone.put(lu);
    CHECK(lu.factor() == (last == 1));
  }
}

TEST_CASE(
    "a right-hand side that is not finite leaves nothing for the next, in factors of blocks that are not symmetric") {
  const Blocks blocks({6, 6, 6}, {{1, 0}, {2, 1}}, 3);
  BlockLu lu;
  blocks.put(lu);
  REQUIRE(lu.factor());
  const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(18, -1, 2), x = solve(lu, blocks, b);
  CHECK_FALSE(solve(lu, blocks, Eigen::VectorXd::Constant(18, HUGE_VAL)).allFinite());
  CHECK(solve(lu, blocks, b) == x);
}
