// Cores: which feature of the one is nearest to the other.
//
// Problem: a point or a segment and another core (place, m): the nearest points, or the least way out; two solid cores:
// the axis that separates them best. Sources: Ericson, "Real-Time Collision Detection" (2005), 5.1.9 and 5.3.8, for
// segments; Gregorius, "The separating axis test between convex polyhedra" (2013), for pairs of edges: two edges are an
// axis of their own where the arcs of their faces' normals cross. Differences from the sources:
//   1. Nearly parallel segments: the sine comes from a cross product, and the four ends are tried too, so that the
//      distance is exact however parallel they are.
//   2. Order and margins of axes are those of box_box.cpp. Axes of edges whose arcs do not cross are not looked at: the
//      gap of cores apart by corner and edge is then a smaller bound than box_box.cpp's; where they touch it is equal.
// Does not fail.
#include "geometry/core.h"

#include <algorithm>
#include <cmath>

namespace cb {

namespace {

constexpr double parallel_sine2 = 1e-20;  // as box_box.cpp's
constexpr double on_edge = 1e-9;          // of its length: as far below the highest vertex an edge is outermost

// Foot of p on q + t v, 0 <= t <= 1.
double along_segment(const Vec3& p, const Vec3& q, const Vec3& v) {
  const double length2 = v.squaredNorm();
  return length2 > 0 ? std::clamp((p - q).dot(v) / length2, 0.0, 1.0) : 0;
}

bool foot_inside(const PlacedCore& solid, int face, const Vec3& p) {
  const Polytope::Face& f = solid.form->faces[face];
  for (int k = 0; k < f.count; ++k) {
    const Vec3 &from = solid.x[solid.form->corner(f, k)], &to = solid.x[solid.form->corner(f, k + 1)];
    if ((to - from).cross(solid.n[face]).dot(p - from) > 0) return false;
  }
  return true;
}

// Is any of the segment p q within the faces?
bool reaches_in(const PlacedCore& solid, const Vec3& p, const Vec3& q) {
  double first = 0, last = 1;
  for (std::size_t f = 0; f < solid.n.size(); ++f) {
    const double h_p = solid.n[f].dot(p) - solid.offset[f], h_q = solid.n[f].dot(q) - solid.offset[f];
    if (h_p > 0 && h_q > 0) return false;
    if (h_p > 0)
      first = std::max(first, h_p / (h_p - h_q));
    else if (h_q > 0)
      last = std::min(last, h_p / (h_p - h_q));
  }
  return first <= last;
}

// The least way out of a solid that a segment has: over a face, or across an edge.
NearestCore way_out(const PlacedCore& s, const PlacedCore& solid) {
  const Vec3 &p = s.x.front(), &q = s.x.back();
  NearestCore out;
  out.distance = -HUGE_VAL;
  for (int f = 0; f < static_cast<int>(solid.n.size()); ++f) {
    if (solid.inner(f)) continue;
    const double h_p = solid.n[f].dot(p) - solid.offset[f], h_q = solid.n[f].dot(q) - solid.offset[f];
    if (std::min(h_p, h_q) <= out.distance) continue;
    out.distance = std::min(h_p, h_q);
    out.n = solid.n[f];
    out.on_s = h_p <= h_q ? p : q;
    out.on_x = out.on_s - out.distance * out.n;
    out.face = f;
  }
  const Vec3 u = q - p;
  for (int e = 0; e < solid.edges(); ++e) {
    const Vec3 v = solid.along(e), across = u.cross(v);
    if (across.squaredNorm() <= parallel_sine2 * u.squaredNorm() * v.squaredNorm()) continue;
    for (const Vec3& n : {Vec3(across.normalized()), Vec3(-across.normalized())}) {
      double highest = -HUGE_VAL;
      for (const Vec3& x : solid.x) highest = std::max(highest, n.dot(x));
      const Vec3& from = solid.x[solid.form->edges[e].from];
      const double gap = n.dot(p) - highest;
      if (gap <= out.distance || n.dot(from) < highest - on_edge * v.norm() || !edge_carries(solid, e, n)) continue;
      const SegmentPair pair = closest(p, u, from, v);
      out = {gap, n, pair.a, pair.b, -1, e, e, pair.t};
    }
  }
  return out;
}

// A direction for segments that cross: that of both, or any across them.
Vec3 across(const Vec3& u, const Vec3& v) {
  const Vec3 n = u.cross(v);
  if (n.squaredNorm() > parallel_sine2 * u.squaredNorm() * v.squaredNorm()) return n.normalized();
  const Vec3 along = u.squaredNorm() > v.squaredNorm() ? u : v;
  // Points in one place have no direction of their own: up.
  return along.squaredNorm() > 0 && along.x() * along.x() + along.z() * along.z() > 0 ? along.unitOrthogonal()
         : along.squaredNorm() > 0                                                    ? Vec3(Vec3::UnitX())
                                                                                      : Vec3(Vec3::UnitY());
}

}  // namespace

SegmentPair closest(const Vec3& p, const Vec3& u, const Vec3& q, const Vec3& v) {
  SegmentPair best{0, 0, p, q, HUGE_VAL};
  const auto look = [&](double s, double t) {
    const Vec3 a = p + s * u, b = q + t * v;
    const double distance2 = (a - b).squaredNorm();
    if (distance2 < best.distance2) best = {s, t, a, b, distance2};
  };
  const double uu = u.squaredNorm(), vv = v.squaredNorm(), sine2 = u.cross(v).squaredNorm();
  if (sine2 > parallel_sine2 * uu * vv) {
    const Vec3 d = q - p;
    const double uv = u.dot(v), s = (d.dot(u) * vv - d.dot(v) * uv) / sine2;
    if (s > 0 && s < 1) {
      const double t = (s * uv - d.dot(v)) / vv;
      if (t > 0 && t < 1) look(s, t);
    }
  }
  if (best.distance2 < HUGE_VAL && sine2 > 1e-6 * uu * vv) return best;
  look(0, along_segment(p, q, v));
  look(1, along_segment(p + u, q, v));
  look(along_segment(q, p, u), 0);
  look(along_segment(q + v, p, u), 1);
  return best;
}

namespace {

constexpr double level = 1e-9;        // sine: a direction that rises above a normal's plane by less does not
constexpr double same_normal = 1e-8;  // rad

bool none_rises(const PlacedCore& core, const Directions& beyond, const Vec3& n) {
  if (!beyond) return true;
  const Vec3 n_local = core.R.transpose() * n;
  return std::all_of(beyond->begin(), beyond->end(), [&](const Vec3& d) { return d.dot(n_local) <= level; });
}

}  // namespace

bool edge_carries(const PlacedCore& core, int edge, const Vec3& n) {
  const Seams* seams = core.seams();
  return seams == nullptr || (seams->sharp_edge[edge] != 0 && none_rises(core, seams->beyond_edge[edge], n));
}

bool vertex_carries(const PlacedCore& core, int vertex, const Vec3& n) {
  const Seams* seams = core.seams();
  return seams == nullptr || (seams->sharp_vertex[vertex] != 0 && none_rises(core, seams->beyond_vertex[vertex], n));
}

bool carries(const PlacedCore& x, const NearestCore& near) {
  if (x.seams() == nullptr) return true;
  if (near.face >= 0) return !x.inner(near.face);
  // On the rim of a face, along its normal: rounding says which of two neighbours it is on.
  for (int f = 0; f < static_cast<int>(x.n.size()); ++f)
    if (!x.inner(f) && (near.n - x.n[f]).squaredNorm() <= same_normal * same_normal) return true;
  const Polytope::Edge& edge = x.form->edges[near.on_edge];
  if (near.along <= 0) return vertex_carries(x, edge.from, near.n);
  if (near.along >= 1) return vertex_carries(x, edge.to, near.n);
  return edge_carries(x, near.on_edge, near.n);
}

NearestCore nearest(const PlacedCore& s, const PlacedCore& x) {
  const Vec3 &p = s.x.front(), &q = s.x.back();
  if (x.solid() && reaches_in(x, p, q)) return way_out(s, x);
  NearestCore out;
  double best2 = HUGE_VAL;
  // An end over a face: that whose plane it is furthest above.
  for (std::size_t end = 0; end < s.x.size() && x.solid(); ++end) {
    int face = 0;
    double height = -HUGE_VAL;
    for (std::size_t f = 0; f < x.n.size(); ++f) {
      const double h = x.n[f].dot(s.x[end]) - x.offset[f];
      if (h > height) {
        height = h;
        face = static_cast<int>(f);
      }
    }
    if (height <= 0 || height * height >= best2 || !foot_inside(x, face, s.x[end])) continue;
    best2 = height * height;
    out = {height, x.n[face], s.x[end], s.x[end] - height * x.n[face], face};
  }
  const Vec3 u = q - p;
  for (int e = 0; e < x.edges(); ++e) {
    const SegmentPair pair = closest(p, u, x.x[x.form->edges[e].from], x.along(e));
    if (pair.distance2 >= best2) continue;
    best2 = pair.distance2;
    const bool inner = pair.s > 0 && pair.s < 1 && pair.t > 0 && pair.t < 1;
    out.on_s = pair.a;
    out.on_x = pair.b;
    out.face = -1;
    out.edge = inner ? e : -1;
    out.on_edge = e;
    out.along = pair.t;
  }
  if (x.edges() == 0 && !x.solid()) {
    out.on_x = x.x[0];
    out.on_s = p + along_segment(x.x[0], p, u) * u;
    best2 = (out.on_s - out.on_x).squaredNorm();
  }
  if (out.face >= 0) return out;
  out.distance = std::sqrt(best2);
  out.n = out.distance > 0 ? Vec3((out.on_s - out.on_x) / out.distance)
                           : across(u, x.edges() > 0 ? x.along(std::max(0, out.edge)) : Vec3(Vec3::Zero()));
  return out;
}

namespace {

// How far all of b is above each face of a, the furthest; a later face counts where it is so by more than the margin.
// `counts(f)`: may the face be the axis?
template <class Counts>
void over_faces(const PlacedCore& a, const PlacedCore& b, double margin, CoreAxis::Kind kind, const Counts& counts,
                CoreAxis& best) {
  for (std::size_t f = 0; f < a.n.size(); ++f) {
    const double enough = best.gap + margin + a.offset[f];
    double lowest = HUGE_VAL;
    for (const Vec3& x : b.x) {
      lowest = std::min(lowest, a.n[f].dot(x));
      if (lowest <= enough) break;
    }
    if (lowest <= enough || !counts(static_cast<int>(f))) continue;
    best.gap = lowest - a.offset[f];
    best.kind = kind;
    (kind == CoreAxis::Kind::face_a ? best.a : best.b) = static_cast<int>(f);
    best.n = kind == CoreAxis::Kind::face_a ? a.n[f] : Vec3(-a.n[f]);
  }
}

// Edges of each, and the normals of their faces, b's turned round. `counts(i, j, n, gap)`: may the edges i of a and j
// of b be the axis n?
template <class Counts>
void over_edges(const PlacedCore& a, const PlacedCore& b, double margin, const Counts& counts, CoreAxis& best) {
  for (int i = 0; i < a.edges(); ++i) {
    const Polytope::Edge& edge_a = a.form->edges[i];
    const Vec3 &A = a.n[edge_a.left], &B = a.n[edge_a.right], u = a.along(i);
    for (int j = 0; j < b.edges(); ++j) {
      const Polytope::Edge& edge_b = b.form->edges[j];
      const Vec3 &C = b.n[edge_b.left], &D = b.n[edge_b.right];
      // The arcs A B and -C -D cross.
      const double CBA = C.dot(u), DBA = D.dot(u);
      if (CBA * DBA >= 0) continue;
      const Vec3 v = b.along(j);
      const double ADC = A.dot(v), BDC = B.dot(v);
      if (ADC * BDC >= 0 || CBA * BDC >= 0) continue;
      Vec3 n = u.cross(v);
      const double sine2 = n.squaredNorm();
      if (sine2 <= parallel_sine2 * u.squaredNorm() * v.squaredNorm()) continue;
      n /= std::sqrt(sine2);
      if (n.dot(A + B) < 0) n = -n;
      const double gap = n.dot(b.x[edge_b.from] - a.x[edge_a.from]);
      if (gap <= best.gap + margin || !counts(i, j, n, gap)) continue;
      best = {gap, CoreAxis::Kind::edges, i, j, n};
    }
  }
}

}  // namespace

bool outermost_carries(const PlacedCore& core, const Vec3& n, double margin) {
  double highest = -HUGE_VAL;
  for (const Vec3& x : core.x) highest = std::max(highest, n.dot(x));
  int found[2] = {-1, -1}, count = 0;
  for (int i = 0; i < static_cast<int>(core.x.size()); ++i) {
    if (n.dot(core.x[i]) < highest - margin) continue;
    if (count < 2) found[count] = i;
    ++count;
  }
  if (count == 1) return vertex_carries(core, found[0], n);
  if (count == 2) {
    for (int e = 0; e < core.edges(); ++e) {
      const Polytope::Edge& edge = core.form->edges[e];
      if (std::minmax(edge.from, edge.to) == std::minmax(found[0], found[1])) return edge_carries(core, e, n);
    }
    return false;
  }
  int face = 0;
  for (int f = 1; f < static_cast<int>(core.n.size()); ++f)
    if (core.n[f].dot(n) > core.n[face].dot(n)) face = f;
  return !core.inner(face);
}

CoreAxis separating_axis(const PlacedCore& a, const PlacedCore& b, double margin, double enough) {
  const auto any = [](auto...) { return true; };
  CoreAxis best;
  best.gap = -HUGE_VAL;
  over_faces(a, b, margin, CoreAxis::Kind::face_a, any, best);
  if (best.gap > enough) return best;
  over_faces(b, a, margin, CoreAxis::Kind::face_b, any, best);
  if (best.gap > enough) return best;
  over_edges(a, b, margin, any, best);
  return best;
}

CoreAxis carrying_axis(const PlacedCore& a, const PlacedCore& b, double margin) {
  if (a.seams() == nullptr) {
    CoreAxis axis = carrying_axis(b, a, margin);
    if (axis.kind != CoreAxis::Kind::edges)
      axis.kind = axis.kind == CoreAxis::Kind::face_a ? CoreAxis::Kind::face_b : CoreAxis::Kind::face_a;
    std::swap(axis.a, axis.b);
    axis.n = -axis.n;
    return axis;
  }
  CoreAxis best;
  best.gap = -HUGE_VAL;
  over_faces(
      a, b, margin, CoreAxis::Kind::face_a, [&](int f) { return !a.inner(f); }, best);
  const auto lies_on = [&](int f) {
    if (!outermost_carries(a, -b.n[f], margin)) return false;
    thread_local CorePatch patch;  // does not allocate after its first calls
    face_patch(b, a, f, margin, patch);
    return !patch.empty();
  };
  over_faces(b, a, margin, CoreAxis::Kind::face_b, lies_on, best);
  const auto cross = [&](int i, int j, const Vec3& n, double gap) {
    if (!edge_carries(a, i, n)) return false;
    const SegmentPair at = closest(a.x[a.form->edges[i].from], a.along(i), b.x[b.form->edges[j].from], b.along(j));
    return (at.b - at.a - gap * n).cwiseAbs().maxCoeff() <= margin;
  };
  over_edges(a, b, margin, cross, best);
  return best;
}

namespace {

struct Clipped {
  std::vector<CorePatchPoint> point;
  std::vector<int> edge;  // of the side from point k to the next: an incident edge, or ~k along the reference's side k
};

std::uint64_t id_of(int kind, int incident, int reference) {
  return static_cast<std::uint64_t>(kind) << 48 | static_cast<std::uint64_t>(incident + 1) << 24 |
         static_cast<std::uint64_t>(reference + 1);
}

void set_feature(CorePatchPoint& point, CorePatchPoint::Kind kind, int incident, int reference) {
  point.kind = kind;
  point.incident = incident;
  point.reference = reference;
  point.id = id_of(kind, incident, reference);
}

// A vertex of the other as a point over the plane of the patch's reference face.
CorePatchPoint vertex_over(const PlacedCore& reference, const CorePatch& patch, const PlacedCore& other, int vertex) {
  const double gap = patch.n.dot(other.x[vertex]) - reference.offset[patch.face];
  CorePatchPoint point{other.x[vertex] - gap * patch.n, gap, 0, 0, 0, CorePatchPoint::vertex_over_face};
  set_feature(point, CorePatchPoint::vertex_over_face, vertex, 0);
  return point;
}

// What lies within the side k of a face, which looks out along m.
void clip(const Clipped& in, const Polytope& form, const Polytope::Face& face, int k, const Vec3& corner, const Vec3& m,
          double slack, Clipped& out) {
  out.point.clear();
  out.edge.clear();
  const std::size_t count = in.point.size();
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t j = i + 1 == count ? 0 : i + 1;
    const double d_i = m.dot(in.point[i].foot - corner), d_j = m.dot(in.point[j].foot - corner);
    const bool in_i = d_i <= slack, in_j = d_j <= slack;
    if (in_i) {
      out.point.push_back(in.point[i]);
      out.edge.push_back(in.edge[i]);
    }
    if (in_i == in_j) continue;
    const double s = std::clamp(d_i / (d_i - d_j), 0.0, 1.0);
    CorePatchPoint cut = in.point[i];
    cut.foot += s * (in.point[j].foot - in.point[i].foot);
    cut.gap += s * (in.point[j].gap - in.point[i].gap);
    const int edge = in.edge[i];
    if (edge >= 0) {
      set_feature(cut, CorePatchPoint::edges, edge, k);
    } else {
      const int other = ~edge;  // the corner that two sides share
      set_feature(cut, CorePatchPoint::face_over_vertex, 0,
                  form.corner(face, (k + 1) % face.count == other ? other : k));
    }
    out.point.push_back(cut);
    out.edge.push_back(in_i ? ~k : edge);
  }
}

// Is a corner of a patch one of what carries? One of the two has seams.
bool point_carries(const PlacedCore& reference, const PlacedCore& other, const CorePatch& patch,
                   const CorePatchPoint& point) {
  const bool of_reference = reference.seams() != nullptr;
  const PlacedCore& core = of_reference ? reference : other;
  const int face = of_reference ? patch.face : patch.incident,
            feature = of_reference ? point.reference : point.incident;
  const Vec3 n = of_reference ? patch.n : Vec3(-patch.n);
  if (point.kind == CorePatchPoint::edges) return edge_carries(core, edge_of_side(*core.form, face, feature), n);
  if ((point.kind == CorePatchPoint::vertex_over_face) == of_reference) return !core.inner(face);
  return vertex_carries(core, feature, n);
}

}  // namespace

