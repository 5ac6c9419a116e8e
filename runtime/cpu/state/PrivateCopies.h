// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- PrivateCopies.h - Reductions without locks -------------------------===//
//
// A kernel that changes a field of a buffer or an image by operations of one
// kind alone, which commute and associate, need not lock: each lane has a copy
// of its own, and what copies hold is combined with the state when the kernel
// ends. The first lane has the state itself.
//
// Invariant: between launches, a copy holds the identity of the operation
// everywhere, and no run of it is dirty.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CPU_PRIVATECOPIES_H
#define PIKO_RUNTIME_CPU_PRIVATECOPIES_H

#include "cpu/Kernel.h"

namespace piko::rt {

/// Of one reduction.
struct PrivateCopies {
  int64_t records = 0, runs = 0;
  struct Copy {
    Array<uint8_t> data;  ///< None of the first lane.
    Array<uint8_t> dirty; ///< Of the first lane, never read.
  };
  std::vector<Copy> ofLanes;
};

/// Gives the lanes of a kernel that begins their copies.
void beginReductions(pikort_pipeline &p, Kernel &kernel);
/// Combines what they hold with the state.
void endReductions(pikort_pipeline &p, Kernel &kernel);

} // namespace piko::rt

#endif // PIKO_RUNTIME_CPU_PRIVATECOPIES_H
