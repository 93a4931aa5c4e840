// One impact at one contact: closed forms where nothing turns, plain integration where the slip does.

#include "methods/stronge_impact.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>

#include "linalg/stop.h"

using namespace cb;
using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

constexpr double no_slip = 1e-14;

Impact impact_of(const Matrix3d& K, const Vector3d& u, double mu, double e, const ImpactOptions& options = {},
                 double event_approach = 0) {
  Impact out;
  integrate_impact(K, u, mu, e, no_slip, event_approach, options, out);
  return out;
}

/// Motion in a plane: the normal impulse pushes along t1.
Matrix3d planar(double K_nt = 0.5, double K_t = 1) {
  Matrix3d K;
  K << 2, K_nt, 0, K_nt, K_t, 0, 0, 0, 3;
  return K;
}

/// Any K, slip and friction.
struct Drawn {
  Matrix3d K;
  Vector3d u;
  double mu, e;
};
Drawn draw(std::mt19937& generator) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto vector = [&] { return Vector3d(uniform(generator), uniform(generator), uniform(generator)); };
  Matrix3d half;
  for (int i = 0; i < 3; ++i) half.col(i) = vector();
  const Vector3d u = 3 * vector();
  return {half * half.transpose() + 0.05 * Matrix3d::Identity(),
          {-std::abs(u[0]) - 0.1, u[1], u[2]},
          2 * std::abs(uniform(generator)),
          std::abs(uniform(generator))};
}

/// Stronge's law by classical Runge-Kutta over sigma in steps so short that nothing else is needed. Not for slips that
/// stop, nor for contacts that are compressed again while they part.
struct Plain {
  Vector3d r = Vector3d::Zero();
  double compression = 0, restitution = 0, friction = 0;
  bool stops = false;
};
Plain plain_integration(const Drawn& drawn) {
  using Five = Eigen::Matrix<double, 5, 1>;
  const auto slope = [&](const Five& y) {
    const Vector3d u = drawn.u + drawn.K * y.head<3>();
    const double s = std::hypot(u[1], u[2]);
    Five out;
    out << s, -drawn.mu * u[1], -drawn.mu * u[2], s * u[0], -drawn.mu * s * s;
    return out;
  };
  const auto after = [&](const Five& y, double h) {
    const Five k1 = slope(y), k2 = slope(y + h / 2 * k1), k3 = slope(y + h / 2 * k2), k4 = slope(y + h * k3);
    return Five(y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4));
  };
  Plain out;
  const double slip = std::hypot(drawn.u[1], drawn.u[2]), h = 1e-2 / ((1 + drawn.mu) * drawn.K.trace());
  Five y = Five::Zero();
  double stored = 0;
  bool loading = true;
  for (int i = 0; i < 200000; ++i) {
    const auto over = [&](const Five& at) {
      return loading ? drawn.u[0] + drawn.K.row(0) * at.head<3>() >= 0 : at[3] >= drawn.e * drawn.e * stored;
    };
    const Five next = after(y, h);
    const Vector3d u = drawn.u + drawn.K * next.head<3>();
    out.stops = std::hypot(u[1], u[2]) < 1e-2 * slip;
    if (out.stops) break;
    if (!over(next)) {
      y = next;
      continue;
    }
    double low = 0, high = h;
    for (int k = 0; k < 60; ++k) {
      const double middle = 0.5 * (low + high);
      (over(after(y, middle)) ? high : low) = middle;
    }
    y = after(y, high);
    (loading ? out.compression : out.restitution) = y[3];
    if (!loading) break;
    stored = -y[3];
    loading = false;
    y[3] = 0;
  }
  out.r = y.head<3>();
  out.friction = y[4];
  return out;
}

}  // namespace

