// SphereImpact of a sphere on a plane, and its motion before and after, in closed form.
//
// Problem: sphere (m in kg, I, r), velocity v, spin w, plane with unit normal n, friction mu, restitution e.
// Normal impulse j = (1 + e) m v_n: the tangential impulse acts through the contact point along the plane and has no
// part in the normal velocity. Slip s = v_t + (w x -r n)_t changes by J / m + r^2 J / I under a tangential impulse J,
// so the slip per impulse is c = 1/m + r^2/I (3.5 / m for a solid sphere). It sticks iff |s| <= c mu j, with J = -s /
// c; else J = -mu j s / |s|. The slip keeps its direction while it slides, so all laws agree for any e. Polygon (A-P, e
// = 0): J is the element of the polygon nearest to -s / c, because c is the same in all directions. Afterwards it
// slides with mu g against the slip, which falls at the rate c m mu g, and rolls when it is zero.
#include "evaluation/sphere_impact.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "geometry/shapes.h"

namespace cb {

namespace {

SphereImpact apply(const SphereBody& sphere, const Vec3& v, const Vec3& w, const Vec3& n, double normal,
                   const Vec3& tangential, bool sticks) {
  SphereImpact impact;
  impact.impulse = normal * n + tangential;
  impact.v = v + impact.impulse / sphere.mass;
  impact.w = w + (-sphere.radius * n).cross(tangential) / sphere.inertia;
  impact.sticks = sticks;
  return impact;
}

}  // namespace

Vec3 SphereBody::slip(const Vec3& v, const Vec3& w, const Vec3& n) const {
  const Vec3 u = v - radius * w.cross(n);
  return u - n.dot(u) * n;
}

SphereImpact sphere_impact(const SphereBody& sphere, const Vec3& v, const Vec3& w, const Vec3& n, double mu, double e) {
  const double normal = (1 + e) * sphere.mass * -n.dot(v);
  const Vec3 slip = sphere.slip(v, w, n);
  const double size = slip.norm(), stop = size / sphere.slip_per_impulse();
  const bool sticks = stop <= mu * normal;
  const Vec3 tangential = size > 0 ? Vec3(slip * (-(sticks ? stop : mu * normal) / size)) : Vec3(Vec3::Zero());
  return apply(sphere, v, w, n, normal, tangential, sticks);
}

SphereImpact sphere_impact_polygon(const SphereBody& sphere, const Vec3& v, const Vec3& w, const Vec3& n, double mu,
                                   int k, double rotate_cone) {
  using std::numbers::pi;
  const double normal = sphere.mass * -n.dot(v), half_angle = pi / k;
  Vec3 t1, t2;
  contact_tangents(n, rotate_cone, t1, t2);
  const Vec3 wanted = sphere.slip(v, w, n) / -sphere.slip_per_impulse();
  const double x = wanted.dot(t1), y = wanted.dot(t2);
  // Edge whose sector holds the wanted impulse: its normal at an odd number of half angles.
  const double angle = (2 * std::floor(std::atan2(y, x) / (2 * half_angle)) + 1) * half_angle;
  const double out = x * std::cos(angle) + y * std::sin(angle), along = -x * std::sin(angle) + y * std::cos(angle);
  const double apothem = mu * normal * std::cos(half_angle), edge = mu * normal * std::sin(half_angle);
  if (out <= apothem) return apply(sphere, v, w, n, normal, wanted, true);
  const double on_edge = std::clamp(along, -edge, edge);
  const Vec3 tangential = (apothem * std::cos(angle) - on_edge * std::sin(angle)) * t1 +
                          (apothem * std::sin(angle) + on_edge * std::cos(angle)) * t2;
  return apply(sphere, v, w, n, normal, tangential, false);
}

SphereFlight::SphereFlight(const SphereBody& sphere, const Pose& start, const Vec3& v, const Vec3& w, double gap,
                           const Vec3& n, double g, double mu)
    : p0_(start.p), v0_(v), n_(n), g_(g) {
  // gap + v_n t - g t^2 / 2 = 0
  const double v_n = n.dot(v), root = std::sqrt(v_n * v_n + 2 * g * gap);
  t_impact = v_n > 0 ? (v_n + root) / g : 2 * gap / (root - v_n);
  if (gap <= 0 && v_n <= 0) t_impact = 0;
  if (!std::isfinite(t_impact)) t_impact = std::numeric_limits<double>::infinity();
  t_roll = std::numeric_limits<double>::infinity();
  p_impact_ = v_impact_ = slowing_ = Vec3::Zero();
  if (!std::isfinite(t_impact)) return;

  const Vec3 before = v - g * t_impact * n;
  const SphereImpact impact = sphere_impact(sphere, before, w, n, mu, 0);
  p_impact_ = p0_ + t_impact * v0_ - (g / 2 * t_impact * t_impact) * n;
  v_impact_ = impact.v - n.dot(impact.v) * n;
  const Vec3 slip = sphere.slip(impact.v, impact.w, n);
  const double size = slip.norm();
  if (impact.sticks) {
    t_roll = t_impact;
  } else if (mu > 0 && g > 0) {
    slowing_ = (mu * g / size) * slip;
    t_roll = t_impact + size / (sphere.slip_per_impulse() * sphere.mass * mu * g);
  }
}

Vec3 SphereFlight::position(double t) const {
  if (t < t_impact) return p0_ + t * v0_ - (g_ / 2 * t * t) * n_;
  const double tau = t - t_impact, sliding = std::min(t, t_roll) - t_impact;
  return p_impact_ + tau * v_impact_ - (sliding * (tau - sliding / 2)) * slowing_;
}

}  // namespace cb
