#include "scenario/solid.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "scenario/mesh_file.h"

namespace cb {

const std::vector<std::string>& solids() {
  static const std::vector<std::string> names{"box", "sphere", "cylinder", "capsule", "hull"};
  return names;
}

bool is_solid(const XmlElement& element) {
  return std::find(solids().begin(), solids().end(), element.name) != solids().end();
}

std::vector<std::string> needs(const XmlElement& solid) {
  if (solid.name == "hull") return {"name", "position"};
  if (solid.name == "cylinder" || solid.name == "capsule") return {"name", "radius", "length", "position"};
  return {"name", solid.name == "box" ? "size" : "radius", "position"};
}

std::vector<std::string> takes(const XmlElement& solid) {
  if (solid.name == "hull") return {"points", "file", "scale"};
  return {};
}

Shape hull_shape(std::shared_ptr<const Hull> hull) {
  Shape shape;
  shape.kind = ShapeKind::hull;
  shape.half_extents = hull->polytope.half_extents();
  shape.hull = std::move(hull);
  return shape;
}

Pose placed(const Pose& pose, const Solid& solid) {
  if (solid.shape.kind != ShapeKind::hull) return pose;
  return {pose * solid.frame.p, (pose.q * solid.frame.q).normalized()};
}

namespace {

std::shared_ptr<const Hull> hull_of_points(Reading& in, const XmlAttribute& attribute, double scale) {
  std::vector<double> numbers = in.values.points(attribute);
  for (double& x : numbers) x *= scale;
  std::shared_ptr<const Hull>& hull = in.hull_of_points[numbers];
  if (hull) return hull;
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < numbers.size(); i += 3) points.emplace_back(&numbers[i]);
  try {
    hull = std::make_shared<Hull>(make_hull(points));
  } catch (const NoHull& error) {
    in.values.fail(attribute, fmt::format("{}; a hull has at least 4 points that are not in one plane, and at most {} "
                                          "of its points are vertices",
                                          error.what(), most_hull_vertices));
  }
  return hull;
}

std::shared_ptr<const Hull> hull_of_file(Reading& in, const XmlAttribute& attribute, double scale) {
  const std::string path = in.beside_scene(attribute.value);
  std::shared_ptr<const Hull>& hull = in.hull_of_file[{path, scale}];
  if (hull) return hull;
  try {
    hull = std::make_shared<Hull>(make_hull(read_mesh_points(path, scale)));
  } catch (const NoMesh& error) {
    in.values.fail(attribute, fmt::format("{} (a hull's file is named from the scene's folder on)", error.what()));
  } catch (const NoHull& error) {
    in.values.fail(attribute, fmt::format("{}: {}; a hull has at least 4 points that are not in one plane, and at most "
                                          "{} of its points are vertices: simplify the mesh",
                                          path, error.what(), most_hull_vertices));
  }
  in.note_file(path);
  return hull;
}

void read_hull(Reading& in, const XmlElement& element, Solid& solid) {
  const XmlAttribute *points = element.find("points"), *file = element.find("file"), *scale = element.find("scale");
  if (points != nullptr && file != nullptr)
    in.source.fail(file->name_at, "points and file; a hull has one of them: keep one");
  if (points == nullptr && file == nullptr)
    in.source.fail(element.at, "<hull> needs points=\"x y z  x y z ...\" (m), or file=\"part.obj\" (or .stl)");
  const double size = scale != nullptr ? in.values.number(*scale, positive) : 1;
  const auto hull = points != nullptr ? hull_of_points(in, *points, size) : hull_of_file(in, *file, size);
  solid.shape = hull_shape(hull);
  solid.frame = hull->frame;
  solid.volume = hull->volume;
  solid.inertia_per_mass = hull->inertia_per_mass;
}

// A cylinder between two half balls.
void read_capsule(Reading& in, const XmlElement& element, Solid& solid) {
  Shape& shape = solid.shape;
  shape.kind = ShapeKind::capsule;
  const double r = shape.radius = in.values.number(*element.find("radius"), positive);
  const double l = in.values.number(*element.find("length"), not_negative);
  shape.half_extents = Vec3(r, l / 2, r);
  const double middle = std::numbers::pi * r * r * l, ends = 4 * std::numbers::pi / 3 * r * r * r;
  solid.volume = middle + ends;
  const double along = middle * r * r / 2 + ends * 0.4 * r * r;
  const double across = middle * (3 * r * r + l * l) / 12 + ends * (0.4 * r * r + l * l / 4 + 0.375 * r * l);
  solid.inertia_per_mass = Vec3(across, along, across) / solid.volume;
}

}  // namespace

Solid read_solid(Reading& in, const XmlElement& element) {
  Solid solid;
  Shape& shape = solid.shape;
  if (element.name == "box") {
    const XmlAttribute& attribute = *element.find("size");
    const Vec3 size = in.vector(attribute, "x y z in m");
    if (size.minCoeff() <= 0)
      in.values.fail(attribute,
                     fmt::format("size has the edge {}; all three edges have to be more than 0", size.minCoeff()));
    shape.kind = ShapeKind::box;
    shape.half_extents = size / 2;
    solid.volume = size.prod();
    const Vec3 square = size.cwiseAbs2();
    solid.inertia_per_mass = Vec3(square[1] + square[2], square[2] + square[0], square[0] + square[1]) / 12;
  } else if (element.name == "hull") {
    read_hull(in, element, solid);
  } else if (element.name == "capsule") {
    read_capsule(in, element, solid);
  } else if (element.name == "cylinder") {
    shape.kind = ShapeKind::cylinder;
    const double r = shape.radius = in.values.number(*element.find("radius"), positive);
    const double length = in.values.number(*element.find("length"), not_negative);
    shape.half_extents = Vec3(r, length / 2, r);
    solid.volume = std::numbers::pi * r * r * length;
    solid.inertia_per_mass = Vec3(3 * r * r + length * length, 6 * r * r, 3 * r * r + length * length) / 12;
  } else {
    shape.kind = ShapeKind::sphere;
    shape.radius = in.values.number(*element.find("radius"), positive);
    solid.volume = 4 * std::numbers::pi / 3 * shape.radius * shape.radius * shape.radius;
    solid.inertia_per_mass.setConstant(0.4 * shape.radius * shape.radius);
  }
  return solid;
}

}  // namespace cb
