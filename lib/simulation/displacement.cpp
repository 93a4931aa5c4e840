#include "simulation/displacement.h"

#include <algorithm>
#include <cmath>

#include "dynamics/kinematics.h"

namespace cb {

namespace {

void turn_spin(const Body& body, const double* d, double* w) {
  const Vec3& inertia = body.inertia;
  if (inertia[0] == inertia[1] && inertia[1] == inertia[2]) return;  // turning it leaves its inertia as it is
  const double angle = Vec3(d + 3).norm();
  if (angle == 0) return;
  Eigen::Map<Vec3> spin(w);
  spin = Eigen::AngleAxisd(angle, Vec3(d + 3) / angle) * Vec3(spin);
}

}  // namespace

double tree_energy(const Model& model, const Tree& tree, const State& state) {
  double energy = 0;
  for (const Joint& joint : tree.joints) {
    const Body& body = model.bodies[joint.body];
    const double* v = &state.v[6 * static_cast<std::size_t>(joint.body)];
    energy += 0.5 * body.mass * Vec3(v).squaredNorm() +
              0.5 * body.inertia.dot((state.pose[joint.body].q.conjugate() * Vec3(v + 3)).cwiseAbs2());
  }
  return energy;
}

void set_tree_energy(const Model& model, const Tree& tree, double energy, State& state) {
  const double has = tree_energy(model, tree, state);
  if (has == energy || !(has > 0)) return;
  Eigen::Map<Eigen::VectorXd>(&state.qd[tree.v], tree.nv) *= std::sqrt(energy / has);
  link_twists(model, tree, state);
}

void move_poses(const Model& model, const std::vector<BlockOwner>& owners, const std::vector<int>& first,
                const Eigen::VectorXd& d, State& state) {
  for (std::size_t b = 0; b < owners.size(); ++b) {
    const double* part = d.data() + first[b];
    if (owners[b].tree < 0) {
      Pose& pose = state.pose[owners[b].body];
      pose = advance(pose, Vec3(part), Vec3(part + 3), 1);
      turn_spin(model.bodies[owners[b].body], part, &state.v[6 * static_cast<std::size_t>(owners[b].body) + 3]);
    } else {
      move_tree(model, model.trees[owners[b].tree], part, 1, state);
    }
  }
}

void displace(const Model& model, const std::vector<BlockOwner>& owners, const std::vector<int>& first,
              const Eigen::VectorXd& d, State& state) {
  std::vector<double> before;  // per block that is a tree, J
  for (const BlockOwner& owner : owners)
    if (owner.tree >= 0) before.push_back(tree_energy(model, model.trees[owner.tree], state));
  move_poses(model, owners, first, d, state);
  std::size_t at = 0;
  for (const BlockOwner& owner : owners) {
    if (owner.tree < 0) continue;
    set_tree_energy(model, model.trees[owner.tree], before[at++], state);
  }
}

void find_joint_limits(const Scenario& scenario, const std::vector<ContactPoint>& points, const State& state,
                       std::vector<LimitContact>& limits) {
  limits.clear();
  const Model& model = scenario.model;
  std::vector<char> touched(model.trees.size(), 0);
  for (const ContactPoint& point : points)
    for (const int shape : {point.shape_a, point.shape_b}) {
      const int body = scenario.shapes[shape].body;
      if (body >= 0 && model.bodies[body].tree >= 0) touched[model.bodies[body].tree] = 1;
    }
  for (int t = 0; t < static_cast<int>(model.trees.size()); ++t) {
    if (!touched[t]) continue;
    const std::vector<Joint>& joints = model.trees[t].joints;
    for (int j = 0; j < static_cast<int>(joints.size()); ++j) {
      if (joints[j].q < 0 || !joints[j].limited()) continue;
      for (const double sign : {1.0, -1.0}) {
        const double gap = joints[j].limit_gap(sign, state.q[joints[j].q], state.t);
        if (std::isfinite(gap)) limits.push_back({t, j, sign, gap});
      }
    }
  }
}

}  // namespace cb
