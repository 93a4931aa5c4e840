#pragma once

#include <Eigen/Core>
#include <vector>

#include "cone/second_order_cone.h"
#include "ncp/ncp.h"
#include "ncp/velocity_system.h"

namespace cb {

/// A contact inside its cones, or a step of it (interior_system.cpp).
struct InteriorPoint3 {
  Eigen::Vector3d x;  ///< r_n, r_t / mu, N s
  Eigen::Vector3d z;  ///< the slip, u_t, m/s; unused where mu = 0
  double s;           ///< u_n, m/s
};
using InteriorPoints = std::vector<InteriorPoint3>;  ///< nc

/// Iterate and Newton steps of the interior point methods for (1) of ncp.h. Owns its scratch.
class InteriorSystem {
 public:
  struct Options {
    double start = 10;  ///< -: first impulses and velocities, over a contact's part of the size of the event. Larger: a
                        ///< few more steps
    /// -: compliance of a step, as a fraction of w: bounds the scaling matrices. It does not move the answer.
    double proximal = 1e-9;
    /// -: products of a contact with mu > 1 are mu^-share of the others': impulses of both directions are in scale.
    double share = 0.6;
  };
  /// At the start for this problem, which must stay alive; `system` is prepared for it. `size`: what the event is
  /// about, sqrt(J).
  void begin(const Options& options, const NcpProblem& problem, VelocitySystem& system, NcpMeasure& measure,
             double size);
  /// Of the present iterate. False where it could not be factored.
  bool factor();
  /// 1 or -1: sign of its determinant.
  int sign() const { return system_->sign(); }
  /// step <- the one along which the linear parts of products change by (target - products times what they are - the
  /// products of `second`), and misses by -`misses`. second: another step; may be the same one, or null.
  void solve(double target, double products, const InteriorPoints* second, const std::vector<Eigen::Vector3d>& misses,
             InteriorPoints& step);
  /// Longest step that stays inside the cones.
  double longest(const InteriorPoints& step) const;
  /// Inner product of two steps in the metric in which a step of 1 comes to the edge of a cone; the largest share of a
  /// contact in it.
  double inner(const InteriorPoints& a, const InteriorPoints& b, double& largest) const;
  /// False where numbers overflow.
  bool move(double part, const InteriorPoints& step);
  bool move_to(const InteriorPoints& from, double part, const InteriorPoints& step);

  int nc() const { return problem_->nc(); }
  const InteriorPoints& at() const { return at_; }
  const std::vector<Eigen::Vector3d>& misses() const { return misses_; }  ///< nc, (s, z_t) - u, m/s
  double mean() const { return mean_; }                                   ///< of the products, J
  /// -: the worse of products and misses, over the size of the event.
  double error() const;
  const std::vector<double>& r() const { return r_; }  ///< 3 nc, inside the cones

 private:
  using Vector3 = Eigen::Vector3d;
  struct FirstColumn {
    double top;
    Eigen::Vector2d slope;  ///< the rest, over top
  };
  void look();
  FirstColumn first_column(int c) const;
  Vector3 proximal(int c) const;

  Options o_;
  const NcpProblem* problem_ = nullptr;
  NcpMeasure* measure_ = nullptr;
  VelocitySystem* system_ = nullptr;
  double size_ = 0, mean_ = 0, miss_ = 0;
  InteriorPoints at_;
  std::vector<double> share_, r_, u_, v_;
  std::vector<Vector3> misses_, root_;        // nc; W z = W^-1 x
  std::vector<ConeScaling<double>> scaling_;  // nc, W
  std::vector<Eigen::Matrix3d> first_;        // nc, (I + G a)^-1
  std::vector<double> G_, c_, du_, h_;        // 9 nc: first_ G; 3 nc, 3 nc, nv
};

}  // namespace cb
