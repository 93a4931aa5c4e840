// A block pushed at a height: held, sliding or tipping, by closed forms in step form.
//
// The pusher, a smooth ball of mass A on a rail, is driven by the force F and touches the back of a block (mass m, b
// wide, H high, on the ground with mu) at the height y. P: what it presses with, N and f: load and friction of the
// ground, a: acceleration of the centre, alpha over the front edge:
//   held          f = P = F <= mu m g,  moment about the edge F y <= m g b / 2
//   slides        a = (F - mu m g) / (m + A), P = F - A a,  -m g b <= 2 P (y - H/2) + mu m g H <= m g b
//   tips          alpha = (F y - m g b / 2) / (m (b^2 + H^2) / 3 + A y^2), a = alpha H / 2, P = F - A alpha y,
//                 N = m g + m alpha b / 2, f = P - m a; needs |f| <= mu N
//   tips, slides  f = mu N and
//                 m a = P - f,  A (a + alpha (y - H/2)) = F - P,  J alpha = P (y - H/2) + f H/2 - N b/2
// From rest the velocities after one explicit step of length h are h times these, exactly.

#include <Eigen/Dense>
#include <optional>

#include "closed_forms.h"

using namespace cb;
using namespace cb::test;

namespace {

constexpr double g = 9.8;           // m/s^2
constexpr double rounding = 1e-11;  // -: |difference of velocities| <= rounding * g h, a step from rest
constexpr double b = 1, m = 2, pusher_mass = 3, radius = 0.05;

struct Push {
  double H, mu, y, F;
};
enum class Fate { held, slides, tips, tips_and_slides };
struct Expected {
  Fate fate;
  double a = 0, alpha = 0;
};

// None where a load is within a hundredth of a border between fates.
std::optional<Expected> pushed(const Push& push) {
  const auto [H, mu, y, F] = push;
  const double A = pusher_mass, weight = m * g, arm = y - H / 2, square = b * b + H * H;
  const auto below = [&](double load, double bound) { return load < bound - 0.01 * weight; };
  if (below(F, mu * weight) && below(F * y, weight * b / 2)) return Expected{Fate::held};
  const double slide = (F - mu * weight) / (m + A), moment = 2 * (F - A * slide) * arm + mu * weight * H;
  if (slide > 0.01 * g && below(std::abs(moment), weight * b)) return Expected{Fate::slides, slide};
  const double alpha = (F * y - weight * b / 2) / (m * square / 3 + A * y * y);
  if (alpha < 0.01 * g) return std::nullopt;
  const double f = F - A * alpha * y - m * alpha * H / 2, N = weight + m * alpha * b / 2;
  if (below(std::abs(f), mu * N)) return Expected{Fate::tips, alpha * H / 2, alpha};
  if (below(f, mu * N + 0.02 * weight)) return std::nullopt;
  // Unknowns a, alpha, P; N = m g + m b alpha / 2.
  Eigen::Matrix3d left;
  left << m, mu * m * b / 2, -1,  //
      A, A * arm, 1,              //
      0, m * square / 12 - (mu * H - b) / 2 * m * b / 2, -arm;
  const Eigen::Vector3d x = left.lu().solve(Eigen::Vector3d(-mu * weight, F, weight * (mu * H - b) / 2));
  if (x[1] <= 0 || x[0] - x[1] * H / 2 <= 0) return std::nullopt;
  return Expected{Fate::tips_and_slides, x[0], x[1]};
}

Scenario scene(const Push& push, double h) {
  Scenario s = empty_scene(h, 1);
  add_ground(s);
  add_box(s, {b, push.H, 2}, m, {{0, push.H / 2, 0}, Quat::Identity()});
  const int pusher = add_on_rail(s, sphere_shape(radius), pusher_mass, {-b / 2 - radius, push.y, 0});
  collide(s, {{1, 0, push.mu}, {1, 2, 0}});
  s.forces.push_back({pusher, {push.F, 0, 0}, 0, 1});
  return s;
}

template <class Check>
void for_pushes(const Check& check) {
  for (const double H : {0.5, 1.0, 2.0})
    for (const double mu : {0.2, 0.5, 0.9})
      for (const double height : {0.2, 0.5, 0.9})
        for (const double load : {0.1, 0.3, 0.6, 1.2}) check(Push{H, mu, height * H, load * m * g});
}

std::string text(const Push& push) {
  return "height " + std::to_string(push.H) + ", mu " + std::to_string(push.mu) + ", pushed at " +
         std::to_string(push.y) + " with " + std::to_string(push.F) + " N";
}

void check_first_step(const Push& push, const Expected& expected, const Claimant& who) {
  constexpr double h = 1e-2;
  INFO(who.name << ": " << text(push) << ", fate " << static_cast<int>(expected.fate));
  Stepped run(scene(push, h), who);
  run.step();
  CHECK((run.velocity() / h - Vec3(expected.a, expected.alpha * b / 2, 0)).norm() < rounding * g);
  CHECK((run.spin() / h - Vec3(0, 0, -expected.alpha)).norm() < rounding * g);
  if (expected.alpha > 0) return;
  run.step(10);
  CHECK((run.velocity() / (11 * h) - Vec3(expected.a, 0, 0)).norm() < rounding * g);
}

}  // namespace

