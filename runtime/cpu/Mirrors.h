// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Mirrors.h - What a device sees of the host's memory ----------------===//

#ifndef PIKO_RUNTIME_CPU_MIRRORS_H
#define PIKO_RUNTIME_CPU_MIRRORS_H

#include "cpu/Kernel.h"

namespace piko::rt {

/// Where kernels run on an accelerator: copies constants, bound buffers and
/// sources to memory that it shares, which takes their place; throws. Where the
/// host touches nothing until the run has ended, copies are in the order of its
/// stream, and what is in the device's memory stays where it is.
void beginMirrors(pikort_pipeline &p, bool isFrame);
/// For a frame that the host repeats: copies again what kernels may have
/// changed, and what was not copied; throws.
void refillMirrors(pikort_pipeline &p);
/// Puts the host's memory back, with what kernels have written.
void endMirrors(pikort_pipeline &p);

/// Lets an accelerator read a kernel's units, or all of its input, whose
/// primitives are those of `from`; throws.
void shareHeader(pikort_pipeline &p, Kernel &kernel);
void shareUnits(pikort_pipeline &p, Kernel &kernel);
void shareInput(pikort_pipeline &p, Kernel &kernel, const Items &from);

/// While a frame of a device is recorded: lets the host read constants.
void showConstants(const pikort_pipeline &p);

} // namespace piko::rt

#endif // PIKO_RUNTIME_CPU_MIRRORS_H
