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
inline Shape capsule(double radius, double length) {
  Shape shape = cylinder(radius, length);
  shape.kind = ShapeKind::capsule;
  return shape;
}
/// In the hull's own frame: `frame` is where that is among the points.
inline Shape hull(const std::vector<Vec3>& points, Pose* frame = nullptr) {
  Shape shape;
  shape.kind = ShapeKind::hull;
  shape.body = 0;
  shape.hull = std::make_shared<Hull>(make_hull(points));
  shape.half_extents = shape.hull->polytope.half_extents();
  if (frame) *frame = shape.hull->frame;
  return shape;
}
/// A hull that is a box.
inline Shape box_hull(double x, double y, double z) {
  std::vector<Vec3> corners;
  for (int k = 0; k < 8; ++k) corners.push_back(Vec3(k & 1 ? x : -x, k & 2 ? y : -y, k & 4 ? z : -z) / 2);
  return hull(corners);
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

/// Of convex shapes but cylinders: world positions of the corners of the core, and the radius around it.
inline std::vector<Vec3> core_corners(const Shape& shape, const Pose& pose) {
  std::vector<Vec3> all;
  if (shape.kind == ShapeKind::sphere) all.push_back(pose.p);
  if (shape.kind == ShapeKind::capsule)
    for (const int end : {-1, 1}) all.push_back(pose * Vec3(0, end * shape.half_extents.y(), 0));
  if (shape.kind == ShapeKind::hull)
    for (const Vec3& x : shape.hull->polytope.vertices) all.push_back(pose * x);
  if (shape.kind == ShapeKind::box)
    for (int k = 0; k < 8; ++k)
      all.push_back(pose * Vec3(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1).cwiseProduct(shape.half_extents));
  return all;
}
inline double core_radius(const Shape& shape) {
  return shape.kind == ShapeKind::box || shape.kind == ShapeKind::hull ? 0 : shape.radius;
}

/// How far two convex shapes surely are apart: the most over the directions that can be nearest for some pair of
/// features (any two corners; any corner and line of two corners; any two lines). It knows no face and no edge.
inline double certified_gap(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b) {
  const std::vector<Vec3> A = core_corners(a, pose_a), B = core_corners(b, pose_b);
  double best = -std::numeric_limits<double>::infinity();
  const auto look = [&](const Vec3& direction) {
    if (direction.norm() < 1e-9) return;
    const Vec3 n = direction.normalized();
    double high_a = -1e300, low_a = 1e300, high_b = -1e300, low_b = 1e300;
    for (const Vec3& x : A) {
      high_a = std::max(high_a, n.dot(x));
      low_a = std::min(low_a, n.dot(x));
    }
    for (const Vec3& x : B) {
      high_b = std::max(high_b, n.dot(x));
      low_b = std::min(low_b, n.dot(x));
    }
    best = std::max({best, low_b - high_a, low_a - high_b});
  };
  std::vector<Vec3> lines_a, lines_b;
  for (std::size_t i = 0; i < A.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) lines_a.push_back(A[i] - A[j]);
  for (std::size_t i = 0; i < B.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) lines_b.push_back(B[i] - B[j]);
  for (const Vec3& u : lines_a)
    for (const Vec3& v : lines_b) look(u.cross(v));
  for (const auto* lines : {&lines_a, &lines_b})
    for (std::size_t i = 0; i < lines->size(); ++i)
      for (std::size_t j = 0; j < i; ++j) look((*lines)[i].cross((*lines)[j]));
  for (const Vec3& x : A)
    for (const Vec3& y : B) {
      const Vec3 d = y - x;
      look(d);
      for (const auto* lines : {&lines_a, &lines_b})
        for (const Vec3& u : *lines) look(d - d.dot(u) / u.squaredNorm() * u);
    }
  return best - core_radius(a) - core_radius(b);
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