TEST_CASE("a block pushed at a height is held, slides, tips or does both by friction and moment", "[closed]") {
  int seen[4] = {};
  for (const Claimant& who : complementarity())
    for_pushes([&](const Push& push) {
      const std::optional<Expected> expected = pushed(push);
      if (!expected) return;
      ++seen[static_cast<int>(expected->fate)];
      check_first_step(push, *expected, who);
    });
  for (const int count : seen) CHECK(count >= 6);
}

TEST_CASE("without the bound convex holds a pushed block, or tips it over an edge that does not slip", "[closed]") {
  for_pushes([&](const Push& push) {
    const std::optional<Expected> expected = pushed(push);
    if (expected && (expected->fate == Fate::held || expected->fate == Fate::tips))
      check_first_step(push, *expected, convex(false));
  });
}

// Without friction the two move on together, a = F / (m + A): the pusher presses with P0 = F m / (m + A), and
// kappa = (m g + P0) h. The ground takes at least m g, so that P <= P0, the pusher moves on at least as fast as without
// friction, and the block must. The loads P = P0, f = 0 do that: friction of the block does nothing at all.
TEST_CASE("with the bound convex gives a block that a smooth body pushes no friction", "[closed]") {
  constexpr double h = 1e-2;
  int held = 0;
  for_pushes([&](const Push& push) {
    const double P = push.F * m / (m + pusher_mass);
    if (std::abs(P * (push.y - push.H / 2)) > 0.99 * m * g * b / 2) return;  // turns without friction, too
    const std::optional<Expected> coulomb = pushed(push);
    held += coulomb && coulomb->fate == Fate::held;
    INFO(text(push));
    Stepped run(scene(push, h), convex(true));
    run.step(5);
    CHECK((run.velocity() / (5 * h) - Vec3(push.F / (m + pusher_mass), 0, 0)).norm() < rounding * g);
    CHECK(run.spin().norm() / (5 * h) < rounding * g);
  });
  CHECK(held > 10);
}

// Two flat blocks in a row, F at the first one's centre: m_1, mu_1 push m_2, mu_2. By Coulomb's law the row is held up
// to F = (mu_1 m_1 + mu_2 m_2) g. With the bound P <= P0 = F m_2 / (m_1 + m_2) leaves the first block at least
// a = F / (m_1 + m_2) - mu_1 g: the row moves as if all of it had the first one's friction, where that is the lesser.
// Where it is the greater and the row slides, friction takes load off the second block (P < P0), and the bound leaves
// room by which sliding blocks are pressed and lifted, as they are without the bound.
TEST_CASE("a row of two blocks is held by all its friction; with the bound by no more than the pusher's coefficient",
          "[closed]") {
  constexpr double h = 1e-2, m1 = 1.5, m2 = 2.5, M = m1 + m2;
  for (const double mu1 : {0.1, 0.3})
    for (const double mu2 : {0.1, 0.2, 0.4})
      for (const double load : {0.05, 0.15, 0.25, 0.45}) {
        const double F = load * M * g, grip = (mu1 * m1 + mu2 * m2) * g;
        if (std::abs(F - grip) < 0.01 * M * g || std::abs(load - mu1) < 0.01) continue;
        Scenario s = empty_scene(h, 1);
        add_ground(s);
        add_box(s, {1, 0.5, 1}, m1, {{-0.5, 0.25, 0}, Quat::Identity()});
        add_box(s, {1, 0.5, 1}, m2, {{0.5, 0.25, 0}, Quat::Identity()});
        collide(s, {{0, 1, mu1}, {0, 2, mu2}, {1, 2, 0}});
        s.forces.push_back({0, {F, 0, 0}, 0, 1});
        const double coulomb = std::max(0.0, (F - grip) / M),
                     bounded = mu1 < mu2 ? std::max(0.0, F / M - mu1 * g) : coulomb;
        for (const Claimant& who : complementarity() + std::vector{convex(true), convex(false)}) {
          const bool lifts = who.name == convex(false).name || (who.name == convex(true).name && mu1 > mu2);
          if (coulomb > 0 && lifts) {
            Stepped run(s, who);
            run.step();
            CHECK(std::max(run.velocity(0).y(), run.velocity(1).y()) > 1e-3 * g * h);
            continue;
          }
          INFO(who.name << ": mu " << mu1 << ", " << mu2 << ", load " << load);
          Stepped run(s, who);
          run.step(5);
          const double a = who.name == convex(true).name ? bounded : coulomb;
          for (const int body : {0, 1}) CHECK((run.velocity(body) / (5 * h) - Vec3(a, 0, 0)).norm() < rounding * g);
        }
      }
}
