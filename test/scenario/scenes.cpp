// The five scenes hold what spec/scenarios.md (docs/scenarios.md) says, in closed form.

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "scenario/scenario.h"
#include "scenario_text.h"

using namespace cb;

namespace {

constexpr double pi = std::numbers::pi;

Scenario scene(const std::string& name, const Overrides& overrides = {}) {
  return load_scenario(find_scenario(name), overrides);
}
Vec3 velocity(const Scenario& s, int body = 0) { return Vec3(s.initial.v.data() + 6 * body); }
Vec3 spin(const Scenario& s, int body = 0) { return Vec3(s.initial.v.data() + 6 * body + 3); }
Vec3 plane_normal(const Shape& half_space) { return half_space.local.q * Vec3::UnitY(); }

/// Signed distance of the eight corners of box `shape` from the plane, ascending.
std::vector<double> corner_gaps(const Scenario& s, const Shape& plane, const Shape& box) {
  std::vector<double> gaps;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 sign((corner & 1) != 0 ? 1 : -1, (corner & 2) != 0 ? 1 : -1, (corner & 4) != 0 ? 1 : -1);
    const Vec3 x = s.initial.pose[box.body] * sign.cwiseProduct(box.half_extents);
    gaps.push_back(plane_normal(plane).dot(x - plane.local.p));
  }
  std::sort(gaps.begin(), gaps.end());
  return gaps;
}

}  // namespace

TEST_CASE(
    "The scenes that come with the program are those of the paper, an example, what a model forbids, and large ones") {
  std::vector<std::string> names;
  for (const std::string& file : bundled_scenarios()) names.push_back(std::filesystem::path(file).stem().string());
  CHECK(names == std::vector<std::string>{"brick_wall", "circular_sliding", "conveyor", "grasp", "gripper", "hills",
                                          "impacting_sphere", "mobile_robot", "mobile_robot_caster", "pile",
                                          "pushed_block", "quadruped", "rolling_drum", "rubble_slope", "sliding_box",
                                          "stack", "sticking_box", "tipping_box", "urdf_arm"});
}

TEST_CASE("A pile of any number of bodies begins apart, and inside of its bin") {
  for (const char* bodies : {"2", "7", "100", "1001"}) {
    const Scenario s = scene("pile", {{"bodies", bodies}});
    CHECK(s.model.bodies.size() == static_cast<std::size_t>(std::atoi(bodies)));
    std::vector<std::pair<Vec3, double>> balls;  // around each body
    for (const Shape& shape : s.shapes)
      if (shape.body >= 0) balls.emplace_back(s.initial.pose[shape.body].p, shape.bounding_radius());
    for (std::size_t i = 0; i < balls.size(); ++i) {
      for (const Shape& plane : s.shapes)
        if (plane.body < 0) CHECK(plane_normal(plane).dot(balls[i].first - plane.local.p) > balls[i].second);
      for (std::size_t j = 0; j < i; ++j)
        if ((balls[i].first - balls[j].first).norm() <= balls[i].second + balls[j].second)
          FAIL("bodies " << i << " and " << j << " of " << bodies);
    }
  }
}

TEST_CASE("Each brick of the wall lies flush on the course below, and beside its neighbours") {
  const Scenario s = scene("brick_wall", {{"bricks", "50"}});
  const std::vector<Pose>& pose = s.initial.pose;
  CHECK(pose.size() == 51);
  for (int i = 0; i < 50; ++i) {
    const int course = i / 10;
    CHECK(pose[i].p.y() == Approx(0.04 + 0.08 * course).epsilon(1e-15));
    if (i >= 10) CHECK(std::abs(pose[i].p.x() - pose[i - 10].p.x()) == Approx(0.125).epsilon(1e-12));
    if (i % 10 > 0) CHECK(pose[i].p.x() - pose[i - 1].p.x() == Approx(0.25).epsilon(1e-12));
  }
}

TEST_CASE("Every scene states step, duration, edges, bound, friction and its analytic reference") {
  struct Row {
    const char* name;
    double duration;
    int k;
    double mu;
  };
  for (const Row& row :
       {Row{"impacting_sphere", 4, 8, 0.60581}, Row{"sliding_box", 8, 16, 0.1}, Row{"sticking_box", 5, 8, 0.7},
        Row{"circular_sliding", 60, 8, 0.02}, Row{"stack", 1, 4, 0.5}}) {
    INFO(row.name);
    const Scenario s = scene(row.name);
    CHECK(s.name == row.name);
    CHECK_FALSE(s.title.empty());
    CHECK(s.step == 1e-3);
    CHECK(s.duration == row.duration);
    CHECK(s.k == row.k);
    CHECK(s.compression_bound == true);
    CHECK(s.rotate_cone == 0);
    CHECK(s.reference.kind == ReferenceKind::analytic);
    CHECK(s.reference.name == row.name);
    CHECK(s.gravity.constant == Vec3(0, -9.8, 0));
    CHECK(s.gravity.varies() == (s.name == "circular_sliding"));
    CHECK(s.parameters.size() == s.parameter_notes.size());
    for (const PairLaw& law : s.pairs.laws) {
      CHECK(law.mu == row.mu);
      CHECK(law.restitution == 0);
    }
    CHECK(scene(row.name, {{"rotate_cone", "0.19634954"}}).rotate_cone == 0.19634954);
    CHECK(scene(row.name, {{"rotate_cone", "pi/8"}}).rotate_cone == pi / 8);
    CHECK(scene(row.name, {{"mu", "0.25"}}).pairs.laws[0].mu == 0.25);
  }
}

