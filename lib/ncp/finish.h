#pragma once

#include <vector>

#include "ncp/ncp.h"
#include "ncp/velocity_system.h"

namespace cb {

/// Newton's method on Alart and Curnier's map, in impulses: what takes a good guess to the last bits (finish.cpp).
/// Owns its scratch.
class AlartCurnierNewton {
 public:
  struct Options {
    double tolerance = 1e-12;  ///< natural residual at which it stops, -
    int limit = 30;            ///< steps
    int patience = 3;          ///< steps in a row without a better residual
    /// -: proximal term of a step, as a fraction of w: where r is not unique it picks the answer next to the iterate,
    /// and perturbs none. Larger: slower at the end; smaller: worse pivots.
    double proximal = 1e-8;
  };
  /// Of this problem, which must stay alive.
  void begin(const NcpProblem& problem, NcpMeasure& measure);
  /// From r (3 nc): replaced by the best that was met, u (3 nc) with it. Returns its natural residual; `steps` is
  /// counted up.
  double solve(const Options& options, std::vector<double>& r, std::vector<double>& u, int& steps);

 private:
  void linearise(double proximal);

  const NcpProblem* problem_ = nullptr;
  NcpMeasure* measure_ = nullptr;
  VelocitySystem system_;
  std::vector<double> r_, u_, v_, G_, c_, du_, h_;
};

}  // namespace cb
