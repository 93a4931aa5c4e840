#pragma once

#include <Eigen/Cholesky>
#include <vector>

#include "contact/assemble.h"
#include "scenario/scenario.h"

namespace cb {

/// Where a shape is and how it moves. For a fixed one v and w are left as they are.
void shape_motion(const Shape& shape, const State& state, Motion& motion);

/// Takes away the gaps that a step leaves between touching shapes because contacts bind velocities at its start, while
/// points of links and of turning bodies go on arcs (second order in the step). Used in scenes with robots, and in
/// stepping to an accuracy.
///
/// After the positions moved by dt, with delta = what the two shapes' arcs can have opened or closed,
///   * pairs that touched and whose gap would have grown by at most delta in linear motion: all their points with a gap
///     within +-delta;
///   * other pairs: their points with a gap from -delta to -tolerance
/// are brought back to gap 0 by the displacement d least in d.M d, to first order N d = -gap, repeated until the gaps
/// are within a tenth of the tolerance. A joint that d would take beyond its limit is held at it, and gaps that it
/// alone could close stay. A free body's spin turns with it (displacement.h); the energy of trees is the caller's to
/// keep, potential energy changes by second order in the step, with either sign. Both signs of gap are taken, so that
/// contact goes on as contact, and no later event closes what arithmetic opened.
///
/// What arcs moved by delta, displacements of the order of delta put back. Of bodies that touch each other (not by way
/// of a belt that stops drive), none is moved by more than ten times the largest delta of their pairs, but for a
/// thousandth of its radius, and at most a tenth: where d would, the points that d pulls at are parting, not drifting
/// (a box that tips over an edge; points side by side whose gaps differ), and are let go, those first that it pulls at
/// most. Where none is pulled, these bodies stay where they are. Gaps wider than that are not looked at.
class Drift {
 public:
  /// `motions`: per shape, before the move; brought up to date. `touching`: the contacts then. `tolerance`, `radius`:
  /// per shape, m. `limit_tolerance`: closed gap of joints, rad or m. `driven`: per tree, do stops leave each of its
  /// joints one rate? `pairs`: sorted, i < j. `dt`: s, length of the move.
  void remove(const Scenario& scenario, std::vector<Motion>& motions, const std::vector<ContactPoint>& touching,
              const std::vector<double>& tolerance, double limit_tolerance, const std::vector<double>& radius,
              const std::vector<std::pair<int, int>>& pairs, const std::vector<char>& driven, double dt, State& state);
  /// Gaps within a tenth of the tolerance are left alone, which is no smooth function of dt; or none is, but rounding,
  /// and of a pair's open points those are closed that are nearest to where it touched.
  void set_exact(bool exact) { exact_ = exact; }
  /// The points of the pairs of `touching` whose gap is within +-reach (m) are brought to gap 0 likewise; others are
  /// left alone. For poses that are off by no more than that. `before`: per shape, where `touching` was found.
  void close(const Scenario& scenario, const std::vector<Motion>& before, std::vector<Motion>& motions,
             const std::vector<ContactPoint>& touching, const std::vector<double>& tolerance, double limit_tolerance,
             const std::vector<std::pair<int, int>>& pairs, const std::vector<char>& driven, double reach,
             State& state);

 private:
  void bring_to_zero(const Scenario& scenario, std::vector<Motion>& motions, const std::vector<double>& tolerance,
                     double limit_tolerance, const std::vector<std::pair<int, int>>& pairs, State& state);
  void find_points(const Scenario& scenario, const std::vector<Motion>& motions, const std::vector<double>& tolerance,
                   const std::vector<std::pair<int, int>>& pairs);
  /// Where a point that touched was on the shapes of its pair, in their frames.
  struct Place {
    std::size_t pair;
    Vec3 on_first, on_second;  // m
  };
  Place place_of(std::size_t pair, const ContactPoint& contact, const std::vector<Motion>& motions) const;
  void keep_touched(std::size_t pair, double closed, const std::vector<Motion>& motions);
  void take_driven(const Scenario& scenario, const std::vector<char>& driven);
  int owner(const Scenario& scenario, int shape) const;
  int component_of(const Scenario& scenario, const ContactPoint& point) const;
  void find_components(const Scenario& scenario);
  bool displace_within_reach(const Scenario& scenario, const std::vector<double>& tolerance, double limit_tolerance,
                             std::vector<Motion>& motions, State& state);
  bool moves_too_far(const Scenario& scenario, const std::vector<Motion>& motions);
  bool let_go(const Scenario& scenario, const std::vector<double>& tolerance);
  void assemble(const Scenario& scenario, const State& state);
  bool find_displacement();
  bool hold_limits(double limit_tolerance);

  std::vector<double> arc_;    // per shape: how far from steady motion it ended, m
  std::vector<double> delta_;  // per pair, m; negative: did not stay in touch
  std::vector<double> slip_;   // per pair, m/s
  std::vector<Place> touched_;
  std::vector<char> kept_;  // per point of found_
  std::vector<ContactPoint> points_, found_;
  std::vector<int> pair_of_;               // per point
  std::vector<double> window_;             // per pair, m: its points with gaps within +-this are looked at
  std::vector<int> component_;             // per owner, a tree or else a body: its number among components
  std::vector<double> reach_;              // per owner, m: the largest delta of the pairs of its components
  std::vector<char> too_far_;              // per component
  std::vector<double> of_component_;       // m
  std::vector<double> pull_;               // per component: the largest of its points, kg m
  std::vector<Motion> was_;                // per shape, before the first round
  State state_was_;                        // before the round
  std::vector<char> driven_;               // per tree
  double worst_ = 0;                       // largest |gap| / tolerance of points_
  bool exact_ = false, rounding_ = false;  // rounding_: are all gaps of points_ rounding's?

  std::vector<LimitContact> limits_;  // that can hold
  std::vector<int> held_;             // rows: points, held_points_ of them, then those of the limits that do
  Eigen::Index held_points_ = 0;
  std::vector<double> wanted_;  // N d of held_, m or rad
  std::vector<char> in_;        // per limit: does it hold?

  Assembler assembler_;
  ContactProblem problem_;
  std::vector<BlockOwner> owners_;
  std::vector<double> zeros_;
  BlockCholesky factor_;
  Eigen::MatrixXd NT_, MNT_;                // columns: points, then limits_
  Eigen::MatrixXd held_NT_, held_MNT_, G_;  // of held_
  Eigen::VectorXd lambda_, d_;
  Eigen::LLT<Eigen::MatrixXd> llt_;
};

}  // namespace cb
