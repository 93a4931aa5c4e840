#pragma once

#include <algorithm>
#include <chrono>

namespace cb {

/// The moment at which something that may take long is to give up.
class Deadline {
 public:
  Deadline() = default;  ///< never
  /// `limit_s` from now, wall clock; 0: never.
  explicit Deadline(double limit_s) : set_(limit_s > 0) {
    constexpr double years = 1e9;  // s; what the clock can count
    if (set_)
      end_ = Clock::now() +
             std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(std::min(limit_s, years)));
  }
  /// Reads the clock where there is a limit.
  bool passed() const { return set_ && Clock::now() > end_; }

 private:
  using Clock = std::chrono::steady_clock;
  bool set_ = false;
  Clock::time_point end_;
};

}  // namespace cb
