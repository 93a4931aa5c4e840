#pragma once

#include <span>

#include "dynamics/kinematics.h"

namespace cb {

/// The generalised mass matrix of a tree.
class CompositeBody {
 public:
  /// M: tree.nv x tree.nv, in the order of the tree's rates (kg, kg m, kg m^2); all of it is written, symmetric.
  /// Poses of the links must be those of q.
  void mass_matrix(const Model& model, const Tree& tree, const State& state, Eigen::Ref<Eigen::MatrixXd> M);

 private:
  /// A rigid inertia about a point.
  struct Inertia {
    double mass;
    Vec3 first;   // mass times (centre of mass - point)
    Mat3 second;  // about the point
  };
  std::vector<LinkFrame> frames_;
  std::vector<Inertia> composite_;
};

}  // namespace cb
