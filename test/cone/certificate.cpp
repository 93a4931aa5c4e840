// What an answer to a cone program is worth, by hand: velocities and impulses are made up, and belong to no motion.

#include "cone/certificate.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>

using namespace cb;

namespace {

// Three contacts of which no two have a number in common. The second's normal velocity may fall below 0 by its slack;
// the third's is fixed, has no friction, and does not count in the sum of normal impulses.
struct Answer {
  BlockDiagonalMatrix M;
  BandMatrix J;
  std::vector<double> mu{0.5, 0.2, 0}, weight{4, 0.25, 1}, slack{0, 0.03, 0.05}, share{1, 1, 0};
  std::vector<char> fixed{0, 0, 1};
  std::vector<double> r{3, 1, 0, 5, 0, -1, 7, 0, 0}, eta{2, 4, -6};
  // Before the impulses: 24^2 / 4 + 2.5^2 / 0.25 = 13^2 J; what approached asks for 24 / 4 = 6 N s.
  std::vector<double> q{-24, 0, 0, 0, 0, 2.5, 0, 0, 0};
  ConeVelocities velocities;
  ConeProgram p;

  Answer() {
    M.add_block(3);
    for (int c = 0; c < 3; ++c) {
      J.add_band();
      J.add_entry(0, 3);
    }
    velocities.u = {0.5, 0, 0, -0.02, 0, 0, 0, 0, 0};
    // Short of the dual cone by mu |y_t| - y_n = 0.4, 0.95 and nothing.
    velocities.u_hat = {0.1, 0.6, 0.8, 0.05, 3, -4, 0.3, 0, 0};
    p.bounded_below = true;
    p.kappa = 10;
  }
  void excuse(double unit) { velocities.rounding = {unit / 8, 2 * unit / 8, 4 * unit / 8}; }
  Certificate certificate(bool with_eta = true) {
    p.M = &M;
    p.J = &J;
    p.mu = &mu;
    p.weight = &weight;
    p.slack = &slack;
    p.fixed = &fixed;
    p.share = &share;
    return certify(p, r, with_eta ? std::span<const double>(eta) : std::span<const double>(), velocities, q, 8);
  }
};

}  // namespace

TEST_CASE("the gap sums what multipliers and impulses leave at each contact, and the bound's", "[cone]") {
  Answer answer;
  answer.velocities.u[6] = 0.25;
  const double impulses = (3 * 0.1 + 1 * 0.6) + (5 * 0.05 + 1 * 4) + 7 * 0.3;
  Certificate found = answer.certificate();
  CHECK(found.s == Approx(0.95));
  CHECK(found.size == Approx(13));
  CHECK(found.gap == Approx(2 * 0.5 + 4 * (0.03 - 0.02) - 6 * 0.25 + impulses + 0.95 * 10));
  CHECK(found.gap_rounding == Approx(0.95 * 8 * std::numeric_limits<double>::epsilon() * 10));  // the sum's
  CHECK(answer.certificate(false).gap == Approx(impulses + 0.95 * 10));
  // Below its slack a velocity is infeasible, and takes nothing off the gap.
  answer.velocities.u[3] = -0.05;
  CHECK(answer.certificate().gap == Approx(2 * 0.5 - 6 * 0.25 + impulses + 0.95 * 10));
  // Beyond its bound the sum, 8 N s, leaves nothing of it, but counts itself.
  answer.p.kappa = 5;
  CHECK(answer.certificate(false).gap == Approx(impulses + 0.95 * 8));
  answer.p.kappa = HUGE_VAL;
  found = answer.certificate(false);
  CHECK(found.s == 0);
  CHECK(found.gap == Approx(impulses));
  answer.velocities.u[3] = NAN;
  found = answer.certificate();
  CHECK(found.gap == HUGE_VAL);
  CHECK(found.infeasibility == HUGE_VAL);
}

TEST_CASE("the size of an answer is the largest of its impulses', its velocities' and those without impulses",
          "[cone]") {
  Answer answer;
  answer.r = {9, 0, 0, 0, 0, 2, 0, 12, 0};  // 4 81 + 4 / 4 + 144 = 469
  CHECK(answer.certificate().size == Approx(std::sqrt(469)));
  answer.velocities.u = {20, 0, 4, 0, 7, 0, 0, 0, 10};  // 416 / 4 + 49 4 + 100 = 400
  CHECK(answer.certificate().size == Approx(std::sqrt(469)));
  answer.r.assign(9, 0.0);
  CHECK(answer.certificate().size == Approx(20));
}

