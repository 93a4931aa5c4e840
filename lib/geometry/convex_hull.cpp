// The convex hull of points, and the moments of the solid.
//
// Problem: n points (m), not all in a plane; the vertices, polygons and edges of their convex hull. Source: Chand and
// Kapur, "An algorithm for convex polytopes" (1970), gift wrapping: about each edge of the hull, the plane through it
// that has all points on one side. Differences from the source:
//   1. Points are rounded to a grid of 2^-40 of their extent, on which the volume of four points is an integer of less
//      than 127 bits and its sign exact: which points are in a plane, and which side the others are on, contradicts
//      itself nowhere, so that the polygons close. The vertices keep their unrounded places.
//   2. All points in a plane are one polygon at once.
//   3. Polygons of points that are in one plane but for rounding (1e-9 of the extent) are then joined.
// A library (qhull) merges facets by estimates of its round-off, keeps its state in one large struct and leaves by
// longjmp; hulls here are read once and small, O(n) for each edge is enough, and nothing has to be installed.
// Moments: Eberly, "Polyhedral mass properties (revisited)" (2002): sums over tetrahedra from an inner point.
// Fails, as NoHull: fewer than four points, points in one plane (to 1e-6 of the extent), or too many.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "geometry/polytope.h"
#include "linalg/stop.h"

namespace cb {

namespace {

constexpr double coplanar = 1e-9;  // of the extent: corners of faces that are joined are as near to one plane
constexpr double flattest = 1e-6;  // of the extent: thinner is flat
constexpr int grid_bits = 40;
constexpr double least_extent = 1e-30;  // m, and its inverse the most: fifth powers of it are numbers

__extension__ using Wide = __int128;
using Cell = std::array<long long, 3>;

struct Wrap {
  std::vector<Cell> cells;  // the points on the grid, each once

  // Six times the volume of a, b, c, d: positive where d is above the plane in which a, b, c turn counter-clockwise.
  int side(int a, int b, int c, int d) const;
  std::vector<int> polygon(int a, int b, int c) const;
  int wrap(int a, int b, int inside) const;
  std::vector<int> first_face() const;
  std::vector<std::vector<int>> faces() const;
};

int sign_of(Wide x) { return (x > 0) - (x < 0); }

int Wrap::side(int a, int b, int c, int d) const {
  Wide u[3], v[3], w[3];
  for (int i = 0; i < 3; ++i) {
    u[i] = cells[b][i] - cells[a][i];
    v[i] = cells[c][i] - cells[a][i];
    w[i] = cells[d][i] - cells[a][i];
  }
  return sign_of((u[1] * v[2] - u[2] * v[1]) * w[0] + (u[2] * v[0] - u[0] * v[2]) * w[1] +
                 (u[0] * v[1] - u[1] * v[0]) * w[2]);
}

bool in_line(const Cell& a, const Cell& b, const Cell& c) {
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    if (static_cast<Wide>(b[i] - a[i]) * (c[j] - a[j]) != static_cast<Wide>(b[j] - a[j]) * (c[i] - a[i])) return false;
  }
  return true;
}

// Of the points in the plane a, b, c, with a b an edge of the hull and all others below: the corners of their hull,
// counter-clockwise seen from above, from a on.
std::vector<int> Wrap::polygon(int a, int b, int c) const {
  // Seen along the axis that the plane's normal is most along; `flip` where it looks the other way.
  Wide normal[3];
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    normal[i] = static_cast<Wide>(cells[b][j] - cells[a][j]) * (cells[c][k] - cells[a][k]) -
                static_cast<Wide>(cells[b][k] - cells[a][k]) * (cells[c][j] - cells[a][j]);
  }
  int axis = 0;
  for (int i = 1; i < 3; ++i)
    if ((normal[i] < 0 ? -normal[i] : normal[i]) > (normal[axis] < 0 ? -normal[axis] : normal[axis])) axis = i;
  const int x = (axis + 1) % 3, y = (axis + 2) % 3, flip = sign_of(normal[axis]);
  std::vector<int> plane;
  for (int d = 0; d < static_cast<int>(cells.size()); ++d)
    if (side(a, b, c, d) == 0) plane.push_back(d);
  const auto left_of = [&](int p, int q, int r) {  // is r left of p q?
    return flip * sign_of(static_cast<Wide>(cells[q][x] - cells[p][x]) * (cells[r][y] - cells[p][y]) -
                          static_cast<Wide>(cells[q][y] - cells[p][y]) * (cells[r][x] - cells[p][x]));
  };
  const auto further = [&](int p, int q, int r) {  // of two in one direction from p
    const auto length = [&](int s) {
      const Wide dx = cells[s][x] - cells[p][x], dy = cells[s][y] - cells[p][y];
      return dx * dx + dy * dy;
    };
    return length(r) > length(q);
  };
  std::vector<int> corners{a};
  for (int p = a;;) {
    int q = -1;
    for (const int r : plane) {
      if (r == p) continue;
      const int turn = q < 0 ? -1 : left_of(p, q, r);
      if (turn < 0 || (turn == 0 && further(p, q, r))) q = r;
    }
    if (q == a) return corners;
    corners.push_back(q);
    p = q;
  }
}

