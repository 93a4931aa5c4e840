#pragma once

#include <chrono>

namespace cb {

/// One line on a terminal that says how far a run is; silent where standard error is no terminal.
class Progress {
 public:
  using Clock = std::chrono::steady_clock;

  explicit Progress(bool wanted);
  /// Cheap where it is not yet time for the next line.
  void update(Clock::time_point now, double t, double duration, int contacts) {
    if (active_ && now >= next_) print(now, t, duration, contacts);
  }
  /// Wipes the line.
  void clear();

  static constexpr std::chrono::milliseconds quiet_start{300}, interval{100};

 private:
  void print(Clock::time_point now, double t, double duration, int contacts);

  bool active_, shown_ = false;
  Clock::time_point start_ = Clock::now(), next_ = start_ + quiet_start;
};

}  // namespace cb