TEST_CASE(
    "what does not approach has no impact, and what nothing moves has none that ends; of the last one nothing stays") {
  Impact impact;
  const auto filled = [] {
    Impact out;
    out.status = Status::nonconverged;
    out.r = Vector3d(1, 2, 3);
    out.compression_work = out.restitution_work = out.friction_work = 4;
    out.slid = out.stuck = out.diverged = out.locked = true;
    out.steps = 5;
    return out;
  };
  const auto nothing = [&] {
    return impact.r == Vector3d(0, 0, 0) && impact.compression_work == 0 && impact.restitution_work == 0 &&
           impact.friction_work == 0 && !impact.slid && !impact.stuck && !impact.diverged && !impact.locked;
  };
  for (const double u_n : {0.0, 1e-300, 2.0}) {
    impact = filled();
    integrate_impact(planar(), {u_n, 1, 0}, 0.5, 0.5, no_slip, 1, {}, impact);
    CHECK(impact.status == Status::ok);
    CHECK(impact.steps == 0);
    CHECK(nothing());
  }
  for (const double K_n : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    Matrix3d K = planar();
    K(0, 0) = K_n;
    impact = filled();
    integrate_impact(K, {-1, 1, 0}, 0.5, 0.5, no_slip, 1, {}, impact);
    CHECK(impact.status == Status::singular);
    CHECK(nothing());
  }
}

TEST_CASE("an impact that never ends says so, with the impulse until nothing moves any more") {
  // Where it sticks no normal impulse moves the contact: K_nn = K_nt^2 / K_t.
  Matrix3d K;
  K << 1, 1, 0, 1, 1, 0, 0, 0, 1;
  Impact impact = impact_of(K, {-1, 0, 0}, 2, 0.5);
  CHECK(impact.status == Status::singular);
  CHECK(impact.stuck);
  CHECK(impact.r == Vector3d(0, 0, 0));
  // Slip 3 along t1: xi = (1, -2, 0) and K xi = (-1, -1, 0), so that it stops after 3 N s.
  impact = impact_of(K, {-1, 3, 0}, 2, 0.5);
  CHECK(impact.status == Status::singular);
  CHECK(impact.slid);
  CHECK(impact.locked);
  CHECK(impact.stuck);
  CHECK((impact.r - Vector3d(3, -6, 0)).norm() < 1e-14);
}

TEST_CASE("an impact whose impulse, work or square of a velocity overflows is not finite, and not without end") {
  CHECK(impact_of(1e-3 * Matrix3d::Identity(), {-1.7e308, 0, 0}, 0, 0).status == Status::not_finite);
  // Stored are 1e400 / 4 J, of a finite impulse.
  const Impact stored = impact_of(planar(), {-1e200, 0, 0}, 0, 1);
  CHECK(stored.status == Status::not_finite);
  CHECK(stored.r == Vector3d(5e199, 0, 0));
  // Stored are 5e299 J, at a velocity whose square is 1e310.
  CHECK(impact_of(1e10 * Matrix3d::Identity(), {-1e155, 0, 0}, 0, 1).status == Status::not_finite);
}

TEST_CASE("an impact may take as many steps as the limit says and not one more") {
  Drawn turning{planar(), {-1, 2, 1}, 0.4, 0.6};
  turning.K(0, 2) = turning.K(2, 0) = -0.3;
  const Drawn cases[] = {{planar(), {-1, 2, 0}, 0, 0.6}, {planar(), {-1, 0, 0}, 0.6, 0.6}, turning};
  for (const Drawn& c : cases) {
    const Impact free = impact_of(c.K, c.u, c.mu, c.e);
    REQUIRE(free.status == Status::ok);
    ImpactOptions options;
    options.step_limit = free.steps;
    const Impact enough = impact_of(c.K, c.u, c.mu, c.e, options);
    CHECK(enough.status == Status::ok);
    CHECK(enough.r == free.r);
    options.step_limit = free.steps - 1;
    const Impact cut = impact_of(c.K, c.u, c.mu, c.e, options);
    CHECK(cut.status == Status::nonconverged);
    // The impulse so far: some, and less than all.
    CHECK(cut.r[0] > 0);
    CHECK(cut.r[0] < free.r[0]);
  }
}

TEST_CASE("a stop that is asked for is heard within an impact, with friction and without") {
  struct Ask {
    Ask() { stop_asked = true; }
    ~Ask() { stop_asked = false; }
  };
  for (const Drawn& c : {Drawn{planar(), {-1, 2, 1}, 0.4, 0.6}, Drawn{planar(), {-1, 2, 1}, 0, 0.6}}) {
    const Ask ask;
    CHECK_THROWS_AS(impact_of(c.K, c.u, c.mu, c.e), Stopped);
  }
}

