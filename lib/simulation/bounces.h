#pragma once

#include <utility>
#include <vector>

namespace cb {

/// How often each pair of shapes (or joint and its limit) came together within a step, and whether its bounces are
/// over. Between heavy bodies that close in on each other a light one bounces faster and faster: infinitely often in
/// finite time where restitution e < 1 (inelastic collapse; McNamara and Young, Physics of Fluids A 4 (1992) 496).
///   1. Such bounces end with contact that lasts, which is e = 0. A pair's bounces are over once n impacts of it in one
///      step have left less than `spent` of its first approach, e^n < spent; from then on its restitution is 0 for the
///      rest of the step. What that leaves out is at most e u_n of speed with which the pair parts at such an impact,
///      and e u_n h of distance; the run counts both. Elastic bounces are never over.
///   2. Edges that rock and contacts that slide and lift (the convex model's do) come together again and again without
///      restitution too. After `resolved` impacts without restitution of a pair in one step its times of contact are
///      h / resolved apart, or less where it could come deeper than `shallow` of the smaller size within that. What
///      overlaps by then parts at the next event and is taken away at the end of the step (overlap.h).
/// Difference from Luding and McNamara, Granular Matter 1 (1998) 113, who set e = 1 after a stated time between two
/// impacts: theirs keeps a gas of grains going, here contact that lasts is what the next event can solve.
class Bounces {
 public:
  static constexpr double spent = 1e-3;    ///< -: of the speed of a pair's first approach in the step
  static constexpr int resolved = 100;     ///< impacts of a pair in a step
  static constexpr double shallow = 0.01;  ///< -

  using Pair = std::pair<int, int>;
  void clear() { seen_.clear(); }
  /// The pair came to a time of contact. Returns how often it has in this step.
  int arrive(const Pair& pair);
  /// The pair that came last approaches, at time t: an impact.
  void impact(double t);
  /// Has any pair come to a time of contact in this step?
  bool any() const { return !seen_.empty(); }
  const Pair& last() const { return seen_[last_].pair; }
  /// Is this the end of the bounces of a pair with restitution e?
  bool over(const Pair& pair, double e) const;
  /// s after time t: the next time of contact of a pair with restitution e is no earlier. h: s, the step; size: m, the
  /// smaller shape's; speed: m/s, no point of one moves faster as seen from the other.
  double wait(const Pair& pair, double e, double t, double h, double size, double speed) const;

 private:
  struct Seen {
    Pair pair;
    int arrivals = 0, impacts = 0;
    double last_impact = 0;  // s
  };
  const Seen* find(const Pair& pair) const;

  std::vector<Seen> seen_;  // few: pairs that come together within one step
  std::size_t last_ = 0;
};

}  // namespace cb
