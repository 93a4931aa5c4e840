// Reads <contacts> into the table of laws of pairs, and <forces>.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <tuple>

#include "scenario/reading.h"

namespace cb {

namespace {

constexpr std::size_t group_limit = 2000;  // groups of bodies that pairs treat alike; the table has its square

/// A <pair>: the bodies that its two sides select.
struct Pair {
  const XmlElement* element;
  std::vector<int> a, b;  ///< groups
};

/// The second body of a group.
int next_of_group(const Reading& in, int group) {
  const auto first = std::find(in.scenario.pairs.group.begin(), in.scenario.pairs.group.end(), group);
  return static_cast<int>(std::find(first + 1, in.scenario.pairs.group.end(), group) - in.scenario.pairs.group.begin());
}

std::pair<std::vector<int>, std::vector<int>> read_pair(Reading& in, const XmlElement& element) {
  check_attributes(in.source, element, {"a", "b", "mu"}, {"restitution"});
  check_empty(in.source, element);
  const XmlAttribute &a = *element.find("a"), &b = *element.find("b");
  PairLaw law;
  law.mu = in.values.number(*element.find("mu"), not_negative);
  if (const XmlAttribute* restitution = element.find("restitution"))
    law.restitution = in.values.number(*restitution, {0, 1, false});
  in.scenario.pairs.laws.push_back(law);
  std::vector<int> first = in.find_bodies(a), second = in.find_bodies(b);

  // By name, what cannot collide is a mistake; of a pattern those pairs are taken that can.
  if (is_name(a.value) && a.value == b.value)
    in.source.fail(b.value_at, fmt::format("{} does not collide with itself; name another body", b.value));
  const int body_a = in.scenario.shapes[first.front()].body, body_b = in.scenario.shapes[second.front()].body;
  if (is_name(a.value) && is_name(b.value) && body_a >= 0 && body_a == body_b)
    in.source.fail(b.value_at,
                   fmt::format("{} and {} are shapes of one link, which keep their distance; name another body",
                               a.value, b.value));
  const auto is_free_body = [&](int i) { return in.is_free(i); };
  if (std::none_of(first.begin(), first.end(), is_free_body) &&
      std::none_of(second.begin(), second.end(), is_free_body))
    in.source.fail(a.value_at, fmt::format("{} and {} are both fixed to the world; one of a pair has to be free",
                                           a.value, b.value));
  return {std::move(first), std::move(second)};
}

/// All pairs; `selectors`: per body the sides that select it, ascending, side 2 i for a and 2 i + 1 for b of pair i.
std::vector<Pair> read_pairs(Reading& in, const XmlElement& element, std::vector<std::vector<int>>& selectors) {
  std::vector<Pair> pairs;
  check_attributes(in.source, element, {}, {});
  for (const XmlElement& child : element.children) {
    if (child.name != "pair") in.fail_child(child, "<contacts>", {"pair"});
    const auto [a, b] = read_pair(in, child);
    const int side = 2 * static_cast<int>(pairs.size());
    for (const int i : a) selectors[i].push_back(side);
    for (const int i : b) selectors[i].push_back(side + 1);
    pairs.push_back({&child, {}, {}});
  }
  return pairs;
}

/// Bodies of one kind that the same sides select, and that are alike fixed or free, are one group.
struct BodyGroups {
  std::vector<int> first, size;  ///< per group: its first body, and how many it has
};
BodyGroups group_bodies(Reading& in, const XmlElement* element, const std::vector<std::vector<int>>& selectors,
                        std::vector<Pair>& pairs) {
  BodyGroups groups;
  std::map<std::tuple<ShapeKind, bool, std::vector<int>>, int> group_of;
  for (std::size_t i = 0; i < selectors.size(); ++i) {
    const auto [group, is_new] =
        group_of.try_emplace({in.scenario.shapes[i].kind, in.is_free(static_cast<int>(i)), selectors[i]},
                             static_cast<int>(groups.first.size()));
    if (is_new) {
      // Without pairs there are few kinds.
      if (element != nullptr && groups.first.size() == group_limit)
        in.source.fail(element->at, fmt::format("more than {} kinds of bodies by their pairs; name arrays by patterns "
                                                "(box_*) in place of single bodies",
                                                group_limit));
      groups.first.push_back(static_cast<int>(i));
      groups.size.push_back(0);
      for (const int side : selectors[i])
        (side % 2 == 0 ? pairs[side / 2].a : pairs[side / 2].b).push_back(group->second);
    }
    in.scenario.pairs.group.push_back(group->second);
    ++groups.size[group->second];
  }
  return groups;
}

/// Puts law number `law` of `pairs` into the table for the groups g and h.
void set_law(Reading& in, const std::vector<Pair>& pairs, const BodyGroups& groups, int law, int g, int h) {
  const int first_g = groups.first[g], first_h = groups.first[h];
  if (!in.is_free(first_g) && !in.is_free(first_h)) return;
  if (g == h && groups.size[g] == 1) return;  // a pattern on both sides that only one body matches
  std::vector<int>& index = in.scenario.pairs.index;
  const int count = in.scenario.pairs.groups, known = index[g * count + h];
  if (known >= 0 && known != law)
    in.source.fail(pairs[law].element->at,
                   fmt::format("{} and {} are a pair already (at {}); keep one", in.scenario.shapes[first_g].name,
                               in.declared[g == h ? next_of_group(in, h) : first_h].name,
                               in.source.where(pairs[known].element->at)));
  index[g * count + h] = index[h * count + g] = law;
}

}  // namespace

void read_contacts(Reading& in, const XmlElement* element) {
  std::vector<std::vector<int>> selectors(in.declared.size());
  std::vector<Pair> pairs;
  if (element != nullptr) pairs = read_pairs(in, *element, selectors);
  const BodyGroups groups = group_bodies(in, element, selectors, pairs);
  in.scenario.pairs.groups = static_cast<int>(groups.first.size());
  in.scenario.pairs.index.assign(groups.first.size() * groups.first.size(), -1);
  for (int law = 0; law < static_cast<int>(pairs.size()); ++law)
    for (const int g : pairs[law].a)
      for (const int h : pairs[law].b) set_law(in, pairs, groups, law, g, h);
}

void read_forces(Reading& in, const XmlElement& element) {
  check_attributes(in.source, element, {}, {});
  for (const XmlElement& child : element.children) {
    if (child.name != "force") in.fail_child(child, "<forces>", {"force"});
    check_attributes(in.source, child, {"body", "force", "from", "to"}, {});
    check_empty(in.source, child);
    const XmlAttribute& body = *child.find("body");
    if (body.value.find('*') != std::string::npos)
      in.source.fail(body.value_at, "a force acts on one body; write one <force> for each");
    Force force;
    force.body = in.scenario.shapes[in.find_bodies(body).front()].body;
    if (force.body < 0)
      in.source.fail(body.value_at, fmt::format("{} is fixed to the world; a force needs a free body", body.value));
    force.force = in.vector(*child.find("force"), "x y z in N");
    force.from = in.values.number(*child.find("from"), not_negative);
    force.to = in.values.number(*child.find("to"), not_negative);
    if (force.to < force.from)
      in.values.fail(*child.find("to"),
                     fmt::format("the force ends at {} s, before it begins at {} s; swap them", force.to, force.from));
    in.scenario.forces.push_back(force);
  }
}

}  // namespace cb
