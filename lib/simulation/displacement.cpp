#include "simulation/displacement.h"

#include <algorithm>
#include <cmath>

#include "dynamics/kinematics.h"

namespace cb {

namespace {

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

void displace_body(const Body& body, const double* d, Pose& pose, double* w) {
  pose = advance(pose, Vec3(d), Vec3(d + 3), 1);
  const Vec3& inertia = body.inertia;
  if (inertia[0] == inertia[1] && inertia[1] == inertia[2]) return;  // turning it leaves its inertia as it is
  const double angle = Vec3(d + 3).norm();
  if (angle == 0) return;
  Eigen::Map<Vec3> spin(w);
  spin = Eigen::AngleAxisd(angle, Vec3(d + 3) / angle) * Vec3(spin);
}

void displace_tree(const Model& model, const Tree& tree, const double* d, State& state) {
  const double before = tree_energy(model, tree, state);
  move_tree(model, tree, d, 1, state);
  const double after = tree_energy(model, tree, state);
  if (after == before || !(after > 0)) return;
  Eigen::Map<Eigen::VectorXd>(&state.qd[tree.v], tree.nv) *= std::sqrt(before / after);
  link_twists(model, tree, state);
}

}  // namespace

void displace(const Model& model, const std::vector<BlockOwner>& owners, const std::vector<int>& first,
              const Eigen::VectorXd& d, State& state) {
  for (std::size_t b = 0; b < owners.size(); ++b) {
    const double* part = d.data() + first[b];
    const int body = owners[b].body;
    if (owners[b].tree < 0)
      displace_body(model.bodies[body], part, state.pose[body], &state.v[6 * static_cast<std::size_t>(body) + 3]);
    else
      displace_tree(model, model.trees[owners[b].tree], part, state);
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
