#include "contact/assemble.h"

namespace cb {

void Assembler::assemble(const Model& model, const State& state, const std::vector<Shape>& shapes,
                         const std::vector<ContactPoint>& contacts, const std::vector<double>& mu,
                         const std::vector<double>& restitution, double turn, ContactProblem& problem,
                         std::vector<int>& body_of_block) {
  problem.clear();
  body_of_block.clear();

  // Bodies that touch something, in the order of their index.
  block_of_body_.assign(model.bodies.size(), -1);
  for (const ContactPoint& contact : contacts)
    for (int shape : {contact.shape_a, contact.shape_b})
      if (shapes[shape].body >= 0) block_of_body_[shapes[shape].body] = 0;
  for (int body = 0; body < static_cast<int>(model.bodies.size()); ++body) {
    if (block_of_body_[body] < 0) continue;
    const int b = block_of_body_[body] = problem.M.add_block(6);
    body_of_block.push_back(body);
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

  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const ContactPoint& contact = contacts[c];
    Eigen::Matrix3d axes;  // rows n, t1, t2
    Vec3 t1, t2;
    contact_tangents(contact.normal, turn, t1, t2);
    axes << contact.normal.transpose(), t1.transpose(), t2.transpose();

    problem.J.add_band();
    const auto add = [&](int shape, double sign) {
      const int body = shapes[shape].body;
      auto J = problem.J.entry(problem.J.add_entry(block_of_body_[body], 6));
      const Vec3 arm = contact.position - state.pose[body].p;
      J.leftCols<3>() = sign * axes;
      for (int row = 0; row < 3; ++row)
        J.row(row).tail<3>() = sign * arm.cross(Vec3(axes.row(row))).transpose();  // d.(w x arm) = w.(arm x d)
    };
    const int a = shapes[contact.shape_a].body, b = shapes[contact.shape_b].body;
    const bool b_first = a >= 0 && b >= 0 && block_of_body_[b] < block_of_body_[a];
    if (b >= 0 && b_first) add(contact.shape_b, -1);
    if (a >= 0) add(contact.shape_a, 1);
    if (b >= 0 && !b_first) add(contact.shape_b, -1);
  }
  problem.offset.assign(3 * contacts.size(), 0.0);
  problem.mu = mu;
  problem.restitution = restitution;
}

}  // namespace cb
