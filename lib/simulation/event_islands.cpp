#include "simulation/event_islands.h"

#include <algorithm>
#include <numeric>

namespace cb {

int EventIslands::root(int node) {
  while (parent_[node] != node) node = parent_[node] = parent_[parent_[node]];
  return node;
}

void EventIslands::find(const Model& model, const std::vector<Shape>& shapes, const std::vector<ContactPoint>& contacts,
                        const std::vector<LimitContact>& limits, const std::vector<char>& driven,
                        const std::vector<char>& approaches) {
  const auto bodies = static_cast<int>(model.bodies.size()), trees = static_cast<int>(model.trees.size());
  all_ = bodies + trees <= 1 ||
         std::all_of(approaches.begin(), approaches.end(), [](char approaching) { return approaching != 0; });
  if (all_) return;

  const auto node = [&](int shape) {
    const int body = shapes[shape].body;
    if (body < 0 || model.bodies[body].tree < 0) return body;
    return driven[model.bodies[body].tree] != 0 ? -1 : bodies + model.bodies[body].tree;
  };
  parent_.resize(bodies + trees);
  std::iota(parent_.begin(), parent_.end(), 0);
  island_.clear();
  for (const ContactPoint& contact : contacts) {
    const int a = node(contact.shape_a), b = node(contact.shape_b);
    if (a >= 0 && b >= 0) parent_[root(a)] = root(b);
    island_.push_back(a >= 0 ? a : b);
  }
  for (const LimitContact& limit : limits) island_.push_back(bodies + limit.tree);

  approaching_.assign(parent_.size(), 0);
  for (std::size_t i = 0; i < island_.size(); ++i) {
    island_[i] = root(island_[i]);
    if (approaches[i]) approaching_[island_[i]] = 1;
  }
}

}  // namespace cb
