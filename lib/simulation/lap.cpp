#include "simulation/lap.h"

#ifdef __x86_64__
#include <cpuid.h>
#endif

namespace cb {

namespace {

using Clock = std::chrono::steady_clock;

double seconds(Clock::duration time) { return std::chrono::duration<double>(time).count(); }

#ifdef __x86_64__

bool counts_evenly() {
  constexpr unsigned power = 0x80000007, invariant = 1U << 8;  // the same rate in all states of the processor
  unsigned a = 0, b = 0, c = 0, d = 0;
  return __get_cpuid(power, &a, &b, &c, &d) != 0 && (d & invariant) != 0;
}

struct Moment {
  Clock::time_point time;
  std::uint64_t count;
};

// Time and count at once, as nearly as some tries give it: something else may run between the two.
Moment read_both() {
  constexpr int tries = 8;
  Moment best{};
  auto least = Clock::duration::max();
  for (int k = 0; k < tries; ++k) {
    const auto before = Clock::now();
    const std::uint64_t count = __rdtsc();
    const auto took = Clock::now() - before;
    if (took >= least) continue;
    least = took;
    best = {before + took / 2, count};
  }
  return best;
}

// s; measured, to some 1e-4.
double time_of_a_count() {
  constexpr double long_enough = 3e-4;  // s
  const Moment begin = read_both();
  Moment end = begin;
  while (!(seconds(end.time - begin.time) > long_enough)) end = read_both();
  return seconds(end.time - begin.time) / static_cast<double>(end.count - begin.count);
}

#else

bool counts_evenly() { return false; }
double time_of_a_count() { return 0; }

#endif

}  // namespace

Lap::Lap() {
  static const bool even = counts_evenly();
  static const double unit = even ? time_of_a_count() : seconds(Clock::duration(1));
  counts_ = even;
  unit_ = unit;
}

}  // namespace cb
