// What the models of today are known for, as motions: softness creeps and lifts, a convex model without a bound lifts.

#include "closed_forms.h"

using namespace cb;
using namespace cb::test;

namespace {

constexpr double g = 9.8;  // m/s^2

Claimant soft(const std::string& variant = "sap") {
  Claimant out{"soft " + variant, "soft"};
  out.options.variant = variant;
  return out;
}

/// A cube of 1 m and 1 kg on a plane that is steep by `tilt`, downhill along x; gravity is tilted, not the plane.
Scenario cube_on_plane(double tilt, double mu, double h, double speed = 0) {
  Scenario s = empty_scene(h, 10);
  s.gravity.constant = {g * std::sin(tilt), -g * std::cos(tilt), 0};
  add_ground(s);
  add_box(s, {1, 1, 1}, 1, {{0, 0.5, 0}, Quat::Identity()}, {speed, 0, 0});
  collide_all(s, mu);
  return s;
}

double along(const Scenario& s, const Claimant& who, Stepping way, double duration) {
  Stepped run(s, who, way);
  run.step(static_cast<int>(std::lround(duration / s.step)));
  return run.pose().p.x();
}
double height(const Scenario& s, const Claimant& who, Stepping way, double duration) {
  Stepped run(s, who, way);
  double highest = 0;
  for (long i = std::lround(duration / s.step); i > 0; --i) {
    run.step();
    highest = std::max(highest, run.pose().p.y() - 0.5);
  }
  return highest;
}

}  // namespace

// Each of four contacts carries a quarter of m g sin(tilt) h, under which it slips by R_t of that, R_t = sigma w with w
// = |W_ii| / 3. W_ii = 5.5 I - 6 a a^T of a cube, a = (+-1, +-1, +-1)/2: |W_ii|^2 = 3 * 4^2 + 6 * 1.5^2 = 61.5
// (1/kg)^2.
TEST_CASE("soft never sticks: a cube on a slope creeps with sigma w/4 m g sin(tilt) h, half as far at half the step") {
  const double tilt = 0.4, sigma = 1e-3, w = std::sqrt(61.5) / 3;
  for (const Stepping way : {Stepping::events, Stepping::steps}) {
    double last = 0;
    for (const double h : {4e-3, 2e-3, 1e-3}) {
      const double creep = along(cube_on_plane(tilt, 0.7, h), soft(), way, 0.4);
      CHECK(creep == Approx(sigma * w / 4 * g * std::sin(tilt) * h * 0.4).epsilon(0.02));
      if (last > 0) CHECK(last / creep == Approx(2).epsilon(0.02));
      last = creep;
    }
    CHECK(along(cube_on_plane(tilt, 0.7, 1e-3), convex(true), way, 0.4) == Approx(0).margin(1e-12));
  }
}

// By steps the gap follows from u_n + g / h = mu u_t, but for what R makes of it: g = h mu u_t.
TEST_CASE("soft slides above the ground by h mu v, as a convex program without a bound does; with a bound it stays") {
  for (const double mu : {0.1, 0.4})
    for (const double v : {0.5, 4.0})
      for (const double h : {1e-3, 2e-3}) {
        const auto high = [&](const Claimant& who) {
          return height(cube_on_plane(0, mu, h, v), who, Stepping::steps, 20 * h);
        };
        INFO("mu " << mu << ", " << v << " m/s, h " << h);
        CHECK(high(soft()) == Approx(h * mu * v).epsilon(0.05));
        CHECK(high(convex(false)) == Approx(h * mu * v).epsilon(0.05));
        CHECK(high(convex(true)) == Approx(0).margin(1e-9));
        CHECK(high(ap()) == Approx(0).margin(1e-9));
      }
}
