#pragma once

#include <string>
#include <vector>

#include "scenario/scenario.h"
#include "scenario/xml_tree.h"

namespace cb {

/// A robot as a file describes it, before it is checked: what <robot> in a scene and a URDF file both become. All
/// poses are in the robot's frame in its zero pose, where every joint coordinate is 0.
struct RobotDescription {
  /// `at`: offset into the source's text, for messages.
  struct Link {
    std::string name;
    double mass = 0;              ///< kg
    Pose pose;                    ///< centre of mass; axes in which `inertia` is given
    Mat3 inertia = Mat3::Zero();  ///< about the centre of mass, in the axes of `pose`, kg m^2
    std::vector<Shape> shapes;    ///< `local`: pose in the robot's frame; `name` is set, `body` is not
    std::vector<std::size_t> shape_at;
    std::size_t at = 0;
  };
  struct Joint {
    std::string name;
    JointKind kind = JointKind::fixed;
    std::string parent, child;  ///< names of links; parent "world": the robot's frame, which does not move
    Vec3 anchor = Vec3::Zero();
    Vec3 axis = Vec3::UnitX();  ///< of any length but 0
    double lower = -std::numeric_limits<double>::infinity(), upper = std::numeric_limits<double>::infinity();
    double limit_rate = 0, damping = 0, stiffness = 0, rest = 0, torque_limit = std::numeric_limits<double>::infinity();
    double position = 0, velocity = 0;                                     ///< at t = 0; revolute and prismatic
    Vec3 linear_velocity = Vec3::Zero(), angular_velocity = Vec3::Zero();  ///< at t = 0, of a free joint's child
    std::size_t at = 0, parent_at = 0, child_at = 0;
  };
  std::string name;
  Pose pose;  ///< of the robot's frame in the world
  std::vector<Link> links;
  std::vector<Joint> joints;
  std::size_t at = 0;
};

/// Checks a description and appends it to the model: bodies, a tree, its initial q, qd, and (moved by forward
/// kinematics to where q says) poses and twists of its links. Links become principal: `pose` of Body is turned into the
/// axes of inertia. Shapes are returned, `body` and `local` (in their body's frame) set, for the caller to declare.
/// Throws InputError at the place in `source`: a loop in the tree, a link that no joint carries or two do, an unknown
/// link, no inertia, a limit beyond the other, a start outside the limits, names given twice, nothing that moves.
std::vector<std::pair<Shape, std::size_t>> add_robot(const RobotDescription& robot, const SourceText& source,
                                                     Scenario& scenario);

}  // namespace cb
