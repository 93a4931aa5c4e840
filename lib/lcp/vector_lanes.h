#pragma once

#include <cstring>

namespace cb {

/// Eight doubles that the compiler maps to whatever vector registers the machine has.
typedef double Lanes __attribute__((vector_size(64)));
/// The masks of their comparisons.
typedef long long LaneMask __attribute__((vector_size(64)));

inline constexpr int lane_count = 8;

inline void load(const double* p, Lanes& x) { std::memcpy(&x, __builtin_assume_aligned(p, 64), sizeof x); }
inline void store(const Lanes& x, double* p) { std::memcpy(__builtin_assume_aligned(p, 64), &x, sizeof x); }

/// The largest lane, none of which may be NaN.
inline double largest_lane(Lanes x) {
  Lanes y = __builtin_shufflevector(x, x, 4, 5, 6, 7, 0, 1, 2, 3);
  x = x > y ? x : y;
  y = __builtin_shufflevector(x, x, 2, 3, 0, 1, 6, 7, 4, 5);
  x = x > y ? x : y;
  return x[0] > x[1] ? x[0] : x[1];
}

}  // namespace cb
