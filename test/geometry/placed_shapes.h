#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "geometry/shapes.h"

namespace cb::test {

using std::numbers::pi;

inline Shape box(double x, double y, double z) {
  Shape shape;
  shape.kind = ShapeKind::box;
  shape.body = 0;
  shape.half_extents = Vec3(x, y, z) / 2;
  return shape;
}
inline Shape sphere(double radius) {
  Shape shape;
  shape.kind = ShapeKind::sphere;
  shape.body = 0;
  shape.radius = radius;
  return shape;
}
inline Shape cylinder(double radius, double length) {
  Shape shape;
  shape.kind = ShapeKind::cylinder;
  shape.body = 0;
  shape.radius = radius;
  shape.half_extents = Vec3(radius, length / 2, radius);
  return shape;
}
inline Shape half_space() {
  Shape shape;
  shape.kind = ShapeKind::half_space;
  return shape;
}
inline Pose at(double x, double y, double z) {
  Pose pose;
  pose.p = Vec3(x, y, z);
  return pose;
}
inline Pose at(const Vec3& p, const Quat& q = Quat::Identity()) {
  Pose pose;
  pose.p = p;
  pose.q = q;
  return pose;
}
inline Quat turn(double angle, const Vec3& axis) { return Quat(Eigen::AngleAxisd(angle, axis.normalized())); }
inline Pose operator*(const Pose& a, const Pose& b) { return at(a.p + a.q * b.p, (a.q * b.q).normalized()); }

/// Repeatable random numbers, the same on every machine.
class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double in(double low, double high) { return low + (high - low) * (static_cast<double>(engine_()) / 4294967295.0); }
  Vec3 vector(double size) { return {in(-size, size), in(-size, size), in(-size, size)}; }
  Quat rotation() {
    while (true) {
      const Quat q(in(-1, 1), in(-1, 1), in(-1, 1), in(-1, 1));
      if (q.norm() > 0.1 && q.norm() < 1) return q.normalized();
    }
  }
  Pose pose(double size) {
    const Vec3 p = vector(size);
    return at(p, rotation());
  }

 private:
  std::mt19937 engine_;
};

inline std::vector<ContactPoint> points(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b,
                                        double tolerance = 1e-9) {
  std::vector<ContactPoint> out;
  contact_points(a, pose_a, 0, b, pose_b, 1, tolerance, out);
  return out;
}

/// World positions of the eight corners of a box.
inline std::vector<Vec3> corners(const Shape& shape, const Pose& pose) {
  std::vector<Vec3> all;
  for (int k = 0; k < 8; ++k) {
    const Vec3 sign(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1);
    all.push_back(pose * sign.cwiseProduct(shape.half_extents));
  }
  return all;
}

/// Nearest point of a solid box to x.
inline Vec3 nearest(const Shape& shape, const Pose& pose, const Vec3& x) {
  const Vec3 local = pose.q.conjugate() * (x - pose.p);
  return pose * local.cwiseMax(-shape.half_extents).cwiseMin(shape.half_extents);
}

/// Distance of two boxes from above, by alternating projections: each is a pair of points of the two solids.
inline double distance_by_projection(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b,
                                     int rounds) {
  Vec3 x = pose_a.p;
  double distance = 0;
  for (int k = 0; k < rounds; ++k) {
    const Vec3 y = nearest(b, pose_b, x);
    x = nearest(a, pose_a, y);
    distance = (x - y).norm();
    if (distance < 1e-14) break;
  }
  return distance;
}

/// Largest distance from a point of one set to the nearest of the other, over position, normal and gap.
inline double set_difference(const std::vector<ContactPoint>& a, const std::vector<ContactPoint>& b,
                             double normal_sign = 1) {
  if (a.size() != b.size()) return std::numeric_limits<double>::infinity();
  double worst = 0;
  for (const ContactPoint& p : a) {
    double best = std::numeric_limits<double>::infinity();
    for (const ContactPoint& q : b)
      best = std::min(best, std::max({(p.position - q.position).norm(), (p.normal - normal_sign * q.normal).norm(),
                                      std::abs(p.gap - q.gap)}));
    worst = std::max(worst, best);
  }
  return worst;
}

}  // namespace cb::test
