// Reads <bodies>: half-spaces, solids, arrays of them; robots are read_robots.cpp's, grounds read_ground.cpp's.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scenario/near_name.h"
#include "scenario/solid.h"

namespace cb {

namespace {

constexpr long array_limit = 100000;  // bodies of one array
constexpr int grid_limit = 256;       // contact points along an edge of a box

bool is_fixed(const Reading& in, const XmlElement& element) {
  const XmlAttribute* fixed = element.find("fixed");
  if (fixed == nullptr || in.one_of(*fixed, {"yes", "no"}) == "no") return false;
  for (const char* name : {"mass", "density", "velocity", "angular_velocity", "moves_with"})
    if (const XmlAttribute* attribute = element.find(name))
      in.source.fail(attribute->name_at, fmt::format("a fixed body has no {}; remove it, or fixed=\"yes\"", name));
  return true;
}

const XmlAttribute& mass_or_density(const Reading& in, const XmlElement& element) {
  const XmlAttribute *mass = element.find("mass"), *density = element.find("density");
  if (mass != nullptr && density != nullptr)
    in.source.fail(density->name_at, "mass and density; one follows from the other: keep one");
  if (mass == nullptr && density == nullptr)
    in.source.fail(element.at, fmt::format("<{}> needs a mass or a density (or fixed=\"yes\")", element.name));
  return mass != nullptr ? *mass : *density;
}

/// Takes a body from where it would be in the robot's zero pose to where the link is now, and gives it the velocity
/// that it has there as a part of the link.
void carry(const Reading& in, const XmlElement& element, const XmlAttribute& link, Pose& pose, Vec3& v, Vec3& w) {
  for (const char* name : {"velocity", "angular_velocity"})
    if (const XmlAttribute* attribute = element.find(name))
      in.source.fail(attribute->name_at, fmt::format("{} beside moves_with, which gives it; keep one", name));
  std::vector<std::string> links;
  for (const Tree& tree : in.scenario.model.trees) {
    for (const Joint& joint : tree.joints) {
      links.push_back(in.scenario.model.bodies[joint.body].name);
      if (links.back() != link.value) continue;
      const Pose& zero = in.zero_pose[joint.body];
      const Pose& now = in.scenario.initial.pose[joint.body];
      const Quat turn = now.q * zero.q.conjugate();
      pose.p = now.p + turn * (pose.p - zero.p);
      pose.q = (turn * pose.q).normalized();
      const double* twist = &in.scenario.initial.v[6 * static_cast<std::size_t>(joint.body)];
      w = Vec3(twist + 3);
      v = Vec3(twist) + w.cross(pose.p - now.p);
      return;
    }
  }
  in.source.fail(link.value_at, links.empty()
                                    ? "there is no robot before this body; moves_with names a link of one"
                                    : fmt::format("there is no link \"{}\"; {}", link.value,
                                                  suggest(link.value, links, "the links before this body are:")));
}

void read_half_space(Reading& in, const XmlElement& element) {
  check_attributes(in.source, element, {"name", "point"}, {"normal", "axis", "angle", "quaternion"});
  check_empty(in.source, element);
  Shape shape;
  shape.kind = ShapeKind::half_space;
  shape.local.p = in.vector(*element.find("point"), "x y z in m");
  const XmlAttribute* normal = element.find("normal");
  const bool turned =
      element.find("axis") != nullptr || element.find("angle") != nullptr || element.find("quaternion") != nullptr;
  if (normal == nullptr && !turned)
    in.source.fail(element.at,
                   "<half_space> needs a normal, or axis and angle (or a quaternion) that turn the y axis into it");
  if (normal != nullptr && turned)
    in.source.fail(normal->name_at,
                   "normal beside an orientation; the orientation turns the y axis into the normal: keep one");
  if (normal != nullptr)
    shape.local.q = Quat::FromTwoVectors(Vec3::UnitY(), in.direction(*normal)).normalized();
  else
    shape.local.q = in.orientation(element);
  in.declare_body(element, {}, -1, std::move(shape));
}

void read_body(Reading& in, const XmlElement& element, const Vec3& offset, const std::string& suffix, int array) {
  check_empty(in.source, element);
  std::vector<std::string> optional{"mass",     "density",          "fixed",     "axis", "angle", "quaternion",
                                    "velocity", "angular_velocity", "moves_with"};
  if (element.name == "box") optional.push_back("contact_grid");
  for (const std::string& name : takes(element)) optional.push_back(name);
  check_attributes(in.source, element, needs(element), optional);
  const Solid solid = read_solid(in, element);
  Shape shape = solid.shape;
  if (const XmlAttribute* grid = element.find("contact_grid"))
    shape.contact_grid = static_cast<int>(in.values.integer(*grid, 2, grid_limit));
  Body body;
  Pose pose;
  pose.p = in.vector(*element.find("position"), "x y z in m") + offset;
  pose.q = in.orientation(element);
  pose = placed(pose, solid);

  if (is_fixed(in, element)) {
    shape.local = pose;
    in.declare_body(element, suffix, array, std::move(shape));
    return;
  }

  const XmlAttribute& weight = mass_or_density(in, element);
  body.mass = in.values.number(weight, positive) * (weight.name == "density" ? solid.volume : 1);
  body.inertia = body.mass * solid.inertia_per_mass;
  if (!std::isnormal(body.mass) || !body.inertia.allFinite() || !(body.inertia.minCoeff() > 0))
    in.values.fail(weight,
                   fmt::format("the mass comes to {} kg and the least moment of inertia to {} kg m^2; both have "
                               "to be more than 0 and finite",
                               body.mass, body.inertia.minCoeff()));
  shape.body = static_cast<int>(in.scenario.model.bodies.size());
  body.name = element.find("name")->value + suffix;
  Vec3 v = Vec3::Zero(), w = Vec3::Zero();
  if (const XmlAttribute* velocity = element.find("velocity")) v = in.vector(*velocity, "x y z in m/s");
  if (const XmlAttribute* spin = element.find("angular_velocity")) w = in.vector(*spin, "x y z in rad/s");
  if (const XmlAttribute* link = element.find("moves_with")) carry(in, element, *link, pose, v, w);
  in.scenario.model.bodies.push_back(std::move(body));
  in.scenario.initial.pose.push_back(pose);
  for (const Vec3& part : {v, w})
    in.scenario.initial.v.insert(in.scenario.initial.v.end(), part.data(), part.data() + 3);
  in.declare_body(element, suffix, array, std::move(shape));
}

void read_array(Reading& in, const XmlElement& element) {
  check_attributes(in.source, element, {"count"}, {"offset"});
  const long count = in.values.integer(*element.find("count"), 1, array_limit);
  const XmlAttribute* step = element.find("offset");
  const Vec3 offset = step != nullptr ? in.vector(*step, "x y z in m") : Vec3::Zero();
  if (step != nullptr && offset.isZero(0) && count > 1)
    in.values.fail(*step, "offset is 0 0 0: all bodies would be in one place; write the step from one to the next");
  if (element.children.empty()) in.source.fail(element.at, "an empty <array>; put one <box> or <sphere> into it");
  const XmlElement& child = element.children.front();
  if (!is_solid(child)) in.fail_child(child, "<array>", solids(), "it repeats:");
  if (element.children.size() > 1)
    in.source.fail(element.children[1].at, "a second element in <array>; write one <array> for each");
  const XmlAttribute* position = child.find("position");
  if (step == nullptr && count > 1 && position != nullptr && position->value.find("index") == std::string::npos)
    in.source.fail(
        element.at,
        "<array> needs an offset, the step from one copy to the next, or a position by the index of the copy");
  const int array = in.arrays++;
  for (long i = 0; i < count; ++i) {
    in.values.set_index(i);
    read_body(in, child, static_cast<double>(i) * offset, fmt::format("_{}", i + 1), array);
  }
  in.values.set_index(Values::none_of_array);
}

}  // namespace

void read_bodies(Reading& in, const XmlElement& element) {
  check_attributes(in.source, element, {}, {});
  for (const XmlElement& child : element.children) {
    if (child.name == "half_space")
      read_half_space(in, child);
    else if (is_solid(child))
      read_body(in, child, Vec3::Zero(), {}, -1);
    else if (child.name == "array")
      read_array(in, child);
    else if (child.name == "heightfield")
      read_heightfield(in, child);
    else if (child.name == "mesh")
      read_mesh(in, child);
    else if (child.name == "robot")
      read_robot(in, child);
    else
      in.fail_child(
          child, "<bodies>",
          {"half_space", "box", "sphere", "cylinder", "capsule", "hull", "heightfield", "mesh", "array", "robot"});
  }
  if (in.scenario.model.bodies.empty())
    in.source.fail(element.at, "no body that can move; add a <box> or a <sphere> with a mass");
}

}  // namespace cb
