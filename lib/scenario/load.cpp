// Reads a scenario file into a Scenario: docs/scenarios.md is the reference of the format.
// What is not written down there is refused: one message with file, line, column and what would be right.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <string_view>
#include <tuple>

#include "dynamics/kinematics.h"
#include "scenario/near_name.h"
#include "scenario/robot.h"
#include "scenario/scenario.h"
#include "scenario/urdf.h"
#include "scenario/values.h"
#include "scenario/xml_tree.h"

namespace cb {

namespace {

constexpr long array_limit = 100000;       // bodies of one array
constexpr std::size_t group_limit = 2000;  // groups of bodies that pairs treat alike; the table has its square
constexpr int edge_limit = 4096;           // edges of a friction polygon
constexpr int grid_limit = 256;            // contact points along an edge of a box

/// Does `name` match a pattern, in which one * stands for any characters?
bool matches(std::string_view pattern, std::string_view name) {
  const std::size_t star = pattern.find('*');
  if (star == std::string_view::npos) return pattern == name;
  const std::string_view head = pattern.substr(0, star), tail = pattern.substr(star + 1);
  return name.size() >= head.size() + tail.size() && name.substr(0, head.size()) == head &&
         name.substr(name.size() - tail.size()) == tail;
}

class Loader {
 public:
  Loader(const SourceText& source, const Overrides& overrides) : source_(source), values_(source, overrides) {}

  Scenario load(const XmlElement& root) {
    if (root.name != "scenario")
      source_.fail(root.at,
                   fmt::format("the root element is <{}>; a scenario starts with <scenario title=\"...\">", root.name));
    check_attributes(source_, root, {"title"}, {});
    scenario_.file = source_.file;
    scenario_.files.push_back(source_.file);
    scenario_.name = std::filesystem::path(source_.file).stem().string();
    scenario_.title = root.find("title")->value;

    find_sections(root);
    values_.declare(section("parameters"));
    read_simulation(*section("simulation"));
    read_reference(*section("reference"));
    read_gravity(*section("gravity"));
    read_bodies(*section("bodies"));
    read_contacts(section("contacts"));
    if (const XmlElement* forces = section("forces")) read_forces(*forces);
    if (const XmlElement* control = section("controllers")) read_controllers(*control);
    values_.check_all_used();
    values_.report(scenario_);
    return std::move(scenario_);
  }

 private:
  /// A body as it was declared; its index is that of its shape.
  struct Declared {
    std::string name;
    std::size_t at = 0;  ///< offset of the name
    int array = -1;      ///< which array it belongs to, -1: none
  };

  // Sections --------------------------------------------------------------------------------------------------------

  void find_sections(const XmlElement& root) {
    static const std::vector<std::string> known{"parameters", "simulation", "reference", "gravity",
                                                "bodies",     "contacts",   "forces",    "controllers"};
    for (const XmlElement& child : root.children) {
      if (std::find(known.begin(), known.end(), child.name) == known.end())
        source_.fail(child.at,
                     fmt::format("<{}> in <scenario>; {}", child.name, suggest(child.name, known, "it holds:")));
      if (const XmlElement* first = section(child.name))
        source_.fail(child.at, fmt::format("a second <{}> (first at {}); put both into one", child.name,
                                           source_.where(first->at)));
      sections_.push_back(&child);
    }
    for (const char* needed : {"simulation", "reference", "gravity", "bodies"})
      if (section(needed) == nullptr)
        source_.fail(root.at, fmt::format("<scenario> needs the element <{}>; it holds: {}", needed, join(known)));
  }

  const XmlElement* section(std::string_view name) const {
    for (const XmlElement* candidate : sections_)
      if (candidate->name == name) return candidate;
    return nullptr;
  }

  void read_simulation(const XmlElement& element) {
    check_attributes(source_, element, {"step", "duration"}, {"k", "compression_bound", "rotate_cone"});
    check_empty(source_, element);
    scenario_.step = values_.number(*element.find("step"), positive);
    scenario_.duration = values_.number(*element.find("duration"), not_negative);
    if (const XmlAttribute* k = element.find("k")) {
      scenario_.k = static_cast<int>(values_.integer(*k, 4, edge_limit));
      if (*scenario_.k % 2 != 0)
        values_.fail(
            *k, fmt::format("k is {}; the friction polygon has an even number of edges, at least 4", *scenario_.k));
    }
    if (const XmlAttribute* bound = element.find("compression_bound"))
      scenario_.compression_bound = one_of(*bound, {"on", "off"}) == "on";
    if (const XmlAttribute* turn = element.find("rotate_cone"))
      scenario_.rotate_cone = values_.number(*turn, any_number);
  }

  void read_reference(const XmlElement& element) {
    check_empty(source_, element);
    check_attributes(source_, element, {"kind"}, {"name"});
    const std::string kind = one_of(*element.find("kind"), {"analytic", "certified", "missing"});
    const XmlAttribute* name = element.find("name");
    if (kind == "analytic") {
      scenario_.reference.kind = ReferenceKind::analytic;
      check_attributes(source_, element, {"kind", "name"}, {});
      scenario_.reference.name = name->value;
      if (!is_name(name->value))
        source_.fail(name->value_at,
                     fmt::format("\"{}\" is no name of a reference; see `contactbench list references`", name->value));
    } else {
      scenario_.reference.kind = kind == "certified" ? ReferenceKind::certified : ReferenceKind::missing;
      if (name != nullptr)
        source_.fail(name->name_at,
                     fmt::format("a {} reference has no name; remove it, or set kind=\"analytic\"", kind));
    }
  }

