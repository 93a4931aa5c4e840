#include "contact/assemble.h"

namespace cb {

namespace {

// Of a body's point, m/s.
Vec3 velocity_at(const State& state, int body, const Vec3& position) {
  const double* v = &state.v[6 * static_cast<std::size_t>(body)];
  return Vec3(v) + Vec3(v + 3).cross(position - state.pose[body].p);
}

}  // namespace

void Assembler::add_tree_rows(const Model& model, const State& state, int body, const Vec3& position, double sign,
                              const Mat3& axes, Eigen::Ref<Eigen::Matrix3Xd> J) {
  const Tree& tree = model.trees[model.bodies[body].tree];
  point_.resize(3, tree.nv);
  point_jacobian(model, tree, state, joint_of_body(tree, body), position, point_);
  J.noalias() += sign * (axes * point_);
}

void Assembler::assemble(const Model& model, const State& state, const std::vector<Shape>& shapes,
                         const std::vector<ContactPoint>& contacts, const std::vector<LimitContact>& limits,
                         const std::vector<double>& mu, const std::vector<double>& restitution, double turn,
                         ContactProblem& problem, std::vector<BlockOwner>& owners, const std::vector<char>& driven) {
  const auto is_driven = [&](int body) {
    return !driven.empty() && model.bodies[body].tree >= 0 && driven[model.bodies[body].tree] != 0;
  };
  problem.clear();
  owners.clear();

  // Bodies that touch something, in the order of their index; then trees.
  block_of_body_.assign(model.bodies.size(), -1);
  block_of_tree_.assign(model.trees.size(), -1);
  for (const ContactPoint& contact : contacts) {
    for (int shape : {contact.shape_a, contact.shape_b}) {
      const int body = shapes[shape].body;
      if (body < 0 || is_driven(body)) continue;
      const int tree = model.bodies[body].tree;
      (tree < 0 ? block_of_body_[body] : block_of_tree_[tree]) = 0;
    }
  }
  for (const LimitContact& limit : limits) block_of_tree_[limit.tree] = 0;
  for (int body = 0; body < static_cast<int>(model.bodies.size()); ++body) {
    if (block_of_body_[body] < 0) continue;
    const int b = block_of_body_[body] = problem.M.add_block(6);
    owners.push_back({body, -1});
    auto M = problem.M.block(b);
    M.diagonal().head<3>().setConstant(model.bodies[body].mass);
    const Vec3& inertia = model.bodies[body].inertia;
    if (inertia[0] == inertia[1] && inertia[1] == inertia[2]) {  // turning a cube or a sphere changes nothing
      M.diagonal().tail<3>() = inertia;
    } else {
      const Mat3 R = state.pose[body].q.toRotationMatrix();
      M.bottomRightCorner<3, 3>() = R * inertia.asDiagonal() * R.transpose();
    }
    problem.v_minus.insert(problem.v_minus.end(), state.v.begin() + 6 * body, state.v.begin() + 6 * body + 6);
  }
  for (int t = 0; t < static_cast<int>(model.trees.size()); ++t) {
    if (block_of_tree_[t] < 0) continue;
    const Tree& tree = model.trees[t];
    block_of_tree_[t] = problem.M.add_block(tree.nv);
    owners.push_back({-1, t});
    composite_body_.mass_matrix(model, tree, state, problem.M.block(block_of_tree_[t]));
    problem.v_minus.insert(problem.v_minus.end(), state.qd.begin() + tree.v, state.qd.begin() + tree.v + tree.nv);
  }

  problem.offset.assign(3 * (contacts.size() + limits.size()), 0.0);
  std::size_t row = 0;
  for (const ContactPoint& contact : contacts) {
    Mat3 axes;  // rows n, t1, t2
    Vec3 t1, t2;
    contact_tangents(contact.normal, -turn, t1, t2);  // the normal points from b to a
    axes << contact.normal.transpose(), t1.transpose(), t2.transpose();

    problem.J.add_band();
    const auto block = [&](int body) {
      if (body < 0 || is_driven(body)) return -1;
      const int tree = model.bodies[body].tree;
      return tree < 0 ? block_of_body_[body] : block_of_tree_[tree];
    };
    const int a = shapes[contact.shape_a].body, b = shapes[contact.shape_b].body;
    const int block_a = block(a), block_b = block(b);
    Eigen::Map<Vec3> offset(&problem.offset[row]);
    row += 3;
    if (a >= 0 && is_driven(a)) offset += axes * velocity_at(state, a, contact.position);
    if (b >= 0 && is_driven(b)) offset -= axes * velocity_at(state, b, contact.position);
    const auto add = [&](int body, int index, double sign) {
      if (model.bodies[body].tree >= 0) {
        auto J = problem.J.entry(problem.J.add_entry(index, problem.M.block_size(index)));
        add_tree_rows(model, state, body, contact.position, sign, axes, J);
        return;
      }
      auto J = problem.J.entry(problem.J.add_entry(index, 6));
      const Vec3 arm = contact.position - state.pose[body].p;
      J.leftCols<3>() = sign * axes;
      for (int i = 0; i < 3; ++i)
        J.row(i).tail<3>() = sign * arm.cross(Vec3(axes.row(i))).transpose();  // d.(w x arm) = w.(arm x d)
    };
    if (block_a >= 0 && block_a == block_b) {  // two links of one tree: one entry
      auto J = problem.J.entry(problem.J.add_entry(block_a, problem.M.block_size(block_a)));
      add_tree_rows(model, state, a, contact.position, 1, axes, J);
      add_tree_rows(model, state, b, contact.position, -1, axes, J);
      continue;
    }
    const bool b_first = block_a >= 0 && block_b >= 0 && block_b < block_a;
    if (b_first) add(b, block_b, -1);
    if (block_a >= 0) add(a, block_a, 1);
    if (block_b >= 0 && !b_first) add(b, block_b, -1);
  }
  problem.mu = mu;
  problem.restitution = restitution;
  for (const LimitContact& limit : limits) {
    problem.J.add_band();
    const int index = block_of_tree_[limit.tree];
    auto J = problem.J.entry(problem.J.add_entry(index, problem.M.block_size(index)));
    const Tree& tree = model.trees[limit.tree];
    const Joint& joint = tree.joints[limit.joint];
    J(0, joint.v - tree.v) = limit.sign;
    problem.offset[row] = -limit.sign * joint.limit_rate;
    row += 3;
    problem.mu.push_back(0);
    problem.restitution.push_back(0);
  }
}

}  // namespace cb
