// Reads <heightfield> and <mesh>: a fixed ground of triangles, whose prisms (geometry/terrain.h) are bodies like the
// copies of an <array>.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "geometry/terrain.h"
#include "scenario/mesh_file.h"
#include "scenario/solid.h"

namespace cb {

namespace {

constexpr std::size_t triangle_limit = 100000;  // of one ground

/// The largest extent along x or z of a triangle, m.
double width(const std::vector<Triangle>& triangles) {
  double widest = 0;
  for (const Triangle& t : triangles)
    for (int k = 0; k < 3; ++k) {
      const Vec3 side = (t[(k + 1) % 3] - t[k]).cwiseAbs();
      widest = std::max({widest, side.x(), side.z()});
    }
  return widest;
}

/// Declares the prisms. `from`: the attribute that the triangles came from.
void declare_ground(Reading& in, const XmlElement& element, const XmlAttribute& from,
                    const std::vector<Triangle>& triangles) {
  if (triangles.size() > triangle_limit)
    in.values.fail(from, fmt::format("{} triangles, more than {}; make them larger, or leave out what no body reaches",
                                     triangles.size(), triangle_limit));
  const XmlAttribute* depth = element.find("depth");
  const double thickness = depth != nullptr ? in.values.number(*depth, positive) : width(triangles);
  Pose pose;
  pose.p = in.vector(*element.find("position"), "x y z in m");
  pose.q = in.orientation(element);
  const int array = in.arrays++;
  int copy = 0;
  for (const auto& prism : ground_prisms(triangles, thickness)) {
    if (!std::isfinite(prism->volume) || !(prism->volume > 0))
      in.values.fail(from, "a triangle so small, or so large, that the volume below it is out of a number's range");
    Shape shape = hull_shape(prism);
    shape.local = {pose * prism->frame.p, pose.q};
    in.declare_body(element, fmt::format("_{}", ++copy), array, std::move(shape));
  }
}

}  // namespace

void read_heightfield(Reading& in, const XmlElement& element) {
  check_empty(in.source, element);
  check_attributes(in.source, element, {"name", "position", "columns", "spacing", "heights"},
                   {"axis", "angle", "quaternion", "depth"});
  const XmlAttribute &spacing = *element.find("spacing"), &attribute = *element.find("heights");
  const auto columns = static_cast<std::size_t>(
      in.values.integer(*element.find("columns"), 2, static_cast<long>(triangle_limit) / 2 + 1));
  const std::vector<double> step = in.values.numbers(spacing, 2, "along x and z, in m");
  if (std::min(step[0], step[1]) <= 0)
    in.values.fail(spacing, fmt::format("spacing is {} {}; both have to be more than 0", step[0], step[1]));
  const std::vector<double> heights = in.values.row(attribute);
  if (heights.size() % columns != 0 || heights.size() < 2 * columns)
    in.values.fail(attribute, fmt::format("{} heights are no two or more rows of {} columns; write a row of {} heights "
                                          "along x for each step along z",
                                          heights.size(), columns, columns));
  const auto at = [&](std::size_t i, std::size_t j) {
    return Vec3(static_cast<double>(i) * step[0], heights[j * columns + i], static_cast<double>(j) * step[1]);
  };
  std::vector<Triangle> triangles;
  for (std::size_t j = 0; j + 1 < heights.size() / columns; ++j)
    for (std::size_t i = 0; i + 1 < columns; ++i) {
      triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j + 1)});
      triangles.push_back({at(i, j), at(i + 1, j + 1), at(i + 1, j)});
    }
  if (!std::all_of(triangles.begin(), triangles.end(), looks_up))
    in.values.fail(attribute, "two heights side by side are a wall (steeper than a million); make it less steep");
  declare_ground(in, element, attribute, triangles);
}

void read_mesh(Reading& in, const XmlElement& element) {
  check_empty(in.source, element);
  check_attributes(in.source, element, {"name", "position", "file"}, {"axis", "angle", "quaternion", "scale", "depth"});
  const XmlAttribute &file = *element.find("file"), *scale = element.find("scale");
  const std::string path = in.beside_scene(file.value);
  std::vector<Triangle> triangles;
  try {
    triangles = read_mesh_triangles(path, scale != nullptr ? in.values.number(*scale, positive) : 1);
  } catch (const NoMesh& error) {
    in.values.fail(file, fmt::format("{} (a mesh's file is named from the scene's folder on)", error.what()));
  }
  const std::size_t all = triangles.size();
  std::erase_if(triangles, [](const Triangle& t) { return !looks_up(t); });
  if (triangles.empty())
    in.values.fail(file, fmt::format("none of the {} triangles of {} looks up (along y, corners counter-clockwise seen "
                                     "from above); turn the mesh, or the order of its corners",
                                     all, path));
  in.note_file(path);
  if (triangles.size() < all)
    in.scenario.left_out.push_back(
        fmt::format("{} of {} triangles of {}: they look down or stand upright, and are no "
                    "ground",
                    all - triangles.size(), all, path));
  declare_ground(in, element, file, triangles);
}

}  // namespace cb