  void read_gravity(const XmlElement& element) {
    check_attributes(source_, element, {"constant"}, {});
    scenario_.gravity.constant = vector(*element.find("constant"), "x y z in m/s^2");
    std::size_t seen[3] = {0, 0, 0};
    for (const XmlElement& child : element.children) {
      if (child.name != "harmonic")
        source_.fail(child.at,
                     fmt::format("<{}> in <gravity>; {}", child.name, suggest(child.name, {"harmonic"}, "it holds:")));
      check_attributes(source_, child, {"axis", "amplitude", "frequency"}, {"phase"});
      check_empty(source_, child);
      const int axis = one_of(*child.find("axis"), {"x", "y", "z"})[0] - 'x';
      if (seen[axis] != 0)
        source_.fail(child.at, fmt::format("a second <harmonic> for this axis (first at {}); keep one",
                                           source_.where(seen[axis])));
      seen[axis] = child.at;
      Harmonic& harmonic = scenario_.gravity.harmonic[axis];
      harmonic.amplitude = values_.number(*child.find("amplitude"), any_number);
      harmonic.frequency = values_.number(*child.find("frequency"), not_negative);
      if (const XmlAttribute* phase = child.find("phase")) harmonic.phase = values_.number(*phase, any_number);
    }
  }

  // Bodies ----------------------------------------------------------------------------------------------------------

  void read_bodies(const XmlElement& element) {
    check_attributes(source_, element, {}, {});
    for (const XmlElement& child : element.children) {
      if (child.name == "half_space")
        read_half_space(child);
      else if (is_solid(child))
        read_body(child, Vec3::Zero(), {}, -1);
      else if (child.name == "array")
        read_array(child);
      else if (child.name == "robot")
        read_robot(child);
      else
        source_.fail(child.at,
                     fmt::format("<{}> in <bodies>; {}", child.name,
                                 suggest(child.name, {"half_space", "box", "sphere", "cylinder", "array", "robot"},
                                         "it holds:")));
    }
    if (scenario_.model.bodies.empty())
      source_.fail(element.at, "no body that can move; add a <box> or a <sphere> with a mass");
  }

  void read_array(const XmlElement& element) {
    check_attributes(source_, element, {"count", "offset"}, {});
    const XmlAttribute& count_attribute = *element.find("count");
    const long count = values_.integer(count_attribute, 1, array_limit);
    const Vec3 offset = vector(*element.find("offset"), "x y z in m");
    if (offset.isZero(0) && count > 1)
      values_.fail(*element.find("offset"),
                   "offset is 0 0 0: all bodies would be in one place; write the step from one to the next");
    if (element.children.empty()) source_.fail(element.at, "an empty <array>; put one <box> or <sphere> into it");
    const XmlElement& child = element.children.front();
    if (!is_solid(child))
      source_.fail(child.at,
                   fmt::format("<{}> in <array>; {}", child.name, suggest(child.name, solids(), "it repeats:")));
    if (element.children.size() > 1)
      source_.fail(element.children[1].at, "a second element in <array>; write one <array> for each");
    const int array = arrays_++;
    for (long i = 0; i < count; ++i)
      read_body(child, static_cast<double>(i) * offset, fmt::format("_{}", i + 1), array);
  }

  void read_half_space(const XmlElement& element) {
    check_attributes(source_, element, {"name", "point"}, {"normal", "axis", "angle", "quaternion"});
    check_empty(source_, element);
    Shape shape;
    shape.kind = ShapeKind::half_space;
    shape.local.p = vector(*element.find("point"), "x y z in m");
    const XmlAttribute* normal = element.find("normal");
    const bool turned =
        element.find("axis") != nullptr || element.find("angle") != nullptr || element.find("quaternion") != nullptr;
    if (normal == nullptr && !turned)
      source_.fail(element.at,
                   "<half_space> needs a normal, or axis and angle (or a quaternion) that turn the y axis into it");
    if (normal != nullptr && turned)
      source_.fail(normal->name_at,
                   "normal beside an orientation; the orientation turns the y axis into the normal: keep one");
    if (normal != nullptr)
      shape.local.q = Quat::FromTwoVectors(Vec3::UnitY(), direction(*normal)).normalized();
    else
      shape.local.q = orientation(element);
    declare_body(element, {}, -1, std::move(shape));
  }

  /// A solid shape as its element gives it: kind and extents, without a place.
  struct Solid {
    Shape shape;
    double volume = 0;                     ///< m^3
    Vec3 inertia_per_mass = Vec3::Zero();  ///< of the solid, about its centre, m^2
  };

  static const std::vector<std::string>& solids() {
    static const std::vector<std::string> names{"box", "sphere", "cylinder"};
    return names;
  }
  static bool is_solid(const XmlElement& element) {
    return std::find(solids().begin(), solids().end(), element.name) != solids().end();
  }
  /// The attributes that give a solid's extents.
  static std::vector<std::string> extents(const XmlElement& element) {
    if (element.name == "cylinder") return {"radius", "length"};
    return {element.name == "box" ? "size" : "radius"};
  }

