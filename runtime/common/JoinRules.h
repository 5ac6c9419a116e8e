// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- JoinRules.h - What the joins of all targets agree on ---------------===//
//
// Lineage order, and how a bin's primitives are cut into calls and units: rules
// that a result, or the shape of a launch, depends on. They are compiled for
// processors and for devices; how a target moves what it joins is its own.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_COMMON_JOINRULES_H
#define PIKO_RUNTIME_COMMON_JOINRULES_H

#include <stdint.h>

namespace piko::join {

/// Whether item i comes before item j of another stream; of equal keys the one
/// whose stream is the earlier one does. What a shorter key lacks is 0.
template <class Keys>
bool comesBefore(const Keys &a, int64_t i, const Keys &b, int64_t j,
                 bool isEarlier) {
  int32_t width = a.width < b.width ? b.width : a.width;
  for (int32_t w = 0; w < width; ++w) {
    uint64_t u = a.word(i, w), v = b.word(j, w);
    if (u != v)
      return u < v;
  }
  return isEarlier;
}

constexpr int64_t clamp(int64_t value, int64_t least, int64_t most) {
  return value < least ? least : most < value ? most : value;
}

/// Positions of a call to a Process of a list, of a bin that has `count`: as
/// many as the schedule's batch, or, if that is 0, all.
constexpr int64_t callSize(int64_t batch, int64_t count) {
  return clamp(batch > 0 ? batch : count, 1, UINT32_MAX);
}

/// Calls of that bin. One that has nothing is called once if it `runsEmpty`.
constexpr int64_t callCount(int64_t count, int64_t size, bool runsEmpty) {
  return count == 0 ? runsEmpty : (count + size - 1) / size;
}

/// Positions of a unit that a block of a GPU runs, where `blocks` of them fill
/// the device: as many as the schedule's tile split, if that is not 0.
constexpr int64_t blockUnitSize(int64_t tileSplit, int64_t positions,
                                int64_t blocks) {
  constexpr int64_t least = 64, most = 1024;
  int64_t share = positions / blocks;
  return tileSplit > 0
             ? tileSplit
             : clamp((share + least - 1) / least * least, least, most);
}

} // namespace piko::join

#endif // PIKO_RUNTIME_COMMON_JOINRULES_H
