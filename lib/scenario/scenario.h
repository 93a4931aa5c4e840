#pragma once

#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "control/controller.h"
#include "dynamics/model.h"
#include "geometry/shapes.h"

namespace cb {

/// amplitude cos(frequency t + phase) on one axis, added to the constant part.
struct Harmonic {
  double amplitude = 0;  ///< m/s^2
  double frequency = 0;  ///< rad/s
  double phase = 0;      ///< rad
};
struct Gravity {
  Vec3 constant{0, -9.8, 0};  ///< m/s^2
  Harmonic harmonic[3];
  bool varies() const { return harmonic[0].amplitude != 0 || harmonic[1].amplitude != 0 || harmonic[2].amplitude != 0; }
  Vec3 at(double t) const;
};

/// A constant force at a body's centre of mass in the steps that start in [from, to).
struct Force {
  int body = 0;
  Vec3 force = Vec3::Zero();  ///< N, world
  double from = 0, to = 0;    ///< s
};

/// Contact law of a declared pair of shapes.
struct PairLaw {
  double mu = 0;
  double restitution = 0;
};

/// Laws of the declared pairs of shapes. Kept by group, so that an array of n bodies costs n entries and not n^2:
/// shapes that every pair element of the file treats alike (the same set of selectors matches them) share a group.
struct PairLaws {
  std::vector<int> group;  ///< per shape: index of its group
  int groups = 0;
  std::vector<int> index;     ///< groups x groups, symmetric: index into laws, -1 where no pair is declared
  std::vector<PairLaw> laws;  ///< in the file's order; --friction and --restitution override all of them

  /// The law of two shapes in either order, nullptr where they pass through each other. O(1).
  const PairLaw* find(int shape_i, int shape_j) const {
    const int law = index[group[shape_i] * groups + group[shape_j]];
    return law < 0 ? nullptr : &laws[law];
  }
};

/// What the scene's errors are measured against.
enum class ReferenceKind { analytic, certified, missing };
struct Reference {
  ReferenceKind kind = ReferenceKind::missing;
  std::string name;   ///< analytic: which closed form (lib/evaluation), e.g. "sliding_box"
  std::string where;  ///< and where that stands: "file:line:column"
};

/// What a scenario says of a parameter, for people: `check` prints it.
struct ParameterNote {
  std::string takes;          ///< "a number, at least 0", "one of: steady, rest"
  std::string unit;           ///< empty where it has none
  std::string default_value;  ///< as text
  std::string description;
};

/// A scene, checked and complete: everything a run needs but the method.
struct Scenario {
  std::string name;                ///< the file's name without .xml
  std::string file;                ///< as it was found
  std::string title;               ///< one line
  std::vector<std::string> files;  ///< all that were read: `file`, then those of robots, in the order of the scene
  Model model;
  State initial;
  std::vector<Shape> shapes;
  PairLaws pairs;
  Gravity gravity;
  std::vector<Force> forces;
  std::vector<ControllerSpec> controllers;  ///< their torques add up
  double step = 1e-3;                       ///< s
  double duration = 1;                      ///< s
  double rotate_cone = 0;                   ///< rad, turns t1, t2 about the normal
  std::optional<int> k;                     ///< ap: edges of the friction polygon this scene asks for
  std::optional<bool> compression_bound;
  bool implicit_joints = false;  ///< are joint forces those of the end of a step (dynamics/implicit_joints.h)?
  Reference reference;
  /// Values in force of the parameters the scenario declares, after --set, in the file's order (numbers or words as
  /// text).
  std::vector<std::pair<std::string, std::string>> parameters;
  std::vector<std::string> left_out;           ///< of robots' files: what a simulation does not use, for people
  std::vector<ParameterNote> parameter_notes;  ///< one for each of `parameters`

  /// Do these two shapes meet: is their pair declared, and do they move apart from each other?
  bool can_touch(int i, int j) const {
    const int body = shapes[static_cast<std::size_t>(i)].body;
    return pairs.find(i, j) != nullptr && (body < 0 || body != shapes[static_cast<std::size_t>(j)].body);
  }
};

/// Bad input: what() is the one message with file, line, column and remedy.
struct InputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// name=value pairs from --set; a name the scenario does not declare is an InputError.
using Overrides = std::vector<std::pair<std::string, std::string>>;

/// Reads, validates and completes a scenario. Throws InputError.
Scenario load_scenario(const std::string& path, const Overrides& overrides);

/// Finds a scenario: `name` as a path; else among the scenes that come with the program (beside the installed or built
/// program). Throws InputError, which lists the scenes there are.
std::string find_scenario(const std::string& name);
/// The scenes that come with the program: file paths, sorted.
std::vector<std::string> bundled_scenarios();

}  // namespace cb