  Solid read_solid(const XmlElement& element) {
    Solid solid;
    Shape& shape = solid.shape;
    if (element.name == "box") {
      const XmlAttribute& attribute = *element.find("size");
      const Vec3 size = vector(attribute, "x y z in m");
      if (size.minCoeff() <= 0)
        values_.fail(attribute,
                     fmt::format("size has the edge {}; all three edges have to be more than 0", size.minCoeff()));
      shape.kind = ShapeKind::box;
      shape.half_extents = size / 2;
      solid.volume = size.prod();
      const Vec3 square = size.cwiseAbs2();
      solid.inertia_per_mass = Vec3(square[1] + square[2], square[2] + square[0], square[0] + square[1]) / 12;
    } else if (element.name == "cylinder") {
      shape.kind = ShapeKind::cylinder;
      const double r = shape.radius = values_.number(*element.find("radius"), positive);
      const double length = values_.number(*element.find("length"), not_negative);
      shape.half_extents = Vec3(r, length / 2, r);
      solid.volume = std::numbers::pi * r * r * length;
      solid.inertia_per_mass = Vec3(3 * r * r + length * length, 6 * r * r, 3 * r * r + length * length) / 12;
    } else {
      shape.kind = ShapeKind::sphere;
      shape.radius = values_.number(*element.find("radius"), positive);
      solid.volume = 4 * std::numbers::pi / 3 * shape.radius * shape.radius * shape.radius;
      solid.inertia_per_mass.setConstant(0.4 * shape.radius * shape.radius);
    }
    return solid;
  }

  void read_body(const XmlElement& element, const Vec3& offset, const std::string& suffix, int array) {
    check_empty(source_, element);
    std::vector<std::string> required = extents(element);
    required.insert(required.begin(), "name");
    required.push_back("position");
    std::vector<std::string> optional{"mass",     "density",          "fixed",     "axis", "angle", "quaternion",
                                      "velocity", "angular_velocity", "moves_with"};
    if (element.name == "box") optional.push_back("contact_grid");
    check_attributes(source_, element, required, optional);
    const Solid solid = read_solid(element);
    Shape shape = solid.shape;
    if (const XmlAttribute* grid = element.find("contact_grid"))
      shape.contact_grid = static_cast<int>(values_.integer(*grid, 2, grid_limit));
    Body body;
    Pose pose;
    pose.p = vector(*element.find("position"), "x y z in m") + offset;
    pose.q = orientation(element);

    if (is_fixed(element)) {
      shape.local = pose;
      declare_body(element, suffix, array, std::move(shape));
      return;
    }

    const XmlAttribute& weight = mass_or_density(element);
    body.mass = values_.number(weight, positive) * (weight.name == "density" ? solid.volume : 1);
    body.inertia = body.mass * solid.inertia_per_mass;
    if (!std::isnormal(body.mass) || !body.inertia.allFinite() || !(body.inertia.minCoeff() > 0))
      values_.fail(weight,
                   fmt::format("the mass comes to {} kg and the least moment of inertia to {} kg m^2; both have "
                               "to be more than 0 and finite",
                               body.mass, body.inertia.minCoeff()));
    shape.body = static_cast<int>(scenario_.model.bodies.size());
    body.name = element.find("name")->value + suffix;
    Vec3 v = Vec3::Zero(), w = Vec3::Zero();
    if (const XmlAttribute* velocity = element.find("velocity")) v = vector(*velocity, "x y z in m/s");
    if (const XmlAttribute* spin = element.find("angular_velocity")) w = vector(*spin, "x y z in rad/s");
    if (const XmlAttribute* link = element.find("moves_with")) carry(element, *link, pose, v, w);
    scenario_.model.bodies.push_back(std::move(body));
    scenario_.initial.pose.push_back(pose);
    for (const Vec3& part : {v, w}) scenario_.initial.v.insert(scenario_.initial.v.end(), part.data(), part.data() + 3);
    declare_body(element, suffix, array, std::move(shape));
  }

  /// Takes a body from where it would be in the robot's zero pose to where the link is now, and gives it the velocity
  /// that it has there as a part of the link.
  void carry(const XmlElement& element, const XmlAttribute& link, Pose& pose, Vec3& v, Vec3& w) const {
    for (const char* name : {"velocity", "angular_velocity"})
      if (const XmlAttribute* attribute = element.find(name))
        source_.fail(attribute->name_at, fmt::format("{} beside moves_with, which gives it; keep one", name));
    std::vector<std::string> links;
    for (const Tree& tree : scenario_.model.trees) {
      for (const Joint& joint : tree.joints) {
        links.push_back(scenario_.model.bodies[joint.body].name);
        if (links.back() != link.value) continue;
        const Pose& zero = zero_pose_[joint.body];
        const Pose& now = scenario_.initial.pose[joint.body];
        const Quat turn = now.q * zero.q.conjugate();
        pose.p = now.p + turn * (pose.p - zero.p);
        pose.q = (turn * pose.q).normalized();
        const double* twist = &scenario_.initial.v[6 * static_cast<std::size_t>(joint.body)];
        w = Vec3(twist + 3);
        v = Vec3(twist) + w.cross(pose.p - now.p);
        return;
      }
    }
    source_.fail(link.value_at, links.empty()
                                    ? "there is no robot before this body; moves_with names a link of one"
                                    : fmt::format("there is no link \"{}\"; {}", link.value,
                                                  suggest(link.value, links, "the links before this body are:")));
  }

  // Robots ------------------------------------------------------------------------------------------------------------

