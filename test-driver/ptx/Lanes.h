// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Lanes.h - Handlers of instructions that work lane by lane ----------===//
//
// An operation is a struct with the types of its operands and of its result,
// and a static function `apply`. Registers of equal width are read and written
// in place, so that the compiler makes vectors of the loop over all lanes.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_TEST_DRIVER_PTX_LANES_H
#define PIKO_TEST_DRIVER_PTX_LANES_H

#include "ptx/Warp.h"

namespace piko::ptx {

/// Calls \p function for each lane of \p mask.
template <typename F> inline void forLanes(uint32_t mask, F function) {
  if (mask == allLanes) {
#pragma omp simd
    for (uint32_t lane = 0; lane < warpSize; ++lane)
      function(lane);
    return;
  }
  for (; mask; mask &= mask - 1)
    function(static_cast<uint32_t>(std::countr_zero(mask)));
}

/// The same, where what it does cannot be a vector.
template <typename F> inline void forEachLane(uint32_t mask, F function) {
  for (; mask; mask &= mask - 1)
    function(static_cast<uint32_t>(std::countr_zero(mask)));
}

template <typename Op> void unary(Warp &warp, const Instruction &it) {
  auto *result = warp.lanes<typename Op::Result>(it.result);
  const auto *a = warp.lanes<typename Op::A>(it.a);
  forLanes(warp.active,
           [=](uint32_t lane) { result[lane] = Op::apply(a[lane]); });
}

template <typename Op> void binary(Warp &warp, const Instruction &it) {
  auto *result = warp.lanes<typename Op::Result>(it.result);
  const auto *a = warp.lanes<typename Op::A>(it.a);
  const auto *b = warp.lanes<typename Op::B>(it.b);
  forLanes(warp.active,
           [=](uint32_t lane) { result[lane] = Op::apply(a[lane], b[lane]); });
}

template <typename Op> void ternary(Warp &warp, const Instruction &it) {
  auto *result = warp.lanes<typename Op::Result>(it.result);
  const auto *a = warp.lanes<typename Op::A>(it.a);
  const auto *b = warp.lanes<typename Op::B>(it.b);
  const auto *c = warp.lanes<typename Op::C>(it.c);
  forLanes(warp.active, [=](uint32_t lane) {
    result[lane] = Op::apply(a[lane], b[lane], c[lane]);
  });
}

/// The lanes of \p mask for which \p function holds.
template <typename F> inline uint32_t lanesWhere(uint32_t mask, F function) {
  uint32_t found = 0;
  if (mask == allLanes) {
    for (uint32_t lane = 0; lane < warpSize; ++lane)
      found |= static_cast<uint32_t>(function(lane)) << lane;
    return found;
  }
  forEachLane(mask, [&](uint32_t lane) {
    found |= static_cast<uint32_t>(function(lane)) << lane;
  });
  return found;
}

/// The value of a register of any width, extended.
inline uint64_t readLane(const Warp &warp, Operand from, uint32_t lane,
                         bool isSigned = false) {
  switch (from.bytes) {
  case 2: {
    uint16_t value = warp.lanes<uint16_t>(from)[lane];
    return isSigned ? static_cast<uint64_t>(static_cast<int16_t>(value))
                    : value;
  }
  case 4: {
    uint32_t value = warp.lanes<uint32_t>(from)[lane];
    return isSigned ? static_cast<uint64_t>(static_cast<int32_t>(value))
                    : value;
  }
  default:
    return warp.lanes<uint64_t>(from)[lane];
  }
}

inline void writeLane(const Warp &warp, Operand to, uint32_t lane,
                      uint64_t value) {
  switch (to.bytes) {
  case 2:
    warp.lanes<uint16_t>(to)[lane] = static_cast<uint16_t>(value);
    break;
  case 4:
    warp.lanes<uint32_t>(to)[lane] = static_cast<uint32_t>(value);
    break;
  default:
    warp.lanes<uint64_t>(to)[lane] = value;
  }
}

} // namespace piko::ptx

#endif // PIKO_TEST_DRIVER_PTX_LANES_H