TEST_CASE("slip that is round-off is none: the contact sticks from the start") {
  const Vector3d u(-1, 1e-3, 0);
  Impact sticks, slides;
  integrate_impact(planar(), u, 0.8, 0, 2e-3, 1, {}, sticks);
  integrate_impact(planar(), u, 0.8, 0, 0.5e-3, 1, {}, slides);
  CHECK_FALSE(sticks.slid);
  CHECK(sticks.stuck);
  CHECK(slides.slid);
  CHECK(slides.stuck);
  // Sticking alone: r = p (1, -K_nt / K_t), K_nn - K_nt^2 / K_t = 1.75.
  CHECK((sticks.r - Vector3d(1, -0.5, 0) / 1.75).norm() < 1e-14);
  CHECK(sticks.friction_work == Approx(-0.5 / 1.75 * 1e-3));  // of the slip that is left as it was
  // Sliding first: xi = (1, -0.8, 0), K xi = (1.6, -0.3, 0): it stops after 1/300 N s.
  const double p = 1.0 / 300, rest = (1 - 1.6 * p) / 1.75;
  CHECK((slides.r - Vector3d(p + rest, -0.8 * p - 0.5 * rest, 0)).norm() < 1e-14);
}

TEST_CASE("slip that stops while the contact parts: works, impulse and velocity in closed form") {
  // Sliding: xi = (1, -0.8, 0), a = K xi = (1.6, -0.3, 0). Slip 0.24 stops at p = 0.8, compression ended at 0.625.
  // Sticking: xi = (1, -0.5, 0), a_n = 1.75.
  const double e = 0.6, stored = 1 / 3.2, u_stop = -1 + 1.6 * 0.8, left = e * e * stored - u_stop * u_stop / 3.2;
  const double p = (-u_stop + std::sqrt(u_stop * u_stop + 2 * 1.75 * left)) / 1.75;
  for (const double sign : {1.0, -1.0}) {
    const Impact impact = impact_of(planar(sign * 0.5), {-1, sign * 0.24, 0}, 0.8, e);
    CHECK(impact.status == Status::ok);
    CHECK(impact.slid);
    CHECK(impact.stuck);
    CHECK_FALSE(impact.diverged);
    CHECK_FALSE(impact.locked);
    CHECK(impact.compression_work == Approx(-stored).epsilon(1e-14));
    CHECK(impact.restitution_work == Approx(e * e * stored).epsilon(1e-14));
    CHECK(impact.friction_work == Approx(-0.8 * 0.5 * 0.24 * 0.8).epsilon(1e-14));
    CHECK((impact.r - Vector3d(0.8 + p, -sign * (0.8 * 0.8 + 0.5 * p), 0)).norm() < 1e-14);
  }
}

TEST_CASE("slip that does not stop, and slip from rest, do the work of friction over all of the way") {
  // xi = (1, -0.3, 0), a = (1.85, 0.2, 0): u_n+ = e, p = (1 + e) / 1.85, u_t = slip + 0.2 p.
  const double e = 0.5, p = (1 + e) / 1.85;
  for (const double slip : {0.0, 10.0}) {
    const Impact impact = impact_of(planar(), {-1, slip, 0}, 0.3, e);
    CHECK(impact.slid == (slip > 0));
    CHECK(impact.diverged == (slip == 0));
    CHECK_FALSE(impact.stuck);
    CHECK((impact.r - p * Vector3d(1, -0.3, 0)).norm() < 1e-14);
    CHECK(impact.compression_work == Approx(-0.5 / 1.85).epsilon(1e-14));
    CHECK(impact.restitution_work == Approx(0.5 * e * e / 1.85).epsilon(1e-14));
    CHECK(impact.friction_work == Approx(-0.3 * p * (slip + 0.1 * p)).epsilon(1e-14));
  }
  // Without friction there is neither a mode nor work of it, however the normal impulse changes the slip.
  const Impact smooth = impact_of(planar(), {-1, 2, 0}, 0, e);
  CHECK((smooth.r - Vector3d(0.75, 0, 0)).norm() < 1e-15);
  CHECK(smooth.friction_work == 0);
  CHECK_FALSE((smooth.slid || smooth.stuck || smooth.diverged || smooth.locked));
}

