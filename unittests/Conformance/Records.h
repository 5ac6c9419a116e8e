//===- Records.h - What pipelines and their hosts share -------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_CONFORMANCE_RECORDS_H
#define PIKO_CONFORMANCE_RECORDS_H

#include <cstdint>

namespace conformance {

/// Something at a pixel.
struct Dot {
  int32_t x, y, value;
};

/// A dot that moves, so many hops more.
struct Walker {
  int32_t x, y, value, left;
};

/// What came to a pixel, in its order.
struct Trace {
  uint64_t hash = 7;
  int32_t count = 0, last = -1;

  constexpr void add(int32_t value) {
    hash = (hash ^ static_cast<uint32_t>(value)) * 1099511628211u;
    ++count;
    last = value;
  }
  friend bool operator==(const Trace &, const Trace &) = default;
};

/// Something at a position.
struct Item {
  int32_t index;
  float x, y, z;
  int32_t kind;
};

struct Nearest {
  float z = 1000;
  int32_t index = -1;
  friend bool operator==(const Nearest &, const Nearest &) = default;
};

/// Pixels of a bin in each dimension, for stages that say nothing else.
inline constexpr int binExtent = 8;
/// Primitives of a call of the stage that takes batches.
inline constexpr int batchSize = 5;
/// Where Hops goes next; stays in the domain.
constexpr Walker hop(const Walker &w, int32_t width, int32_t height) {
  return {(w.x + 5) % width, (w.y + 3) % height, w.value * 3 + 1, w.left - 1};
}

} // namespace conformance

#endif // PIKO_CONFORMANCE_RECORDS_H
