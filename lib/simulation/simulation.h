#pragma once

#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "contact/assemble.h"
#include "contact/laws.h"
#include "contact/referee.h"
#include "dynamics/articulated_body.h"
#include "dynamics/free_bodies.h"
#include "geometry/broad_phase.h"
#include "methods/registry.h"
#include "scenario/scenario.h"
#include "simulation/bounces.h"
#include "simulation/drift.h"
#include "simulation/event_islands.h"
#include "simulation/overlap.h"

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
};

/// CPU-clock seconds spent in the parts of a step.
struct StepTimes {
  double dynamics_s = 0, collision_s = 0, assembly_s = 0, solve_s = 0, step_s = 0;
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
  double event_energy_gain = 0;                     ///< J
  double event_energy_gain_relative = 0;            ///< worst over the events: gain / energy before
  double max_penetration = 0;                       ///< m, at the end of the step
  double penetration_inside = 0;                    ///< m, at the events and before it was taken away
  double penetration_displacement = 0;              ///< m, furthest that a point was moved for that
  int bounces_left_out = 0;                         ///< impacts of pairs whose bounces were over (bounces.h)
  double bounce_speed = 0;                          ///< m/s, largest e u_n of these: what they would have parted with
  double bounce_distance = 0;                       ///< m, largest e u_n t of these, t to the end of the step
  double kinetic_energy = 0, potential_energy = 0;  ///< J
  int false_claims = 0;                             ///< answers called ok that the check refutes
  int doubted = 0;                                  ///< answers not called ok that the check confirms
  bool unsolved = false;                            ///< an event that no answer was found to ended the run
  StepTimes times;
};

/// What a step may leave out because the motion is the same without it.
struct StepPruning {
  /// Points of a box's contact grid inside a whole face or edge that touches: the corners of their hull carry any force
  /// and torque that all of them can, but for friction where the patch spins; there, and where the pair has
  /// restitution, all of them stay. For laws that say so (contact/laws.h: Corners).
  bool coplanar_points = true;
  /// Times of contact of pairs that move by less than a quarter of the tolerance before the step ends.
  bool contact_times = true;
  /// Searches for pairs of shapes that can meet, while everything has moved by less than half of the margin since the
  /// last one. Not with robots, whose links are moved without a velocity too (drift.h).
  bool pair_searches = true;
};

/// What a run left out of its steps, summed over it.
struct StepLeftOut {
  long coplanar_points = 0;  ///< contacts of events
  long contact_times = 0;    ///< searches
  long pair_searches = 0;
};

struct SimulationOptions {
  double step = 1e-3;               ///< s
  double duration = 1;              ///< s
  double accepted_residual = 1e-9;  ///< model residual beyond which an event counts as `inaccurate`, -
  /// Fraction of the body's size below which a pair is closed. Also the window within which contacts are simultaneous:
  /// at a time of contact every feature closer than this belongs to the event (closed_gap * size / approach speed, in
  /// s), if its island does.
  double closed_gap = 1e-9;
  double approach = 1e-13;  ///< an event needs u_n < -approach * (|g| h + |v| + |w x arm| of the pair); also an island
  int event_cap = 1000;     ///< times of contact of one pair in one step, its bounces apart; more: event_stall
  /// Seed of a new order of each event's contacts, which should change nothing but round-off; 0: as they are found.
  std::uint64_t shuffle = 0;
  double blowup_factor = 1e6;  ///< kinetic energy over the largest energy that was put in: energy_blowup
  /// J: kinetic energy that counts as energy_blowup whatever was put in; motors that an unstable explicit step drives
  /// put it in themselves. Far above any scene's, far below overflow.
  double blowup_energy = 1e60;
  Gyroscopic gyroscopic = Gyroscopic::implicit;  ///< of free bodies
  /// Fractions of the smaller body's size. Deeper inside a step than the limit, or at its end than the bound: the run
  /// ends as `penetration`. Inside a step points of contact move along the surfaces while their velocities are bound
  /// where they were; at its end overlap.h has taken that away down to the closed gap.
  double penetration_limit = 0.1;
  double penetration_bound = 1e-6;
  StepPruning prune = {false, false, false};
};

/// The event-driven stepper (docs/architecture.md, "The path of a step"). Is handed a method and never asks which.
class Simulation {
 public:
  Simulation(const Scenario& scenario, const SimulationOptions& options, ContactMethod method, const Law& law);

  /// Advances one step; the record holds until the next call. A status other than ok or inaccurate ends the run. Where
  /// a stop is asked for within it: throws Stopped, and nothing of the step is to be used.
  const StepRecord& step();

