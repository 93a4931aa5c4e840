#include <cmath>

#include "scenario/scenario.h"

namespace cb {

Vec3 Gravity::at(double t) const {
  Vec3 g = constant;
  for (int axis = 0; axis < 3; ++axis)
    if (harmonic[axis].amplitude != 0)
      g[axis] += harmonic[axis].amplitude * std::cos(harmonic[axis].frequency * t + harmonic[axis].phase);
  return g;
}

}  // namespace cb
