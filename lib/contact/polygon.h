#pragma once

#include <vector>

namespace cb {

/// Directions of the friction polygon of A-P's law in the tangent plane: d_i = cosine[i] t1 + sine[i] t2, the first
/// along t1. Exact on the axes and, of an even k, in opposite pairs: a box that slides along t1 stays on its line.
struct FrictionPolygon {
  FrictionPolygon() = default;
  explicit FrictionPolygon(int edges);
  int k() const { return static_cast<int>(cosine.size()); }
  /// Becomes one of so many edges; free where it is that already.
  void set(int edges) {
    if (k() != edges) *this = FrictionPolygon(edges);
  }
  /// The least lam that lets a contact slip with u (n, t1, t2) without friction, m/s.
  double least_slip_bound(const double* u) const;

  std::vector<double> cosine, sine;  ///< k
};

}  // namespace cb
