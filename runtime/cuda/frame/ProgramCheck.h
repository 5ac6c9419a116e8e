// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- ProgramCheck.h - Whether a table of steps can be run ---------------===//

#ifndef PIKO_RUNTIME_CUDA_PROGRAMCHECK_H
#define PIKO_RUNTIME_CUDA_PROGRAMCHECK_H

#include "cuda/frame/FrameDescription.h"

namespace piko::cuda {

/// Throws Failure, which names the step, unless a frame can be made of the
/// steps: all that they number has been declared, and what is repeated ends, in
/// the order of nesting. Once, when the declarations are complete; frames ask
/// nothing of this again.
void checkProgram(const pikort_pipeline &p, Steps program);

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_PROGRAMCHECK_H
