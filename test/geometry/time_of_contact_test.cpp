#include <catch2/catch.hpp>

#include "geometry/advancement.h"
#include "geometry/placed_shapes.h"

using namespace cb;
using namespace cb::test;

namespace {

constexpr double tol = 1e-9;

Motion moving(const Pose& pose, const Vec3& v = Vec3::Zero(), const Vec3& w = Vec3::Zero()) {
  Motion motion;
  motion.pose = pose;
  motion.v = v;
  motion.w = w;
  return motion;
}

// Heights of the corners of a box above y = 0 after t seconds.
std::vector<double> heights(const Shape& shape, const Motion& motion, double t) {
  std::vector<double> out;
  for (const Vec3& x : corners(shape, advance(motion, t))) out.push_back(x.y());
  return out;
}

// What touches now (as many points), touches more at the time of contact, or goes on to the horizon, whoever is first.
void check_something_closes(const Shape& a, const Motion& motion_a, const Shape& b, const Motion& motion_b,
                            double closed, double horizon, std::size_t touching) {
  for (const bool swap : {false, true}) {
    const double t = swap ? time_of_contact(b, motion_b, a, motion_a, closed, horizon)
                          : time_of_contact(a, motion_a, b, motion_b, closed, horizon);
    std::vector<ContactPoint> before, then;
    contact_points(a, motion_a.pose, 0, b, motion_b.pose, 1, closed, before);
    contact_points(a, advance(motion_a, t), 0, b, advance(motion_b, t), 1, closed, then);
    CAPTURE(swap, t);
    CHECK(before.size() == touching);
    CHECK((t == horizon || then.size() > before.size()));
  }
}

}  // namespace

TEST_CASE("A falling sphere and a falling box meet the ground when distance over speed says") {
  const Motion ground = moving(at(0, 0, 0));
  // Gap 0.5 m at 10 m/s: 0.05 s, less half the tolerance.
  const double t = time_of_contact(sphere(1), moving(at(0, 1.5, 0), Vec3(3, -10, 0)), half_space(), ground, tol, 1);
  CHECK(t == Approx(0.05).margin(1.0e-10));
  const Pose landed = advance(moving(at(0, 1.5, 0), Vec3(3, -10, 0)), t);
  CHECK(separation(sphere(1), landed, half_space(), at(0, 0, 0)) > 0);
  CHECK(separation(sphere(1), landed, half_space(), at(0, 0, 0)) < 0.01 * tol);
  const Motion falling = moving(at(0, 1, 0), Vec3(0, -10, 0));
  const double t_box = time_of_contact(box(1, 1, 1), falling, half_space(), ground, tol, 1);
  CHECK(t_box == Approx(0.05).margin(1.0e-10));
  CHECK(time_of_contact(half_space(), ground, box(1, 1, 1), falling, tol, 1) == t_box);
  // Too slow, receding, or at rest: the horizon, exactly.
  CHECK(time_of_contact(box(1, 1, 1), falling, half_space(), ground, tol, 0.049) == 0.049);
  CHECK(time_of_contact(box(1, 1, 1), moving(at(0, 1, 0), Vec3(0, 10, 0)), half_space(), ground, tol, 1) == 1);
  CHECK(time_of_contact(box(1, 1, 1), moving(at(0, 1, 0)), half_space(), ground, tol, 1) == 1);
}

TEST_CASE("What is closed is left aside: a resting box pressed down has no time of contact") {
  const Motion ground = moving(at(0, 0, 0));
  CHECK(time_of_contact(box(1, 1, 1), moving(at(0, 0.5, 0), Vec3(1, -0.1, 0)), half_space(), ground, tol, 0.1) == 0.1);
  CHECK(time_of_contact(sphere(1), moving(at(0, 1, 0), Vec3(1, -0.1, 0)), half_space(), ground, tol, 0.1) == 0.1);
  CHECK(time_of_contact(sphere(1), moving(at(0, 2, 0), Vec3(0, -1, 0)), sphere(1), ground, tol, 0.1) == 0.1);
  CHECK(time_of_contact(box(1, 1, 1), moving(at(0, 1, 0), Vec3(1e-3, -0.1, 0)), box(1, 1, 1), ground, tol, 0.1) == 0.1);
  CHECK(time_of_contact(sphere(1), moving(at(0, 1.5, 0), Vec3(0, -1, 0)), box(1, 1, 1), ground, tol, 0.1) == 0.1);
}

