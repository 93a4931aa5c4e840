#include "limits.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/time.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstring>
#include <fstream>

#include "linalg/stop.h"
#include "output/machine.h"

namespace cb {

namespace {

/// Its allocator takes a refusal for the end of the world.
#if defined(__SANITIZE_ADDRESS__)
constexpr bool address_sanitizer = true;
#else
constexpr bool address_sanitizer = false;
#endif

/// Why a stop was asked for: a signal's number (SIGALRM: the time), `memory`, or 0.
volatile std::sig_atomic_t cause = 0;
constexpr int memory = -1;

void ask_stop(int why) {
  if (cause == 0) cause = why;
  stop_asked.store(true, std::memory_order_relaxed);
}

/// Has `signal` ask for a stop; flags as of sigaction.
void catch_signal(int signal, int flags) {
  struct sigaction action = {};
  action.sa_handler = ask_stop;
  action.sa_flags = flags | SA_RESTART;  // a write that is under way goes on
  sigaction(signal, &action, nullptr);
}

/// Sends SIGALRM after `seconds`; 0: never.
void set_timer(double seconds) {
  constexpr double longest = 1e9, shortest = 1e-6;  // s: some decades; what the timer tells from never
  if (seconds > 0) seconds = std::clamp(seconds, shortest, longest);
  itimerval timer = {};
  timer.it_value.tv_sec = static_cast<time_t>(seconds);
  timer.it_value.tv_usec = static_cast<suseconds_t>(std::fmod(seconds, 1) * 1e6);
  setitimer(ITIMER_REAL, &timer, nullptr);
}

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

unsigned long bytes_of(double mb) {
  constexpr double most = 0x1p60, one = 1048576;
  return static_cast<unsigned long>(std::min(mb * one, most));
}

Limits::Limits(std::optional<double> time_s, std::optional<double> memory_mb) : time_s_(time_s), memory_mb_(memory_mb) {
  cause = 0;
  const int once = static_cast<int>(SA_RESETHAND);
  for (const int signal : {SIGINT, SIGTERM}) catch_signal(signal, once);
  struct sigaction hangup = {};
  if (sigaction(SIGHUP, nullptr, &hangup) == 0 && hangup.sa_handler != SIG_IGN) catch_signal(SIGHUP, once);
  if (!time_s_) return;
  catch_signal(SIGALRM, 0);
  set_timer(*time_s_);
}

void Limits::bound_memory() {
  if (address_sanitizer || !memory_mb_) return;
  const rlim_t data = data_size();
  if (data > 0) data_limit_before_ = limit_data(data + bytes_of(*memory_mb_));
}

void Limits::lift() {
  if (time_s_) set_timer(0);
  stop_asked = false;
  if (data_limit_before_) limit_data(*data_limit_before_);
  data_limit_before_.reset();
}

void Limits::look_at_memory(Clock::time_point now) {
  if (!memory_mb_ ||
      (++steps_since_memory_check_ < steps_between_memory_checks && now - memory_checked_ < time_between_memory_checks))
    return;
  steps_since_memory_check_ = 0;
  memory_checked_ = now;
  if (peak_memory_beyond(*memory_mb_)) ask_stop(memory);
}

Status Limits::status() const {
  if (cause == 0) return Status::ok;
  if (cause == memory) return Status::memory_limit;
  return cause == SIGALRM ? Status::time_limit : Status::interrupted;
}

std::string Limits::reason(Status status) const {
  switch (status) {
    case Status::interrupted:
      return fmt::format("stopped by signal {} ({})", int(cause), strsignal(cause));
    case Status::time_limit:
      return fmt::format("the time limit of {:g} s was reached", *time_s_);
    case Status::memory_limit:
      return memory_mb_ ? fmt::format("the memory limit of {:g} MB was reached", *memory_mb_) : "out of memory";
    default:
      return {};
  }
}

}  // namespace cb
