#include "linalg/dormand_prince.h"

#include <catch2/catch.hpp>
#include <cmath>

using namespace cb;

// The slopes of a quadrature: stage i has 2 c_i^p (not 1 at the end, whose inverse is itself), whose integral is
// 2 / (p + 1).
TEST_CASE("the step integrates to order 5 and its error vanishes to order 4, and no further", "[dormand_prince]") {
  using namespace dormand_prince;
  for (int p = 0; p <= 5; ++p) {
    INFO("slope c^" << p);
    const auto k = [p](double c) { return p == 0 ? 2.0 : 2 * std::pow(c, p); };
    const double sum = whole(k(0), k(c3), k(c4), k(c5), k(1)), off = error(k(0), k(c3), k(c4), k(c5), k(1), k(1));
    CHECK((std::abs(sum - 2.0 / (p + 1)) < 2e-15) == (p < 5));
    CHECK((std::abs(off) < 2e-15) == (p < 4));
  }
}

TEST_CASE("each stage stands where its weights add up to", "[dormand_prince]") {
  using namespace dormand_prince;
  const double one = 1;
  CHECK(second(one) == Approx(c2).epsilon(1e-15));
  CHECK(third(one, one) == Approx(c3).epsilon(1e-15));
  CHECK(fourth(one, one, one) == Approx(c4).epsilon(1e-14));
  CHECK(fifth(one, one, one, one) == Approx(c5).epsilon(1e-14));
  CHECK(sixth(one, one, one, one, one) == Approx(1).epsilon(1e-14));
  // And where a slope that grows with time has it: c^2 / 2.
  CHECK(third(0.0, c2) == Approx(c3 * c3 / 2).epsilon(1e-14));
  CHECK(fourth(0.0, c2, c3) == Approx(c4 * c4 / 2).epsilon(1e-14));
  CHECK(fifth(0.0, c2, c3, c4) == Approx(c5 * c5 / 2).epsilon(1e-14));
  CHECK(sixth(0.0, c2, c3, c4, c5) == Approx(0.5).epsilon(1e-14));
}
