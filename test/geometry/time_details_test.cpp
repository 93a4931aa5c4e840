// Times of contact of every two kinds of shapes against bisection on their separation, and at the bounds of what counts
// as open.
#include <catch2/catch.hpp>
#include <functional>

#include "geometry/placed_shapes.h"

using namespace cb;
using namespace cb::test;

namespace {

constexpr double tol = 1e-9;

Motion moving(const Pose& pose, const Vec3& v = Vec3::Zero(), const Vec3& w = Vec3::Zero()) { return {pose, v, w}; }

/// One of each kind, 1 m high about its origin and with something below it, whichever way it is turned about y.
std::vector<Shape> one_of_each() {
  return {sphere(0.5), box(0.8, 1, 0.6), cylinder(0.4, 1), capsule(0.3, 0.4), box_hull(0.8, 1, 0.6), cylinder(0.4, 0)};
}
double half_height(const Shape& shape) {
  if (shape.kind == ShapeKind::half_space) return 0;
  return shape.kind == ShapeKind::cylinder ? shape.half_extents.y() : 0.5;
}

/// Both orders of naming give the same within `margin`.
double time_either_way(const Shape& a, const Motion& motion_a, const Shape& b, const Motion& motion_b, double tolerance,
                       double horizon, double margin) {
  const double t = time_of_contact(a, motion_a, b, motion_b, tolerance, horizon);
  CHECK(time_of_contact(b, motion_b, a, motion_a, tolerance, horizon) == Approx(t).epsilon(0).margin(margin));
  return t;
}

/// The two at a height of `gap` above each other, the upper one moving down, as seen in a frame; told of the pair.
void for_each_stack(const Pose& frame, double gap,
                    const std::function<void(const Shape&, const Pose&, const Shape&, const Pose&)>& told) {
  std::vector<Shape> lower = one_of_each();
  lower.push_back(half_space());
  for (const Shape& low : lower)
    for (const Shape& high : one_of_each()) {
      INFO(name(low.kind) << " below " << name(high.kind));
      told(high, frame * at(0, half_height(low) + half_height(high) + gap, 0), low, frame);
    }
}

}  // namespace

TEST_CASE("What is beyond the tolerance by half of it is open, and closes when it is a thousandth of it apart") {
  constexpr double tolerance = 1e-6, gap = 1.5 * tolerance, speed = 2;
  for (const Pose& frame : {at(0, 0, 0), at(Vec3(0.3, -0.2, 0.5), turn(0.7, Vec3(1, 2, -1)))})
    for_each_stack(frame, gap, [&](const Shape& high, const Pose& up, const Shape& low, const Pose& down) {
      const Vec3 n = frame.q * Vec3::UnitY();
      // Only just fast enough within the horizon; with a motion that both share, or about the normal.
      for (const Vec3& along : {Vec3(Vec3::Zero()), Vec3(frame.q * Vec3(0.01, 0, 0.02))})
        for (const double spin : {0.0, 0.3}) {
          const Motion falling = moving(up, along - speed * n, spin * n), still = moving(down);
          const double t = time_either_way(high, falling, low, still, tolerance, 2 * gap / speed, 1e-3 * gap / speed);
          CHECK(t == Approx((gap - 1e-3 * tolerance) / speed).epsilon(2e-4));
          // Not as fast as that, or the other way: the horizon.
          const double early = 0.3 * gap / speed;
          CHECK(time_either_way(high, falling, low, still, tolerance, early, 0) == early);
          for (const double up_again : {2.0, 0.5, 0.0}) {
            const Motion rising = moving(up, along + up_again * n, spin * n);
            CHECK(time_either_way(high, rising, low, still, tolerance, 1e-3, 0) == 1e-3);
          }
        }
      if (low.kind == ShapeKind::half_space) return;
      // It is the lower one that moves, or both.
      for (const double part : {0.5, 1.0})
        CHECK(time_either_way(high, moving(up, (part - 1) * speed * n), low, moving(down, part * speed * n), tolerance,
                              2 * gap / speed,
                              1e-3 * gap / speed) == Approx((gap - 1e-3 * tolerance) / speed).epsilon(2e-4));
    });
}

