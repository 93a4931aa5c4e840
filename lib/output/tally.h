#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "contact/conditioning.h"
#include "simulation/simulation.h"

namespace cb {

/// Median of a stream of numbers >= 0 in bounded memory: exact for up to `kept` numbers, beyond that to 1/64 (the width
/// of a bucket of the histogram that takes over). Depends on the numbers only, not on their order.
class StreamMedian {
 public:
  StreamMedian();
  void add(double x);
  /// None where nothing was added.
  std::optional<double> median() const;

  static constexpr std::size_t kept = std::size_t(1) << 16;

 private:
  static std::size_t bucket(double x);
  static double value(std::size_t bucket);

  std::vector<double> first_;
  std::vector<std::int64_t> counts_;
  std::int64_t total_ = 0;
};

/// What summary.json says of a run as a whole, gathered step by step in bounded memory.
struct RunTally {
  long steps = 0;        ///< completed
  double t_reached = 0;  ///< s, end of the last completed step
  long long events = 0, solves = 0, iterations = 0;
  int contacts_max = 0;  ///< in one event
  long long false_claims = 0, inaccurate_events = 0, doubted = 0;
  std::optional<double> residual_max, claimed_max, law_max;
  std::optional<double> gap_max;  ///< J, the one of largest magnitude
  std::optional<double> infeasibility_max;
  double residual_max_t = 0;                          ///< s, step in which residual_max was met
  std::optional<double> gain_max, gain_relative_max;  ///< J, -: of one event; negative where every event loses
  double penetration_max = 0;                         ///< m, at the end of a step
  double penetration_inside_max = 0;                  ///< m, within one, before it was taken away
  long penetration_removals = 0;                      ///< steps at whose end poses were displaced for it
  double penetration_displacement_max = 0;            ///< m, furthest that a point was moved so in a step
  long long bounces_left_out = 0;               ///< impacts whose pair had restitution left out (simulation/bounces.h)
  double bounce_speed_max = 0;                  ///< m/s, that one of these would have parted with
  double bounce_distance_max = 0;               ///< m, how far that is by the end of the step
  long long scaled_events = 0;                  ///< whose restitution was scaled so that no island gains energy
  std::optional<double> restitution_scale_min;  ///< -, of these: the least share of restitution that was left
  StepTimes times;
  StreamMedian residuals;
  /// On demand: the problem of the worst condition among those measured.
  std::optional<Conditioning> conditioning;
  double conditioning_t = 0;                                 ///< s
  long seen_events = 0, measured_events = 0, too_large = 0;  ///< problems measured; those beyond the estimate's limit
  int measured_contacts = -1, measured_freedoms = -1;

  /// An event that was solved; `holds`: did the referee accept it? One of a try counts once a step is observed, which
  /// has taken it, unless it is forgotten before.
  void observe_event(const EventRecord& event, bool holds);
  /// What has been tried is not taken.
  void forget_tried() { tried_.clear(); }
  /// Measures the problem of an event whose numbers of contacts or freedoms differ from the last measured one's, and of
  /// every hundredth event.
  void observe_conditioning(const EventRecord& event, ConditioningEstimate& estimate);
  /// Every step, the one that ends the run (`completed` = false) included.
  void observe_step(const StepRecord& record, bool completed);

 private:
  /// What counts of an event.
  struct Seen {
    int contacts;
    double residual, gain, energy_before, restitution_scale;
    bool holds;
  };
  void count(const Seen& event);
  std::vector<Seen> tried_;
};

}  // namespace cb
