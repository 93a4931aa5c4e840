#pragma once

#include <array>

#include "geometry/advancement.h"
#include "geometry/core.h"
#include "geometry/shapes.h"

namespace cb {

/// time_of_contact of two shapes one of which is a capsule or a hull, and neither a half-space or a cylinder.
double core_to_core(const Shape& shape_a, const Motion& motion_a, const Shape& shape_b, const Motion& motion_b,
                    const Goal& goal);

/// How fast the points of two shapes that are closed now approach, m/s: they are the caller's, who binds them or not.
double closing_speed(const Shape& shape_a, const Motion& motion_a, const Shape& shape_b, const Motion& motion_b,
                     double tolerance);

/// An edge of a core: a point of it, its direction, and what falls away from it on both sides, along the faces.
struct EdgeOf {
  Vec3 x, e;
  std::array<Vec3, 2> away;
  int sides;
};
EdgeOf edge_of(const PlacedCore& core, int edge);

}  // namespace cb
