#include "output/machine.h"

#include <sys/resource.h>
#include <sys/utsname.h>

#include <cstdlib>
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

// What the system counts for this process holds what the one that started it had, when it did.
double most_memory_mb() {
  rusage usage;
  return getrusage(RUSAGE_SELF, &usage) == 0 ? static_cast<double>(usage.ru_maxrss) / 1024 : 0;
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
  const std::string kilobytes = field("/proc/self/status", "VmHWM", ':');
  return kilobytes.empty() ? most_memory_mb() : std::strtod(kilobytes.c_str(), nullptr) / 1024;
}

bool peak_memory_beyond(double mb) { return most_memory_mb() > mb && peak_memory_mb() > mb; }

}  // namespace cb
