#include "scenario/perturb.h"

#include <algorithm>
#include <random>

namespace cb {

namespace {

/// In [-1, 1); the distributions of <random> differ between libraries, the engine does not.
double uniform(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1p-52 - 1; }

Vec3 direction(std::mt19937_64& random) {
  for (;;) {  // ends with probability 1/2 at each turn
    const double x = uniform(random), y = uniform(random), z = uniform(random);
    const Vec3 d(x, y, z);
    if (const double length = d.norm(); length <= 1 && length > 1e-3) return d / length;
  }
}

}  // namespace

void perturb(Scenario& scenario, double size, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<double> reach(scenario.model.bodies.size(), 0.0);
  for (const Shape& shape : scenario.shapes)
    if (shape.body >= 0)
      reach[shape.body] = std::max(reach[shape.body], shape.bounding_radius() + shape.local.p.norm());
  for (std::size_t b = 0; b < reach.size(); ++b) {
    if (scenario.model.bodies[b].tree >= 0) continue;
    Pose& pose = scenario.initial.pose[b];
    pose.p += size * direction(random);
    const Vec3 axis = direction(random);
    if (reach[b] > 0) pose.q = (Quat(Eigen::AngleAxisd(size / reach[b], axis)) * pose.q).normalized();
  }
}

}  // namespace cb
