#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
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
    /// heavy one), -. Looser: bodies go on approaching by that fraction. A joint at its limit, whose velocity may be in
    /// rad/s, has its own approach in place of the island's m/s, and no part in them; on an island with one, a contact
    /// is also about what its own impulses stop, w_c r_n.
    double approach = 1e-10;
    /// Velocities below rounding x (sum of |J v| and |w| of a row; of contacts the largest of the island's) are
    /// round-off, -. Looser: a slow approach beside a fast slip is taken for round-off.
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
  const Eigen::Matrix3d& K(int c) const { return K_[c]; }     ///< W_cc, 1/kg
  double slip_rounding(int c) const { return rounding_[c]; }  ///< m/s, below: no slip
  /// m/s, or rad/s of a limit, by what was applied so far.
  double approach_tolerance(int c) const {
    return std::max(approach_ * std::min(most_[c], std::max(before_[c], stopping_[c] * given_[c])), rounding_[c]);
  }

  /// By what velocities of an island's contacts are compared: 1, or 1 / sqrt(w_c) where a limit is among them.
  double measure_of(int c) const { return stopping_[c] > 0 ? 1 / std::sqrt(stopping_[c]) : 1; }

  /// The fastest approach before the event, of the island of contact c; of a limit its own. m/s, or rad/s.
  double approach_before(int c) const { return before_[c]; }
  /// -: the fastest approach that is left of contacts, as a fraction of the fastest before or of what impulses stopped
  /// beside a limit; of a limit the same of its own.
  double approach_left() const;
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
  bool is_limit(int c) const { return cb::is_limit(*problem_, c); }
  void measure(const Tolerances& tolerances);

  const ContactProblem* problem_ = nullptr;
  BlockCholesky factor_;
  Islands islands_;
  std::vector<double> v_;  // nv
  std::vector<int> band_;  // nc + 1: first entry of each contact
  std::vector<Entry> entry_;
  std::vector<double> jt_, mjt_;    // J^T and M^-1 J^T, entry by entry
  std::vector<Eigen::Matrix3d> K_;  // nc
  double approach_ = 0;             // Tolerances::approach
  // nc: approaches before, and the most that counts as one, m/s or rad/s; rounding of velocities; w_c where a limit is
  // on the island, else 0, 1/kg; normal impulses so far, N s
  std::vector<double> before_, most_, rounding_, stopping_, given_;
  std::vector<double> of_island_;  // approach, m/s; the same in sqrt(J); rounding, m/s; 1 where there is a limit
  bool has_neighbours_ = false;
  std::vector<int> of_block_first_, of_block_, neighbour_first_, neighbour_, mark_;
};

}  // namespace cb
