// From a URDF file to a robot's description.
//
// Source: the URDF specification (http://wiki.ros.org/urdf/XML), read by liburdfdom. Differences from other readers:
//   1. A fixed base is the world: the root's inertia is not used, its shapes stand still.
//   2. A link without inertia on a fixed joint is a part of its parent (tool frames, mounts). On a joint that moves it
//      is an error.
//   3. A mesh of a collision counts as its convex hull where its file is an OBJ or STL file beside the URDF file; else
//      it is left out and reported, as all that a simulation does not use.
//   4. A geometry may be a <capsule radius length>, along z like a cylinder, which newer readers know, and Debian's
//      liburdfdom does not: it is told of a cylinder.
// liburdfdom knows no places. Elements are found again in the text by their names, with pugixml, which also says what
// is not well formed.
#include "scenario/urdf.h"

#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <pugixml.hpp>
#include <set>
#include <sstream>

#include "scenario/expression.h"
#include "scenario/mesh_file.h"
#include "scenario/solid.h"

#ifdef CONTACTBENCH_HAVE_URDFDOM
#include <console_bridge/console.h>
#include <urdf_parser/urdf_parser.h>
#endif

namespace cb {

#ifndef CONTACTBENCH_HAVE_URDFDOM

UrdfRobot read_urdf(const SourceText& source, bool, const std::string&) {
  source.fail(0,
              "this program was built without liburdfdom, which reads URDF; install it (scripts/setup.sh) and build "
              "again, or write the robot as <link> and <joint> elements");
}

#else

namespace {

Pose operator*(const Pose& a, const Pose& b) { return {a * b.p, (a.q * b.q).normalized()}; }

/// Keeps what liburdfdom would print.
class Messages : public console_bridge::OutputHandler {
 public:
  Messages() { console_bridge::useOutputHandler(this); }
  ~Messages() override { console_bridge::restorePreviousOutputHandler(); }
  Messages(const Messages&) = delete;
  Messages& operator=(const Messages&) = delete;
  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    if (level < console_bridge::CONSOLE_BRIDGE_LOG_ERROR) return;
    all_ += (all_.empty() ? "" : "; ") + text;
  }
  const std::string& all() const { return all_; }

 private:
  std::string all_;
};

std::size_t offset(const pugi::xml_node& node) {
  return static_cast<std::size_t>(std::max<std::ptrdiff_t>(node.offset_debug(), 0));
}

/// What a simulation does not use, counted by kind.
class LeftOutElements {
 public:
  explicit LeftOutElements(const SourceText& source) : source_(source) {}
  void add(const std::string& what, std::size_t at) {
    Entry& entry = entries_[what];
    if (entry.count++ == 0) entry.first = at;
  }
  std::vector<std::string> all() const {
    std::vector<std::string> lines;
    for (const auto& [what, entry] : entries_)
      lines.push_back(entry.count == 1
                          ? fmt::format("{} at {}", what, source_.where(entry.first))
                          : fmt::format("{} {}, the first at {}", entry.count, what, source_.where(entry.first)));
    return lines;
  }

 private:
  struct Entry {
    int count = 0;
    std::size_t first = 0;
  };
  const SourceText& source_;
  std::map<std::string, Entry> entries_;
};

class Reader {
 public:
  Reader(const SourceText& source, bool free_base, const std::string& prefix)
      : source_(source), free_base_(free_base), prefix_(prefix), left_out_(source) {}

  UrdfRobot read() {
    find_elements();
    parse();
    const urdf::Link& root = *model_->getRoot();
    if (free_base_) {
      if (!root.inertial)
        source_.fail(link_at(root.name), fmt::format("the base {} is free but has no <inertial>; give it one, or write "
                                                     "base=\"fixed\"",
                                                     root.name));
      const std::string link = add_link(root, Pose());
      RobotDescription::Joint joint;
      joint.name = prefix_ + "base_free";
      joint.kind = JointKind::free;
      joint.parent = "world";
      joint.child = link;
      joint.at = joint.parent_at = joint.child_at = link_at(root.name);
      out_.robot.joints.push_back(joint);
      descend(root, Pose(), link);
    } else {
      if (root.inertial) left_out_.add("the <inertial> of the base, which stands still", link_at(root.name));
      descend(root, Pose(), "world");
      add_shapes(root, Pose(), "world");
    }
    out_.left_out = left_out_.all();
    return std::move(out_);
  }

