#include "output/machine.h"

#include <sys/resource.h>
#include <sys/utsname.h>

#include <fstream>
#include <thread>

namespace cb {

namespace {

/// What stands after `key` and the next separator on its first line of a file, without quotes; empty where it is
/// nowhere.
std::string field(const char* path, const std::string& key, char separator) {
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (!line.starts_with(key)) continue;
    const std::size_t at = line.find(separator);
    if (at == std::string::npos) continue;
    const std::size_t first = line.find_first_not_of(" \t\"", at + 1), last = line.find_last_not_of(" \t\"");
    if (first != std::string::npos) return line.substr(first, last - first + 1);
  }
  return {};
}

}  // namespace

Machine machine() {
  Machine here;
  here.cpu = field("/proc/cpuinfo", "model name", ':');
  if (here.cpu.empty()) here.cpu = "unknown";
  here.cores = static_cast<int>(std::thread::hardware_concurrency());
  here.os = field("/etc/os-release", "PRETTY_NAME", '=');
  utsname system;
  if (uname(&system) == 0)
    here.os +=
        (here.os.empty() ? "" : ", ") + std::string(system.sysname) + " " + system.release + " " + system.machine;
  return here;
}

double peak_memory_mb() {
  rusage usage;
  return getrusage(RUSAGE_SELF, &usage) == 0 ? static_cast<double>(usage.ru_maxrss) / 1024 : 0;
}

}  // namespace cb
