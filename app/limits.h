#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "contact/problem.h"

namespace cb {

/// What may end a run between two steps: a signal (SIGINT, SIGTERM, SIGHUP), the time, the memory.
class Limits {
 public:
  using Clock = std::chrono::steady_clock;

  /// Time runs from here on. Signals are caught from here on too; a second one kills the program.
  Limits(std::optional<double> time_s, std::optional<double> memory_mb);
  ~Limits() { lift(); }
  Limits(const Limits&) = delete;
  Limits& operator=(const Limits&) = delete;

  /// Has the system refuse a single step that asks for much more than the limit, which check() would see too late: it
  /// ends in bad_alloc. Private memory counts from here on.
  void bound_memory();
  /// ok, interrupted, time_limit or memory_limit. Cheap: memory is looked at now and then.
  Status check(Clock::time_point now);
  /// One line for a status that check() returned.
  std::string reason(Status status) const;

  /// Gives back the memory that was kept from the process, so that what is left to do can be done.
  void lift();

  Clock::time_point start() const { return start_; }

  static constexpr int steps_between_memory_checks = 256;
  static constexpr std::chrono::milliseconds time_between_memory_checks{20};

 private:
  Clock::time_point start_ = Clock::now(), memory_checked_ = start_;
  std::optional<double> time_s_, memory_mb_;
  int steps_since_memory_check_ = 0;
  std::optional<unsigned long> data_limit_before_;  // bytes
};

}  // namespace cb
