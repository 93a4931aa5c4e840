#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <span>
#include <string>

#include "contact/problem.h"

namespace cb {

struct DelassusFactorOptions {
  /// Eigenvalues of W (scaled to unit contacts) below this are taken as zero while eliminating; larger: fewer unknowns,
  /// and the check below fails more often.
  double rank_tolerance = 1e-11;
  /// |W - J J^T| (scaled) that the sparse elimination may leave; beyond, the eigendecomposition takes its place.
  double sparse_error = 1e-13;
  /// -(smallest eigenvalue of W) over the largest (scaled) that counts as rounding (W written with
  /// seven digits) and is set to zero, with a note; beyond: refused.
  double negative_tolerance = 1e-6;
  /// Largest connected part of W, in rows, that the eigendecomposition takes (8 n^2 bytes three times).
  int dense_rows = 3000;
};

struct DelassusFactorReport {
  int rank = 0;              ///< columns of J
  bool dense = false;        ///< did a part need the eigendecomposition?
  double error = 0;          ///< largest |W - J J^T|, scaled by sqrt(w_i w_j), w_i = trace(W_ii) / 3
  double most_negative = 0;  ///< largest -(eigenvalue) that was set to zero, over the largest eigenvalue (scaled)
};

/// Finds a contact problem with M = 1 whose Delassus matrix J J^T is the given W (3 nc x 3 nc, symmetric) and whose
/// u_minus is q: J stays sparse where W is, v_minus is the least motion that explains q, offset the rest of q.
/// Returns an empty string, or why there is no such problem. mu and restitution are left alone.
std::string factor_delassus(const Eigen::SparseMatrix<double>& W, std::span<const double> q,
                            const DelassusFactorOptions& options, ContactProblem& problem,
                            DelassusFactorReport& report);

}  // namespace cb