TEST_CASE("A box that turns about the edge it rests on lies flat after angle over speed") {
  // Unit cube tilted by `angle` about z round its edge at the origin, turning back at 2 rad/s: the centre moves on a
  // circle about the edge, here along its tangent, so the closed form is for the sampled motion itself.
  const double angle = 1e-3, speed = 2;
  const Quat tilt = turn(angle, Vec3(0, 0, 1));
  const Vec3 centre = tilt * Vec3(0.5, 0.5, 0), w(0, 0, -speed);
  const Motion motion = moving(at(centre, tilt), w.cross(centre), w);
  for (const bool on_box : {false, true}) {
    const Shape floor = on_box ? box(4, 4, 4) : half_space();
    const Motion ground = moving(at(0, on_box ? -2.0 : 0.0, 0));
    const double t = time_of_contact(box(1, 1, 1), motion, floor, ground, tol, 0.01);
    CHECK(t == Approx(angle / speed).epsilon(2e-3));
    // The two far corners are what lands, with a gap between 0 and the tolerance.
    const auto high = heights(box(1, 1, 1), motion, t);
    for (const int corner : {1, 5}) {
      CHECK(high[corner] > 0);
      CHECK(high[corner] <= tol);
    }
  }
}

TEST_CASE("A tilted beam across another falls flat on it although no corner is near") {
  // Beams of length 4 across each other. The upper one touches with the lower one's edge at x = -0.25 and turns about
  // it.
  const double angle = 2e-3, speed = 1;
  const Quat tilt = turn(angle, Vec3(0, 0, 1));
  const Vec3 pivot(-0.25, 0.5, 0), w(0, 0, -speed);
  const Vec3 centre = pivot + tilt * Vec3(0.25, 0.5, 0);
  const Motion upper = moving(at(centre, tilt), w.cross(centre - pivot), w);
  const Motion lower = moving(at(0, 0, 0));
  const Shape a = box(4, 1, 0.5), b = box(0.5, 1, 4);
  const double t = time_of_contact(a, upper, b, lower, tol, 0.01);
  CHECK(t == Approx(angle / speed).epsilon(4e-3));
  // What lands is the other edge of the lower beam. The first has lifted by the second order of the step: the body's
  // centre moves straight on while it turns.
  const auto landed = points(a, advance(upper, t), b, lower.pose);
  REQUIRE(landed.size() == 2);
  for (const ContactPoint& p : landed) CHECK(p.position.x() == Approx(0.25).margin(1e-5));
  CHECK(time_of_contact(b, lower, a, upper, tol, 0.01) == Approx(angle / speed).epsilon(4e-3));
}

