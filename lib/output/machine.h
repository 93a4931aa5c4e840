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

/// Largest resident memory of this program so far, MB (2^20 bytes); nothing of the process that it was started in.
double peak_memory_mb();

/// Was that more than so many MB? In most cases without asking how much, which takes some 30 us.
bool peak_memory_beyond(double mb);

}  // namespace cb
