#pragma once

#include <string>

#include "output/summary.h"

namespace cb {

/// What this program was made from.
Versions versions();
/// One line for --version.
std::string version_line();

}  // namespace cb
