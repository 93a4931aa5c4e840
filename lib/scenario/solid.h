#pragma once

#include <string>
#include <vector>

#include "scenario/reading.h"

namespace cb {

/// A solid shape as its element gives it: kind and extents, without a place.
struct Solid {
  Shape shape;
  double volume = 0;                     ///< m^3
  Vec3 inertia_per_mass = Vec3::Zero();  ///< of the solid, about its centre, m^2
};

/// The names of the elements that are solids.
const std::vector<std::string>& solids();
bool is_solid(const XmlElement& element);
/// The attributes that a solid's element needs: name, extents, position.
std::vector<std::string> needs(const XmlElement& solid);
Solid read_solid(Reading& in, const XmlElement& element);

}  // namespace cb