TEST_CASE("What is within the tolerance by half of it is closed, and is not found again as it comes nearer") {
  constexpr double tolerance = 1e-6;
  for_each_stack(at(0, 0, 0), 0.5 * tolerance,
                 [&](const Shape& high, const Pose& up, const Shape& low, const Pose& down) {
                   // Nor where it turns down to one side, or both do.
                   for (const Vec3& w : {Vec3(0, 0, 0), Vec3(0.03, 0, -0.05)}) {
                     const Motion falling = moving(up, Vec3(0, -0.2, 0), w);
                     const Motion below = moving(down, Vec3::Zero(), (low.kind == ShapeKind::half_space ? 0 : -1) * w);
                     CHECK(time_either_way(high, falling, low, below, tolerance, 1e-4, 0) == 1e-4);
                   }
                 });
}

TEST_CASE("A thousand kilometres away a gap of 2 ulp is closed whatever was asked for; an open one closes at 2 ulp") {
  constexpr double far = 1e6, ulp = 0x1p-52 * far, speed = 1e-3;
  const Pose frame = at(far, far, far);
  for (const double gap : {2 * ulp, 40 * ulp})
    for_each_stack(frame, gap, [&](const Shape& high, const Pose& up, const Shape& low, const Pose& down) {
      const Motion falling = moving(up, Vec3(0, -speed, 0));
      const double t = time_either_way(high, falling, low, moving(down), 1e-14, 1e-3, 0.1 * ulp / speed);
      const double rounded = separation(high, up, low, down);
      CHECK(t == Approx(gap < 4 * ulp ? 1e-3 : (rounded - 2 * ulp) / speed).epsilon(0).margin(0.2 * ulp / speed));
    });
}

TEST_CASE("However it is turned, what falls by a hair on to a face lands after its height over its speed") {
  Random random(462);
  constexpr double tolerance = 1e-7, speed = 3;
  std::vector<Shape> kinds = one_of_each();
  kinds.push_back(box(0.02, 1, 0.4));
  kinds.push_back(box(1, 1, 1));
  kinds.push_back(cylinder(0.05, 2));
  kinds.push_back(hull({{1, 0, 0}, {-0.8, 0.1, 0}, {0, 1, 0.1}, {0.1, -0.9, 0}, {0, 0.2, 1}, {0.3, 0.1, -1}}));
  for (const Shape& under : {half_space(), box(20, 2, 20), box_hull(20, 2, 20), cylinder(10, 2)})
    for (const Shape& high : kinds)
      for (int k = 0; k < 4; ++k) {
        INFO(name(high.kind) << " over " << name(under.kind) << ", " << k);
        const Pose frame = random.pose(2), down = frame * at(0, under.kind == ShapeKind::half_space ? 0 : -1, 0);
        const Vec3 n = frame.q * Vec3::UnitY();
        // A corner right below the middle, and any other way.
        Pose up = frame * at(random.in(-1, 1), 3, random.in(-1, 1));
        up.q = k > 0 ? random.rotation() : Quat::FromTwoVectors(high.half_extents + Vec3(0, 1e-9, 0), -n);
        const double height = 1e-3 * random.in(0.5, 1);
        for (int i = 0; i < 3; ++i) up.p -= (separation(high, up, under, down) - height) * n;
        const Motion falling = moving(up, random.vector(1).cross(n) - speed * n);
        const double t = time_either_way(high, falling, under, moving(down), tolerance, 1.5 * height / speed, 1e-13);
        CHECK(t == Approx((height - 1e-3 * tolerance) / speed).epsilon(0).margin(tolerance / speed / 50));
      }
}

