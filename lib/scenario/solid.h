#pragma once

#include <string>
#include <vector>

#include "scenario/reading.h"

namespace cb {

/// A solid shape as its element gives it: kind and extents, without a place.
struct Solid {
  Shape shape;
  /// Of the shape's frame, which is that of the centre of mass and principal axes, in that of the element: a hull's
  /// points have another.
  Pose frame;
  double volume = 0;                     ///< m^3
  Vec3 inertia_per_mass = Vec3::Zero();  ///< of the solid, about its centre, m^2
};

/// The names of the elements that are solids.
const std::vector<std::string>& solids();
bool is_solid(const XmlElement& element);
/// The attributes that a solid's element needs: name, extents, position.
std::vector<std::string> needs(const XmlElement& solid);
/// The attributes that it may have besides.
std::vector<std::string> takes(const XmlElement& solid);
Solid read_solid(Reading& in, const XmlElement& element);
/// A hull's shape.
Shape hull_shape(std::shared_ptr<const Hull> hull);
/// The pose of a solid's shape where its element is at `pose`.
Pose placed(const Pose& pose, const Solid& solid);

}  // namespace cb
