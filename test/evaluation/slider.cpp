#include "evaluation/slider.h"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <numbers>
#include <random>

#include "evaluation/stored.h"

using namespace cb;
using cb::test::stored;
using std::numbers::pi;

namespace {

SliderState state_at(Slider& slider, double t) {
  return std::visit([t](auto& s) { return s.at(t); }, slider);
}

// The sliding box: 1 N on 1 kg along x from 1 to 5 s.
Drive push() {
  Drive drive;
  drive.pushes.push_back({Vec2(1, 0), 1, 5});
  return drive;
}

// The circular drive of 0.4 m/s^2 at 1 rad/s.
Drive turning() {
  Drive drive;
  drive.harmonics.push_back({Vec2(0.4, 0), 1, 0});
  drive.harmonics.push_back({Vec2(0, 0.4), 1, -pi / 2});
  return drive;
}

}  // namespace

TEST_CASE("The pushed box follows its parabolas and stops where the closed form says") {
  Slider slider = coulomb_slider(push(), 0.98, {});
  const auto& data = stored()["sliding_cone"];
  for (std::size_t i = 0; i < data["t"].size(); ++i) {
    const SliderState now = state_at(slider, data["t"][i]);
    CHECK(now.p.x() == Approx(data["x"][i].get<double>()).margin(1e-14));
    CHECK(now.v.x() == Approx(data["v"][i].get<double>()).margin(1e-14));
    CHECK(std::abs(now.p.y()) < 1e-15);
  }
  // x(8) = 0.16 + 0.08^2 / (2 * 0.98) = 8 / 49
  CHECK(state_at(slider, 8).p.x() == Approx(8.0 / 49).epsilon(1e-14));
  CHECK(state_at(slider, 8).v.isZero(0));
}

TEST_CASE("Under a polygon turned against the push the box goes where the stored answers say") {
  for (const auto& row : stored()["sliding_pyramid"]) {
    const int k = row["k"];
    PolygonSlider slider(push(), 0.98, k, row["misalign_over_pi_by_k"].get<double>() * pi / k, {});
    CHECK(slider.at(5).p.x() == Approx(row["x5"].get<double>()).epsilon(1e-12));
    CHECK(slider.at(8).p.x() == Approx(row["x8"].get<double>()).epsilon(1e-12));
    CHECK(std::abs(slider.at(8).p.y()) == Approx(row["abs_lateral8"].get<double>()).margin(1e-12));
  }
}

TEST_CASE("On a ramp the polygon sticks or slides with the stored acceleration") {
  for (const auto& row : stored()["ramp"]) {
    const double mu = row["mu"], slope = row["theta"], g = 9.8;
    Drive drive;
    drive.constant = Vec2(g * std::sin(slope), 0);
    const double friction = mu * g * std::cos(slope), a = row["acceleration"];
    if (row["k"].is_null()) {
      Slider slider = coulomb_slider(drive, friction, {});
      CHECK(state_at(slider, 2).p.x() == Approx(2 * a).margin(1e-13));
    } else {
      const int k = row["k"];
      PolygonSlider slider(drive, friction, k, row["misalign_over_pi_by_k"].get<double>() * pi / k, {});
      CHECK(slider.at(2).p.x() == Approx(2 * a).margin(1e-13));
      CHECK(slider.at(2).p.y() == Approx(0).margin(1e-13));
    }
  }
}

TEST_CASE("From rest in the turning drive the slider follows the stored trajectories") {
  for (const auto& row : stored()["circular"]) {
    Slider slider = coulomb_slider(turning(), row["mu"].get<double>() * 9.8, {});
    for (std::size_t i = 0; i < row["t"].size(); ++i) {
      const SliderState now = state_at(slider, row["t"][i]);
      CHECK(now.p.x() == Approx(row["x"][i].get<double>()).margin(2e-9));
      CHECK(now.p.y() == Approx(row["z"][i].get<double>()).margin(2e-9));
      CHECK(now.v.x() == Approx(row["vx"][i].get<double>()).margin(2e-9));
      CHECK(now.v.y() == Approx(row["vz"][i].get<double>()).margin(2e-9));
    }
  }
}

TEST_CASE("On the steady circle the slider stays for a minute") {
  // speed = radius = sqrt(a^2 - mu^2 g^2), velocity behind the drive by acos(mu g / a), p = r (sin(t - lag), -cos(t -
  // lag)).
  const double friction = 0.196, radius = std::sqrt(0.16 - friction * friction), lag = std::acos(friction / 0.4);
  const auto circle = [&](double t) { return Vec2(radius * std::sin(t - lag), -radius * std::cos(t - lag)); };
  SliderState start;
  start.p = circle(0);
  start.v = Vec2(radius * std::cos(-lag), radius * std::sin(-lag));
  Slider slider = coulomb_slider(turning(), friction, start);
  for (double t = 0; t <= 60; t += 0.0137) CHECK((state_at(slider, t).p - circle(t)).norm() < 1e-11);
}

