#pragma once

#include <vector>

#include "dynamics/model.h"

namespace cb {

/// Where a state is as seen from another one, as numbers that may be added and scaled: places by difference, free
/// bodies' (and free joints') turns as rotation vectors in the world from the start's orientation, joints by q,
/// velocities as they are.
void to_vector(const Model& model, const State& start, const State& state, std::vector<double>& x);
/// The state at x; poses and twists of links follow. `state.t` is left alone.
void from_vector(const Model& model, const State& start, const std::vector<double>& x, State& state);

/// Extrapolation to step 0 of results with n_1 < n_2 < ... equal steps that cross one interval, powers of h: Aitken and
/// Neville. results[j]: with n[j] steps. Afterwards `best`, `neighbour` and `before` are the last three of the
/// table's last row: of the order of their number, one less, two less; of fewer results the same again.
void extrapolate(const std::vector<std::vector<double>>& results, const std::vector<int>& n, std::vector<double>& best,
                 std::vector<double>& neighbour, std::vector<double>& before);

/// Largest distance of a body's points in two states, m, to first order: |dp| + radius |turn|; `radius`: per body, m.
double distance(const std::vector<double>& radius, const State& a, const State& b);
/// The same of their velocities, m/s.
double speed_difference(const std::vector<double>& radius, const State& a, const State& b);

}  // namespace cb