TEST_CASE("slip that an impulse leaves as it is, and an approach that it leaves as it is until the slip stops") {
  // mu = K_nt / K_t: xi = (1, -0.5, 0), a = K xi = (1.75, 0, 0).
  const Impact steady = impact_of(planar(), {-1, 2, 0}, 0.5, 0.6);
  const double p = 1.6 / 1.75;
  CHECK(steady.slid);
  CHECK_FALSE(steady.stuck);
  CHECK((steady.r - p * Vector3d(1, -0.5, 0)).norm() < 1e-14);
  CHECK(steady.friction_work == Approx(-0.5 * 2 * p).epsilon(1e-14));
  // mu = K_nn / K_nt: xi = (1, -2, 0), a = (0, -1, 0) until slip 3 stops after 3 N s; then xi = (1, -1, 0), a_n = 1.
  const Impact waits = impact_of(planar(1), {-1, 3, 0}, 2, 0);
  CHECK(waits.status == Status::ok);
  CHECK(waits.stuck);
  CHECK_FALSE(waits.locked);
  CHECK((waits.r - Vector3d(4, -7, 0)).norm() < 1e-14);
  CHECK(waits.compression_work == Approx(-3.5).epsilon(1e-14));
  CHECK(waits.friction_work == Approx(-2 * 4.5).epsilon(1e-14));
}

TEST_CASE("without slip a contact sticks, though nothing counts as round-off") {
  Impact impact;
  integrate_impact(planar(), {-1, 0, 0}, 0.8, 0, 0, 1, {}, impact);
  CHECK_FALSE(impact.slid);
  CHECK(impact.stuck);
  CHECK((impact.r - Vector3d(1, -0.5, 0) / 1.75).norm() < 1e-14);
}

TEST_CASE("friction that just suffices to stick does, and what gives way along one tangent alone is pushed along it") {
  const Impact just = impact_of(planar(), {-1, 0, 0}, 0.5, 0);
  CHECK(just.stuck);
  CHECK_FALSE(just.diverged);
  // K_tt = (1, 1)(1, 1)^T, K_tn = a (1, 1): x = a / 2 (1, 1), |x| = a / sqrt(2), K_nn - K_nt x = 2 - a^2.
  for (const double a : {0.8, -0.8})
    for (const double mu : {0.9, 0.2}) {
      Matrix3d K;
      K << 2, a, a, a, 1, 1, a, 1, 1;
      const Impact impact = impact_of(K, {-1, 0, 0}, mu, 0);
      const double share = std::min(mu / std::sqrt(2), std::abs(a) / 2), t = a > 0 ? -share : share;
      CHECK(impact.stuck == (mu == 0.9));
      CHECK(impact.diverged == (mu == 0.2));
      CHECK((impact.r - Vector3d(1, t, t) / (2 + 2 * a * t)).norm() < 1e-14);
    }
}

// Errors are fractions of what the event or the impact is about: no unit of mass or of velocity has a say.
TEST_CASE("an impact is the same in any units, in as many steps") {
  std::mt19937 generator(12);
  const double mass = std::ldexp(1, 14), speed = std::ldexp(1, -9);  // powers of two round nothing
  int turned = 0;
  for (int i = 0; i < 200; ++i) {
    INFO(i);
    const Drawn c = draw(generator);
    const double event = i % 2 == 0 ? 0 : 1e3;
    Impact a, b;
    integrate_impact(c.K, c.u, c.mu, c.e, 1e-13, event, {}, a);
    integrate_impact(c.K / mass, speed * c.u, c.mu, c.e, speed * 1e-13, speed * event, {}, b);
    REQUIRE(a.status == Status::ok);
    CHECK(b.status == Status::ok);
    CHECK(b.steps == a.steps);
    CHECK((b.r / (mass * speed) - a.r).norm() <= 1e-13 * a.r.norm());
    const double energy = mass * speed * speed;
    CHECK(b.compression_work / energy == Approx(a.compression_work).epsilon(1e-13));
    CHECK(b.restitution_work / energy == Approx(a.restitution_work).epsilon(1e-13));
    CHECK(b.friction_work / energy == Approx(a.friction_work).epsilon(1e-13));
    turned += a.steps > 5;
  }
  CHECK(turned > 100);
}