TEST_CASE("The impacting sphere is solid, of unit density, half a metre above the ground") {
  const Scenario s = scene("impacting_sphere");
  REQUIRE(s.model.bodies.size() == 1);
  const double m = 4 * pi / 3;  // 1 kg/m^3 times 4/3 pi r^3
  CHECK(s.model.bodies[0].name == "sphere");
  CHECK(s.model.bodies[0].mass == Approx(m).epsilon(1e-15));
  for (int axis = 0; axis < 3; ++axis) CHECK(s.model.bodies[0].inertia[axis] == Approx(0.4 * m).epsilon(1e-15));
  CHECK(s.initial.pose[0].p == Vec3(0, 1.5, 0));
  CHECK(velocity(s) == Vec3(1, -10, 0));
  CHECK(spin(s) == Vec3(0, 0, 0));
  // Energy: v_n^2 = 10^2 + 2 g gap, the 10.478 m/s of the scene's description.
  const double gap = s.initial.pose[0].p[1] - s.shapes[1].radius;
  CHECK(std::sqrt(100 + 2 * 9.8 * gap) == Approx(10.478).margin(1e-3));
  CHECK(s.forces.empty());

  const Scenario set =
      scene("impacting_sphere",
            {{"gap", "0"}, {"vx", "5"}, {"vy", "-2"}, {"vz", "1"}, {"wx", "0.1"}, {"wy", "-0.2"}, {"wz", "-6"}});
  CHECK(set.initial.pose[0].p == Vec3(0, 1, 0));
  CHECK(velocity(set) == Vec3(5, -2, 1));
  CHECK(spin(set) == Vec3(0.1, -0.2, -6));
  CHECK(set.parameters[6] == std::pair<std::string, std::string>("wz", "-6"));
}

TEST_CASE("The push on the sliding box exceeds friction by 2 %, from 1 s to 5 s") {
  const Scenario s = scene("sliding_box");
  REQUIRE(s.forces.size() == 1);
  CHECK(s.forces[0].body == 0);
  CHECK(s.forces[0].force == Vec3(1, 0, 0));
  CHECK(s.forces[0].from == 1);
  CHECK(s.forces[0].to == 5);
  const double friction = s.pairs.laws[0].mu * s.model.bodies[0].mass * 9.8;
  CHECK(s.forces[0].force.norm() - friction == Approx(0.02).epsilon(1e-12));
  CHECK(s.model.bodies[0].mass == 1);
  CHECK(s.model.bodies[0].inertia == Vec3::Constant(1.0 / 6));  // m/12 (1 + 1)
  CHECK(corner_gaps(s, s.shapes[0], s.shapes[1])[3] == 0);
  CHECK(corner_gaps(s, s.shapes[0], s.shapes[1])[0] == 0);
}

TEST_CASE("push_angle turns the push as rotate_cone turns the friction directions") {
  // About the normal y, t1 = x turned by a is cos a x + sin a (y cross x) = cos a x - sin a z.
  for (const double a : {0.0, pi / 16, pi / 2, -1.0, 3.0}) {
    const Vec3 force = scene("sliding_box", {{"push_angle", std::to_string(a)}}).forces[0].force;
    const double turned = std::stod(std::to_string(a));
    CHECK((force - Vec3(std::cos(turned), 0, -std::sin(turned))).norm() <= 1e-15);
  }
}

