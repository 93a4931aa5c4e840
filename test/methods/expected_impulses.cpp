#include "methods/expected_impulses.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

using namespace cb;

namespace {

/// Impulses of a contact at event k: polynomials in k, all of them of that order.
std::vector<double> polynomial(int order, double k) {
  const double x = std::pow(k, order);
  return {2 + x, -1 - 0.5 * x, 0.25 * x};
}

double worst_difference(const std::vector<double>& a, const std::vector<double>& b) {
  REQUIRE(a.size() == b.size());
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i) worst = std::max(worst, std::abs(a[i] - b[i]));
  return worst;
}

}  // namespace

TEST_CASE("polynomials up to the third order are expected to go on", "[expected_impulses]") {
  for (int order = 0; order <= 3; ++order) {
    ExpectedImpulses expected;
    for (int k = 1; k <= 7; ++k) expected.note(polynomial(order, k));
    INFO("order " << order);
    CHECK(worst_difference(expected.next(), polynomial(order, 8)) < 1e-11);
  }
}

TEST_CASE("of one event the same is expected, of two their change, once more", "[expected_impulses]") {
  ExpectedImpulses expected;
  CHECK(expected.next().empty());
  expected.note({1, 2, 3});
  CHECK(expected.next() == std::vector<double>{1, 2, 3});
  expected.note({1.5, 2, 3});
  CHECK(expected.next() == std::vector<double>{1.5, 2, 3});  // nothing says yet that it goes on
  expected.note({2, 2, 3});
  CHECK(expected.next() == std::vector<double>{2.5, 2, 3});
}

TEST_CASE("what stays is expected to the last bit, whatever its neighbour does", "[expected_impulses]") {
  ExpectedImpulses expected;
  const std::vector<double> rests{0.1, 1.0 / 3, -0.7};
  for (int k = 0; k < 7; ++k) {
    std::vector<double> both = rests;
    for (const double x : polynomial(2, k)) both.push_back(x);
    expected.note(both);
  }
  for (int i = 0; i < 3; ++i) CHECK(expected.next()[i] == rests[i]);
  CHECK(expected.next()[3] == Approx(polynomial(2, 7)[0]).margin(1e-12));
}

TEST_CASE("friction that turns steadily is foreseen ever better, a jump is not carried on", "[expected_impulses]") {
  ExpectedImpulses expected;
  const auto turning = [](int k) { return std::vector<double>{1, 0.3 * std::cos(1e-2 * k), 0.3 * std::sin(1e-2 * k)}; };
  for (int k = 0; k < 8; ++k) {
    if (k >= 5) CHECK(worst_difference(expected.next(), turning(k)) < 1e-8);
    expected.note(turning(k));
  }
  const std::vector<double> lies{1, 0, 0};
  expected.note(lies);
  CHECK(expected.next() == lies);
  for (int k = 0; k < 5; ++k) expected.note(lies);
  CHECK(expected.next() == lies);
}

TEST_CASE("events of another size are a new beginning", "[expected_impulses]") {
  ExpectedImpulses expected;
  for (int k = 0; k < 4; ++k) expected.note({1.0 + k, 0, 0});
  expected.note({1, 2, 3, 4, 5, 6});
  CHECK(expected.next() == std::vector<double>{1, 2, 3, 4, 5, 6});
  expected.note({7, 0, 0});
  CHECK(expected.next() == std::vector<double>{7, 0, 0});
}
