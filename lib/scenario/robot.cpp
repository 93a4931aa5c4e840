// From a robot's description to a tree of the model: checks, order, frames.
#include "scenario/robot.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <map>

#include "dynamics/kinematics.h"
#include "scenario/near_name.h"

namespace cb {

namespace {

Pose operator*(const Pose& a, const Pose& b) { return {a * b.p, (a.q * b.q).normalized()}; }
Pose inverse(const Pose& a) { return {a.q.conjugate() * -a.p, a.q.conjugate()}; }

class Builder {
 public:
  Builder(const RobotDescription& robot, const SourceText& source, Scenario& scenario)
      : robot_(robot), source_(source), scenario_(scenario) {}

  std::vector<std::pair<Shape, std::size_t>> build() {
    index_links();
    find_carriers();
    order();
    const int first_body = static_cast<int>(scenario_.model.bodies.size());
    const int tree_index = static_cast<int>(scenario_.model.trees.size());
    Tree tree;
    tree.name = robot_.name;
    tree.v = static_cast<int>(scenario_.initial.qd.size());
    std::vector<std::pair<Shape, std::size_t>> shapes;
    std::map<int, int> joint_of_link;
    for (const int j : order_) {
      const RobotDescription::Joint& from = robot_.joints[j];
      const int link = link_.at(from.child);
      const int body = first_body + static_cast<int>(tree.joints.size());
      const Pose pose = add_link(robot_.links[link], tree_index);
      zero_[link] = pose;

      Joint joint;
      joint.name = from.name;
      joint.kind = from.kind;
      joint.body = body;
      Pose parent;
      if (from.parent != "world") {
        const int up = link_.at(from.parent);
        joint.up = joint_of_link.at(up);
        joint.parent = first_body + joint.up;
        parent = zero_.at(up);
      }
      const Vec3 anchor = robot_.pose * from.anchor;
      joint.anchor_P = inverse(parent) * anchor;
      joint.anchor_C = inverse(pose) * anchor;
      joint.turn_PC = (parent.q.conjugate() * pose.q).normalized();
      if (!(from.axis.norm() > 0))
        source_.fail(from.at, fmt::format("the axis of {} is 0 0 0; it has to point somewhere", from.name));
      joint.axis_C = (pose.q.conjugate() * (robot_.pose.q * from.axis.stableNormalized())).normalized();
      joint.lower = from.lower;
      joint.upper = from.upper;
      joint.limit_rate = from.limit_rate;
      joint.damping = from.damping;
      joint.stiffness = from.stiffness;
      joint.rest = from.rest;
      joint.torque_limit = from.torque_limit;
      check_limits(from);
      State& initial = scenario_.initial;
      if (joint.nv() > 0) joint.v = static_cast<int>(initial.qd.size());
      if (joint.kind == JointKind::free) {
        for (const Vec3& part : {robot_.pose.q * from.linear_velocity, robot_.pose.q * from.angular_velocity})
          initial.qd.insert(initial.qd.end(), part.data(), part.data() + 3);
      } else if (joint.nv() == 1) {
        joint.q = static_cast<int>(initial.q.size());
        initial.q.push_back(from.position);
        initial.qd.push_back(from.velocity);
      }
      tree.nv += joint.nv();
      joint_of_link[link] = static_cast<int>(tree.joints.size());
      tree.joints.push_back(joint);

      for (std::size_t s = 0; s < robot_.links[link].shapes.size(); ++s) {
        Shape shape = robot_.links[link].shapes[s];
        shape.body = body;
        shape.local = inverse(pose) * (robot_.pose * shape.local);
        shapes.emplace_back(std::move(shape), robot_.links[link].shape_at[s]);
      }
    }
    if (tree.nv == 0)
      source_.fail(robot_.at,
                   fmt::format("nothing of {} can move: every joint is fixed; make one revolute, prismatic or "
                               "free, or use fixed=\"yes\" bodies",
                               robot_.name));
    scenario_.model.trees.push_back(std::move(tree));
    forward_kinematics(scenario_.model, scenario_.model.trees.back(), scenario_.initial);
    return shapes;
  }

