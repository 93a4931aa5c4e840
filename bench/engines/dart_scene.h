#pragma once

#include <memory>
#include <string>
#include <vector>

#include "frame/plain_scene.h"

#define DART_SCENE __attribute__((visibility("default")))

namespace dart_scene {

namespace plain = cb::plain;

struct Setting {
  double step;
  bool pgs, fall_back;
  int iterations;
  std::vector<double> mu, restitution;  ///< of each shape
  bool keep_problems;                   ///< will problem() be asked for?
};

DART_SCENE std::unique_ptr<plain::World> make_world(const plain::Scene& scene, const Setting& setting);

DART_SCENE std::string version();

}  // namespace dart_scene
