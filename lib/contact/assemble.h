#pragma once

#include <vector>

#include "contact/problem.h"
#include "geometry/shapes.h"

namespace cb {

/// Builds the contact problem of one event from touching points.
/// Only bodies that touch something get a block, in the order of their index; `body_of_block` receives the bodies.
class Assembler {
 public:
  /// `mu`, `restitution`: one per contact. `turn`: angle of t1, t2 about the normal, rad. Contacts between two fixed
  /// shapes must not occur.
  void assemble(const Model& model, const State& state, const std::vector<Shape>& shapes,
                const std::vector<ContactPoint>& contacts, const std::vector<double>& mu,
                const std::vector<double>& restitution, double turn, ContactProblem& problem,
                std::vector<int>& body_of_block);

 private:
  std::vector<int> block_of_body_;
};

}  // namespace cb
