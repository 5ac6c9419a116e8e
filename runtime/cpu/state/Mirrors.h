// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Mirrors.h - What a device sees of the host's memory ----------------===//

#ifndef PIKO_RUNTIME_CPU_MIRRORS_H
#define PIKO_RUNTIME_CPU_MIRRORS_H

#include "cpu/Kernel.h"

namespace piko::rt {

/// Where kernels run on an accelerator: puts memory that they reach in the
/// place of constants, buffers, sources and images; throws. For a frame, of
/// which the host touches nothing until it has ended, that is the device's own,
/// and copies are in the order of its stream. For the host's way it is the
/// host's, with copies of what is the device's.
void beginMirrors(pikort_pipeline &p, bool isFrame);
/// For a frame that the host repeats: the same for the host's way; throws.
void refillMirrors(pikort_pipeline &p);
/// Puts the host's memory back, with what kernels have written.
void endMirrors(pikort_pipeline &p);

/// Lets an accelerator read a kernel's units, or all of its input, whose
/// primitives are those of `from`; throws.
void shareHeader(pikort_pipeline &p, Kernel &kernel);
void shareUnits(pikort_pipeline &p, Kernel &kernel);
void shareInput(pikort_pipeline &p, Kernel &kernel, const Items &from);

} // namespace piko::rt

#endif // PIKO_RUNTIME_CPU_MIRRORS_H
