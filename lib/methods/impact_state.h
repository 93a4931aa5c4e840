#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "contact/islands.h"
#include "contact/problem.h"

namespace cb {

/// What the methods that take one contact at a time (newton, mirtich) share: the velocity as it stands between two
/// impacts, and what an impulse at one contact does to it. An impulse costs the columns of its own two blocks only.
class ImpactState {
 public:
  struct Tolerances {
    /// An approach is over when u_n >= -approach x (fastest approach of its island before the event), the fastest
    /// both in m/s and in sqrt(J) (velocities over sqrt(w_c), so that a light body's tolerance does not serve for a
    /// heavy one), -. Looser: bodies go on approaching by that fraction.
    double approach = 1e-10;
    /// Velocities below rounding x (sum of |J v| and |w| of a row, largest of its island) are round-off, -. Looser: a
    /// slow approach beside a fast slip is taken for round-off.
    double rounding = 2e-14;
  };

  /// Reads the problem; v = v_minus. Returns ok, not_finite (data) or singular (M, or a contact that nothing can move);
  /// `reason` is set where it is not ok.
  Status start(const ContactProblem& problem, const Tolerances& tolerances, std::string& reason);
  /// v = v_minus + M^-1 J^T r: removes the round-off that many small impulses leave behind.
  void restart(const std::vector<double>& r);

  double normal_velocity(int c) const;          ///< m/s
  Eigen::Vector3d velocity(int c) const;        ///< u_c: n, t1, t2, m/s
  void apply(int c, const Eigen::Vector3d& r);  ///< r in N s

  int nc() const { return static_cast<int>(K_.size()); }
  const Eigen::Matrix3d& K(int c) const { return K_[c]; }                          ///< W_cc, 1/kg
  double approach_tolerance(int c) const { return tolerance_[c]; }                 ///< m/s
  double slip_rounding(int c) const { return rounding_[islands_.of_contact[c]]; }  ///< m/s, below: no slip

  /// The fastest approach before the event, m/s.
  double approach_before() const { return approach_before_; }
  /// The same of the island of contact c, m/s.
  double approach_before(int c) const { return approach_[islands_.of_contact[c]]; }
  bool finite() const;

  /// Contacts that share a block with c, c included; built on the first call after start().
  std::span<const int> neighbours(int c);

 private:
  struct Entry {
    int first;   // row of v
    int size;    // rows
    int values;  // of J^T and M^-1 J^T: size x 3, column-major
  };
  double weight(int c) const;  // w_c, 1/kg: trace(W_cc) / 3, or W_nn of a contact without tangents
  void measure(const Tolerances& tolerances);

  const ContactProblem* problem_ = nullptr;
  BlockCholesky factor_;
  Islands islands_;
  std::vector<double> v_;  // nv
  std::vector<int> band_;  // nc + 1: first entry of each contact
  std::vector<Entry> entry_;
  std::vector<double> jt_, mjt_;                        // J^T and M^-1 J^T, entry by entry
  std::vector<Eigen::Matrix3d> K_;                      // nc
  std::vector<double> tolerance_;                       // nc, m/s
  std::vector<double> approach_, weighted_, rounding_;  // per island: m/s, sqrt(J), m/s
  double approach_before_ = 0;
  bool has_neighbours_ = false;
  std::vector<int> of_block_first_, of_block_, neighbour_first_, neighbour_, mark_;
};

}  // namespace cb