 private:
  // The text again, for places and for what is left out
  // ----------------------------------------------------------------

  void find_elements() {
    const pugi::xml_parse_result result =
        document_.load_buffer(source_.text.data(), source_.text.size(), pugi::parse_default, pugi::encoding_utf8);
    if (!result)
      source_.fail(std::min(static_cast<std::size_t>(std::max<std::ptrdiff_t>(result.offset, 0)), source_.text.size()),
                   fmt::format("not well formed XML ({})", result.description()));
    const pugi::xml_node robot = document_.child("robot");
    if (!robot)
      source_.fail(offset(document_.document_element()), "a URDF file has one root element, <robot name=\"...\">");
    root_at_ = offset(robot);
    for (const pugi::xml_node& node : robot.children()) {
      if (node.type() != pugi::node_element) continue;
      const std::string kind = node.name(), name = node.attribute("name").value();
      if (kind == "link") {
        if (!link_at_.try_emplace(name, offset(node)).second)
          source_.fail(offset(node), fmt::format("a second link named {} (first at {}); rename one", name,
                                                 source_.where(link_at_.at(name))));
        look_into_link(node);
      } else if (kind == "joint") {
        if (!joint_at_.try_emplace(name, offset(node)).second)
          source_.fail(offset(node), fmt::format("a second joint named {} (first at {}); rename one", name,
                                                 source_.where(joint_at_.at(name))));
        look_into_joint(node);
      } else {
        left_out_.add('<' + kind + '>', offset(node));
      }
    }
  }

  void look_into_link(const pugi::xml_node& link) {
    int collisions = 0;
    for (const pugi::xml_node& node : link.children()) {
      if (node.type() != pugi::node_element) continue;
      const std::string kind = node.name();
      if (kind == "collision") {
        if (node.child("geometry").child("capsule")) capsules_.emplace(link.attribute("name").value(), collisions);
        ++collisions;
        const pugi::xml_node mesh = node.child("geometry").child("mesh");
        if (mesh && mesh_path(mesh.attribute("filename").value()).empty())
          left_out_.add(
              "<mesh> of a <collision> (its hull collides where it is an OBJ or STL file that is found from "
              "the URDF file's folder on)",
              offset(mesh));
      } else if (kind != "inertial") {
        left_out_.add('<' + kind + '>', offset(node));
      }
    }
  }

  void look_into_joint(const pugi::xml_node& joint) {
    static const std::vector<std::string> used{"origin", "parent", "child", "axis"};
    for (const pugi::xml_node& node : joint.children()) {
      if (node.type() != pugi::node_element) continue;
      const std::string kind = node.name();
      if (kind == "limit") {
        if (node.attribute("velocity").as_double() != 0) left_out_.add("velocity of a <limit>", offset(node));
      } else if (kind == "dynamics") {
        if (node.attribute("friction").as_double() != 0)
          left_out_.add("dry friction of a joint's <dynamics>", offset(node));
      } else if (kind == "mimic") {
        left_out_.add("<mimic> (the joint moves on its own)", offset(node));
      } else if (std::find(used.begin(), used.end(), kind) == used.end()) {
        left_out_.add('<' + kind + '>', offset(node));
      }
    }
  }

  /// The file of a mesh that is read; empty where there is none. What begins with package:// is known to ROS alone.
  std::string mesh_path(const std::string& filename) const {
    const std::string path = filename.starts_with("file://") ? filename.substr(7) : filename;
    const std::string beside = (std::filesystem::path(source_.file).parent_path() / path).string();
    std::error_code unreadable;
    return is_mesh_name(path) && std::filesystem::is_regular_file(beside, unreadable) ? beside : std::string();
  }