// About the edge a b of a face (whose loop goes from b to a) that has the corner `inside`: the point c with all others
// on or below the plane of a, b, c.
int Wrap::wrap(int a, int b, int inside) const {
  int c = inside;
  for (int d = 0; d < static_cast<int>(cells.size()); ++d)
    if (side(a, b, c, d) > 0) c = d;
  return c;
}

// A face: first the plane that is parallel to z and touches at the lowest point (by x, then y, then z), then about the
// line of points in it where they are in line.
std::vector<int> Wrap::first_face() const {
  const int n = static_cast<int>(cells.size());
  const int a = static_cast<int>(std::min_element(cells.begin(), cells.end()) - cells.begin());
  const auto right_of = [&](int p, int q) {  // seen along z from a: is q right of p?
    return sign_of(static_cast<Wide>(cells[p][1] - cells[a][1]) * (cells[q][0] - cells[a][0]) -
                   static_cast<Wide>(cells[p][0] - cells[a][0]) * (cells[q][1] - cells[a][1]));
  };
  int b = -1;
  for (int d = 0; d < n; ++d) {
    if (cells[d][0] == cells[a][0] && cells[d][1] == cells[a][1]) continue;
    if (b < 0 || right_of(b, d) > 0) b = d;
  }
  if (b < 0) return {};
  int off_line = -1, end = b;
  for (int d = 0; d < n; ++d) {
    if (d == a || d == b || right_of(b, d) != 0) continue;
    if (!in_line(cells[a], cells[b], cells[d]))
      off_line = d;
    else if (std::pair(cells[d][0], cells[d][1]) > std::pair(cells[end][0], cells[end][1]))
      end = d;
  }
  if (off_line < 0) {
    for (int d = 0; d < n && off_line < 0; ++d)
      if (!in_line(cells[a], cells[end], cells[d])) off_line = d;
    if (off_line < 0) return {};
    off_line = wrap(a, end, off_line);
  }
  // The other points are on one side: below.
  for (int d = 0; d < n; ++d) {
    const int where = side(a, end, off_line, d);
    if (where != 0) return where < 0 ? polygon(a, end, off_line) : polygon(a, off_line, end);
  }
  return {};
}

// All faces; none where the points are in a plane.
std::vector<std::vector<int>> Wrap::faces() const {
  std::vector<std::vector<int>> all;
  std::set<std::pair<int, int>> done;
  std::set<int> corners;
  const auto add = [&](std::vector<int> loop) {
    for (std::size_t k = 0; k < loop.size(); ++k) done.emplace(loop[k], loop[(k + 1) % loop.size()]);
    corners.insert(loop.begin(), loop.end());
    if (corners.size() > most_hull_vertices)
      throw NoHull("the hull has more than " + std::to_string(most_hull_vertices) + " vertices");
    all.push_back(std::move(loop));
  };
  std::vector<int> first = first_face();
  if (first.size() < 3) return {};
  add(std::move(first));
  for (std::size_t f = 0; f < all.size(); ++f) {
    for (std::size_t k = 0; k < all[f].size(); ++k) {
      poll_stop();
      const std::size_t count = all[f].size();
      const int a = all[f][(k + 1) % count], b = all[f][k], inside = all[f][(k + 2) % count];
      if (!done.contains({a, b})) add(polygon(a, b, wrap(a, b, inside)));
    }
  }
  return all;
}

