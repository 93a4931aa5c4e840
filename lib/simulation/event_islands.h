#pragma once

#include <vector>

#include "contact/assemble.h"

namespace cb {

/// Which of the closed features an event is made of: those of islands in which one of them approaches. An island is
/// bodies joined by contacts; a tree of joints is one body, the fixed world and what is driven none. Where nothing
/// approaches zero impulses solve every contact model exactly, so that there is nothing to hand to a method.
class EventIslands {
 public:
  /// `approaches`: contacts first, then limits; `driven`: per tree. Afterwards includes() holds. Free where all or none
  /// of them approach, or the model has one free body or tree only.
  void find(const Model& model, const std::vector<Shape>& shapes, const std::vector<ContactPoint>& contacts,
            const std::vector<LimitContact>& limits, const std::vector<char>& driven,
            const std::vector<char>& approaches);
  bool all() const { return all_; }
  /// Of the contact, or the limit, at this place of `approaches`.
  bool includes(std::size_t at) const { return all_ || approaching_[island_[at]]; }

 private:
  int root(int node);

  bool all_ = true;
  std::vector<int> parent_;        // nodes: free bodies and links by index, then trees
  std::vector<int> island_;        // per contact and limit: the node that stands for its island
  std::vector<char> approaching_;  // per node that stands for an island
};

}  // namespace cb
