#pragma once

#include <functional>
#include <string>
#include <vector>

#include "contact/referee.h"
#include "geometry/broad_phase.h"
#include "methods/registry.h"
#include "scenario/scenario.h"

namespace cb {

/// One event as it was solved; references hold until the next event.
struct EventRecord {
  double t;                             ///< s
  const ContactProblem& problem;
  const ContactSolution& solution;
  const Residuals& residuals;
  const std::vector<double>& v_plus;
  const std::vector<ContactPoint>& contacts;
};

/// CPU-clock seconds spent in the parts of a step.
struct StepTimes {
  double dynamics_s = 0, collision_s = 0, assembly_s = 0, solve_s = 0, step_s = 0;
};

/// One row of steps.csv (spec: contract.md). Where a step has several events, counts add up and residuals are the worst.
struct StepRecord {
  long step = 0;  ///< 1-based: the step that ends at t
  double t = 0;
  int events = 0, contacts = 0, size = 0, iterations = 0, solves = 0;
  Status status = Status::ok;
  double claimed_residual = 0, residual = 0;
  std::optional<double> law_residual, gap, infeasibility;
  double event_energy_gain = 0;           ///< J
  double event_energy_gain_relative = 0;  ///< worst over the events: gain / energy before
  double max_penetration = 0;             ///< m
  double kinetic_energy = 0, potential_energy = 0;  ///< J
  int false_claims = 0;
  StepTimes times;
};

struct SimulationOptions {
  double step = 1e-3;                 ///< s
  double duration = 1;                ///< s
  double accepted_residual = 1e-9;    ///< model residual beyond which an event counts as `inaccurate`, -
  double closed_gap = 1e-9;           ///< fraction of the body's size below which a pair is closed
  double same_event_window = 1e-9;    ///< fraction of the step within which times of contact are one event
  int event_cap = 1000;               ///< events in one step; beyond: event_stall
  double blowup_factor = 1e6;         ///< kinetic energy over the largest energy that was put in: energy_blowup
  double penetration_limit = 0.1;     ///< fraction of the body's size; deeper: penetration
};

/// The event-driven stepper (spec: methods.md, "The step"). Is handed a method and never asks which.
class Simulation {
 public:
  Simulation(const Scenario& scenario, const SimulationOptions& options, ContactMethod method, Law law);

  /// Advances one step; the record holds until the next call. A status other than ok or inaccurate ends the run.
  const StepRecord& step();

  const State& state() const { return state_; }
  long steps_total() const { return steps_total_; }
  long step_index() const { return step_index_; }
  double kinetic_energy() const;
  double potential_energy() const;
  /// Called after each event, in time order; may be empty.
  std::function<void(const EventRecord&)> on_event;
  /// Where status is not ok: one line.
  const std::string& reason() const { return reason_; }
  const ContactProblem& problem() const { return problem_; }
  const ContactSolution& solution() const { return solution_; }

 private:
  void apply_forces();
  void find_contacts();
  bool solve_event();
  double first_contact(double horizon);
  void advance_positions(double dt);
  void refresh_motions();
  double h_at_step(long n) const;

  const Scenario& scenario_;
  SimulationOptions options_;
  ContactMethod method_;
  Law law_;
  State state_;
  long step_index_ = 0, steps_total_ = 0;
  StepRecord record_;
  std::string reason_;

  ContactProblem problem_;
  ContactSolution solution_;
  Residuals residuals_;
  Referee referee_;
  std::vector<double> v_plus_, contact_velocity_;
  std::vector<ContactPoint> contacts_;
  std::vector<PairLaw> contact_laws_;
  std::vector<Motion> motions_;
  std::vector<double> tolerance_;  ///< per shape, m
  BroadPhase broad_phase_;
  std::vector<int> block_of_body_;
  std::vector<std::pair<int, int>> candidate_pairs_;
  std::vector<int> pair_law_index_;
};

}  // namespace cb