  void read_robot(const XmlElement& element) {
    if (element.find("urdf") != nullptr) return read_urdf_robot(element);
    check_attributes(source_, element, {"name"}, {"position", "axis", "angle", "quaternion"});
    RobotDescription robot;
    robot.name = name_of(element, "a robot");
    robot.at = element.find("name")->value_at;
    if (const XmlAttribute* position = element.find("position")) robot.pose.p = vector(*position, "x y z in m");
    robot.pose.q = orientation(element);
    for (const XmlElement& child : element.children) {
      if (child.name == "link")
        robot.links.push_back(read_link(child));
      else if (child.name == "joint")
        robot.joints.push_back(read_joint(child));
      else
        source_.fail(child.at, fmt::format("<{}> in <robot>; {}", child.name,
                                           suggest(child.name, {"link", "joint"}, "it holds:")));
    }
    declare_robot(robot, source_);
  }

  void read_urdf_robot(const XmlElement& element) {
    check_attributes(source_, element, {"name", "urdf"}, {"base", "prefix", "position", "axis", "angle", "quaternion"});
    const XmlAttribute &file = *element.find("urdf"), &name = *element.find("name");
    const XmlAttribute* base = element.find("base");
    const XmlAttribute* prefix = element.find("prefix");
    if (prefix != nullptr && !is_name(prefix->value))
      source_.fail(prefix->value_at, "a prefix is a letter, then letters, digits and underscores");
    const std::filesystem::path beside = std::filesystem::path(source_.file).parent_path() / file.value;
    if (file.value.empty() || !std::filesystem::is_regular_file(beside))
      source_.fail(file.value_at,
                   fmt::format("there is no file {}; urdf names one, from the scene's folder on", beside.string()));
    const SourceText source = read_text(beside.string());
    scenario_.files.push_back(source.file);
    UrdfRobot urdf = read_urdf(source, base != nullptr && one_of(*base, {"fixed", "free"}) == "free",
                               prefix != nullptr ? prefix->value : std::string());
    RobotDescription& robot = urdf.robot;
    robot.name = name_of(element, "a robot");
    for (const Tree& tree : scenario_.model.trees)
      if (tree.name == robot.name)
        source_.fail(name.value_at, fmt::format("a second robot named {}; rename one", robot.name));
    if (const XmlAttribute* position = element.find("position")) robot.pose.p = vector(*position, "x y z in m");
    robot.pose.q = orientation(element);
    for (const XmlElement& child : element.children) read_start(child, robot);
    declare_robot(robot, source);
    for (auto& [shape, at] : urdf.fixed) {
      shape.local = {robot.pose * shape.local.p, (robot.pose.q * shape.local.q).normalized()};
      declare_shape(std::move(shape), name.value_at, -1);
    }
    for (std::string& line : urdf.left_out) scenario_.left_out.push_back(std::move(line));
  }

  /// <start joint position velocity>: where a joint of a URDF file begins.
  void read_start(const XmlElement& element, RobotDescription& robot) {
    if (element.name != "start")
      source_.fail(element.at, fmt::format("<{}> in a <robot urdf>; {}", element.name,
                                           suggest(element.name, {"start"}, "it holds:")));
    check_attributes(source_, element, {"joint"}, {"position", "velocity"});
    check_empty(source_, element);
    const XmlAttribute& name = *element.find("joint");
    std::vector<std::string> joints;
    for (RobotDescription::Joint& joint : robot.joints) {
      if (joint.kind != JointKind::revolute && joint.kind != JointKind::prismatic) continue;
      joints.push_back(joint.name);
      if (joint.name != name.value) continue;
      const auto read = [&](const char* key, double& value) {
        if (const XmlAttribute* attribute = element.find(key)) value = values_.number(*attribute, any_number);
      };
      read("position", joint.position);
      read("velocity", joint.velocity);
      if (joint.position < joint.lower || joint.position > joint.upper)
        source_.fail(name.value_at, fmt::format("joint {} starts at {}, outside its limits from {} to {}", joint.name,
                                                joint.position, joint.lower, joint.upper));
      return;
    }
    source_.fail(name.value_at, fmt::format("the robot has no joint \"{}\" that moves; {}", name.value,
                                            suggest(name.value, joints, "these it has:")));
  }

  void declare_robot(const RobotDescription& robot, const SourceText& source) {
    for (const Tree& tree : scenario_.model.trees)
      if (tree.name == robot.name)
        source.fail(robot.at, fmt::format("a second robot named {}; rename one", robot.name));
    for (auto& [shape, at] : add_robot(robot, source, scenario_)) declare_shape(std::move(shape), at, -1);

    // Where the links are while all joints are at 0.
    State zero = scenario_.initial;
    std::fill(zero.q.begin(), zero.q.end(), 0.0);
    forward_kinematics(scenario_.model, scenario_.model.trees.back(), zero);
    zero_pose_.resize(zero.pose.size());
    for (const Joint& joint : scenario_.model.trees.back().joints) zero_pose_[joint.body] = zero.pose[joint.body];
  }

  std::string name_of(const XmlElement& element, std::string_view what) const {
    const XmlAttribute& name = *element.find("name");
    if (!is_name(name.value))
      source_.fail(name.value_at, fmt::format("\"{}\" is no name for {}; a name is a letter, then letters, digits and "
                                              "underscores",
                                              name.value, what));
    return name.value;
  }

