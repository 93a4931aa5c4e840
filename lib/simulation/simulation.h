#pragma once

#include <memory>

#include "simulation/base_step.h"

namespace cb {

class AccuracyStepping;

/// What the scene itself asks of a simulation: its step, duration and joint forces, written over those of `options`.
void take_from(const Scenario& scenario, SimulationOptions& options);

/// `options` with the closed gap that is in force: a tenth of the accuracy, where that is less than what steps ask for
/// otherwise. A Simulation does so itself.
SimulationOptions with_closed_gap(SimulationOptions options, const Scenario& scenario);

/// A run, step by step (docs/architecture.md, "The path of a step"; stepping/: the ways of stepping). Is handed a
/// method and never asks which.
class Simulation {
 public:
  Simulation(const Scenario& scenario, const SimulationOptions& options, ContactMethod method, const Law& law);
  ~Simulation();
  Simulation(const Simulation&) = delete;  // on_event and on_forgive are base_'s

  /// Advances one step; the record holds until the next call. A status other than ok or inaccurate ends the run. Where
  /// a stop is asked for within it: throws Stopped, and nothing of the step is to be used.
  const StepRecord& step();
  bool done() const;

  const State& state() const { return base_.state(); }
  long steps_total() const { return steps_total_; }
  long step_index() const { return step_index_; }
  /// Called after each event, in time order; may be empty.
  std::function<void(const EventRecord&)>& on_event = base_.on_event;
  /// Called where the step is tried again: its trial events so far are not part of it. May be empty.
  std::function<void()>& on_forgive = base_.on_forgive;
  /// Where status is not ok: one line.
  const std::string& reason() const { return base_.reason(); }
  /// Torques of the motors in the last step, after their limits (N m, N); indexed as State::qd.
  const std::vector<double>& torque() const { return base_.torque(); }
  /// Of stepping to an accuracy; nullptr where that is not how it steps.
  const AccuracyTally* accuracy() const;
  const StepLeftOut& left_out() const { return base_.left_out(); }
  const ContactProblem& problem() const { return base_.problem(); }
  const ContactSolution& solution() const { return base_.solution(); }

 private:
  SimulationOptions options_;
  long step_index_ = 0, steps_total_ = 0;
  BaseStep base_;
  std::unique_ptr<AccuracyStepping> accuracy_;  // where that is how it steps
};

}  // namespace cb
