#include "linalg/block_matrix.h"

#include <Eigen/Cholesky>
#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <random>

using namespace cb;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// Blocks of all sizes up to eight, six of a free body in between, and the same matrix dense.
struct Blocks {
  BlockDiagonalMatrix A;
  MatrixXd dense;
};
Blocks positive_definite(unsigned seed) {
  std::srand(seed);
  Blocks out;
  for (const int n : {6, 1, 2, 3, 6, 4, 5, 7, 8, 6}) out.A.add_block(n);
  out.dense.setZero(out.A.order(), out.A.order());
  for (int b = 0; b < out.A.blocks(); ++b) {
    const int n = out.A.block_size(b), at = out.A.first[b];
    const MatrixXd half = MatrixXd::Random(n, n);
    out.A.block(b) = half * half.transpose() + 0.5 * MatrixXd::Identity(n, n);
    out.dense.block(at, at, n, n) = out.A.block(b);
  }
  return out;
}

VectorXd random_vector(int n) { return VectorXd::Random(n); }

double off(const VectorXd& a, const VectorXd& b) { return (a - b).norm() / b.norm(); }

constexpr double rounding = 1e-12;

}  // namespace

TEST_CASE("products and solves by blocks of any size are those of the whole matrix", "[block_matrix]") {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const Blocks blocks = positive_definite(seed);
    const int n = blocks.A.order();
    const VectorXd x = random_vector(n);
    VectorXd y(n);
    multiply(blocks.A, {x.data(), static_cast<std::size_t>(n)}, {y.data(), static_cast<std::size_t>(n)});
    CHECK(off(y, blocks.dense * x) < rounding);
    CHECK(quadratic_form(blocks.A, {x.data(), static_cast<std::size_t>(n)}) ==
          Approx(x.dot(blocks.dense * x)).epsilon(rounding));

    BlockCholesky factor;
    REQUIRE(factor.factor(blocks.A));
    y = x;
    factor.solve_in_place({y.data(), static_cast<std::size_t>(n)});
    CHECK(off(y, blocks.dense.llt().solve(x)) < rounding);

    // M = L L^T
    const MatrixXd L = blocks.dense.llt().matrixL();
    y = x;
    factor.solve_upper_in_place({y.data(), static_cast<std::size_t>(n)});
    CHECK(off(L.transpose() * y, x) < rounding);
    MatrixXd X = MatrixXd::Random(n, 2);
    const MatrixXd before = X;
    for (int b = 0; b < blocks.A.blocks(); ++b) factor.solve_lower_in_place(b, X, blocks.A.first[b]);
    CHECK((L * X - before).norm() < rounding * before.norm());

    for (int b = 0; b < blocks.A.blocks(); ++b) {
      const int size = blocks.A.block_size(b);
      const MatrixXd J = MatrixXd::Random(3, size), A = blocks.A.block(b);
      MatrixXd columns = J.transpose();
      factor.solve_block_in_place(b, columns.data(), 3);
      CHECK((A * columns - J.transpose()).norm() < rounding * J.norm());
      double sums[3] = {1, 2, 3};
      factor.add_row_norms(b, J.data(), sums);
      const MatrixXd W = J * A.inverse() * J.transpose();
      for (int i = 0; i < 3; ++i) CHECK(sums[i] - (i + 1) == Approx(W(i, i)).epsilon(rounding));
    }
  }
}

TEST_CASE("columns solved side by side are those solved one at a time, bit for bit", "[block_matrix]") {
  const Blocks blocks = positive_definite(11);
  const int n = blocks.A.order();
  BlockCholesky factor;
  REQUIRE(factor.factor(blocks.A));
  for (int cols = 0; cols <= 9; ++cols) {
    const MatrixXd B = MatrixXd::Random(n, cols);
    MatrixXd together = B, alone = B;
    factor.solve_in_place(together);
    for (int j = 0; j < cols; ++j) factor.solve_in_place({alone.col(j).data(), static_cast<std::size_t>(n)});
    CHECK(together == alone);
    CHECK((blocks.dense * together - B).norm() <= rounding * B.norm());
    for (int b = 0; b < blocks.A.blocks(); ++b) {
      MatrixXd rows = B.middleRows(blocks.A.first[b], blocks.A.block_size(b));
      factor.solve_block_in_place(b, rows.data(), cols);
      CHECK(rows == alone.middleRows(blocks.A.first[b], blocks.A.block_size(b)));
    }
  }
}

