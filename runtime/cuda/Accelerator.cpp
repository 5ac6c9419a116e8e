// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Accelerator.cpp - A pipeline's part of a CUDA device ---------------===//

#include "cuda/Accelerator.h"
#include "common/Pipeline.h"
#include "pikort/grid.h"

#include <algorithm>

using namespace piko::cuda;
using piko::rt::Failure;

Accelerator::Accelerator(pikort_pipeline &p, const char *ptx)
    : p_(p), ptx_(ptx), device_(Device::open()) {
  device_->check(device_->enter(), "entering its context");
  residentThreads_ =
      int64_t(device_->attribute(
          CU_DEVICE_ATTRIBUTE_MAX_THREADS_PER_MULTIPROCESSOR)) *
      device_->attribute(CU_DEVICE_ATTRIBUTE_MULTIPROCESSOR_COUNT);
  device_->check(
      device_->driver.cuStreamCreate(&stream_, CU_STREAM_NON_BLOCKING),
      "creating a stream");
}

Accelerator::~Accelerator() {
  const Driver &driver = device_->driver;
  device_->enter();
  if (!log_.empty())
    unmap(log_.data());
  if (module_)
    driver.cuModuleUnload(module_);
  if (stream_)
    driver.cuStreamDestroy(stream_);
}

// --- Memory ------------------------------------------------------------------

uint8_t *Accelerator::map(size_t bytes) noexcept {
  CUdeviceptr address = 0;
  CUresult result = device_->enter();
  if (result == CUDA_SUCCESS)
    result = device_->driver.cuMemAllocManaged(&address, bytes,
                                               CU_MEM_ATTACH_GLOBAL);
  if (result == CUDA_SUCCESS)
    return reinterpret_cast<uint8_t *>(address);
  if (result != CUDA_ERROR_OUT_OF_MEMORY)
    piko::rt::guarded(&p_, "pipeline", [&] {
      device_->check(result, "allocating " + std::to_string(bytes) + " bytes");
    });
  return nullptr;
}

void Accelerator::unmap(uint8_t *data) noexcept {
  // After an error of a kernel the memory is gone with the context.
  if (device_->enter() == CUDA_SUCCESS)
    device_->driver.cuMemFree(reinterpret_cast<CUdeviceptr>(data));
}

std::span<uint8_t> Accelerator::logSpace() noexcept {
  constexpr size_t most = size_t(1) << 36, least = size_t(1) << 28;
  for (size_t bytes = most; log_.empty() && bytes >= least; bytes /= 2)
    if (uint8_t *data = map(bytes))
      log_ = {data, bytes};
    else if (p_.status != PIKORT_OK)
      break;
  return log_;
}

void Accelerator::clearLog(std::span<uint8_t> part) noexcept {
  if (part.empty())
    return;
  piko::rt::guarded(&p_, "run", [&] {
    device_->check(device_->enter(), "entering its context");
    device_->check(device_->driver.cuMemsetD8Async(
                       reinterpret_cast<CUdeviceptr>(part.data()), 0,
                       part.size(), stream_),
                   "clearing the log");
  });
}

// --- Kernels -----------------------------------------------------------------

void Accelerator::loadModule() {
  char log[8192] = "";
  CUjit_option options[] = {CU_JIT_ERROR_LOG_BUFFER,
                            CU_JIT_ERROR_LOG_BUFFER_SIZE_BYTES};
  void *values[] = {log, reinterpret_cast<void *>(sizeof(log))};
  CUresult result =
      device_->driver.cuModuleLoadDataEx(&module_, ptx_, 2, options, values);
  std::string text = log;
  while (!text.empty() && (text.back() == '\n' || text.back() == ' '))
    text.pop_back();
  device_->check(result, "loading the kernels" +
                             (text.empty() ? "" : " (" + text + ")"));
}

CUfunction Accelerator::find(const char *kernel) {
  auto [found, isNew] = functions_.try_emplace(kernel, nullptr);
  if (isNew) {
    CUresult result =
        device_->driver.cuModuleGetFunction(&found->second, module_, kernel);
    if (result != CUDA_SUCCESS)
      functions_.erase(kernel);
    device_->check(result, std::string("finding kernel '") + kernel + "'");
  }
  return found->second;
}

void Accelerator::launch(const char *kernel, int64_t blocks, int64_t threads,
                         const void *arguments, int64_t count) {
  device_->check(device_->enter(), "entering its context");
  if (!module_)
    loadModule();
  CUfunction function = find(kernel);
  if (blocks > INT32_MAX)
    throw Failure{PIKORT_TOO_MANY, std::string("kernel '") + kernel +
                                       "': expected at most 2147483647 blocks, "
                                       "but got " +
                                       std::to_string(blocks)};
  std::vector<void *> places(static_cast<size_t>(count));
  for (size_t i = 0; i < places.size(); ++i)
    places[i] =
        const_cast<int64_t *>(static_cast<const int64_t *>(arguments) + i);
  std::string doing = std::string("running kernel '") + kernel + "'";
  device_->check(device_->driver.cuLaunchKernel(
                     function, static_cast<unsigned>(blocks), 1, 1,
                     static_cast<unsigned>(threads), 1, 1, /*sharedBytes=*/0,
                     stream_, places.data(), nullptr),
                 doing);
  device_->check(device_->driver.cuStreamSynchronize(stream_), doing);
}

// --- What generated code calls ----------------------------------------------

extern "C" {

void pikoir_cuda_module(pikort_pipeline *p, const char *ptx) {
  piko::rt::guarded(p, "pipeline", [&] {
    p->useAccelerator(std::make_unique<Accelerator>(*p, ptx));
  });
}

void pikoir_cuda_launch(pikort_pipeline *p, const char *kernel, int64_t blocks,
                        int64_t threads, const void *arguments, int64_t count) {
  if (p->status != PIKORT_OK)
    return;
  piko::rt::guarded(p, "run", [&] {
    if (!p->accelerator)
      throw Failure{PIKORT_BAD_PROGRAM,
                    std::string("kernel '") + kernel +
                        "': expected pikoir_cuda_module in the setup"};
    p->accelerator->launch(kernel, blocks, threads, arguments, count);
  });
}

} // extern "C"
