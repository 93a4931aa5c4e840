// Contact points of two shapes and the distance between them.
//
// Problem: shapes a and b with their poses (m). Which points of the two surfaces are at most `tolerance` apart?
// A point per touching feature: corners of a box on a half-space (in the order of their signs, x fastest), corners of
// the patch that two faces share (in order around the incident face), the crossing of two edges, the nearest point of a
// sphere. A cylinder on a plane: the lowest point of each end's rim; of an end whose whole rim touches, the four points
// on the end's local x and z axes in their place (+x, +z, -x, -z), which stay with the body as a box's corners do; of
// an end that is nearly flat, the points a quarter turn from its lowest one where they touch. A standing cylinder is so
// carried by a square within its rim, and tips where the square's sides do. Capsules and hulls: core_contacts.cpp;
// cylinders on anything but planes and spheres: cylinder_contacts.cpp. Reference face of two boxes: the face axis
// with the largest gap; of axes within the margin (1e-9 of the size, at least the tolerance) the first of a's faces,
// then b's, then edge pairs. Tolerances are raised to 4 ulp of the largest coordinate (resolved_tolerance). Does not
// fail: whenever the gap of the best axis is within the tolerance there is at least one point.
#include <cmath>

#include "geometry/box_box.h"
#include "geometry/core.h"
#include "geometry/cylinder.h"
#include "geometry/shapes.h"

