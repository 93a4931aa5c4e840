// The bounds that conservative advancement rests on: derivatives against differences of the motion itself, and bounds
// where they are attained.
#include "geometry/advancement.h"

#include <catch2/catch.hpp>

#include "geometry/box_box.h"
#include "geometry/core_time.h"
#include "geometry/placed_shapes.h"

using namespace cb;
using namespace cb::test;

namespace {

Vec3 turned(const Vec3& x, const Vec3& w, double t) {
  return w.norm() == 0 ? x : Vec3(Eigen::AngleAxisd(w.norm() * t, w.normalized()) * x);
}

/// The first three derivatives of f at 0, by differences of fourth order.
template <class F>
std::array<Vec3, 3> derivatives(const F& f) {
  constexpr double h = 2e-3;
  const Vec3 a3 = f(-3 * h), a2 = f(-2 * h), a1 = f(-h), o = f(0), b1 = f(h), b2 = f(2 * h), b3 = f(3 * h);
  return {(a2 - 8 * a1 + 8 * b1 - b2) / (12 * h), (-a2 + 16 * a1 - 30 * o + 16 * b1 - b2) / (12 * h * h),
          (a3 - 8 * a2 + 13 * a1 - 13 * b1 + 8 * b2 - b3) / (8 * h * h * h)};
}

/// Two bodies: points at arms x_o and x_r of origins that are apart, and directions that turn with them.
struct Bodies {
  Vec3 apart, v, w_o, x_o, w_r, x_r, e, f;
  Vec3 distance(double t) const { return apart + v * t + turned(x_o, w_o, t) - turned(x_r, w_r, t); }
  Vec3 across(double t) const { return turned(e, w_o, t).cross(turned(f, w_r, t)); }
  Moving moving_distance(double horizon) const { return between(distance(0), v, w_o, x_o, w_r, x_r, horizon); }
  Moving moving_across() const { return crossed(turning_direction(e, w_o), turning_direction(f, w_r)); }
};

}  // namespace

TEST_CASE("Derivatives of distances, directions and what is across two of them are those of the motion") {
  Random random(481);
  for (int k = 0; k < 200; ++k) {
    const Bodies b{random.vector(2), random.vector(2), random.vector(2), random.vector(1),
                   random.vector(2), random.vector(1), random.vector(1), random.vector(1)};
    const auto check = [](const Moving& now, const std::array<Vec3, 3>& by_differences) {
      CHECK((now.x1 - by_differences[0]).norm() < 1e-7);
      CHECK((now.x2 - by_differences[1]).norm() < 1e-7);
    };
    check(turning_direction(b.e, b.w_o), derivatives([&](double t) { return turned(b.e, b.w_o, t); }));
    check(b.moving_distance(1), derivatives([&](double t) { return b.distance(t); }));
    check(b.moving_across(), derivatives([&](double t) { return b.across(t); }));
    const Approach gap = along_normal(b.moving_across(), b.moving_distance(1));
    const auto height = derivatives([&](double t) { return Vec3(b.across(t).dot(b.distance(t)), 0, 0); });
    CHECK(gap.value == Approx(b.across(0).dot(b.distance(0))).margin(1e-12));
    CHECK(gap.rate == Approx(height[0].x()).margin(1e-7));
    CHECK(gap.curvature == Approx(height[1].x()).margin(1e-7));
  }
}

TEST_CASE("Bounds on derivatives hold over the horizon") {
  Random random(482);
  constexpr double horizon = 0.7;
  for (int k = 0; k < 200; ++k) {
    // Directions are of unit length; some do not turn, or move along.
    Bodies b{random.vector(2), random.vector(2), random.vector(2), random.vector(1),
             random.vector(2), random.vector(1), Vec3(),           Vec3()};
    b.e = random.rotation() * Vec3::UnitX();
    b.f = random.rotation() * Vec3::UnitX();
    if (k % 3 == 1) b.w_o.setZero();
    if (k % 3 == 2) b.w_r.setZero();
    if (k % 2) b.v.setZero();
    const Moving distance = b.moving_distance(horizon), across = b.moving_across();
    const Approach gap = along_normal(across, distance);
    for (int sample = 0; sample <= 10; ++sample) {
      const double at = horizon * sample / 10;
      const auto d = derivatives([&](double t) { return b.distance(at + t); });
      const auto q = derivatives([&](double t) { return b.across(at + t); });
      const auto height = derivatives([&](double t) { return Vec3(b.across(at + t).dot(b.distance(at + t)), 0, 0); });
      CHECK(b.distance(at).norm() <= distance.size[0] + 1e-12);
      CHECK(b.across(at).norm() <= across.size[0] + 1e-12);
      for (std::size_t i = 0; i < 3; ++i) {
        CHECK(d[i].norm() <= distance.size[i + 1] + 1e-5);
        CHECK(q[i].norm() <= across.size[i + 1] + 1e-5);
      }
      CHECK(std::abs(height[2].x()) <= gap.K + 1e-5);
    }
  }
}

