#pragma once

#include <optional>

#include "dynamics/implicit_joints.h"
#include "scenario/scenario.h"
#include "simulation/options.h"

namespace cb {

/// Of each rate (as State::qd): the damping, N m s/rad or N s/m, of a joint that no controller drives. Its torque is
/// that of the rates at the end of a step, so that it never drives what it should brake: explicit, it does where h d is
/// more than twice the inertia that the joint moves. A driven joint's stays explicit, as the torques that are to make
/// up for it are.
std::vector<double> implicit_damping(const Scenario& scenario);

/// What implicit joint forces take at the end of a step: of springs and dampers; of controllers.
JointGains passive_gains(const Scenario& scenario);
JointGains motor_gains(const Scenario& scenario);

/// Largest eigenvalue, by magnitude, of h A at the scenario's initial state, where A = -d qdd / d qd of the controlled
/// robots out of contact, motors without limits: M^-1 (velocity gains + damping) and what feed-forward leaves of them;
/// (M + h D)^-1 with implicit damping D.
/// With implicit joint forces M is M + h D + h^2 K. The step multiplies a rate's error by 1 - h A: beyond 2 it grows, whatever the method. None without a controller.
std::optional<double> largest_eigenvalue(const Scenario& scenario, double h,
                                         JointForces forces = JointForces::explicit_euler);

/// Largest step, s, that is stable at the scenario's initial state, out of contact, motors without limits: no
/// eigenvalue of the linearised step (velocities first, then positions with the new ones)
///   qd' = qd - h (A qd + K q),  q' = q + h qd',   K = -d qdd / d q of revolute and prismatic joints,
/// is larger than 1, or than what the motion itself grows by where it is unstable (a rod on end). An undamped spring:
/// 2 / sqrt(k / m). None without controllers, springs and damping; at most 1e3.
/// With implicit joint forces h K qd is added to the forces of K q, and M is M + h D + h^2 K.
std::optional<double> largest_stable_step(const Scenario& scenario, JointForces forces = JointForces::explicit_euler);

}  // namespace cb
