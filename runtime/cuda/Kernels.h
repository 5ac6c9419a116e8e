// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Kernels.h - The runtime's own kernels, as PTX and cubins -----------===//

#ifndef PIKO_RUNTIME_CUDA_KERNELS_H
#define PIKO_RUNTIME_CUDA_KERNELS_H

#include "pikort/grid.h"

namespace piko::cuda {

// As pikoir_cuda_module takes them.
extern const pikoir_cuda_image joinKernels[];      ///< device/Joins.cpp
extern const pikoir_cuda_image stepKernels[];      ///< device/Step.cpp
extern const pikoir_cuda_image conditionKernels[]; ///< device/Condition.cpp

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_KERNELS_H
