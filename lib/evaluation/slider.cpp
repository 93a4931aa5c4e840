// Exact motion of a point mass that slides on a plane.
//
// Problem: v' = a(t) + F, F in a polygon or disk of friction accelerations (m/s^2), with F.v least (maximum
// dissipation); at rest F balances a if it can. Source: Moreau's principle; for sliding along a bisector, Filippov
// (1988), section 4.
//
// Polygon with vertices f d_j, half angle b = pi/k. While the velocity lies in the sector opposed by one vertex, F is
// that vertex. On the ray u between two sectors F may be anything on the edge between: across the ray the two vertices
// give -+ f sin b, always back towards it, so the velocity stays on the ray while the drive across it is at most
// f sin b, and along the ray friction is f cos b. At rest v' = a + F with F the projection of -a on the polygon: this
// is the one F for which F.(a + F) is least.
// Events (leaving a sector or a ray, coming to rest, setting off, a push that starts or ends) are bracketed in steps of
// the drive's period / 400 and bisected to round-off.
// Disk: along one line a polygon with k = 2 is the same, and where a constant drive and the velocity come to share one
// it goes on in closed form; otherwise integrated numerically to 1e-13 a step: small steps where it is slow. From rest
// the direction is the drive's, lagging behind a turning drive by the factor A / (2 A - f) of its turn, A = |a|.
#include "evaluation/slider.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "linalg/dormand_prince.h"

