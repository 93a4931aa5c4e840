#include "geometry/shapes.h"

#include <algorithm>
#include <cmath>

#include "dynamics/kinematics.h"

namespace cb {

std::string_view name(ShapeKind kind) {
  switch (kind) {
    case ShapeKind::sphere:
      return "sphere";
    case ShapeKind::box:
      return "box";
    case ShapeKind::cylinder:
      return "cylinder";
    case ShapeKind::capsule:
      return "capsule";
    case ShapeKind::hull:
      return "hull";
    case ShapeKind::half_space:
      break;
  }
  return "half_space";
}

double Shape::bounding_radius() const {
  switch (kind) {
    case ShapeKind::sphere:
      return radius;
    case ShapeKind::cylinder:
      return length(radius, half_extents.y());
    case ShapeKind::capsule:
      return half_extents.y() + radius;
    case ShapeKind::hull:
      return hull->radius;
    case ShapeKind::box:
      return half_extents.norm();
    case ShapeKind::half_space:
      break;
  }
  return std::numeric_limits<double>::infinity();
}

Vec3 Shape::box_around() const {
  if (kind == ShapeKind::sphere) return Vec3::Constant(radius);
  return kind == ShapeKind::capsule ? Vec3(radius, half_extents.y() + radius, radius) : half_extents;
}

double Shape::size() const {
  switch (kind) {
    case ShapeKind::sphere:
      return 2 * radius;
    case ShapeKind::box:
    case ShapeKind::cylinder:
      return 2 * half_extents.maxCoeff();
    case ShapeKind::capsule:
      return 2 * (half_extents.y() + radius);
    case ShapeKind::hull:
      return hull->size;
    case ShapeKind::half_space:
      break;
  }
  return std::numeric_limits<double>::infinity();
}

void contact_tangents(const Vec3& normal, double angle, Vec3& t1, Vec3& t2) {
  // Below this sine of the angle between the normal and the x axis, the projection of x counts as vanished.
  constexpr double vanishing_sine = 1e-6;
  // t2 = n x t1 is parallel to n x (x axis), which has no cancellation; t1 follows from it.
  const double length_x = length(normal.y(), normal.z());
  if (length_x > vanishing_sine) {
    t2 = Vec3(0, normal.z() / length_x, -normal.y() / length_x);
  } else {
    const double length_z = length(normal.x(), normal.y());
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

void contact_tangents(const ContactPoint& contact, double turn, Vec3& t1, Vec3& t2) {
  contact_tangents(contact.normal, -turn, t1, t2);  // the normal points from b to a
}

Pose advance(const Motion& motion, double t) { return advance(motion.pose, motion.v, motion.w, t); }

}  // namespace cb
