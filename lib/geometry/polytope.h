#pragma once

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "dynamics/model.h"

namespace cb {

using Directions = std::shared_ptr<const std::vector<Vec3>>;  ///< unit

/// What goes on beside a polytope that is one of several which make one surface (terrain.h). Inner faces, and edges and
/// vertices across which the surface goes on flat or bends up, keep bodies apart, but carry none: what is beside them
/// does. An edge or a vertex across which it bends down carries along normals that none of `beyond` rises above.
struct Seams {
  std::vector<char> inner;                     ///< per face: is it covered by a neighbour?
  std::vector<char> sharp_edge, sharp_vertex;  ///< does the surface bend down there?
  std::vector<Directions> beyond_edge;         ///< per edge: into the faces of neighbours; null: none there
  std::vector<Directions> beyond_vertex;       ///< per vertex: along the edges of neighbours
};

/// A convex polytope in a shape's frame. Also what is thinner: a point (one vertex) and a segment (two, one edge).
struct Polytope {
  struct Face {
    Vec3 normal;        ///< unit, outward
    double offset = 0;  ///< m: no vertex is above { x : normal.x = offset }
    int first = 0;      ///< its corners are loop[first], ..., counter-clockwise seen from outside
    int count = 0;
  };
  /// `left` is the face whose loop goes from `from` to `to`, `right` the one that goes back; -1 where there is none.
  struct Edge {
    int from, to, left, right;
  };
  std::vector<Vec3> vertices;  ///< m
  std::vector<Face> faces;
  std::vector<int> loop;
  std::vector<Edge> edges;
  std::shared_ptr<const Seams> seams = nullptr;  ///< null: all of it carries

  int corner(const Face& face, int k) const { return loop[face.first + (k < face.count ? k : k - face.count)]; }
  double bounding_radius() const;  ///< of its vertices about the frame's origin, m
  Vec3 half_extents() const;       ///< of the box about the frame's origin with the frame's axes, m
};

/// Points that have no hull with a volume, or too many: what() says which.
struct NoHull : std::runtime_error {
  using std::runtime_error::runtime_error;
};
inline constexpr std::size_t most_hull_points = 100000;  ///< that convex_hull takes
inline constexpr std::size_t most_hull_vertices = 1000;  ///< that a hull has

/// The convex hull of points (m). Faces whose corners all lie within 1e-9 of the points' extent of one plane are one
/// polygon; points closer than 2^-40 of the extent are one. Throws NoHull.
Polytope convex_hull(const std::vector<Vec3>& points);

/// The polytope of points, all of them vertices, and the loops of its faces, counter-clockwise seen from outside.
Polytope polytope_of_faces(const std::vector<Vec3>& points, const std::vector<std::vector<int>>& loops);

/// Of the solid polytope at density 1.
struct SolidMoments {
  double volume = 0;            ///< m^3
  Vec3 centre = Vec3::Zero();   ///< of mass, m
  Mat3 inertia = Mat3::Zero();  ///< about the centre, m^5
};
SolidMoments solid_moments(const Polytope& polytope);

/// A solid hull in the frame of its centre and principal axes. These are the axes that are nearest to the points' own;
/// where the points' axes are principal to 1e-12 of the largest moment, they are kept. A ground's prism, which never
/// moves, has the axes of its triangles.
struct Hull {
  Polytope polytope;
  Pose frame;                            ///< of that frame in the points' frame
  double radius = 0;                     ///< of the sphere about its origin that contains it, m
  double size = 0;                       ///< the largest extent along the points' axes, m
  double volume = 0;                     ///< m^3
  Vec3 inertia_per_mass = Vec3::Zero();  ///< about its axes, m^2
};
/// Throws NoHull.
Hull make_hull(const std::vector<Vec3>& points);

/// The cube with corners (+-1, +-1, +-1).
const Polytope& unit_box();
/// From (0, -1, 0) to (0, 1, 0).
const Polytope& unit_segment();
/// The origin.
const Polytope& single_point();

}  // namespace cb