  std::size_t link_at(const std::string& name) const {
    const auto found = link_at_.find(name);
    return found == link_at_.end() ? root_at_ : found->second;
  }
  std::size_t joint_at(const std::string& name) const {
    const auto found = joint_at_.find(name);
    return found == joint_at_.end() ? root_at_ : found->second;
  }

  // The model
  // ----------------------------------------------------------------------------------------------------------

  void parse() {
    check_joints();
    bool renamed = false;
    for (const pugi::xml_node& link : document_.child("robot").children("link"))
      for (const char* kind : {"collision", "visual"})  // those of a visual are read, too
        for (const pugi::xml_node& element : link.children(kind))
          if (pugi::xml_node capsule = element.child("geometry").child("capsule")) {
            capsule.set_name("cylinder");
            renamed = true;
          }
    std::ostringstream copy;
    if (renamed) document_.save(copy, "", pugi::format_raw);
    const Messages messages;
    try {
      model_ = urdf::parseURDF(renamed ? copy.str() : source_.text);
    } catch (const std::exception& error) {
      source_.fail(place_of(error.what()), fmt::format("liburdfdom: {}", error.what()));
    }
    if (model_ == nullptr || !messages.all().empty())
      source_.fail(place_of(messages.all()),
                   fmt::format("liburdfdom: {}", messages.all().empty() ? "no model" : messages.all()));
  }

  /// liburdfdom takes the last parent where a link has two, and says nothing of the place of a loop.
  void check_joints() const {
    std::map<std::string, pugi::xml_node> carrier;
    for (const pugi::xml_node& joint : document_.child("robot").children("joint")) {
      const std::string name = joint.attribute("name").value(), child = joint.child("child").attribute("link").value();
      if (child.empty()) continue;
      const auto [first, is_new] = carrier.try_emplace(child, joint);
      if (!is_new)
        source_.fail(offset(joint),
                     fmt::format("{} is the child of joint {} already (at {}): that closes a loop; a "
                                 "robot is a tree, in which each link is the child of one joint",
                                 child, first->second.attribute("name").value(), source_.where(offset(first->second))));
    }
    for (const auto& [child, joint] : carrier) {
      std::string link = child;
      for (std::size_t i = 0; i <= carrier.size(); ++i) {
        const auto up = carrier.find(link);
        if (up == carrier.end()) break;
        link = up->second.child("parent").attribute("link").value();
        if (link == child)
          source_.fail(offset(joint), fmt::format("joint {} is part of a loop: going from {} to parents comes back to "
                                                  "it; a robot is a tree",
                                                  joint.attribute("name").value(), child));
      }
    }
  }

  /// The joint or link that a message quotes, the longest name of them; the root where none.
  std::size_t place_of(const std::string& message) const {
    std::size_t place = root_at_, longest = 0;
    for (const auto* elements : {&joint_at_, &link_at_})
      for (const auto& [name, at] : *elements) {
        if (name.size() <= longest) continue;
        for (const auto& quoted : {'[' + name + ']', '\'' + name + '\'', '"' + name + '"'})
          if (message.find(quoted) != std::string::npos) {
            place = at;
            longest = name.size();
          }
      }
    return place;
  }

  Pose pose(const urdf::Pose& from, std::size_t at) const {
    Pose to;
    to.p = vector(from.position, at);
    to.q = Quat(from.rotation.w, from.rotation.x, from.rotation.y, from.rotation.z);
    if (!(to.q.norm() > 0) || !to.q.coeffs().allFinite()) source_.fail(at, "rpy of an <origin> is not three numbers");
    to.q.normalize();
    return to;
  }
  Vec3 vector(const urdf::Vector3& from, std::size_t at) const {
    const Vec3 to(from.x, from.y, from.z);
    if (!to.allFinite()) source_.fail(at, "a number here is not finite");
    return to;
  }