namespace cb {

namespace {

Vec3 plane_normal(const Pose& pose) {
  // Column y of the rotation matrix: R(q) (0, 1, 0).
  const Quat& q = pose.q;
  return {2 * (q.x() * q.y() - q.w() * q.z()), 1 - 2 * (q.x() * q.x() + q.z() * q.z()),
          2 * (q.y() * q.z() + q.w() * q.x())};
}

// The points of the surface lattice of a box with `grid` points along each edge that are within `tolerance` of a plane,
// in the order of the corners: x fastest. Points inside the box are none of the lattice.
void add_grid(int grid, double centre, const double (&gap_of)[3], const Vec3 (&axis)[3], const Vec3& p, const Vec3& n,
              double tolerance, const Sink& sink) {
  const int last = grid - 1;
  const auto at = [last](int i) { return (2.0 * i - last) / last; };
  for (int k = 0; k < grid; ++k)
    for (int j = 0; j < grid; ++j) {
      const bool inner = k > 0 && k < last && j > 0 && j < last;
      for (int i = 0; i < grid; i += inner ? last : 1) {
        const double gap = centre + (at(i) * gap_of[0] + at(j) * gap_of[1] + at(k) * gap_of[2]);
        if (gap > tolerance) continue;
        sink.add(p + (at(i) * axis[0] + at(j) * axis[1] + at(k) * axis[2]) - (gap / 2) * n, n, gap);
      }
    }
}

// The points of the grid that touch, if their hull has corners of the box only: those of a face, of an edge, or one.
// Else 0. `lowest` is the smallest gap of a corner, g half the difference of gaps along each edge.
int whole_patch(int grid, double lowest, const double (&g)[3], double tolerance) {
  int points = 1;
  double highest = lowest;
  for (const double half : g) {
    const double step = 2 * std::abs(half) / (grid - 1);
    if (lowest + step > tolerance) continue;  // nothing beyond the end of this edge
    highest += 2 * std::abs(half);
    points *= grid;
  }
  return highest <= tolerance && points <= grid * grid ? points : 0;
}

// Returns how many points of the box's grid were left out.
int box_on_plane(const Shape& box, const Pose& pose, const Pose& plane, double tolerance, bool corners_only,
                 const Sink& sink) {
  const Vec3 n = plane_normal(plane);
  const Mat3 R = pose.q.toRotationMatrix();
  const Vec3& h = box.half_extents;
  const double centre = n.dot(pose.p - plane.p);
  const double gx = h.x() * n.dot(R.col(0)), gy = h.y() * n.dot(R.col(1)), gz = h.z() * n.dot(R.col(2));
  const double lowest = centre - std::abs(gx) - std::abs(gy) - std::abs(gz);
  if (lowest > tolerance) return 0;
  const Vec3 x = h.x() * R.col(0), y = h.y() * R.col(1), z = h.z() * R.col(2);
  const int patch =
      corners_only && box.contact_grid > 2 ? whole_patch(box.contact_grid, lowest, {gx, gy, gz}, tolerance) : 0;
  if (box.contact_grid > 2 && patch == 0) {
    add_grid(box.contact_grid, centre, {gx, gy, gz}, {x, y, z}, pose.p, n, tolerance, sink);
    return 0;
  }
  int corners = 0;
  for (int k = 0; k < 8; ++k) {
    const double sx = k & 1 ? 1 : -1, sy = k & 2 ? 1 : -1, sz = k & 4 ? 1 : -1;
    const double gap = centre + (sx * gx + sy * gy + sz * gz);
    if (gap > tolerance) continue;
    sink.add(pose.p + (sx * x + sy * y + sz * z) - (gap / 2) * n, n, gap);
    ++corners;
  }
  return patch > 0 ? patch - corners : 0;
}

void cylinder_on_plane(const Shape& cylinder, const Pose& pose, const Pose& plane, double tolerance, double reach,
                       const Sink& sink) {
  const Vec3 n = plane_normal(plane);
  const Mat3 R = pose.q.toRotationMatrix();
  const double r = cylinder.radius, l = cylinder.half_extents.y();
  const double centre = n.dot(pose.p - plane.p), c = n.dot(R.col(1));
  // Up the slope of the ends' planes: u, with sine of its angle to the plane.
  const double sine_x = n.dot(R.col(0)), sine_z = n.dot(R.col(2)), sine = length(sine_x, sine_z);
  if (centre - l * std::abs(c) - r * sine > reach) return;
  const auto add = [&](const Vec3& x, double gap) { sink.add(pose.p + x - (gap / 2) * n, n, gap); };
  for (int end = l > 0 ? -1 : 1; end <= 1; end += 2) {
    const Vec3 middle = end * l * R.col(1);
    const double height = centre + end * l * c, lowest = height - r * sine;
    if (lowest > reach) continue;
    const bool whole = height + r * sine <= reach;
    if (whole && r * sine <= tolerance) {
      for (int k = 0; k < 4; ++k) {
        const double sign = k < 2 ? r : -r;
        add(middle + sign * R.col(k % 2 == 0 ? 0 : 2), height + sign * (k % 2 == 0 ? sine_x : sine_z));
      }
      continue;
    }
    const Vec3 u = (sine_x / sine) * R.col(0) + (sine_z / sine) * R.col(2);
    add(middle - r * u, lowest);
    if (height > reach) continue;
    const Vec3 across = R.col(1).cross(u);
    add(middle - r * across, height);
    add(middle + r * across, height);
    // Sunk in askew: its rim is no square, the lowest point must count.
    if (whole) add(middle + r * u, height + r * sine);
  }
}

// Nearest point of a box to a sphere: unit normal out of the box, gap of the surfaces, point on the box.
struct Nearest {
  Vec3 normal, point;
  double gap;
};
Nearest nearest_on_box(const Shape& box, const Pose& pose, const Vec3& centre, double radius) {
  const Mat3 R = pose.q.toRotationMatrix();
  const Vec3& h = box.half_extents;
  const Vec3 p = R.transpose() * (centre - pose.p);
  const Vec3 q = p.cwiseMax(-h).cwiseMin(h);
  const Vec3 d = p - q;
  const double distance2 = d.squaredNorm();
  if (distance2 > 0) {
    const double distance = std::sqrt(distance2);
    return {R * (d / distance), pose.p + R * q, distance - radius};
  }
  // The centre is inside: out through the nearest face, the first of equals.
  const double margin = axis_margin(0, h, h);
  const Vec3 depth = h - p.cwiseAbs();
  int axis = 0;
  for (int i = 1; i < 3; ++i)
    if (depth[i] < depth[axis] - margin) axis = i;
  const double sign = p[axis] < 0 ? -1 : 1;
  Vec3 surface = p;
  surface[axis] = sign * h[axis];
  return {sign * R.col(axis), pose.p + R * surface, -depth[axis] - radius};
}

void sphere_on_box(const Shape& sphere, const Pose& pose, const Shape& box, const Pose& pose_box, double tolerance,
                   const Sink& sink) {
  const Nearest nearest = nearest_on_box(box, pose_box, pose.p, sphere.radius);
  if (nearest.gap > tolerance) return;
  sink.add(nearest.point + (nearest.gap / 2) * nearest.normal, nearest.normal, nearest.gap);
}

// The same of a cylinder.
Nearest nearest_on_cylinder(const Shape& cylinder, const Pose& pose, const Vec3& centre, double radius) {
  const Mat3 R = pose.q.toRotationMatrix();
  const double r = cylinder.radius, l = cylinder.half_extents.y();
  const Vec3 p = R.transpose() * (centre - pose.p);
  const double across = length(p.x(), p.z());
  // On the axis there is no direction of its own: the local x axis.
  const Vec3 outward = across > 0 ? Vec3(p.x() / across, 0, p.z() / across) : Vec3(1, 0, 0);
  const Vec3 q = std::min(across, r) * outward + Vec3(0, std::clamp(p.y(), -l, l), 0);
  // Outside beyond the side, an end or the rim; without cancellation in the part that vanishes.
  const double beyond_side = std::max(0.0, across - r), beyond_end = std::max(0.0, std::abs(p.y()) - l);
  const double sign = p.y() < 0 ? -1 : 1;
  if (beyond_side > 0 || beyond_end > 0) {
    const double distance = length(beyond_side, beyond_end);
    const Vec3 normal = (beyond_side / distance) * outward + Vec3(0, sign * beyond_end / distance, 0);
    return {R * normal, pose.p + R * q, distance - radius};
  }
  const double margin = axis_margin(0, cylinder.half_extents, cylinder.half_extents);
  const double depth_side = r - across, depth_end = l - std::abs(p.y());
  if (depth_end <= depth_side + margin)
    return {sign * R.col(1), pose.p + R * Vec3(p.x(), sign * l, p.z()), -depth_end - radius};
  return {R * outward, pose.p + R * (r * outward + Vec3(0, p.y(), 0)), -depth_side - radius};
}

void sphere_on_cylinder(const Shape& sphere, const Pose& pose, const Shape& cylinder, const Pose& pose_cylinder,
                        double tolerance, const Sink& sink) {
  const Nearest nearest = nearest_on_cylinder(cylinder, pose_cylinder, pose.p, sphere.radius);
  if (nearest.gap > tolerance) return;
  sink.add(nearest.point + (nearest.gap / 2) * nearest.normal, nearest.normal, nearest.gap);
}

void sphere_on_plane(const Shape& sphere, const Pose& pose, const Pose& plane, double tolerance, const Sink& sink) {
  const Vec3 n = plane_normal(plane);
  const double gap = n.dot(pose.p - plane.p) - sphere.radius;
  if (gap > tolerance) return;
  sink.add(pose.p - (sphere.radius + gap / 2) * n, n, gap);
}

void sphere_on_sphere(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b, double tolerance,
                      const Sink& sink) {
  const Vec3 d = pose_a.p - pose_b.p;
  const double distance = d.norm(), gap = distance - a.radius - b.radius;
  if (gap > tolerance) return;
  // Concentric spheres have no direction of their own: up.
  const Vec3 n = distance > 0 ? Vec3(d / distance) : Vec3(0, 1, 0);
  sink.add(pose_b.p + (b.radius + gap / 2) * n, n, gap);
}

// The points of a patch that are at most `tolerance` above the reference face.
int add_patch(const PlacedBox& a, const PlacedBox& b, const FacePatch& patch, double tolerance, const Sink& sink) {
  const PlacedBox& reference = patch.reference_is_a ? a : b;
  const Vec3 normal = patch.reference_is_a ? Vec3(-patch.n) : patch.n;
  const int i = patch.axis;
  const Vec3 u = reference.R.col((i + 1) % 3), v = reference.R.col((i + 2) % 3);
  int added = 0;
  for (int k = 0; k < patch.count; ++k) {
    const PatchPoint& point = patch.point[k];
    if (point.gap > tolerance) continue;
    sink.add(reference.c + (point.u * u + point.v * v + (reference.h[i] + point.gap / 2) * patch.n), normal, point.gap);
    ++added;
  }
  return added;
}

// Two edges that cross while a face of each nearly lies on the other: the face's corners that come next, at the heights
// that they have above the crossing.
void add_next_corners(const PlacedBox& a, const PlacedBox& b, const RelativeBox& ab, const SeparatingAxis& axis,
                      double margin, double reach, const Sink& sink) {
  constexpr double nearly = 0.99;  // cosine
  const Vec3 &normal_A = axis.normal_A, normal_B = ab.C.transpose() * normal_A;
  int i = 0, j = 0;
  const double cosine_a = normal_A.cwiseAbs().maxCoeff(&i), cosine_b = normal_B.cwiseAbs().maxCoeff(&j);
  if (std::max(cosine_a, cosine_b) < nearly) return;
  FacePatch patch;
  // The other box's centre may be on the far side of the face.
  if (cosine_a >= cosine_b)
    face_patch(a, b, ab, i, margin, patch, normal_A[i] < 0 ? -1 : 1);
  else
    face_patch(a, b, ab, 3 + j, margin, patch, normal_B[j] > 0 ? -1 : 1);
  double lowest = HUGE_VAL;
  for (int k = 0; k < patch.count; ++k) lowest = std::min(lowest, patch.point[k].gap);
  for (int k = 0; k < patch.count; ++k) patch.point[k].gap += axis.gap - lowest;
  const std::size_t first = sink.out.size();
  add_patch(a, b, patch, reach, sink);
  leave_out_crossing(sink.out, first, margin);
}

/// The vertex that reaches furthest along `direction`; where an edge or a face does, its vertex next to `other`.
Vec3 nearest_vertex(const PlacedBox& box, const Vec3& direction, const Vec3& other) {
  constexpr double level = 1e-6;  // cosine
  Vec3 vertex = box.c;
  for (int k = 0; k < 3; ++k) {
    const Vec3 edge = box.R.col(k);
    const double along = direction.dot(edge);
    vertex += ((std::abs(along) > level ? along : (other - box.c).dot(edge)) > 0 ? box.h[k] : -box.h[k]) * edge;
  }
  return vertex;
}

void box_on_box(const Shape& shape_a, const Pose& pose_a, const Shape& shape_b, const Pose& pose_b, double tolerance,
                double reach, const Sink& sink) {
  const double furthest = shape_a.half_extents.norm() + shape_b.half_extents.norm() + reach;
  if ((pose_b.p - pose_a.p).squaredNorm() > furthest * furthest) return;
  const PlacedBox a(shape_a, pose_a), b(shape_b, pose_b);
  const RelativeBox ab(a, b);
  const double margin = axis_margin(tolerance, a.h, b.h);
  const SeparatingAxis axis = separating_axis(a, b, ab, margin, reach);
  if (axis.gap > reach) return;

  const Vec3 normal = -(a.R * axis.normal_A);
  if (axis.index < 6) {
    FacePatch patch;
    face_patch(a, b, ab, axis.index, margin, patch);
    if (add_patch(a, b, patch, reach, sink) > 0) return;
    // Faces that miss each other (corner past corner): the vertex that reaches furthest to the face. Corners that are
    // further apart may pass.
    if (axis.gap > tolerance) return;
    const bool face_of_a = axis.index < 3;
    const Vec3 vertex = face_of_a ? nearest_vertex(b, normal, a.c) : nearest_vertex(a, -normal, b.c);
    sink.add(vertex + (face_of_a ? 0.5 : -0.5) * axis.gap * normal, normal, axis.gap);
    return;
  }
  sink.add(a.c + a.R * edge_crossing(a, b, ab, axis), normal, axis.gap);
  if (reach > tolerance) add_next_corners(a, b, ab, axis, margin, reach, sink);
}

}  // namespace

int contact_points(const Shape& a, const Pose& pose_a, int index_a, const Shape& b, const Pose& pose_b, int index_b,
                   double tolerance, std::vector<ContactPoint>& out, bool corners_only, double reach) {
  const double closed = resolved_tolerance(tolerance, pose_a.p, pose_b.p), tol = std::max(closed, reach);
  const Sink straight{out, 1, index_a, index_b}, turned{out, -1, index_a, index_b};
  switch (a.kind) {
    case ShapeKind::box:
      if (b.kind == ShapeKind::half_space) return box_on_plane(a, pose_a, pose_b, tol, corners_only, straight);
      if (b.kind == ShapeKind::box)
        box_on_box(a, pose_a, b, pose_b, closed, tol, straight);
      else if (b.kind == ShapeKind::sphere)
        sphere_on_box(b, pose_b, a, pose_a, tol, turned);
      else if (b.kind == ShapeKind::cylinder)
        cylinder_points(b, pose_b, a, pose_a, closed, tol, turned);
      else
        core_points(a, pose_a, b, pose_b, closed, tol, straight);
      break;
    case ShapeKind::sphere:
      if (b.kind == ShapeKind::half_space)
        sphere_on_plane(a, pose_a, pose_b, tol, straight);
      else if (b.kind == ShapeKind::box)
        sphere_on_box(a, pose_a, b, pose_b, tol, straight);
      else if (b.kind == ShapeKind::sphere)
        sphere_on_sphere(a, pose_a, b, pose_b, tol, straight);
      else if (b.kind == ShapeKind::cylinder)
        sphere_on_cylinder(a, pose_a, b, pose_b, tol, straight);
      else
        core_points(a, pose_a, b, pose_b, closed, tol, straight);
      break;
    case ShapeKind::cylinder:
      if (b.kind == ShapeKind::half_space)
        cylinder_on_plane(a, pose_a, pose_b, closed, tol, straight);
      else if (b.kind == ShapeKind::sphere)
        sphere_on_cylinder(b, pose_b, a, pose_a, tol, turned);
      else
        cylinder_points(a, pose_a, b, pose_b, closed, tol, straight);
      break;
    case ShapeKind::capsule:
    case ShapeKind::hull:
      if (b.kind == ShapeKind::half_space)
        core_on_plane(a, pose_a, plane_normal(pose_b), pose_b.p, tol, straight);
      else if (b.kind == ShapeKind::cylinder)
        cylinder_points(b, pose_b, a, pose_a, closed, tol, turned);
      else
        core_points(a, pose_a, b, pose_b, closed, tol, straight);
      break;
    case ShapeKind::half_space:
      if (b.kind == ShapeKind::box) return box_on_plane(b, pose_b, pose_a, tol, corners_only, turned);
      if (b.kind == ShapeKind::sphere)
        sphere_on_plane(b, pose_b, pose_a, tol, turned);
      else if (b.kind == ShapeKind::cylinder)
        cylinder_on_plane(b, pose_b, pose_a, closed, tol, turned);
      else if (b.kind != ShapeKind::half_space)
        core_on_plane(b, pose_b, plane_normal(pose_a), pose_a.p, tol, turned);
      break;
  }
  return 0;
}

namespace {

bool is_capsule_or_hull(ShapeKind kind) { return kind == ShapeKind::capsule || kind == ShapeKind::hull; }

}  // namespace

double separation(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b) {
  if (a.kind == ShapeKind::half_space) {
    if (b.kind == ShapeKind::half_space) return std::numeric_limits<double>::infinity();
    return separation(b, pose_b, a, pose_a);
  }
  if (b.kind == ShapeKind::half_space) {
    const Vec3 n = plane_normal(pose_b);
    if (is_capsule_or_hull(a.kind)) return core_height(a, pose_a, n, pose_b.p);
    const double centre = n.dot(pose_a.p - pose_b.p);
    if (a.kind == ShapeKind::sphere) return centre - a.radius;
    const Mat3 R = pose_a.q.toRotationMatrix();
    if (a.kind == ShapeKind::cylinder)
      return centre - a.half_extents.y() * std::abs(n.dot(R.col(1))) -
             a.radius * length(n.dot(R.col(0)), n.dot(R.col(2)));
    return centre - (R.transpose() * n).cwiseAbs().dot(a.half_extents);
  }
  if (a.kind == ShapeKind::sphere && b.kind == ShapeKind::sphere)
    return (pose_a.p - pose_b.p).norm() - a.radius - b.radius;
  if ((is_capsule_or_hull(a.kind) && has_core(b.kind)) || (is_capsule_or_hull(b.kind) && has_core(a.kind)))
    return core_separation(a, pose_a, b, pose_b);
  if (a.kind == ShapeKind::sphere) return separation(b, pose_b, a, pose_a);
  if (b.kind == ShapeKind::sphere)
    return (a.kind == ShapeKind::box ? nearest_on_box(a, pose_a, pose_b.p, b.radius)
                                     : nearest_on_cylinder(a, pose_a, pose_b.p, b.radius))
        .gap;
  if (a.kind == ShapeKind::cylinder) return cylinder_separation(a, pose_a, b, pose_b);
  if (b.kind == ShapeKind::cylinder) return cylinder_separation(b, pose_b, a, pose_a);
  const PlacedBox box_a(a, pose_a), box_b(b, pose_b);
  return separating_axis(box_a, box_b, RelativeBox(box_a, box_b), 0).gap;
}

}  // namespace cb
