// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Module.cpp - A program's kernels on a CUDA device ------------------===//
//
// A cubin is machine code: it runs on devices of the same major version of
// compute capability and at least the same minor one. Not every driver takes
// it: one that is older than the assembler may not. Then there is the PTX,
// which the driver translates.
//
//===----------------------------------------------------------------------===//

#include "cuda/Module.h"
#include "common/Pipeline.h"

#include <algorithm>
#include <vector>

using namespace piko::cuda;
using piko::rt::Failure;

/// The cubins that a device can run, the latest chip's first.
static std::vector<const pikoir_cuda_image *>
findFitting(const pikoir_cuda_image *images, int32_t device) {
  std::vector<const pikoir_cuda_image *> fitting;
  for (const auto *image = images; image->data; ++image)
    if (image->is_exact
            ? image->chip == device
            : image->chip / 10 == device / 10 && image->chip <= device)
      fitting.push_back(image);
  std::stable_sort(fitting.begin(), fitting.end(),
                   [](auto *a, auto *b) { return a->chip > b->chip; });
  return fitting;
}

void Module::load() {
  refused_.clear();
  for (const auto *cubin : findFitting(images_, device_.capability()))
    if (loadCubin(*cubin))
      return;
  const auto *ptx = images_;
  while (ptx->data && ptx->chip)
    ++ptx;
  if (!ptx->data)
    throw Failure{PIKORT_BAD_PROGRAM,
                  "pikoir_cuda_module: expected PTX among the images"};
  loadPTX(ptx->data);
}

void Module::unload() {
  if (handle_)
    device_.driver.cuModuleUnload(handle_);
  handle_ = nullptr;
  functions_.clear();
}

/// False if the PTX may do.
bool Module::loadCubin(const pikoir_cuda_image &image) {
  CUresult result = device_.driver.cuModuleLoadDataEx(&handle_, image.data, 0,
                                                      nullptr, nullptr);
  if (result == CUDA_ERROR_OUT_OF_MEMORY)
    device_.check(result, "loading the kernels");
  if (result == CUDA_SUCCESS)
    return true;
  const char *name = nullptr;
  device_.driver.cuGetErrorName(result, &name);
  refused_ += "; the cubin for " + std::to_string(image.chip) + ": " +
              (name ? name : "error " + std::to_string(result));
  return false;
}

void Module::loadPTX(const void *ptx) {
  char log[8192] = "";
  CUjit_option options[] = {CU_JIT_ERROR_LOG_BUFFER,
                            CU_JIT_ERROR_LOG_BUFFER_SIZE_BYTES};
  void *values[] = {log, reinterpret_cast<void *>(sizeof(log))};
  CUresult result =
      device_.driver.cuModuleLoadDataEx(&handle_, ptx, 2, options, values);
  std::string text = log;
  while (!text.empty() && (text.back() == '\n' || text.back() == ' '))
    text.pop_back();
  text += refused_;
  device_.check(result, "loading the kernels" +
                            (text.empty() ? "" : " (" + text + ")"));
}

CUfunction Module::find(const std::string &kernel) {
  require();
  auto found = functions_.find(kernel);
  if (found != functions_.end())
    return found->second;
  CUfunction function = nullptr;
  device_.check(
      device_.driver.cuModuleGetFunction(&function, handle_, kernel.c_str()),
      "finding " + describe(kernel));
  // Drivers load it when it is asked for, which a capture may refuse.
  int registers = 0;
  device_.check(device_.driver.cuFuncGetAttribute(
                    &registers, CU_FUNC_ATTRIBUTE_NUM_REGS, function),
                "loading " + describe(kernel));
  functions_.emplace(kernel, function);
  return function;
}

void Module::name(const char *kernel, const char *stage, const char *place) {
  std::string origin = std::string(" of stage '") + stage + "'";
  if (*place)
    origin.append(" (").append(place).append(")");
  origins_[kernel] = origin;
}

std::string Module::describe(const std::string &kernel) const {
  auto found = origins_.find(kernel);
  return "kernel '" + kernel + "'" +
         (found == origins_.end() ? "" : found->second);
}