  RobotDescription::Link read_link(const XmlElement& element) {
    check_attributes(source_, element, {"name", "mass", "position", "inertia"},
                     {"products", "axis", "angle", "quaternion"});
    RobotDescription::Link link;
    link.name = name_of(element, "a link");
    link.at = element.find("name")->value_at;
    link.mass = values_.number(*element.find("mass"), positive);
    link.pose.p = vector(*element.find("position"), "x y z in m");
    link.pose.q = orientation(element);
    link.inertia = vector(*element.find("inertia"), "xx yy zz in kg m^2").asDiagonal();
    if (const XmlAttribute* products = element.find("products")) {
      const Vec3 p = vector(*products, "xy xz yz in kg m^2");
      link.inertia(0, 1) = link.inertia(1, 0) = p[0];
      link.inertia(0, 2) = link.inertia(2, 0) = p[1];
      link.inertia(1, 2) = link.inertia(2, 1) = p[2];
    }
    for (const XmlElement& child : element.children) {
      if (!is_solid(child))
        source_.fail(child.at,
                     fmt::format("<{}> in <link>; {}", child.name, suggest(child.name, solids(), "its shapes are:")));
      check_empty(source_, child);
      std::vector<std::string> required = extents(child);
      required.insert(required.begin(), "name");
      required.push_back("position");
      check_attributes(source_, child, required, {"axis", "angle", "quaternion"});
      Shape shape = read_solid(child).shape;
      shape.name = name_of(child, "a shape");
      shape.local.p = vector(*child.find("position"), "x y z in m");
      shape.local.q = orientation(child);
      link.shapes.push_back(std::move(shape));
      link.shape_at.push_back(child.find("name")->value_at);
    }
    return link;
  }