// Of a loop of points: twice the area times the normal (Newell).
Vec3 twice_area(const std::vector<Vec3>& x, const std::vector<int>& loop) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = 1; k + 1 < loop.size(); ++k) sum += (x[loop[k]] - x[loop[0]]).cross(x[loop[k + 1]] - x[loop[0]]);
  return sum;
}

// The loop around faces that hang together; empty where it is not one.
std::vector<int> loop_around(const std::vector<std::vector<int>>& faces, const std::vector<int>& group) {
  std::set<std::pair<int, int>> sides;
  for (const int f : group)
    for (std::size_t k = 0; k < faces[f].size(); ++k) sides.emplace(faces[f][k], faces[f][(k + 1) % faces[f].size()]);
  std::map<int, int> next;
  for (const auto& [from, to] : sides)
    if (!sides.contains({to, from}) && !next.emplace(from, to).second) return {};
  if (next.empty()) return {};
  std::vector<int> loop{next.begin()->first};
  while (next.at(loop.back()) != loop.front()) loop.push_back(next.at(loop.back()));
  return loop.size() == next.size() ? loop : std::vector<int>{};
}

// Joins what is in one plane but for rounding, the largest faces first.
std::vector<std::vector<int>> joined(const std::vector<Vec3>& x, const std::vector<std::vector<int>>& faces,
                                     double tolerance) {
  std::map<std::pair<int, int>, int> face_of;
  std::vector<double> area;
  std::vector<int> order;
  for (int f = 0; f < static_cast<int>(faces.size()); ++f) {
    for (std::size_t k = 0; k < faces[f].size(); ++k) face_of[{faces[f][k], faces[f][(k + 1) % faces[f].size()]}] = f;
    area.push_back(twice_area(x, faces[f]).norm());
    order.push_back(f);
  }
  std::stable_sort(order.begin(), order.end(), [&](int f, int g) { return area[f] > area[g]; });
  std::vector<char> used(faces.size(), 0);
  std::vector<std::vector<int>> out;
  for (const int seed : order) {
    if (used[seed]) continue;
    const Vec3 n = twice_area(x, faces[seed]).normalized();
    std::vector<int> group{seed};
    used[seed] = 1;
    for (std::size_t g = 0; g < group.size(); ++g) {
      const std::vector<int>& loop = faces[group[g]];
      for (std::size_t k = 0; k < loop.size(); ++k) {
        const int other = face_of.at({loop[(k + 1) % loop.size()], loop[k]});
        const auto off = [&](int i) { return std::abs(n.dot(x[i] - x[faces[seed][0]])) > tolerance; };
        if (used[other] || std::any_of(faces[other].begin(), faces[other].end(), off)) continue;
        used[other] = 1;
        group.push_back(other);
      }
    }
    std::vector<int> loop = loop_around(faces, group);
    if (!loop.empty())
      out.push_back(std::move(loop));
    else
      for (const int f : group) out.push_back(faces[f]);
  }
  // A point between two faces alone is in the middle of their edge.
  std::map<int, int> faces_at;
  for (const auto& loop : out)
    for (const int i : loop) ++faces_at[i];
  for (auto& loop : out)
    if (loop.size() > 3) std::erase_if(loop, [&](int i) { return faces_at[i] < 3; });
  return out;
}

