// Reads <controllers>, against the table of controllers and the robots that there are.
#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>

#include "scenario/near_name.h"
#include "scenario/reading.h"

namespace cb {

namespace {

std::vector<double> read_gains(Reading& in, const XmlElement& element, const std::vector<GainRow>& rows) {
  std::vector<double> gains;
  for (const GainRow& row : rows) {
    const XmlAttribute* attribute = element.find(std::string(row.name));
    gains.push_back(attribute != nullptr
                        ? in.values.number(*attribute, {row.least, std::numeric_limits<double>::infinity(), false})
                        : *row.default_value);
  }
  return gains;
}

ControllerSpec::ControlledJoint read_controlled(Reading& in, const XmlElement& element, const JointRoleRow& role,
                                                int index, int tree_index, std::map<int, std::size_t>& named) {
  std::vector<std::string> required{"joint"}, optional;
  for (const GainRow& gain : role.gains) (gain.default_value ? optional : required).emplace_back(gain.name);
  check_attributes(in.source, element, required, optional);
  const XmlAttribute& attribute = *element.find("joint");
  const Tree& tree = in.scenario.model.trees[tree_index];
  std::vector<std::string> joints;  // that a motor can drive
  ControllerSpec::ControlledJoint part;
  part.role = index;
  part.joint = -1;
  for (std::size_t j = 0; j < tree.joints.size(); ++j) {
    if (tree.joints[j].nv() != 1) continue;
    joints.push_back(tree.joints[j].name);
    if (joints.back() == attribute.value) part.joint = static_cast<int>(j);
  }
  if (part.joint < 0)
    in.source.fail(attribute.value_at, fmt::format("{} has no joint \"{}\" that a motor can drive; {}", tree.name,
                                                   attribute.value, suggest(attribute.value, joints, "these it has:")));
  const auto [first, is_new] = named.try_emplace(part.joint, attribute.value_at);
  if (!is_new)
    in.source.fail(attribute.value_at, fmt::format("{} is controlled already (at {}); keep one", attribute.value,
                                                   in.source.where(first->second)));
  part.gains = read_gains(in, element, role.gains);
  return part;
}

/// The tree that a controller drives.
int find_robot(const Reading& in, const XmlAttribute& name) {
  std::vector<std::string> robots;
  for (std::size_t i = 0; i < in.scenario.model.trees.size(); ++i) {
    robots.push_back(in.scenario.model.trees[i].name);
    if (robots.back() == name.value) return static_cast<int>(i);
  }
  in.source.fail(name.value_at, robots.empty() ? "there is no robot in <bodies> to control"
                                               : fmt::format("there is no robot \"{}\"; {}", name.value,
                                                             suggest(name.value, robots, "the robots are:")));
}

const ControllerRow& find_row(const Reading& in, const XmlElement& element) {
  const XmlAttribute* kind = element.find("kind");
  std::vector<std::string> kinds;
  for (const ControllerRow& row : controllers()) kinds.emplace_back(row.name);
  if (kind == nullptr)
    in.source.fail(element.at, fmt::format("<controller> needs a kind; it is one of: {}", join(kinds)));
  const ControllerRow* row = find_controller(kind->value);
  if (row == nullptr)
    in.source.fail(kind->value_at, fmt::format("there is no controller \"{}\"; {}", kind->value,
                                               suggest(kind->value, kinds, "it is one of:")));
  return *row;
}

/// Which of its choices each word has.
std::vector<int> read_words(Reading& in, const XmlElement& element, const std::vector<GainWordRow>& rows) {
  std::vector<int> words;
  for (const GainWordRow& row : rows) {
    const XmlAttribute* attribute = element.find(std::string(row.name));
    int choice = 0;
    if (attribute != nullptr) {
      const std::vector<std::string> choices(row.choices.begin(), row.choices.end());
      const std::string value = in.values.word(*attribute, choices);
      choice = static_cast<int>(std::find(choices.begin(), choices.end(), value) - choices.begin());
    }
    words.push_back(choice);
  }
  return words;
}

/// The joints by their roles, of which a controller takes as many as its row says.
void read_joints(Reading& in, const XmlElement& element, ControllerSpec& spec) {
  const ControllerRow& row = *spec.row;
  std::vector<std::string> roles;
  for (const JointRoleRow& role : row.roles) roles.emplace_back(role.name);
  std::map<int, std::size_t> named;  // joints, and where
  std::vector<int> count(roles.size(), 0);
  for (const XmlElement& child : element.children) {
    const auto role = static_cast<std::size_t>(std::find(roles.begin(), roles.end(), child.name) - roles.begin());
    if (role == roles.size()) in.fail_child(child, fmt::format("a {} controller", row.name), roles);
    check_empty(in.source, child);
    ++count[role];
    spec.joints.push_back(read_controlled(in, child, row.roles[role], static_cast<int>(role), spec.tree, named));
  }
  for (std::size_t role = 0; role < roles.size(); ++role)
    if (count[role] < row.roles[role].least || count[role] > row.roles[role].most)
      in.source.fail(element.at,
                     fmt::format("{} <{}> in a {} controller; it takes {}", count[role], roles[role], row.name,
                                 row.roles[role].least == row.roles[role].most
                                     ? fmt::format("{}", row.roles[role].least)
                                     : fmt::format("at least {}", row.roles[role].least)));
}

void read_controller(Reading& in, const XmlElement& element) {
  ControllerSpec spec;
  spec.row = &find_row(in, element);
  std::vector<std::string> required{"kind", "robot"}, optional;
  for (const GainRow& gain : spec.row->gains) (gain.default_value ? optional : required).emplace_back(gain.name);
  for (const GainWordRow& word : spec.row->words) optional.emplace_back(word.name);
  check_attributes(in.source, element, required, optional);
  spec.tree = find_robot(in, *element.find("robot"));
  spec.gains = read_gains(in, element, spec.row->gains);
  spec.words = read_words(in, element, spec.row->words);
  read_joints(in, element, spec);
  in.scenario.controllers.push_back(std::move(spec));
}

}  // namespace

void read_controllers(Reading& in, const XmlElement& element) {
  check_attributes(in.source, element, {}, {});
  for (const XmlElement& child : element.children) {
    if (child.name != "controller") in.fail_child(child, "<controllers>", {"controller"});
    read_controller(in, child);
  }
}

}  // namespace cb