  RobotDescription::Joint read_joint(const XmlElement& element) {
    check_empty(source_, element);
    static const std::vector<std::string> kinds{"fixed", "revolute", "prismatic", "free"};
    const XmlAttribute* kind = element.find("kind");
    if (kind == nullptr) source_.fail(element.at, fmt::format("<joint> needs a kind; it is one of: {}", join(kinds)));
    const std::string word = one_of(*kind, kinds);
    std::vector<std::string> required{"name", "kind", "parent", "child"}, optional;
    RobotDescription::Joint joint;
    if (word == "revolute" || word == "prismatic") {
      joint.kind = word == "revolute" ? JointKind::revolute : JointKind::prismatic;
      required.push_back("axis");
      if (word == "revolute") required.push_back("anchor");
      optional = {"lower", "upper",        "limit_rate", "damping", "stiffness",
                  "rest",  "torque_limit", "position",   "velocity"};
    } else if (word == "free") {
      joint.kind = JointKind::free;
      optional = {"velocity", "angular_velocity"};
    }
    check_attributes(source_, element, required, optional);
    joint.name = name_of(element, "a joint");
    joint.at = element.find("name")->value_at;
    joint.parent = element.find("parent")->value;
    joint.parent_at = element.find("parent")->value_at;
    joint.child = element.find("child")->value;
    joint.child_at = element.find("child")->value_at;
    if (joint.kind == JointKind::free) {
      if (const XmlAttribute* v = element.find("velocity")) joint.linear_velocity = vector(*v, "x y z in m/s");
      if (const XmlAttribute* w = element.find("angular_velocity"))
        joint.angular_velocity = vector(*w, "x y z in rad/s");
      return joint;
    }
    if (const XmlAttribute* axis = element.find("axis")) joint.axis = direction(*axis);
    if (const XmlAttribute* anchor = element.find("anchor")) joint.anchor = vector(*anchor, "x y z in m");
    const auto read = [&](const char* name, const Range& range, double& value) {
      if (const XmlAttribute* attribute = element.find(name)) value = values_.number(*attribute, range);
    };
    read("lower", any_number, joint.lower);
    read("upper", any_number, joint.upper);
    read("limit_rate", any_number, joint.limit_rate);
    if (element.find("limit_rate") && !element.find("lower") && !element.find("upper"))
      source_.fail(
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

  // Controllers -------------------------------------------------------------------------------------------------------

  void read_controllers(const XmlElement& element) {
    check_attributes(source_, element, {}, {});
    for (const XmlElement& child : element.children) {
      if (child.name != "controller")
        source_.fail(child.at, fmt::format("<{}> in <controllers>; {}", child.name,
                                           suggest(child.name, {"controller"}, "it holds:")));
      read_controller(child);
    }
  }

  void read_controller(const XmlElement& element) {
    const XmlAttribute* kind = element.find("kind");
    std::vector<std::string> kinds;
    for (const ControllerRow& row : controllers()) kinds.emplace_back(row.name);
    if (kind == nullptr)
      source_.fail(element.at, fmt::format("<controller> needs a kind; it is one of: {}", join(kinds)));
    const ControllerRow* row = find_controller(kind->value);
    if (row == nullptr)
      source_.fail(kind->value_at, fmt::format("there is no controller \"{}\"; {}", kind->value,
                                               suggest(kind->value, kinds, "it is one of:")));
    ControllerSpec spec;
    spec.row = row;
    std::vector<std::string> required{"kind", "robot"}, optional;
    for (const GainRow& gain : row->gains) (gain.default_value ? optional : required).emplace_back(gain.name);
    for (const GainWordRow& word : row->words) optional.emplace_back(word.name);
    check_attributes(source_, element, required, optional);

    const XmlAttribute& robot = *element.find("robot");
    std::vector<std::string> robots;
    spec.tree = -1;
    for (std::size_t i = 0; i < scenario_.model.trees.size(); ++i) {
      robots.push_back(scenario_.model.trees[i].name);
      if (robots.back() == robot.value) spec.tree = static_cast<int>(i);
    }
    if (spec.tree < 0)
      source_.fail(robot.value_at, robots.empty() ? "there is no robot in <bodies> to control"
                                                  : fmt::format("there is no robot \"{}\"; {}", robot.value,
                                                                suggest(robot.value, robots, "the robots are:")));
    spec.gains = read_gains(element, row->gains);
    for (const GainWordRow& word : row->words) {
      const XmlAttribute* attribute = element.find(std::string(word.name));
      int choice = 0;
      if (attribute != nullptr) {
        const std::vector<std::string> choices(word.choices.begin(), word.choices.end());
        const std::string value = values_.word(*attribute, choices);
        choice = static_cast<int>(std::find(choices.begin(), choices.end(), value) - choices.begin());
      }
      spec.words.push_back(choice);
    }

    std::vector<std::string> roles;
    for (const JointRoleRow& role : row->roles) roles.emplace_back(role.name);
    std::map<int, std::size_t> named;  // joints, and where
    std::vector<int> count(roles.size(), 0);
    for (const XmlElement& child : element.children) {
      const auto role = static_cast<std::size_t>(std::find(roles.begin(), roles.end(), child.name) - roles.begin());
      if (role == roles.size())
        source_.fail(child.at, fmt::format("<{}> in a {} controller; {}", child.name, row->name,
                                           suggest(child.name, roles, "it holds:")));
      check_empty(source_, child);
      ++count[role];
      spec.joints.push_back(read_controlled(child, row->roles[role], static_cast<int>(role), spec.tree, named));
    }
    for (std::size_t role = 0; role < roles.size(); ++role)
      if (count[role] < row->roles[role].least || count[role] > row->roles[role].most)
        source_.fail(element.at,
                     fmt::format("{} <{}> in a {} controller; it takes {}", count[role], roles[role], row->name,
                                 row->roles[role].least == row->roles[role].most
                                     ? fmt::format("{}", row->roles[role].least)
                                     : fmt::format("at least {}", row->roles[role].least)));
    scenario_.controllers.push_back(std::move(spec));
  }

  ControllerSpec::ControlledJoint read_controlled(const XmlElement& element, const JointRoleRow& role, int index,
                                                  int tree_index, std::map<int, std::size_t>& named) {
    std::vector<std::string> required{"joint"}, optional;
    for (const GainRow& gain : role.gains) (gain.default_value ? optional : required).emplace_back(gain.name);
    check_attributes(source_, element, required, optional);
    const XmlAttribute& attribute = *element.find("joint");
    const Tree& tree = scenario_.model.trees[tree_index];
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
      source_.fail(attribute.value_at, fmt::format("{} has no joint \"{}\" that a motor can drive; {}", tree.name,
                                                   attribute.value, suggest(attribute.value, joints, "these it has:")));
    const auto [first, is_new] = named.try_emplace(part.joint, attribute.value_at);
    if (!is_new)
      source_.fail(attribute.value_at, fmt::format("{} is controlled already (at {}); keep one", attribute.value,
                                                   source_.where(first->second)));
    part.gains = read_gains(element, role.gains);
    return part;
  }

  std::vector<double> read_gains(const XmlElement& element, const std::vector<GainRow>& rows) {
    std::vector<double> gains;
    for (const GainRow& row : rows) {
      const XmlAttribute* attribute = element.find(std::string(row.name));
      gains.push_back(attribute != nullptr
                          ? values_.number(*attribute, {row.least, std::numeric_limits<double>::infinity(), false})
                          : *row.default_value);
    }
    return gains;
  }

  // Bodies, on
  // ----------------------------------------------------------------------------------------------------------

  bool is_fixed(const XmlElement& element) const {
    const XmlAttribute* fixed = element.find("fixed");
    if (fixed == nullptr || one_of(*fixed, {"yes", "no"}) == "no") return false;
    for (const char* name : {"mass", "density", "velocity", "angular_velocity", "moves_with"})
      if (const XmlAttribute* attribute = element.find(name))
        source_.fail(attribute->name_at, fmt::format("a fixed body has no {}; remove it, or fixed=\"yes\"", name));
    return true;
  }

  const XmlAttribute& mass_or_density(const XmlElement& element) const {
    const XmlAttribute *mass = element.find("mass"), *density = element.find("density");
    if (mass != nullptr && density != nullptr)
      source_.fail(density->name_at, "mass and density; one follows from the other: keep one");
    if (mass == nullptr && density == nullptr)
      source_.fail(element.at, fmt::format("<{}> needs a mass or a density (or fixed=\"yes\")", element.name));
    return mass != nullptr ? *mass : *density;
  }

  void declare_body(const XmlElement& element, const std::string& suffix, int array, Shape shape) {
    shape.name = name_of(element, "a body") + suffix;
    for (const Joint& joint : links())
      if (scenario_.model.bodies[joint.body].name == shape.name)
        source_.fail(element.find("name")->value_at,
                     fmt::format("there is a link named {} already; rename one", shape.name));
    declare_shape(std::move(shape), element.find("name")->value_at, array);
  }

  std::vector<Joint> links() const {
    std::vector<Joint> all;
    for (const Tree& tree : scenario_.model.trees) all.insert(all.end(), tree.joints.begin(), tree.joints.end());
    return all;
  }

  void declare_shape(Shape shape, std::size_t at, int array) {
    const int index = static_cast<int>(declared_.size());
    const auto [first, is_new] = index_.try_emplace(shape.name, index);
    if (!is_new)
      source_.fail(at, fmt::format("a second body named {} (first at {}); rename one", shape.name,
                                   source_.where(declared_[first->second].at)));
    declared_.push_back({shape.name, at, array});
    scenario_.shapes.push_back(std::move(shape));
  }

  // Contacts and forces -----------------------------------------------------------------------------------------------

  /// A <pair>: the bodies that its two sides select.
  struct Pair {
    const XmlElement* element;
    std::vector<int> a, b;  ///< groups
  };

  void read_contacts(const XmlElement* element) {
    const std::size_t count = declared_.size();
    std::vector<std::vector<int>> selectors(count);  // per body: the sides that select it; ascending
    std::vector<Pair> pairs;
    if (element != nullptr) {
      check_attributes(source_, *element, {}, {});
      for (const XmlElement& child : element->children) {
        if (child.name != "pair")
          source_.fail(child.at,
                       fmt::format("<{}> in <contacts>; {}", child.name, suggest(child.name, {"pair"}, "it holds:")));
        const auto [a, b] = read_pair(child);
        const int side = 2 * static_cast<int>(pairs.size());
        for (const int i : a) selectors[i].push_back(side);
        for (const int i : b) selectors[i].push_back(side + 1);
        pairs.push_back({&child, {}, {}});
      }
    }

    // Bodies of one kind that the same sides select, and that are alike fixed or free, are one group.
    std::map<std::tuple<ShapeKind, bool, std::vector<int>>, int> group_of;
    std::vector<int> first_of, size_of;
    for (std::size_t i = 0; i < count; ++i) {
      const auto [group, is_new] = group_of.try_emplace(
          {scenario_.shapes[i].kind, is_free(static_cast<int>(i)), selectors[i]}, static_cast<int>(first_of.size()));
      if (is_new) {
        // Without pairs there are few kinds.
        if (element != nullptr && first_of.size() == group_limit)
          source_.fail(element->at, fmt::format("more than {} kinds of bodies by their pairs; name arrays by patterns "
                                                "(box_*) in place of single bodies",
                                                group_limit));
        first_of.push_back(static_cast<int>(i));
        size_of.push_back(0);
        for (const int side : selectors[i])
          (side % 2 == 0 ? pairs[side / 2].a : pairs[side / 2].b).push_back(group->second);
      }
      scenario_.pairs.group.push_back(group->second);
      ++size_of[group->second];
    }

    const int groups = scenario_.pairs.groups = static_cast<int>(first_of.size());
    std::vector<int>& index = scenario_.pairs.index;
    index.assign(first_of.size() * first_of.size(), -1);
    for (int law = 0; law < static_cast<int>(pairs.size()); ++law) {
      for (const int g : pairs[law].a) {
        for (const int h : pairs[law].b) {
          if (!is_free(first_of[g]) && !is_free(first_of[h])) continue;
          if (g == h && size_of[g] == 1) continue;  // a pattern on both sides that only one body matches
          const Shape &shape_g = scenario_.shapes[first_of[g]], &shape_h = scenario_.shapes[first_of[h]];
          if (!can_touch(shape_g.kind, shape_h.kind))
            source_.fail(pairs[law].element->at,
                         fmt::format("{} and {} are a pair, but a cylinder touches half-spaces and spheres only; name "
                                     "other bodies, or give one of the two another shape",
                                     shape_g.name, g == h ? declared_[next_of_group(h)].name : shape_h.name));
          const int known = index[g * groups + h];
          if (known >= 0 && known != law)
            source_.fail(pairs[law].element->at,
                         fmt::format("{} and {} are a pair already (at {}); keep one", declared_[first_of[g]].name,
                                     declared_[g == h ? next_of_group(h) : first_of[h]].name,
                                     source_.where(pairs[known].element->at)));
          index[g * groups + h] = index[h * groups + g] = law;
        }
      }
    }
  }

  /// The second body of a group.
  int next_of_group(int group) const {
    const auto first = std::find(scenario_.pairs.group.begin(), scenario_.pairs.group.end(), group);
    return static_cast<int>(std::find(first + 1, scenario_.pairs.group.end(), group) - scenario_.pairs.group.begin());
  }

  bool is_free(int body) const { return scenario_.shapes[body].body >= 0; }

  std::pair<std::vector<int>, std::vector<int>> read_pair(const XmlElement& element) {
    check_attributes(source_, element, {"a", "b", "mu"}, {"restitution"});
    check_empty(source_, element);
    const XmlAttribute &a = *element.find("a"), &b = *element.find("b");
    PairLaw law;
    law.mu = values_.number(*element.find("mu"), not_negative);
    if (const XmlAttribute* restitution = element.find("restitution"))
      law.restitution = values_.number(*restitution, {0, 1, false});
    scenario_.pairs.laws.push_back(law);
    std::vector<int> first = find_bodies(a), second = find_bodies(b);

    // By name, what cannot collide is a mistake; of a pattern those pairs are taken that can.
    if (is_name(a.value) && a.value == b.value)
      source_.fail(b.value_at, fmt::format("{} does not collide with itself; name another body", b.value));
    const int body_a = scenario_.shapes[first.front()].body, body_b = scenario_.shapes[second.front()].body;
    if (is_name(a.value) && is_name(b.value) && body_a >= 0 && body_a == body_b)
      source_.fail(b.value_at,
                   fmt::format("{} and {} are shapes of one link, which keep their distance; name another body",
                               a.value, b.value));
    const auto is_free_body = [&](int i) { return is_free(i); };
    if (std::none_of(first.begin(), first.end(), is_free_body) &&
        std::none_of(second.begin(), second.end(), is_free_body))
      source_.fail(a.value_at, fmt::format("{} and {} are both fixed to the world; one of a pair has to be free",
                                           a.value, b.value));
    return {std::move(first), std::move(second)};
  }

  std::vector<int> find_bodies(const XmlAttribute& attribute) const {
    const auto found = index_.find(attribute.value);
    if (found != index_.end()) return {found->second};
    std::vector<int> bodies;
    if (std::count(attribute.value.begin(), attribute.value.end(), '*') > 1)
      source_.fail(attribute.value_at, fmt::format("\"{}\" has more than one *; write one", attribute.value));
    if (attribute.value.find('*') != std::string::npos)
      for (std::size_t i = 0; i < declared_.size(); ++i)
        if (matches(attribute.value, declared_[i].name)) bodies.push_back(static_cast<int>(i));
    if (bodies.empty()) fail_no_body(attribute);
    return bodies;
  }

  [[noreturn]] void fail_no_body(const XmlAttribute& attribute) const {
    std::vector<std::string> names;
    for (const Declared& body : declared_) {
      if (body.array >= 0 && body.name.compare(0, body.name.rfind('_'), attribute.value) == 0)
        source_.fail(attribute.value_at, fmt::format("there is no body \"{0}\" but an array of them; write {0}_1 for "
                                                     "the first, {0}_* for all",
                                                     attribute.value));
      names.push_back(body.name);
    }
    source_.fail(attribute.value_at, fmt::format("there is no body \"{}\"; {}", attribute.value,
                                                 suggest(attribute.value, names, "the bodies are:")));
  }

  void read_forces(const XmlElement& element) {
    check_attributes(source_, element, {}, {});
    for (const XmlElement& child : element.children) {
      if (child.name != "force")
        source_.fail(child.at,
                     fmt::format("<{}> in <forces>; {}", child.name, suggest(child.name, {"force"}, "it holds:")));
      check_attributes(source_, child, {"body", "force", "from", "to"}, {});
      check_empty(source_, child);
      const XmlAttribute& body = *child.find("body");
      if (body.value.find('*') != std::string::npos)
        source_.fail(body.value_at, "a force acts on one body; write one <force> for each");
      Force force;
      force.body = scenario_.shapes[find_bodies(body).front()].body;
      if (force.body < 0)
        source_.fail(body.value_at, fmt::format("{} is fixed to the world; a force needs a free body", body.value));
      force.force = vector(*child.find("force"), "x y z in N");
      force.from = values_.number(*child.find("from"), not_negative);
      force.to = values_.number(*child.find("to"), not_negative);
      if (force.to < force.from)
        values_.fail(*child.find("to"),
                     fmt::format("the force ends at {} s, before it begins at {} s; swap them", force.to, force.from));
      scenario_.forces.push_back(force);
    }
  }

  // Values ------------------------------------------------------------------------------------------------------------

  Vec3 vector(const XmlAttribute& attribute, std::string_view meaning) {
    const std::vector<double> x = values_.numbers(attribute, 3, meaning);
    return {x[0], x[1], x[2]};
  }

  Vec3 direction(const XmlAttribute& attribute) {
    const Vec3 x = vector(attribute, "x y z, of any length but 0");
    const double largest = x.cwiseAbs().maxCoeff();
    if (largest == 0) values_.fail(attribute, fmt::format("{} is 0 0 0; it has to point somewhere", attribute.name));
    return (x / largest).normalized();
  }

  /// From `quaternion`, or from `axis` and `angle`; none: as the world.
  Quat orientation(const XmlElement& element) {
    const XmlAttribute *axis = element.find("axis"), *angle = element.find("angle");
    const XmlAttribute* quaternion = element.find("quaternion");
    if (quaternion != nullptr) {
      if (axis != nullptr || angle != nullptr)
        source_.fail(quaternion->name_at, "a quaternion beside axis and angle; keep one of the two");
      const std::vector<double> q = values_.numbers(*quaternion, 4, "w x y z");
      const Eigen::Vector4d x(q[0], q[1], q[2], q[3]);
      const double largest = x.cwiseAbs().maxCoeff();
      if (largest == 0) values_.fail(*quaternion, "quaternion is 0 0 0 0; no turn at all is 1 0 0 0");
      const Eigen::Vector4d unit = (x / largest).normalized();
      return {unit[0], unit[1], unit[2], unit[3]};
    }
    if (axis == nullptr && angle == nullptr) return Quat::Identity();
    if (axis == nullptr) source_.fail(angle->name_at, "an angle without an axis; add axis=\"x y z\"");
    if (angle == nullptr) source_.fail(axis->name_at, "an axis without an angle; add angle=\"...\" in rad");
    const Vec3 unit = direction(*axis);
    Quat q = Quat(Eigen::AngleAxisd(values_.number(*angle, any_number), unit)).normalized();
    q.coeffs().array() += 0.0;  // -0 becomes 0
    return q;
  }

  std::string one_of(const XmlAttribute& attribute, const std::vector<std::string>& words) const {
    if (std::find(words.begin(), words.end(), attribute.value) == words.end())
      source_.fail(attribute.value_at, fmt::format("{} is \"{}\"; {}", attribute.name, attribute.value,
                                                   suggest(attribute.value, words, "it is one of:")));
    return attribute.value;
  }

  const SourceText& source_;
  Values values_;
  Scenario scenario_;
  std::vector<const XmlElement*> sections_;
  std::vector<Declared> declared_;
  std::map<std::string, int> index_;  ///< of a body's name in declared_
  int arrays_ = 0;
  std::vector<Pose> zero_pose_;  ///< of links, by body: in the robot's zero pose
};

}  // namespace

Scenario load_scenario(const std::string& path, const Overrides& overrides) {
  const SourceText source = read_text(path);
  const XmlElement root = parse_xml(source);
  return Loader(source, overrides).load(root);
}

}  // namespace cb
