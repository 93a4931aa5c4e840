#pragma once

#include <cstring>

namespace cb {

/// Four doubles, a register of the machines that the program is built for: of wider ones the compiler makes memory
/// there.
typedef double Lanes __attribute__((vector_size(32)));
/// The masks of their comparisons.
typedef long long LaneMask __attribute__((vector_size(32)));

inline constexpr int lane_count = 4;

inline void load(const double* p, Lanes& x) { std::memcpy(&x, __builtin_assume_aligned(p, 32), sizeof x); }
inline void store(const Lanes& x, double* p) { std::memcpy(__builtin_assume_aligned(p, 32), &x, sizeof x); }

/// The largest lane, none of which may be NaN.
inline double largest_lane(Lanes x) {
  const Lanes y = __builtin_shufflevector(x, x, 2, 3, 0, 1);
  x = x > y ? x : y;
  return x[0] > x[1] ? x[0] : x[1];
}

}  // namespace cb
