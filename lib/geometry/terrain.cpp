// A ground of triangles, as one convex prism for each.
//
// Problem: bodies are convex, a ground is not. Each triangle carries as the top of a solid prism; but prisms side by
// side have faces and edges that the ground does not have, and a body that slides over them must not bump into these
// ("ghost collisions"). Which features of a prism are the ground's own is decided here once, from its neighbours:
//   a side that a neighbour shares is inner;
//   a seam is sharp where the neighbour bends down; along a normal it carries where the neighbour does not rise above
//   the plane across that normal, that is between the normals of the two triangles;
//   a corner carries along the normals above whose planes none of the ground's edges there rises;
//   the upright edge below a corner of the ground's outline is sharp, also where several triangles share the corner.
// The bottom, and sides without a neighbour, are the outside of a solid like others.
#include "geometry/terrain.h"

#include <algorithm>
#include <map>
#include <utility>

#include "linalg/stop.h"

namespace cb {

namespace {

constexpr double upright = 1e-6;  // sine: triangles steeper than this are walls
constexpr double flat = 1e-9;     // sine: neighbours that bend down by less do not

// Faces of a prism with the corners 0, 1, 2 and 3, 4, 5 below them: top, bottom, and the side below the top's side k.
const std::vector<std::vector<int>> loops{{0, 1, 2}, {3, 5, 4}, {1, 0, 3, 4}, {2, 1, 4, 5}, {0, 2, 5, 3}};
constexpr int side_face = 2;  // of side 0

int after(int k) { return (k + 1) % 3; }

Vec3 normal_of(const Triangle& t) { return (t[1] - t[0]).cross(t[2] - t[0]).normalized(); }

/// Which triangles and corners are neighbours.
struct Mesh {
  std::vector<std::array<int, 3>> corner, neighbour;  ///< per triangle: its points; beyond its sides, -1: none
  std::vector<Directions> around;                     ///< per point: along the edges there
};

Mesh mesh_of(const std::vector<Triangle>& triangles) {
  Mesh mesh;
  std::map<std::array<double, 3>, int> point_of;
  std::vector<Vec3> point;
  std::map<std::pair<int, int>, int> left_of;  // of the way from a point to another; -2: several
  for (int t = 0; t < static_cast<int>(triangles.size()); ++t) {
    mesh.corner.emplace_back();
    for (int k = 0; k < 3; ++k) {
      const Vec3& x = triangles[t][k];
      const auto [found, is_new] =
          point_of.try_emplace({x.x() + 0.0, x.y() + 0.0, x.z() + 0.0}, static_cast<int>(point.size()));
      if (is_new) point.push_back(x);
      mesh.corner[t][k] = found->second;
    }
    for (int k = 0; k < 3; ++k) {
      const auto [found, is_new] = left_of.try_emplace({mesh.corner[t][k], mesh.corner[t][after(k)]}, t);
      if (!is_new) found->second = -2;
    }
  }
  std::vector<std::vector<Vec3>> around(point.size());
  for (const auto& [way, t] : left_of) {
    const Vec3 along = (point[way.second] - point[way.first]).normalized();
    around[way.first].push_back(along);
    if (!left_of.contains({way.second, way.first})) around[way.second].push_back(-along);
  }
  for (std::vector<Vec3>& directions : around)
    mesh.around.push_back(std::make_shared<const std::vector<Vec3>>(std::move(directions)));
  for (const std::array<int, 3>& corner : mesh.corner) {
    mesh.neighbour.emplace_back();
    for (int k = 0; k < 3; ++k) {
      const auto back = left_of.find({corner[after(k)], corner[k]});
      const bool single = left_of.at({corner[k], corner[after(k)]}) >= 0;
      mesh.neighbour.back()[k] = single && back != left_of.end() ? std::max(-1, back->second) : -1;
    }
  }
  return mesh;
}

// Is a point of the ground's outline a corner of it? `outward`: normal of an outer side there. Then all of the ground's
// edges there but that side's are behind its plane; along a straight outline the next side's is in it.
bool is_outer_corner(const std::vector<Vec3>& around, const Vec3& outward) {
  return std::count_if(around.begin(), around.end(), [&](const Vec3& d) { return outward.dot(d) >= -flat; }) <= 1;
}

Seams seams_of(const std::vector<Triangle>& triangles, const Mesh& mesh, int t, const Polytope& prism) {
  Seams seams;
  seams.inner.assign(loops.size(), 0);
  for (int k = 0; k < 3; ++k) seams.inner[side_face + k] = mesh.neighbour[t][k] >= 0;
  seams.sharp_vertex.assign(prism.vertices.size(), 0);
  for (const Polytope::Edge& edge : prism.edges) {
    const int top_or_bottom = std::min(edge.left, edge.right);
    bool sharp = seams.inner[edge.left] == 0 && seams.inner[edge.right] == 0;
    Directions beyond;
    if (top_or_bottom >= side_face) {
      beyond = mesh.around[mesh.corner[t][edge.from % 3]];  // upright
      if (seams.inner[edge.left] != seams.inner[edge.right])
        sharp = is_outer_corner(*beyond, prism.faces[seams.inner[edge.left] ? edge.right : edge.left].normal);
    } else if (!sharp) {
      const int k = std::max(edge.left, edge.right) - side_face;
      const Triangle& other = triangles[mesh.neighbour[t][k]];
      const Vec3 along = (triangles[t][after(k)] - triangles[t][k]).normalized();
      // From the side across the neighbour, which has it the other way round.
      const Vec3 across = along.cross(normal_of(other));
      beyond = std::make_shared<const std::vector<Vec3>>(1, across);
      sharp = prism.faces[top_or_bottom].normal.dot(across) < -flat;
    }
    seams.sharp_edge.push_back(sharp);
    seams.beyond_edge.push_back(std::move(beyond));
    if (sharp) seams.sharp_vertex[edge.from] = seams.sharp_vertex[edge.to] = 1;
  }
  for (int i = 0; i < static_cast<int>(prism.vertices.size()); ++i)
    seams.beyond_vertex.push_back(mesh.around[mesh.corner[t][i % 3]]);
  return seams;
}

}  // namespace

bool looks_up(const Triangle& triangle) {
  const Vec3 n = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
  return n.y() > upright * n.norm();
}

std::vector<std::shared_ptr<const Hull>> ground_prisms(const std::vector<Triangle>& triangles, double depth) {
  const Mesh mesh = mesh_of(triangles);
  std::vector<std::shared_ptr<const Hull>> prisms;
  for (int t = 0; t < static_cast<int>(triangles.size()); ++t) {
    poll_stop();
    const Triangle& top = triangles[t];
    const Vec3 down(0, depth, 0), centre = (top[0] + top[1] + top[2]) / 3 - down / 2;
    std::vector<Vec3> corners;
    for (const Vec3& x : top) corners.push_back(x - centre);
    for (int k = 0; k < 3; ++k) corners.push_back(corners[k] - down);
    Hull prism;
    prism.polytope = polytope_of_faces(corners, loops);
    prism.polytope.seams = std::make_shared<const Seams>(seams_of(triangles, mesh, t, prism.polytope));
    prism.frame.p = centre;
    prism.radius = prism.polytope.bounding_radius();
    const SolidMoments moments = solid_moments(prism.polytope);
    prism.volume = moments.volume;
    prism.inertia_per_mass = moments.inertia.diagonal() / moments.volume;
    Vec3 low = corners[0], high = corners[0];
    for (const Vec3& x : corners) {
      low = low.cwiseMin(x);
      high = high.cwiseMax(x);
    }
    prism.size = (high - low).maxCoeff();
    prisms.push_back(std::make_shared<const Hull>(std::move(prism)));
  }
  return prisms;
}

}  // namespace cb
