#pragma once

// A scene in Simbody, in plain numbers: its headers are not C++20, so that what includes them is built by itself.

#include <memory>
#include <string>
#include <vector>

#include "frame/plain_scene.h"

namespace simbody {

namespace plain = cb::plain;

struct Setting {
  bool rigid, pgs;
  double stiffness, dissipation, transition_speed, accuracy, constraint_tolerance;
};

std::unique_ptr<plain::World> make_world(const plain::Scene& scene, const Setting& setting);

std::string version();

}  // namespace simbody
