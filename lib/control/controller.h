#pragma once

#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "dynamics/implicit_joints.h"
#include "dynamics/model.h"

namespace cb {

/// A number that a controller takes, as an attribute of its element in the scene file.
struct GainRow {
  std::string_view name, unit, meaning;
  std::optional<double> default_value;  ///< none: the file has to give it
  double least = -std::numeric_limits<double>::infinity();
};
/// A word that it takes: one of `choices`, the first being the default.
struct GainWordRow {
  std::string_view name;
  std::vector<std::string_view> choices;
};
/// A kind of child element: <track joint="..." .../>. Each names a revolute or prismatic joint of the robot.
struct JointRoleRow {
  std::string_view name, meaning;
  int least = 0, most = std::numeric_limits<int>::max();  ///< how many there are
  std::vector<GainRow> gains;
};

struct ControllerRow;

/// A controller as the scene file has it: numbers and words in the order of its row.
struct ControllerSpec {
  const ControllerRow* row = nullptr;
  int tree = 0;               ///< the robot
  std::vector<double> gains;  ///< per row->gains
  std::vector<int> words;     ///< per row->words: index of the choice
  struct ControlledJoint {
    int role = 0;               ///< index into row->roles
    int joint = 0;              ///< index into Tree::joints
    std::vector<double> gains;  ///< per row->roles[role].gains
  };
  std::vector<ControlledJoint> joints;  ///< in the file's order
};

/// Adds its torques to `tau` (indexed as State::qd), from the state at the start of a step and gravity then (m/s^2).
/// Owns its scratch. Limits are clamped by who calls.
using Controller =
    std::function<void(const Model& model, const State& state, const Vec3& gravity, std::span<double> tau)>;

/// One law of control: a file lib/control/<name>.cpp and a row of the table.
struct ControllerRow {
  std::string_view name, summary, source;
  std::vector<GainRow> gains;
  std::vector<GainWordRow> words;
  std::vector<JointRoleRow> roles;
  std::function<Controller(const Model&, const ControllerSpec&)> make;
  /// Adds how its torques answer to the joints' own coordinates and rates, which implicit joint forces take.
  std::function<void(const Model&, const ControllerSpec&, JointGains&)> gains_of_joints;
};

ControllerRow figure_eight_row();
ControllerRow computed_torque_row();

/// The table, in the order `contactbench list controllers` prints it.
std::span<const ControllerRow> controllers();
/// nullptr where there is none of that name.
const ControllerRow* find_controller(std::string_view name);

}  // namespace cb
