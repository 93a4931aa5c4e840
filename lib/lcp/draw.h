#pragma once

#include <cstdint>

namespace cb {

/// A well mixed 64-bit number for each x (S. Vigna, splitmix64).
inline std::uint64_t splitmix64(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

/// Pseudo-random number in [0, 1) that depends on nothing but its arguments.
inline double draw(unsigned seed, unsigned i) {
  return static_cast<double>(splitmix64(std::uint64_t(seed) << 32 | i) >> 11) * 0x1p-53;
}

}  // namespace cb
