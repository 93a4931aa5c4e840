#pragma once

#include <map>
#include <utility>
#include <vector>

#include "simulation/base_step.h"

namespace cb {

/// Steps whose length follows a wanted accuracy: base steps of first order, extrapolated (docs/stepping.md).
class AccuracyStepping {
 public:
  AccuracyStepping(const Scenario& scenario, const SimulationOptions& options);
  /// One macro step, or one of first order where a contact's mode changes; `base` is at its start, begun.
  void step(BaseStep& base);
  const AccuracyTally& tally() const { return tally_; }

 private:
  using Modes = std::vector<BaseStep::Mode>;
  /// What came of a try to cross a macro step.
  struct Try {
    enum What { taken, inexact, switched, arrived, bent, failed } what = taken;
    bool jumps = false;   ///< switched: does friction change at once?
    double at = 0;        ///< s after the start: where the finest sequence was still as at the start, or the arrival
    double estimate = 0;  ///< m
    double excess = 0;    ///< of the estimate over what is allowed
  };
  void step_once(BaseStep& base);
  double until_edge(double t) const;
  void take_impact(BaseStep& base);
  bool probe(BaseStep& base, double h, Modes& modes, std::vector<ContactPoint>& held);
  Try cross(BaseStep& base, int n, double H, std::vector<double>& result);
  Try attempt(BaseStep& base, double H, double t_end);
  Try judge(double H);
  /// Power of H by which the estimate grows over what is allowed.
  int growth_order() const { return order_ >= 3 ? order_ : std::max(1, order_ - 1); }
  Try leave(BaseStep& base, double H, double t_end);
  double next_length(const Try& tried, double H) const;
  bool covers(const std::vector<ContactPoint>& contacts, const std::vector<ContactPoint>& others);
  bool bind_at_end(BaseStep& base, double h);
  bool step_from_impact(BaseStep& base, double h);
  void take_first_order(BaseStep& base, double h, double edge, AccuracyStep::Kind kind);
  void go_on_from(const Try& taken, double H, double limit, bool nearing);
  void take_macro_step(BaseStep& base, double edge);
  bool piles_up(double t);

  const Model& model_;
  SimulationOptions options_;
  int order_;
  double acceleration_;         // m/s^2: what the scene's forces give
  double smallest_;             // s
  double finest_;               // s: across switches at which an acceleration jumps
  std::vector<double> radius_;  // per body, m
  std::vector<double> edges_;   // s, ascending: where forces begin and end
  AccuracyTally tally_;
  AccuracyStep taken_;  // of the step at hand

  double next_ = 0;               // s, the next macro step's length
  double noise_ = 0;              // m, of estimates
  double nearing_ = HUGE_VAL;     // s, no more than that while a time of contact comes near
  double looking_ = 0;            // s, the base step that the modes at a start are read after
  bool struck_ = false;           // has no macro step been taken since the last impact?
  bool modes_known_ = false;      // are entry_ those of the present state and forces?
  long first_order_left_ = 0;     // steps to come
  long batch_ = 0;                // of them, when switches pile up next
  std::vector<double> stumbles_;  // s: times of the last impacts and switches
  BaseStep::Checkpoint start_, end_;
  Modes entry_, exit_, modes_;
  std::vector<ContactPoint> entry_held_, exit_held_;  // what touches and does not part, where the modes are read
  std::vector<ContactPoint> touching_, opening_;      // at the start of a step of first order; those that it opens
  std::map<std::pair<int, int>, int> per_pair_;       // points
  std::vector<std::vector<double>> results_;
  std::vector<int> n_;
  std::vector<double> best_, neighbour_, before_;
  State best_state_, neighbour_state_, before_state_;
};

}  // namespace cb
