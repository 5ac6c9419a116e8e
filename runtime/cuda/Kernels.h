// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Kernels.h - The runtime's own kernels, as PTX ----------------------===//

#ifndef PIKO_RUNTIME_CUDA_KERNELS_H
#define PIKO_RUNTIME_CUDA_KERNELS_H

namespace piko::cuda {

// Each ends with a zero byte.
extern const char *const joinKernels;      ///< device/Joins.cpp
extern const char *const stepKernels;      ///< device/Step.cpp
extern const char *const conditionKernels; ///< device/Condition.cpp

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_KERNELS_H
