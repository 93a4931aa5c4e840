#include "output/tally.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace cb {

namespace {

// Buckets: 0 for zero and what is below 2^-130, then 64 an octave up to 2^126; the last takes the rest.
constexpr int lowest_exponent = -130, octaves = 256, per_octave_bits = 6;
constexpr std::size_t buckets = (std::size_t(octaves) << per_octave_bits) + 1;

void raise(std::optional<double>& worst, double x) {
  if (std::isfinite(x) && (!worst || x > *worst)) worst = x;
}
void raise(std::optional<double>& worst, const std::optional<double>& x) {
  if (x) raise(worst, *x);
}

}  // namespace

StreamMedian::StreamMedian() : counts_(buckets) { first_.reserve(kept); }

std::size_t StreamMedian::bucket(double x) {
  if (!(x >= std::ldexp(1.0, lowest_exponent))) return 0;
  // The leading bits of a positive double order as the double does: exponent, then the top of the mantissa.
  const auto bits = std::bit_cast<std::uint64_t>(x) >> (52 - per_octave_bits);
  const auto lowest = static_cast<std::uint64_t>(lowest_exponent + 1023) << per_octave_bits;
  return std::min<std::size_t>(1 + bits - lowest, buckets - 1);
}

double StreamMedian::value(std::size_t bucket) {
  if (bucket == 0) return 0;
  const auto lowest = static_cast<std::uint64_t>(lowest_exponent + 1023) << per_octave_bits;
  const std::uint64_t half = std::uint64_t(1) << (51 - per_octave_bits);
  return std::bit_cast<double>(((lowest + bucket - 1) << (52 - per_octave_bits)) + half);
}

void StreamMedian::add(double x) {
  if (first_.size() < kept) first_.push_back(x);
  ++counts_[bucket(x)];
  ++total_;
}

std::optional<double> StreamMedian::median() const {
  if (total_ == 0) return std::nullopt;
  if (total_ == static_cast<std::int64_t>(first_.size())) {
    std::vector<double> sorted = first_;
    std::sort(sorted.begin(), sorted.end());
    const std::size_t half = sorted.size() / 2;
    return sorted.size() % 2 == 1 ? sorted[half] : 0.5 * (sorted[half - 1] + sorted[half]);
  }
  std::int64_t below = 0;
  std::size_t b = 0;
  while (2 * (below + counts_[b]) < total_) below += counts_[b++];
  return value(b);
}

void RunTally::observe_event(const EventRecord& event, bool holds) {
  const Residuals& checked = event.residuals;
  const Seen seen{event.problem.nc(),
                  checked.model,
                  checked.energy_gain,
                  checked.energy_before,
                  event.solution.restitution_scale,
                  holds};
  if (event.trial)
    tried_.push_back(seen);
  else
    count(seen);
}

void RunTally::count(const Seen& event) {
  if (!event.holds) ++inaccurate_events;
  contacts_max = std::max(contacts_max, event.contacts);
  if (std::isfinite(event.residual)) residuals.add(event.residual);
  raise(gain_max, event.gain);
  if (event.restitution_scale < 1) {
    ++scaled_events;
    restitution_scale_min = std::min(restitution_scale_min.value_or(1), event.restitution_scale);
  }
  if (event.energy_before > 0) raise(gain_relative_max, event.gain / event.energy_before);
}

void RunTally::observe_conditioning(const EventRecord& event, ConditioningEstimate& estimate) {
  constexpr long every = 100;
  const int nc = event.problem.nc(), nv = event.problem.nv();
  if (nc == measured_contacts && nv == measured_freedoms && seen_events++ % every != 0) return;
  measured_contacts = nc;
  measured_freedoms = nv;
  Conditioning found;
  if (!estimate.measure(event.problem, found)) {
    ++too_large;
    return;
  }
  ++measured_events;
  if (conditioning && found.condition <= conditioning->condition) return;
  conditioning = found;
  conditioning_t = event.t;
}

void RunTally::observe_step(const StepRecord& record, bool completed) {
  for (const Seen& event : tried_) count(event);
  tried_.clear();
  if (completed) {
    ++steps;
    t_reached = record.t;
  }
  events += record.events;
  solves += record.solves;
  iterations += record.iterations;
  false_claims += record.false_claims;
  doubted += record.doubted;
  penetration_max = std::max(penetration_max, record.max_penetration);
  penetration_inside_max = std::max(penetration_inside_max, record.penetration_inside);
  if (record.penetration_displacement > 0) ++penetration_removals;
  bounces_left_out += record.bounces_left_out;
  bounce_speed_max = std::max(bounce_speed_max, record.bounce_speed);
  bounce_distance_max = std::max(bounce_distance_max, record.bounce_distance);
  penetration_displacement_max = std::max(penetration_displacement_max, record.penetration_displacement);
  if (record.events > 0) {
    if (record.events == 1) contacts_max = std::max(contacts_max, record.contacts);
    if (!residual_max || record.residual > *residual_max) residual_max_t = record.t;
    raise(residual_max, record.residual);
    raise(claimed_max, record.claimed_residual);
    raise(law_max, record.law_residual);
    raise(infeasibility_max, record.infeasibility);
    if (record.gap && std::isfinite(*record.gap) && (!gap_max || std::abs(*record.gap) > std::abs(*gap_max)))
      gap_max = record.gap;
  }
  times.dynamics_s += record.times.dynamics_s;
  times.collision_s += record.times.collision_s;
  times.assembly_s += record.times.assembly_s;
  times.solve_s += record.times.solve_s;
  times.step_s += record.times.step_s;
}

}  // namespace cb