namespace {

// A-P's own steps for a point mass: v+ = v* + h F with v* = v + h a; F of the polygon such that F.v+ is least over it,
// which is the projection of -v* / h on the polygon, here by trying every edge.
Vec2 stepped(double friction, int k, double h, double t_end) {
  Vec2 p = Vec2::Zero(), v = Vec2::Zero();
  const Drive drive = turning();
  for (long n = 0; n < std::lround(t_end / h); ++n) {
    v += h * drive.at(static_cast<double>(n) * h);
    const Vec2 wanted = -v / h;
    Vec2 best = wanted;
    double nearest = 0;
    for (int j = 0; j < k; ++j) {
      const double turn = (2 * j + 1) * pi / k;
      const Vec2 normal(std::cos(turn), std::sin(turn)), along(-normal.y(), normal.x());
      const double apothem = friction * std::cos(pi / k), edge = friction * std::sin(pi / k);
      if (wanted.dot(normal) <= apothem) continue;
      const Vec2 foot = apothem * normal + std::clamp(wanted.dot(along), -edge, edge) * along;
      if (nearest > 0 && (foot - wanted).norm() >= nearest) continue;
      nearest = (foot - wanted).norm();
      best = foot;
    }
    v += h * best;
    p += h * v;
  }
  return p;
}

}  // namespace

TEST_CASE("A-P's steps on the circle from rest tend to the polygon's slider, and that to the cone as k^-2") {
  // Distance of the steps of 1 ms from the cone at t = 10, vertex on the axis, from the scene's description.
  const double described[] = {0.382, 0.0738, 0.0170};
  Slider exact = coulomb_slider(turning(), 0.196, {});
  const Vec2 p = state_at(exact, 10).p;
  double last = 0;
  for (int i = 0; i < 4; ++i) {
    const int k = 4 << i;
    PolygonSlider slider(turning(), 0.196, k, 0, {});
    const Vec2 polygon = slider.at(10).p;
    const Vec2 coarse = stepped(0.196, k, 1e-3, 10), fine = stepped(0.196, k, 1e-4, 10);
    if (k < 32) CHECK((coarse - p).norm() == Approx(described[i]).epsilon(0.02));
    CHECK((coarse - polygon).norm() < 1.5e-3);
    CHECK((fine - polygon).norm() < 1.5e-4);
    CHECK((polygon - (10 * fine - coarse) / 9).norm() < 1e-4);
    const double distance = (polygon - p).norm();
    if (i > 0) {
      CHECK(last / distance > 3.5);
      CHECK(last / distance < 6);
    }
    last = distance;
  }
}

TEST_CASE("At every moment a polygon's friction lies in the polygon and opposes the velocity most") {
  std::mt19937 engine(5);
  const auto in = [&engine](double low, double high) {
    return low + (high - low) * static_cast<double>(engine()) / 4294967295.0;
  };
  for (int run = 0; run < 40; ++run) {
    Drive drive;
    drive.constant = Vec2(in(-0.3, 0.3), in(-0.3, 0.3));
    if (run % 2) drive.harmonics.push_back({Vec2(in(-1, 1), in(-1, 1)), in(0.5, 3), in(-3, 3)});
    drive.pushes.push_back({Vec2(in(-1, 1), in(-1, 1)), in(0, 1), in(1, 3)});
    const int k = 4 + 2 * (run % 5);
    const double friction = in(0.2, 0.8), angle = in(-3, 3);
    SliderState start;
    if (run % 3) start.v = Vec2(in(-1, 1), in(-1, 1));
    PolygonSlider slider(drive, friction, k, angle, start);
    // Friction as the difference quotient of the velocity; steps across a change of the friction are left out by
    // comparing the quotients of two halves.
    const double h = 1e-5;
    int compared = 0;
    for (double t = 0.0123; t < 4; t += 0.0171) {
      const Vec2 v0 = slider.at(t).v, v1 = slider.at(t + h).v, v2 = slider.at(t + 2 * h).v;
      const Vec2 f0 = (v1 - v0) / h - drive.at(t + h / 2), f1 = (v2 - v1) / h - drive.at(t + 1.5 * h);
      if ((f0 - f1).norm() > 1e-4) continue;
      ++compared;
      double least = 0, furthest = 0;
      for (int j = 0; j < k; ++j) {
        const Vec2 vertex = friction * Vec2(std::cos(angle + 2 * pi * j / k), std::sin(angle + 2 * pi * j / k));
        least = std::min(least, vertex.dot(v1));
        const double turn = angle + (2 * j + 1) * pi / k;
        furthest = std::max(furthest, f0.dot(Vec2(std::cos(turn), std::sin(turn))));
      }
      CHECK(furthest <= friction * std::cos(pi / k) + 1e-8);
      CHECK(f0.dot(v1) <= least + 1e-8);
    }
    CHECK(compared > 200);
  }
}

