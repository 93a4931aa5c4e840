#include "linalg/stopping_impulse.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "linalg/convex_search.h"
#include "linalg/proximal_term.h"

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

TEST_CASE("contacts of the set stop in all their rows, those beside it get nothing, whatever each weighs") {
  // Two bodies of three rates; contacts 0 and 2 are the set.
  BlockDiagonalMatrix M;
  M.add_block(3);
  M.add_block(3);
  M.block(0).diagonal() << 1, 2, 4;
  M.block(1).diagonal() << 100, 50, 25;
  BlockCholesky factor;
  REQUIRE(factor.factor(M));
  BandMatrix J;
  for (const int b : {0, 0, 1}) {
    J.add_band();
    auto entry = J.entry(J.add_entry(b, 3));
    entry << 1, 0.5, 0, 0, 1, 0.25, 0.125, 0, 1;
    if (J.bands() == 2) entry *= 2;
  }
  const std::vector<double> weight{0.5, 2, 0.02}, u{-1, 2, 3, 7, 7, 7, 4, -5, 6};
  const std::vector<char> in_set{1, 0, 1};
  for (const int rows : {3, 1}) {
    StoppingImpulse stop;
    REQUIRE(stop.prepare(M, J, factor, weight, in_set, rows));
    std::vector<double> r(9, 0.0), v(6, 0.0), change(9);
    r[4] = 9;  // of a contact beside the set: kept
    std::vector<double> own = r;
    stop.correct(u, r);
    CHECK(r[3] == 0);
    CHECK(r[4] == 9);
    for (std::size_t i = 0; i < r.size(); ++i) own[i] = r[i] - own[i];
    multiply_transposed_add(J, M, own, v);
    factor.solve_in_place(v);
    multiply(J, M, v, change);
    for (const int c : {0, 2})
      for (int i = 0; i < rows; ++i) CHECK(change[3 * c + i] == Approx(-u[3 * c + i]).epsilon(1e-12));
    if (rows == 1)
      for (const int c : {0, 2}) CHECK(r[3 * c + 1] == 0);
  }
}

TEST_CASE("of all velocities that move contacts as asked the least has the least energy") {
  // Masses 1, 2 and 4; J = (1, 1, 0): v = M^-1 J^T 3 / 1.5.
  BlockDiagonalMatrix M;
  M.add_block(3);
  M.block(0).diagonal() << 1, 2, 4;
  BlockCholesky factor;
  REQUIRE(factor.factor(M));
  BandMatrix J;
  J.add_band();
  J.entry(J.add_entry(0, 3)).row(0) << 1, 1, 0;
  StoppingImpulse stop;
  REQUIRE(stop.prepare(M, J, factor, std::vector<double>{0.3}, std::vector<char>{1}, 1));
  std::vector<double> v(3);
  stop.least_velocity(std::vector<double>{3, 0, 0}, factor, v);
  CHECK(v[0] == Approx(2));
  CHECK(v[1] == Approx(1));
  CHECK(v[2] == Approx(0).margin(1e-15));
}

TEST_CASE(
    "a search along a line takes a whole step that is good, goes on where it falls, comes back, and stays uphill") {
  const auto to = [](double least) { return convex_search({}, [=](double x) { return Along{2 * (x - least), 2}; }); };
  CHECK(to(1.1) == 1);
  CHECK(to(0.8) == 1);  // the slope is 0.25 of the start's
  CHECK(to(0.7) == Approx(0.7));
  CHECK(to(0.2) == Approx(0.2));
  CHECK(to(3) == Approx(3));
  CHECK(to(0) == 0);
  CHECK(to(-1) == 0);
  // A kink, where Newton's steps leave the bracket: slope -1 before 0.5, 10 after.
  CHECK(convex_search({}, [](double x) { return Along{x < 0.5 ? -1.0 : 10.0, 1e-3}; }) == Approx(0.5).margin(1e-12));
}