namespace cb {

namespace {

using std::numbers::pi;

/// Fraction of the largest speed so far below which a slider counts as at rest; under a polygon that by which its
/// velocity leaves a ray to the middle of the next sector: below that it belongs to no sector.
constexpr double zero_speed = 1e-11;
/// Relative slack of the polygon's edges: a drive that matches friction to this holds.
constexpr double zero_slack = 1e-13;
/// Steps a period of the drive, for bracketing events.
constexpr double steps_per_period = 400;
/// Bracketing step where the drive is piecewise constant (events are then found in any step), s.
constexpr double long_scan = 10;
/// Of the disk's integrator: error of a step, m and m/s; longest step, s, which keeps the quintic exact to round-off;
/// first step from rest, s.
constexpr double tolerance = 1e-13;
constexpr double longest = 0.01;
constexpr double setting_off = 1e-6;
/// m/s: speed below which the errors of the disk's integrator turn it anyhow.
constexpr double least_speed = 100 * tolerance;
/// Segments without progress in time before the rest is taken at face value.
constexpr int max_segments = 1000;

double cross(const Vec2& a, const Vec2& b) { return a.x() * b.y() - a.y() * b.x(); }
Vec2 left_of(const Vec2& u) { return {-u.y(), u.x()}; }

}  // namespace

Vec2 Drive::steady(double t) const {
  Vec2 a = constant;
  for (const Push& push : pushes)
    if (push.from <= t && t < push.to) a += push.acceleration;
  return a;
}

Vec2 Drive::at(double t) const {
  Vec2 a = steady(t);
  for (const Harmonic& harmonic : harmonics)
    a += std::cos(harmonic.frequency * t + harmonic.phase) * harmonic.amplitude;
  return a;
}

double Drive::next_change(double t) const {
  double next = std::numeric_limits<double>::infinity();
  for (const Push& push : pushes) {
    if (push.from > t) next = std::min(next, push.from);
    if (push.to > t) next = std::min(next, push.to);
  }
  return next;
}

void Drive::integrate(double t0, double t, Vec2& velocity, Vec2& way) const {
  const double tau = t - t0;
  const Vec2 a = steady(t0);
  velocity = tau * a;
  way = (tau * tau / 2) * a;
  for (const Harmonic& harmonic : harmonics) {
    const double w = harmonic.frequency, from = w * t0 + harmonic.phase, half = w * tau / 2;
    // sin(x + 2 h) - sin x = 2 sin h cos(x + h), and the same for the cosine: no cancellation.
    const double sine = std::sin(half);
    velocity += (2 * sine * std::cos(from + half) / w) * harmonic.amplitude;
    way += ((2 * sine * std::sin(from + half) / w - tau * std::sin(from)) / w) * harmonic.amplitude;
  }
}

PolygonSlider::PolygonSlider(Drive drive, double friction, int k, double angle, const SliderState& start)
    : drive_(std::move(drive)), friction_(friction), angle_(angle), half_angle_(pi / k), k_(k) {
  double frequency = 0;
  for (const Drive::Harmonic& harmonic : drive_.harmonics)
    frequency = std::max(frequency, std::abs(harmonic.frequency));
  scan_ = frequency > 0 ? 2 * pi / frequency / steps_per_period : long_scan;
  classify(0, start);
}

// Unit vector at `turn` half angles from the first vertex: even for vertices, odd for bisectors.
Vec2 PolygonSlider::direction(double turn) const {
  const double angle = angle_ + turn * half_angle_;
  return {std::cos(angle), std::sin(angle)};
}

// Starts a segment at t: which part of the polygon acts from here on?
void PolygonSlider::classify(double t, const SliderState& state) {
  t0_ = t_safe_ = t;
  ends_ = false;
  t_end_ = drive_.next_change(t);
  start_ = state;
  const Vec2 a = drive_.at(t);
  const double speed = state.v.norm();
  fastest_ = std::max(fastest_, speed);
  const double edge = friction_ * std::sin(half_angle_), apothem = friction_ * std::cos(half_angle_);

  if (speed * std::sin(half_angle_) <= zero_speed * fastest_) {
    start_.v.setZero();
    // Nearest edge to -a: odd turn.
    const double turn = (std::atan2(-a.y(), -a.x()) - angle_) / half_angle_;
    const double odd = 2 * std::floor(turn / 2) + 1;
    const Vec2 normal = direction(odd);
    const double out = -a.dot(normal) - apothem, along = -a.dot(left_of(normal));
    const double slack = zero_slack * (friction_ + a.norm());
    if (out <= slack && std::abs(along) <= edge + slack) {
      mode_ = Mode::rest;
      force_.setZero();
    } else if (std::abs(along) < edge) {
      mode_ = Mode::ray;
      ray_ = -normal;
      force_ = -apothem * ray_;
    } else {
      mode_ = Mode::vertex;
      vertex_ = static_cast<int>(odd) + (along > 0 ? 1 : -1);
      force_ = friction_ * direction(vertex_);
    }
    return;
  }

  // Sector of the velocity, opposed by the vertex nearest to -v.
  const double turn = (std::atan2(-state.v.y(), -state.v.x()) - angle_) / half_angle_;
  vertex_ = 2 * static_cast<int>(std::lround(turn / 2));
  for (const int side : {-1, 1}) {
    const Vec2 ray = -direction(vertex_ + side);
    if (std::abs(cross(ray, state.v)) > zero_speed * fastest_) continue;
    const double across = a.dot(left_of(ray));
    if (std::abs(across) <= edge * (1 + zero_slack)) {
      mode_ = Mode::ray;
      ray_ = ray;
      start_.v = ray * ray.dot(state.v);
      force_ = -apothem * ray;
      return;
    }
    // Pushed off the ray: into the sector on its left (opposed by the next vertex) or on its right.
    vertex_ += side + (across > 0 ? 1 : -1);
    break;
  }
  mode_ = Mode::vertex;
  force_ = friction_ * direction(vertex_);
}

SliderState PolygonSlider::evaluate(double t) const {
  if (mode_ == Mode::rest) return start_;
  const double tau = t - t0_;
  SliderState state;
  Vec2 dv, dp;
  drive_.integrate(t0_, t, dv, dp);
  dv += tau * force_;
  dp += (tau * tau / 2) * force_;
  if (mode_ == Mode::ray) {
    dv = ray_ * ray_.dot(dv);
    dp = ray_ * ray_.dot(dp);
  }
  state.v = start_.v + dv;
  state.p = start_.p + tau * start_.v + dp;
  return state;
}

// Is the segment's mode still right at t?
bool PolygonSlider::holds(double t) const {
  const Vec2 a = drive_.at(t);
  switch (mode_) {
    case Mode::rest: {
      const double turn = (std::atan2(-a.y(), -a.x()) - angle_) / half_angle_;
      const Vec2 normal = direction(2 * std::floor(turn / 2) + 1);
      const double slack = zero_slack * (friction_ + a.norm());
      return -a.dot(normal) - friction_ * std::cos(half_angle_) <= slack &&
             std::abs(a.dot(left_of(normal))) <= friction_ * std::sin(half_angle_) + slack;
    }
    case Mode::ray:
      return ray_.dot(evaluate(t).v) >= 0 &&
             std::abs(cross(ray_, a)) <= friction_ * std::sin(half_angle_) * (1 + zero_slack);
    case Mode::vertex: {
      // Between the two rays of the sector, with round-off for a velocity that starts on one of them.
      const Vec2 v = evaluate(t).v;
      const double slack = zero_speed * std::max(fastest_, v.norm()) / 2;
      return cross(-direction(vertex_ - 1), v) >= -slack && cross(v, -direction(vertex_ + 1)) >= -slack;
    }
  }
  return true;
}

SliderState PolygonSlider::at(double t) {
  while (t_safe_ < t) {
    if (ends_) {
      SliderState state = evaluate(t_safe_);
      // A velocity that turns round on its own line passes through zero between two doubles.
      if (mode_ == Mode::ray && ray_.dot(state.v) < 0) state.v.setZero();
      stalled_ = t_safe_ > t0_ ? 0 : stalled_ + 1;
      classify(t_safe_, state);
    }
    extend();
  }
  return evaluate(t);
}

// Looks ahead for the end of the segment: checks up to the next bracketing step, or to the event before it.
void PolygonSlider::extend() {
  const double next = std::min(t_safe_ + scan_, t_end_);
  if (holds(std::nextafter(next, t_safe_)) || stalled_ > max_segments) {
    t_safe_ = next;
    ends_ = next == t_end_;
    if (mode_ != Mode::rest) fastest_ = std::max(fastest_, evaluate(next).v.norm());
    return;
  }
  double low = t_safe_, high = next;
  while (true) {
    const double middle = 0.5 * (low + high);
    if (middle <= low || middle >= high) break;
    (holds(middle) ? low : high) = middle;
  }
  t_safe_ = high;
  ends_ = true;
}

DiskSlider::DiskSlider(Drive drive, double friction, const SliderState& start)
    : drive_(std::move(drive)), friction_(friction), s0_(start), s1_(start) {
  fastest_ = start.v.norm();
  a0_ = a1_ = acceleration(0, start.v);
}

Vec2 DiskSlider::acceleration(double t, const Vec2& v) const {
  const double speed = v.norm();
  if (speed == 0) return Vec2::Zero();
  return drive_.at(t) - (friction_ / speed) * v;
}

SliderState DiskSlider::at(double t) {
  while (t1_ < t) advance();
  const double h = t1_ - t0_;
  if (h == 0 || t >= t1_) return s1_;
  // Quintic that takes position, velocity and acceleration at both ends.
  const double s = (t - t0_) / h, r = 1 - s;
  const double s2 = s * s, r2 = r * r, s3 = s2 * s, r3 = r2 * r;
  const double p1 = s3 * (1 + 3 * r + 6 * r2);
  const double v0 = s * r3 * (1 + 3 * s), v1 = -r * s3 * (1 + 3 * r);
  const double a0 = 0.5 * s2 * r3, a1 = 0.5 * r2 * s3;
  SliderState state;
  state.p = s0_.p + p1 * (s1_.p - s0_.p) + h * (v0 * s0_.v + v1 * s1_.v) + h * h * (a0 * a0_ + a1 * a1_);
  // Velocity: cubic in velocity and acceleration.
  state.v = r2 * (1 + 2 * s) * s0_.v + s2 * (1 + 2 * r) * s1_.v + h * s * r * (r * a0_ - s * a1_);
  return state;
}

// One step of the integrator, or of rest.
void DiskSlider::advance() {
  t0_ = t1_;
  s0_ = s1_;
  const double room = drive_.next_change(t0_) - t0_;
  // The drive after a change is another one: take the acceleration from its right.
  a0_ = acceleration(t0_, s0_.v);
  if (s0_.v.norm() <= standing() && holds(t0_)) return rest(room);
  if (on_one_line()) return go_straight(room);
  if (s0_.v.norm() <= standing()) return set_off(room);
  slide(room);
}

bool DiskSlider::holds(double t) const { return drive_.at(t).norm() <= friction_ * (1 + zero_slack); }

double DiskSlider::standing() const { return std::max(zero_speed * fastest_, least_speed); }

bool DiskSlider::on_one_line() const {
  if (!drive_.harmonics.empty()) return false;
  const Vec2 a = drive_.at(t0_);
  // What is across turns along within |v| / |a|.
  const bool soon = s0_.v.norm() <= longest * a.norm();
  return std::abs(cross(a, s0_.v)) <= (soon ? least_speed : tolerance) * a.norm();
}

void DiskSlider::end_step(double h) {
  t1_ = t0_ + h;
  fastest_ = std::max(fastest_, s1_.v.norm());
  a1_ = acceleration(t1_, s1_.v);
}

// Up to where the drive may have overcome friction.
void DiskSlider::rest(double room) {
  trial_ = setting_off;
  s0_.v = s1_.v = a0_ = Vec2::Zero();
  double h = std::min(longest, room);
  if (!drive_.harmonics.empty()) {
    double low = 0, high = h;
    if (!holds(t0_ + h)) {
      for (int i = 0; i < 60; ++i) (holds(t0_ + 0.5 * (low + high)) ? low : high) = 0.5 * (low + high);
      h = high;
    }
  }
  end_step(h);
  a1_.setZero();
}

// In closed form, to rest at most.
void DiskSlider::go_straight(double room) {
  const Vec2 a = drive_.at(t0_), line = a.isZero(0) ? s0_.v.normalized() : a.normalized();
  const double before = s0_.v.dot(line), rate = a.dot(line) + (before < 0 ? friction_ : -friction_);
  const double stops = before * rate < 0 ? -before / rate : std::numeric_limits<double>::infinity();
  const double h = std::min({longest, room, stops}), after = h < stops ? before + h * rate : 0;
  a0_ = rate * line;
  s1_.v = after * line;
  s1_.p = s0_.p + (h / 2 * (before + after)) * line;
  end_step(h);
  a1_ = a0_;
}

void DiskSlider::set_off(double room) {
  const Vec2 a = drive_.at(t0_);
  const double strength = a.norm(), h = std::min(setting_off, room);
  const Vec2 later = drive_.at(t0_ + h / 2);
  const double turned = std::atan2(cross(a, later), a.dot(later)) * 2 * strength / (2 * strength - friction_);
  const Vec2 along = a / strength;
  const Vec2 heading = std::cos(turned) * along + std::sin(turned) * left_of(along);
  a0_ = (strength - friction_) * along;
  s1_.v = s0_.v + (h * (strength - friction_)) * heading;
  s1_.p = s0_.p + (h / 2) * (s0_.v + s1_.v);
  trial_ = h / 2;
  end_step(h);
}

// Dormand and Prince's method in the velocity, which does not see the way; the way has the mean velocity of its stages.
void DiskSlider::slide(double room) {
  using namespace dormand_prince;
  const Vec2 &v = s0_.v, k1 = a0_;
  while (true) {
    const double h = std::min({trial_, longest, room});
    const Vec2 v2 = v + h * second(k1);
    const Vec2 k2 = acceleration(t0_ + c2 * h, v2);
    const Vec2 v3 = v + h * third(k1, k2);
    const Vec2 k3 = acceleration(t0_ + c3 * h, v3);
    const Vec2 v4 = v + h * fourth(k1, k2, k3);
    const Vec2 k4 = acceleration(t0_ + c4 * h, v4);
    const Vec2 v5 = v + h * fifth(k1, k2, k3, k4);
    const Vec2 k5 = acceleration(t0_ + c5 * h, v5);
    // The right end belongs to this window: a push that starts there must not be seen.
    const double end = std::nextafter(t0_ + h, t0_);
    const Vec2 v6 = v + h * sixth(k1, k2, k3, k4, k5);
    const Vec2 k6 = acceleration(end, v6);
    const Vec2 v7 = v + h * whole(k1, k3, k4, k5, k6);
    const Vec2 k7 = acceleration(end, v7);
    const double ratio = (h * error(k1, k3, k4, k5, k6, k7)).norm() / tolerance;
    const double factor = std::clamp(0.9 * std::pow(std::max(ratio, 1e-10), -0.2), 0.2, 5.0);
    trial_ = factor * h;
    if (ratio <= 1) {
      s1_.v = v7;
      s1_.p = s0_.p + h * whole(v, v3, v4, v5, v6);
      end_step(h);
      a1_ = k7;
      return;
    }
    // Steps that shrink to nothing: the velocity is about to vanish.
    if (trial_ < 1e-13 * std::max(1.0, t0_)) {
      s1_.v.setZero();
      return end_step(0);
    }
  }
}

Slider coulomb_slider(const Drive& drive, double friction, const SliderState& start) {
  // Do the velocity and everything that drives lie on one line?
  Vec2 line = Vec2::Zero();
  bool one_line = true;
  const auto add = [&](const Vec2& vector) {
    if (vector.isZero(0)) return;
    if (line.isZero(0)) line = vector.normalized();
    one_line &= std::abs(cross(line, vector)) <= 4 * std::numeric_limits<double>::epsilon() * vector.norm();
  };
  add(drive.constant);
  for (const Drive::Push& push : drive.pushes) add(push.acceleration);
  for (const Drive::Harmonic& harmonic : drive.harmonics) add(harmonic.amplitude);
  add(start.v);
  if (one_line) return PolygonSlider(drive, friction, 2, std::atan2(line.y(), line.x()), start);
  return DiskSlider(drive, friction, start);
}

}  // namespace cb
