#include "scenario/solid.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

namespace cb {

const std::vector<std::string>& solids() {
  static const std::vector<std::string> names{"box", "sphere", "cylinder"};
  return names;
}

bool is_solid(const XmlElement& element) {
  return std::find(solids().begin(), solids().end(), element.name) != solids().end();
}

std::vector<std::string> needs(const XmlElement& solid) {
  if (solid.name == "cylinder") return {"name", "radius", "length", "position"};
  return {"name", solid.name == "box" ? "size" : "radius", "position"};
}

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
