#pragma once

#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "dynamics/model.h"
#include "geometry/polytope.h"

namespace cb {

enum class ShapeKind { sphere, box, cylinder, capsule, hull, half_space };
/// The name of its element in a scene.
std::string_view name(ShapeKind kind);

/// A shape rigidly attached to a body, or to the world (body = -1).
struct Shape {
  ShapeKind kind = ShapeKind::sphere;
  int body = -1;      ///< index into Model::bodies, -1: fixed to the world
  Pose local;         ///< pose of the shape in the body's frame (in the world where fixed)
  double radius = 0;  ///< sphere, cylinder, capsule, m
  /// box, m; cylinder, capsule: (radius, half its length, radius); hull: of the box about its origin.
  Vec3 half_extents = Vec3::Zero();
  int contact_grid = 2;  ///< box: contact points along an edge of a face, evenly spaced; against half-spaces
  // cylinder: along the local y axis. Length 0 is a disc, which touches a plane with one point of its rim.
  // capsule: the points within `radius` of a segment along the local y axis. Length 0 is a sphere.
  std::shared_ptr<const Hull> hull;  ///< hull: in its own frame; shared by all shapes that are alike
  // half_space: the solid is { x : n.(x - p) <= 0 } with n = local.q * y axis, p = local.p. Always fixed.
  std::string name;

  /// Radius of the sphere about the shape's origin that contains it (infinite for a half-space), m.
  double bounding_radius() const;
  /// Half extents of a box about its origin, with its axes, that contains it (not of a half-space), m.
  Vec3 box_around() const;
  /// Length that tolerances are a fraction of: the largest extent, m (infinite for a half-space).
  double size() const;
};

/// Length of (x, y), both lengths or cosines: without std::hypot's care for what overflows, at a tenth of its time.
inline double length(double x, double y) { return std::sqrt(x * x + y * y); }

/// One point of contact. `normal` points from shape b to shape a: a positive normal impulse pushes a along +normal.
/// This is the only place where the direction of the normal is fixed.
struct ContactPoint {
  Vec3 position;  ///< world, midway between the two surfaces, m
  Vec3 normal;    ///< unit
  double gap;     ///< distance of the surfaces along the normal, m; negative: penetration
  int shape_a, shape_b;
};

/// Tangents of a contact plane: t1 is the world x axis projected on the plane (the world z axis where that vanishes),
/// turned about the normal by `angle` rad; t2 = normal x t1.
void contact_tangents(const Vec3& normal, double angle, Vec3& t1, Vec3& t2);
/// Those of a contact's rows: turned about the direction from a to b, away from the shape that is listed first.
void contact_tangents(const ContactPoint& contact, double turn, Vec3& t1, Vec3& t2);

/// Appends the contact points of two shapes whose gap is at most `tolerance` (m): one for a sphere, the corners of the
/// common patch for touching faces (a unit box on a unit box gives its four corner points), one for an edge across an
/// edge; of a cylinder on a plane the lowest point of each of its ends (two on its side, one of a disc), and standing
/// on an end four points of its rim; on a face of another shape those of them that are over it, and corners of what its
/// ends and sides have in common with it; of a capsule the nearest point, or the ends of what lies along a face, an
/// edge or another capsule; of a hull what a box has, for its polygons. Exact for faces that touch. Order and content
/// depend on the arguments only. Here and below a tolerance counts as at least 4 ulp of the largest coordinate of the
/// two origins (8.9e-10 m at 1e6 m): closer is not resolved. Poses are of the *shapes* in the world. `corners_only`: of
/// a box's grid of points, where what touches is a whole face, an edge or a corner of it, the corners of the hull
/// alone. Returns how many points were left out so. `reach`, m: points whose gap is at most this are listed too, where
/// it is more than the tolerance; which faces count as equal, and which ends of a cylinder as flat, is still the
/// tolerance's to say.
int contact_points(const Shape& a, const Pose& pose_a, int index_a, const Shape& b, const Pose& pose_b, int index_b,
                   double tolerance, std::vector<ContactPoint>& out, bool corners_only = false, double reach = 0);

/// A lower bound on the distance of two shapes that is exact where they touch, m; negative: penetration depth.
/// Overlaps of a cylinder as deep as the shapes are large may have a smaller way out than it says.
double separation(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b);

/// A shape in steady motion: its pose now, velocity of the shape's origin and angular velocity (world).
struct Motion {
  Pose pose;
  Vec3 v = Vec3::Zero();
  Vec3 w = Vec3::Zero();
};
/// Of the shape's point that is at `position`, m/s.
inline Vec3 velocity_at(const Motion& motion, const Vec3& position) {
  return motion.v + motion.w.cross(position - motion.pose.p);
}
/// The pose after t seconds: translation with v, rotation by the exponential map of w t.
Pose advance(const Motion& motion, double t);

/// First time in [0, horizon] at which a feature (corner, face, edge, surface) of the pair that is open now (gap beyond
/// `tolerance`) comes to a gap between 0 and `tolerance`; returns `horizon` where none does. Conservative: on the way
/// there no open feature of the pair penetrates by more than `tolerance`. Features that are closed now are left aside,
/// so that a box resting on one edge still finds the other edge, a capsule on one end the other, and a cylinder on its
/// rim the rest of it; of two shapes that touch, neither a plane, whatever else arrives is found once they are deeper
/// than the arcs of what touches can make them. Never loops: gives up after a stated number of advancements and returns
/// the safe time reached.
double time_of_contact(const Shape& a, const Motion& motion_a, const Shape& b, const Motion& motion_b, double tolerance,
                       double horizon);

}  // namespace cb
