#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "geometry/shapes.h"
#include "geometry/terrain.h"

namespace cb::test {

/// The prisms under triangles as shapes.
inline std::vector<Shape> shapes_of(const std::vector<Triangle>& triangles) {
  std::vector<Shape> shapes;
  for (const auto& prism : ground_prisms(triangles, 1)) {
    Shape shape;
    shape.kind = ShapeKind::hull;
    shape.hull = prism;
    shape.half_extents = prism->polytope.half_extents();
    shape.local.p = prism->frame.p;
    shapes.push_back(shape);
  }
  return shapes;
}

/// Two strips, x from -1 to 0 and from 0 to 1, z from -1 to 1, falling by `drop` from x = 0 towards both sides: each of
/// as many rectangles of two triangles as rows. The first triangle of two is that towards -x and +z.
inline std::vector<Shape> roof(double drop, int rows = 1) {
  std::vector<Triangle> triangles;
  for (const double x : {-1.0, 0.0})
    for (int row = 0; row < rows; ++row) {
      const double low = -1 + 2.0 * row / rows, high = -1 + 2.0 * (row + 1) / rows;
      const auto point = [&](double u, double z) { return Vec3(u, -drop * std::abs(u), z); };
      triangles.push_back({point(x, low), point(x, high), point(x + 1, high)});
      triangles.push_back({point(x, low), point(x + 1, high), point(x + 1, low)});
    }
  return shapes_of(triangles);
}

inline double first_contact(const std::vector<Shape>& ground, const Shape& shape, const Motion& motion,
                            double horizon) {
  for (const Shape& prism : ground) {
    Motion still;
    still.pose = prism.local;
    horizon = std::min(horizon, time_of_contact(shape, motion, prism, still, 1e-9, horizon));
  }
  return horizon;
}

}  // namespace cb::test