TEST_CASE("A slider that moves across its push stops, and rests while friction holds") {
  // Velocity along z, constant push below friction along x: Coulomb's disk and a polygon of many sides agree.
  Drive drive;
  drive.constant = Vec2(0.3, 0);
  SliderState start;
  start.v = Vec2(0, 1);
  Slider disk = coulomb_slider(drive, 0.5, start);
  PolygonSlider polygon(drive, 0.5, 4096, 0, start);
  for (double t = 0; t < 6; t += 0.1) CHECK((state_at(disk, t).p - polygon.at(t).p).norm() < 2e-6);
  CHECK(state_at(disk, 6).v.norm() == 0);
  CHECK((state_at(disk, 9).p - state_at(disk, 6).p).norm() == 0);
  // Closed form for the speed against the angle from the push: v = C (1 + cos)^a ..., here its stopping time:
  // d(v f + v_x a)/dt = a^2 - f^2 along the motion, so T = (f |v0| + a v0_x) / (f^2 - a^2).
  Slider again = coulomb_slider(drive, 0.5, start);
  const double stop = 0.5 / (0.25 - 0.09);
  CHECK(state_at(again, stop - 1e-4).v.norm() > 0);
  CHECK(state_at(again, stop + 1e-6).v.norm() == 0);
}

TEST_CASE("A slider on a line in a swinging drive sticks and breaks loose at the moments of the closed form") {
  // a = cos t, friction 0.5: it slides from t = 0, v = sin t - t / 2 until that is zero again (t = 1.895494267),
  // sticks while |cos t| <= 1/2, i.e. at once up to 2 pi / 3, then slides back.
  Drive drive;
  drive.harmonics.push_back({Vec2(1, 0), 1, 0});
  Slider slider = coulomb_slider(drive, 0.5, {});
  const double stop = 1.8954942670339809;
  CHECK(state_at(slider, 1.5).v.x() == Approx(std::sin(1.5) - 0.75).margin(1e-14));
  CHECK(state_at(slider, 2.0).v.isZero(0));
  CHECK(state_at(slider, 2.0).p.x() == Approx(1 - std::cos(stop) - stop * stop / 4).epsilon(1e-13));
  // Loose again at 2 pi / 3: v(t) = sin t - sin(2 pi / 3) + (t - 2 pi / 3) / 2.
  const double loose = 2 * pi / 3;
  CHECK(state_at(slider, 3.0).v.x() == Approx(std::sin(3.0) - std::sin(loose) + (3.0 - loose) / 2).epsilon(1e-11));
}

TEST_CASE("Pushes that follow each other in different directions count from when each sets in to when it ends") {
  // 1 m/s^2 along x from 1.0037 s to 2 s, along y from 3 s to 3.5 s, against friction of 0.5 m/s^2: it speeds up and
  // slows down as long. Then back along x from 6 s to 7 s: not all is on the line of the first and the last.
  Drive drive;
  drive.pushes.push_back({Vec2(1, 0), 1.0037, 2});
  drive.pushes.push_back({Vec2(0, 1), 3, 3.5});
  drive.pushes.push_back({Vec2(-1, 0), 6, 7});
  Slider slider = coulomb_slider(drive, 0.5, {});
  CHECK(std::holds_alternative<DiskSlider>(slider));
  CHECK(state_at(slider, 1.0036).p.norm() == 0);
  const double pushed = 2 - 1.0037, x = 2 * 0.25 * pushed * pushed;
  CHECK(state_at(slider, 1.9).p.x() == Approx(0.25 * (1.9 - 1.0037) * (1.9 - 1.0037)).epsilon(1e-9));
  CHECK(state_at(slider, 2).v.x() == Approx(0.5 * pushed).epsilon(1e-9));
  CHECK(state_at(slider, 2.999).v.norm() == 0);
  CHECK(state_at(slider, 2.999).p.x() == Approx(x).epsilon(1e-9));
  CHECK(state_at(slider, 3.5).p.y() == Approx(0.25 * 0.25).epsilon(1e-9));
  CHECK(state_at(slider, 4.5).p.y() == Approx(2 * 0.25 * 0.25).epsilon(1e-9));
  CHECK(state_at(slider, 4.5).p.x() == Approx(x).epsilon(1e-9));
  CHECK(state_at(slider, 8.5).p.x() == Approx(x - 2 * 0.25).margin(1e-9));
  CHECK(state_at(slider, 8.5).p.y() == Approx(2 * 0.25 * 0.25).epsilon(1e-9));
}

