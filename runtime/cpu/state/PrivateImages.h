// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- PrivateImages.h - Pixels that threads select -----------------------===//
//
// A kernel that only selects, for each pixel, what is first by a key, may run
// its one bin on several threads: each lane has the images for itself, and the
// unit of what each pixel is. When the kernel ends, the first of all lanes' is
// selected, pixel by pixel; of equal keys that of the first unit, or of the
// last. The first lane has the state itself.
//
// Invariant: the units of a lane ascend, so that of equal keys it has the right
// one already.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CPU_PRIVATEIMAGES_H
#define PIKO_RUNTIME_CPU_PRIVATEIMAGES_H

#include "cpu/Kernel.h"

namespace piko::rt {

/// Of one selection.
struct PrivateImages {
  int64_t pixels = 0;
  struct Own {
    std::vector<Array<uint8_t>> images; ///< None of the first lane.
    Array<int32_t> units;
    std::vector<uint8_t *> pointers; ///< What generated code sees.
  };
  std::vector<Own> ofLanes;
};

/// Gives the lanes of a kernel that begins their images, or says that one
/// thread is to run it.
void beginSelections(pikort_pipeline &p, Kernel &kernel);
/// Selects among what they hold.
void endSelections(pikort_pipeline &p, Kernel &kernel);

} // namespace piko::rt

#endif // PIKO_RUNTIME_CPU_PRIVATEIMAGES_H