TEST_CASE("An end that turns down faster than its body rises is found, one that does not is not") {
  constexpr double tolerance = 1e-9, turning = 2, height = 1e-6;
  const Quat lying = turn(-pi / 2, Vec3::UnitZ());
  struct Case {
    Shape shape;
    Quat q;
  };
  const Quat on_a_corner = turn(pi / 4, Vec3::UnitY());
  const Case cases[] = {{box(2, 2, 2), on_a_corner},
                        {box_hull(2, 2, 2), on_a_corner},
                        {capsule(0.3, 2), lying},
                        {cylinder(0.01, 2), lying}};
  for (const Case& one : cases)
    for (const double frame_angle : {0.0, 0.8}) {
      INFO(name(one.shape.kind));
      const Pose frame = at(Vec3(1, 2, 3), turn(frame_angle, Vec3(1, 1, 0)));
      const double tilt = 0.1;
      const Quat q = turn(-tilt, Vec3::UnitZ()) * one.q;
      Pose pose = at(Vec3(0, 5, 0), q);
      pose.p.y() -= separation(one.shape, pose, half_space(), at(0, 0, 0)) - height;
      const auto low = points(one.shape, pose, half_space(), at(0, 0, 0), 2 * height);
      REQUIRE(!low.empty());
      const double arm = low[0].position.x() - pose.p.x();  // level, from the middle to what comes down
      REQUIRE(std::abs(arm) > 0.85);
      const Vec3 w(0, 0, arm > 0 ? -turning : turning);
      for (const double rise : {0.95, 1.05}) {
        const double speed = rise * turning * std::abs(arm);
        const Motion motion = moving(frame * pose, frame.q * Vec3(0.1, speed, 0), frame.q * w);
        const double t = time_of_contact(one.shape, motion, half_space(), moving(frame), tolerance, 1e-4);
        if (rise > 1)
          CHECK(t == 1e-4);
        else
          CHECK(t == Approx(height / (0.05 * turning * std::abs(arm))).epsilon(5e-3));
      }
    }
}

TEST_CASE("A bar that turns about its own middle meets what is in its way after angle over speed") {
  // In the plane of x and y, half 0.1 m thick; what is in its way is round there, of 0.3 m, its middle 2 m away.
  constexpr double tolerance = 1e-7, speed = 2, angle = 1, away = 2, thick = 0.1, round = 0.3;
  const double meets = angle - std::asin((thick + round + 1e-3 * tolerance) / away);
  const Quat upright = turn(pi / 2, Vec3::UnitX()), lying = turn(-pi / 2, Vec3::UnitZ());
  const std::pair<Shape, Quat> bars[] = {{box(6, 2 * thick, 1), Quat::Identity()},
                                         {box_hull(6, 2 * thick, 1), Quat::Identity()},
                                         {capsule(thick, 6), lying},
                                         {cylinder(thick, 6), lying}};
  const std::pair<Shape, Quat> others[] = {
      {sphere(round), Quat::Identity()}, {capsule(round, 1), upright}, {cylinder(round, 1), upright}};
  const Pose frame = at(Vec3(1, -2, 3), turn(0.7, Vec3(1, 2, -1)));
  for (const auto& [bar, q] : bars)
    for (const auto& [other, r] : others)
      for (const Vec3& common : {Vec3(0, 0, 0), Vec3(3, -1, 2)})
        for (const double own : {0.0, 5.0}) {
          INFO(name(bar.kind) << " at " << name(other.kind) << ", " << own);
          const Vec3 z = frame.q * Vec3::UnitZ();
          const Motion turning = moving(frame * at(Vec3::Zero(), q), common, speed * z);
          const Motion in_its_way =
              moving(frame * at(away * Vec3(std::cos(angle), std::sin(angle), 0), r), common, own * z);
          const double t = time_either_way(bar, turning, other, in_its_way, tolerance, 1, tolerance / speed);
          // It need not be nearer than the tolerance.
          CHECK(t <= meets / speed + 1e-12);
          CHECK(t >= meets / speed - tolerance / speed / 2);
          const double early = 0.9 * meets / speed;
          CHECK(time_either_way(bar, turning, other, in_its_way, tolerance, early, 0) == early);
        }
}

