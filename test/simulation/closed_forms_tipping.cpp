// Held, sliding or tipping: one block on a plane, by closed forms in step form.
//
// A block of mass m, b wide and H high, at rest on a plane; the load on each kg is (gx, -gy), gx, gy > 0: gravity on an
// incline (gx = g sin theta, gy = g cos theta), or gravity and a push at the centre. With N, f the force of the plane
// over m, and alpha the angular acceleration over the edge in front:
//   rest         f = gx <= mu gy, moment about the edge gx H <= gy b
//   slides       a = gx - mu gy; the load stays inside the base where mu H <= b
//   tips         the edge stays: alpha = 3/2 (gx H - gy b) / (b^2 + H^2), the centre accelerates by
//                alpha (H/2, b/2), so f = gx - alpha H / 2 and N = gy + alpha b / 2; needs f <= mu N
//   tips, slides f = mu N: (b^2 + H^2) / 12 alpha = N (mu H - b) / 2, N = gy + alpha b / 2, so
//                N = gy / (1 - 3 b (mu H - b) / (b^2 + H^2)), a = gx - mu N
// One explicit step of length h from rest multiplies these by h, exactly: contacts bind velocities, which are linear in
// the impulses, at the configuration at the start of the step.

#include "closed_forms.h"

using namespace cb;
using namespace cb::test;

namespace {

constexpr double g = 9.8;           // m/s^2
constexpr double rounding = 1e-12;  // -: |difference of velocities| <= rounding * g h, a step from rest

enum class Fate { rests, slides, tips, tips_and_slides };

struct Expected {
  Fate fate;
  double ax = 0, ay = 0, alpha = 0;  ///< of the centre, m/s^2; over the front edge, rad/s^2
  double margin = 0;                 ///< how far the load is from where another fate begins, fraction of gy
};

Expected block(double b, double H, double mu, double gx, double gy) {
  const double square = b * b + H * H;
  const double slip_margin = std::abs(gx - mu * gy), tip_margin = std::abs(gx - gy * b / H);
  if (gx <= mu * gy && gx * H <= gy * b) return {Fate::rests, 0, 0, 0, std::min(slip_margin, tip_margin) / gy};
  if (mu * H <= b) return {Fate::slides, gx - mu * gy, 0, 0, std::min(slip_margin, std::abs(mu - b / H) * gy) / gy};
  double alpha = 1.5 * (gx * H - gy * b) / square;
  const double f = gx - alpha * H / 2;
  double N = gy + alpha * b / 2;
  const double grip = std::abs(f - mu * N);
  if (f <= mu * N) return {Fate::tips, alpha * H / 2, alpha * b / 2, alpha, std::min(tip_margin, grip) / gy};
  N = gy / (1 - 3 * b * (mu * H - b) / square);
  alpha = 2 * (N - gy) / b;
  return {Fate::tips_and_slides, gx - mu * N, alpha * b / 2, alpha, grip / gy};
}

Scenario on_plane(double b, double H, double mu, const Vec3& gravity, double h) {
  Scenario s = empty_scene(h, 1);
  s.gravity.constant = gravity;
  add_ground(s);
  // Deep: a block of H = 4 b that is thinner than 1.5 b can as well turn about one corner of its edge while the other
  // slides, by Coulomb's law (ap with path finds that answer).
  add_box(s, {b, H, 2}, 2, {{0, H / 2, 0}, Quat::Identity()});
  collide_all(s, mu);
  return s;
}

// The table: aspect ratios, friction and slopes on both sides of every border; those on a border are left out.
template <class Check>
void for_blocks_on_inclines(const Check& check) {
  constexpr double border = 1e-3;  // fraction of gy
  for (const double H : {0.5, 1.0, 2.0, 4.0})
    for (const double mu : {0.1, 0.3, 0.6, 1.2})
      for (const double degrees : {3.0, 10.0, 20.0, 35.0, 50.0, 65.0}) {
        const double theta = degrees * M_PI / 180, gx = g * std::sin(theta), gy = g * std::cos(theta);
        const Expected expected = block(1, H, mu, gx, gy);
        if (expected.margin > border) check(H, mu, degrees, expected, Vec3(gx, -gy, 0));
      }
}

}  // namespace

TEST_CASE("a block on an incline rests, slides, tips or does both by its aspect and friction", "[closed]") {
  constexpr double h = 1e-2;
  int seen[4] = {};
  for (const Claimant& who : complementarity())
    for_blocks_on_inclines([&](double H, double mu, double degrees, const Expected& expected, const Vec3& gravity) {
      INFO(who.name << ": height " << H << ", mu " << mu << ", slope " << degrees);
      ++seen[static_cast<int>(expected.fate)];
      Stepped run(on_plane(1, H, mu, gravity, h), who);
      run.step();
      CHECK((run.velocity() / h - Vec3(expected.ax, expected.ay, 0)).norm() < rounding * g);
      CHECK((run.spin() / h - Vec3(0, 0, -expected.alpha)).norm() < rounding * g);
      if (expected.alpha > 0) return;
      run.step(20);
      CHECK((run.velocity() / (21 * h) - Vec3(expected.ax, 0, 0)).norm() < rounding * g);
    });
  for (const int count : seen) CHECK(count >= 18);
}

