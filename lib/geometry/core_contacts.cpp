// Contact points of capsules and hulls: core and radius.
//
// Problem: two convex shapes, each a core with a radius, one of them a capsule or a hull (or a sphere beside these);
// which points carry where they touch?
//   Two solid cores (hull, box): as box_box.cpp and contact_points.cpp do it for boxes: the patch that two faces share,
//   the crossing of two edges.
//   A point or a segment with a radius and another core: on a face that it lies along, the segment clipped to the face
//   has two ends; beside an edge or a segment that it is parallel to, the ends of what they have in common; else the
//   one point where they come closest. Distances are exact.
//   On a plane: each vertex of the core.
//   A core with seams (polytope.h): those of these points that it carries; where it is an inner face that the other is
//   beside, beyond the tolerance, those that come next over its other faces.
// Does not fail: whenever the gap is within the tolerance there is at least one point, but where there are seams.
#include <algorithm>
#include <cmath>
#include <tuple>

#include "geometry/box_box.h"
#include "geometry/core.h"

namespace cb {

bool has_core(ShapeKind kind) { return kind != ShapeKind::cylinder && kind != ShapeKind::half_space; }

const Polytope& core_of(const Shape& shape) {
  switch (shape.kind) {
    case ShapeKind::hull:
      return shape.hull->polytope;
    case ShapeKind::capsule:
      return shape.half_extents.y() > 0 ? unit_segment() : single_point();
    case ShapeKind::box:
      return unit_box();
    case ShapeKind::sphere:
    case ShapeKind::cylinder:
    case ShapeKind::half_space:
      break;
  }
  return single_point();
}

double core_reach(const Shape& shape) {
  if (shape.kind == ShapeKind::capsule) return shape.half_extents.y();
  return shape.kind == ShapeKind::sphere ? 0 : shape.bounding_radius();
}

void PlacedCore::place(const Shape& shape, const Pose& pose, const Vec3& origin, int vertex) {
  const Polytope& whole = core_of(shape);
  form = vertex < 0 ? &whole : &single_point();
  const bool round = shape.kind == ShapeKind::sphere || shape.kind == ShapeKind::capsule;
  radius = round ? shape.radius : 0;
  c = pose.p - origin;
  R = pose.q.toRotationMatrix();
  // Unit forms have the shape's extents.
  const bool scaled = shape.kind != ShapeKind::hull;
  const auto at = [&](int i) -> Vec3 {
    const Vec3& v = whole.vertices[i];
    return c + R * (scaled ? Vec3(v.cwiseProduct(shape.half_extents)) : v);
  };
  x.clear();
  n.clear();
  offset.clear();
  if (vertex >= 0) {
    x.push_back(at(vertex));
    return;
  }
  for (int i = 0; i < static_cast<int>(whole.vertices.size()); ++i) x.push_back(at(i));
  for (const Polytope::Face& face : whole.faces) {
    n.push_back(R * face.normal);
    offset.push_back(n.back().dot(c) + (scaled ? face.normal.cwiseAbs().dot(shape.half_extents) : face.offset));
  }
}

void leave_out_crossing(std::vector<ContactPoint>& points, std::size_t first, double margin) {
  const auto lowest = std::min_element(points.begin() + static_cast<std::ptrdiff_t>(first), points.end(),
                                       [](const ContactPoint& p, const ContactPoint& q) { return p.gap < q.gap; });
  if (lowest == points.end()) return;
  const ContactPoint& crossing = points[first - 1];
  if ((lowest->position - crossing.position).norm() <= margin + std::abs(crossing.gap)) points.erase(lowest);
}

namespace {

/// Two cores, placed about the first one's origin.
struct Placed {
  PlacedCore a, b;
  Vec3 origin;
};
Placed& place(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b) {
  thread_local Placed placed;  // does not allocate after its first calls
  placed.origin = pose_a.p;
  placed.a.place(a, pose_a, placed.origin);
  placed.b.place(b, pose_b, placed.origin);
  return placed;
}

/// Of two cores one of which is a point or a segment: is it a?
bool a_is_thin(const PlacedCore& a, const PlacedCore& b) { return a.x.size() <= 2 && a.x.size() <= b.x.size(); }

constexpr double nearly = 0.99;  // cosine: of faces that nearly lie on each other, of edges that are nearly parallel

/// A point or segment s with a radius on the core x; the normal pushes s away.
struct ThinOnCore {
  const PlacedCore &s, &x;
  const Vec3& origin;
  double radius, closed, reach, margin;
  const Sink& sink;

