#pragma once

#include <cstring>

namespace cb {

/// Four doubles that the compiler maps to whatever vector registers the machine has.
typedef double Pack __attribute__((vector_size(32)));
inline constexpr int pack_size = 4;

inline void load(const double* p, Pack& x) { std::memcpy(&x, p, sizeof x); }
inline void store(const Pack& x, double* p) { std::memcpy(p, &x, sizeof x); }

}  // namespace cb
