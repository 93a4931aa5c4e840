// Contact points of a cylinder and a core, or another cylinder, along the axis that separates them best.
//
// On a flat axis (a face of the core, an end of either cylinder) the points are corners of what the two have in common:
//   a cylinder over the face: what it has on a half-space (contact_points.cpp), as far as it is over the face; where
//   its line of lowest points leaves the face; corners of the face under an end that is flat, and where sides of the
//   face cross its rim; a core over an end: the corners of the face that looks most at it, or of its segment, as far as
//   they are over the end; where sides cross the rim; the points of the rim a quarter turn apart, on the cylinder's
//   axes x and z, that are under the face.
// Two ends that lie within one another have the four points of the smaller one. On any other axis it is one point; two,
// at the ends of what they have in common, for a side beside a parallel edge, capsule or side.
// Does not fail: whenever the gap is within the tolerance there is at least one point, but where there are seams.
#include <algorithm>
#include <array>

#include "geometry/box_box.h"
#include "geometry/cylinder.h"

namespace cb {

namespace {

constexpr double nearly = 0.99;   // cosine: as core_contacts.cpp's
constexpr double steepest = 0.5;  // cosine between two flat faces that are looked at as one patch

/// Where a line p + s u, 0 <= s <= 1, is within r of the origin: first <= s <= last.
struct Within {
  double first, last;
  bool any;
};
Within within_circle(const Vec3& p, const Vec3& u, double r) {
  const double uu = u.squaredNorm();
  if (uu == 0) return {0, 0, p.squaredNorm() <= r * r};
  const double middle = -p.dot(u) / uu, miss2 = (p + middle * u).squaredNorm();
  if (miss2 > r * r) return {0, 0, false};
  const double half = std::sqrt((r * r - miss2) / uu);
  const Within in{middle - half, middle + half, middle + half >= 0 && middle - half <= 1};
  return in;
}

/// A flat face: a polygon of a core, or an end of a cylinder.
struct Flat {
  const PlacedCore* core;  // null: an end
  int face;
  const PlacedCylinder* cylinder;
  int end;
  Vec3 n;        // out of it
  double level;  // n.x on it
  double slack;

  Vec3 middle() const { return cylinder->middle(end); }
  double height(const Vec3& p) const { return n.dot(p) - level; }
  bool contains(const Vec3& foot) const;
  bool seam_carries(int side) const {
    return core->seams() == nullptr || edge_carries(*core, edge_of_side(*core->form, face, side), n);
  }
};

bool Flat::contains(const Vec3& foot) const {
  if (core != nullptr) return over_face(*core, face, foot, slack);
  return (foot - middle()).norm() <= cylinder->r + slack;
}

/// Points that are near enough, each once.
struct Collector {
  const Flat& flat;
  double reach;
  std::vector<FlatPoint>& points;

  void add(const Vec3& foot, double gap) const {
    if (gap > reach) return;
    for (const FlatPoint& p : points)
      if ((p.foot - foot).cwiseAbs().maxCoeff() <= flat.slack && std::abs(p.gap - gap) <= flat.slack) return;
    points.push_back({foot, gap});
  }
  void add_over(const Vec3& p) const {
    const double gap = flat.height(p);
    const Vec3 foot = p - gap * flat.n;
    if (gap <= reach && flat.contains(foot)) add(foot, gap);
  }
};

// The corners and sides of a polygon under an end: the end's plane is `gap` above them.
void polygon_under_end(const Collector& to, const PlacedCylinder& c, int end) {
  const Flat& flat = to.flat;
  const Vec3 middle = c.middle(end), d = c.d();
  const double cosine = d.dot(flat.n);
  const Polytope::Face& around = flat.core->form->faces[flat.face];
  const auto up = [&](int k) -> Vec3 {  // from a corner to the end's plane
    return (d.dot(middle - flat.core->x[flat.core->form->corner(around, k)]) / cosine) * flat.n;
  };
  for (int k = 0; k < around.count; ++k) {
    const int vertex = flat.core->form->corner(around, k);
    const Vec3 p = flat.core->x[vertex], u = flat.core->x[flat.core->form->corner(around, k + 1)] - p;
    const Vec3 up_p = up(k), up_q = up(k + 1);
    const double gap_p = up_p.dot(flat.n), gap_q = up_q.dot(flat.n);
    if ((p + up_p - middle).norm() <= c.r + flat.slack && vertex_carries(*flat.core, vertex, flat.n)) to.add(p, gap_p);
    const Within in = within_circle(p + up_p - middle, u + up_q - up_p, c.r);
    if (!in.any || !flat.seam_carries(k)) continue;
    for (const double s : {in.first, in.last})
      if (s >= 0 && s <= 1) to.add(p + s * u, gap_p + s * (gap_q - gap_p));
  }
}

/// The plane of an end above the points of a flat face: where it is the end, and how its distance from the rim changes.
struct EndAbove {
  const Vec3 &middle, &d, &n;
  double cosine;  // d.n

