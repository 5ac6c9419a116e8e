// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Mirrors.h - What a device sees of the host's memory ----------------===//

#ifndef PIKO_RUNTIME_GPU_MIRRORS_H
#define PIKO_RUNTIME_GPU_MIRRORS_H

#include "cpu/Kernel.h"

namespace piko::rt {

/// Of a pipeline with an accelerator: puts memory that kernels reach in the
/// place of constants, buffers, sources and images; throws. For a frame, of
/// which the host touches nothing until it has ended, that is the device's own,
/// and copies are in the order of its stream. For the host's way it is the
/// host's, with copies of what is the device's.
void beginMirrors(pikort_pipeline &p, bool isFrame);
/// For a frame that the host repeats: the same for the host's way; throws.
void refillMirrors(pikort_pipeline &p);
/// Puts the host's memory back, with what kernels have written.
void endMirrors(pikort_pipeline &p);

/// Puts copies in the place of what is the host's alone of the input of a
/// serial launch, whose primitives are those of `from`; throws.
void shareInput(pikort_pipeline &p, Kernel &kernel, const Items &from);
/// The input of a kernel that is ready to run, as the accelerator reads it;
/// throws.
const pikoir_input *shareKernel(pikort_pipeline &p, Kernel &kernel);

} // namespace piko::rt

#endif // PIKO_RUNTIME_GPU_MIRRORS_H
