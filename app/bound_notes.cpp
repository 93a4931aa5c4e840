#include "bound_notes.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

namespace cb {

namespace {

/// What the laws of a group of shapes (PairLaws::group) say.
struct GroupLaws {
  double mu = 0;              ///< the largest
  bool meets_moving = false;  ///< does it collide with bodies that move?
};

std::vector<GroupLaws> laws_by_group(const Scenario& scenario) {
  const PairLaws& pairs = scenario.pairs;
  const auto groups = static_cast<std::size_t>(pairs.groups);
  std::vector<char> moving(groups, 0);
  for (std::size_t i = 0; i < scenario.shapes.size(); ++i)
    if (scenario.shapes[i].body >= 0) moving[static_cast<std::size_t>(pairs.group[i])] = 1;
  std::vector<GroupLaws> out(groups);
  for (std::size_t g = 0; g < groups; ++g)
    for (std::size_t other = 0; other < groups; ++other) {
      const int law = pairs.index[g * groups + other];
      if (law < 0) continue;
      out[g].mu = std::max(out[g].mu, pairs.laws[static_cast<std::size_t>(law)].mu);
      out[g].meets_moving = out[g].meets_moving || moving[other] != 0;
    }
  return out;
}

/// A box that friction holds until it tips: the first one with an edge shorter than mu times another.
std::optional<std::string> tips(const Scenario& scenario, const std::vector<GroupLaws>& laws) {
  for (std::size_t i = 0; i < scenario.shapes.size(); ++i) {
    const Shape& shape = scenario.shapes[i];
    if (shape.kind != ShapeKind::box || shape.body < 0) continue;
    const double slender = shape.half_extents.minCoeff() / shape.half_extents.maxCoeff();
    const double mu = laws[static_cast<std::size_t>(scenario.pairs.group[i])].mu;
    if (mu > slender)
      return fmt::format(
          "with the compression bound a box that should tip slides: {} tips before it slides where friction ({:g}) is "
          "above width over height ({:.3g} on its narrowest base); ap or --compression-bound off tip it",
          shape.name, mu, slender);
  }
  return std::nullopt;
}

/// Bodies that can push each other, not all with the same grip: unequal friction, or a link that stands on nothing.
bool pushes(const Scenario& scenario, const std::vector<GroupLaws>& laws) {
  const auto& all = scenario.pairs.laws;
  const bool even = std::all_of(all.begin(), all.end(), [&](const PairLaw& law) { return law.mu == all[0].mu; });
  if (even && scenario.model.trees.empty()) return false;
  for (std::size_t i = 0; i < scenario.shapes.size(); ++i)
    if (scenario.shapes[i].body >= 0 && laws[static_cast<std::size_t>(scenario.pairs.group[i])].meets_moving)
      return true;
  return false;
}

}  // namespace

std::vector<std::string> bound_notes(const Scenario& scenario) {
  const std::vector<GroupLaws> laws = laws_by_group(scenario);
  std::vector<std::string> out;
  if (auto note = tips(scenario, laws)) out.push_back(std::move(*note));
  if (pushes(scenario, laws))
    out.emplace_back(
        "with the compression bound a body that another one pushes is held by no more friction than the pusher's own; "
        "ap or --compression-bound off hold it");
  return out;
}

}  // namespace cb
