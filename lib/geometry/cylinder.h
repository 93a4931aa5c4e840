#pragma once

// Cylinders and discs: the convex hull of two discs. What separates one from another convex shape best, and which
// points carry where they touch (not on half-spaces and spheres: contact_points.cpp).

#include <algorithm>
#include <cmath>

#include "geometry/core.h"

namespace cb {

/// A cylinder placed among others: world axes, places from an origin of the caller's, m. Its axis is R's column y.
struct PlacedCylinder {
  Vec3 c = Vec3::Zero();      ///< its middle
  Mat3 R = Mat3::Identity();  ///< columns: its axes
  double r = 0, l = 0;        ///< radius, half its length; 0: a disc, or a point

  void place(const Shape& shape, const Pose& pose, const Vec3& origin);
  Vec3 d() const { return R.col(1); }
  int ends() const { return l > 0 ? 2 : 1; }
  int end(int k) const { return k == 0 ? 1 : -1; }  ///< of its ends' number k: which way along the axis it is
  Vec3 middle(int end) const { return c + (end * l) * d(); }
  /// The part of n across the axis; by the other two axes, without cancellation.
  Vec3 across(const Vec3& n) const { return n.dot(R.col(0)) * R.col(0) + n.dot(R.col(2)) * R.col(2); }
  /// The most of n.(x - c) over its points x, m, for a unit n.
  double reach(const Vec3& n) const { return l * std::abs(n.dot(d())) + r * across(n).norm(); }
  /// Unit, across the axis, towards n; the local x axis where n is along it.
  Vec3 outward(const Vec3& n) const;
  /// The point of an end's rim that is furthest along n.
  Vec3 rim(int end, const Vec3& n) const { return middle(end) + r * outward(n); }
};

/// What a cylinder meets: a core with a radius, or another cylinder (the other pointer is null).
struct Opposite {
  const PlacedCore* core = nullptr;
  const PlacedCylinder* cylinder = nullptr;

  double radius() const { return core != nullptr ? core->radius : 0; }
  const Seams* seams() const { return core != nullptr ? core->seams() : nullptr; }
  /// The least of n.x over its points x, m; a point where it is.
  double lowest(const Vec3& n) const;
  Vec3 lowest_point(const Vec3& n) const;
};

/// The axis that separates a cylinder from another shape best.
struct CylinderAxis {
  /// A face of the core, an end of the cylinder or of the other one; or none of them is flat on the other: an edge of
  /// the core and the side of the cylinder, a line of either's side and a rim, a vertex, two rims.
  enum class Kind { face, end, end_of_other, curved };
  double gap;  ///< signed distance of the projections, m
  Kind kind = Kind::curved;
  int index = 0;  ///< the face; the end, 1 or -1
  Vec3 n;         ///< unit, from the cylinder to the other
  int edge = -1;  ///< curved: of the core, where it is one that is nearest
};
/// An earlier flat axis is kept unless a later one separates by more than `margin` (m) further; stops at the first that
/// is beyond `enough` (m). The gap is never more than the distance, and as much where they touch.
CylinderAxis separating_axis(const PlacedCylinder& c, const Opposite& x, double margin,
                             double enough = std::numeric_limits<double>::infinity());
/// The same of the axes along which a core with seams carries (core.h, carrying_axis).
CylinderAxis carrying_axis(const PlacedCylinder& c, const PlacedCore& x, double margin);

/// Is p over a face of a core, or within `slack` (m) of it?
bool over_face(const PlacedCore& core, int face, const Vec3& p, double slack);

/// What of a shape is outermost along a normal, with what is within a radius of it: a segment, or a point.
struct Outermost {
  Vec3 p, q;
  double radius;
  bool point() const { return p == q; }
};
/// Of a cylinder along n, and of what it meets towards it: a side, or an edge, is a segment if its ends are level
/// within `margin` (m). Of an end that is flat a point of its rim.
Outermost outermost(const PlacedCylinder& c, const Vec3& n, double margin);
Outermost outermost(const Opposite& x, const Vec3& n, double margin);

/// A point that two have in common where one lies on a flat face of the other.
struct FlatPoint {
  Vec3 foot;   ///< on the face
  double gap;  ///< above it, m
};
/// The points of c and x on the flat face of a `flat` axis (Kind face, end or end_of_other) whose gap is at most
/// `reach`; `closed` says which ends are flat on it (m). Of a core with seams, those that carry. Points within `slack`
/// (m) outside count as inside, and are one if they are closer.
void flat_points(const PlacedCylinder& c, const Opposite& x, const CylinderAxis& flat, double closed, double reach,
                 double slack, std::vector<FlatPoint>& points);

/// contact_points of a cylinder and what is placed with it about `origin`; sink's normals push the cylinder away.
void cylinder_points(const PlacedCylinder& c, const Opposite& x, const Vec3& origin, double closed, double reach,
                     double margin, const Sink& sink);

/// contact_points, and separation, of two shapes one of which is a cylinder, a the first such, and b no half-space.
void cylinder_points(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b, double tolerance,
                     double reach, const Sink& sink);
double cylinder_separation(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b);

}  // namespace cb
