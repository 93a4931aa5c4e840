// What slides until it no longer does: spheres with backspin, belts, carts. Closed forms in step form.

#include "closed_forms.h"

using namespace cb;
using namespace cb::test;

namespace {

constexpr double g = 9.8;           // m/s^2
constexpr double rounding = 1e-11;  // -: |difference of velocities| <= rounding * the fastest one of the scene

// How long a slip s lasts, in s / rate, where a step takes off friction out of a polygon of k edges (0: a circle) with
// one direction along x. Friction of the polygon is a vertex v, or mixes two; it takes s along the vertex nearest to s
// until s points between two, then along the mean of both, shorter by cos(pi/k). With phi the angle of s from the
// vertex nearest to it the two parts take, together,
//   |s| cos(phi - pi/k) / cos(pi/k):   the gauge of the polygon, |s| at a vertex, |s| / cos(pi/k) between two.
// A step of friction r shortens it by r exactly, whatever phi.
double gauge(const Vec3& s, int k) {
  if (k == 0) return s.norm();
  const double edge = 2 * M_PI / k, angle = std::atan2(s.z(), s.x());
  const double phi = std::abs(angle - edge * std::round(angle / edge));
  return s.norm() * std::cos(phi - edge / 2) / std::cos(edge / 2);
}

struct Spin {
  Vec3 v, w;  // horizontal velocity, spin at the start
};
constexpr double R = 0.3;
Vec3 slip_of(const Vec3& v, const Vec3& w) { return v - R * w.cross(Vec3::UnitY()); }

Scenario spinning_sphere(const Spin& start, double mu, double h) {
  Scenario s = empty_scene(h, 10);
  add_ground(s);
  add_sphere(s, R, 2, {0, R, 0}, start.v, start.w);
  collide_all(s, mu);
  return s;
}

}  // namespace

// Friction P (over m) changes v by P and R w x y by -5/2 P, the slip s = v - R w x y by 7/2 P. So the slip goes
// straight to zero where friction opposes it, and v - 2/7 s stays whatever the friction: rolling begins with
//   v = v0 - 2/7 s0 = (5 v0 + 2 R w0 x y) / 7,
// after |s0| / (7/2 mu g), and the spin about the vertical stays.
TEST_CASE("a sphere with oblique backspin rolls with (5 v0 + 2 R w0 x y) / 7 once its slip is used up", "[closed]") {
  constexpr double h = 1e-3, mu = 0.25;
  std::vector<std::pair<Claimant, int>> who = {{convex(true), 0}, {newton(), 0}, {mirtich(), 0}};
  for (const char* solver : {"lemke", "path", "ynl"})
    for (const int k : {4, 8, 16}) who.emplace_back(ap(solver, k), k);
  for (const auto& [claimant, k] : who)
    for (const Spin& start : {Spin{{2, 0, 0}, {0, 0, 9}}, Spin{{2, 0, 0.5}, {-4, 3, 7}}, Spin{{-1, 0, 2}, {5, -2, 1}},
                              Spin{{0, 0, 0}, {3, 1, -11}}, Spin{{1, 0, 1}, {0, 20, 0}}}) {
      INFO(claimant.name << ": v0 " << start.v.transpose() << ", w0 " << start.w.transpose());
      Stepped run(spinning_sphere(start, mu, h), claimant);
      const Vec3 slip = slip_of(start.v, start.w), rolling = start.v - 2.0 / 7 * slip;
      const double each = 3.5 * mu * g * h, whole = gauge(slip, k), scale = start.v.norm() + R * start.w.norm();
      const int steps = static_cast<int>(std::ceil(whole / each)) + 5;
      for (int n = 1; n <= steps; ++n) {
        run.step();
        const Vec3 now = slip_of(run.velocity(), run.spin());
        CHECK(std::abs(gauge(now, k) - std::max(0.0, whole - n * each)) < rounding * scale);
        if (k == 0 && n * each < whole)  // straight to zero
          CHECK((now - slip * (1 - n * each / whole)).norm() < rounding * scale);
      }
      CHECK((run.velocity() - rolling).norm() < rounding * scale);
      CHECK(slip_of(run.velocity(), run.spin()).norm() < rounding * scale);
      CHECK(run.spin().y() == Approx(start.w.y()).margin(rounding * scale));
    }
}