TEST_CASE("A bound on the third derivative is the product rule's of what it is made of") {
  // Each part alone, of sizes that are told apart: a product's third derivative is f3 g0 + 3 f2 g1 + 3 f1 g2 + f0 g3.
  const auto sized = [](double s0, double s1, double s2, double s3) {
    return Moving{Vec3::UnitX(), Vec3::Zero(), Vec3::Zero(), {s0, s1, s2, s3}};
  };
  CHECK(along_normal(sized(1, 2, 3, 5), sized(7, 11, 13, 17)).K == 5 * 7 + 3 * 3 * 11 + 3 * 2 * 13 + 1 * 17);
  const Moving q = crossed(sized(1, 2, 3, 5), sized(1, 11, 13, 17));
  CHECK(q.size[0] == 1);
  CHECK(q.size[1] == 2 + 11);
  CHECK(q.size[2] == 3 + 2 * 2 * 11 + 13);
  CHECK(q.size[3] == 5 + 3 * 3 * 11 + 3 * 2 * 13 + 17);
  // Arms across the axes of turning, 2 and 3 m at 5 and 7 rad/s; 4 m/s; 6 m apart, over 0.5 s.
  const Vec3 x = Vec3::UnitX(), z = Vec3::UnitZ();
  const Moving d = between(6 * x, 4 * x, 5 * z, 2 * x, 7 * z, 3 * x, 0.5);
  CHECK(d.size[1] == 4 + 5 * 2 + 7 * 3);
  CHECK(d.size[0] == 6 + 0.5 * (4 + 5 * 2 + 7 * 3));
  CHECK(d.size[2] == 25 * 2 + 49 * 3);
  CHECK(d.size[3] == 125 * 2 + 343 * 3);
}

TEST_CASE("The first root of a parabola that starts above zero") {
  CHECK(first_root(6, -5, 2) == Approx(2));   // (s - 2)(s - 3)
  CHECK(first_root(6, 1, -2) == Approx(3));   // (3 - s)(s + 2)
  CHECK(first_root(6, -1, -2) == Approx(2));  // (2 - s)(s + 3)
  CHECK(first_root(6, -3, 0) == Approx(2));
  CHECK(first_root(8, 0, -4) == Approx(2));
  CHECK(first_root(1e-20, -1, 2) == Approx(1e-20));  // without cancellation
  for (const auto& [b, k] : {std::pair(0.0, 0.0), {1.0, 0.0}, {0.0, 1.0}, {5.0, 2.0}, {-1.0, 2.0}})
    CHECK(std::isinf(first_root(6, b, k)));
}

TEST_CASE("Over a safe step the worst of gaps stays above the target, and where none comes down it is all the rest") {
  Random random(483);
  int found = 0;
  for (int k = 0; k < 2000; ++k) {
    const Approach gap{std::pow(10, random.in(-6, 0)), random.in(-2, 1), random.in(-3, 3), random.in(0, 20)};
    const double target = gap.value * random.in(0, 0.9), rest = random.in(0.01, 2);
    const double step = safe_step(gap, target, rest);
    REQUIRE(step <= rest);
    REQUIRE(step > 0);
    for (int sample = 0; sample <= 20; ++sample) {
      const double s = step * sample / 20;
      const double worst = gap.value + s * (gap.rate + s * (gap.curvature / 2 - s * gap.K / 6));
      CHECK(worst >= target - 1e-12);
    }
    found += step < rest;
    // A margin that stands still is as far off as ever.
    CHECK(safe_step({gap.value, 0, 0, 0}, target, rest) == rest);
  }
  CHECK(found > 500);
  // Without a third derivative it is the parabola's root.
  CHECK(safe_step({7, -5, 2, 0}, 1, 10) == Approx(2));
  CHECK(safe_step({7, -5, 2, 0}, 1, 1.5) == 1.5);
}

TEST_CASE("Two lines with a radius stay apart over a safe step") {
  Random random(484);
  int found = 0;
  for (int k = 0; k < 1000; ++k) {
    Bodies b{random.vector(1), random.vector(2),   random.vector(3), random.vector(0.5),
             random.vector(3), random.vector(0.5), Vec3(),           Vec3()};
    b.e = random.rotation() * Vec3::UnitX();
    b.f = random.rotation() * Vec3::UnitX();
    if (b.across(0).dot(b.distance(0)) < 0) b.f = -b.f;
    const auto gap = [&](double t) { return b.across(t).dot(b.distance(t)) / b.across(t).norm(); };
    const double radius = k % 4 ? 0.5 * gap(0) : 0, target = random.in(0, 0.5) * (gap(0) - radius);
    const double rest = std::pow(10, random.in(-3, 0));
    if (b.across(0).norm() < 1e-2 || gap(0) < 1e-3) continue;
    const double step = safe_step_across(b.moving_across(), along_normal(b.moving_across(), b.moving_distance(rest)),
                                         radius, target, rest);
    REQUIRE(step >= 0);
    REQUIRE(step <= rest);
    found += step < rest && step > 0;
    for (int sample = 0; sample <= 20; ++sample) {
      const double t = step * sample / 20;
      CHECK((gap(t) - radius) * b.across(t).norm() >= target * b.across(0).norm() - 1e-12);
    }
  }
  CHECK(found > 200);
}