TEST_CASE("A slider that is pushed across its way comes to rest each time, however slow it was") {
  // Pushes of 1 s, along two lines at right angles, of hardly more than friction and of more.
  for (const double friction : {1e-3, 0.98, 30.0})
    for (const double beyond : {1e-9, 1e-6, 1e-4, 2e-2, 0.7}) {
      INFO(friction << ", " << beyond);
      const double a = friction * (1 + beyond), v = a - friction, way = v / 2 + v * v / (2 * friction);
      const Vec2 one(std::cos(0.3), std::sin(0.3)), other(-one.y(), one.x());
      Drive drive;
      drive.pushes = {{a * one, 1, 2}, {a * other, 4, 5}};
      Slider slider = coulomb_slider(drive, friction, {});
      REQUIRE(std::holds_alternative<DiskSlider>(slider));
      CHECK(state_at(slider, 3.9).v.isZero(0));
      CHECK(state_at(slider, 8).v.isZero(0));
      CHECK(state_at(slider, 8).p.dot(one) == Approx(way).epsilon(1e-9).margin(1e-14));
      CHECK(state_at(slider, 8).p.dot(other) == Approx(way).epsilon(1e-9).margin(1e-14));
    }
}

namespace {

/// Where implicit steps of length h end, which know of no rest and no setting off, m.
Vec2 by_implicit_steps(const Drive& drive, double friction, SliderState state, double duration, double h) {
  for (int i = 0; i < std::lround(duration / h); ++i) {
    const Vec2 without = state.v + h * drive.at((i + 0.5) * h);
    const Vec2 v = without * (1 - std::min(1.0, h * friction / without.norm()));
    state.p += h / 2 * (state.v + v);
    state.v = v;
  }
  return state.p;
}

}  // namespace

TEST_CASE("Whatever drives it, a slider is where shorter and shorter implicit steps lead") {
  std::mt19937 random(5);
  const auto between = [&](double low, double high) {
    return low + (high - low) * (static_cast<double>(random()) / 4294967296.0);
  };
  const auto along = [&](double size) {
    return Vec2(size * Eigen::Rotation2Dd(between(0, 2 * pi)).toRotationMatrix().col(0));
  };
  for (int i = 0; i < 12; ++i) {
    INFO(i);
    const double friction = std::pow(10, between(-3, 1)), duration = 3;
    Drive drive;
    if (i % 3 == 0) drive.constant = along(friction * between(0, 1));
    for (int k = 0; k < 3; ++k) {
      const double from = std::round(between(0, 2) * 1e3) / 1e3;  // an end of implicit steps
      drive.pushes.push_back({along(friction * between(0.3, 1.7)), from, from + 0.5});
    }
    for (int k = 0; k < i % 3; ++k)
      drive.harmonics.push_back({along(friction * between(0, 1.5)), between(0.3, 6), between(0, 6)});
    SliderState start;
    if (i % 2 == 0) start.v = along(friction * std::pow(10, between(-4, 0)));
    Slider slider = coulomb_slider(drive, friction, start);
    const Vec2 p = state_at(slider, duration).p;
    const Vec2 coarse = by_implicit_steps(drive, friction, start, duration, 2e-4),
               fine = by_implicit_steps(drive, friction, start, duration, 1e-4);
    CHECK((p - fine).norm() < 2 * (fine - coarse).norm() + 1e-7 * friction);
    CHECK((fine - coarse).norm() < 1e-3 * friction);  // or it would prove little
  }
}

TEST_CASE("Under a polygon of many corners a box comes to rest, whatever way it goes") {
  Drive drive;
  drive.constant = Vec2(-1.5, -0.2);
  const double friction = 48, speed = 2e-5;
  for (int i = 0; i < 100; ++i) {
    INFO(i);
    const SliderState start{Vec2::Zero(), speed * Vec2(std::cos(0.0628 * i), std::sin(0.0628 * i))};
    Slider polygon = PolygonSlider(drive, friction, 512, 0.1, start), disk = DiskSlider(drive, friction, start);
    const SliderState end = state_at(polygon, 3);
    CHECK(end.v.norm() == 0);
    CHECK((end.p - state_at(disk, 3).p).norm() <= 5e-3 * speed * speed / friction);
  }
}
