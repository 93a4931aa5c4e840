#include "simulation/lap.h"

#include <catch2/catch.hpp>
#include <chrono>

using namespace cb;
using Clock = std::chrono::steady_clock;

namespace {

double seconds(Clock::duration time) { return std::chrono::duration<double>(time).count(); }

Clock::time_point wait(double time) {
  const auto begin = Clock::now();
  while (seconds(Clock::now() - begin) < time) {
  }
  return Clock::now();
}

}  // namespace

TEST_CASE("parts of a step have the time that the system's clock says", "[lap]") {
  constexpr double near = 2e-3;  // -
  Lap lap;
  double first = 0, second = 0;
  const auto before = Clock::now();
  lap.begin();
  const auto begun = Clock::now();
  auto done = wait(5e-3);
  lap.add_to(first);
  CHECK(first >= (1 - near) * seconds(done - begun));
  CHECK(first <= (1 + near) * seconds(Clock::now() - before));
  wait(3e-3);
  const auto left_out = Clock::now();
  lap.leave_out();
  done = wait(4e-3);
  lap.add_to(second);
  lap.add_to(first);
  CHECK(second >= (1 - near) * 4e-3);
  CHECK(second <= (1 + near) * seconds(Clock::now() - left_out));
  CHECK(lap.total() >= (1 - near) * seconds(done - begun));
  CHECK(lap.total() <= (1 + near) * seconds(Clock::now() - before));
  CHECK(first + second <= lap.total() - (1 - near) * 3e-3);
}