// The polytope of loops over some of the points.
Polytope polytope_of(const std::vector<Vec3>& x, const std::vector<std::vector<int>>& loops) {
  Polytope out;
  std::map<int, int> number;
  for (const auto& loop : loops)
    for (const int i : loop) number.emplace(i, 0);
  for (auto& [i, k] : number) {
    k = static_cast<int>(out.vertices.size());
    out.vertices.push_back(x[i]);
  }
  std::map<std::pair<int, int>, int> edge_of;
  for (const auto& loop : loops) {
    const int f = static_cast<int>(out.faces.size());
    Polytope::Face face;
    face.normal = twice_area(x, loop).normalized();
    face.first = static_cast<int>(out.loop.size());
    face.count = static_cast<int>(loop.size());
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const int from = number.at(loop[k]), to = number.at(loop[(k + 1) % loop.size()]);
      out.loop.push_back(from);
      if (const auto back = edge_of.find({to, from}); back != edge_of.end()) {
        out.edges[back->second].right = f;
      } else {
        edge_of[{from, to}] = static_cast<int>(out.edges.size());
        out.edges.push_back({from, to, f, -1});
      }
    }
    out.faces.push_back(face);
  }
  return out;
}

void set_offsets(Polytope& polytope) {
  for (Polytope::Face& face : polytope.faces) {
    face.offset = -HUGE_VAL;
    for (const Vec3& x : polytope.vertices) face.offset = std::max(face.offset, face.normal.dot(x));
  }
}

double thickness(const Polytope& polytope) {
  double least = HUGE_VAL;
  for (const Polytope::Face& face : polytope.faces) {
    double depth = 0;
    for (const Vec3& x : polytope.vertices) depth = std::max(depth, face.offset - face.normal.dot(x));
    least = std::min(least, depth);
  }
  return least;
}

bool closed(const Polytope& polytope) {
  const auto V = polytope.vertices.size(), E = polytope.edges.size(), F = polytope.faces.size();
  return V + F == E + 2 && std::all_of(polytope.edges.begin(), polytope.edges.end(),
                                       [](const Polytope::Edge& edge) { return edge.right >= 0; });
}

// A rotation to axes in which a symmetric matrix is diagonal: those nearest to its own.
Mat3 principal_axes(const Mat3& inertia) {
  constexpr double diagonal = 1e-12;
  const double largest = inertia.diagonal().maxCoeff();
  if (std::max({std::abs(inertia(0, 1)), std::abs(inertia(0, 2)), std::abs(inertia(1, 2))}) <= diagonal * largest)
    return Mat3::Identity();
  const Mat3 axes = Eigen::SelfAdjointEigenSolver<Mat3>(inertia).eigenvectors();
  int order[3] = {0, 1, 2}, best[3] = {0, 1, 2};
  double nearest = -1;
  do {
    double sum = 0;
    for (int i = 0; i < 3; ++i) sum += std::abs(axes(i, order[i]));
    if (sum > nearest) {
      nearest = sum;
      std::copy_n(order, 3, best);
    }
  } while (std::next_permutation(order, order + 3));
  // With a diagonal of none below 0 whose sum is the largest of all orders this turns: a mirror's is at most 1, and the
  // mean over the orders is a third of the sum of all entries' sizes, at least a third of that of their squares, 1.
  Mat3 R;
  for (int i = 0; i < 3; ++i) {
    R.col(i) = axes(i, best[i]) < 0 ? Vec3(-axes.col(best[i])) : Vec3(axes.col(best[i]));
  }
  return R;
}

}  // namespace

double Polytope::bounding_radius() const {
  double square = 0;
  for (const Vec3& x : vertices) square = std::max(square, x.squaredNorm());
  return std::sqrt(square);
}

Vec3 Polytope::half_extents() const {
  Vec3 h = Vec3::Zero();
  for (const Vec3& x : vertices) h = h.cwiseMax(x.cwiseAbs());
  return h;
}