TEST_CASE("Whatever meets does so at the time that bisection on their separation says, and touches then") {
  Random random(461);
  std::vector<Shape> kinds = one_of_each();
  kinds.push_back(half_space());
  const std::vector<Vec3> rock{{1, 0, 0}, {-0.8, 0.1, 0}, {0, 1, 0.1}, {0.1, -0.9, 0}, {0, 0.2, 1}, {0.3, 0.1, -1}};
  kinds.push_back(hull(rock));
  constexpr double horizon = 0.5;
  int met = 0, passed = 0;
  for (std::size_t i = 0; i < kinds.size(); ++i)
    for (std::size_t j = 0; j <= i; ++j)
      for (int k = 0; k < 24; ++k) {
        const Shape &a = kinds[i], &b = kinds[j];
        if (a.kind == ShapeKind::half_space && b.kind == ShapeKind::half_space) continue;
        // Coming at each other from 2 m, with a miss that grazes as often as not; spinning slowly, fast, about their
        // own axes, or not at all.
        const double spin = k % 4 == 0 ? 0 : k % 4 == 1 ? 0.5 : 8;
        const Vec3 away = random.vector(1).normalized(), beside = random.vector(1).cross(away).normalized();
        const Pose frame = at(random.vector(k % 3 ? 1 : 1000), random.rotation());
        const auto plane = [](const Shape& shape) { return shape.kind == ShapeKind::half_space; };
        Motion one = moving(at(frame * (2.0 * away + (k % 2 ? random.in(0, 1.4) : 0.1) * beside), random.rotation()),
                            Vec3::Zero(), random.vector(spin));
        Motion other = moving(at(frame.p, random.rotation()), Vec3::Zero(), random.vector(spin));
        if (k % 4 == 3) one.w = spin * (one.pose.q * Vec3::UnitY());
        one.v = frame.q * (-random.in(2, 8) * away) + random.vector(0.2);
        if (plane(a) || plane(b)) {
          Motion& flat = plane(a) ? one : other;
          Motion& solid = plane(a) ? other : one;
          flat = moving(at(frame.p - 1.5 * (frame.q * away), Quat::FromTwoVectors(Vec3::UnitY(), frame.q * away)));
          solid.v = frame.q * Vec3(random.in(-4, -2) * away) + random.vector(1);
        } else {
          const Vec3 common = random.vector(3);
          one.v += common;
          other.v += common;
        }
        const auto gap = [&](double t) { return separation(a, advance(one, t), b, advance(other, t)); };
        if (gap(0) < 1e-3) continue;
        INFO(name(a.kind) << " and " << name(b.kind) << ", " << k);
        const double t = time_of_contact(a, one, b, other, tol, horizon);
        // Fine steps to the first that is deeper than zero, then halves.
        constexpr int steps = 400;
        double open = 0, closed = horizon;
        bool meets = false;
        for (int s = 1; s <= steps && !meets; ++s) {
          const double then = horizon * s / steps;
          meets = gap(then) <= 0;
          (meets ? closed : open) = then;
        }
        for (int half = 0; meets && half < 60; ++half) {
          const double middle = 0.5 * (open + closed);
          (gap(middle) <= 0 ? closed : open) = middle;
        }
        CHECK(gap(t) >= -1e-12);
        if (!meets) {
          ++passed;
          // It may have grazed between two looks: then it touches.
          if (t < horizon) CHECK(gap(t) <= tol);
          continue;
        }
        ++met;
        CHECK(t <= closed);
        CHECK(gap(t) <= tol);
        // Over the ground steps go on until the landing is exact.
        if (plane(a) || plane(b)) CHECK(gap(t) <= 5e-3 * tol + 1e-12);
        std::vector<ContactPoint> found;
        contact_points(a, advance(one, t), 0, b, advance(other, t), 1, tol, found);
        CHECK(!found.empty());
      }
  CHECK(met > 300);
  CHECK(passed > 100);
}

TEST_CASE("A beam that touches a slab's rim, its middle below the slab's, is found to lay its other end on the slab") {
  // It leans out over the rim of a slab and turns about it at first; then its middle goes straight on.
  const double lean = 0.12, inside = 0.3, side = 0.1, spin = 10, half_diagonal = std::sqrt(0.5) * side;
  const Vec3 arm = turn(-lean, Vec3::UnitZ()) * Vec3(1.5 - inside, half_diagonal, 0), w(0, 0, spin);  // from the rim
  const Quat on_edge = turn(-lean, Vec3::UnitZ()) * turn(pi / 4, Vec3::UnitX());
  const Motion beam = moving(at(Vec3(1, 0.05, 0) + arm, on_edge), w.cross(arm), w);
  REQUIRE(beam.pose.p.y() < 0);
  const auto height = [&](double t) {  // of the lower corner of its inner end above the face
    const double angle = spin * t - lean;
    return arm.y() + beam.v.y() * t - 1.5 * std::sin(angle) - half_diagonal * std::cos(angle);
  };
  const double horizon = 1.5 * lean / spin;
  double open = 0, closed = horizon;
  for (int k = 0; k < 60; ++k) {
    const double middle = 0.5 * (open + closed);
    (height(middle) > 0 ? open : closed) = middle;
  }
  const double t = time_of_contact(box(2, 0.1, 2), moving(at(0, 0, 0)), box(3, side, side), beam, tol, horizon);
  CHECK(t == Approx(closed).epsilon(1e-6));
}
