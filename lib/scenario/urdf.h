#pragma once

#include <string>
#include <utility>
#include <vector>

#include "scenario/robot.h"

namespace cb {

/// What a URDF file becomes.
struct UrdfRobot {
  RobotDescription robot;  ///< `at`: offsets into the URDF file's text; name and pose are the caller's
  /// Shapes of what stands still with a fixed base, and where they are in the text; `local` in the robot's frame.
  std::vector<std::pair<Shape, std::size_t>> fixed;
  std::vector<std::string> files;     ///< of meshes that were read
  std::vector<std::string> left_out;  ///< what the file has and a simulation does not use: "12 <visual>, first at ..."
};

/// Reads a robot from a URDF file (http://wiki.ros.org/urdf/XML): links, inertials, revolute, continuous, prismatic,
/// fixed and floating joints, limits and damping, collision shapes box, sphere, cylinder, capsule, hulls of meshes.
/// `free_base`: the root link floats; else it is the world. `prefix`: before all names. In names, what is no letter,
/// digit or underscore becomes an underscore. Throws InputError at the place in the file.
UrdfRobot read_urdf(const SourceText& source, bool free_base, const std::string& prefix);

}  // namespace cb
