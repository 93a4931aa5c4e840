#pragma once

#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "contact/assemble.h"
#include "contact/referee.h"
#include "geometry/shapes.h"

namespace cb {

/// One event as it was solved; references hold until the next event.
struct EventRecord {
  double t;  ///< s
  const ContactProblem& problem;
  const ContactSolution& solution;
  const Residuals& residuals;
  const std::vector<double>& v_plus;
  const std::vector<ContactPoint>& contacts;  ///< the problem's contacts from the first on;
  std::span<const LimitContact> limits = {};  ///< then these
  bool trial = false;  ///< of a base step that is extrapolated from: no event of the motion itself
  /// Per contact, m/s: what the problem's offset has of its gap over the step, which is no velocity; empty: nothing.
  std::span<const double> gap_speed = {};
};

/// Seconds of the wall clock spent in the parts of a step.
struct StepTimes {
  double dynamics_s = 0, collision_s = 0, assembly_s = 0, solve_s = 0, step_s = 0;
};

/// How stepping to an accuracy came to its next state (a row of stepping.csv).
struct AccuracyStep {
  /// Extrapolated; or one step of first order, across a switch or because switches pile up.
  enum Kind { macro, switched, first_order } kind = macro;
  double length = 0;    ///< s
  double estimate = 0;  ///< m: what it is estimated to be off by
  int refused = 0;      ///< tries before it that were not taken
  bool impact = false;  ///< did it begin with one?
};

/// One row of steps.csv (docs/interface.md). Where a step has several events, counts add up and residuals are the
/// worst.
struct StepRecord {
  long step = 0;  ///< 1-based: the step that ends at t
  double t = 0;
  int events = 0, contacts = 0, size = 0, iterations = 0, solves = 0;
  Status status = Status::ok;
  double claimed_residual = 0, residual = 0;
  std::optional<double> law_residual, gap, infeasibility;
  double event_energy_gain = 0;                     ///< J, of the motion's own events: not of trials
  double event_energy_gain_relative = 0;            ///< worst over the events: gain / energy before
  double max_penetration = 0;                       ///< m, at the end of the step
  double penetration_inside = 0;                    ///< m, at the events (not of trials) and before it was taken away
  double penetration_displacement = 0;              ///< m, furthest that a point was moved for that
  int bounces_left_out = 0;                         ///< impacts of pairs whose bounces were over (bounces.h)
  double bounce_speed = 0;                          ///< m/s, largest e u_n of these: what they would have parted with
  double bounce_distance = 0;                       ///< m, largest e u_n t of these, t to the end of the step
  double kinetic_energy = 0, potential_energy = 0;  ///< J
  int false_claims = 0;                             ///< answers called ok that the check refutes
  int doubted = 0;                                  ///< answers not called ok that the check confirms
  std::optional<AccuracyStep> accuracy;             ///< where that is how it steps
  bool unsolved = false;                            ///< an event that no answer was found to ended the run
  StepTimes times;
};

/// What stepping to an accuracy did, summed over a run.
struct AccuracyTally {
  int order = 0;
  double smallest_step = 0;  ///< s: what switches are taken with; tied to the accuracy
  long taken = 0;            ///< macro steps
  long refused = 0;          ///< and tries that were not taken: an error too large, a switch or an impact within
  long base_steps = 0;       ///< of all of them
  long base_solves = 0;      ///< and the events solved in these
  long switches = 0;         ///< changes of a contact's mode that a step of first order was taken across
  long impacts = 0;          ///< located, with restitution where the pair has any
  long first_order = 0;      ///< steps of first order because switches or impacts pile up
  long noisy = 0;            ///< macro steps taken whose estimate, beyond what is allowed, is a solver's noise
  double shortest = HUGE_VAL, longest = 0;  ///< s, of the macro steps taken
  double estimated_error = 0;               ///< m: sum of what the macro steps taken were estimated to be off by
};

/// What a run left out of its steps, summed over it.
struct StepLeftOut {
  long coplanar_points = 0;  ///< contacts of events
  long contact_times = 0;    ///< searches
  long pair_searches = 0;
  long repeats = 0;  ///< events
};

}  // namespace cb
