#pragma once

#include <functional>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "contact/assemble.h"
#include "contact/laws.h"
#include "contact/referee.h"
#include "dynamics/articulated_body.h"
#include "dynamics/free_bodies.h"
#include "dynamics/implicit_joints.h"
#include "geometry/broad_phase.h"
#include "methods/registry.h"
#include "scenario/scenario.h"
#include "simulation/bounces.h"
#include "simulation/drift.h"
#include "simulation/event_islands.h"
#include "simulation/lap.h"
#include "simulation/options.h"
#include "simulation/overlap.h"
#include "simulation/step_record.h"

namespace cb {

/// What all ways of stepping are made of (stepping/): bodies that take forces, look what they touch, have events solved
/// and checked, and move. Is handed a method and never asks which.
class BaseStep {
 public:
  BaseStep(const Scenario& scenario, const SimulationOptions& options, ContactMethod method, const Law& law);

  // The verbs of a step, in the order in which they come.
  /// A new record; what it says is gathered until finish().
  void begin(long step);
  /// Which forces of the scene push: in step `index` of equal steps h, s.
  void choose_forces(long index, double h);
  /// Velocities from the forces of a step of h seconds that begins now.
  void kick(double h);
  /// Finds what touches, unless that is known. `horizon`: s, what is left of the step.
  void look(double horizon);
  /// Which of what touches approaches? Where any does, what the event is made of is selected.
  bool approaching();
  /// Has the event solved. False where that ended the run. `bounced`: s left of a step that a time of contact has
  /// split; 0 where none has.
  bool event(double bounced);
  /// Has the event left all bodies at rest, free of overlap (StepPruning::repeats)?
  bool rests() const;
  /// The rest of a step in which all rests: what touches goes on touching.
  void wait();
  /// How long all may move, s, before links' arcs leave steady motion, by which times of contact are sought, or free
  /// bodies that touch turn into each other, by more than a fraction of the smallest shape. No limit where nothing
  /// does.
  double longest_move() const;
  /// Has the last move taken a link further from steady motion, by which times of contact are sought, than such a piece
  /// may be? Of trials alone.
  bool strays() const { return strayed_ > most_off_line * smallest_; }
  /// The first time of contact of what is open, s, or `horizon`. `again`: after another one in this step; `solved`:
  /// did velocities change since the last?
  double until_contact(double horizon, bool again, bool solved);
  /// Moves everything by dt, s.
  void move(double dt);
  /// All that touches or can come to touch within h seconds, for one problem in which open contacts may close by their
  /// gap (stepping/steps.h).
  void look_ahead(double h);
  /// What moves moves with the velocities of the present.
  void update_motions();
  /// Counts a time of contact that ended a move by dt; false where its pair has come too often, which ends the run.
  bool arrive(double dt);
  void find_contacts();
  /// Takes away what overlaps of what was found.
  void part();
  /// The end of a step: what overlaps is taken away, and what touches is found.
  void settle();
  /// The end of the record: at time t, s.
  void finish(double t);