TEST_CASE("slip that turns ends where a plain integration in short steps ends") {
  std::mt19937 generator(21);
  int compared = 0;
  for (int i = 0; i < 60; ++i) {
    INFO(i);
    const Drawn c = draw(generator);
    const Plain plain = plain_integration(c);
    if (plain.stops) continue;
    ++compared;
    const Impact impact = impact_of(c.K, c.u, c.mu, c.e);
    REQUIRE(impact.status == Status::ok);
    CHECK(impact.slid);
    CHECK_FALSE((impact.stuck || impact.diverged));
    CHECK((impact.r - plain.r).norm() <= 1e-8 * plain.r.norm());
    CHECK(impact.compression_work == Approx(plain.compression).epsilon(1e-8));
    CHECK(impact.restitution_work == Approx(plain.restitution).epsilon(1e-8));
    CHECK(impact.friction_work == Approx(plain.friction).epsilon(1e-8));
  }
  CHECK(compared > 20);
}

TEST_CASE("an impact is as exact as it is asked to be, as a fraction of the approach") {
  std::mt19937 generator(21);
  ImpactOptions sharp;
  sharp.integration = 1e-14;
  sharp.turn = 1e-5;
  const ImpactOptions asked;
  REQUIRE(asked.integration == 1e-10);
  for (int i = 0; i < 100; ++i) {
    INFO(i);
    const Drawn c = draw(generator);
    const Impact exact = impact_of(c.K, c.u, c.mu, c.e, sharp);
    const auto missed = [&](const ImpactOptions& options, double event_approach) {
      const Impact impact = impact_of(c.K, c.u, c.mu, c.e, options, event_approach);
      return (c.K * (impact.r - exact.r)).norm() / -c.u[0];
    };
    for (const double integration : {1e-4, 1e-7, 1e-10}) {
      ImpactOptions options;
      options.integration = integration;
      CHECK(missed(options, 0) < 20 * integration);
      // An event a thousand times as fast may leave a thousand times as much.
      CHECK(missed(options, -1e3 * c.u[0]) < std::min(20e3 * integration, 2e-3));
    }
    // However fast the event, a slow impact is known to its own size, and the slip to its direction.
    const double event_approach = -1e12 * c.u[0];
    CHECK(missed({}, event_approach) < 1e-3);
    ImpactOptions own, turn;
    own.integration_own = 1e-7;
    CHECK(missed(own, event_approach) < 2e-6);
    turn.turn = 1e-6;
    CHECK(missed(turn, event_approach) < 5e-5);
  }
}

TEST_CASE("an impact of an event that is far faster is not followed as closely") {
  std::mt19937 generator(21);
  int alone = 0, late = 0, loose = 0;
  ImpactOptions rough;
  rough.integration = 1e-6;
  for (int i = 0; i < 100; ++i) {
    const Drawn c = draw(generator);
    alone += impact_of(c.K, c.u, c.mu, c.e).steps;
    late += impact_of(c.K, c.u, c.mu, c.e, {}, -1e4 * c.u[0]).steps;
    loose += impact_of(c.K, c.u, c.mu, c.e, rough).steps;
  }
  CHECK(2 * late < alone);
  CHECK(2 * loose < alone);
}

// However long the steps: the length of the last one is found by itself.
TEST_CASE(
    "compression ends where nothing approaches and restitution where e^2 of the work is back, be steps ever so long") {
  std::mt19937 generator(33);
  ImpactOptions rough;
  rough.integration = rough.integration_own = 1e-2;
  rough.turn = 0.1;
  for (int i = 0; i < 1000; ++i) {
    INFO(i);
    Drawn c = draw(generator);
    if (i % 2 == 0) c.mu *= 2;
    const Impact plastic = impact_of(c.K, c.u, c.mu, 0, rough);
    REQUIRE(plastic.status == Status::ok);
    CHECK(std::abs(c.u[0] + c.K.row(0) * plastic.r) <= 1e-8 * c.u.norm());
    CHECK(plastic.restitution_work == 0);
    const Impact elastic = impact_of(c.K, c.u, c.mu, c.e, rough);
    REQUIRE(elastic.status == Status::ok);
    CHECK(elastic.restitution_work == Approx(-c.e * c.e * elastic.compression_work).epsilon(1e-8));
  }
}
