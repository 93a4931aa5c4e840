#pragma once

#include <string_view>

namespace cb::test {

/// Hands bytes to the loader of scenes, or where they begin like a URDF file (`<robot`) to its reader of robots. What
/// it refuses it must refuse by an InputError of one line; everything else that is thrown passes through.
void read_as_scene(std::string_view bytes);

/// Hands bytes to the readers of stored problems: Matrix Market, FCLIB (HDF5), else Siconos text, taken as an LCP and
/// as a friction problem. What they refuse they must refuse by a FileError of one line.
void read_as_problem(std::string_view bytes);

}  // namespace cb::test
