#pragma once

#include <Eigen/Core>
#include <vector>

#include "contact/assemble.h"
#include "scenario/scenario.h"

namespace cb {

/// Kinetic energy of a tree's links, J.
double tree_energy(const Model& model, const Tree& tree, const State& state);
/// Scales a tree's rates by the root of `energy` (J) over the kinetic energy that it has; one at rest stays so.
void set_tree_energy(const Model& model, const Tree& tree, double energy, State& state);

/// Moves bodies and joints by d (nv, as the problem's v); `first`: per block, where its part of d begins. A free body's
/// spin turns with the body, as its inertia does, and keeps its energy; other velocities and rates stay, so that a
/// tree's energy changes with its inertia: by the order of d.
void move_poses(const Model& model, const std::vector<BlockOwner>& owners, const std::vector<int>& first,
                const Eigen::VectorXd& d, State& state);
/// The same without a change of kinetic energy: a tree's rates are scaled by the root of the energies before and after.
void displace(const Model& model, const std::vector<BlockOwner>& owners, const std::vector<int>& first,
              const Eigen::VectorXd& d, State& state);

/// What a displacement must not push joints beyond: the limits of the trees that `points` touch.
void find_joint_limits(const Scenario& scenario, const std::vector<ContactPoint>& points, const State& state,
                       std::vector<LimitContact>& limits);

/// Least N d of a feature with this gap, m or rad: what is closed must not close further, what is open or deeper than
/// `closed` ends at gap 0.
inline double wanted_opening(double gap, double closed) { return gap < -closed || gap > 0 ? -gap : 0; }

}  // namespace cb
