#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "lcp/complementary_path.h"
#include "lcp/judge.h"

namespace cb {

/// From a vertex that is not exact on to one that is. Contacts that are all but redundant make bases all but singular,
/// where the pivots that led there have left no digits: values that seem to be zero are not, and z_0 has left for the
/// wrong one. The basis is taken from the original matrix, with a covering vector of its own: its basic values y become
/// y + p z_0, p in [1, 2) pseudo-random, feasible from some z_0 > 0 on, where the lowest leaves; from there a path goes
/// on to z_0 = 0. Each further try starts from the best vertex so far, with another p.
struct ExactVertex {
  int repairs = 4;           ///< paths at most
  double tolerance = 1e-10;  ///< Judgement::residual up to which a vertex may be exact, -
  /// Judgement::beyond_rounding up to which it is, -; larger: vertices near the exact one are kept.
  double vertex_tolerance = 1e-12;

  /// From the vertex in hand, for the load: the better of the last and the best on the way, and its residual, which is
  /// infinite where none could be factorised. `first`, where given, is the first path in place of one with a cover of
  /// its own. A ray counts only as the end of its path.
  double find(Basis& basis, const ScaledLoad& load, ComplementaryPath& path, PathJudge& judge, unsigned seed,
              Eigen::VectorXd& z, const std::function<PathEnd()>& first = {});

 private:
  bool cover(Basis& basis, const ScaledLoad& load, unsigned seed);

  Eigen::VectorXd best_, noise_, cover_, scratch_;  // n
  std::vector<int> active_;                         // pairs whose z is basic at the best vertex
};

}  // namespace cb