TEST_CASE("Boxes that tilt on one edge of a wide box lie flat on it as on the ground") {
  Random random(44);
  int landed = 0, both = 0;
  for (int k = 0; k < 600; ++k) {
    // Tilted about one of its lower edges and turned about the vertical; the edge is on the ground to round-off.
    const Shape shape = box(random.in(0.5, 2), random.in(0.5, 2), random.in(0.5, 2)), table = box(20, 2, 20);
    const double tilt = std::pow(10, random.in(-4, -1));
    const Quat yaw = turn(random.in(-3, 3), Vec3(0, 1, 0));
    const Quat tilted = turn(k % 2 ? tilt : -tilt, k % 4 < 2 ? Vec3(0, 0, 1) : Vec3(1, 0, 0));
    const Vec3 back = yaw * ((k % 2 ? -1 : 1) * (k % 4 < 2 ? Vec3(0, 0, 1) : Vec3(1, 0, 0)));
    Motion motion = moving(at(random.vector(1), (yaw * tilted).normalized()), random.vector(0.2),
                           random.in(0, 3) * back + random.vector(0.1));
    double lowest = 1e9;
    for (const double y : heights(shape, motion, 0)) lowest = std::min(lowest, y);
    motion.pose.p.y() -= lowest;
    const double horizon = 0.02;
    const double on_ground = time_of_contact(shape, motion, half_space(), moving(at(0, 0, 0)), tol, horizon);
    const Motion still = moving(at(0, -1, 0));
    const double t = k % 3 ? time_of_contact(shape, motion, table, still, tol, horizon)
                           : time_of_contact(table, still, shape, motion, tol, horizon);
    const auto at_start = heights(shape, motion, 0);
    for (int sample = 0; sample <= 50; ++sample) {
      const auto now = heights(shape, motion, t * sample / 50);
      for (int i = 0; i < 8; ++i)
        if (at_start[i] > tol) CHECK(now[i] >= 0);
    }
    landed += t < horizon;
    both += on_ground < horizon;
    if (t == horizon || on_ground == horizon) continue;
    CHECK(t == Approx(on_ground).margin(1e-6));
    double nearest_open = 1e9;
    const auto at_end = heights(shape, motion, t);
    for (int i = 0; i < 8; ++i)
      if (at_start[i] > tol) nearest_open = std::min(nearest_open, at_end[i]);
    CHECK(nearest_open <= tol);
  }
  CHECK(landed > 150);
  CHECK(landed == both);
}

TEST_CASE("A pair that hovers just beyond the tolerance, turning about the near corner, is not cut into small steps") {
  // Centre at rest above the corner's path: the corner is at its lowest, 1e-8 m above a face, and swings up both ways.
  const double r2 = std::sqrt(0.5);
  const Motion swinging = moving(at(Vec3(0, r2 + 1e-8, 0), turn(pi / 4, Vec3(0, 0, 1))), Vec3(1, 0, 0), Vec3(0, 0, 3));
  CHECK(time_of_contact(box(1, 1, 1), swinging, half_space(), moving(at(0, 0, 0)), tol, 1e-3) == 1e-3);
  const Motion table = moving(at(0, -1, 0));
  CHECK(time_of_contact(box(1, 1, 1), swinging, box(20, 2, 20), table, tol, 1e-3) == 1e-3);
  CHECK(time_of_contact(box(20, 2, 20), table, box(1, 1, 1), swinging, tol, 1e-3) == 1e-3);
  // Both turn together, one on the other, with a hair between them.
  const Vec3 w(0.5, 1, 2), v = w.cross(Vec3(0, 1 + 1e-8, 0));
  const Motion low = moving(at(0, 0, 0), Vec3::Zero(), w), high = moving(at(0, 1 + 1e-8, 0), v, w);
  // The upper one's centre goes straight on: the gap grows with the square of time, |w|^2 - ... > 0.
  CHECK(time_of_contact(box(1, 1, 1), high, box(1, 1, 1), low, tol, 1e-3) == 1e-3);
}

TEST_CASE("Edges a hair out of line are followed to where they touch, not to where the sine between them ends") {
  // From a stack whose boxes are turned against each other by 7e-5 rad: one corner touches, others come down. It came
  // back after 2e-19 s with nothing closed, and did so again and again.
  const Motion low =
      moving(at(Vec3(9.5513619676275101e-05, 0.095250016453326175, -8.7599961086579257e-05),
                Quat(0.99999998618687114, -1.4914167322806226e-08, 0.00016621148137432577, -3.0163265896319953e-08)),
             Vec3(0.0010121061743295799, 0.0023361395480955755, -0.00038215511453427824),
             Vec3(0.0049835394874111795, -0.0046945060080079946, -0.018622046078542665));
  const Motion high =
      moving(at(Vec3(9.7957272463986686e-05, 0.22284502201857143, -9.3037991599394511e-05),
                Quat(0.99999997974039201, -2.6864916420144094e-08, 0.00020129384999054441, -3.2635080744403087e-08)),
             Vec3(0.0014157983638898768, 0.00036698897268014271, -0.0011807088775772018),
             Vec3(-0.0086492266401919111, -0.010362806242626241, 0.0079047404059687815));
  const Shape lower = box(0.3507, 0.1905, 0.3931), upper = box(0.3507, 0.06469, 0.3931);
  constexpr double closed = 3.931e-10, horizon = 9.19e-4;
  check_something_closes(lower, low, upper, high, closed, horizon, 1);
  check_something_closes(box_hull(0.3507, 0.1905, 0.3931), low, box_hull(0.3507, 0.06469, 0.3931), high, closed,
                         horizon, 1);
}