TEST_CASE("The sticking box lies flush on a ramp whose downhill is +x, at any slope") {
  for (const double degrees : {0.0, 10.0, 20.0, 30.0, 45.0}) {
    const Scenario s = scene("sticking_box", {{"tilt", std::to_string(degrees) + "*deg"}});
    const double tilt = degrees * pi / 180;
    const Vec3 n = plane_normal(s.shapes[0]);
    CHECK((n - Vec3(std::sin(tilt), std::cos(tilt), 0)).norm() <= 2e-16);
    const Vec3 downhill = s.gravity.at(0) - n * n.dot(s.gravity.at(0));
    CHECK(downhill[0] >= 0);
    CHECK(downhill.norm() == Approx(9.8 * std::sin(tilt)).margin(1e-14));
    CHECK(s.shapes[0].local.q.coeffs() == s.initial.pose[0].q.coeffs());
    const std::vector<double> gaps = corner_gaps(s, s.shapes[0], s.shapes[1]);
    for (int corner = 0; corner < 4; ++corner) CHECK(std::abs(gaps[corner]) <= 2.3e-16);
    for (int corner = 4; corner < 8; ++corner) CHECK(gaps[corner] == Approx(1).epsilon(1e-15));
    CHECK(std::abs(s.initial.pose[0].q.norm() - 1) <= 2.3e-16);
  }
  const Scenario s = scene("sticking_box");
  CHECK(plane_normal(s.shapes[0])[0] == Approx(0.5).epsilon(1e-15));
  CHECK(s.pairs.laws[0].mu > std::tan(pi / 6));
  CHECK(velocity(s).isZero(0));
  CHECK(scene("sticking_box", {{"mu", "1.001*tan(30*deg)"}}).pairs.laws[0].mu == 1.001 * std::tan(pi / 6));
}

TEST_CASE("The steady start of the circle is on the exact circle about the origin, with its velocity") {
  // v = u (cos(t - lag), sin(t - lag)); along v: 0.4 cos(lag) = mu g, across: 0.4 sin(lag) = u omega, omega = 1.
  for (const char* mu : {"0.02", "0", "0.03", "0.04"}) {
    const Scenario s = scene("circular_sliding", {{"mu", mu}});
    const double friction = std::stod(mu) * 9.8;
    const double radius = std::sqrt(0.16 - friction * friction);
    const Vec3 p = s.initial.pose[0].p - Vec3(0, 0.5, 0), v = velocity(s);
    CHECK(p.norm() == Approx(radius).epsilon(1e-14));
    CHECK(v.norm() == Approx(radius).epsilon(1e-14));
    CHECK(std::abs(p.dot(v)) <= 1e-16);
    // The forces at t = 0 are those of the circle: drive - friction = -p omega^2.
    const Vec3 drive = s.gravity.at(0) - Vec3(0, -9.8, 0);
    CHECK((drive - friction * v.normalized() + p).norm() <= 1e-15);
    // Velocity lags the drive (towards +x at t = 0): it comes before it in the sense of the turn, x to z.
    CHECK(std::atan2(v[2], v[0]) == Approx(-std::acos(friction / 0.4)).epsilon(1e-14));
  }
  const Scenario s = scene("circular_sliding");
  CHECK(velocity(s).norm() == Approx(0.348688973155).epsilon(1e-12));
  CHECK(-std::atan2(velocity(s)[2], velocity(s)[0]) == Approx(1.058706573861).epsilon(1e-12));
}

TEST_CASE("Explicit Euler from the steady start stays within 0.81 h of the circle for 60 s") {
  // Independent of any solver: while the box slides, friction takes mu g h off its speed in each step.
  const Scenario s = scene("circular_sliding");
  const double h = 1e-2, mu = s.pairs.laws[0].mu, lag = std::acos(mu * 9.8 / 0.4), radius = 0.4 * std::sin(lag);
  Vec3 p = s.initial.pose[0].p, v = velocity(s);
  double worst = 0;
  for (int n = 0; n < 6000; ++n) {
    Vec3 drive = s.gravity.at(n * h);
    drive[1] = 0;
    v += h * drive;
    v *= 1 - mu * 9.8 * h / v.norm();
    p += h * v;
    const double t = (n + 1) * h;
    worst = std::max(worst, (p - Vec3(radius * std::sin(t - lag), 0.5, -radius * std::cos(t - lag))).norm());
  }
  CHECK(worst / h == Approx(0.81).margin(0.005));
}

TEST_CASE("The circle's box starts at rest in the centre on request, and wherever friction holds it") {
  for (const Overrides& overrides : {Overrides{{"start", "rest"}}, Overrides{{"mu", "0.05"}}}) {
    const Scenario s = scene("circular_sliding", overrides);
    CHECK(s.initial.pose[0].p == Vec3(0, 0.5, 0));
    CHECK(velocity(s) == Vec3(0, 0, 0));
  }
}

TEST_CASE("Gravity of the circle is (0.4 cos t, -9.8, 0.4 sin t)") {
  const Scenario s = scene("circular_sliding");
  for (const double t : {0.0, 0.5, 2.0, 10.0, 59.9}) {
    CHECK((s.gravity.at(t) - Vec3(0.4 * std::cos(t), -9.8, 0.4 * std::sin(t))).norm() <= 1e-14);
  }
}

