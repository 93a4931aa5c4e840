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

/// Eigenvalues of S^-1 W S^-1 with S_c^2 = w_c = trace(W_cc) / 3: every contact at the same mobility, so that neither
/// units nor one light body decide. Those below max(rows, freedoms) eps of the largest count as zero: rank is what
/// double precision can tell, and conditions end near 1e15. Dense, O(rows freedoms min(rows, freedoms)): not for the
/// inner loop.
class ConditioningEstimate {
 public:
  /// False where the problem is larger than `limit` rows or freedoms, or where M is not definite: `out` is untouched.
  bool measure(const ContactProblem& problem, Conditioning& out, int limit = 1500);

 private:
  BlockCholesky factor_;
  std::vector<double> weight_;
  Eigen::MatrixXd A_, gram_;
};

}  // namespace cb