namespace {

// A heavy belt on a rail, its top at y = 0, and what is on it.
int add_belt(Scenario& s, double mass, double speed) {
  return add_on_rail(s, box_shape({20, 1, 4}), mass, {0, -0.5, 0}, speed);
}
// Driven from outside: both limits of the rail move with its speed.
void drive(Scenario& s, double speed) {
  Joint& rail = s.model.trees.back().joints[0];
  rail.lower = rail.upper = 0;
  rail.limit_rate = speed;
}
Scenario box_on_belt(double mu, double belt_mass, double speed, double h) {
  Scenario s = empty_scene(h, 10);
  add_belt(s, belt_mass, speed);
  add_box(s, {0.6, 0.3, 0.6}, 2, {{0, 0.15, 0}, Quat::Identity()});
  collide_all(s, mu);
  return s;
}

// v = mu g t up to the belt's speed, which is met exactly in the step in which the slip would turn round.
void check_box_on_driven_belt(const Claimant& who) {
  constexpr double h = 1e-2;
  for (const double mu : {0.1, 0.4})
    for (const double speed : {0.55, -1.23}) {
      INFO(who.name << ": mu " << mu << ", belt " << speed);
      Scenario s = box_on_belt(mu, 5, speed, h);
      drive(s, speed);
      Stepped run(s, who);
      const int steps = static_cast<int>(std::ceil(std::abs(speed) / (mu * g * h))) + 5;
      for (int n = 1; n <= steps; ++n) {
        run.step();
        const double expected = std::copysign(std::min(n * mu * g * h, std::abs(speed)), speed);
        CHECK((run.velocity(1) - Vec3(expected, 0, 0)).norm() < rounding * std::abs(speed));
        CHECK((run.velocity(0) - Vec3(speed, 0, 0)).norm() < rounding * std::abs(speed));
      }
    }
}

// The slip at the start is -V along the belt: rolling begins with v = -2/7 of that, 2 V / 7, after 2 V / (7 mu g).
void check_ball_on_driven_belt(const Claimant& who) {
  constexpr double h = 1e-3, V = 1.4, mu = 0.2, radius = 0.25;
  INFO(who.name);
  Scenario s = empty_scene(h, 10);
  add_belt(s, 5, V);
  drive(s, V);
  add_sphere(s, radius, 2, {0, radius, 0});
  collide_all(s, mu);
  Stepped run(s, who);
  const int rolls = static_cast<int>(std::ceil(2 * V / 7 / (mu * g * h)));
  for (int n = 1; n <= rolls + 40; ++n) {
    run.step();
    CHECK(std::abs(run.velocity(1).x() - std::min(n * mu * g * h, 2 * V / 7)) < rounding * V);
  }
}

}  // namespace

TEST_CASE("a driven belt takes a box along with mu g up to its own speed", "[closed]") {
  for (const Claimant& who : complementarity()) check_box_on_driven_belt(who);
}

TEST_CASE("a ball put on a driven belt rolls off with two sevenths of its speed", "[closed]") {
  for (const Claimant& who : complementarity()) check_ball_on_driven_belt(who);
  for (const Claimant& who : {newton(), mirtich()}) check_ball_on_driven_belt(who);
}

// What drives the belt is no contact: it bears m mu g, which is no part of the bound (limit rows have no share in
// kappa).
TEST_CASE("the drive of a belt takes nothing from what the compression bound leaves to friction", "[closed]") {
  check_box_on_driven_belt(convex(true));
  check_ball_on_driven_belt(convex(true));
}

// The tall box tips, or would without the bound on compression, and leans on how impulses are shared; the heavy one
// slides.
TEST_CASE("a box on a driven belt does not feel what else is on the belt", "[closed]") {
  constexpr double h = 1e-3, speed = 2, mu = 0.8;
  for (const Claimant& who : complementarity() + std::vector{newton(), mirtich(), convex(true), convex(false)})
    for (const double e : {0.0, 0.5}) {
      INFO(who.name << ": e " << e);
      const auto belt = [&](bool both) {
        Scenario s = empty_scene(h, 10);
        add_belt(s, 5, speed);
        drive(s, speed);
        add_box(s, {0.2, 1, 0.2}, 2, {{0, 0.5, 0}, Quat::Identity()});
        if (both) add_box(s, {0.6, 0.3, 0.6}, 300, {{3, 0.15, 0}, Quat::Identity()});
        collide_all(s, mu, e);
        return s;
      };
      Stepped alone(belt(false), who), together(belt(true), who);
      for (int n = 0; n < (e > 0 ? 1 : 60); ++n) {  // bounces are chaotic, and split each other's steps
        alone.step();
        together.step();
        CHECK((alone.velocity(1) - together.velocity(1)).norm() < rounding * speed);
        CHECK((alone.spin(1) - together.spin(1)).norm() < rounding * speed);
      }
    }
}