 private:
  void index_links() {
    for (std::size_t i = 0; i < robot_.links.size(); ++i) {
      const RobotDescription::Link& link = robot_.links[i];
      if (link.name == "world") source_.fail(link.at, "\"world\" is what does not move; give the link another name");
      const auto [first, is_new] = link_.try_emplace(link.name, static_cast<int>(i));
      if (!is_new)
        source_.fail(link.at, fmt::format("a second link named {} (first at {}); rename one", link.name,
                                          source_.where(robot_.links[first->second].at)));
      for (const Body& body : scenario_.model.bodies)
        if (body.name == link.name)
          source_.fail(link.at, fmt::format("there is a body named {} already; rename the link", link.name));
    }
    if (robot_.links.empty()) source_.fail(robot_.at, fmt::format("{} has no link; add a <link>", robot_.name));
  }

  int link(const std::string& name, std::size_t at) const {
    const auto found = link_.find(name);
    if (found != link_.end()) return found->second;
    std::vector<std::string> names{"world"};
    for (const RobotDescription::Link& known : robot_.links) names.push_back(known.name);
    source_.fail(at,
                 fmt::format("{} has no link \"{}\"; {}", robot_.name, name, suggest(name, names, "the links are:")));
  }

  // Which joint carries each link: exactly one.
  void find_carriers() {
    carrier_.assign(robot_.links.size(), -1);
    for (std::size_t j = 0; j < robot_.joints.size(); ++j) {
      const RobotDescription::Joint& joint = robot_.joints[j];
      for (std::size_t k = 0; k < j; ++k)
        if (robot_.joints[k].name == joint.name)
          source_.fail(joint.at, fmt::format("a second joint named {} (first at {}); rename one", joint.name,
                                             source_.where(robot_.joints[k].at)));
      for (const Tree& tree : scenario_.model.trees)
        for (const Joint& known : tree.joints)
          if (known.name == joint.name)
            source_.fail(joint.at,
                         fmt::format("the robot {} has a joint named {} too; rename one", tree.name, joint.name));
      if (joint.parent != "world") link(joint.parent, joint.parent_at);
      if (joint.child == "world")
        source_.fail(joint.child_at, "the world does not move: it is no child of a joint; swap parent and child");
      const int child = link(joint.child, joint.child_at);
      if (carrier_[child] >= 0)
        source_.fail(joint.child_at,
                     fmt::format("{} is the child of joint {} already (at {}): that closes a loop; a robot is a tree, "
                                 "in which each link is the child of one joint",
                                 joint.child, robot_.joints[carrier_[child]].name,
                                 source_.where(robot_.joints[carrier_[child]].at)));
      carrier_[child] = static_cast<int>(j);
      if (joint.kind == JointKind::free && joint.parent != "world")
        source_.fail(joint.parent_at, fmt::format("the free joint {} hangs on {}; a free joint has parent=\"world\"",
                                                  joint.name, joint.parent));
    }
    for (std::size_t i = 0; i < carrier_.size(); ++i)
      if (carrier_[i] < 0)
        source_.fail(
            robot_.links[i].at,
            fmt::format("no joint has {} as its child; add a <joint parent=\"world\" child=\"{}\"> (kind=\"free\" "
                        "where it floats, \"fixed\" where it stands)",
                        robot_.links[i].name, robot_.links[i].name));
  }

