#pragma once

#include <array>
#include <optional>

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

/// Two shapes touch now, their gap `gap_now` (m), and approach by at most `fastest` (m/s). Another feature has arrived
/// (a face beside the edge that touches, an edge where a corner has left its face) when they get deeper than they are
/// by more than the arcs of what touches explain,
///   arcs = (2 (w_a + w_b) fastest + w_a^2 r_a + w_b^2 r_b) S^2 / 2   over the horizon S,
/// the largest second derivative of a gap, and what of it already approaches. The gap (m, < 0) at which that is
/// certain; none where they cannot get that deep by the horizon.
std::optional<double> depth_of_arrival(const Shape& shape_a, const Motion& motion_a, const Shape& shape_b,
                                       const Motion& motion_b, double fastest, double gap_now, const Goal& goal);

/// An edge of a core: a point of it, its direction, and what falls away from it on both sides, along the faces.
struct EdgeOf {
  Vec3 x, e;
  std::array<Vec3, 2> away;
  int sides;
};
EdgeOf edge_of(const PlacedCore& core, int edge);

}  // namespace cb
