#pragma once

#include <optional>

#include "scenario/scenario.h"

namespace cb {

/// Largest eigenvalue, by magnitude, of h A at the scenario's initial state, where A = -d qdd / d qd of the controlled
/// robots out of contact, motors without limits: M^-1 (velocity gains + damping) and what feed-forward leaves of them.
/// The step multiplies a rate's error by 1 - h A: beyond 2 it grows, whatever the method. None without a controller.
std::optional<double> largest_eigenvalue(const Scenario& scenario, double h);
inline constexpr double explicit_limit = 2;

}  // namespace cb
