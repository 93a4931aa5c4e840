#pragma once

// A scene in Siconos, in plain numbers: its headers are not C++20, so that what includes them is built by itself.

#include <memory>

#include "frame/plain_scene.h"

namespace siconos_scene {

namespace plain = cb::plain;

struct Setting {
  double step, theta, tolerance, newton_tolerance;
  double margin;  ///< share of a shape's least half length by which it is smaller for Bullet
  int iterations, newton_iterations;
  double gravity[3];   ///< m/s^2, in the step before the first
  bool keep_problems;  ///< will problem() be asked for?
};

std::unique_ptr<plain::World> make_world(const plain::Scene& scene, const Setting& setting);

}  // namespace siconos_scene
