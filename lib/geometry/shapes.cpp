#include "geometry/shapes.h"

#include <algorithm>
#include <cmath>

namespace cb {

double Shape::bounding_radius() const {
  switch (kind) {
    case ShapeKind::sphere:
      return radius;
    case ShapeKind::box:
      return half_extents.norm();
    case ShapeKind::half_space:
      break;
  }
  return std::numeric_limits<double>::infinity();
}

double Shape::size() const {
  switch (kind) {
    case ShapeKind::sphere:
      return 2 * radius;
    case ShapeKind::box:
      return 2 * half_extents.maxCoeff();
    case ShapeKind::half_space:
      break;
  }
  return std::numeric_limits<double>::infinity();
}

void contact_tangents(const Vec3& normal, double angle, Vec3& t1, Vec3& t2) {
  // Below this sine of the angle between the normal and the x axis, the projection of x counts as vanished.
  constexpr double vanishing_sine = 1e-6;
  // t2 = n x t1 is parallel to n x (x axis), which has no cancellation; t1 follows from it.
  const double length_x = std::hypot(normal.y(), normal.z());
  if (length_x > vanishing_sine) {
    t2 = Vec3(0, normal.z() / length_x, -normal.y() / length_x);
  } else {
    const double length_z = std::hypot(normal.x(), normal.y());
    t2 = Vec3(normal.y() / length_z, -normal.x() / length_z, 0);
  }
  t1 = t2.cross(normal);
  if (angle != 0) {
    const double c = std::cos(angle), s = std::sin(angle);
    const Vec3 turned = c * t1 + s * t2;
    t2 = c * t2 - s * t1;
    t1 = turned;
  }
}

namespace {

// cos x and sin(x) / x from x^2. The series is used where its first term left out is below 1e-18.
void half_angle(double x2, double& cosine, double& sinc) {
  constexpr double series_below = 1e-3;  // of x^2
  if (x2 < series_below) {
    cosine = 1 - x2 / 2 * (1 - x2 / 12 * (1 - x2 / 30 * (1 - x2 / 56)));
    sinc = 1 - x2 / 6 * (1 - x2 / 20 * (1 - x2 / 42));
    return;
  }
  const double x = std::sqrt(x2);
  cosine = std::cos(x);
  sinc = std::sin(x) / x;
}

}  // namespace

Pose advance(const Motion& motion, double t) {
  Pose pose = motion.pose;
  pose.p += t * motion.v;
  const Vec3 half = (t / 2) * motion.w;
  const double x2 = half.squaredNorm();
  if (x2 == 0) return pose;  // no turn: the quaternion stays as it is, bit for bit
  double cosine = 0, sinc = 0;
  half_angle(x2, cosine, sinc);
  const Quat& q = motion.pose.q;
  const Vec3 e = sinc * half;
  const Vec3 u = q.vec();
  const Vec3 vec = cosine * u + q.w() * e + e.cross(u);
  const double w = cosine * q.w() - e.dot(u);
  const double scale = 1 / std::sqrt(w * w + vec.squaredNorm());
  pose.q = Quat(scale * w, scale * vec.x(), scale * vec.y(), scale * vec.z());
  return pose;
}

}  // namespace cb