TEST_CASE("a factor is that of the blocks as they are now, whichever of them changed", "[block_matrix]") {
  Blocks blocks = positive_definite(7);
  const int n = blocks.A.order();
  BlockCholesky factor;
  REQUIRE(factor.factor(blocks.A));
  const VectorXd x = random_vector(n);
  for (const int changed : {0, 3, 9}) {
    const int at = blocks.A.first[changed], size = blocks.A.block_size(changed);
    blocks.A.block(changed) *= 2 + changed;
    blocks.dense.block(at, at, size, size) *= 2 + changed;
    REQUIRE(factor.factor(blocks.A));
    VectorXd y = x;
    factor.solve_in_place({y.data(), static_cast<std::size_t>(n)});
    CHECK(off(y, blocks.dense.llt().solve(x)) < rounding);
  }
  // One that has none leaves nothing behind.
  Blocks wrong = blocks;
  wrong.A.block(4)(5, 5) = -1;
  CHECK_FALSE(factor.factor(wrong.A));
  wrong.A.block(4)(5, 5) = std::nan("");
  CHECK_FALSE(factor.factor(wrong.A));
  REQUIRE(factor.factor(blocks.A));
  VectorXd y = x;
  factor.solve_in_place({y.data(), static_cast<std::size_t>(n)});
  CHECK(off(y, blocks.dense.llt().solve(x)) < rounding);
}

TEST_CASE("bands of three rows multiply as the whole Jacobian does, from both sides", "[block_matrix]") {
  const Blocks blocks = positive_definite(3);
  const int n = blocks.A.order();
  BandMatrix J;
  const std::vector<std::vector<int>> touched = {{0}, {0, 4}, {1, 2}, {3, 4, 9}, {}, {5, 6, 7, 8}, {4}};
  MatrixXd dense = MatrixXd::Zero(3 * static_cast<int>(touched.size()), n);
  for (std::size_t c = 0; c < touched.size(); ++c) {
    J.add_band();
    for (const int b : touched[c]) {
      const int size = blocks.A.block_size(b);
      const int e = J.add_entry(b, size);
      J.entry(e) = MatrixXd::Random(3, size);
      dense.block(3 * static_cast<int>(c), blocks.A.first[b], 3, size) = J.entry(e);
    }
  }
  CHECK(J.bands() == static_cast<int>(touched.size()));
  const VectorXd v = random_vector(n), r = random_vector(static_cast<int>(dense.rows()));
  VectorXd u = VectorXd::Constant(dense.rows(), 7), y = random_vector(n);
  const VectorXd start = y;
  multiply(J, blocks.A, {v.data(), static_cast<std::size_t>(n)}, {u.data(), static_cast<std::size_t>(u.size())});
  CHECK(off(u, dense * v) < rounding);
  multiply_transposed_add(J, blocks.A, {r.data(), static_cast<std::size_t>(r.size())},
                          {y.data(), static_cast<std::size_t>(n)});
  CHECK(off(y, start + dense.transpose() * r) < rounding);
}

TEST_CASE("sizes of terms are sums of absolute values, whatever cancels", "[block_matrix]") {
  BlockDiagonalMatrix columns;
  for (int b = 0; b < 2; ++b) columns.add_block(2);
  BandMatrix J;
  MatrixXd dense = MatrixXd::Zero(6, 4);
  for (int c = 0; c < 2; ++c) {
    J.add_band();
    for (int b = c; b < 2; ++b) {
      const int e = J.add_entry(b, 2);
      J.entry(e) = MatrixXd::Random(3, 2);
      dense.block(3 * c, 2 * b, 3, 2) = J.entry(e);
    }
  }
  const std::vector<double> v{1, -2, 3, -4}, w{0.5, -0.25, 2, -1, 3, -0.125};
  std::vector<double> terms(2);
  sizes_of_terms(J, columns, v, w, terms);
  const VectorXd sums =
      dense.cwiseAbs() * VectorXd::Map(v.data(), 4).cwiseAbs() + VectorXd::Map(w.data(), 6).cwiseAbs();
  for (int c = 0; c < 2; ++c) CHECK(terms[c] == Approx(sums.segment<3>(3 * c).norm()));
}

TEST_CASE("a block of any size that is not positive definite, or no number, has no factor", "[block_matrix]") {
  for (int n = 1; n <= 9; ++n)
    for (const double last : {-1.0, 0.0, std::nan(""), HUGE_VAL, 1e-3}) {
      INFO(n << " rows, the last " << last);
      BlockDiagonalMatrix A;
      A.add_block(6);
      A.block(0).setIdentity();
      A.add_block(n);
      A.block(1).setIdentity();
      A.block(1)(n - 1, n - 1) = last;
      CHECK(BlockCholesky().factor(A) == (last == 1e-3));
    }
}
