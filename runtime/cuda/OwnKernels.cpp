// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- OwnKernels.cpp - The runtime's own kernels on a CUDA device --------===//

#include "cuda/OwnKernels.h"
#include "cuda/Accelerator.h"
#include "cuda/Kernels.h"

using namespace piko::cuda;

OwnKernels::OwnKernels(const Device &device)
    : joins_{{device, joinKernels}, {}}, steps_{{device, stepKernels}, {}},
      conditions_{{device, conditionKernels}, {}} {}

CUfunction OwnKernels::find(const std::string &kernel) {
  Part &part = kernel == conditionKernel ? conditions_
               : kernel == stepKernel    ? steps_
                                         : joins_;
  std::lock_guard<std::mutex> lock(part.mutex);
  return part.module.find(kernel);
}

void OwnKernels::unload() {
  for (Part *part : {&joins_, &steps_, &conditions_})
    part->module.unload();
}