TEST_CASE("The distance of two edges is told less the goal, times the sine of their angle; none where it is reached") {
  const Goal goal{1e-3, 1e-6, 1};
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY(), z = Vec3::UnitZ(), none = Vec3::Zero();
  const Vec3 leaning = 0.6 * x + 0.8 * z;
  const auto told = [&](double height, double speed) {
    const Moving q = crossed(turning_direction(z, none), turning_direction(leaning, none));
    return edge_over_edge(q, between(height * y + 0.3 * x, speed * y, none, none, none, none, 1), goal);
  };
  const Approach gap = told(0.5, -3);
  CHECK(gap.value == Approx(0.6 * (0.5 - 1e-6)).epsilon(1e-12));
  CHECK(gap.rate == Approx(-0.6 * 3));
  CHECK(told(1e-6, -3).value == 0);
  CHECK(told(1e-6 + 0.005 * 1e-3, -3).value == 0);
  CHECK(told(1e-6 + 0.02 * 1e-3, -3).value > 0);
}

TEST_CASE("Two that touch are said to get deeper by the arcs of what touches, and by what approaches") {
  // A cube of 2 m on another; both spin about the vertical and the upper one comes down. Its reach is sqrt(3) m.
  const Shape cube = box(2, 2, 2), ball = sphere(1.5);
  const double reach = std::sqrt(3.0);
  for (const double spin : {0.0, 3.0})
    for (const double spin_below : {0.0, 5.0})
      for (const double fall : {0.0, 0.25})
        for (const double gap : {0.0, -1e-8, 1e-10}) {
          const Motion high{at(0, 2 + gap, 0), Vec3(0.5, -fall, 0), Vec3(0, spin, 0)},
              low{at(0, 0, 0), Vec3(0.5, 0, 0), Vec3(0, -spin_below, 0)};
          const Goal goal{1e-9, 1e-12, 1e-2};
          const double fastest = 700;
          const auto depth = depth_of_arrival(cube, high, cube, low, fastest, gap, goal);
          const double arcs =
              (2 * (spin + spin_below) * fastest + spin * spin * reach + spin_below * spin_below * reach) *
              goal.horizon * goal.horizon / 2;
          REQUIRE(depth.has_value());
          CHECK(closing_speed(cube, high, cube, low, goal.closed) == Approx(fall));
          CHECK(*depth == Approx(std::min(0.0, gap) - arcs - fall * goal.horizon).epsilon(1e-12).margin(5e-9));
          CHECK(*depth < std::min(0.0, gap) - goal.closed);
        }
  // The reach is that of each: of a ball's middle none.
  const Motion on_top{at(0, 2.5, 0), Vec3::Zero(), Vec3(0, 30, 0)}, still{at(0, 0, 0), Vec3::Zero(), Vec3::Zero()};
  const auto of_ball = depth_of_arrival(ball, on_top, cube, still, 1, 0, {1e-9, 1e-12, 1e-3});
  CHECK(of_ball.value_or(0) == Approx(-30.0 * 1e-6).margin(5e-9));
  const Motion turning{at(0, 0, 0), Vec3::Zero(), Vec3(0, 30, 0)},
      still_on_top{at(0, 2.5, 0), Vec3::Zero(), Vec3::Zero()};
  CHECK(depth_of_arrival(ball, still_on_top, cube, turning, 1, 0, {1e-9, 1e-12, 1e-3}).value_or(0) ==
        Approx(-(30.0 + 450 * reach) * 1e-6).margin(5e-9));
  // Slower than what touches explains: never.
  CHECK(!depth_of_arrival(cube, {at(0, 2, 0), Vec3(0, 1, 0), Vec3::Zero()}, cube, still, 1e-8, 0, {1e-9, 1e-12, 0.1}));
}

TEST_CASE("Points that approach do so at the fastest of their speeds, whichever way they are named and turn") {
  // On an end that turns down at 2 rad/s, 1 m from the middle, which goes up at 0.5 m/s.
  const Shape plank = box(2, 1, 1), table = box(10, 2, 10);
  const Motion high{at(0, 0.5, 0), Vec3(7, 0.5, 3), Vec3(0, 0, -2)}, low{at(0, -1, 0), Vec3(7, 0, 3), Vec3::Zero()};
  CHECK(closing_speed(plank, high, table, low, 1e-9) == Approx(1.5));
  CHECK(closing_speed(table, low, plank, high, 1e-9) == Approx(1.5));
  // The table turns up to it at 1 rad/s about its own middle.
  const Motion rising{at(0, -1, 0), Vec3(7, 0, 3), Vec3(0, 0, 1)};
  CHECK(closing_speed(plank, high, table, rising, 1e-9) == Approx(2.5));
  CHECK(closing_speed(plank, {at(0, 0.5, 0), Vec3(0, 3, 0), Vec3::Zero()}, table, {at(0, -1, 0)}, 1e-9) == 0);
  CHECK(closing_speed(plank, {at(0, 0.6, 0), Vec3(0, -3, 0), Vec3::Zero()}, table, {at(0, -1, 0)}, 1e-9) == 0);
}