int edge_of_side(const Polytope& form, int face, int k) {
  const int from = form.corner(form.faces[face], k), to = form.corner(form.faces[face], k + 1);
  for (int e = 0; e < static_cast<int>(form.edges.size()); ++e)
    if (std::minmax(form.edges[e].from, form.edges[e].to) == std::minmax(from, to)) return e;
  return -1;
}

namespace {

// Of the faces at the lowest vertex, or one as low, that which looks most against n. Another one may do so more, and
// have nothing of what is lowest.
int incident_face(const PlacedCore& core, const Vec3& n, double slack) {
  constexpr double equal_cosines = 1e-9;
  double lowest = HUGE_VAL;
  for (const Vec3& x : core.x) lowest = std::min(lowest, n.dot(x));
  int found = -1;
  for (int f = 0; f < static_cast<int>(core.n.size()); ++f) {
    if (found >= 0 && core.n[f].dot(n) >= core.n[found].dot(n) - equal_cosines) continue;
    const Polytope::Face& face = core.form->faces[f];
    for (int k = 0; k < face.count; ++k)
      if (n.dot(core.x[core.form->corner(face, k)]) <= lowest + slack) found = f;
  }
  return std::max(0, found);
}

}  // namespace

void face_patch(const PlacedCore& reference, const PlacedCore& other, int face, double slack, CorePatch& patch) {
  patch.face = face;
  patch.n = reference.n[face];
  patch.incident = incident_face(other, patch.n, slack);
  thread_local Clipped first, second;
  first.point.clear();
  first.edge.clear();
  const Polytope::Face& incident = other.form->faces[patch.incident];
  for (int k = 0; k < incident.count; ++k) {
    first.point.push_back(vertex_over(reference, patch, other, other.form->corner(incident, k)));
    first.edge.push_back(k);
  }
  const Polytope::Face& around = reference.form->faces[face];
  for (int k = 0; k < around.count; ++k) {
    const Vec3& corner = reference.x[reference.form->corner(around, k)];
    const Vec3 side = reference.x[reference.form->corner(around, k + 1)] - corner;
    clip(first, *reference.form, around, k, corner, side.cross(patch.n).normalized(), slack, second);
    std::swap(first, second);
  }
  if (reference.seams() != nullptr || other.seams() != nullptr)
    std::erase_if(first.point, [&](const CorePatchPoint& p) { return !point_carries(reference, other, patch, p); });
  patch.point.clear();
  const auto same = [slack](const CorePatchPoint& p, const CorePatchPoint& q) {
    return (p.foot - q.foot).cwiseAbs().maxCoeff() <= slack && std::abs(p.gap - q.gap) <= slack;
  };
  for (std::size_t k = 0; k < first.point.size(); ++k) {
    if (!patch.point.empty() && same(first.point[k], patch.point.back())) continue;
    if (k + 1 == first.point.size() && !patch.point.empty() && same(first.point[k], patch.point.front())) continue;
    patch.point.push_back(first.point[k]);
  }
}