TEST_CASE(
    "a proximal term falls by tenths while points are found, goes back where one is not, and ends at either side") {
  ProximalTerm t(1e-3);
  CHECK(t() == 0.1);
  t.found();
  CHECK(t() == Approx(0.01));
  t.missed();  // back towards 0.1, and more slowly down from there
  CHECK(t() == Approx(0.03));
  CHECK_FALSE(t.over());
  t.found();
  CHECK(t() == Approx(0.03 * std::sqrt(0.1)));
  t.found();
  CHECK(t() == Approx(0.003 * std::sqrt(0.1)));
  CHECK(t.over());
  ProximalTerm none(1e-3);
  int misses = 0;
  for (; !none.over(); ++misses) none.missed();
  CHECK(misses == 9);  // 0.1 times 3^9 is beyond 1000
}

TEST_CASE("after points that were missed again and again a proximal term goes back no further than the last found") {
  ProximalTerm t(1e-3);
  t.found();                                     // at 0.1
  for (const double next : {0.03, 0.09, 0.1}) {  // by threes, as far as that
    t.missed();
    CHECK(t() == Approx(next));
  }
  t.missed();  // none there either
  CHECK(t() == Approx(0.3));
  // It has slowed down: its fall is 0.1^(1/2), ^(1/4), ^(1/8), and 0.8 at most.
  t.found();
  CHECK(t() == Approx(0.3 * 0.8));
  t.found();
  CHECK(t() == Approx(0.3 * 0.8 * 0.64));
}

TEST_CASE("impulses that stop are found by dense matrices up to a size, and beyond it not at all") {
  const auto served = [](int bodies, int contacts, int rows) {
    BlockDiagonalMatrix M;
    for (int b = 0; b < bodies; ++b) M.block(M.add_block(3)).setIdentity();
    BlockCholesky factor;
    REQUIRE(factor.factor(M));
    BandMatrix J;
    for (int c = 0; c < contacts; ++c) {
      J.add_band();
      J.entry(J.add_entry(c % bodies, 3)).setIdentity();
    }
    StoppingImpulse stop;
    const std::vector<double> weight(contacts, 1.0);
    return stop.prepare(M, J, factor, weight, std::vector<char>(contacts, 1), rows);
  };
  CHECK(served(2, 32, 3));
  CHECK_FALSE(served(2, 33, 3));
  CHECK(served(2, 96, 1));
  CHECK_FALSE(served(2, 97, 1));
  CHECK(served(32, 1, 3));
  CHECK_FALSE(served(33, 1, 3));
  CHECK_FALSE(served(1, 0, 3));
}

TEST_CASE("a search along a line ends where the slope is the part of the start's that is asked for") {
  // Slope -1 + x^3: 0.729 - 1 at 0.9.
  const auto cubic = [](double x) { return Along{x * x * x - 1, 3 * x * x}; };
  CHECK(convex_search({}, cubic) == 1);
  for (const double part : {0.3, 1e-3, 1e-9}) {
    const double x = convex_search({part, 100}, [&](double a) { return cubic(a / 4); });
    CHECK(std::abs(cubic(x / 4).slope) <= part);
    CHECK(x > 1);
    const double y = convex_search({part, 100}, [&](double a) { return cubic(3 * a); });
    CHECK(std::abs(cubic(3 * y).slope) <= part);
  }
  // Newton's step is too short where the curve is steep at the start alone: it goes on by a tenth at least.
  int evaluations = 0;
  const double x = convex_search({}, [&](double a) {
    ++evaluations;
    return Along{a < 2 ? -1.0 : 0.0, 1e9};
  });
  CHECK(x >= 2);
  CHECK(evaluations <= 12);  // 1.1^8 > 2
  // What never comes to an end does so at the limit.
  evaluations = 0;
  convex_search({0.3, 5}, [&](double) {
    ++evaluations;
    return Along{-1, 1};
  });
  CHECK(evaluations == 6);
}
