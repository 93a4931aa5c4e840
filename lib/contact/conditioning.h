#pragma once

#include <vector>

#include "contact/problem.h"

namespace cb {

/// How well a contact problem determines its answer, whoever solves it.
struct Conditioning {
  int rows = 0;          ///< constraints: 3 a contact, 1 for a joint limit
  int freedoms = 0;      ///< nv
  int rank = 0;          ///< of W; rows - rank combinations of impulses move nothing
  double condition = 1;  ///< of W on its range: largest over least eigenvalue that counts
};

/// Singular values of S^-1 J M^-1/2, where S_c^2 = w_c = trace(W_cc) / 3: their squares are the eigenvalues of W with
/// every contact at the same mobility, so that neither units nor one light body decide. Values below
/// max(rows, freedoms) eps of the largest count as zero. A singular value is exact to eps of the largest one:
/// conditions beyond 1e30 are round-off, and the rank of a problem that is singular but for rounding is that of its
/// rounded data. Dense, O(rows freedoms min(rows, freedoms)): not for the inner loop. Owns its scratch.
class ConditioningEstimate {
 public:
  /// False where the problem is larger than `limit` rows or freedoms, or where M is not definite: `out` is untouched.
  bool measure(const ContactProblem& problem, Conditioning& out, int limit = 1500);

 private:
  BlockCholesky factor_;
  std::vector<Eigen::Matrix3d> W_;
  Eigen::MatrixXd A_;
};

}  // namespace cb
