#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "dynamics/composite_body.h"

namespace cb {

/// How the forces of joints answer to their coordinates and rates: tau = ... - K q - D qd, with
///   K = diag(stiffness) + S M S, S^2 = diag(stiffness_by_mass), and D likewise; all indexed as State::qd.
struct JointGains {
  std::vector<double> stiffness, damping;                  ///< N m/rad or N/m; N m s/rad or N s/m
  std::vector<double> stiffness_by_mass, damping_by_mass;  ///< >= 0, 1/s^2; 1/s: of motors that know M

  explicit JointGains(std::size_t nv = 0)
      : stiffness(nv, 0.0), damping(nv, 0.0), stiffness_by_mass(nv, 0.0), damping_by_mass(nv, 0.0) {}
};

/// Joint forces linearised about the start of a step of h seconds and taken at its end (docs/stepping.md): impulses
/// and forces find the trees with M + h D + h^2 K in place of M.
class ImplicitJoints {
 public:
  ImplicitJoints() = default;
  /// `passive`: springs and dampers; `motors`: what controllers add.
  ImplicitJoints(JointGains passive, JointGains motors);
  /// A step of h seconds begins; 0: an instant, with M as it is.
  void begin(double h);
  /// The motor of a rate (as State::qd) gives the same torque whatever the rate in this step.
  void saturate(int rate);
  /// M <- M + h D + h^2 K; tree.nv x tree.nv.
  void add_to(const Tree& tree, Eigen::Ref<Eigen::MatrixXd> M) const;
  /// From accelerations `qdd` (tree.nv, M qdd = forces at the start) those that the forces at the end give:
  /// (M + h D + h^2 K)^-1 (M qdd - h K qd). Poses of the links must be those of q. Does not fail while M is positive
  /// definite.
  void accelerations(const Model& model, const Tree& tree, const State& state, std::span<double> qdd);

 private:
  JointGains passive_, motors_, now_;
  double h_ = 0;
  CompositeBody composite_body_;
  Eigen::MatrixXd M_;
  Eigen::VectorXd force_;
};

}  // namespace cb
