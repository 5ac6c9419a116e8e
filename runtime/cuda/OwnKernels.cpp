// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- OwnKernels.cpp - The runtime's own kernels on a CUDA device --------===//

#include "cuda/OwnKernels.h"
#include "cuda/Accelerator.h"
#include "cuda/Kernels.h"

using namespace piko::cuda;

OwnKernels::OwnKernels(const Device &device)
    : joins_(device, joinKernels), steps_(device, stepKernels),
      conditions_(device, conditionKernels) {}

CUfunction OwnKernels::find(const std::string &kernel) {
  std::lock_guard<std::mutex> lock(mutex_);
  Module &module = kernel == conditionKernel ? conditions_
                   : kernel == stepKernel    ? steps_
                                             : joins_;
  return module.find(kernel);
}

void OwnKernels::unload() {
  for (Module *module : {&joins_, &steps_, &conditions_})
    module->unload();
}
