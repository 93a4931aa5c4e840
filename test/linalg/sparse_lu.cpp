#include "linalg/sparse_lu.h"

#include <Eigen/Dense>
#include <catch2/catch.hpp>

using namespace cb;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// A matrix in compressed columns, every second entry of it.
struct Columns {
  std::vector<int> starts{0}, rows;
  std::vector<double> values;
  explicit Columns(const MatrixXd& A) {
    for (int j = 0; j < A.cols(); ++j) {
      for (int i = 0; i < A.rows(); ++i)
        if (A(i, j) != 0) {
          rows.push_back(i);
          values.push_back(A(i, j));
        }
      starts.push_back(static_cast<int>(rows.size()));
    }
  }
};

MatrixXd sparse(int n, unsigned seed) {
  std::srand(seed);
  MatrixXd A = MatrixXd::Random(n, n);
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i)
      if ((i + 2 * j) % 3 != 0) A(i, j) = 0;
  A.diagonal().array() += 2;
  return A;
}

}  // namespace

TEST_CASE("a sparse matrix is solved as the dense one is, with factors that serve again for other values") {
  SparseLu lu;
  CHECK(lu.entries() == 0);
  CHECK(lu.flops() == 0);
  for (const unsigned seed : {1U, 2U}) {
    const MatrixXd A = sparse(12, seed);
    const Columns columns(A);
    REQUIRE(lu.factor(columns.starts, columns.rows, columns.values));
    CHECK(lu.order() == 12);
    CHECK(lu.entries() >= static_cast<double>(columns.values.size()));
    CHECK(lu.flops() > 0);
    const VectorXd b = VectorXd::Random(12);
    VectorXd x = b;
    lu.solve({x.data(), 12});
    CHECK((A * x - b).norm() < 1e-13 * b.norm());
  }
  MatrixXd singular = sparse(12, 3);
  singular.col(5) = singular.col(2);
  const Columns columns(singular);
  CHECK_FALSE(lu.factor(columns.starts, columns.rows, columns.values));

  // One whose last column is empty has no factors to count.
  SparseLu none;
  const std::vector<int> starts = {0, 1, 1}, rows = {0};
  const std::vector<double> values = {1};
  CHECK_FALSE(none.factor(starts, rows, values));
  CHECK(none.entries() == 0);
  CHECK(none.flops() == 0);
}

TEST_CASE("pivots are sought afresh where those of the last matrix would lose its digits") {
  // The same pattern, once with large and once with tiny entries where pivots were.
  MatrixXd A(2, 2);
  A << 1, 0.5, 0.5, 1;
  SparseLu lu;
  for (const double pivot : {1.0, 1e-13}) {
    A(0, 0) = pivot;
    const Columns columns(A);
    REQUIRE(lu.factor(columns.starts, columns.rows, columns.values));
    const VectorXd b = VectorXd::Ones(2);
    VectorXd x = b;
    lu.solve({x.data(), 2});
    CHECK((x - A.fullPivLu().solve(b)).norm() < 1e-14);
  }
}

TEST_CASE("a basis after exchanges is solved as the exchanged matrix is") {
  constexpr int n = 8;  // whole vector registers
  MatrixXd B = MatrixXd::Identity(n, n);
  ProductForm form;
  form.resize(n);
  std::srand(5);
  const auto values = [&](const VectorXd& a) {
    VectorXd y = a;
    form.apply(y.data());
    return y;
  };
  for (const int row : {3, 0, 7, 3}) {
    VectorXd entering = VectorXd::Random(n);
    entering[row] += 2;
    const VectorXd change = -values(entering);
    form.push(change.data(), row);
    B.col(row) = entering;
    VectorXd a = VectorXd::Random(n);
    if (row == 0) a[3] = 0;
    CHECK((B * values(a) - a).norm() < 1e-12);
  }
  CHECK(form.exchanges() == 4);
  form.clear();
  CHECK(values(VectorXd::Ones(n)) == VectorXd::Ones(n));
}

TEST_CASE("pivots that are forgotten leave no trace of the matrix before") {
  // Same pattern; the first takes its pivots off the diagonal, the second would take them there.
  MatrixXd weak = sparse(12, 1);
  weak.diagonal() *= 1e-6;
  const Columns first(weak), second(sparse(12, 2));
  REQUIRE(first.rows == second.rows);
  const auto solved = [&](bool before, bool forgotten) {
    SparseLu lu;
    if (before) REQUIRE(lu.factor(first.starts, first.rows, first.values));
    if (forgotten) lu.forget_pivots();
    REQUIRE(lu.factor(second.starts, second.rows, second.values));
    std::vector<double> x(12, 1.0);
    lu.solve(x);
    return x;
  };
  CHECK(solved(true, false) != solved(false, false));
  CHECK(solved(true, true) == solved(false, false));
}

TEST_CASE("a matrix counts as singular where its pivots are fourteen digits apart, and no sooner") {
  for (const auto& [least, regular] : {std::pair{1e-13, true}, std::pair{1e-15, false}}) {
    const Columns columns(MatrixXd{{1, 1, 0}, {1, 1 + least, 0}, {0, 0, 1}});  // pivots 1, `least`, 1
    SparseLu fresh, used;
    CHECK(fresh.factor(columns.starts, columns.rows, columns.values) == regular);
    const std::vector<double> other{1, 1, 1, 3, 1};  // [1 1; 1 3]
    REQUIRE(used.factor(columns.starts, columns.rows, other));
    CHECK(used.factor(columns.starts, columns.rows, columns.values) == regular);
  }
}

TEST_CASE("exchanges of one row after another come in the order in which they were made") {
  // More than are carried out in one pass, the same row in one pass twice, and rows that wait for one another.
  constexpr int n = 16;
  std::srand(9);
  for (const std::vector<int>& rows : {std::vector<int>{2, 2}, {1, 2, 1, 2}, {0, 1, 2, 3, 0, 1, 2, 3, 4}, {5, 6, 5}}) {
    MatrixXd B = MatrixXd::Identity(n, n);
    ProductForm form;
    form.resize(n);
    for (const int row : rows) {
      VectorXd entering = 0.3 * VectorXd::Random(n);
      entering[row] += 2;
      VectorXd change = entering;
      form.apply(change.data());
      change = -change;
      form.push(change.data(), row);
      B.col(row) = entering;
    }
    CHECK(form.exchanges() == static_cast<int>(rows.size()));
    const VectorXd a = VectorXd::Random(n);
    VectorXd y = a;
    form.apply(y.data());
    CHECK((B * y - a).norm() < 1e-13);
  }
}
