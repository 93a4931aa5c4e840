#pragma once

#include <cstring>
#ifdef __FMA__
#include <immintrin.h>
#endif

namespace cb {

/// Four doubles that the compiler maps to whatever vector registers the machine has: one register of the machines that
/// the program is built for; of wider ones it makes memory there.
typedef double Pack __attribute__((vector_size(32)));
inline constexpr int pack_size = 4;

inline void load(const double* p, Pack& x) { std::memcpy(&x, p, sizeof x); }
inline void store(const Pack& x, double* p) { std::memcpy(p, &x, sizeof x); }
/// The same at places that start a pack.
inline void load_aligned(const double* p, Pack& x) {
  load(static_cast<const double*>(__builtin_assume_aligned(p, 32)), x);
}
inline void store_aligned(const Pack& x, double* p) { store(x, static_cast<double*>(__builtin_assume_aligned(p, 32))); }

/// x + a b, rounded once on x86-64 from level v3 on, else twice: the compiler is told to fuse nothing, since what it
/// would choose depends on its version and tuning; what is written out is the same in every build for an instruction
/// set.
inline void add_fused(const Pack& a, const Pack& b, Pack& x) {
#ifdef __FMA__
  x = _mm256_fmadd_pd(a, b, x);
#else
  x += a * b;
#endif
}
/// x - a b.
inline void subtract_fused(const Pack& a, const Pack& b, Pack& x) {
#ifdef __FMA__
  x = _mm256_fnmadd_pd(a, b, x);
#else
  x -= a * b;
#endif
}
inline void add_fused(const Pack& a, double b, Pack& x) { add_fused(a, Pack{b, b, b, b}, x); }
inline void subtract_fused(const Pack& a, double b, Pack& x) { subtract_fused(a, Pack{b, b, b, b}, x); }

/// The largest of four, none of which may be NaN.
inline double largest_of(Pack x) {
  const Pack y = __builtin_shufflevector(x, x, 2, 3, 0, 1);
  x = x > y ? x : y;
  return x[0] > x[1] ? x[0] : x[1];
}

}  // namespace cb