TEST_CASE("Edges that pass each other sideways, over faces that lean, are not waited for") {
  // Two bricks of a wall that is hit, side by side: one upright edge touches, the sides open by 0.09 rad behind it, and
  // the other upright edges are out of line by 1e-8. Their lines cut each other where the sides are apart: it came back
  // at once with nothing closed, a thousand times.
  const Motion left =
      moving(at(Vec3(-0.20283375595753503, 0.056850002914429154, 0.00014270354915683916),
                Quat(0.9999999868023578, 2.4687848477608404e-09, -0.00016246625580200141, -6.0811867129165311e-09)),
             Vec3(-0.0034499848477865937, -0.00020098895564805796, 0.0013511722721189345),
             Vec3(-0.0047402798925417705, -0.00077968617742169878, -0.0011449394206821117));
  const Motion right =
      moving(at(Vec3(0.20955132304893032, 0.056850000342718844, 0.042933716183218042),
                Quat(0.99902026051867565, 1.6449846948230433e-09, 0.044255158718478176, 3.2544099033887637e-11)),
             Vec3(0.032849354032412251, 5.7091519716323606e-05, 0.21176438861584837),
             Vec3(0.0006232097553107367, 0.49759930373044248, -5.5323153260994111e-05));
  const Shape brick = box(0.4051, 0.1137, 0.1825);
  check_something_closes(brick, left, brick, right, 4.051e-10, 9.37e-4, 1);
  const Shape as_hull = box_hull(0.4051, 0.1137, 0.1825);
  check_something_closes(as_hull, left, as_hull, right, 4.051e-10, 9.37e-4, 1);
}

TEST_CASE("A corner that swings down is found, one that swings past is not") {
  // A unit cube spinning about z at height h: the lowest corner reaches sqrt(1/2) below the centre.
  const Motion ground = moving(at(0, 0, 0));
  const Vec3 w(0, 0, 3);
  const double r2 = std::sqrt(0.5);
  CHECK(time_of_contact(box(1, 1, 1), moving(at(0, r2 + 1e-6, 0), Vec3::Zero(), w), half_space(), ground, tol, 2) == 2);
  // At height r2 cos(0.1) it touches when it has turned by 45 degrees less 0.1 rad.
  const double t = time_of_contact(box(1, 1, 1), moving(at(0, r2 * std::cos(0.1), 0), Vec3::Zero(), w), half_space(),
                                   ground, tol, 2);
  CHECK(t == Approx((pi / 4 - 0.1) / 3).margin(1e-8));
}

TEST_CASE("Two flying spheres meet where the quadratic says") {
  // Distance 5 along x, offset 1 across, radii 1 and 1, speed 4: 5 - 4 t = sqrt(4 - 1).
  const Motion a = moving(at(0, 0, 0), Vec3(2, 0, 0)), b = moving(at(5, 1, 0), Vec3(-2, 0, 0));
  CHECK(time_of_contact(sphere(1), a, sphere(1), b, tol, 10) == Approx((5 - std::sqrt(3)) / 4).margin(1e-8));
  const Motion miss = moving(at(5, 2.001, 0), Vec3(-2, 0, 0));
  CHECK(time_of_contact(sphere(1), a, sphere(1), miss, tol, 10) == 10);
}

