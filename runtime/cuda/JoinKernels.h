// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- JoinKernels.h - device/Joins.cpp as PTX ----------------------------===//

#ifndef PIKO_RUNTIME_CUDA_JOINKERNELS_H
#define PIKO_RUNTIME_CUDA_JOINKERNELS_H

namespace piko::cuda {

/// Ends with a zero byte.
extern const char *const joinKernels;

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_JOINKERNELS_H
