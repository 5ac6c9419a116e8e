// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Clock.h - What time costs little to ask for ------------------------===//
//
// Ticks of a clock of unknown rate: a run compares them with the system's.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_COMMON_CLOCK_H
#define PIKO_RUNTIME_COMMON_CLOCK_H

#include <chrono>
#include <cstdint>

#ifdef __x86_64__
#include <x86intrin.h>
#endif

namespace piko::rt {

#ifdef __x86_64__
/// The time stamp counter, which runs at one rate on all that have AVX2.
inline int64_t ticks() { return static_cast<int64_t>(__rdtsc()); }
constexpr double defaultTickRate = 2.5e6; // in a millisecond
#else
inline int64_t ticks() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}
constexpr double defaultTickRate = 1e6;
#endif

} // namespace piko::rt

#endif // PIKO_RUNTIME_COMMON_CLOCK_H