TEST_CASE("A stack of any number of boxes stands without gaps, and costs two groups of pairs") {
  for (const int n : {1, 2, 4, 8, 16, 300}) {
    const Scenario s = scene("stack", {{"boxes", std::to_string(n)}});
    REQUIRE(s.model.bodies.size() == static_cast<std::size_t>(n));
    REQUIRE(s.shapes.size() == static_cast<std::size_t>(n) + 1);
    CHECK(s.initial.v == std::vector<double>(6 * n, 0.0));
    for (int i = 0; i < n; ++i) {
      CHECK(s.model.bodies[i].name == "box_" + std::to_string(i + 1));
      CHECK(s.model.bodies[i].mass == 1);
      CHECK(s.initial.pose[i].p == Vec3(0, i + 0.5, 0));  // exact: no gap and no overlap
      CHECK(s.shapes[i + 1].body == i);
      CHECK(s.shapes[i + 1].half_extents == Vec3(0.5, 0.5, 0.5));
    }
    CHECK(s.pairs.groups == 2);
    CHECK(s.pairs.laws.size() == 2);
    for (int i = 1; i <= std::min(n, 20); ++i) {
      CHECK(s.pairs.find(0, i) == &s.pairs.laws[0]);
      CHECK(s.pairs.find(i, 0) == &s.pairs.laws[0]);
      for (int j = i + 1; j <= std::min(n, 20); ++j) CHECK(s.pairs.find(i, j) == &s.pairs.laws[1]);
    }
  }
}

TEST_CASE("What moves with a link that turns has the velocity of a part of it") {
  // A link that turns about the origin at 2 rad/s, a quarter of pi from its zero pose; the ball was 1.5 m along x
  // there.
  const test::TextFile file(R"(<scenario title="test"><simulation step="1e-3" duration="1"/><reference kind="missing"/>
    <gravity constant="0 0 0"/><bodies>
    <robot name="arm"><link name="bar" mass="3" position="0.5 0 0" inertia="1 1 1"/>
      <joint name="hinge" kind="revolute" parent="world" child="bar" anchor="0 0 0" axis="0 0 1" position="0.7853981633974483" velocity="2"/></robot>
    <sphere name="ball" radius="0.1" mass="1" position="1.5 0 0" moves_with="bar"/></bodies></scenario>)");
  const Scenario s = load_scenario(file.path(), {});
  const double root = std::sqrt(0.5);
  const Vec3 p = s.initial.pose[1].p;
  CHECK((p - 1.5 * Vec3(root, root, 0)).norm() < 1e-14);
  CHECK((velocity(s, 1) - Vec3(0, 0, 2).cross(p)).norm() < 1e-14);
  CHECK((spin(s, 1) - Vec3(0, 0, 2)).norm() < 1e-14);
}

TEST_CASE("A heightfield is as long along each axis as its spacing there says") {
  const test::TextFile file(R"(<scenario title="test"><simulation step="1e-3" duration="1"/><reference kind="missing"/>
    <gravity constant="0 -9.8 0"/><bodies>
    <heightfield name="ground" position="1 0 -1" columns="3" spacing="0.5 2" heights="0 0 0 0 0 0 0 0 0 0 0 0"/>
    <sphere name="ball" radius="0.1" mass="1" position="1.5 1 1"/></bodies></scenario>)");
  const Scenario s = load_scenario(file.path(), {});
  Vec3 low = Vec3::Constant(1e9), high = -low;
  for (const Shape& shape : s.shapes) {
    if (!shape.hull || shape.body >= 0) continue;
    for (const Vec3& x : shape.hull->polytope.vertices) {
      const Vec3 at = shape.local * x;
      low = low.cwiseMin(at);
      high = high.cwiseMax(at);
    }
  }
  CHECK(low[0] == Approx(1));
  CHECK(high[0] == Approx(2));
  CHECK(low[2] == Approx(-1));
  CHECK(high[2] == Approx(5));
}

TEST_CASE("A ground without a depth is as deep as its widest triangle is long, be that along x or along z") {
  for (const char* spacing : {"3 1", "1 3"}) {
    const test::TextFile file(
        "<scenario title=\"test\"><simulation step=\"1e-3\" duration=\"1\"/><reference kind=\"missing\"/>"
        "<gravity constant=\"0 -9.8 0\"/><bodies><heightfield name=\"ground\" position=\"0 0 0\" columns=\"2\" "
        "heights=\"0 0 0 0\" spacing=\"" +
        std::string(spacing) +
        "\"/><sphere name=\"ball\" radius=\"0.1\" mass=\"1\" position=\"0 1 0\"/></bodies></scenario>");
    const Scenario s = load_scenario(file.path(), {});
    double lowest = 0;
    for (const Shape& shape : s.shapes)
      if (shape.hull)
        for (const Vec3& x : shape.hull->polytope.vertices) lowest = std::min(lowest, (shape.local * x).y());
    INFO(spacing);
    CHECK(lowest == Approx(-3));
  }
}
