#pragma once

#include <string>

namespace cb {

/// The machine that a run was made on; nothing that names its owner.
struct Machine {
  std::string cpu;
  int cores = 0;
  std::string os;
};
Machine machine();

/// Largest resident memory of this process so far, MB (2^20 bytes).
double peak_memory_mb();

}  // namespace cb
