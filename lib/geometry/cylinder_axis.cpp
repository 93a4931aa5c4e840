// Cylinders: the axis that separates one from a core or from another cylinder best.
//
// Problem: the most of gap(n) = (least of n.x over the other) - (most of n.x over the cylinder) over unit n (m). Any n
// is a bound; where they are apart the most is their distance, and where they overlap the least way out.
// The normal that is best is that of a pair of features, so it is enough to look at
//   faces of the core, ends of cylinders (Kind face, end, end_of_other: no search);
//   an edge across the side: their common normal; an edge and a rim, or the line along a side and a rim: in the plane
//   across the line the rim is an ellipse, and the line a point beside it;
//   a vertex beside the side or the rim: the way there from the nearest point of the cylinder;
//   two rims: gap(n) is smooth, and concave but for its length; Newton's iteration on the sphere.
// Source for the ellipse: Eberly, "Distance from a point to an ellipse" (2013): the nearest point is in the quadrant
// that the point is in, which gives a bracket. Differences: the unknown is the unit normal, and steps are Newton's.
// Every candidate's gap is taken over all of both shapes before it counts, so that a wrong one does no harm.
// Edges that cannot have it are passed over (may_be_best); nothing more is looked for where what is outermost along the
// best axis so far meets (meets), which is most often so where two rest on each other.
// Does not fail. Where two cylinders overlap the least way out may be another one that was not found: it was seen once
// in a thousand at 1e-4 m, nearly flat, and the gap was then a hundredth below the depth's. Of a core none was seen, at
// 1e-6 to 0.05 m of shapes of 0.1 to 0.6 m.
#include "geometry/cylinder.h"