  std::string named(const std::string& name) const {
    std::string out = prefix_ + name;
    for (char& c : out)
      if (!((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9'))) c = '_';
    return is_name(out) ? out : "link_" + out;
  }

  /// Joints below `link`, whose frame is at `frame` in the robot's frame; `carrier`: the description's link that it is
  /// a part of, or "world".
  void descend(const urdf::Link& link, const Pose& frame, const std::string& carrier) {
    for (const urdf::JointSharedPtr& from : link.child_joints) {
      const std::size_t at = joint_at(from->name);
      const Pose child_frame = frame * pose(from->parent_to_joint_origin_transform, at);
      const urdf::Link& child = *model_->getLink(from->child_link_name);
      if (from->type == urdf::Joint::FIXED && (carrier == "world" || !child.inertial)) {
        if (carrier == "world" && child.inertial)
          left_out_.add("the <inertial> of what is fixed to the base, which stands still", link_at(child.name));
        descend(child, child_frame, carrier);
        add_shapes(child, child_frame, carrier);
        continue;
      }
      if (!child.inertial)
        source_.fail(link_at(child.name),
                     fmt::format("{} moves with joint {} but has no <inertial>; give it mass and inertia (or make the "
                                 "joint fixed)",
                                 child.name, from->name));
      out_.robot.joints.push_back(joint(*from, child_frame, carrier, at));
      const std::string name = add_link(child, child_frame);
      descend(child, child_frame, name);
    }
  }

  RobotDescription::Joint joint(const urdf::Joint& from, const Pose& frame, const std::string& carrier,
                                std::size_t at) const {
    RobotDescription::Joint to;
    to.name = named(from.name);
    to.parent = carrier;
    to.child = named(from.child_link_name);
    to.at = to.parent_at = to.child_at = at;
    to.anchor = frame.p;
    switch (from.type) {
      case urdf::Joint::REVOLUTE:
      case urdf::Joint::CONTINUOUS:
        to.kind = JointKind::revolute;
        break;
      case urdf::Joint::PRISMATIC:
        to.kind = JointKind::prismatic;
        break;
      case urdf::Joint::FIXED:
        to.kind = JointKind::fixed;
        return to;
      case urdf::Joint::FLOATING:
        to.kind = JointKind::free;
        return to;
      default:
        source_.fail(at, fmt::format("joint {} is planar; a robot has revolute, continuous, prismatic, fixed and "
                                     "floating joints",
                                     from.name));
    }
    to.axis = frame.q * vector(from.axis, at);
    if (from.limits) {
      if (from.type != urdf::Joint::CONTINUOUS) {
        to.lower = from.limits->lower;
        to.upper = from.limits->upper;
      }
      to.torque_limit = from.limits->effort;
    }
    if (from.dynamics) to.damping = from.dynamics->damping;
    if (!(to.damping >= 0) || !(to.torque_limit >= 0))
      source_.fail(at, fmt::format("joint {} has damping {} and effort {}; both have to be at least 0", from.name,
                                   to.damping, to.torque_limit));
    return to;
  }

  std::string add_link(const urdf::Link& from, const Pose& frame) {
    RobotDescription::Link link;
    link.name = named(from.name);
    link.at = link_at(from.name);
    const urdf::Inertial& inertial = *from.inertial;
    link.mass = inertial.mass;
    link.pose = frame * pose(inertial.origin, link.at);
    link.inertia << inertial.ixx, inertial.ixy, inertial.ixz, inertial.ixy, inertial.iyy, inertial.iyz, inertial.ixz,
        inertial.iyz, inertial.izz;
    out_.robot.links.push_back(std::move(link));
    add_shapes(from, frame, named(from.name));
    return named(from.name);
  }

  /// The collision shapes of a link go to the description's link `carrier`, or to what stands still.
  void add_shapes(const urdf::Link& from, const Pose& frame, const std::string& carrier) {
    const std::size_t at = link_at(from.name);
    int count = 0, number = 0;
    for (const urdf::CollisionSharedPtr& collision : from.collision_array) {
      const bool capsule = capsules_.contains({from.name, number++});
      if (!collision || !collision->geometry) continue;
      Solid solid;
      Shape& shape = solid.shape;
      if (collision->geometry->type == urdf::Geometry::MESH) {
        solid = hull_of(static_cast<const urdf::Mesh&>(*collision->geometry), from.name, at);
        if (!shape.hull) continue;
      }
      shape.name = named(from.name) + (count == 0 ? "" : fmt::format("_{}", count + 1));
      ++count;
      shape.local = placed(frame * pose(collision->origin, at), solid);
      if (collision->geometry->type == urdf::Geometry::BOX) {
        shape.kind = ShapeKind::box;
        shape.half_extents = vector(static_cast<const urdf::Box&>(*collision->geometry).dim, at) / 2;
      } else if (collision->geometry->type == urdf::Geometry::SPHERE) {
        shape.kind = ShapeKind::sphere;
        shape.radius = static_cast<const urdf::Sphere&>(*collision->geometry).radius;
      } else if (collision->geometry->type == urdf::Geometry::CYLINDER) {
        const auto& cylinder = static_cast<const urdf::Cylinder&>(*collision->geometry);
        shape.kind = capsule ? ShapeKind::capsule : ShapeKind::cylinder;
        shape.radius = cylinder.radius;
        shape.half_extents = Vec3(cylinder.radius, cylinder.length / 2, cylinder.radius);
        // Along z there, along y here.
        shape.local.q = (shape.local.q * Quat(std::sqrt(0.5), std::sqrt(0.5), 0, 0)).normalized();
      }
      const bool round = shape.kind == ShapeKind::sphere || shape.kind == ShapeKind::capsule;
      const double least = round ? shape.radius : shape.half_extents.minCoeff();
      if (!(least > 0) || shape.half_extents.y() < 0 || !std::isfinite(shape.size()))
        source_.fail(at, fmt::format("a <collision> of {} has no size; all lengths have to be more than 0", from.name));
      if (carrier == "world") {
        out_.fixed.emplace_back(std::move(shape), at);
        continue;
      }
      for (RobotDescription::Link& link : out_.robot.links) {
        if (link.name != carrier) continue;
        link.shapes.push_back(shape);
        link.shape_at.push_back(at);
      }
    }
  }

  /// The hull of a mesh; without one where the file is left out.
  Solid hull_of(const urdf::Mesh& mesh, const std::string& link, std::size_t at) {
    Solid solid;
    const std::string path = mesh_path(mesh.filename);
    if (path.empty()) return solid;
    try {
      std::vector<Vec3> points = read_mesh_points(path, 1);
      const Vec3 scale = vector(mesh.scale, at);
      for (Vec3& x : points) x = x.cwiseProduct(scale);
      auto hull = std::make_shared<Hull>(make_hull(points));
      solid.frame = hull->frame;
      solid.shape = hull_shape(std::move(hull));
      out_.files.push_back(path);
    } catch (const std::runtime_error& error) {
      source_.fail(at, fmt::format("the mesh of a <collision> of {}: {}: {}", link, path, error.what()));
    }
    return solid;
  }

  const SourceText& source_;
  bool free_base_;
  std::string prefix_;
  LeftOutElements left_out_;
  pugi::xml_document document_;
  std::size_t root_at_ = 0;
  std::map<std::string, std::size_t> link_at_, joint_at_;
  std::set<std::pair<std::string, int> > capsules_;  ///< of a link: which of its <collision> elements
  urdf::ModelInterfaceSharedPtr model_;
  UrdfRobot out_;
};

}  // namespace

UrdfRobot read_urdf(const SourceText& source, bool free_base, const std::string& prefix) {
  return Reader(source, free_base, prefix).read();
}

#endif

}  // namespace cb
