#include "linalg/finite.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <vector>

#include "linalg/pack.h"

using namespace cb;

TEST_CASE("numbers are finite where none of them is not, wherever it stands and however large they are") {
  const double largest = std::numeric_limits<double>::max();
  CHECK(all_finite({}));
  for (const int n : {1, 3, 4, 7, 16, 33}) {
    std::vector<double> x(n, largest);
    x[0] = -largest;
    CHECK(all_finite(x));
    for (const int at : {0, n / 2, n - 1})
      for (const double bad : {HUGE_VAL, -HUGE_VAL, std::nan("")}) {
        std::vector<double> y = x;
        y[at] = bad;
        CHECK_FALSE(all_finite(y));
      }
  }
}

TEST_CASE("the largest of four is found in each place") {
  for (int at = 0; at < 4; ++at) {
    Pack x = {-4, -3, -2.5, -6};
    x[at] = -1;
    CHECK(largest_of(x) == -1);
  }
  Pack x = {1, 2, 3, 4};
  add_fused(Pack{1, 2, 3, 4}, Pack{2, 2, 2, 3}, x);
  subtract_fused(Pack{1, 1, 1, 2}, 1.0, x);
  for (int i = 0; i < 4; ++i) CHECK(x[i] == (i < 3 ? 3 * (i + 1) - 1 : 14));
}