Polytope convex_hull(const std::vector<Vec3>& points) {
  if (points.size() > most_hull_points)
    throw NoHull(std::to_string(points.size()) + " points, more than " + std::to_string(most_hull_points));
  if (points.size() < 4) throw NoHull(std::to_string(points.size()) + " points; a solid has at least 4");
  Vec3 low = points[0], high = points[0];
  for (const Vec3& x : points) {
    if (!x.allFinite()) throw NoHull("a point that is not finite");
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  const double extent = (high - low).maxCoeff();
  if (!(extent >= least_extent) || !(extent <= 1 / least_extent))
    throw NoHull("points so near to each other, or so far apart, that their volume is out of a number's range");
  // The first point of each cell, in the order of the cells.
  std::map<Cell, int> first;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3 on_grid = (points[i] - low) / extent * std::ldexp(1.0, grid_bits);
    first.emplace(Cell{std::llround(on_grid.x()), std::llround(on_grid.y()), std::llround(on_grid.z())},
                  static_cast<int>(i));
  }
  Wrap wrap;
  std::vector<Vec3> x;
  for (const auto& [cell, i] : first) {
    wrap.cells.push_back(cell);
    x.push_back(points[i]);
  }
  const auto faces = wrap.faces();
  if (faces.empty()) throw NoHull("all points are in one plane");
  Polytope out = polytope_of(x, joined(x, faces, coplanar * extent));
  if (!closed(out)) out = polytope_of(x, faces);
  set_offsets(out);
  if (!closed(out) || thickness(out) < flattest * extent)
    throw NoHull("all points are in one plane (but for 1e-6 of their extent)");
  return out;
}

Polytope polytope_of_faces(const std::vector<Vec3>& points, const std::vector<std::vector<int>>& loops) {
  Polytope out = polytope_of(points, loops);
  set_offsets(out);
  return out;
}

SolidMoments solid_moments(const Polytope& polytope) {
  Vec3 inner = Vec3::Zero();
  for (const Vec3& x : polytope.vertices) inner += x / static_cast<double>(polytope.vertices.size());
  double volume = 0;
  Vec3 first = Vec3::Zero();
  Mat3 second = Mat3::Zero();
  for (const Polytope::Face& face : polytope.faces) {
    for (int k = 1; k + 1 < face.count; ++k) {
      // Integrals over the tetrahedron with corners 0, a, b, c.
      const Vec3 a = polytope.vertices[polytope.corner(face, 0)] - inner;
      const Vec3 b = polytope.vertices[polytope.corner(face, k)] - inner;
      const Vec3 c = polytope.vertices[polytope.corner(face, k + 1)] - inner;
      const double part = a.dot(b.cross(c)) / 6;
      const Vec3 sum = a + b + c;
      volume += part;
      first += part / 4 * sum;
      second += part / 20 * (a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose());
    }
  }
  SolidMoments out;
  out.volume = volume;
  const Vec3 centre = first / volume;
  out.centre = inner + centre;
  second -= volume * centre * centre.transpose();
  out.inertia = second.trace() * Mat3::Identity() - second;
  return out;
}

Hull make_hull(const std::vector<Vec3>& points) {
  Hull out;
  out.polytope = convex_hull(points);
  const SolidMoments moments = solid_moments(out.polytope);
  const Mat3 R = principal_axes(moments.inertia);
  Vec3 low = out.polytope.vertices[0], high = low;
  for (const Vec3& x : out.polytope.vertices) {
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  out.size = (high - low).maxCoeff();
  out.volume = moments.volume;
  out.inertia_per_mass = (R.transpose() * moments.inertia * R).diagonal() / moments.volume;
  out.frame = {moments.centre, Quat(R).normalized()};
  const Mat3 back = out.frame.q.toRotationMatrix().transpose();
  for (Vec3& x : out.polytope.vertices) x = back * (x - moments.centre);
  for (Polytope::Face& face : out.polytope.faces) face.normal = back * face.normal;
  set_offsets(out.polytope);
  out.radius = out.polytope.bounding_radius();
  return out;
}

const Polytope& unit_box() {
  static const Polytope box = [] {
    std::vector<Vec3> corners;
    for (int k = 0; k < 8; ++k) corners.emplace_back(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1);
    return convex_hull(corners);
  }();
  return box;
}

const Polytope& unit_segment() {
  static const Polytope segment{{Vec3(0, -1, 0), Vec3(0, 1, 0)}, {}, {}, {{0, 1, -1, -1}}};
  return segment;
}

const Polytope& single_point() {
  static const Polytope point{{Vec3::Zero()}, {}, {}, {}};
  return point;
}

}  // namespace cb