TEST_CASE("Nothing tunnels through a plate of one millimetre at 100 km/s") {
  const Shape plate = box(10, 1e-3, 10);
  const double thin = 1e-12;  // 1e-9 of the plate's thickness
  for (const double above : {1e-2, 1.0, 90.0}) {
    const Vec3 v(0, -1e5, 0);
    for (const Shape& bullet : {box(1e-2, 1e-2, 1e-2), sphere(5e-3)}) {
      const Motion motion = moving(at(0.1, above, 0.2), v);
      const double t = time_of_contact(bullet, motion, plate, moving(at(0, 0, 0)), thin, 1e-3);
      const double gap = separation(bullet, advance(motion, t), plate, at(0, 0, 0));
      CHECK(t < 1e-3);
      CHECK(gap >= 0);
      CHECK(gap <= thin);
      // Spinning as well.
      const Motion spinning = moving(at(0.1, above, 0.2), v, Vec3(100, 20, 1000));
      const double t_spin = time_of_contact(bullet, spinning, plate, moving(at(0, 0, 0)), thin, 1e-3);
      const double gap_spin = separation(bullet, advance(spinning, t_spin), plate, at(0, 0, 0));
      CHECK(t_spin < 1e-3);
      CHECK(gap_spin >= -thin);
      CHECK(gap_spin <= thin);
    }
  }
}

TEST_CASE("A thousand kilometres from the origin a falling box still lands closed") {
  const double far = 1e6;
  const Motion ground = moving(at(far, far, far)), falling = moving(at(far, far + 1, far), Vec3(0, -10, 0));
  const double t = time_of_contact(box(1, 1, 1), falling, half_space(), ground, tol, 1);
  CHECK(points(box(1, 1, 1), advance(falling, t), half_space(), ground.pose, tol).size() == 4);
  const double t_box = time_of_contact(box(1, 1, 1), falling, box(1, 1, 1), moving(at(far, far - 0.5, far)), tol, 1);
  CHECK(points(box(1, 1, 1), advance(falling, t_box), box(1, 1, 1), at(far, far - 0.5, far), tol).size() == 4);
}

TEST_CASE(
    "Random boxes over the ground: each corner that is open stays out, and the first lands within the tolerance") {
  Random random(41);
  int landed = 0;
  for (int k = 0; k < 2000; ++k) {
    const Shape shape = box(random.in(0.2, 2), random.in(0.2, 2), random.in(0.2, 2));
    const double horizon = std::pow(10, random.in(-3, 0));
    Motion motion = moving(random.pose(1), random.vector(3), random.vector(k % 4 ? 6 : 1e-6));
    // Sunk, touching or above; some start with a corner exactly on the ground.
    double lowest = 1e9;
    for (const double y : heights(shape, motion, 0)) lowest = std::min(lowest, y);
    motion.pose.p.y() += k % 2 ? -lowest : random.in(-0.5, 0.5);
    const double t = time_of_contact(shape, motion, half_space(), moving(at(0, 0, 0)), tol, horizon);
    REQUIRE(t >= 0);
    REQUIRE(t <= horizon);
    const auto at_start = heights(shape, motion, 0), at_end = heights(shape, motion, t);
    double least = 1e9;
    for (int sample = 0; sample <= 100; ++sample) {
      const auto now = heights(shape, motion, t * sample / 100);
      for (int i = 0; i < 8; ++i)
        if (at_start[i] > tol) least = std::min(least, now[i]);
    }
    CHECK(least >= 0);
    if (t < horizon) {
      ++landed;
      double nearest_open = 1e9;
      for (int i = 0; i < 8; ++i)
        if (at_start[i] > tol) nearest_open = std::min(nearest_open, at_end[i]);
      CHECK(nearest_open <= tol);
    }
  }
  CHECK(landed > 300);
}