  // What stepping to an accuracy needs besides (stepping/accuracy.h).
  /// What a step changes and the next one needs: copying it is a checkpoint. What touches is found again.
  struct Checkpoint {
    State state;
    double energy_input = 0;  ///< J
    bool spinning = false;
  };
  void save(Checkpoint& to) const { to = {state_, energy_input_, spinning_}; }
  void restore(const Checkpoint& from);
  void set_state(const State& state);
  /// Forces of the scene that push from time t (s) on.
  void choose_forces_at(double t);
  /// Restitution is left out where no contact would part with more than this, m/s.
  void set_rest_speed(double speed) { rest_speed_ = speed; }
  /// Are contacts of free bodies kept closed as those of robots are (drift.h), and of all only those that do not part?
  void hold_contacts(bool hold) {
    hold_contacts_ = hold;
    drift_.set_exact(hold);
  }
  /// These are not held in what follows.
  void release(const std::vector<ContactPoint>& contacts) { released_ = contacts; }
  void record(const AccuracyStep& step) { record_.accuracy = step; }
  /// Are the events to come of base steps that are extrapolated from?
  void set_trial(bool trial);
  /// What has been tried since set_trial(true) is not taken: its failure ends no run, its answers are not the step's.
  void forgive();
  /// How what touches moves now, where it does not part.
  struct Mode {
    int a, b;   ///< shapes; or -1 - tree and joint at its limit; or a motor at its torque's limit
    int facet;  ///< -1: sticks; else 0, or twice the facet of the polygon that it slips in, odd between two
    Vec3 slip;  ///< m/s, tangential; of what has no friction 0, as its facet is
  };
  void read_modes(std::vector<Mode>& modes) const;
  /// Does it part, as it moves now?
  bool parts(const ContactPoint& contact) const;
  /// What touches, does not part and is not released.
  void read_held(std::vector<ContactPoint>& held) const;
  /// Fastest approach of what touches, m/s.
  double approach_speed();
  /// Brings the points that touched at `touching`, found at the state `before`, to gap 0, where they are off by at most
  /// `reach` (m).
  void close_gaps(const std::vector<ContactPoint>& touching, const State& before, double reach);
  double energy_input() const { return energy_input_; }
  void end_at(double t) { state_.t = t; }
  /// What touches has changed.
  void forget_contacts() { contacts_known_ = false; }
  const std::vector<ContactPoint>& contacts() const { return contacts_; }

  bool going_on() const { return record_.status == Status::ok || record_.status == Status::inaccurate; }
  const StepRecord& record() const { return record_; }
  const State& state() const { return state_; }
  /// Called after each event, in time order; may be empty.
  std::function<void(const EventRecord&)> on_event;
  /// Called by forgive(): events since set_trial(true) are none of the step's. May be empty.
  std::function<void()> on_forgive;
  /// Where status is not ok: one line.
  const std::string& reason() const { return reason_; }
  /// Torques of the motors in the last step, after their limits (N m, N); indexed as State::qd.
  const std::vector<double>& torque() const { return torque_; }
  const StepLeftOut& left_out() const { return left_out_; }
  const ContactProblem& problem() const { return problem_; }
  const ContactSolution& solution() const { return solution_; }

 private:
  const Vec3& gravity();
  void accelerate_trees(const Vec3& gravity);
  struct Lent;
  void kick(const Tree& tree, Lent& lent);
  double bending_of_links() const;               // m/s^2
  double bending_of_contacts() const;            // 1/s^2
  static constexpr double most_off_line = 0.05;  // -: of the smallest shape; half of what ends the run
  double off_line(double dt) const;
  Vec3 shape_velocity(int shape, const Vec3& position) const;
  double largest_pair_tolerance() const;
  bool keeps_pairs() const;
  void find_pairs(double horizon, double margin);
  void find_pairs_within(double travel);
  void remove_overlap();
  void fail_overlap(int i, int j, double depth);
  bool find_approaching();
  bool as_before();
  void shuffle_contacts();
  void find_limits();
  double limit_speed(const Joint& joint) const;
  void find_driven();
  void drive();
  bool moved_by_impulses(int shape) const;
  void select_islands();
  void solve_event();
  bool take_answer();
  void record_answer();
  void take_over_velocities();
  void put_at_rest(int body);
  void stop_at_limits(int tree);
  bool corners_fall_short();
  bool limits_fall_short();
  bool points_fall_short();
  bool goes_through(int i, int j);
  void set_velocities_after();
  bool patch_spins();
  double first_contact(double horizon, double reach);
  double first_limit(double horizon);
  double bounce_wait(int i, int j, double horizon) const;
  void observe_bounces(double remaining);
  void advance_positions(double dt);
  double travel_within(std::size_t shape, double horizon) const;
  double displacement_bound(double horizon);
  void fail(Status status, std::string reason);
  double closing_speed(const ContactPoint& contact, double u_n) const;
  void add_gaps();
  void leave_out_restitution();
  /// How fast shape a's point at a contact moves as seen from b's, m/s; and the sum of the terms' sizes.
  struct Relative {
    Vec3 u;
    double terms;
  };
  Relative relative_velocity(const ContactPoint& contact) const;
  double still(const Relative& relative) const;