  const State& state() const { return state_; }
  long steps_total() const { return steps_total_; }
  long step_index() const { return step_index_; }
  /// Called after each event, in time order; may be empty.
  std::function<void(const EventRecord&)> on_event;
  /// Where status is not ok: one line.
  const std::string& reason() const { return reason_; }
  /// Torques of the motors in the last step, after their limits (N m, N); indexed as State::qd.
  const std::vector<double>& torque() const { return torque_; }
  const StepLeftOut& left_out() const { return left_out_; }
  const ContactProblem& problem() const { return problem_; }
  const ContactSolution& solution() const { return solution_; }

 private:
  class Lap;
  void apply_forces();
  void accelerate_trees(const Vec3& gravity);
  struct Lent;
  void kick(const Tree& tree, Lent& lent);
  void move(double dt, Lap& lap);
  void update_motions();
  bool keeps_pairs() const;
  void find_pairs(double horizon, double margin);
  void find_contacts();
  bool approaching();
  void remove_overlap();
  void fail_overlap(int i, int j, double depth);
  void shuffle_contacts();
  void find_limits();
  void find_driven();
  void drive();
  bool moved_by_impulses(int shape) const;
  void select_islands();
  void solve_event(Lap& lap);
  bool take_answer();
  void record_answer();
  void take_over_velocities();
  bool corners_fall_short();
  bool patch_spins();
  double first_contact(double horizon, double reach);
  double first_limit(double horizon);
  double bounce_wait(int i, int j, double horizon) const;
  bool arrive(double dt);
  void observe_bounces(double remaining);
  void advance_positions(double dt);
  double displacement_bound(double horizon);
  void fail(Status status, std::string reason);

  const Scenario& scenario_;
  SimulationOptions options_;
  ContactMethod method_;
  Law law_;
  State state_;
  long step_index_ = 0, steps_total_ = 0;
  StepRecord record_;
  std::string reason_;
  double gravity_speed_ = 0;  // m/s, |g| h of the step
  double energy_input_ = 0;   // J: initial kinetic energy and |work| of gravity and forces so far

  Assembler assembler_;
  Referee referee_;
  ContactProblem problem_;
  ContactSolution solution_;
  Residuals residuals_;
  std::vector<double> v_plus_, u_plus_, mu_, restitution_;
  /// What the event is made of; contacts_ itself where it is made of all.
  std::vector<ContactPoint>& event_contacts() { return islands_.all() ? contacts_ : event_contacts_; }
  std::vector<ContactPoint> contacts_, event_contacts_;  // all that touch
  std::vector<char> approaches_;                         // per contact and limit that was found
  EventIslands islands_;
  std::mt19937_64 random_;  // of the order of contacts
  std::vector<LimitContact> limits_;
  std::vector<BlockOwner> owners_;
  std::vector<Vec3> external_;  // per body, N

  // Robots.
  std::vector<Controller> controllers_;
  ArticulatedBody articulated_body_;
  std::vector<double> torque_, joint_force_, qdd_;  // as State::qd
  std::vector<double> step_damping_;                // as State::qd: h times the damping that is implicit
  std::vector<double> twists_;                      // State::v before a change
  /// What velocity-product forces gave a tree's rates at the start of the step, until it moves.
  struct Lent {
    double energy = 0;  // J
    double share = 1;   // -: of what it had with it, what it had without
  };
  std::vector<Lent> lent_;              // per tree
  std::vector<double> kept_;            // per tree, J: kinetic energy after a move
  std::vector<double> before_, after_;  // of a tree: rates before a kick; accelerations
  double joint_speed_ = 0;              // largest |qdd| h of the step
  std::vector<char> driven_;            // per tree: do stops leave each of its joints one rate?
  Drift drift_;
  Overlap overlap_;

  Bounces bounces_;
  Bounces::Pair arriving_;  // what the first time of contact is of: shapes; or -1 - tree, joint

  // Collision: what the step looks at.
  BroadPhase broad_phase_;
  std::vector<Motion> motions_;    // per shape
  std::vector<double> tolerance_;  // per shape, m: gap below which it is closed
  std::vector<double> radius_;     // per shape, m: how far its points are from the body's centre of mass
  const std::vector<std::pair<int, int>>* pairs_ = nullptr;
  std::vector<double> travel_;   // per shape, m: bound on its displacement before the step ends
  double margin_ = 0;            // m, by which the pairs were widened
  double moved_ = 0;             // m, bound on what any shape has moved by since they were found
  bool contacts_known_ = false;  // are contacts_ those of the present poses?
  double depth_ = 0;             // m, of the deepest of them
  double overlap_ratio_ = 0;     // -, the deepest in gaps that count as closed
  std::pair<int, int> deepest_;  // shapes of that one

  StepLeftOut left_out_;
  std::vector<std::pair<int, int>> patches_;  // first contact of those that stand for more, and how many more
  int points_left_out_ = 0;                   // of the contacts at hand
  bool spinning_ = false;                     // did a patch spin after the last event?
};

}  // namespace cb
