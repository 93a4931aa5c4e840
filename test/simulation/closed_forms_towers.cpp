// Overhanging towers either side of the harmonic series.

#include "closed_forms.h"

using namespace cb;
using namespace cb::test;

namespace {

constexpr double g = 9.8;  // m/s^2
constexpr double w = 1, H = 0.25, m = 2;

// n blocks; the i-th from the top stands out over the next by `factor` w / (2 i). With factor = 1 the centre of the i
// uppermost is over the edge of the next for every i; in general it is w / 2 - (1 - factor) w / 2 from its middle.
// Body 0 is the top.
Scenario tower(int n, double factor, double mu, double h) {
  Scenario s = empty_scene(h, 10);
  double x = 0;
  for (int i = 1; i <= n; ++i) {
    add_box(s, {w, H, w}, m, {{x, H * (n - i + 0.5), 0}, Quat::Identity()});
    x -= factor * w / (2 * i);
  }
  add_ground(s);
  std::vector<Pair> pairs;
  for (int i = 0; i < n; ++i) pairs.push_back({i, i + 1, mu});
  collide(s, pairs);
  return s;
}

}  // namespace

TEST_CASE("a tower of harmonic overhangs stands with a hundredth less and falls with a hundredth more", "[closed]") {
  constexpr double h = 1e-3;
  for (const Claimant& who : complementarity() + std::vector{convex(true), convex(false)})
    for (const int n : {2, 3, 5, 8}) {
      INFO(who.name << ": " << n << " blocks");
      Stepped stands(tower(n, 0.99, 0.5, h), who);
      stands.step(100);
      for (int i = 0; i < n; ++i) {
        CHECK(stands.velocity(i).norm() < 1e-10 * g * h);
        CHECK(stands.pose(i).p.x() == Approx(tower(n, 0.99, 0.5, h).initial.pose[i].p.x()).margin(1e-12));
      }
      Stepped falls(tower(n, 1.01, 0.5, h), who);
      falls.step();
      // The top block alone would fall over the edge with g (0.01 w / 2) / (its squared radius of gyration about it).
      const double one = g * 0.005 * w / ((w * w + H * H) / 12 + 0.005 * 0.005 * w * w + H * H / 4);
      CHECK(-falls.spin(0).z() > 0.5 * one * h);
      falls.step(99);
      CHECK(-falls.spin(0).z() > 50 * one * h);
    }
}

// Two blocks: the upper one's centre is d beyond the edge, H / 2 above it. If the edge holds,
//   alpha = g d / (k^2 + d^2 + H^2 / 4), k^2 = (w^2 + H^2) / 12, and the centre goes with alpha (H / 2, -d).
// The edge bears N = m (g - alpha d). Without friction it is N0 = m (g - alpha0 d), alpha0 = g d / (k^2 + d^2), which
// is less: with the bound N <= N0, and the block turns as if there were no friction.
TEST_CASE("a block beyond the edge turns about it; with the compression bound as if there were no friction",
          "[closed]") {
  constexpr double h = 1e-2, rounding = 1e-11;
  for (const double factor : {1.01, 1.2, 1.5}) {
    const double d = (factor - 1) * w / 2, gyration = (w * w + H * H) / 12 + d * d;
    for (const Claimant& who : complementarity() + std::vector{convex(true), convex(false)}) {
      INFO(who.name << ": factor " << factor);
      const bool smooth = who.name == convex(true).name;
      const double alpha = g * d / (gyration + (smooth ? 0 : H * H / 4));
      Stepped run(tower(2, factor, 1, h), who);
      run.step();
      CHECK((run.velocity(0) / h - alpha * Vec3(smooth ? 0 : H / 2, -d, 0)).norm() < rounding * g);
      CHECK((run.spin(0) / h - Vec3(0, 0, -alpha)).norm() < rounding * g);
      CHECK(run.velocity(1).norm() / h < rounding * g);
    }
  }
}