// No impulse moves a belt that is driven, so that two that rub each other, and one on the ground, have no contact.
TEST_CASE("a driven belt that lies on the ground and rubs another one moves what is on it all the same", "[closed]") {
  constexpr double h = 1e-2, mu = 0.4, speed = 0.5;
  for (const Claimant& who : complementarity() + std::vector{convex(true)}) {
    INFO(who.name);
    Scenario s = box_on_belt(mu, 5, speed, h);
    drive(s, speed);
    s.shapes[static_cast<std::size_t>(add_ground(s))].local.p.y() = -1;
    add_on_rail(s, box_shape({20, 1, 4}), 5, {0, -0.5, 4}, -speed);
    drive(s, -speed);
    collide_all(s, mu);
    Stepped run(s, who);
    int contacts = 0;
    run.simulation().on_event = [&](const EventRecord& event) { contacts = event.problem.nc(); };
    for (int n = 1; n <= 5; ++n) {
      run.step();
      CHECK(contacts == 4);
      CHECK((run.velocity(1) - Vec3(n * mu * g * h, 0, 0)).norm() < rounding * speed);
    }
  }
}

// Free on its rail the belt, of mass B, gives what it takes: v_box = mu g t, v_belt = V - m / B mu g t, up to the
// common B V / (B + m).
TEST_CASE("a belt that coasts and a box on it end with the momentum that the belt had", "[closed]") {
  constexpr double h = 1e-2, m = 2;
  for (const Claimant& who : complementarity() + std::vector{convex(true)})
    for (const double B : {1.0, 50.0}) {
      INFO(who.name << ": belt of " << B << " kg");
      const double V = 0.8, mu = 0.3, common = B * V / (B + m);
      Stepped run(box_on_belt(mu, B, V, h), who);
      for (int n = 1; n <= 40; ++n) {
        run.step();
        const double box = std::min(n * mu * g * h, common);
        CHECK(std::abs(run.velocity(1).x() - box) < rounding * V);
        CHECK(std::abs(run.velocity(0).x() - (V - m / B * box)) < rounding * V);
      }
    }
}

namespace {

// n boxes (m, w wide, e high) on a cart of mass C that the force F drives along its rail; mu[i]: under box i.
constexpr double cart_mass = 3, m = 2, w = 1, e = 0.4;
Scenario loaded_cart(const std::vector<double>& mu, double F, double h) {
  Scenario s = empty_scene(h, 10);
  add_on_rail(s, box_shape({20, 1, 4}), cart_mass, {0, -0.5, 0});
  std::vector<Pair> pairs;
  for (int i = 0; i < static_cast<int>(mu.size()); ++i) {
    add_box(s, {w, e, w}, m, {{0, e * (i + 0.5), 0}, Quat::Identity()});
    pairs.push_back({i, i + 1, mu[static_cast<std::size_t>(i)]});
  }
  collide(s, pairs);
  s.forces.push_back({0, {F, 0, 0}, 0, 10});
  return s;
}

}  // namespace

// All go together with a = F / (C + n m) while a <= mu_i g at each interface. Beyond, the least mu_j slips: what is
// above goes with mu_j g, what is below with (F - mu_j m_above g) / (C + m_below), if that is within its own friction.
// Nothing tips while the moment about each base holds, a n e <= g w.
TEST_CASE("a stack on a driven cart goes along while a < mu g, and slips where its friction is least", "[closed]") {
  constexpr double h = 1e-2;
  int slipped = 0;
  for (const std::vector<double>& mu : {std::vector{0.3}, {0.2, 0.5}, {0.5, 0.2}, {0.5, 0.15, 0.4}, {0.2, 0.3, 0.4}})
    for (const double load : {0.1, 0.19, 0.32}) {
      const auto weakest = std::min_element(mu.begin(), mu.end());
      const int n = static_cast<int>(mu.size()), below = static_cast<int>(weakest - mu.begin());
      const double F = load * g * (cart_mass + n * m), grip = *weakest * g;
      const bool slips = load > *weakest;
      const double front = slips ? (F - grip * (n - below) * m) / (cart_mass + below * m) : load * g;
      REQUIRE(front * n * e < g * w);
      for (int i = 0; i < below; ++i) REQUIRE(front < mu[static_cast<std::size_t>(i)] * g);
      slipped += slips;
      for (const Claimant& who : complementarity() + std::vector{convex(true), convex(false)}) {
        if (slips && who.name == convex(false).name) continue;  // what slides is lifted
        INFO(who.name << ": " << n << " boxes, weakest " << *weakest << " under box " << below << ", load " << load);
        Stepped run(loaded_cart(mu, F, h), who);
        for (const int steps : {1, 20}) {
          run.step(steps == 1 ? 1 : steps - 1);
          for (int body = 0; body <= n; ++body) {
            const double a = body > below && slips ? grip : front;
            CHECK((run.velocity(body) / (steps * h) - Vec3(a, 0, 0)).norm() < rounding * g);
          }
        }
      }
    }
  CHECK(slipped > 3);
}
