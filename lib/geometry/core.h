#pragma once

// Convex shapes as a core and a radius: the points within `radius` of a polytope. A capsule's core is a segment, a
// sphere's a point; of boxes and hulls the radius is 0.

#include <cstdint>
#include <vector>

#include "geometry/polytope.h"
#include "geometry/shapes.h"

namespace cb {

/// Is the shape a core with a radius? Not a cylinder (cylinder.h) and not a half-space.
bool has_core(ShapeKind kind);
/// The polytope of a shape that has a core, in units of its scale.
const Polytope& core_of(const Shape& shape);
/// Radius of the sphere about the shape's origin that contains its core, m.
double core_reach(const Shape& shape);

/// A core placed among others: world axes, places from an origin of the caller's, m.
struct PlacedCore {
  const Polytope* form = nullptr;
  double radius = 0;
  Vec3 c = Vec3::Zero();       ///< the shape's origin
  Mat3 R = Mat3::Identity();   ///< columns: the shape's axes
  std::vector<Vec3> x;         ///< vertices
  std::vector<Vec3> n;         ///< outward normals of the faces
  std::vector<double> offset;  ///< of the faces: no vertex has n.x beyond it

  /// `vertex` >= 0: that vertex alone. Does not allocate after the first calls.
  void place(const Shape& shape, const Pose& pose, const Vec3& origin, int vertex = -1);
  bool solid() const { return !n.empty(); }
  const Seams* seams() const { return form->seams.get(); }
  bool inner(int face) const { return form->seams && form->seams->inner[static_cast<std::size_t>(face)] != 0; }
  int edges() const { return static_cast<int>(form->edges.size()); }
  Vec3 along(int edge) const { return x[form->edges[edge].to] - x[form->edges[edge].from]; }
};

/// Two segments where they come closest: p + s u and q + t v, 0 <= s, t <= 1.
struct SegmentPair {
  double s, t;
  Vec3 a, b;
  double distance2;
};
SegmentPair closest(const Vec3& p, const Vec3& u, const Vec3& q, const Vec3& v);

/// Where a point or a segment s comes closest to another core x.
struct NearestCore {
  double distance;  ///< m; negative: how deep they are in each other
  Vec3 n;           ///< unit, from x to s
  Vec3 on_s, on_x;
  int face = -1;     ///< of x, on which on_x is
  int edge = -1;     ///< of x, where an inner point of s is over an inner point of the edge
  int on_edge = -1;  ///< of x, on which on_x is where it is on no face: `along` of it from its beginning, 0 to 1
  double along = 0;
};
NearestCore nearest(const PlacedCore& s, const PlacedCore& x);

/// Which axis separates two solid cores best: a face of a, a face of b, or an edge of each.
struct CoreAxis {
  enum class Kind { face_a, face_b, edges };
  double gap;  ///< signed distance of the projections, m
  Kind kind = Kind::face_a;
  int a = -1, b = -1;  ///< the face, or the edges
  Vec3 n;              ///< unit, from a to b
};
/// An earlier axis is kept unless a later one separates by more than `margin` (m) further; stops at the first kind of
/// face that is beyond `enough` (m).
CoreAxis separating_axis(const PlacedCore& a, const PlacedCore& b, double margin,
                         double enough = std::numeric_limits<double>::infinity());

/// The same of the axes along which the core that has seams carries the other where they are; of its own faces' one at
/// least. Its gap is no more than separating_axis': what else keeps the two apart, a neighbour covers.
CoreAxis carrying_axis(const PlacedCore& a, const PlacedCore& b, double margin);
/// Does the surface bend down at an edge, or a vertex, so that it carries along n (unit, out of the core)?
bool edge_carries(const PlacedCore& core, int edge, const Vec3& n);
bool vertex_carries(const PlacedCore& core, int vertex, const Vec3& n);
/// Does a core with seams carry along n with what of it is outermost that way, within the margin (m)?
bool outermost_carries(const PlacedCore& core, const Vec3& n, double margin);
/// Does x, which may have seams, carry what comes nearest to it there?
bool carries(const PlacedCore& x, const NearestCore& near);

/// A corner of what two faces have in common.
struct CorePatchPoint {
  Vec3 foot;         ///< on the reference face
  double gap;        ///< above it, m
  std::uint64_t id;  ///< feature, of the kinds below
  int incident, reference;
  enum Kind { vertex_over_face, face_over_vertex, edges } kind;  ///< of the incident core first, and their numbers
};
struct CorePatch {
  bool reference_is_a = true;
  int face = 0, incident = 0;
  Vec3 n;  ///< out of the reference face
  std::vector<CorePatchPoint> point;
  bool empty() const { return point.empty(); }
};
/// The face of one clipped against the sides of the other's reference face, as box_box.h's face_patch does it: points
/// within `slack` outside count as inside, and are one if they are closer than that. Of a core with seams, what of it
/// does not carry is left out.
void face_patch(const PlacedCore& reference, const PlacedCore& other, int face, double slack, CorePatch& patch);
/// Of cores with seams, vertices of the incident face that are not over the reference face now, as points of the patch
/// that they are in once they have slid over a seam. Without seams a corner on the face's side stands for them.
void beside_patch(const PlacedCore& reference, const PlacedCore& other, const CorePatch& patch,
                  std::vector<CorePatchPoint>& beside);
/// Clips a segment from p to q against the sides of a face; false: nothing is over it.
struct ClippedEnds {
  int p = -1, q = -1;  ///< the sides of the face that the ends were clipped at; -1: they were not
};
bool clip_to_face(const PlacedCore& solid, int face, double slack, Vec3& p, Vec3& q, ClippedEnds* at = nullptr);
/// The edge along the side k of a face.
int edge_of_side(const Polytope& form, int face, int k);

/// Where contact points go, with the sign that turns a normal that pushes the first shape of a routine away from the
/// second into one that pushes a away from b.
struct Sink {
  std::vector<ContactPoint>& out;
  double sign;
  int index_a, index_b;
  void add(const Vec3& position, const Vec3& normal, double gap) const {
    out.push_back({position, sign * normal, gap, index_a, index_b});
  }
};
/// The points from `first` on are corners of a patch, that before them is where two edges cross: leaves out the lowest
/// corner where that is the crossing once more: within `margin` (m) of it, and its gap, by which at most a face that
/// nearly lies on the other sees it aside.
void leave_out_crossing(std::vector<ContactPoint>& points, std::size_t first, double margin);

/// contact_points of two shapes one of which is a capsule or a hull; and of one of these on a half-space.
void core_points(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b, double tolerance, double reach,
                 const Sink& sink);
void core_on_plane(const Shape& shape, const Pose& pose, const Vec3& normal, const Vec3& point, double tolerance,
                   const Sink& sink);
/// separation of them.
double core_separation(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b);
double core_height(const Shape& shape, const Pose& pose, const Vec3& normal, const Vec3& point);

}  // namespace cb