  double gap_at(const Vec3& foot) const { return d.dot(middle - foot) / cosine; }
  Vec3 from_middle(const Vec3& foot) const { return foot + gap_at(foot) * n - middle; }
};

// Turns a point of the rim about `centre` to where the other end's rim, of `radius`, is above it; false if that is
// nowhere near. By Newton's method on the angle.
bool turn_to_rim(const EndAbove& above, double radius, const Vec3& centre, double slack, Vec3& foot) {
  constexpr int most_steps = 20;
  constexpr double longest = 0.5;  // rad
  const double r = (foot - centre).norm();
  for (int k = 0; k < most_steps; ++k) {
    const Vec3 q = above.from_middle(foot);
    const double distance = q.norm();
    if (std::abs(distance - radius) <= slack) return true;
    const Vec3 along = above.n.cross(foot - centre);  // m/rad
    const double rate = q.dot(along - (above.d.dot(along) / above.cosine) * above.n) / distance;
    if (!(std::abs(rate) > 0)) return false;
    const double turn = std::clamp((radius - distance) / rate, -longest, longest);
    foot = centre + r * (foot - centre + turn * along).normalized();
  }
  return false;
}

// Two ends, flat on each other: the points of the one below that are under the other, and where the rims cross.
void end_under_end(const Collector& to, const PlacedCylinder& c, int end) {
  const Flat& flat = to.flat;
  const Vec3 middle = c.middle(end), d = c.d();
  const double height = flat.height(middle), r = flat.cylinder->r;
  const Vec3 offset = middle - height * flat.n - flat.middle();
  const double distance = offset.norm();
  if (distance + c.r <= r + flat.slack || distance > r + c.r) return;
  const EndAbove above{middle, d, flat.n, d.dot(flat.n)};
  for (int k = 0; k < 4; ++k) {
    const Vec3 foot = flat.middle() + (k < 2 ? r : -r) * flat.cylinder->R.col(k % 2 == 0 ? 0 : 2);
    if (above.from_middle(foot).norm() <= c.r + flat.slack) to.add(foot, above.gap_at(foot));
  }
  if (distance + r <= c.r) return;
  const double along = (distance * distance + (r - c.r) * (r + c.r)) / (2 * distance);
  const double beside = std::sqrt(std::max(0.0, (r - along) * (r + along)));
  const Vec3 u = offset / distance, v = flat.n.cross(u);
  for (const double sign : {1.0, -1.0}) {
    Vec3 foot = flat.middle() + along * u + (sign * beside) * v;  // but for the square of the tilt
    if (!turn_to_rim(above, c.r, flat.middle(), flat.slack, foot)) continue;
    to.add(foot, above.gap_at(foot));
  }
}

// Where the line of the lowest points of both ends leaves the face.
void line_over_face(const Collector& to, const PlacedCylinder& c) {
  const Flat& flat = to.flat;
  const Vec3 p = c.rim(-1, -flat.n), q = c.rim(1, -flat.n);
  const double gap_p = flat.height(p), gap_q = flat.height(q);
  Vec3 from = p - gap_p * flat.n, to_end = q - gap_q * flat.n;
  const Vec3 u = to_end - from, start = from;
  if (u.norm() <= flat.slack) return;
  if (flat.core == nullptr) {
    const Within in = within_circle(start - flat.middle(), u, flat.cylinder->r);
    if (!in.any) return;
    for (const double s : {in.first, in.last})
      if (s > 0 && s < 1) to.add(start + s * u, gap_p + s * (gap_q - gap_p));
    return;
  }
  ClippedEnds at;
  if (!clip_to_face(*flat.core, flat.face, flat.slack, from, to_end, &at)) return;
  const auto clipped = [&](int side, const Vec3& foot) {
    if (side < 0 || !flat.seam_carries(side)) return;
    to.add(foot, gap_p + (foot - start).dot(u) / u.squaredNorm() * (gap_q - gap_p));
  };
  clipped(at.p, from);
  clipped(at.q, to_end);
}

// As contact_points.cpp's cylinder_on_plane, over the face.
void cylinder_over(const Collector& to, const PlacedCylinder& c, double closed) {
  const Flat& flat = to.flat;
  const double sine_x = flat.n.dot(c.R.col(0)), sine_z = flat.n.dot(c.R.col(2)), sine = length(sine_x, sine_z);
  const double cosine = std::abs(flat.n.dot(c.d()));
  for (int k = c.ends() - 1; k >= 0; --k) {
    const int end = c.end(k);
    const Vec3 middle = c.middle(end);
    const double height = flat.height(middle);
    if (height - c.r * sine > to.reach) continue;
    const bool whole = height + c.r * sine <= to.reach;
    if (whole && c.r * sine <= closed) {
      for (int j = 0; j < 4; ++j) to.add_over(middle + (j < 2 ? c.r : -c.r) * c.R.col(j % 2 == 0 ? 0 : 2));
    } else {
      const Vec3 u = c.outward(flat.n), across = c.d().cross(u);
      to.add_over(middle - c.r * u);
      if (height <= to.reach)
        for (const double sign : {-c.r, c.r}) to.add_over(middle + sign * across);
      if (whole) to.add_over(middle + c.r * u);
    }
    const bool looks_away = c.l > 0 && end * flat.n.dot(c.d()) > 0;  // the cylinder is between
    if (height > to.reach || cosine < steepest || looks_away) continue;
    if (flat.core != nullptr)
      polygon_under_end(to, c, end);
    else
      end_under_end(to, c, end);
  }
  if (c.l > 0) line_over_face(to, c);
}

// The face of a core that looks most at an end, or its segment.
void core_over(const Collector& to, const PlacedCore& x) {
  constexpr double equal_cosines = 1e-9;
  const Flat& flat = to.flat;
  const Vec3 middle = flat.middle();
  const double r = flat.cylinder->r;
  const auto add_side = [&](int from, int next, int edge) {
    const double gap_p = flat.height(x.x[from]) - x.radius, gap_q = flat.height(x.x[next]) - x.radius;
    const Vec3 p = x.x[from] - flat.height(x.x[from]) * flat.n, q = x.x[next] - flat.height(x.x[next]) * flat.n;
    if ((p - middle).norm() <= r + flat.slack && vertex_carries(x, from, -flat.n)) to.add(p, gap_p);
    const Within in = within_circle(p - middle, q - p, r);
    if (!in.any || from == next || (edge >= 0 && !edge_carries(x, edge, -flat.n))) return;
    for (const double s : {in.first, in.last})
      if (s >= 0 && s <= 1) to.add(p + s * (q - p), gap_p + s * (gap_q - gap_p));
  };
  if (!x.solid()) {
    const int last = static_cast<int>(x.x.size()) - 1;
    add_side(0, last, -1);
    if (last > 0) add_side(last, 0, -1);
    return;
  }
  int face = 0;
  for (int f = 1; f < static_cast<int>(x.n.size()); ++f)
    if (x.n[f].dot(flat.n) < x.n[face].dot(flat.n) - equal_cosines) face = f;
  const Polytope::Face& around = x.form->faces[face];
  for (int k = 0; k < around.count; ++k)
    add_side(x.form->corner(around, k), x.form->corner(around, k + 1),
             x.seams() != nullptr ? edge_of_side(*x.form, face, k) : -1);
  const double cosine = x.n[face].dot(flat.n);
  if (cosine > -steepest || x.inner(face)) return;
  for (int k = 0; k < 4; ++k) {
    const Vec3 foot = middle + (k < 2 ? r : -r) * flat.cylinder->R.col(k % 2 == 0 ? 0 : 2);
    const double gap = (x.offset[face] - x.n[face].dot(foot)) / cosine;
    if (over_face(x, face, foot + gap * flat.n, flat.slack)) to.add(foot, gap);
  }
}

/// A cylinder on something along an axis that is not flat.
struct Curved {
  const PlacedCylinder& c;
  const Opposite& x;
  const Vec3& origin;
  const CylinderAxis& axis;
  double closed, reach, margin;
  const Sink& sink;

