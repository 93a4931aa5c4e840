#pragma once

#include <Eigen/QR>
#include <span>
#include <vector>

#include "linalg/block_matrix.h"

namespace cb {

/// Impulses that bring chosen rows of the contact velocity to zero, least in norm where they are not unique: by an
/// orthogonal factorisation of L^-1 J^T (M = L L^T), whose singular values are the square roots of W's. Robots make W
/// nearly singular in some directions (a wheel's spin beside a heavy base); proximal iterations need many steps there.
class StoppingImpulse {
 public:
  /// `rows`: 1 (normals) or 3 per contact; those of (M, J) that `in_set` has. `factor` of M, `weight` (1/kg) nc.
  /// Returns false where the sizes are beyond `dense_limit` rows or unknowns: the cost is that of dense matrices.
  bool prepare(const BlockDiagonalMatrix& M, const BandMatrix& J, const BlockCholesky& factor,
               std::span<const double> weight, std::span<const char> in_set, int rows);
  /// Adds to r (3 nc) what takes the velocities u (3 nc, m/s) away to first order, in the rows prepared.
  void correct(std::span<const double> u, std::span<double> r);

  /// The velocity v (nv) of least energy that gives the rows prepared the velocities u (3 nc, m/s).
  void least_velocity(std::span<const double> u, const BlockCholesky& factor, std::span<double> v);

  static constexpr int dense_limit = 96;
  /// -: singular values of the scaled matrix below this fraction of the largest count as zero.
  static constexpr double rank_threshold = 1e-9;

 private:
  void load(std::span<const double> u);

  int rows_ = 3;
  std::vector<double> scale_;  // per contact, 1 / sqrt(weight)
  Eigen::MatrixXd A_;
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> decomposition_;
  Eigen::VectorXd u_, y_, x_;
};

}  // namespace cb
