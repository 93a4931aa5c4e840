// Reads <robot>, written out or from a URDF file, into descriptions, which robot.cpp checks and adds to the model.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <string>

#include "dynamics/kinematics.h"
#include "scenario/near_name.h"
#include "scenario/robot.h"
#include "scenario/solid.h"
#include "scenario/urdf.h"

namespace cb {

namespace {

RobotDescription::Link read_link(Reading& in, const XmlElement& element) {
  check_attributes(in.source, element, {"name", "mass", "position", "inertia"},
                   {"products", "axis", "angle", "quaternion"});
  RobotDescription::Link link;
  link.name = in.name_of(element, "a link");
  link.at = element.find("name")->value_at;
  link.mass = in.values.number(*element.find("mass"), positive);
  link.pose.p = in.vector(*element.find("position"), "x y z in m");
  link.pose.q = in.orientation(element);
  link.inertia = in.vector(*element.find("inertia"), "xx yy zz in kg m^2").asDiagonal();
  if (const XmlAttribute* products = element.find("products")) {
    const Vec3 p = in.vector(*products, "xy xz yz in kg m^2");
    link.inertia(0, 1) = link.inertia(1, 0) = p[0];
    link.inertia(0, 2) = link.inertia(2, 0) = p[1];
    link.inertia(1, 2) = link.inertia(2, 1) = p[2];
  }
  for (const XmlElement& child : element.children) {
    if (!is_solid(child)) in.fail_child(child, "<link>", solids(), "its shapes are:");
    check_empty(in.source, child);
    std::vector<std::string> optional{"axis", "angle", "quaternion"};
    for (const std::string& name : takes(child)) optional.push_back(name);
    check_attributes(in.source, child, needs(child), optional);
    const Solid solid = read_solid(in, child);
    Shape shape = solid.shape;
    shape.name = in.name_of(child, "a shape");
    shape.local.p = in.vector(*child.find("position"), "x y z in m");
    shape.local.q = in.orientation(child);
    shape.local = placed(shape.local, solid);
    link.shapes.push_back(std::move(shape));
    link.shape_at.push_back(child.find("name")->value_at);
  }
  return link;
}

RobotDescription::Joint read_joint(Reading& in, const XmlElement& element) {
  check_empty(in.source, element);
  static const std::vector<std::string> kinds{"fixed", "revolute", "prismatic", "free"};
  const XmlAttribute* kind = element.find("kind");
  if (kind == nullptr) in.source.fail(element.at, fmt::format("<joint> needs a kind; it is one of: {}", join(kinds)));
  const std::string word = in.one_of(*kind, kinds);
  std::vector<std::string> required{"name", "kind", "parent", "child"}, optional;
  RobotDescription::Joint joint;
  if (word == "revolute" || word == "prismatic") {
    joint.kind = word == "revolute" ? JointKind::revolute : JointKind::prismatic;
    required.push_back("axis");
    if (word == "revolute") required.push_back("anchor");
    optional = {"lower", "upper", "limit_rate", "damping", "stiffness", "rest", "torque_limit", "position", "velocity"};
  } else if (word == "free") {
    joint.kind = JointKind::free;
    optional = {"velocity", "angular_velocity"};
  }
  check_attributes(in.source, element, required, optional);
  joint.name = in.name_of(element, "a joint");
  joint.at = element.find("name")->value_at;
  joint.parent = element.find("parent")->value;
  joint.parent_at = element.find("parent")->value_at;
  joint.child = element.find("child")->value;
  joint.child_at = element.find("child")->value_at;
  if (joint.kind == JointKind::free) {
    if (const XmlAttribute* v = element.find("velocity")) joint.linear_velocity = in.vector(*v, "x y z in m/s");
    if (const XmlAttribute* w = element.find("angular_velocity"))
      joint.angular_velocity = in.vector(*w, "x y z in rad/s");
    return joint;
  }
  if (const XmlAttribute* axis = element.find("axis")) joint.axis = in.direction(*axis);
  if (const XmlAttribute* anchor = element.find("anchor")) joint.anchor = in.vector(*anchor, "x y z in m");
  const auto read = [&](const char* name, const Range& range, double& value) {
    if (const XmlAttribute* attribute = element.find(name)) value = in.values.number(*attribute, range);
  };
  read("lower", any_number, joint.lower);
  read("upper", any_number, joint.upper);
  read("limit_rate", any_number, joint.limit_rate);
  if (element.find("limit_rate") && !element.find("lower") && !element.find("upper"))
    in.source.fail(
        element.find("limit_rate")->value_at,
        fmt::format("limit_rate without a limit that it could move; give {} a lower or an upper one", joint.name));
  read("damping", not_negative, joint.damping);
  read("stiffness", not_negative, joint.stiffness);
  read("rest", any_number, joint.rest);
  read("torque_limit", not_negative, joint.torque_limit);
  read("position", any_number, joint.position);
  read("velocity", any_number, joint.velocity);
  return joint;
}

/// `source`: what the robot's places are in: the scene; or a URDF file, whose shapes are declared where the scene has
/// the robot's name.
void declare_robot(Reading& in, const RobotDescription& robot, const SourceText& source, const XmlAttribute& name) {
  const bool in_scene = &source == &in.source;
  for (const Tree& tree : in.scenario.model.trees)
    if (tree.name == robot.name) source.fail(robot.at, fmt::format("a second robot named {}; rename one", robot.name));
  for (auto& [shape, at] : add_robot(robot, source, in.scenario))
    in.declare_shape(std::move(shape), in_scene ? at : name.value_at, -1);

  // Where the links are while all joints are at 0.
  State zero = in.scenario.initial;
  std::fill(zero.q.begin(), zero.q.end(), 0.0);
  forward_kinematics(in.scenario.model, in.scenario.model.trees.back(), zero);
  in.zero_pose.resize(zero.pose.size());
  for (const Joint& joint : in.scenario.model.trees.back().joints) in.zero_pose[joint.body] = zero.pose[joint.body];
}

/// <start joint position velocity>: where a joint of a URDF file begins.
void read_start(Reading& in, const XmlElement& element, RobotDescription& robot, std::set<std::string>& started) {
  if (element.name != "start")
    in.source.fail(element.at, fmt::format("<{}> in a <robot urdf>; {}", element.name,
                                           suggest(element.name, {"start"}, "it holds:")));
  check_attributes(in.source, element, {"joint"}, {"position", "velocity"});
  check_empty(in.source, element);
  const XmlAttribute& name = *element.find("joint");
  if (!started.insert(name.value).second)
    in.source.fail(name.value_at, fmt::format("joint {} has a <start> already; keep one", name.value));
  std::vector<std::string> joints;
  for (RobotDescription::Joint& joint : robot.joints) {
    if (joint.kind != JointKind::revolute && joint.kind != JointKind::prismatic) continue;
    joints.push_back(joint.name);
    if (joint.name != name.value) continue;
    const auto read = [&](const char* key, double& value) {
      if (const XmlAttribute* attribute = element.find(key)) value = in.values.number(*attribute, any_number);
    };
    read("position", joint.position);
    read("velocity", joint.velocity);
    if (joint.position < joint.lower || joint.position > joint.upper)
      in.source.fail(name.value_at, fmt::format("joint {} starts at {}, outside its limits from {} to {}", joint.name,
                                                joint.position, joint.lower, joint.upper));
    return;
  }
  in.source.fail(name.value_at, fmt::format("the robot has no joint \"{}\" that moves; {}", name.value,
                                            suggest(name.value, joints, "these it has:")));
}

void read_urdf_robot(Reading& in, const XmlElement& element) {
  check_attributes(in.source, element, {"name", "urdf"}, {"base", "prefix", "position", "axis", "angle", "quaternion"});
  const XmlAttribute &file = *element.find("urdf"), &name = *element.find("name");
  const XmlAttribute* base = element.find("base");
  const XmlAttribute* prefix = element.find("prefix");
  if (prefix != nullptr && !is_name(prefix->value))
    in.source.fail(prefix->value_at, "a prefix is a letter, then letters, digits and underscores");
  const std::filesystem::path beside = std::filesystem::path(in.source.file).parent_path() / file.value;
  std::error_code unreadable;
  if (file.value.empty() || !std::filesystem::is_regular_file(beside, unreadable))
    in.source.fail(file.value_at,
                   fmt::format("there is no file {}; urdf names one, from the scene's folder on", beside.string()));
  const SourceText source = read_text(beside.string());
  in.note_file(source.file);
  UrdfRobot urdf = read_urdf(source, base != nullptr && in.one_of(*base, {"fixed", "free"}) == "free",
                             prefix != nullptr ? prefix->value : std::string());
  for (const std::string& mesh : urdf.files) in.note_file(mesh);
  RobotDescription& robot = urdf.robot;
  robot.name = in.name_of(element, "a robot");
  for (const Tree& tree : in.scenario.model.trees)
    if (tree.name == robot.name)
      in.source.fail(name.value_at, fmt::format("a second robot named {}; rename one", robot.name));
  if (const XmlAttribute* position = element.find("position")) robot.pose.p = in.vector(*position, "x y z in m");
  robot.pose.q = in.orientation(element);
  std::set<std::string> started;  // joints
  for (const XmlElement& child : element.children) read_start(in, child, robot, started);
  declare_robot(in, robot, source, name);
  for (auto& [shape, at] : urdf.fixed) {
    shape.local = {robot.pose * shape.local.p, (robot.pose.q * shape.local.q).normalized()};
    in.declare_shape(std::move(shape), name.value_at, -1);
  }
  for (std::string& line : urdf.left_out) in.scenario.left_out.push_back(std::move(line));
}

}  // namespace

void read_robot(Reading& in, const XmlElement& element) {
  if (element.find("urdf") != nullptr) return read_urdf_robot(in, element);
  check_attributes(in.source, element, {"name"}, {"position", "axis", "angle", "quaternion"});
  RobotDescription robot;
  robot.name = in.name_of(element, "a robot");
  robot.at = element.find("name")->value_at;
  if (const XmlAttribute* position = element.find("position")) robot.pose.p = in.vector(*position, "x y z in m");
  robot.pose.q = in.orientation(element);
  for (const XmlElement& child : element.children) {
    if (child.name == "link")
      robot.links.push_back(read_link(in, child));
    else if (child.name == "joint")
      robot.joints.push_back(read_joint(in, child));
    else
      in.fail_child(child, "<robot>", {"link", "joint"});
  }
  declare_robot(in, robot, in.source, *element.find("name"));
}

}  // namespace cb
