#include "limits.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <cstring>
#include <fstream>

#include "output/machine.h"

namespace cb {

namespace {

/// Its allocator takes a refusal for the end of the world.
#if defined(__SANITIZE_ADDRESS__)
constexpr bool address_sanitizer = true;
#else
constexpr bool address_sanitizer = false;
#endif

volatile std::sig_atomic_t caught = 0;

void catch_signal(int signal) { caught = signal; }

/// Private writable memory of this process, bytes: what RLIMIT_DATA is compared with. 0 where the system does not say.
rlim_t data_size() {
  std::ifstream file("/proc/self/status");
  for (std::string word; file >> word;)
    if (word == "VmData:") {
      rlim_t kilobytes = 0;
      file >> kilobytes;
      return kilobytes * 1024;
    }
  return 0;
}

/// Sets the soft limit on private memory and returns the one before.
rlim_t limit_data(rlim_t bytes) {
  rlimit limit = {RLIM_INFINITY, RLIM_INFINITY};
  getrlimit(RLIMIT_DATA, &limit);
  const rlim_t before = limit.rlim_cur;
  limit.rlim_cur = std::min(bytes, limit.rlim_max);
  setrlimit(RLIMIT_DATA, &limit);
  return before;
}

}  // namespace

Limits::Limits(std::optional<double> time_s, std::optional<double> memory_mb) : time_s_(time_s), memory_mb_(memory_mb) {
  struct sigaction action = {};
  action.sa_handler = catch_signal;
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  for (const int signal : {SIGINT, SIGTERM}) sigaction(signal, &action, nullptr);
  struct sigaction hangup = {};
  if (sigaction(SIGHUP, nullptr, &hangup) == 0 && hangup.sa_handler != SIG_IGN) sigaction(SIGHUP, &action, nullptr);
}

void Limits::bound_memory() {
  if (address_sanitizer || !memory_mb_) return;
  const rlim_t data = data_size();
  if (data > 0) data_limit_before_ = limit_data(data + static_cast<rlim_t>(*memory_mb_ * 1048576));
}

void Limits::lift() {
  if (data_limit_before_) limit_data(*data_limit_before_);
  data_limit_before_.reset();
}

Status Limits::check(Clock::time_point now) {
  if (caught != 0) return Status::interrupted;
  if (time_s_ && std::chrono::duration<double>(now - start_).count() >= *time_s_) return Status::time_limit;
  if (memory_mb_ && (++steps_since_memory_check_ >= steps_between_memory_checks ||
                     now - memory_checked_ >= time_between_memory_checks)) {
    steps_since_memory_check_ = 0;
    memory_checked_ = now;
    if (peak_memory_mb() > *memory_mb_) return Status::memory_limit;
  }
  return Status::ok;
}

std::string Limits::reason(Status status) const {
  switch (status) {
    case Status::interrupted:
      return fmt::format("stopped by signal {} ({})", int(caught), strsignal(caught));
    case Status::time_limit:
      return fmt::format("the time limit of {:g} s was reached", *time_s_);
    case Status::memory_limit:
      return memory_mb_ ? fmt::format("the memory limit of {:g} MB was reached", *memory_mb_) : "out of memory";
    default:
      return {};
  }
}

}  // namespace cb
