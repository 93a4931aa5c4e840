// The algebra of one second-order cone (second_order_cone.h), in both kinds of numbers.
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "cone/second_order_cone.h"
#include "linalg/double_double.h"

using namespace cb;

namespace {

template <class Real>
struct Drawn {
  std::mt19937 generator;
  std::uniform_real_distribution<double> uniform{-1, 1};
  explicit Drawn(unsigned seed) : generator(seed) {}
  Real number() { return Real(uniform(generator)) + Real(1e-17 * uniform(generator)); }
  ConeVector<Real> vector() { return {number(), number(), number()}; }
  /// In the inside of the cone.
  ConeVector<Real> inside() {
    ConeVector<Real> x = vector();
    x[0] = Real(std::hypot(double(x[1]), double(x[2]))) + Real(0.01 + std::abs(uniform(generator)));
    return x;
  }
};

template <class Real>
double size(const ConeVector<Real>& x) {
  return std::sqrt(double(x.dot(x)));
}

}  // namespace

TEMPLATE_TEST_CASE("the scaling of a cone takes both of its points to the same", "[cone]", double, DoubleDouble) {
  const double digits = std::is_same_v<TestType, double> ? 1e-13 : 1e-27;
  Drawn<TestType> drawn(1);
  for (int trial = 0; trial < 50; ++trial) {
    const ConeVector<TestType> x = drawn.inside(), z = drawn.inside() * TestType(10), any = drawn.vector();
    const auto W = ConeScaling<TestType>::of(x, z);
    const ConeVector<TestType> lambda = W.apply(z);
    CHECK(size<TestType>(lambda - W.apply_inverse(x)) <= 1e2 * digits * size(lambda));
    CHECK(lambda[0] > 0);
    CHECK(size<TestType>(W.apply(W.apply_inverse(any)) - any) <= 1e3 * digits);
    CHECK(size<TestType>(W.squared() * any - W.apply(W.apply(any))) <= 1e4 * digits);
    CHECK(size<TestType>(W.inverse_squared() * any - W.apply_inverse(W.apply_inverse(any))) <= 1e4 * digits);
    // x = W W z, and W is symmetric.
    CHECK(size<TestType>(W.squared() * z - x) <= 1e3 * digits * size(x));
    const ConeVector<TestType> other = drawn.vector();
    CHECK(std::abs(double(other.dot(W.apply(any)) - any.dot(W.apply(other)))) <= 1e3 * digits);
    // lambda o lambda has x.z in its first entry.
    CHECK(std::abs(double(lambda.dot(lambda) - x.dot(z))) <= 1e2 * digits * double(x.dot(z)));
  }
}

TEMPLATE_TEST_CASE("a Jordan product is undone by the division", "[cone]", double, DoubleDouble) {
  const double digits = std::is_same_v<TestType, double> ? 1e-12 : 1e-26;
  const ConeVector<TestType> product = jordan<TestType>({1, 2, 3}, {4, 5, -6});
  CHECK(double(product[0]) == 4 + 10 - 18);
  CHECK(double(product[1]) == 1 * 5 + 4 * 2);
  CHECK(double(product[2]) == 1 * -6 + 4 * 3);
  Drawn<TestType> drawn(2);
  for (int trial = 0; trial < 50; ++trial) {
    const ConeVector<TestType> lambda = drawn.inside(), d = drawn.vector();
    const ConeVector<TestType> u = jordan_divide(lambda, d);
    CHECK(size<TestType>(jordan<TestType>(lambda, u) - d) <= digits * (1 + size(u)));
  }
}

TEST_CASE("a step ends where it leaves the cone, through its side or its tip, or nowhere", "[cone]") {
  const double never = std::numeric_limits<double>::infinity();
  using Three = ConeVector<double>;
  const auto step = [](const Three& x, const Three& dx) { return cone_step<double>(x, dx); };
  CHECK(step({2, 0, 0}, {0, 1, 0}) == Approx(2));
  CHECK(step({2, 0, 0}, {0, 0.6, -0.8}) == Approx(2));
  CHECK(step({2, 0, 1}, {1, 0, 3}) == Approx(0.5));   // 2 + t = 1 + 3 t
  CHECK(step({2, 0, 1}, {1, 0, -3}) == Approx(1.5));  // 2 + t = 3 t - 1
  CHECK(step({2, 0, 0}, {-1, 0, 0}) == Approx(2));
  CHECK(step({2, 0, 0}, {-1, 1, 0}) == Approx(1));
  CHECK(step({3, 1, 0}, {-1, 0, 1}) == Approx(4.0 / 3));  // (3 - t)^2 = 1 + t^2
  CHECK(step({2, 0, 1}, {1, 0.6, 0.8}) == never);         // along the side
  CHECK(step({2, 0, 1}, {1, 0, 0}) == never);
  CHECK(step({2, 0, 1}, {0, 0, 0}) == never);
  CHECK(step({2, 0, 1}, {-2, 0, -1}) == Approx(1));  // into the tip
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int trial = 0; trial < 200; ++trial) {
    const Three x(1.5, uniform(generator), uniform(generator)), dx(uniform(generator), 3 * uniform(generator), 2);
    if (cone_product(x) <= 0.01) continue;
    const double t = step(x, dx);
    REQUIRE(t < never);  // |dx_t| > dx_0
    const Three end = x + t * dx, before = x + 0.999 * t * dx;
    CHECK(std::hypot(end[1], end[2]) == Approx(end[0]).margin(1e-12));
    CHECK(cone_product(before) > 0);
    CHECK(before[0] > 0);
  }
  CHECK(ray_step(3.0, -2.0) == 1.5);
  CHECK(ray_step(3.0, 2.0) == never);
  CHECK(ray_step(3.0, 0.0) == never);
}

TEST_CASE("the product of a cone has its digits near the side too", "[cone]") {
  CHECK(cone_product<double>({3, 1, -2}) == Approx(4).epsilon(1e-15));
  CHECK(cone_product<double>({1, 2, 0}) == Approx(-3).epsilon(1e-15));
  const double off = 0x1p-40;
  CHECK(cone_product<double>({1 + off, 0.6, 0.8}) == Approx(off * (2 + off)).epsilon(1e-3));
  const double n[] = {2, 3, -4};
  CHECK(in_primal<double>(n, 0.5) == ConeVector<double>(1, 3, -4));
  CHECK(in_dual<double>(n, 0.5) == ConeVector<double>(4, 3, -4));
}
