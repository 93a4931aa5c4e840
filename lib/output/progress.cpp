#include "output/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>

namespace cb {

Progress::Progress(bool wanted) : active_(wanted && isatty(STDERR_FILENO) == 1) {}

void Progress::print(Clock::time_point now, double t, double duration, int contacts) {
  next_ = now + interval;
  shown_ = true;
  const double spent = std::chrono::duration<double>(now - start_).count();
  const auto left = t > 0 ? std::lround(spent * (duration - t) / t) : 0;
  // A terminal that went away must not end the run.
  std::fputs(fmt::format("\r{:.3f} of {:g} s ({:.0f} %) at {:.3g} of real time, {} contacts, {}:{:02}:{:02} left\033[K",
                         t, duration, 100 * t / duration, spent > 0 ? t / spent : 0, contacts, left / 3600,
                         left / 60 % 60, left % 60)
                 .c_str(),
             stderr);
  std::fflush(stderr);
}

void Progress::clear() {
  if (shown_) std::fputs("\r\033[K", stderr);
  shown_ = false;
}

}  // namespace cb
