#include <catch2/catch.hpp>
#include <random>

#include "linalg/double_double_lu.h"

using namespace cb;

namespace {

/// Some number with 32 digits, of size 1.
DoubleDouble drawn(std::mt19937& generator) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  return DoubleDouble::sum(uniform(generator), 1e-17 * uniform(generator));
}

double size(const DoubleDouble& x) { return std::abs(static_cast<double>(x)); }

constexpr double digits = 0x1p-98;  // a few roundings

}  // namespace

TEST_CASE("a double's last bit is kept beside a large number, and comes back") {
  const DoubleDouble large = 1e16, sum = large + DoubleDouble(0.3);
  CHECK(static_cast<double>(sum - large) == 0.3);
  CHECK(static_cast<double>(DoubleDouble(1) + 1e-30 - 1) == 1e-30);
  CHECK(DoubleDouble(1) + 1e-30 > DoubleDouble(1));
  CHECK(DoubleDouble(1) - 1e-30 < DoubleDouble(1));
}

TEST_CASE("a product of doubles is exact") {
  const double a = 1 + 0x1p-30, b = 1 - 0x1p-30;
  CHECK(static_cast<double>(DoubleDouble(a) * b - 1) == -0x1p-60);
}

TEST_CASE("quotients and roots are undone by products to 29 digits") {
  std::mt19937 generator(1);
  for (int i = 0; i < 100; ++i) {
    const DoubleDouble a = drawn(generator), b = drawn(generator);
    CHECK(size(a / b * b - a) <= digits * size(a));
    const DoubleDouble square = a * a;
    CHECK(size(sqrt(square) - abs(a)) <= digits * size(a));
    CHECK(size((a + b) * (a - b) - (square - b * b)) <= digits);
  }
  CHECK(static_cast<double>(sqrt(DoubleDouble(0))) == 0);
  CHECK_FALSE(isfinite(DoubleDouble(1) / DoubleDouble(0)));
}

TEST_CASE("elimination solves what a double's digits cannot tell from singular") {
  // Rows that differ by 1e-18 of themselves.
  std::mt19937 generator(2);
  for (const int n : {1, 2, 7, 30}) {
    std::vector<std::vector<DoubleDouble>> A(n, std::vector<DoubleDouble>(n));
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) A[i][j] = i == 0 ? drawn(generator) : A[0][j] + 1e-18 * drawn(generator);
    DoubleDoubleLu lu;
    lu.resize(n);
    DoubleDoubleVector x(n);
    std::vector<DoubleDouble> expected(n);
    for (DoubleDouble& value : expected) value = drawn(generator);
    for (int i = 0; i < n; ++i) {
      DoubleDouble sum;
      for (int j = 0; j < n; ++j) {
        lu.add(i, j, A[i][j]);
        sum += A[i][j] * expected[j];
      }
      x.set(i, sum);
    }
    REQUIRE(lu.factor());
    lu.solve_in_place(x);
    INFO(n << " unknowns");
    for (int i = 0; i < n; ++i) CHECK(size(x[i] - expected[i]) <= 1e-8);
  }
}

TEST_CASE("a singular matrix is refused") {
  DoubleDoubleLu lu;
  lu.resize(2);
  lu.add(0, 0, 1);
  lu.add(1, 0, 3);
  CHECK_FALSE(lu.factor());
}

TEST_CASE("sums of multiples and inner products have 29 digits in every lane") {
  std::mt19937 generator(3);
  for (const int n : {1, 3, 4, 8, 13, 40}) {
    DoubleDoubleVector x(n), y(n), z(n);
    const DoubleDouble a = drawn(generator);
    DoubleDouble sum;
    for (int i = 0; i < n; ++i) {
      x.set(i, drawn(generator));
      y.set(i, drawn(generator));
      z.set(i, y[i] + a * x[i]);
      sum += x[i] * y[i];
    }
    CHECK(size(dot(x.high.data(), x.low.data(), y.high.data(), y.low.data(), n) - sum) <= n * digits);
    add_multiple(a, x.high.data(), x.low.data(), y.high.data(), y.low.data(), n);
    for (int i = 0; i < n; ++i) CHECK(size(y[i] - z[i]) <= digits);
  }
}

TEST_CASE("numbers of two doubles are ordered by the second where the first are the same") {
  const DoubleDouble low(1, -1e-20), one = 1, high(1, 1e-20);
  CHECK(low < one);
  CHECK(one < high);
  CHECK_FALSE(high < one);
  CHECK_FALSE(one < one);
  CHECK(high > one);
  CHECK_FALSE(low > one);
  CHECK(low <= one);
  CHECK(one <= one);
  CHECK_FALSE(high <= one);
  CHECK(high >= one);
  CHECK(one >= one);
  CHECK_FALSE(low >= one);
  CHECK(DoubleDouble(2) > high);
  CHECK(DoubleDouble(0.5, 1) <= one);
  CHECK_FALSE(high == one);
  CHECK(DoubleDouble(1, 1e-20) == high);
  CHECK(abs(DoubleDouble(-2, 1e-20)) == DoubleDouble(2, -1e-20));
  CHECK(abs(high) == high);
  CHECK(-high == DoubleDouble(-1, -1e-20));
  CHECK(pow(DoubleDouble(3), 0) == one);
  CHECK(pow(DoubleDouble(3), 1) == DoubleDouble(3));
  CHECK(pow(DoubleDouble(3), 4) == DoubleDouble(81));
  CHECK_FALSE(isfinite(DoubleDouble(HUGE_VAL)));
  CHECK_FALSE(isfinite(DoubleDouble(NAN)));
  CHECK(isfinite(high));
  CHECK(std::isinf(sqrt(DoubleDouble(HUGE_VAL)).high));
  CHECK(std::isnan(sqrt(DoubleDouble(-1)).high));
  DoubleDouble x = 6;
  x *= 2;
  CHECK(x == DoubleDouble(12));
  x /= 3;
  CHECK(x == DoubleDouble(4));
  x -= 1;
  CHECK(x == DoubleDouble(3));
}

TEST_CASE("elimination exchanges rows where a pivot would be zero or small") {
  // 1e-30 first: without the exchange nothing would be left of the second row.
  for (const double first : {0.0, 1e-30}) {
    DoubleDoubleLu lu;
    lu.resize(3);
    const double A[3][3] = {{first, 1, 2}, {1, 1, 1}, {4, -1, 0}};
    DoubleDoubleVector x(3);
    for (int i = 0; i < 3; ++i) {
      double sum = 0;
      for (int j = 0; j < 3; ++j) {
        lu.add(i, j, A[i][j]);
        sum += A[i][j] * (j + 1) * (i == 0 && j == 0 ? 0 : 1);
      }
      x.set(i, DoubleDouble(sum) + DoubleDouble(i == 0 ? first : 0));
    }
    REQUIRE(lu.factor());
    lu.solve_in_place(x);
    for (int i = 0; i < 3; ++i) CHECK(size(x[i] - DoubleDouble(i + 1)) <= 1e-28);
  }
  DoubleDoubleLu lu;
  lu.resize(1);
  lu.add(0, 0, NAN);
  CHECK_FALSE(lu.factor());
}
