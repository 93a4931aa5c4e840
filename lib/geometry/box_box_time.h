#pragma once

#include "geometry/advancement.h"

namespace cb {

/// The time of contact of two boxes (time_of_contact.cpp says which features are followed).
double box_to_box(const Shape& shape_a, const Motion& motion_a, const Shape& shape_b, const Motion& motion_b,
                  const Goal& goal);

}  // namespace cb
