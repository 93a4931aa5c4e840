#include "output/progress.h"

#include <fcntl.h>
#include <stdlib.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstdio>
#include <string>

using namespace cb;

namespace {

/// Standard error is a terminal while it lives.
class Terminal {
 public:
  Terminal() : end_(posix_openpt(O_RDWR | O_NOCTTY)), before_(dup(STDERR_FILENO)) {
    if (end_ < 0 || grantpt(end_) != 0 || unlockpt(end_) != 0) return;
    const int terminal = open(ptsname(end_), O_RDWR | O_NOCTTY);
    if (terminal < 0) return;
    works = dup2(terminal, STDERR_FILENO) >= 0;
    close(terminal);
  }
  ~Terminal() {
    dup2(before_, STDERR_FILENO);
    close(before_);
    close(end_);
  }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  /// What was written since the last time.
  std::string said() const {
    std::fputc('\a', stderr);  // its end: what is read at once may be a part of it
    std::string text;
    for (char c = 0; read(end_, &c, 1) == 1 && c != '\a';) text += c;
    return text;
  }

  bool works = false;

 private:
  int end_, before_;
};

}  // namespace

TEST_CASE("a terminal is told how far a run is and its rate and the time that is left at the pace so far", "[output]") {
  const Terminal terminal;
  if (!terminal.works) {
    WARN("no terminals here");
    return;
  }
  // Before: what comes after may take as long as it likes.
  const Progress::Clock::time_point start = Progress::Clock::now();
  Progress progress(true);
  // Nothing of a run that may be over at once, nor again before a tenth of a second.
  progress.update(start + Progress::quiet_start / 3, 0.5, 2, 7);
  CHECK(terminal.said().empty());
  progress.update(start + std::chrono::seconds(3700), 0.5, 2, 7);
  const std::string line = terminal.said();
  CHECK(line.find("0.500 of 2 s (25 %) at 0.000135 of real time, 7 contacts, 3:05:00 left") != std::string::npos);
  progress.update(start + std::chrono::seconds(3700) + Progress::interval / 2, 0.5, 2, 7);
  CHECK(terminal.said().empty());
  progress.update(start + std::chrono::seconds(3800), 0, 2, 7);
  CHECK(terminal.said().find("0 %) at 0 of real time, 7 contacts, 0:00:00 left") != std::string::npos);
  progress.clear();
  CHECK(terminal.said() == "\r\033[K");
  Progress quiet(false);
  quiet.update(start + std::chrono::seconds(3900), 0.5, 2, 7);
  quiet.clear();
  CHECK(terminal.said().empty());
}