void beside_patch(const PlacedCore& reference, const PlacedCore& other, const CorePatch& patch,
                  std::vector<CorePatchPoint>& beside) {
  beside.clear();
  const Polytope::Face& incident = other.form->faces[patch.incident];
  for (int k = 0; k < incident.count; ++k) {
    const CorePatchPoint point = vertex_over(reference, patch, other, other.form->corner(incident, k));
    const auto is_it = [&](const CorePatchPoint& p) { return p.id == point.id; };
    if (std::any_of(patch.point.begin(), patch.point.end(), is_it)) continue;
    if (point_carries(reference, other, patch, point)) beside.push_back(point);
  }
}

bool clip_to_face(const PlacedCore& solid, int face, double slack, Vec3& p, Vec3& q, ClippedEnds* at) {
  ClippedEnds side_of;
  const Polytope::Face& around = solid.form->faces[face];
  const Vec3 from = p, along = q - p;
  double first = 0, last = 1;
  for (int k = 0; k < around.count; ++k) {
    const Vec3& corner = solid.x[solid.form->corner(around, k)];
    const Vec3 side = solid.x[solid.form->corner(around, k + 1)] - corner;
    const Vec3 m = side.cross(solid.n[face]).normalized();
    const double d_p = m.dot(from - corner), d_q = m.dot(from + along - corner);
    if (d_p > slack && d_q > slack) return false;
    if (d_p > slack && d_p / (d_p - d_q) > first) {
      first = d_p / (d_p - d_q);
      side_of.p = k;
    } else if (d_q > slack && d_p / (d_p - d_q) < last) {
      last = d_p / (d_p - d_q);
      side_of.q = k;
    }
  }
  if (first > last) return false;
  if (at != nullptr) *at = side_of;
  if (first > 0) p = from + first * along;
  if (last < 1) q = from + last * along;
  return true;
}

}  // namespace cb