  /// `on_c`: on the cylinder's surface.
  void add(const Vec3& on_c, const Vec3& n, double gap) const { sink.add(origin + on_c + (gap / 2) * n, -n, gap); }
  /// Two points, on the cylinder's surface: do they touch both?
  struct Ends {
    bool any = false, touch = false;
    std::array<Vec3, 2> on_c, n;
    std::array<double, 2> gap{};
  };
  Ends ends_of(const Outermost& a, const Outermost& b) const;
  Vec3 point(const Outermost& a, const Outermost& b) const;
  void next_ends(const Vec3& first) const;
  void next_points(const Vec3& first) const;
  void points() const;
};

// The ends of what two segments have in common; with points where they are as near as along the axis, within `closed`.
Curved::Ends Curved::ends_of(const Outermost& a, const Outermost& b) const {
  Ends out;
  const Vec3 u = a.q - a.p, v = b.q - b.p;
  const double length2 = u.squaredNorm();
  if (std::abs(u.dot(v)) < nearly * std::sqrt(length2 * v.squaredNorm())) return out;
  const double s_p = (b.p - a.p).dot(u) / length2, s_q = (b.q - a.p).dot(u) / length2;
  const double low = std::clamp(std::min(s_p, s_q), 0.0, 1.0), high = std::clamp(std::max(s_p, s_q), 0.0, 1.0);
  if ((high - low) * std::sqrt(length2) <= margin) return out;
  out.touch = true;
  for (std::size_t k = 0; k < 2; ++k) {
    const Vec3 at = a.p + (k == 0 ? low : high) * u;
    const Vec3 foot = b.p + std::clamp((at - b.p).dot(v) / v.squaredNorm(), 0.0, 1.0) * v;
    const double distance = (foot - at).norm();
    if (distance == 0 || (foot - at).dot(axis.n) <= 0) return {};
    out.n[k] = (foot - at) / distance;
    out.on_c[k] = at + a.radius * out.n[k];
    out.gap[k] = distance - a.radius - b.radius;
    out.touch = out.touch && out.gap[k] <= axis.gap + closed;
  }
  out.any = true;
  return out;
}

// Lists points along the axis; returns the first.
Vec3 Curved::point(const Outermost& a, const Outermost& b) const {
  Vec3 on_c = a.p + a.radius * axis.n;
  if (axis.kind == CylinderAxis::Kind::end || (!a.point() && b.point()))
    on_c = b.p - (b.radius + axis.gap) * axis.n;
  else if (!a.point())
    on_c = closest(a.p, a.q - a.p, b.p, b.q - b.p).a + a.radius * axis.n;
  add(on_c, axis.n, axis.gap);
  return on_c;
}

// How far the side is inside of a sphere about its axis, along a unit n that is nearly across it.
double inside(const PlacedCylinder& c, const Vec3& n) {
  const double cosine = n.dot(c.d());
  return c.r * cosine * cosine / (1 + c.across(n).norm());
}

// The ends of what a side and a line that it nearly lies along have in common, that come next.
void Curved::next_ends(const Vec3& first) const {
  constexpr double slope = 0.14;         // sine of the angle whose cosine is `nearly`
  constexpr double beside_first = 0.01;  // of the length: an end as near as that to the first point is that point
  const Outermost a = outermost(c, axis.n, slope * c.l);
  Outermost b{first, first, 0};
  if (x.cylinder != nullptr) {
    b = outermost(x, axis.n, slope * x.cylinder->l);
  } else if (!x.core->solid()) {
    b = {x.core->x.front(), x.core->x.back(), x.core->radius};
  } else if (axis.edge >= 0) {
    const Polytope::Edge& edge = x.core->form->edges[static_cast<std::size_t>(axis.edge)];
    b = {x.core->x[edge.from], x.core->x[edge.to], 0};
  }
  if (a.point() || b.point()) return;
  const Ends ends = ends_of(a, b);
  if (!ends.any) return;
  const double near = beside_first * (ends.on_c[1] - ends.on_c[0]).norm();
  for (std::size_t k = 0; k < 2; ++k) {
    // Sides that are not level: the surface is less far out along n, and its point is beside the axis's.
    const Vec3 &n = ends.n[k], at = ends.on_c[k] - c.r * n;
    double level = ends.gap[k] + inside(c, n);
    Vec3 on_c = at + c.r * c.across(n).normalized();
    if (x.cylinder != nullptr) {
      const PlacedCylinder& other = *x.cylinder;
      level += inside(other, n);
      if (std::abs(n.dot(other.d())) > std::abs(n.dot(c.d())))
        on_c = ends.on_c[k] + (ends.gap[k] + other.r - level) * n - other.r * other.across(n).normalized();
    }
    const double gap = std::max(level, axis.gap);  // nothing is nearer than what is nearest
    if (gap <= reach && (on_c - first).norm() > near) add(on_c, n, gap);
  }
}

// As core_contacts.cpp's next corners, where a flat face nearly lies on the other shape.
void Curved::next_points(const Vec3& first) const {
  CylinderAxis flat = axis;
  double most = nearly;
  const auto look = [&](const Vec3& n, CylinderAxis::Kind kind, int index) {
    if (n.dot(axis.n) <= most) return;
    most = n.dot(axis.n);
    flat.kind = kind;
    flat.index = index;
    flat.n = n;
  };
  if (x.core != nullptr)
    for (int f = 0; f < static_cast<int>(x.core->n.size()); ++f)
      if (!x.core->inner(f)) look(-x.core->n[f], CylinderAxis::Kind::face, f);
  for (const int end : {1, -1}) {
    look(end * c.d(), CylinderAxis::Kind::end, end);
    if (x.cylinder != nullptr) look(-end * x.cylinder->d(), CylinderAxis::Kind::end_of_other, end);
  }
  if (flat.kind == CylinderAxis::Kind::curved) return;
  thread_local std::vector<FlatPoint> points;  // does not allocate after its first calls
  points.clear();
  flat_points(c, x, flat, closed, HUGE_VAL, margin, points);
  for (const FlatPoint& p : points) {
    const double gap = std::max(p.gap, axis.gap);
    const Vec3 on_c = flat.kind == CylinderAxis::Kind::end ? p.foot : Vec3(p.foot - p.gap * flat.n);
    if (gap <= reach && (on_c - first).norm() > margin) add(on_c, flat.n, gap);
  }
}

void Curved::points() const {
  const Outermost a = outermost(c, axis.n, margin), b = outermost(x, axis.n, margin);
  if (!a.point() && !b.point()) {
    const Ends ends = ends_of(a, b);
    bool listed = false;  // ends may be beyond reach where what is between them is not
    for (std::size_t k = 0; ends.touch && k < 2; ++k) {
      if (ends.gap[k] > reach) continue;
      add(ends.on_c[k], ends.n[k], ends.gap[k]);
      listed = true;
    }
    if (listed) return;
  }
  const Vec3 first = point(a, b);
  if (reach <= closed) return;
  next_ends(first);
  next_points(first);
}

}  // namespace

void flat_points(const PlacedCylinder& c, const Opposite& x, const CylinderAxis& flat, double closed, double reach,
                 double slack, std::vector<FlatPoint>& points) {
  using Kind = CylinderAxis::Kind;
  if (flat.kind == Kind::face) {
    const Flat face{x.core, flat.index, nullptr, 0, x.core->n[flat.index], x.core->offset[flat.index], slack};
    cylinder_over({face, reach, points}, c, closed);
    return;
  }
  const PlacedCylinder& below = flat.kind == Kind::end ? c : *x.cylinder;
  const Vec3 n = flat.index * below.d();
  const Flat end{nullptr, 0, &below, flat.index, n, n.dot(below.middle(below.l > 0 ? flat.index : 1)), slack};
  if (flat.kind == Kind::end_of_other)
    cylinder_over({end, reach, points}, c, closed);
  else if (x.cylinder != nullptr)
    cylinder_over({end, reach, points}, *x.cylinder, closed);
  else
    core_over({end, reach, points}, *x.core);
}

void cylinder_points(const PlacedCylinder& c, const Opposite& x, const Vec3& origin, double closed, double reach,
                     double margin, const Sink& sink) {
  using Kind = CylinderAxis::Kind;
  CylinderAxis axis = separating_axis(c, x, margin, reach);
  if (axis.gap > reach) return;
  const bool seams = x.seams() != nullptr;
  bool beside = false;  // a neighbour is in between: what comes next
  if (seams) {
    const double apart = axis.gap;
    axis = carrying_axis(c, *x.core, margin);
    beside = apart > closed && axis.gap < apart - margin;
    if (axis.gap == -HUGE_VAL || (beside && (reach <= closed || axis.kind != Kind::face))) return;
  }
  thread_local std::vector<FlatPoint> points;  // does not allocate after its first calls
  points.clear();
  if (axis.kind != Kind::curved) {
    flat_points(c, x, axis, closed, reach, margin, points);
    if (points.empty() && seams) return;  // a neighbour carries
  }
  for (const FlatPoint& p : points) {
    if (beside && p.gap <= closed) continue;
    const Vec3 on_face = origin + p.foot;
    sink.add(axis.kind == Kind::end ? Vec3(on_face + (p.gap / 2) * axis.n) : Vec3(on_face - (p.gap / 2) * axis.n),
             -axis.n, p.gap);
  }
  if (beside) return;
  const auto lowest = std::ranges::min_element(points, {}, &FlatPoint::gap);
  const bool explained = lowest != points.end() && (seams || lowest->gap <= axis.gap + closed);
  // What is nearest is beside the face, if by less than the margin.
  if (!explained && axis.kind != Kind::curved) axis = separating_axis(c, x, 0);
  if (!explained && axis.gap <= reach) Curved{c, x, origin, axis, closed, reach, margin, sink}.points();
}

namespace {

/// A cylinder and what it meets, placed about the cylinder's middle.
struct Placed {
  PlacedCylinder a, b;
  PlacedCore core;
  Opposite x;
};
const Placed& place(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b) {
  thread_local Placed placed;  // does not allocate after its first calls
  placed.a.place(a, pose_a, pose_a.p);
  if (b.kind == ShapeKind::cylinder) {
    placed.b.place(b, pose_b, pose_a.p);
    placed.x = {nullptr, &placed.b};
  } else {
    placed.core.place(b, pose_b, pose_a.p);
    placed.x = {&placed.core, nullptr};
  }
  return placed;
}

}  // namespace

void cylinder_points(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b, double tolerance,
                     double reach, const Sink& sink) {
  const double furthest = a.bounding_radius() + b.bounding_radius() + reach;
  if ((pose_b.p - pose_a.p).squaredNorm() > furthest * furthest) return;
  const Placed& placed = place(a, pose_a, b, pose_b);
  cylinder_points(placed.a, placed.x, pose_a.p, tolerance, reach,
                  axis_margin(tolerance, a.half_extents, b.half_extents), sink);
}

double cylinder_separation(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b) {
  const Placed& placed = place(a, pose_a, b, pose_b);
  return separating_axis(placed.a, placed.x, 0).gap;
}

}  // namespace cb
