#include "scenario/reading.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "scenario/near_name.h"

namespace cb {

namespace {

/// Does `name` match a pattern, in which one * stands for any characters?
bool matches(std::string_view pattern, std::string_view name) {
  const std::size_t star = pattern.find('*');
  if (star == std::string_view::npos) return pattern == name;
  const std::string_view head = pattern.substr(0, star), tail = pattern.substr(star + 1);
  return name.size() >= head.size() + tail.size() && name.substr(0, head.size()) == head &&
         name.substr(name.size() - tail.size()) == tail;
}

}  // namespace

Vec3 Reading::vector(const XmlAttribute& attribute, std::string_view meaning) {
  const std::vector<double> x = values.numbers(attribute, 3, meaning);
  return {x[0], x[1], x[2]};
}

Vec3 Reading::direction(const XmlAttribute& attribute) {
  const Vec3 x = vector(attribute, "x y z, of any length but 0");
  const double largest = x.cwiseAbs().maxCoeff();
  if (largest == 0) values.fail(attribute, fmt::format("{} is 0 0 0; it has to point somewhere", attribute.name));
  return (x / largest).normalized();
}

Quat Reading::orientation(const XmlElement& element) {
  const XmlAttribute *axis = element.find("axis"), *angle = element.find("angle");
  const XmlAttribute* quaternion = element.find("quaternion");
  if (quaternion != nullptr) {
    if (axis != nullptr || angle != nullptr)
      source.fail(quaternion->name_at, "a quaternion beside axis and angle; keep one of the two");
    const std::vector<double> q = values.numbers(*quaternion, 4, "w x y z");
    const Eigen::Vector4d x(q[0], q[1], q[2], q[3]);
    const double largest = x.cwiseAbs().maxCoeff();
    if (largest == 0) values.fail(*quaternion, "quaternion is 0 0 0 0; no turn at all is 1 0 0 0");
    const Eigen::Vector4d unit = (x / largest).normalized();
    return {unit[0], unit[1], unit[2], unit[3]};
  }
  if (axis == nullptr && angle == nullptr) return Quat::Identity();
  if (axis == nullptr) source.fail(angle->name_at, "an angle without an axis; add axis=\"x y z\"");
  if (angle == nullptr) source.fail(axis->name_at, "an axis without an angle; add angle=\"...\" in rad");
  const Vec3 unit = direction(*axis);
  Quat q = Quat(Eigen::AngleAxisd(values.number(*angle, any_number), unit)).normalized();
  q.coeffs().array() += 0.0;  // -0 becomes 0
  return q;
}

std::string Reading::one_of(const XmlAttribute& attribute, const std::vector<std::string>& words) const {
  if (std::find(words.begin(), words.end(), attribute.value) == words.end())
    source.fail(attribute.value_at, fmt::format("{} is \"{}\"; {}", attribute.name, attribute.value,
                                                suggest(attribute.value, words, "it is one of:")));
  return attribute.value;
}

std::string Reading::name_of(const XmlElement& element, std::string_view what) const {
  const XmlAttribute& name = *element.find("name");
  if (!is_name(name.value))
    source.fail(name.value_at, fmt::format("\"{}\" is no name for {}; a name is a letter, then letters, digits and "
                                           "underscores",
                                           name.value, what));
  return name.value;
}

std::string Reading::beside_scene(const std::string& file) const {
  return (std::filesystem::path(source.file).parent_path() / file).string();
}

void Reading::note_file(const std::string& path) {
  if (std::find(scenario.files.begin(), scenario.files.end(), path) == scenario.files.end())
    scenario.files.push_back(path);
}

void Reading::declare_body(const XmlElement& element, const std::string& suffix, int array, Shape shape) {
  shape.name = name_of(element, "a body") + suffix;
  for (const Tree& tree : scenario.model.trees)
    for (const Joint& joint : tree.joints)
      if (scenario.model.bodies[joint.body].name == shape.name)
        source.fail(element.find("name")->value_at,
                    fmt::format("there is a link named {} already; rename one", shape.name));
  declare_shape(std::move(shape), element.find("name")->value_at, array);
}

void Reading::declare_shape(Shape shape, std::size_t at, int array) {
  const auto [first, is_new] = index.try_emplace(shape.name, static_cast<int>(declared.size()));
  if (!is_new)
    source.fail(at, fmt::format("a second body named {} (first at {}); rename one", shape.name,
                                source.where(declared[first->second].at)));
  const Vec3 where = shape.body < 0 ? shape.local.p : Vec3(scenario.initial.pose[shape.body].p + shape.local.p);
  if (!where.allFinite())
    source.fail(at, fmt::format("{} would be at a place that is not finite; move it, or its array or robot, closer",
                                shape.name));
  declared.push_back({shape.name, at, array});
  scenario.shapes.push_back(std::move(shape));
}

std::vector<int> Reading::find_bodies(const XmlAttribute& attribute) const {
  const auto found = index.find(attribute.value);
  if (found != index.end()) return {found->second};
  std::vector<int> bodies;
  if (std::count(attribute.value.begin(), attribute.value.end(), '*') > 1)
    source.fail(attribute.value_at, fmt::format("\"{}\" has more than one *; write one", attribute.value));
  if (attribute.value.find('*') != std::string::npos)
    for (std::size_t i = 0; i < declared.size(); ++i)
      if (matches(attribute.value, declared[i].name)) bodies.push_back(static_cast<int>(i));
  if (bodies.empty()) fail_no_body(attribute);
  return bodies;
}

void Reading::fail_no_body(const XmlAttribute& attribute) const {
  std::vector<std::string> names;
  for (const Declared& body : declared) {
    if (body.array >= 0 && body.name.compare(0, body.name.rfind('_'), attribute.value) == 0)
      source.fail(attribute.value_at, fmt::format("there is no body \"{0}\" but an array of them; write {0}_1 for "
                                                  "the first, {0}_* for all",
                                                  attribute.value));
    names.push_back(body.name);
  }
  source.fail(attribute.value_at, fmt::format("there is no body \"{}\"; {}", attribute.value,
                                              suggest(attribute.value, names, "the bodies are:")));
}

void Reading::fail_child(const XmlElement& child, std::string_view where, const std::vector<std::string>& known,
                         std::string_view intro) const {
  source.fail(child.at, fmt::format("<{}> in {}; {}", child.name, where, suggest(child.name, known, intro)));
}

}  // namespace cb
