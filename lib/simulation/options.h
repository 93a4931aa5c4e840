#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "contact/laws.h"
#include "dynamics/free_bodies.h"

namespace cb {

/// The first of equal steps h (s) that starts at or after time t, s; one that no run comes to where that is further
/// off.
inline long step_at(double t, double h) { return std::lround(std::min(std::ceil(t / h - 1e-9), 1e18)); }

/// What a step may leave out because the motion is the same without it.
struct StepPruning {
  /// Points of a box's contact grid inside a whole face or edge that touches: the corners of their hull carry any force
  /// and torque that all of them can, but for friction where the patch spins; there, and where the pair has
  /// restitution, all of them stay. What the law says of that.
  Corners corners = Corners::differ;
  /// Times of contact of pairs that move by less than a quarter of the tolerance before the step ends.
  bool contact_times = true;
  /// Searches for pairs of shapes that can meet, while everything has moved by less than half of the margin since the
  /// last one. Not with robots, whose links are moved without a velocity too (drift.h).
  bool pair_searches = true;
  /// Events of bodies that all rest, where they begin as the last one did to the last bit: its answer, which the
  /// referee has seen, is theirs. So that there are any, a body that an event leaves with less than 1e-12 of what it
  /// came with is put at rest: less than what answers are solved to. Not with robots, and not where steps are compared.
  bool repeats = false;
};

/// The ways of stepping (docs/stepping.md), one file each in stepping/.
enum class Stepping { events, steps, accuracy };

/// Springs, dampers and motors of joints as at the start of a step, but for damping that no controller makes up for; or
/// linearised and taken at its end (dynamics/implicit_joints.h).
enum class JointForces { explicit_euler, implicit };

struct SimulationOptions {
  Stepping stepping = Stepping::events;
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
  JointForces joint_forces = JointForces::explicit_euler;
  /// Fractions of the smaller body's size. Deeper inside a step than the limit, or at its end than the bound: the run
  /// ends as `penetration`. Inside a step points of contact move along the surfaces while their velocities are bound
  /// where they were; at its end overlap.h has taken that away down to the closed gap.
  double penetration_limit = 0.1;
  double penetration_bound = 1e-6;
  StepPruning prune = {Corners::differ, false, false};

  // Of stepping to an accuracy.
  double accuracy = 1e-6;      ///< m: wanted bound of a body's place (a rotation counts by its radius), at any time
  int order = 0;               ///< base steps of the finest sequence, 2 to 8; 0: what the accuracy asks for
  double longest = HUGE_VAL;   ///< s: no macro step is longer
  double smallest = 0;         ///< s: what switches are taken with; 0: what the accuracy asks for
  double record_interval = 0;  ///< s: macro steps end at its multiples; 0: wherever they end
};

}  // namespace cb
