#pragma once

/// Has this processor, and the system that saves its registers, what a level of x86-64 asks (2, 3)? By the instructions
/// of each level that compilers know to ask for; no processor with these lacks the others.
inline bool has_level(int level) {
#ifdef __x86_64__
  __builtin_cpu_init();
  const bool second = __builtin_cpu_supports("sse4.2") && __builtin_cpu_supports("popcnt");
  const bool third = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi") &&
                     __builtin_cpu_supports("bmi2");
  return (level < 2 || second) && (level < 3 || third);
#else
  return level == 0;
#endif
}