TEST_CASE("each way to be infeasible counts by itself, the worst of all as a fraction of the size", "[cone]") {
  struct Case {
    const char* what;
    std::function<void(Answer&)> change;
    double infeasibility;
  };
  const auto without_bound = [](Answer& a) { a.p.kappa = HUGE_VAL; };
  const Case cases[] = {
      {"nothing", [](Answer&) {}, 0},
      {"a fixed velocity falls", [](Answer& a) { a.velocities.u[6] = -0.26; }, 0.26 / 13},
      {"a fixed velocity rises", [](Answer& a) { a.velocities.u[6] = 0.26; }, 0.26 / 13},
      {"an approach beyond its slack", [](Answer& a) { a.velocities.u[3] = -0.16; }, 0.13 / 0.5 / 13},
      {"it beside less that approached",
       [](Answer& a) {
         a.velocities.u[3] = -0.16;
         a.p.before = 2;
       },
       0.13 / 0.5 / 2},
      {"it where the sum alone is bounded",
       [](Answer& a) {
         a.velocities.u[3] = -0.16;
         a.p.bounded_below = false;
       },
       0},
      {"it where nothing is bounded",
       [](Answer& a) {
         a.velocities.u[3] = -1.5;
         a.p.bounded_below = false;
         a.p.kappa = HUGE_VAL;
       },
       (1.5 - 0.03) / 0.5 / 13},
      {"a pull",
       [](Answer& a) {
         a.r[0] = -0.13;
         a.r[1] = 0;
       },
       0.13 * 2 / 13},
      {"a tangential impulse beyond the cone", [](Answer& a) { a.r[5] = -1.26; }, 0.26 * 0.5 / 13},
      {"a multiplier that pulls", [](Answer& a) { a.eta[0] = -0.065; }, 0.065 * 2 / 13},
      {"velocities beyond the dual cone without a bound", without_bound, 0.95 / 0.5 / 13},
      {"those of a contact that the bound does not count", [](Answer& a) { a.velocities.u_hat[6] = -0.13; }, 0.13 / 13},
      {"a sum beyond its bound", [](Answer& a) { a.p.kappa = 5; }, (8 - 5) / 6.0},
      {"a sum beyond a bound that is more than what approached asks for", [](Answer& a) { a.p.kappa = 7; }, 1 / 7.0},
      {"two of them, the worse one first",
       [](Answer& a) {
         a.r[5] = -1.52;
         a.velocities.u[6] = 0.13;
       },
       0.52 * 0.5 / 13},
  };
  for (const Case& one : cases) {
    INFO(one.what);
    Answer answer;
    one.change(answer);
    CHECK(answer.certificate().infeasibility == Approx(one.infeasibility));
  }
}

TEST_CASE("what rounding excuses of a velocity is none of its errors, contact by contact", "[cone]") {
  struct Case {
    const char* what;
    std::function<void(Answer&)> change;
    double infeasibility;
  };
  // Excused: 0.01, 0.02 and 0.04 sqrt(J).
  const Case cases[] = {
      {"nothing", [](Answer&) {}, 0},
      {"a fixed velocity", [](Answer& a) { a.velocities.u[6] = -0.3; }, 0.26 / 13},
      {"a fixed velocity within it", [](Answer& a) { a.velocities.u[6] = -0.039; }, 0},
      {"an approach", [](Answer& a) { a.velocities.u[3] = -0.17; }, (0.14 / 0.5 - 0.02) / 13},
      {"velocities beyond the dual cone", [](Answer& a) { a.p.kappa = HUGE_VAL; }, (0.95 / 0.5 - 1.2 * 0.02) / 13},
      {"a sum beyond its bound", [](Answer& a) { a.p.kappa = 5; }, (3 - (0.01 / 2 + 0.02 / 0.5 + 0.04)) / 6},
      {"an impulse, which is exact", [](Answer& a) { a.r[5] = -1.26; }, 0.26 * 0.5 / 13},
  };
  for (const Case& one : cases) {
    INFO(one.what);
    Answer answer;
    answer.excuse(0.01);
    one.change(answer);
    CHECK(answer.certificate().infeasibility == Approx(one.infeasibility));
  }
}

TEST_CASE("the rounding of a gap is that of the velocities, times what they are multiplied by", "[cone]") {
  Answer answer;
  const double unit = 1e-12;
  answer.excuse(unit);
  const auto of_gap = [&](double s, bool with_eta) {
    const double eta[3] = {2, 4, 6};
    const double r[3] = {std::sqrt(10), std::sqrt(26), 7}, root[3] = {2, 0.5, 1};
    const double y[3] = {std::sqrt(1.01), std::sqrt(25.0025), 0.3}, excused[3] = {unit, 2 * unit, 4 * unit};
    double sum = 0;
    for (int c = 0; c < 3; ++c)
      sum += excused[c] * (root[c] * (r[c] + (with_eta ? eta[c] : 0)) + (y[c] + 2 * s) / root[c]);
    return sum;
  };
  // The bound's multiplier is wrong by (1 + mu) times what is excused, at worst at the first contact, and acts on
  // kappa.
  const double eps = std::numeric_limits<double>::epsilon();
  const double of_bound = 0.95 * (unit / 2 + 2 * unit / 0.5 + 4 * unit + 8 * eps * 10) + 1.5 * unit * 2 * 10;
  for (const bool with_eta : {true, false})
    CHECK(answer.certificate(with_eta).gap_rounding == Approx(of_gap(0.95, with_eta) + of_bound).epsilon(1e-9));
  answer.p.kappa = HUGE_VAL;
  for (const bool with_eta : {true, false})
    CHECK(answer.certificate(with_eta).gap_rounding == Approx(of_gap(0, with_eta)).epsilon(1e-9));
  answer.excuse(1);
  CHECK(answer.certificate().gap_rounding == Approx(1e-9 * 169));
}
