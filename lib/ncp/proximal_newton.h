#pragma once

#include <vector>

#include "ncp/ncp.h"
#include "ncp/velocity_system.h"

namespace cb {

/// One step of the proximal point method for (1) of ncp.h, by Newton's method in velocities (proximal_newton.cpp).
/// Owns its scratch.
class ProximalNewton {
 public:
  struct Options {
    int limit = 40;           ///< Newton steps before it is given up
    int halvings = 12;        ///< of one step
    double tolerance = 1e-3;  ///< -: error in momentum over what the proximal terms are. Smaller: more steps, sharper r
    double rounding = 1e-14;  ///< -: the same over the size of the event, below which all is done
  };
  enum class Ending { solved, stalled, singular };

  /// Of this problem, which must stay alive; `system` is prepared for it. `size`: what the event is about, sqrt(J).
  void begin(const NcpProblem& problem, VelocitySystem& system, double size);
  /// With compliances alpha w_c around the impulses r (3 nc), from the velocity v (nv): both are replaced by the
  /// answer, or by the best that was met. `steps` is counted up.
  Ending solve(const Options& options, double alpha, std::vector<double>& r, std::vector<double>& v, int& steps);

 private:
  double evaluate(double alpha, const std::vector<double>& v);
  void linearise(double alpha);
  double proximal_terms(double alpha) const;

  const NcpProblem* problem_ = nullptr;
  double size_ = 0;
  VelocitySystem* system_ = nullptr;
  std::vector<double> middle_;         // 3 nc, N s: impulses that the compliances are around
  std::vector<double> y_, r_, F_, h_;  // 3 nc, 3 nc, nv, nv
  std::vector<double> G_, way_, next_;
};

}  // namespace cb
