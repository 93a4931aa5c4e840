#pragma once

#include <array>
#include <stdexcept>
#include <string>
#include <vector>

#include "dynamics/model.h"

namespace cb {

/// A file that is no mesh: what() names file and line (or facet), and what would be right.
struct NoMesh : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The points of a Wavefront OBJ file (its v lines; faces and all else are not looked at) or of an STL file, text or
/// binary, each once, in the order of their coordinates. The name's ending says which: .obj or .stl, in any case. At
/// most 64 MB. `scale`: m for each of the file's units. Throws NoMesh.
std::vector<Vec3> read_mesh_points(const std::string& path, double scale);

/// The triangles of such a file, in its order, corners counter-clockwise seen from outside: polygons (f lines of an OBJ
/// file) as the fans about their first corners. Throws NoMesh.
std::vector<std::array<Vec3, 3>> read_mesh_triangles(const std::string& path, double scale);

/// Is this a name that they would take?
bool is_mesh_name(const std::string& path);

}  // namespace cb