TEST_CASE("without the bound convex holds what rests, and tips over an edge that does not slip, as Coulomb's law does",
          "[closed]") {
  constexpr double h = 1e-2;
  int tipped = 0;
  for_blocks_on_inclines([&](double H, double mu, double degrees, const Expected& expected, const Vec3& gravity) {
    if (expected.fate != Fate::rests && expected.fate != Fate::tips) return;  // what slides is lifted
    INFO("height " << H << ", mu " << mu << ", slope " << degrees);
    tipped += expected.fate == Fate::tips;
    Stepped run(on_plane(1, H, mu, gravity, h), convex(false));
    run.step();
    CHECK((run.velocity() / h - Vec3(expected.ax, expected.ay, 0)).norm() < rounding * g);
    CHECK((run.spin() / h - Vec3(0, 0, -expected.alpha)).norm() < rounding * g);
  });
  CHECK(tipped > 5);
}

// Without friction the block slides flat: kappa = gy h. Tipping needs N = gy + alpha b / 2 > gy. With N <= gy the
// centre cannot rise, so that nothing of the base lifts, alpha = 0; of the loads N = gy that do not turn the block, the
// one at the front edge bears most friction, f H / 2 = N b / 2: f = min(mu, b / H) gy, and this leaves the least
// energy.
TEST_CASE("with the bound convex tips no block: what should tip slides as if mu were at most b / H", "[closed]") {
  constexpr double h = 1e-2;
  int departures = 0;
  for_blocks_on_inclines([&](double H, double mu, double degrees, const Expected& expected, const Vec3& gravity) {
    INFO("height " << H << ", mu " << mu << ", slope " << degrees);
    departures += expected.alpha > 0;
    Stepped run(on_plane(1, H, mu, gravity, h), convex(true));
    const double a = std::max(0.0, gravity[0] + std::min(mu, 1 / H) * gravity[1]);
    for (const int n : {1, 20}) {
      run.step(n == 1 ? 1 : n - 1);
      CHECK((run.velocity() / (n * h) - Vec3(a, 0, 0)).norm() < rounding * g);
      CHECK(run.spin().norm() / (n * h) < rounding * g);
    }
  });
  CHECK(departures > 10);
}

// Tilted by phi over its front edge the block is a pendulum on it, r = half the diagonal:
//   m (b^2 + H^2) / 3 phi'' = m (gx (H cos phi + b sin phi) - gy (b cos phi - H sin phi)) / 2
// integrated here by Runge and Kutta with steps far below those of the scene.
TEST_CASE("a block that tips over an edge that holds falls as a pendulum on it, to first order in the step",
          "[closed]") {
  const double b = 1, H = 2, gx = g * std::sin(0.6), gy = g * std::cos(0.6), duration = 0.3;
  const auto acceleration = [&](double phi) {
    const double c = std::cos(phi), s = std::sin(phi);
    return 1.5 / (b * b + H * H) * (gx * (H * c + b * s) - gy * (b * c - H * s));
  };
  double phi = 0, rate = 0;
  const int parts = 2000;
  const double dt = duration / parts;
  for (int i = 0; i < parts; ++i) {
    const double k1 = acceleration(phi), k2 = acceleration(phi + dt / 2 * rate),
                 k3 = acceleration(phi + dt / 2 * rate + dt * dt / 4 * k1),
                 k4 = acceleration(phi + dt * rate + dt * dt / 2 * k2);
    phi += dt * rate + dt * dt / 6 * (k1 + k2 + k3);
    rate += dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  }
  for (const Claimant& who : complementarity() + std::vector{convex(false)}) {
    INFO(who.name);
    double error[2];
    for (const int i : {0, 1}) {
      const double h = i == 0 ? 2e-3 : 1e-3;
      Stepped run(on_plane(b, H, 2, {gx, -gy, 0}, h), who);
      run.step(static_cast<int>(std::lround(duration / h)));
      error[i] = -2 * std::atan2(run.pose().q.z(), run.pose().q.w()) - phi;
    }
    CHECK(phi > 0.03);
    CHECK(std::abs(error[1]) < 0.02 * phi);
    CHECK(error[0] / error[1] == Approx(2).epsilon(0.15));
  }
}

TEST_CASE("the scenes of what the compression bound forbids begin as their heads say, by each method", "[closed]") {
  const Scenario tall = load_scenario(SOURCE_ROOT "/scenarios/tipping_box.xml", {}),
                 row = load_scenario(SOURCE_ROOT "/scenarios/pushed_block.xml", {});
  const double tilt = 35 * M_PI / 180, alpha = 1.5 * g * (2 * std::sin(tilt) - std::cos(tilt)) / 5,
               slide = g * (std::sin(tilt) - std::cos(tilt) / 2);
  CHECK(alpha == Approx(0.9643).epsilon(1e-4));
  CHECK(slide == Approx(1.6072).epsilon(1e-4));
  for (const Claimant& who : complementarity() + std::vector{convex(true), convex(false)}) {
    INFO(who.name);
    const bool bounded = who.name == convex(true).name;
    Stepped ramp(tall, who);
    ramp.step();
    CHECK(-ramp.spin().z() / tall.step == Approx(bounded ? 0 : alpha).margin(1e-10));
    const double along = ramp.velocity().x() * std::cos(tilt) - ramp.velocity().y() * std::sin(tilt);
    CHECK(along / tall.step == Approx(bounded ? slide : alpha).margin(1e-10));  // H / 2 = 1 above the edge
    Stepped blocks(row, who);
    blocks.step(100);
    for (const int body : {0, 1})
      CHECK(blocks.velocity(body).x() == Approx(bounded ? 2 * 100 * row.step : 0).margin(1e-10));
  }
}
