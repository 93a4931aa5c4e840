#pragma once

#include <vector>

#include "contact/problem.h"
#include "dynamics/composite_body.h"
#include "dynamics/implicit_joints.h"
#include "geometry/shapes.h"

namespace cb {

/// A joint that is at its limit: a contact without friction between a link and its parent. u_n = sign (qd - the
/// limit's own rate).
struct LimitContact {
  int tree = 0, joint = 0;
  double sign = 1;  ///< 1: at the lower limit, -1: at the upper one
  double gap = 0;   ///< rad or m
};

/// What a block of M stands for: a free body (tree = -1), or a whole tree.
struct BlockOwner {
  int body = -1, tree = -1;
};

/// Builds the contact problem of one event from touching points and joints at their limits.
/// Only bodies and trees that touch something get a block: free bodies in the order of their index, then trees; a
/// tree's velocities are its qd. `owners` receives who they are. Contacts come first, in their order, then limits: row
/// n acts on the joint's rate (a torque impulse in N m s at a revolute one), the tangential rows are 0, mu = 0 and
/// restitution = 0.
/// `joints`: the blocks of trees are M + h D + h^2 K. Trees that are `driven` (indexed as Model::trees; empty: none) get no block, as what is fixed does not: how they
/// move is no impulse's doing. Their velocity at a contact is in the offset.
class Assembler {
 public:
  /// `mu`, `restitution`: one per contact. `turn`: angle of t1, t2 about -normal (from a to b), rad. Contacts between
  /// two shapes that are fixed or driven must not occur.
  void assemble(const Model& model, const State& state, const std::vector<Shape>& shapes,
                const std::vector<ContactPoint>& contacts, const std::vector<LimitContact>& limits,
                const std::vector<double>& mu, const std::vector<double>& restitution, double turn,
                ContactProblem& problem, std::vector<BlockOwner>& owners, const std::vector<char>& driven = {},
                const ImplicitJoints* joints = nullptr);

 private:
  /// What an event is assembled from.
  struct Scene {
    const Model& model;
    const State& state;
    const std::vector<Shape>& shapes;
    const std::vector<char>& driven;
    const ImplicitJoints* joints;
    bool is_driven(int body) const {
      return !driven.empty() && model.bodies[body].tree >= 0 && driven[model.bodies[body].tree] != 0;
    }
  };
  void mark_blocks(const Scene& scene, const std::vector<ContactPoint>& contacts,
                   const std::vector<LimitContact>& limits);
  void add_bodies(const Scene& scene, ContactProblem& problem, std::vector<BlockOwner>& owners);
  void add_trees(const Scene& scene, ContactProblem& problem, std::vector<BlockOwner>& owners);
  int block_of(const Scene& scene, int body) const;
  void add_contact(const Scene& scene, const ContactPoint& contact, double turn, double* offset,
                   ContactProblem& problem);
  void add_rows(const Scene& scene, int body, int block, const Vec3& position, double sign, const Mat3& axes,
                ContactProblem& problem);
  void add_tree_rows(const Scene& scene, int body, const Vec3& position, double sign, const Mat3& axes,
                     Eigen::Ref<Eigen::Matrix3Xd> J);
  void add_limit(const Scene& scene, const LimitContact& limit, double* offset, ContactProblem& problem) const;

  std::vector<int> block_of_body_, block_of_tree_;  // -1 where there is none
  CompositeBody composite_body_;
  Eigen::Matrix3Xd point_;  // Jacobian of one point
};

}  // namespace cb
