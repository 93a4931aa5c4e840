#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "contact/problem.h"

namespace cb {

/// Bytes of so many MB; what no memory reaches where they are more than a number of bytes can be.
unsigned long bytes_of(double mb);

/// What may end a computation from outside: a signal (SIGINT, SIGTERM, SIGHUP), the time, the memory. Each asks for a
/// stop, which poll_stop() (linalg/stop.h) hears wherever it stands.
class Limits {
 public:
  using Clock = std::chrono::steady_clock;

  /// Time runs from here on. Signals are caught from here on too; a second one kills the program. One object at a time.
  Limits(std::optional<double> time_s, std::optional<double> memory_mb);
  ~Limits() { lift(); }
  Limits(const Limits&) = delete;
  Limits& operator=(const Limits&) = delete;

  /// Has the system refuse at once what is asked for far beyond the limit, within a step too: it ends in bad_alloc.
  /// Private memory counts from here on.
  void bound_memory();
  /// Asks for a stop where more memory is in use than the limit. Cheap: looks now and then.
  void look_at_memory(Clock::time_point now);
  /// interrupted, time_limit or memory_limit: why a stop was asked for, the first reason; ok where it was not.
  Status status() const;
  /// One line for a status that ends a run.
  std::string reason(Status status) const;

  /// Ends all limits and takes the stop back, so that what is left to do can be done; status() stays.
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