  void add(const Vec3& on_x, const Vec3& n, double gap) const {
    sink.add(origin + on_x + (x.radius + gap / 2) * n, n, gap);
  }
  bool along_face(const NearestCore& near) const;
  bool along_edges(const NearestCore& near) const;
  bool at_seam(int face, int side) const;
  void next_on_faces() const;
  void points() const;
};

// Is a point on this side of the face (-1: on none) none of what carries, since the surface goes on there?
bool ThinOnCore::at_seam(int face, int side) const {
  return side >= 0 && x.seams() != nullptr && !edge_carries(x, edge_of_side(*x.form, face, side), x.n[face]);
}

// The ends of the part of s that is over the face which looks most along the normal, at the heights above it. `near`
// may be beside the face by less than the margin, or for points to come nearly on it.
bool ThinOnCore::along_face(const NearestCore& near) const {
  if (!x.solid() || s.x.size() < 2) return false;
  int face = 0;
  for (int f = 1; f < static_cast<int>(x.n.size()); ++f)
    if (x.n[f].dot(near.n) > x.n[face].dot(near.n)) face = f;
  const Vec3& n = x.n[face];
  if (n.dot(near.n) < nearly || x.inner(face)) return false;
  Vec3 p = s.x[0], q = s.x[1];
  ClippedEnds clipped;
  if (!clip_to_face(x, face, margin, p, q, &clipped)) return false;
  const double h_p = n.dot(p) - x.offset[face], h_q = n.dot(q) - x.offset[face], lowest = std::min(h_p, h_q);
  const bool on_face = lowest >= near.distance - margin;
  if (lowest > near.distance + margin) return false;  // it is deepest beside the face
  if (!on_face && reach <= closed) return false;
  const double gap = near.distance - radius;
  if (!on_face && carries(x, near)) add(near.on_x, near.n, gap);
  int ends = 0;
  bool beside = false;
  for (const auto& [at, h, side] : {std::tuple(p, h_p, clipped.p), std::tuple(q, h_q, clipped.q)}) {
    const double gap_here = on_face ? h - radius : gap + (h - lowest);
    if (at_seam(face, side)) {
      beside = true;
      continue;
    }
    if (gap_here > reach || (ends > 0 && (q - p).norm() <= margin)) continue;
    if (!on_face && (at - near.on_s).norm() <= margin) continue;
    add(at - h * n, n, gap_here);
    ++ends;
  }
  return ends > 0 || !on_face || beside;
}

// The ends of what s and an edge, or another segment, have in common side by side.
bool ThinOnCore::along_edges(const NearestCore& near) const {
  if (s.x.size() < 2) return false;
  const Vec3 u = s.x[1] - s.x[0];
  const double length2 = u.squaredNorm(), limit = near.distance + (closed > reach ? closed : reach);
  bool listed = false;  // ends may be beyond reach where what is between them is not
  for (int e = 0; e < x.edges(); ++e) {
    const Vec3 &q = x.x[x.form->edges[e].from], v = x.along(e);
    if (!edge_carries(x, e, near.n)) continue;
    if (std::abs(u.dot(v)) < nearly * std::sqrt(length2 * v.squaredNorm())) continue;
    const SegmentPair pair = closest(s.x[0], u, q, v);
    if (std::sqrt(pair.distance2) > limit) continue;
    const double s_q = (q - s.x[0]).dot(u) / length2, s_end = s_q + v.dot(u) / length2;
    const double low = std::clamp(std::min(s_q, s_end), 0.0, 1.0), high = std::clamp(std::max(s_q, s_end), 0.0, 1.0);
    if ((high - low) * std::sqrt(length2) <= margin) continue;
    double gap[2];
    Vec3 foot[2], n[2];
    bool touch = true;
    for (int k = 0; k < 2; ++k) {
      const Vec3 at = s.x[0] + (k == 0 ? low : high) * u;
      foot[k] = q + std::clamp((at - q).dot(v) / v.squaredNorm(), 0.0, 1.0) * v;
      const double distance = (at - foot[k]).norm();
      if (distance == 0) return false;
      n[k] = (at - foot[k]) / distance;
      gap[k] = distance - radius;
      touch = touch && gap[k] <= near.distance - radius + closed;
    }
    if (!touch && reach <= closed) continue;
    if (!touch && !listed) {
      add(near.on_x, near.n, near.distance - radius);
      listed = true;
    }
    for (int k = 0; k < 2; ++k) {
      if (gap[k] > reach || (!touch && (foot[k] - near.on_x).norm() <= margin)) continue;
      add(foot[k], n[k], gap[k]);
      listed = true;
    }
  }
  return listed;
}

// What is nearest is a neighbour's: the ends of s over the faces of this one.
void ThinOnCore::next_on_faces() const {
  for (int face = 0; face < static_cast<int>(x.n.size()); ++face) {
    if (x.inner(face)) continue;
    Vec3 p = s.x.front(), q = s.x.back();
    ClippedEnds clipped;
    if (!clip_to_face(x, face, margin, p, q, &clipped)) continue;
    for (const auto& [at, side] : {std::pair(p, clipped.p), std::pair(q, clipped.q)}) {
      const double height = x.n[face].dot(at) - x.offset[face], gap = height - radius;
      if (gap > closed && gap <= reach && !at_seam(face, side)) add(at - height * x.n[face], x.n[face], gap);
    }
  }
}

void ThinOnCore::points() const {
  const NearestCore near = nearest(s, x);
  const double gap = near.distance - radius;
  if (gap > reach) return;
  if (along_face(near)) return;
  if (!carries(x, near)) {
    if (reach > closed && s.x.size() > 1) next_on_faces();
    return;
  }
  if (near.distance > 0 && along_edges(near)) return;
  add(near.on_x, near.n, gap);
}

/// The points of a patch that are at most `tolerance` above the reference face, and more than `least`.
int add_patch(const CorePatch& patch, const Vec3& origin, double tolerance, const Sink& sink,
              double least = -HUGE_VAL) {
  const Vec3 normal = patch.reference_is_a ? Vec3(-patch.n) : patch.n;
  int added = 0;
  for (const CorePatchPoint& point : patch.point) {
    if (point.gap > tolerance || point.gap <= least) continue;
    sink.add(origin + point.foot + (point.gap / 2) * patch.n, normal, point.gap);
    ++added;
  }
  return added;
}

CorePatch& patch_of(const PlacedCore& a, const PlacedCore& b, bool reference_is_a, int face, double margin) {
  thread_local CorePatch patch;  // does not allocate after its first calls
  patch.reference_is_a = reference_is_a;
  face_patch(reference_is_a ? a : b, reference_is_a ? b : a, face, margin, patch);
  return patch;
}

// As contact_points.cpp's of boxes: the corners that come next where edges cross and a face nearly lies on another.
void add_next_corners(const PlacedCore& a, const PlacedCore& b, const CoreAxis& axis, double margin, double reach,
                      const Vec3& origin, const Sink& sink) {
  int i = 0, j = 0;
  for (int f = 1; f < static_cast<int>(a.n.size()); ++f)
    if (a.n[f].dot(axis.n) > a.n[i].dot(axis.n)) i = f;
  for (int f = 1; f < static_cast<int>(b.n.size()); ++f)
    if (b.n[f].dot(axis.n) < b.n[j].dot(axis.n)) j = f;
  const double cosine_a = a.n[i].dot(axis.n), cosine_b = -b.n[j].dot(axis.n);
  if (std::max(cosine_a, cosine_b) < nearly) return;
  CorePatch& patch = patch_of(a, b, cosine_a >= cosine_b, cosine_a >= cosine_b ? i : j, margin);
  double lowest = HUGE_VAL;
  for (const CorePatchPoint& point : patch.point) lowest = std::min(lowest, point.gap);
  for (CorePatchPoint& point : patch.point) point.gap += axis.gap - lowest;
  const std::size_t first = sink.out.size();
  add_patch(patch, origin, reach, sink);
  leave_out_crossing(sink.out, first, margin);
}

// As contact_points.cpp's of boxes: the vertex that reaches furthest along `direction`; of several, the one next to
// `other`.
Vec3 nearest_vertex(const PlacedCore& core, const Vec3& direction, const Vec3& other) {
  constexpr double level = 1e-6;  // of the core's size
  double furthest = -HUGE_VAL, size = 0;
  for (const Vec3& x : core.x) {
    furthest = std::max(furthest, direction.dot(x));
    size = std::max(size, (x - core.x[0]).norm());
  }
  const Vec3* vertex = nullptr;
  for (const Vec3& x : core.x) {
    if (direction.dot(x) < furthest - level * size) continue;
    if (vertex == nullptr || (x - other).squaredNorm() < (*vertex - other).squaredNorm()) vertex = &x;
  }
  return *vertex;
}

void solid_on_solid(const Placed& placed, double closed, double reach, double margin, const Sink& sink) {
  const auto& [a, b, origin] = placed;
  CoreAxis axis = separating_axis(a, b, margin, reach);
  if (axis.gap > reach) return;
  const bool seams = a.seams() != nullptr || b.seams() != nullptr;
  if (seams) {
    const double apart = axis.gap;
    axis = carrying_axis(a, b, margin);
    if (apart > closed && axis.gap < apart - margin) {  // a neighbour is in between
      const bool of_a = a.seams() != nullptr;
      if (reach > closed && axis.kind == (of_a ? CoreAxis::Kind::face_a : CoreAxis::Kind::face_b))
        add_patch(patch_of(a, b, of_a, of_a ? axis.a : axis.b, margin), origin, reach, sink, closed);
      return;
    }
  }
  const Vec3 normal = -axis.n;
  if (axis.kind == CoreAxis::Kind::edges) {
    const SegmentPair pair =
        closest(a.x[a.form->edges[axis.a].from], a.along(axis.a), b.x[b.form->edges[axis.b].from], b.along(axis.b));
    sink.add(origin + 0.5 * (pair.a + pair.b), normal, axis.gap);
    if (reach > closed) add_next_corners(a, b, axis, margin, reach, origin, sink);
    return;
  }
  const bool of_a = axis.kind == CoreAxis::Kind::face_a;
  if (add_patch(patch_of(a, b, of_a, of_a ? axis.a : axis.b, margin), origin, reach, sink) > 0) return;
  if (seams) return;  // a neighbour carries
  // As contact_points.cpp's of boxes, where faces miss each other (corner past corner).
  if (axis.gap > closed) return;
  const Vec3 vertex = of_a ? nearest_vertex(b, normal, a.c) : nearest_vertex(a, -normal, b.c);
  sink.add(origin + vertex + (of_a ? 0.5 : -0.5) * axis.gap * normal, normal, axis.gap);
}

}  // namespace

void core_points(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b, double tolerance, double reach,
                 const Sink& sink) {
  const double furthest = a.bounding_radius() + b.bounding_radius() + reach;
  if ((pose_b.p - pose_a.p).squaredNorm() > furthest * furthest) return;
  const Placed& placed = place(a, pose_a, b, pose_b);
  const double margin = axis_margin(tolerance, a.half_extents, b.half_extents);
  const double radius = placed.a.radius + placed.b.radius;
  if (placed.a.x.size() > 2 && placed.b.x.size() > 2)
    solid_on_solid(placed, tolerance, reach, margin, sink);
  else if (a_is_thin(placed.a, placed.b))
    ThinOnCore{placed.a, placed.b, placed.origin, radius, tolerance, reach, margin, sink}.points();
  else
    ThinOnCore{placed.b,  placed.a, placed.origin, radius,
               tolerance, reach,    margin,        {sink.out, -sink.sign, sink.index_a, sink.index_b}}
        .points();
}

double core_separation(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b) {
  const Placed& placed = place(a, pose_a, b, pose_b);
  if (placed.a.x.size() > 2 && placed.b.x.size() > 2) return separating_axis(placed.a, placed.b, 0).gap;
  const bool thin_a = a_is_thin(placed.a, placed.b);
  const NearestCore near = thin_a ? nearest(placed.a, placed.b) : nearest(placed.b, placed.a);
  return near.distance - placed.a.radius - placed.b.radius;
}

void core_on_plane(const Shape& shape, const Pose& pose, const Vec3& normal, const Vec3& point, double tolerance,
                   const Sink& sink) {
  thread_local PlacedCore core;  // does not allocate after its first calls
  core.place(shape, pose, pose.p);
  const double centre = normal.dot(pose.p - point) - core.radius;
  for (const Vec3& x : core.x) {
    const double gap = centre + normal.dot(x);
    if (gap <= tolerance) sink.add(pose.p + (x - (core.radius + gap / 2) * normal), normal, gap);
  }
}

double core_height(const Shape& shape, const Pose& pose, const Vec3& normal, const Vec3& point) {
  const double centre = normal.dot(pose.p - point);
  const Vec3 n = pose.q.conjugate() * normal;
  if (shape.kind == ShapeKind::capsule) return centre - shape.half_extents.y() * std::abs(n.y()) - shape.radius;
  double lowest = HUGE_VAL;
  for (const Vec3& x : shape.hull->polytope.vertices) lowest = std::min(lowest, n.dot(x));
  return centre + lowest;
}

}  // namespace cb