namespace cb {

void PlacedCylinder::place(const Shape& shape, const Pose& pose, const Vec3& origin) {
  c = pose.p - origin;
  R = pose.q.toRotationMatrix();
  r = shape.radius;
  l = shape.half_extents.y();
}

Vec3 PlacedCylinder::outward(const Vec3& n) const {
  const Vec3 out = across(n);
  const double sine = out.norm();
  return sine > 0 ? Vec3(out / sine) : Vec3(R.col(0));
}

double Opposite::lowest(const Vec3& n) const {
  if (cylinder != nullptr) return n.dot(cylinder->c) - cylinder->reach(n);
  double least = HUGE_VAL;
  for (const Vec3& x : core->x) least = std::min(least, n.dot(x));
  return least - core->radius;
}

Vec3 Opposite::lowest_point(const Vec3& n) const {
  if (cylinder != nullptr) return cylinder->rim(n.dot(cylinder->d()) > 0 ? -1 : 1, -n);
  const Vec3* least = &core->x[0];
  for (const Vec3& x : core->x)
    if (n.dot(x) < n.dot(*least)) least = &x;
  return *least - core->radius * n;
}

bool over_face(const PlacedCore& core, int face, const Vec3& p, double slack) {
  const Polytope::Face& around = core.form->faces[face];
  for (int k = 0; k < around.count; ++k) {
    const Vec3& corner = core.x[core.form->corner(around, k)];
    const Vec3 side = core.x[core.form->corner(around, k + 1)] - corner;
    if (side.cross(core.n[face]).dot(p - corner) > slack * side.norm()) return false;
  }
  return true;
}

Outermost outermost(const PlacedCylinder& c, const Vec3& n, double margin) {
  if (c.l > 0 && std::abs(n.dot(c.d())) * c.l <= margin) return {c.middle(-1), c.middle(1), c.r};
  const Vec3 p = c.rim(n.dot(c.d()) > 0 ? 1 : -1, n);
  return {p, p, 0};
}

Outermost outermost(const Opposite& x, const Vec3& n, double margin) {
  if (x.cylinder != nullptr) return outermost(*x.cylinder, -n, margin);
  const PlacedCore& core = *x.core;
  const Vec3 least = x.lowest_point(n) + core.radius * n;
  Outermost out{least, least, core.radius};
  for (const Vec3& p : core.x)
    if (n.dot(p - least) <= margin && (p - least).squaredNorm() > (out.q - least).squaredNorm()) out.q = p;
  return out;
}

namespace {

constexpr double parallel_sine2 = 1e-20;  // as box_box.cpp's
constexpr double in_arc = 1e-9;           // sine: a normal beyond those of an edge's faces by less is between them

// The outward normal (c, s) of the ellipse with half axes A <= B along which the point (p, q) is furthest beyond it,
// q >= 0: most of p c + q s - sqrt(A^2 c^2 + B^2 s^2) over the quadrant; for p < 0 the one next to (1, 0).
Eigen::Vector2d ellipse_normal(double p, double q, double A, double B) {
  constexpr int most_steps = 80;
  constexpr double rounding = 4e-16;  // rad
  if (B == 0) return p >= 0 && p + q > 0 ? Eigen::Vector2d(Eigen::Vector2d(p, q).normalized()) : Eigen::Vector2d(1, 0);
  const auto turned = [](const Eigen::Vector2d& u, const Eigen::Vector2d& v) { return u.x() * v.y() - u.y() * v.x(); };
  const double squares = (B - A) * (B + A);
  Eigen::Vector2d low(1, 0), high(0, 1), n = Eigen::Vector2d(p + A, q + B).normalized();
  if (p < 0) n = Eigen::Vector2d(B * B, 2 * q * A).normalized();  // beyond where the slope of q s - B^2 s^2 / 2 A ends
  for (int k = 0; k < most_steps; ++k) {
    const double c = n.x(), s = n.y(), width = length(A * c, B * s);
    if (width == 0) break;
    const double width_slope = squares * s * c / width, slope = q * c - p * s - width_slope;
    const double curvature = -(p * c + q * s) - (squares * (c - s) * (c + s) - width_slope * width_slope) / width;
    (slope > 0 ? low : high) = n;
    const double step = -slope / curvature;
    if (slope == 0 || (curvature < 0 && std::abs(step) <= rounding)) break;
    const Eigen::Vector2d newton = Eigen::Vector2d(c - step * s, s + step * c).normalized();
    const bool within = curvature < 0 && turned(low, newton) > 0 && turned(newton, high) > 0;
    const Eigen::Vector2d next = within ? newton : Eigen::Vector2d((low + high).normalized());
    if (next == n) break;
    n = next;
  }
  return n;
}

// u, which is across e but for rounding, made so: nearly parallel lines leave little of their cross product.
Vec3 unit_across(const Vec3& e, const Vec3& u) {
  const Vec3 n = u.normalized();
  return (n - n.dot(e) * e).normalized();
}

/// From a rim to a line, by the ellipse.
struct RimNormal {
  bool found;
  Vec3 n;
};
// The line through p along the unit e beside the rim of an end of c (of a disc: a side of it); n is from c to the line.
// Where the line is below the end, the way out over the rim is only looked for of what is `inside`.
RimNormal rim_to_line(const PlacedCylinder& c, int end, const Vec3& p, const Vec3& e, bool inside) {
  const Vec3 d = c.d(), q = p - c.middle(end);
  const Vec3 upright = d - d.dot(e) * e;
  if (upright.squaredNorm() <= parallel_sine2) {
    const Vec3 n = q - q.dot(e) * e;
    const double distance = n.norm();
    return {distance > 0, n / distance};
  }
  const Vec3 a = unit_across(e, upright), b = e.cross(a);
  const double q_a = end * q.dot(a), q_b = q.dot(b);
  if (q_a < 0 && !inside) return {false, Vec3::Zero()};
  const Eigen::Vector2d n = ellipse_normal(q_a, std::abs(q_b), c.r * std::abs(d.dot(e)), c.r);
  return {true, (end * n.x()) * a + std::copysign(n.y(), q_b) * b};
}

/// A search among axes from a cylinder to another shape.
struct Search {
  const PlacedCylinder& c;
  const Opposite& x;
  double margin;
  bool carrying;  // of a core with seams: those that carry
  CylinderAxis best{-HUGE_VAL, CylinderAxis::Kind::curved, 0, Vec3::UnitY()};

  // Flat ones come first; a curved one is the best of its kind, so that what touches is outermost along it.
  bool better(double gap) const { return gap > best.gap + (best.kind == CylinderAxis::Kind::curved ? 0 : margin); }
  void take(double gap, CylinderAxis::Kind kind, int index, const Vec3& n, int edge = -1) {
    best = {gap, kind, index, n, edge};
  }
  bool meets() const;
  static bool end_meets(const PlacedCylinder& of, const Vec3& n, const Outermost& other, const PlacedCylinder* flat);
  double gap_along(const Vec3& n) const { return x.lowest(n) - n.dot(c.c) - c.reach(n); }