  // Joints with parents first, in the file's order otherwise. What the world does not reach hangs on itself.
  void order() {
    std::vector<bool> placed(robot_.links.size(), false);
    std::vector<bool> used(robot_.joints.size(), false);
    for (bool progress = true; progress;) {
      progress = false;
      for (std::size_t j = 0; j < robot_.joints.size(); ++j) {
        const RobotDescription::Joint& joint = robot_.joints[j];
        if (used[j] || (joint.parent != "world" && !placed[link_.at(joint.parent)])) continue;
        used[j] = placed[link_.at(joint.child)] = progress = true;
        order_.push_back(static_cast<int>(j));
      }
    }
    for (std::size_t j = 0; j < robot_.joints.size(); ++j)
      if (!used[j])
        source_.fail(robot_.joints[j].at,
                     fmt::format("joint {} is part of a loop, or hangs on one: going from {} to parents never reaches "
                                 "the world; a robot is a tree that begins with parent=\"world\"",
                                 robot_.joints[j].name, robot_.joints[j].child));
  }

  // Appends the body; returns its pose in the world where all joints are at 0.
  Pose add_link(const RobotDescription::Link& from, int tree) {
    Body body;
    body.name = from.name;
    body.mass = from.mass;
    body.tree = tree;
    Pose pose = robot_.pose * from.pose;
    const Mat3& I = from.inertia;
    if (I.isDiagonal(0)) {
      body.inertia = I.diagonal();
    } else if (I.allFinite()) {
      const Eigen::SelfAdjointEigenSolver<Mat3> principal(I);
      Mat3 axes = principal.eigenvectors();
      if (axes.determinant() < 0) axes.col(2) = -axes.col(2);
      body.inertia = principal.eigenvalues();
      pose.q = (pose.q * Quat(axes)).normalized();
    }
    if (!std::isnormal(body.mass) || !(body.mass > 0) || !I.allFinite() || !(body.inertia.minCoeff() > 0))
      source_.fail(from.at, fmt::format("{} has a mass of {} kg and principal moments of inertia {} {} {} kg m^2; all "
                                        "have to be more than 0 and finite",
                                        from.name, body.mass, body.inertia[0], body.inertia[1], body.inertia[2]));
    check_triangle(from, body.inertia);
    scenario_.model.bodies.push_back(body);
    scenario_.initial.pose.push_back(pose);
    scenario_.initial.v.resize(scenario_.initial.v.size() + 6, 0.0);
    return pose;
  }

  // Moments about axes of inertia are sums of two of the three integrals of x^2, y^2, z^2 over the mass.
  void check_triangle(const RobotDescription::Link& link, Vec3 moments) const {
    constexpr double written = 1e-2;  // -: of the sum of two moments, what three digits of each may miss (a flat plate)
    std::sort(moments.data(), moments.data() + 3);
    const double two = moments[0] + moments[1];
    if (moments[2] <= (1 + written) * two) return;
    source_.fail(
        link.at,
        fmt::format("{} has principal moments of inertia {:g} {:g} {:g} kg m^2, which no body has: the largest is "
                    "at most the sum of the other two; give the moments and products about its centre of mass",
                    link.name, moments[0], moments[1], moments[2]));
  }

  void check_limits(const RobotDescription::Joint& joint) const {
    if (joint.lower > joint.upper)
      source_.fail(joint.at, fmt::format("joint {} has its lower limit {} beyond its upper one {}; swap them",
                                         joint.name, joint.lower, joint.upper));
    if (joint.position < joint.lower || joint.position > joint.upper)
      source_.fail(joint.at, fmt::format("joint {} starts at {}, outside its limits from {} to {}", joint.name,
                                         joint.position, joint.lower, joint.upper));
  }

  const RobotDescription& robot_;
  const SourceText& source_;
  Scenario& scenario_;
  std::map<std::string, int> link_;
  std::vector<int> carrier_, order_;
  std::map<int, Pose> zero_;
};

}  // namespace

std::vector<std::pair<Shape, std::size_t>> add_robot(const RobotDescription& robot, const SourceText& source,
                                                     Scenario& scenario) {
  return Builder(robot, source, scenario).build();
}

}  // namespace cb
