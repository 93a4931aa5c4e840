#pragma once

#include <chrono>
#include <cstdint>
#ifdef __x86_64__
#include <x86intrin.h>
#endif

namespace cb {

/// Adds the time from one call to the next to the parts of a step in turn. By the processor's counter where that counts
/// evenly: asking the system for the time takes more than twice as long, and a tenth of a cheap step.
class Lap {
 public:
  Lap();
  /// A step.
  void begin() { started_ = last_ = now(); }
  /// What was done since the last part is no part.
  void leave_out() { last_ = now(); }
  /// `part`: s
  void add_to(double& part) {
    const std::uint64_t t = now();
    part += unit_ * static_cast<double>(t - last_);
    last_ = t;
  }
  /// s, from the step's beginning to its last part's end.
  double total() const { return unit_ * static_cast<double>(last_ - started_); }

 private:
  std::uint64_t now() const {
#ifdef __x86_64__
    if (counts_) return __rdtsc();
#endif
    return static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count());
  }

  bool counts_;  // else the system's time is asked for
  double unit_;  // s
  std::uint64_t started_ = 0, last_ = 0;
};

}  // namespace cb
