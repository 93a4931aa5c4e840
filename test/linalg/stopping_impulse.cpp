#include "linalg/stopping_impulse.h"

#include <catch2/catch.hpp>
#include <cmath>

using namespace cb;

TEST_CASE("rows that are nearly the same are told apart down to a billionth, and no further") {
  // Normals of a point of 1 kg that are `apart` (rad) from each other.
  for (const double apart : {1e-2, 1e-4, 1e-6, 1e-12}) {
    BlockDiagonalMatrix M;
    M.add_block(3);
    M.block(0).setIdentity();
    BlockCholesky factor;
    REQUIRE(factor.factor(M));
    BandMatrix J;
    for (int c = 0; c < 2; ++c) {
      J.add_band();
      auto entry = J.entry(J.add_entry(0, 3));
      entry.setZero();
      entry.row(0) << 1, c * apart, 0;
    }
    StoppingImpulse stop;
    const std::vector<double> weight(2, 1.0);
    const std::vector<char> in_set(2, 1);
    REQUIRE(stop.prepare(M, J, factor, weight, in_set, 1));
    const std::vector<double> v{-1, -0.5, 0};
    std::vector<double> u(6, 0.0), r(6, 0.0), change(3, 0.0);
    for (int c = 0; c < 2; ++c) u[3 * c] = v[0] + c * apart * v[1];
    stop.correct(u, r);
    multiply_transposed_add(J, M, r, change);
    INFO(apart << " rad");
    CHECK(change[0] == Approx(1).epsilon(1e-9));
    CHECK(change[1] == Approx(apart > 1e-9 ? 0.5 : 0).margin(1e-6));
  }
}
