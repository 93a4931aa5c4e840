#pragma once

#include "geometry/advancement.h"
#include "geometry/shapes.h"

namespace cb {

/// time_of_contact of two shapes one of which is a cylinder, a the first such, and b no half-space or sphere.
double cylinder_to_solid(const Shape& shape_a, const Motion& motion_a, const Shape& shape_b, const Motion& motion_b,
                         const Goal& goal);

}  // namespace cb
