#pragma once

#include <array>
#include <memory>
#include <vector>

#include "geometry/polytope.h"

namespace cb {

/// Corners counter-clockwise seen from above (y up), m.
using Triangle = std::array<Vec3, 3>;

/// Does a triangle look up? The y of its normal is more than 1e-6 of it.
bool looks_up(const Triangle& triangle);

/// The ground under triangles that look up: a prism for each, the triangle and what is less than `depth` (m) below it,
/// in a frame at its centre with the axes of the triangles. Triangles that share two corners, to the last bit, are
/// neighbours: the sides in between are inner, and the seam carries as polytope.h says of it.
std::vector<std::shared_ptr<const Hull>> ground_prisms(const std::vector<Triangle>& triangles, double depth);

}  // namespace cb