  const Scenario& scenario_;
  SimulationOptions options_;
  ContactMethod method_;
  Law law_;
  State state_;
  StepRecord record_;
  std::string reason_;
  Lap lap_;
  std::vector<char> force_on_;  // per force of the scene: does it push in this step?
  double step_ = 0;             // s, h of the last kick
  double rest_speed_ = 0;       // m/s: where no contact would part with more, none has restitution
  bool hold_contacts_ = false, trial_ = false;
  StepRecord before_trial_;  // and
  std::string reason_before_trial_;
  double ahead_ = 0;                                              // s: what is looked ahead in contacts_; 0: they touch
  Vec3 gravity_ = Vec3::Zero();                                   // m/s^2, at
  double gravity_at_ = std::numeric_limits<double>::quiet_NaN();  // s
  double gravity_speed_ = 0;                                      // m/s, |g| h of the step
  double energy_input_ = 0;  // J: initial kinetic energy and |work| of gravity and forces so far

  Assembler assembler_;
  Referee referee_;
  ContactProblem problem_;
  ContactSolution solution_;
  Residuals residuals_;
  std::vector<double> v_plus_, u_plus_, mu_, restitution_;
  std::vector<double> gap_speed_;  // per contact of the event that is looked ahead at, m/s: w_n of its gap
  /// What the event is made of; contacts_ itself where it is made of all, in their order.
  std::vector<ContactPoint>& event_contacts() {
    return islands_.all() && options_.shuffle == 0 ? contacts_ : event_contacts_;
  }
  std::vector<ContactPoint> contacts_, event_contacts_;  // all that touch
  std::vector<ContactPoint> held_, released_;            // those that do not part; those that are let go
  std::vector<Motion> motions_before_;                   // per shape, where they were found
  std::vector<char> approaches_;                         // per contact and limit that was found
  std::vector<double> partings_;                         // per contact that was found: e times its approach, m/s
  EventIslands islands_;
  std::mt19937_64 random_;  // of the order of contacts
  std::vector<LimitContact>& event_limits() { return islands_.all() ? limits_ : event_limits_; }
  std::vector<LimitContact> limits_, event_limits_;
  std::vector<LimitContact> struck_;  // by steps: that impulses of the step take a joint to
  std::vector<ContactPoint> passed_;  // by steps: of a pair, as far as these take it
  std::pair<std::vector<double>, std::vector<double>> before_impulses_;  // State::v, qd
  std::vector<BlockOwner> owners_;
  std::vector<Vec3> external_;  // per body, N
  // Of events that repeat themselves.
  bool waited_ = false;               // are contacts_, and all of the event, still those of the last one?
  bool repeats_ = false;              // is the present one that one?
  std::vector<double> before_event_;  // State::v
  std::vector<double> reach_;         // per body, m: how far its points are from its centre of mass

  // Robots.
  std::vector<Controller> controllers_;
  ArticulatedBody articulated_body_;
  std::vector<double> torque_, joint_force_, qdd_;  // as State::qd
  std::vector<double> damping_, step_damping_;      // as State::qd: the damping that is implicit, and h times that
  ImplicitJoints implicit_joints_;
  bool implicit_ = false;       // are joint forces those of the end of a step?
  bool at_start_ = false;       // has nothing moved since the kick?
  std::vector<double> twists_;  // State::v before a change
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
  std::vector<double> travel_;  // per shape, m: bound on its displacement before the step ends
  double smallest_ = std::numeric_limits<double>::infinity();  // m, of all shapes
  double strayed_ = 0;                                         // m, off_line of the last move
  double margin_ = 0;                                          // m, by which the pairs were widened
  double moved_ = 0;             // m, bound on what any shape has moved by since they were found
  bool contacts_known_ = false;  // are contacts_ those of the present poses?
  double depth_ = 0;             // m, of the deepest of them
  double overlap_ratio_ = 0;     // -, the deepest in gaps that count as closed
  std::pair<int, int> deepest_;  // shapes of that one
  double deepest_depth_ = 0;     // m, of these; another pair's may be more

  StepLeftOut left_out_;
  std::vector<std::pair<int, int>> patches_;  // first contact of those that stand for more, and how many more
  int points_left_out_ = 0;                   // of the contacts at hand
  bool spinning_ = false;                     // did a patch spin after the last event?
};

}  // namespace cb