  // A curved one, of a point p of the other; `edge`, `vertex`: of the core, where it is one.
  void offer(const Vec3& n, const Vec3& p, int edge, int vertex) {
    if (!better(n.dot(p - c.c) - c.reach(n) - x.radius())) return;
    const double gap = gap_along(n);
    if (better(gap) && (!carrying || carried(n, gap, edge, vertex))) take(gap, CylinderAxis::Kind::curved, 0, n, edge);
  }

  bool carried(const Vec3& n, double gap, int edge, int vertex) const;
  void over_faces();
  void over_ends();
  void over_end(int end);
  void over_edges();
  void over_edge(int edge);
  bool may_be_best(const Vec3& p, const Vec3& e, const Vec3& n_left, const Vec3& n_right, const Vec3& left,
                   const Vec3& right) const;
  bool grows_towards_edge(const Vec3& n, const Vec3& other, const Vec3& p) const;
  void over_vertices();
  void over_cylinder();
  bool start_over_rims(int end_c, int end_b);
  void over_point();
  void over_rims(int end_c, int end_b, const Vec3& start);
};

// Do the features that are outermost along the best axis meet, as far as it says that they are apart? Then no other
// axis separates better: where they are apart they have points at that distance; where they touch no turn of the axis
// widens the gap. Deeper overlaps may have another way out.
bool Search::meets() const {
  constexpr double shallow = 1e-3, level = 1e-12, beside = 1e-10;  // of the radius
  if (carrying || best.gap < -shallow * c.r) return false;
  const double size = std::max(c.r, c.l);
  const Outermost a = outermost(c, best.n, level * size), b = outermost(x, best.n, level * size);
  if (best.kind == CylinderAxis::Kind::end) return end_meets(c, best.n, b, x.cylinder);
  if (best.kind == CylinderAxis::Kind::end_of_other) return end_meets(*x.cylinder, -best.n, a, &c);
  if (best.kind == CylinderAxis::Kind::face) {
    const Vec3 end = c.middle(best.n.dot(c.d()) < 0 ? -1 : 1);
    const bool flat = c.across(best.n).norm() <= level;
    return over_face(*x.core, best.index, flat ? end : a.p, 0) || over_face(*x.core, best.index, flat ? end : a.q, 0);
  }
  const SegmentPair at = closest(a.p, a.q - a.p, b.p, b.q - b.p);
  return (at.b - at.a - (best.gap + a.radius + b.radius) * best.n).norm() <= beside * size;
}

// Is a point of the other under an end, the normal out of it? `flat`: the other, where it is a cylinder.
bool Search::end_meets(const PlacedCylinder& of, const Vec3& n, const Outermost& other, const PlacedCylinder* flat) {
  constexpr double level = 1e-12;  // sine
  const auto middle = [&n](const PlacedCylinder& c) { return c.middle(n.dot(c.d()) < 0 ? -1 : 1); };
  if (flat != nullptr && flat->across(n).norm() <= level) return of.across(flat->c - of.c).norm() <= of.r + flat->r;
  const SegmentPair at = closest(middle(of), Vec3::Zero(), other.p, other.q - other.p);
  return of.across(at.b - of.c).squaredNorm() <= of.r * of.r;
}

// Does an edge or a vertex carry along n, is it outermost, and is what it touches there?
bool Search::carried(const Vec3& n, double gap, int edge, int vertex) const {
  const Vec3& corner = x.core->x[vertex >= 0 ? vertex : x.core->form->edges[edge].from];
  if (n.dot(corner) > x.lowest(n) + margin) return false;
  if (vertex >= 0) return vertex_carries(*x.core, vertex, -n);
  if (!edge_carries(*x.core, edge, -n)) return false;
  const Vec3 p = x.core->x[x.core->form->edges[edge].from], v = x.core->along(edge);
  if (c.l > 0 && std::abs(n.dot(c.d())) * c.l <= margin) {
    const SegmentPair at = closest(c.middle(-1), 2 * c.l * c.d(), p, v);
    return (at.b - at.a - (gap + c.r) * n).cwiseAbs().maxCoeff() <= margin;
  }
  const Vec3 e = v.normalized(), on_edge = c.rim(n.dot(c.d()) > 0 ? 1 : -1, n) + gap * n - p;
  const double along = on_edge.dot(e);
  return along >= -margin && along <= v.norm() + margin && (on_edge - along * e).norm() <= margin;
}

void Search::over_faces() {
  const PlacedCore& core = *x.core;
  for (int f = 0; f < static_cast<int>(core.n.size()); ++f) {
    const double gap = core.n[f].dot(c.c) - core.offset[f] - c.reach(core.n[f]);
    if (better(gap) && !(carrying && core.inner(f))) take(gap, CylinderAxis::Kind::face, f, -core.n[f]);
  }
}

void Search::over_end(int end) {
  const Vec3 n = end * c.d();
  const double gap = x.lowest(n) - n.dot(c.c) - c.l;
  if (!better(gap)) return;
  if (carrying) {
    if (!outermost_carries(*x.core, -n, margin)) return;
    thread_local std::vector<FlatPoint> points;  // does not allocate after its first calls
    points.clear();
    flat_points(c, x, {gap, CylinderAxis::Kind::end, end, n}, margin, HUGE_VAL, margin, points);
    if (points.empty()) return;
  }
  take(gap, CylinderAxis::Kind::end, end, n);
}

// A disc has two sides.
void Search::over_ends() {
  for (const int end : {1, -1}) over_end(end);
  if (x.cylinder == nullptr) return;
  const PlacedCylinder& other = *x.cylinder;
  for (const int end : {1, -1}) {
    const Vec3 n = -end * other.d();
    const double gap = n.dot(other.c) - other.l - n.dot(c.c) - c.reach(n);
    if (better(gap)) take(gap, CylinderAxis::Kind::end_of_other, end, n);
  }
}

// How the gap to a point p changes where n, a normal of one of its edge's faces, turns to the other's.
bool Search::grows_towards_edge(const Vec3& n, const Vec3& other, const Vec3& p) const {
  const Vec3 t = (other - n.dot(other) * n).normalized(), d = c.d();
  const double cosine = n.dot(d);
  const Vec3 across = c.across(n);
  const double sine = across.norm();
  const double up = cosine == 0 ? std::abs(t.dot(d)) : std::copysign(1.0, cosine) * t.dot(d);
  const double along_rim = sine == 0 ? c.across(t).norm() : across.dot(t) / sine;
  return t.dot(p - c.c) - c.l * up - c.r * along_rim >= 0;
}

// Can a normal between those of an edge's faces have a larger gap than the best? By what n.(p - c) is at most, and the
// reach at least; and where the gap is positive it has one maximum, so that it grows towards that.
bool Search::may_be_best(const Vec3& p, const Vec3& e, const Vec3& n_left, const Vec3& n_right, const Vec3& left,
                         const Vec3& right) const {
  const Vec3 q = p - c.c, beside = q - q.dot(e) * e;
  const bool within = q.dot(left) >= 0 && q.dot(right) >= 0;
  if (!better((within ? beside.norm() : std::max(n_left.dot(q), n_right.dot(q))) - std::min(c.r, c.l))) return false;
  const auto falls = [&](const Vec3& n, const Vec3& other) {
    return n.dot(q) - c.reach(n) > 0 && !grows_towards_edge(n, other, p);
  };
  return !falls(n_left, n_right) && !falls(n_right, n_left);
}

void Search::over_edge(int edge) {
  const PlacedCore& core = *x.core;
  const Polytope::Edge& of = core.form->edges[edge];
  const Vec3& p = core.x[of.from];
  const Vec3 along = core.along(edge);
  const double length = along.norm();
  if (length == 0) return;
  const Vec3 e = along / length;
  Vec3 left = Vec3::Zero(), right = Vec3::Zero();  // normals between those of the faces beside it are on both's sides
  if (core.solid()) {
    left = core.n[of.left].cross(e);
    right = e.cross(core.n[of.right]);
    if (!may_be_best(p, e, -core.n[of.left], -core.n[of.right], left, right)) return;
  }
  const auto between_faces = [&](const Vec3& n) { return n.dot(left) >= -in_arc && n.dot(right) >= -in_arc; };
  const Vec3 common = e.cross(c.d());
  if (common.squaredNorm() > parallel_sine2)
    for (const double sign : {1.0, -1.0}) {
      const Vec3 n = sign * unit_across(e, common);
      if (between_faces(n)) offer(n, p, edge, -1);
    }
  for (const int end : {1, -1}) {
    const RimNormal to = rim_to_line(c, end, p, e, best.gap < 0);
    if (to.found && between_faces(to.n)) offer(to.n, p, edge, -1);
  }
}

void Search::over_edges() {
  for (int e = 0; e < x.core->edges(); ++e) over_edge(e);
}

void Search::over_vertices() {
  for (int i = 0; i < static_cast<int>(x.core->x.size()); ++i) {
    const Vec3& p = x.core->x[i];
    const Vec3 q = p - c.c, across = c.across(q);
    const double height = q.dot(c.d()), distance = across.norm(), beyond = std::abs(height) - c.l;
    if (beyond <= 0) {
      if (distance > 0) offer(across / distance, p, -1, i);
      continue;
    }
    if (distance <= c.r) continue;  // over an end
    const Vec3 n = ((distance - c.r) / distance) * across + std::copysign(beyond, height) * c.d();
    offer(n.normalized(), p, -1, i);
  }
}

// Two rims: from `start`, the most of (n.q - r |n across a| - s |n across b|) / |n| that Newton's steps come to.
void Search::over_rims(int end_c, int end_b, const Vec3& start) {
  constexpr int most_steps = 100;
  constexpr double longest = 0.5, shortest = 1e-15, least_sine = 1e-9;
  const PlacedCylinder& b = *x.cylinder;
  const Vec3 d = c.d(), f = b.d();
  const Vec3 q = b.middle(end_b) - c.middle(end_c);
  const auto gap = [&](const Vec3& n) { return n.dot(q) - c.r * c.across(n).norm() - b.r * b.across(n).norm(); };
  Vec3 n = start;
  double value = gap(n);
  for (int k = 0; k < most_steps; ++k) {
    const Vec3 u = c.across(n), v = b.across(n);
    const double s = u.norm(), t = v.norm();
    if (s < least_sine || t < least_sine) return;  // an end
    const Vec3 gradient = q - (c.r / s) * u - (b.r / t) * v;
    const Vec3 along_c = d.cross(u) / s, along_b = f.cross(v) / t, x1 = n.unitOrthogonal(), x2 = n.cross(x1);
    const Eigen::Vector2d g(gradient.dot(x1), gradient.dot(x2));
    const Eigen::Vector2d h_c(along_c.dot(x1), along_c.dot(x2)), h_b(along_b.dot(x1), along_b.dot(x2));
    Eigen::Matrix2d H = (c.r / s) * h_c * h_c.transpose() + (b.r / t) * h_b * h_b.transpose();
    H.diagonal().array() += value;
    // Made positive definite where they overlap by much: the smaller eigenvalue is lifted.
    const double mean = H.trace() / 2, spread = length((H(0, 0) - H(1, 1)) / 2, H(0, 1));
    const double lift = 1e-9 * (mean + spread) - (mean - spread);
    if (mean + spread <= 0) return;
    if (lift > 0) H.diagonal().array() += lift;
    const double det = H(0, 0) * H(1, 1) - H(0, 1) * H(1, 0);
    Eigen::Vector2d step((H(1, 1) * g.x() - H(0, 1) * g.y()) / det, (H(0, 0) * g.y() - H(1, 0) * g.x()) / det);
    const double size = step.norm();
    const double limit = longest * std::min(s, t);  // the rims' parts are cones about their axes
    if (size > limit) step *= limit / size;
    if (size < shortest) break;
    Vec3 next = n;
    double next_value = value;
    for (int halved = 0; halved < 30; ++halved, step /= 2) {
      next = (n + step.x() * x1 + step.y() * x2).normalized();
      next_value = gap(next);
      if (next_value >= value) break;
    }
    if (next_value < value || next == n) break;
    n = next;
    value = next_value;
    if (size < 1e-9) break;  // the next would be its square
  }
  if (!better(value)) return;
  const double all = gap_along(n);
  if (better(all)) take(all, CylinderAxis::Kind::curved, 0, n);
}

// A point beside a cylinder.
void Search::over_point() {
  const PlacedCylinder& b = *x.cylinder;
  const Vec3 q = b.c - c.c, across = b.across(q);
  const double height = q.dot(b.d()), distance = across.norm(), beyond = std::max(0.0, std::abs(height) - b.l);
  const Vec3 way = (distance > b.r ? (distance - b.r) / distance : 0) * across + std::copysign(beyond, height) * b.d();
  for (const Vec3& n : {way, across}) {
    if (n.squaredNorm() == 0) continue;
    const double gap = gap_along(n.normalized());
    if (better(gap)) take(gap, CylinderAxis::Kind::curved, 0, n.normalized());
  }
}

void Search::over_cylinder() {
  const PlacedCylinder& b = *x.cylinder;
  const auto offer_any = [&](const Vec3& n) {
    const double gap = gap_along(n);
    if (better(gap)) take(gap, CylinderAxis::Kind::curved, 0, n);
  };
  const Vec3 common = c.d().cross(b.d());
  if (common.squaredNorm() > parallel_sine2)
    for (const double sign : {1.0, -1.0}) offer_any(sign * unit_across(c.d(), common));
  for (const int end : {1, -1}) {
    const RimNormal to = rim_to_line(b, end, c.c, c.d(), best.gap < 0);
    if (to.found) offer_any(-to.n);
  }
  for (const int end : {1, -1}) {
    const RimNormal to = rim_to_line(c, end, b.c, b.d(), best.gap < 0);
    if (to.found) offer_any(to.n);
  }
  if (meets()) return;
  for (int i = 0; i < c.ends(); ++i)
    for (int j = 0; j < b.ends(); ++j)
      if (start_over_rims(c.end(i), b.end(j))) return;
}

// From the way between the rims' middles, and from the normal of each end towards what of the other's rim is beyond it;
// until there is nothing better.
bool Search::start_over_rims(int end_c, int end_b) {
  const PlacedCylinder& b = *x.cylinder;
  const Vec3 q = b.middle(end_b) - c.middle(end_c);
  if (q.squaredNorm() > 0) {
    Vec3 n = q.normalized();
    for (const Vec3& axis : {c.d(), b.d()})  // about them there is no rim
      if (n.cross(axis).squaredNorm() < 1e-4) n = (n + 0.1 * axis.unitOrthogonal()).normalized();
    over_rims(end_c, end_b, n);
    if (best.gap > 0 && meets()) return true;
  }
  const auto from_end = [&](const PlacedCylinder& of, int end, const PlacedCylinder& other, int other_end,
                            double sign) {
    constexpr double tilt = 0.02;
    const Vec3 d = end * of.d(), p = other.rim(other_end, -d), beyond = of.across(p - of.middle(end));
    if (beyond.squaredNorm() > of.r * of.r)
      over_rims(end_c, end_b, sign * (d + tilt * beyond.normalized()).normalized());
  };
  from_end(c, end_c, b, end_b, 1);
  from_end(b, end_b, c, end_c, -1);
  return meets();
}

CylinderAxis search(const PlacedCylinder& c, const Opposite& x, double margin, double enough, bool carrying) {
  Search search{c, x, margin, carrying};
  const auto done = [&] { return search.best.gap > enough || search.meets(); };
  if (x.core != nullptr) {
    search.over_faces();
    if (x.core->solid() && done()) return search.best;
  }
  search.over_ends();
  if (done()) return search.best;
  if (x.cylinder != nullptr && c.r == 0) {
    search.over_point();
  } else if (x.cylinder != nullptr) {
    search.over_cylinder();
  } else {
    search.over_vertices();
    if (!search.meets()) search.over_edges();
  }
  return search.best;
}

}  // namespace

CylinderAxis separating_axis(const PlacedCylinder& c, const Opposite& x, double margin, double enough) {
  return search(c, x, margin, enough, false);
}

CylinderAxis carrying_axis(const PlacedCylinder& c, const PlacedCore& x, double margin) {
  return search(c, {&x, nullptr}, margin, std::numeric_limits<double>::infinity(), true);
}

}  // namespace cb
