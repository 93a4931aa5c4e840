// Two boxes: separating axes, and the patch that two faces have in common.
//
// Problem: boxes a and b (centres, axes, half extents in m). Which of the 15 axes (3 face normals each, 9 cross
// products of edges) separates them furthest, and which points do the two touching faces share? Source: Gottschalk,
// Lin, Manocha, "OBBTree" (1996), section 5, for the axes; Sutherland and Hodgman, "Reentrant polygon clipping" (1974),
// for the patch. Differences from the sources:
//   1. A cross product of edges is normalised before the boxes are projected on it, and all three half extents are
//      projected with it: the gap is then a lower bound of the distance to round-off however nearly parallel the edges
//      are. The usual short form loses eps / sin of the angle between them.
//   2. Axes are compared with a margin in a fixed order (faces of a, faces of b, edges).
//   3. Clipping has slack: points on the boundary stay as they are, so that aligned unit cubes share their four
//   corners.
// Does not fail: a patch may come out empty (faces that do not overlap), and the caller falls back.
#include "geometry/box_box.h"

namespace cb {

namespace {

// Edges closer to parallel than this (squared sine) have no axis of their own; the face axes are then as good to
// 1e-10 of the size.
constexpr double parallel_sine2 = 1e-20;
// Boxes whose axes agree up to order and sign to this sum of cosines: every edge axis is a face axis.
constexpr double aligned_excess = 1e-12;

constexpr int next[3] = {1, 2, 0};
constexpr int after_next[3] = {2, 0, 1};

}  // namespace

SeparatingAxis separating_axis(const PlacedBox& a, const PlacedBox& b, const RelativeBox& ab, double margin,
                               double enough) {
  SeparatingAxis best;
  const Mat3& C = ab.C;
  const Vec3& t = ab.t;
  const Mat3 absC = C.cwiseAbs();

  // Faces of a, then of b.
  const Vec3 gap_a = t.cwiseAbs() - a.h - absC * b.h;
  int axis = 0;
  for (int i = 1; i < 3; ++i)
    if (gap_a[i] > gap_a[axis] + margin) axis = i;
  const Vec3 t_b = C.transpose() * t;
  const Vec3 gap_b = t_b.cwiseAbs() - b.h - absC.transpose() * a.h;
  best.gap = gap_a[axis];
  best.index = axis;
  for (int j = 0; j < 3; ++j) {
    if (gap_b[j] > best.gap + margin) {
      best.gap = gap_b[j];
      best.index = 3 + j;
    }
  }
  if (best.index < 3)
    best.normal_A[best.index] = t[best.index] < 0 ? -1 : 1;
  else
    best.normal_A = (t_b[best.index - 3] < 0 ? -1 : 1) * C.col(best.index - 3);
  if (best.gap > enough || absC.sum() < 3 + aligned_excess) return best;

  // Edge i of a across edge j of b: the axis e_i x C_j has entries -C(i2, j) at i1 and C(i1, j) at i2.
  for (int i = 0; i < 3; ++i) {
    const int i1 = next[i], i2 = after_next[i];
    for (int j = 0; j < 3; ++j) {
      const double length2 = C(i1, j) * C(i1, j) + C(i2, j) * C(i2, j);
      if (length2 < parallel_sine2) continue;
      const double inverse = 1 / std::sqrt(length2);
      const double n1 = -C(i2, j) * inverse, n2 = C(i1, j) * inverse;
      const int j1 = next[j], j2 = after_next[j];
      const double along = n1 * t[i1] + n2 * t[i2];
      const double radius_a = a.h[i1] * std::abs(n1) + a.h[i2] * std::abs(n2);
      const double radius_b = b.h[j1] * std::abs(n1 * C(i1, j1) + n2 * C(i2, j1)) +
                              b.h[j2] * std::abs(n1 * C(i1, j2) + n2 * C(i2, j2)) +
                              b.h[j] * std::abs(n1 * C(i1, j) + n2 * C(i2, j));
      const double gap = std::abs(along) - radius_a - radius_b;
      if (gap > best.gap + margin) {
        best.gap = gap;
        best.index = 6 + 3 * i + j;
        const double sign = along < 0 ? -1 : 1;
        best.normal_A.setZero();
        best.normal_A[i1] = sign * n1;
        best.normal_A[i2] = sign * n2;
      }
    }
  }
  return best;
}

namespace {

struct Clipped {
  int count = 0;
  PatchPoint point[20];
  int edge[20];  // of the side from point k to the next: 0..3 incident edge, 4 + p: along side p of the reference face
};

// Name of the point where a side of the polygon meets side p of the reference face.
int crossing_id(int edge, int p) {
  if (edge < 4) return 8 + 4 * edge + p;
  // Two sides of the reference face meet in one of its vertices: sides 0, 1 are +u, -u and 2, 3 are +v, -v.
  const int q = edge - 4;
  const int u_side = p < 2 ? p : q, v_side = p < 2 ? q : p;
  return 4 + u_side + 2 * (v_side - 2);
}

// Keeps what lies on the inner side of side p: +-u <= bound or +-v <= bound.
void clip(const Clipped& in, int p, double bound, double slack, Clipped& out) {
  const double sign = p % 2 == 0 ? 1 : -1;
  out.count = 0;
  for (int k = 0; k < in.count; ++k) {
    const int m = k + 1 == in.count ? 0 : k + 1;
    const PatchPoint &from = in.point[k], &to = in.point[m];
    const double d_from = sign * (p < 2 ? from.u : from.v) - bound, d_to = sign * (p < 2 ? to.u : to.v) - bound;
    const bool in_from = d_from <= slack, in_to = d_to <= slack;
    if (in_from) {
      out.point[out.count] = from;
      // The side that leaves the polygon ends on the clipping side; the next one runs along it.
      out.edge[out.count++] = in.edge[k];
    }
    if (in_from == in_to) continue;
    const double s = std::clamp(d_from / (d_from - d_to), 0.0, 1.0);
    PatchPoint cut{from.u + s * (to.u - from.u), from.v + s * (to.v - from.v), from.gap + s * (to.gap - from.gap),
                   crossing_id(in.edge[k], p)};
    (p < 2 ? cut.u : cut.v) = sign * bound;
    out.point[out.count] = cut;
    out.edge[out.count++] = in_from ? 4 + p : in.edge[k];
  }
}

}  // namespace

void face_patch(const PlacedBox& a, const PlacedBox& b, const RelativeBox& ab, int axis, double slack, FacePatch& patch,
                double side) {
  patch.reference_is_a = axis < 3;
  const PlacedBox& reference = patch.reference_is_a ? a : b;
  const PlacedBox& other = patch.reference_is_a ? b : a;
  const int i = axis % 3, i1 = next[i], i2 = after_next[i];
  Mat3 C = ab.C;
  Vec3 t = ab.t;
  if (!patch.reference_is_a) {
    C.transposeInPlace();
    t = -(C * ab.t);
  }
  patch.axis = i;
  patch.sign = side != 0 ? side : t[i] < 0 ? -1 : 1;
  patch.n = patch.sign * reference.R.col(i);

  // Incident face: the one that looks most against the reference face; the first of equals.
  constexpr double equal_cosines = 1e-9;
  int j = 0;
  for (int k = 1; k < 3; ++k)
    if (std::abs(C(i, k)) > std::abs(C(i, j)) + equal_cosines) j = k;
  const int j1 = next[j], j2 = after_next[j];
  const double facing = patch.sign * C(i, j) > 0 ? -1 : 1;
  patch.incident = facing * C.col(j);
  patch.incident_u = j1;
  patch.incident_v = j2;
  const Vec3 centre = t + other.h[j] * patch.incident;
  const Vec3 x = other.h[j1] * C.col(j1), y = other.h[j2] * C.col(j2);
  Clipped first;
  first.count = 4;
  bool inside = true;
  for (int k = 0; k < 4; ++k) {
    const double sx = k == 1 || k == 2 ? 1 : -1, sy = k >= 2 ? 1 : -1;
    const Vec3 corner = centre + sx * x + sy * y;
    first.point[k] = {corner[i1], corner[i2], patch.sign * corner[i] - reference.h[i], k};
    first.edge[k] = k;
    inside &= std::abs(corner[i1]) <= reference.h[i1] + slack && std::abs(corner[i2]) <= reference.h[i2] + slack;
  }
  if (inside) {
    patch.count = 4;
    std::copy_n(first.point, 4, patch.point);
    return;
  }

  Clipped second;
  clip(first, 0, reference.h[i1], slack, second);
  clip(second, 1, reference.h[i1], slack, first);
  clip(first, 2, reference.h[i2], slack, second);
  clip(second, 3, reference.h[i2], slack, first);
  patch.count = 0;
  const auto same = [slack](const PatchPoint& p, const PatchPoint& q) {
    return std::abs(p.u - q.u) <= slack && std::abs(p.v - q.v) <= slack && std::abs(p.gap - q.gap) <= slack;
  };
  for (int k = 0; k < first.count; ++k) {
    if (patch.count > 0 && same(first.point[k], patch.point[patch.count - 1])) continue;
    if (k + 1 == first.count && patch.count > 0 && same(first.point[k], patch.point[0])) continue;
    patch.point[patch.count++] = first.point[k];
  }
}

Vec3 edge_crossing(const PlacedBox& a, const PlacedBox& b, const RelativeBox& ab, const SeparatingAxis& axis) {
  const int i = (axis.index - 6) / 3, j = (axis.index - 6) % 3;
  // A point of each edge: the furthest vertex along the normal, with the component along the edge left at its middle.
  Vec3 p_a = Vec3::Zero(), p_b = ab.t;
  for (int k = 0; k < 3; ++k) {
    if (k != i) p_a[k] = axis.normal_A[k] < 0 ? -a.h[k] : a.h[k];
    if (k != j) p_b -= (axis.normal_A.dot(ab.C.col(k)) < 0 ? -b.h[k] : b.h[k]) * ab.C.col(k);
  }
  const Vec3 d = p_b - p_a, e_b = ab.C.col(j);
  const double c = e_b[i], s2 = e_b[next[i]] * e_b[next[i]] + e_b[after_next[i]] * e_b[after_next[i]];
  const double along_a = std::clamp((d[i] - c * d.dot(e_b)) / s2, -a.h[i], a.h[i]);
  const double along_b = std::clamp((c * d[i] - d.dot(e_b)) / s2, -b.h[j], b.h[j]);
  p_a[i] += along_a;
  return 0.5 * (p_a + p_b + along_b * e_b);
}

}  // namespace cb
