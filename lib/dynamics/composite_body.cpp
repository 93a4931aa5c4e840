// Composite-rigid-body algorithm: M(q), in time linear in links times depth.
//
// A joint moves all links beyond it as one rigid body: M_ij = S_i . (inertia of what j carries) S_j for i on the way
// from j to the world, else 0. Source: Featherstone (2008), section 6.2, table 6.2. Difference: world axes; inertias
// are taken about the centre of mass of the link at which they are summed. Does not fail.
#include "dynamics/composite_body.h"

namespace cb {

namespace {

// I - m [r]^2 - ...: what a second moment gains when its point moves. [a][b] x = a x (b x x).
Mat3 cross_square(const Vec3& a, const Vec3& b) { return b * a.transpose() - a.dot(b) * Mat3::Identity(); }

}  // namespace

void CompositeBody::mass_matrix(const Model& model, const Tree& tree, const State& state,
                                Eigen::Ref<Eigen::MatrixXd> M) {
  const int n = static_cast<int>(tree.joints.size());
  link_frames(model, tree, state, frames_);
  composite_.resize(n);
  for (int i = 0; i < n; ++i)
    composite_[i] = {model.bodies[tree.joints[i].body].mass, Vec3::Zero(), frames_[i].inertia};

  M.setZero();
  for (int i = n - 1; i >= 0; --i) {
    const Joint& joint = tree.joints[i];
    const Inertia& I = composite_[i];
    if (joint.up >= 0) {  // about the parent's centre of mass, r before the point of I
      Inertia& parent = composite_[joint.up];
      const Vec3& r = frames_[i].arm;
      parent.mass += I.mass;
      parent.first += I.first + I.mass * r;
      parent.second += I.second - cross_square(I.first, r) - cross_square(r, I.first) - I.mass * cross_square(r, r);
    }
    for (int k = joint.nv() - 1; k >= 0; --k) {
      Vec6 S = frames_[i].S;
      if (joint.kind == JointKind::free) S = Vec6::Unit(k);
      // Momentum of what the joint carries, about the link's centre of mass.
      Vec3 f = I.mass * S.head<3>() + S.tail<3>().cross(I.first);
      Vec3 m = I.first.cross(S.head<3>()) + I.second * S.tail<3>();
      const int column = joint.v - tree.v + k;
      if (joint.kind == JointKind::free) {
        for (int x = 0; x <= k; ++x) {
          const double entry = x < 3 ? f[x] : m[x - 3];
          M(joint.v - tree.v + x, column) = M(column, joint.v - tree.v + x) = entry;
        }
        continue;
      }
      M(column, column) = S.head<3>().dot(f) + S.tail<3>().dot(m);
      int j = i;
      while (tree.joints[j].up >= 0) {
        m += frames_[j].arm.cross(f);
        j = tree.joints[j].up;
        const Joint& before = tree.joints[j];
        const int row = before.v - tree.v;
        if (before.kind == JointKind::free) {
          for (int x = 0; x < 3; ++x) {
            M(row + x, column) = M(column, row + x) = f[x];
            M(row + 3 + x, column) = M(column, row + 3 + x) = m[x];
          }
        } else if (before.v >= 0) {
          M(row, column) = M(column, row) = frames_[j].S.head<3>().dot(f) + frames_[j].S.tail<3>().dot(m);
        }
      }
    }
  }
}

}  // namespace cb
