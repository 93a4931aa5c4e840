#include "contact/assemble.h"

namespace cb {

void Assembler::assemble(const Model& model, const State& state, const std::vector<Shape>& shapes,
                         const std::vector<ContactPoint>& contacts, const std::vector<LimitContact>& limits,
                         const std::vector<double>& mu, const std::vector<double>& restitution, double turn,
                         ContactProblem& problem, std::vector<BlockOwner>& owners, const std::vector<char>& driven,
                         const ImplicitJoints* joints) {
  const Scene scene{model, state, shapes, driven, joints};
  problem.clear();
  owners.clear();
  mark_blocks(scene, contacts, limits);
  add_bodies(scene, problem, owners);
  add_trees(scene, problem, owners);

  problem.offset.assign(3 * (contacts.size() + limits.size()), 0.0);
  double* offset = problem.offset.data();
  for (const ContactPoint& contact : contacts) {
    add_contact(scene, contact, turn, offset, problem);
    offset += 3;
  }
  problem.mu = mu;
  problem.restitution = restitution;
  for (const LimitContact& limit : limits) {
    add_limit(scene, limit, offset, problem);
    offset += 3;
  }
}

// Which bodies and trees touch something: their place is 0 for now.
void Assembler::mark_blocks(const Scene& scene, const std::vector<ContactPoint>& contacts,
                            const std::vector<LimitContact>& limits) {
  block_of_body_.assign(scene.model.bodies.size(), -1);
  block_of_tree_.assign(scene.model.trees.size(), -1);
  for (const ContactPoint& contact : contacts) {
    for (int shape : {contact.shape_a, contact.shape_b}) {
      const int body = scene.shapes[shape].body;
      if (body < 0 || scene.is_driven(body)) continue;
      const int tree = scene.model.bodies[body].tree;
      (tree < 0 ? block_of_body_[body] : block_of_tree_[tree]) = 0;
    }
  }
  for (const LimitContact& limit : limits) block_of_tree_[limit.tree] = 0;
}

void Assembler::add_bodies(const Scene& scene, ContactProblem& problem, std::vector<BlockOwner>& owners) {
  const State& state = scene.state;
  for (int body = 0; body < static_cast<int>(scene.model.bodies.size()); ++body) {
    if (block_of_body_[body] < 0) continue;
    const int b = block_of_body_[body] = problem.M.add_block(6);
    owners.push_back({body, -1});
    auto M = problem.M.block(b);
    M.diagonal().head<3>().setConstant(scene.model.bodies[body].mass);
    const Vec3& inertia = scene.model.bodies[body].inertia;
    if (inertia[0] == inertia[1] && inertia[1] == inertia[2]) {  // turning a cube or a sphere changes nothing
      M.diagonal().tail<3>() = inertia;
    } else {
      const Mat3 R = state.pose[body].q.toRotationMatrix();
      M.bottomRightCorner<3, 3>() = R * inertia.asDiagonal() * R.transpose();
    }
    problem.v_minus.insert(problem.v_minus.end(), state.v.begin() + 6 * body, state.v.begin() + 6 * body + 6);
  }
}

void Assembler::add_trees(const Scene& scene, ContactProblem& problem, std::vector<BlockOwner>& owners) {
  const State& state = scene.state;
  for (int t = 0; t < static_cast<int>(scene.model.trees.size()); ++t) {
    if (block_of_tree_[t] < 0) continue;
    const Tree& tree = scene.model.trees[t];
    block_of_tree_[t] = problem.M.add_block(tree.nv);
    owners.push_back({-1, t});
    composite_body_.mass_matrix(scene.model, tree, state, problem.M.block(block_of_tree_[t]));
    if (scene.joints != nullptr) scene.joints->add_to(tree, problem.M.block(block_of_tree_[t]));
    problem.v_minus.insert(problem.v_minus.end(), state.qd.begin() + tree.v, state.qd.begin() + tree.v + tree.nv);
  }
}

int Assembler::block_of(const Scene& scene, int body) const {
  if (body < 0 || scene.is_driven(body)) return -1;
  const int tree = scene.model.bodies[body].tree;
  return tree < 0 ? block_of_body_[body] : block_of_tree_[tree];
}

[[gnu::always_inline]] inline void Assembler::add_rows(const Scene& scene, int body, int block, const Vec3& position,
                                                       double sign, const Mat3& axes, ContactProblem& problem) {
  auto J = problem.J.entry(problem.J.add_entry(block, problem.M.block_size(block)));
  if (scene.model.bodies[body].tree >= 0) return add_tree_rows(scene, body, position, sign, axes, J);
  const Vec3 arm = position - scene.state.pose[body].p;
  J.leftCols<3>() = sign * axes;
  // d.(w x arm) = w.(arm x d), a column of all three directions at a time.
  J.col(3) = sign * (arm[1] * axes.col(2) - arm[2] * axes.col(1));
  J.col(4) = sign * (arm[2] * axes.col(0) - arm[0] * axes.col(2));
  J.col(5) = sign * (arm[0] * axes.col(1) - arm[1] * axes.col(0));
}

void Assembler::add_contact(const Scene& scene, const ContactPoint& contact, double turn, double* offset,
                            ContactProblem& problem) {
  Mat3 axes;  // rows n, t1, t2
  Vec3 t1, t2;
  contact_tangents(contact, turn, t1, t2);
  axes << contact.normal.transpose(), t1.transpose(), t2.transpose();

  const Vec3& p = contact.position;
  const int a = scene.shapes[contact.shape_a].body, b = scene.shapes[contact.shape_b].body;
  const int block_a = block_of(scene, a), block_b = block_of(scene, b);
  Eigen::Map<Vec3> w(offset);
  if (a >= 0 && scene.is_driven(a)) w += axes * velocity_at(scene.state, a, p);
  if (b >= 0 && scene.is_driven(b)) w -= axes * velocity_at(scene.state, b, p);

  problem.J.add_band();
  if (block_a >= 0 && block_a == block_b) {  // two links of one tree: one entry
    auto J = problem.J.entry(problem.J.add_entry(block_a, problem.M.block_size(block_a)));
    add_tree_rows(scene, a, p, 1, axes, J);
    add_tree_rows(scene, b, p, -1, axes, J);
    return;
  }
  const bool b_first = block_a >= 0 && block_b >= 0 && block_b < block_a;
  if (b_first) add_rows(scene, b, block_b, p, -1, axes, problem);
  if (block_a >= 0) add_rows(scene, a, block_a, p, 1, axes, problem);
  if (block_b >= 0 && !b_first) add_rows(scene, b, block_b, p, -1, axes, problem);
}

void Assembler::add_tree_rows(const Scene& scene, int body, const Vec3& position, double sign, const Mat3& axes,
                              Eigen::Ref<Eigen::Matrix3Xd> J) {
  const Tree& tree = scene.model.trees[scene.model.bodies[body].tree];
  point_.resize(3, tree.nv);
  point_jacobian(scene.model, tree, scene.state, joint_of_body(tree, body), position, point_);
  J.noalias() += sign * (axes * point_);
}

void Assembler::add_limit(const Scene& scene, const LimitContact& limit, double* offset,
                          ContactProblem& problem) const {
  problem.J.add_band();
  const int index = block_of_tree_[limit.tree];
  auto J = problem.J.entry(problem.J.add_entry(index, problem.M.block_size(index)));
  const Tree& tree = scene.model.trees[limit.tree];
  const Joint& joint = tree.joints[limit.joint];
  J(0, joint.v - tree.v) = limit.sign;
  *offset = -limit.sign * joint.limit_rate;
  problem.mu.push_back(0);
  problem.restitution.push_back(0);
}

}  // namespace cb
