#pragma once

#include <Eigen/Core>
#include <vector>

#include "ncp/ncp.h"
#include "ncp/velocity_system.h"

namespace cb {

/// Interior point steps for (1) of ncp.h, with De Saxce's term in the linearisation (interior.cpp). A guess for what
/// finishes it: many contacts change between sticking, slipping and open at once. Owns its scratch.
class InteriorSteps {
 public:
  struct Options {
    double fraction = 0.98;        ///< -: of the longest step inside the cones
    double proximal = 1e-9;        ///< -: compliance of a step, as a fraction of w: bounds the scaling matrices
    double smoothing = 1e-2;       ///< -: of |u_t|, as a fraction of sqrt(w times the mean product)
    double least_part = 0.1;       ///< -: steps shorter than that: the next leaves the slope of |u_t| out
    double least_centring = 1e-3;  ///< -: share of the mean product that a step aims at, at least
  };
  /// Of this problem, which must stay alive; `system` is prepared for it; starts afresh. `size`: what the event is
  /// about, sqrt(J).
  void begin(const NcpProblem& problem, VelocitySystem& system, NcpMeasure& measure, double size);
  /// One step (a factorisation). False where a system could not be factored, or numbers overflow.
  bool step(const Options& options);
  /// -: the worse of mean product and infeasibility, over the size of the event; 1 is where it starts.
  double error() const;
  const std::vector<double>& r() const { return r_; }  ///< 3 nc, inside the cones where mu > 0

 private:
  using Vector3 = Eigen::Vector3d;
  void look(double smoothing);
  bool factor(const Options& o);
  void solve(double target, bool corrected);
  double longest() const;

  const NcpProblem* problem_ = nullptr;
  NcpMeasure* measure_ = nullptr;
  VelocitySystem* system_ = nullptr;
  double size_ = 0, mean_ = 0, miss_ = 0;
  double theta_ = 1;  // share of the slope of |u_t| in the linearisation
  std::vector<double> r_, u_, v_;
  std::vector<Vector3> x_, z_, p_, dx_, dz_;         // nc: impulse and velocity as cone vectors; misses; step
  std::vector<Eigen::Matrix3d> H_, Z_, first_, G3_;  // nc: scaling; slope of z(u); (I + a G)^-1; G
  std::vector<double> G_, c_, du_, h_;
};

}  // namespace cb
