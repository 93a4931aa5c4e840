#pragma once

#include "cone/cone_workspace.h"

namespace cb {

/// Proximal points one after another (proximal_points.cpp) from the r, eta and s in `x`, which is overwritten by the
/// best answer met, or stays. Returns whether that is at rounding, as polish() does. `workspace` is prepared for
/// `program`.
bool go_by_points(const ConeProgram& program, const ConeOptions& options, ConeWorkspace& workspace, ConeSolution& x);

}  // namespace cb