TEST_CASE("Random pairs in flight: never deeper than the tolerance before, and within it at the time returned") {
  Random random(42);
  int landed = 0, total = 0;
  while (total < 1500) {
    const auto shape = [&random](int kind) {
      const double x = random.in(0.2, 2), y = random.in(0.2, 2), z = random.in(0.2, 2);
      return kind == 0 ? box(x, y, z) : sphere(x / 2);
    };
    const int kinds[3][2] = {{0, 0}, {0, 1}, {1, 1}};
    const Shape a = shape(kinds[total % 3][0]), b = shape(kinds[total % 3][1]);
    const double spin = total % 5 == 0 ? 0 : 4;
    Motion motion_a = moving(random.pose(2), random.vector(2), random.vector(spin));
    const Motion motion_b = moving(random.pose(2), random.vector(2), random.vector(spin));
    motion_a.v += 3 * (motion_b.pose.p - motion_a.pose.p);
    if (separation(a, motion_a.pose, b, motion_b.pose) < 1e-6) continue;
    ++total;
    const double horizon = std::pow(10, random.in(-2, 0));
    const double t = time_of_contact(a, motion_a, b, motion_b, tol, horizon);
    REQUIRE(t >= 0);
    REQUIRE(t <= horizon);
    double least = 1e9;
    for (int sample = 0; sample <= 200; ++sample) {
      const double s = t * sample / 200;
      least = std::min(least, separation(a, advance(motion_a, s), b, advance(motion_b, s)));
    }
    CHECK(least >= 0);
    if (t < horizon) {
      ++landed;
      const double gap = separation(a, advance(motion_a, t), b, advance(motion_b, t));
      CHECK(gap >= 0);
      CHECK(gap <= tol);
      CHECK(!points(a, advance(motion_a, t), b, advance(motion_b, t), tol).empty());
    }
  }
  CHECK(landed > 300);
}

TEST_CASE("A common velocity changes nothing, swapping the shapes neither") {
  Random random(43);
  for (int k = 0; k < 300; ++k) {
    const Shape a = box(1, random.in(0.2, 2), 1), b = k % 2 ? sphere(0.5) : box(1, 1, random.in(0.2, 2));
    Motion motion_a = moving(random.pose(2), random.vector(4), random.vector(2));
    Motion motion_b = moving(random.pose(2), random.vector(4), random.vector(2));
    if (separation(a, motion_a.pose, b, motion_b.pose) < 1e-6) continue;
    const double t = time_of_contact(a, motion_a, b, motion_b, tol, 0.5);
    CHECK(time_of_contact(b, motion_b, a, motion_a, tol, 0.5) == Approx(t).margin(1e-6));
    const Vec3 common = random.vector(3);
    motion_a.v += common;
    motion_b.v += common;
    CHECK(time_of_contact(a, motion_a, b, motion_b, tol, 0.5) == Approx(t).margin(1e-6));
  }
}

TEST_CASE("Every two kinds of shapes meet when distance over speed says, whichever is named first") {
  const Shape ball = sphere(0.5), cube = box(1, 1, 1), plane = half_space();
  Shape drum;
  drum.kind = ShapeKind::cylinder;
  drum.radius = 0.5;
  drum.half_extents = {0.5, 0.5, 0.5};
  for (const Shape& low : {plane, ball, cube, drum})
    for (const Shape& high : {ball, cube, drum}) {
      // The lower one's top at 0 (the plane's) or 0.5, the upper one's bottom 0.3 m above, at 3 m/s.
      const double top = low.kind == ShapeKind::half_space ? 0 : 0.5;
      const Motion falling = moving(at(0, top + 0.8, 0), Vec3(0, -3, 0)), still = moving(at(0, 0, 0));
      INFO(static_cast<int>(low.kind) << " below " << static_cast<int>(high.kind));
      CHECK(time_of_contact(high, falling, low, still, tol, 1) == Approx(0.1).margin(1e-9));
      CHECK(time_of_contact(low, still, high, falling, tol, 1) == Approx(0.1).margin(1e-9));
    }
}

TEST_CASE("a step that is no number ends the look ahead, in place of going round it") {
  int looks = 0;
  const auto lost = [&](double, double, bool) {
    ++looks;
    return Look{.arrived = false, .step = NAN};
  };
  CHECK(advance_until(2, lost) == 2);
  CHECK(looks == 1);
}

TEST_CASE("a look ahead that comes on by small steps alone ends at the safe time that it has reached, not beyond") {
  int looks = 0;
  const auto slow = [&](double, double, bool) {
    ++looks;
    return Look{.arrived = false, .step = 1e-3};
  };
  CHECK(advance_until(2, slow) == Approx(1e-3 * max_advancements));
  CHECK(looks == max_advancements);
}
