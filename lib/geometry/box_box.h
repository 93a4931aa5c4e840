#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/shapes.h"

namespace cb {

/// A box placed in the world: the rotation is computed once.
struct PlacedBox {
  Vec3 c;  ///< centre, m
  Vec3 h;  ///< half extents, m
  Mat3 R;  ///< columns: the box's axes in the world
  PlacedBox(const Shape& shape, const Pose& pose) : c(pose.p), h(shape.half_extents), R(pose.q.toRotationMatrix()) {}
};

/// Which axis separates two boxes best. Face axes of a: 0..2, of b: 3..5, edge i of a across edge j of b: 6 + 3 i + j.
struct SeparatingAxis {
  double gap = -std::numeric_limits<double>::infinity();  ///< signed distance of the projections, m
  int index = 0;
  Vec3 normal_A = Vec3::Zero();  ///< unit, in the frame of a, from a to b
};

/// Pose of b in the frame of a.
struct RelativeBox {
  Mat3 C;  ///< R_a^T R_b
  Vec3 t;  ///< R_a^T (c_b - c_a), m
  RelativeBox(const PlacedBox& a, const PlacedBox& b) : C(a.R.transpose() * b.R), t(a.R.transpose() * (b.c - a.c)) {}
};

/// Best of the 15 axes. An earlier axis is kept unless a later one separates by more than `margin` (m) further, so that
/// round-off does not flip between equivalent axes. Stops at the first face axis whose gap is beyond `enough`.
SeparatingAxis separating_axis(const PlacedBox& a, const PlacedBox& b, const RelativeBox& ab, double margin,
                               double enough = std::numeric_limits<double>::infinity());

/// A corner of the common patch of two faces, in the frame of the reference box.
struct PatchPoint {
  double u, v;  ///< along the two axes of the reference face, m
  double gap;   ///< above the reference face, along its normal, m
  int id;       ///< feature: 0..3 vertex of the incident face, 4..7 vertex of the reference face, 8 + 4 e + p: edge e
                ///< of the incident face across side p of the reference face
};

/// The incident face of one box, clipped against the sides of the reference face of the other.
struct FacePatch {
  bool reference_is_a = true;
  int axis = 0;     ///< of the reference box: normal of the reference face
  double sign = 1;  ///< +1 or -1: which of the two faces
  Vec3 n;           ///< world, unit, out of the reference face
  Vec3 incident;    ///< normal of the incident face in the frame of the reference box, out of the incident box
  int incident_u = 1, incident_v = 2;  ///< axes of the incident box along edges 0, 2 and 1, 3 of its face
  int count = 0;
  PatchPoint point[20];  ///< at most 8 are in exact arithmetic; 20 if round-off made every other corner cross a side
};

/// Patch of the reference face `axis` (0..2 of a, 3..5 of b). Points within `slack` (m) outside a side count as inside,
/// and points closer than `slack` to their neighbour are merged. `side`, +1 or -1: which of the two faces; 0: the one
/// that the other box's centre is beyond, as where the axis separates.
void face_patch(const PlacedBox& a, const PlacedBox& b, const RelativeBox& ab, int axis, double slack, FacePatch& patch,
                double side = 0);

/// Where the two edges of an edge axis come closest, in the frame of a.
Vec3 edge_crossing(const PlacedBox& a, const PlacedBox& b, const RelativeBox& ab, const SeparatingAxis& axis);

/// Largest coordinate of two origins, m.
inline double largest_coordinate(const Vec3& p_a, const Vec3& p_b) {
  return std::max(p_a.cwiseAbs().maxCoeff(), p_b.cwiseAbs().maxCoeff());
}

/// The gap below which coordinates as large as these cannot tell open from closed: 4 ulp of the largest coordinate of
/// the shapes' origins. Asked tolerances are raised to it (at 1e6 m: 8.9e-10 m).
inline double resolved_tolerance(double tolerance, const Vec3& p_a, const Vec3& p_b) {
  constexpr double ulps = 4;
  return std::max(tolerance, ulps * std::numeric_limits<double>::epsilon() * largest_coordinate(p_a, p_b));
}

/// Margin of separating_axis for a pair: equivalent axes differ by less.
inline double axis_margin(double tolerance, const Vec3& h_a, const Vec3& h_b) {
  constexpr double relative = 1e-9;  // of the larger half extent
  return std::max(tolerance, relative * std::max(h_a.maxCoeff(), h_b.maxCoeff()));
}

}  // namespace cb
