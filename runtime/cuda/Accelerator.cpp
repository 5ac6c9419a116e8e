// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Accelerator.cpp - A pipeline's part of a CUDA device ---------------===//

#include "cuda/Accelerator.h"
#include "common/Pipeline.h"
#include "cuda/CudaExecutor.h"
#include "cuda/OwnKernels.h"
#include "pikort/grid.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <cstring>

using namespace piko::cuda;
using piko::rt::Failure, piko::rt::quoted;

/// A barrier of blocks takes as long as some 20 loads, one after the other,
/// and a join has a dozen of them; 2,000 things are eight for a thread of one
/// block.
static int64_t findMostAlone() {
  const char *text = std::getenv("PIKO_CUDA_ALONE");
  int64_t most = 2048;
  if (!text || !*text)
    return most;
  const char *end = text + std::strlen(text);
  auto [stop, error] = std::from_chars(text, end, most);
  if (error != std::errc() || stop != end || most < 0)
    throw Failure{PIKORT_INVALID_ARGUMENT,
                  std::string("PIKO_CUDA_ALONE: expected a number of at least "
                              "0, but got '") +
                      text + "'"};
  return most;
}

Accelerator::Accelerator(pikort_pipeline &p, const pikoir_cuda_image *images)
    : p_(p), device_(Device::open(p.device)), module_(*device_, images) {
  device_->check(device_->enter(), "entering its context");
  processors_ = device_->attribute(CU_DEVICE_ATTRIBUTE_MULTIPROCESSOR_COUNT);
  residentThreads_ = int64_t(device_->attribute(
                         CU_DEVICE_ATTRIBUTE_MAX_THREADS_PER_MULTIPROCESSOR)) *
                     processors_;
  mostAlone_ = findMostAlone();
  device_->check(device_->driver.cuStreamCreate(&own_, CU_STREAM_NON_BLOCKING),
                 "creating a stream");
  stream_ = own_;
}

Accelerator::~Accelerator() {
  if (device_->isLost()) // with all that was on it
    return;
  device_->enter();
  if (!log_.empty())
    release(log_.data());
  for (uint8_t *data : std::exchange(unreleased_, {}))
    device_->driver.cuMemFree(reinterpret_cast<CUdeviceptr>(data));
  submission_.end();
  module_.unload();
  if (done_)
    device_->driver.cuEventDestroy(done_);
  if (own_)
    device_->driver.cuStreamDestroy(own_);
  if (progress_)
    device_->driver.cuMemFreeHost(progress_);
}

// --- Memory ------------------------------------------------------------------

/// Null where that was refused; another error is the pipeline's.
uint8_t *Accelerator::allocated(CUresult result, CUdeviceptr address,
                                size_t bytes) {
  if (result == CUDA_SUCCESS)
    return reinterpret_cast<uint8_t *>(address);
  if (result != CUDA_ERROR_OUT_OF_MEMORY)
    piko::rt::guarded(&p_, "pipeline", [&] {
      device_->check(result, "allocating " + std::to_string(bytes) + " bytes");
    });
  return nullptr;
}

uint8_t *Accelerator::map(size_t bytes) noexcept {
  void *address = nullptr;
  CUresult result = device_->enter();
  if (result == CUDA_SUCCESS)
    result = device_->driver.cuMemAllocHost(&address, bytes);
  return allocated(result, reinterpret_cast<CUdeviceptr>(address), bytes);
}

void Accelerator::unmap(uint8_t *data) noexcept {
  // After an error of a kernel the memory is gone with the context.
  if (device_->enter() == CUDA_SUCCESS)
    device_->driver.cuMemFreeHost(data);
}

uint8_t *Accelerator::allocate(size_t bytes) noexcept {
  CUdeviceptr address = 0;
  CUresult result = device_->enter();
  if (result == CUDA_SUCCESS)
    result = device_->driver.cuMemAlloc(&address, bytes);
  return allocated(result, address, bytes);
}

void Accelerator::release(uint8_t *data) noexcept {
  CUresult result = device_->enter();
  if (result == CUDA_SUCCESS)
    result = device_->driver.cuMemFree(reinterpret_cast<CUdeviceptr>(data));
  if (result != CUDA_SUCCESS)
    unreleased_.push_back(data);
}

/// A sixteenth of what is free, twice as much where that did not suffice, but
/// not all, and less where it is refused.
std::span<uint8_t> Accelerator::logSpace() noexcept {
  constexpr size_t least = size_t(1) << 28;
  if (!log_.empty() && log_.size() >= wantedLog_)
    return log_;
  if (!log_.empty())
    release(std::exchange(log_, {}).data());
  size_t free = 0, all = 0;
  if (device_->enter() == CUDA_SUCCESS)
    device_->driver.cuMemGetInfo(&free, &all);
  wantedLog_ =
      std::min(std::max({wantedLog_, free / 16, least}), free - free / 8);
  for (; log_.empty() && wantedLog_ >= least; wantedLog_ /= 2)
    if (uint8_t *data = allocate(wantedLog_))
      log_ = {data, wantedLog_};
    else if (p_.status != PIKORT_OK)
      break;
  wantedLog_ = log_.size();
  return log_;
}

// --- Streams -----------------------------------------------------------------

void Accelerator::useStream(void *stream, bool waits) {
  bool isOwn = stream == PIKORT_OWN_STREAM;
  device_->check(device_->enter(), "entering its context");
  if (!isOwn)
    device_->checkStream(static_cast<CUstream>(stream));
  if ((!isOwn || !waits) && !done_)
    device_->check(
        device_->driver.cuEventCreate(&done_, CU_EVENT_DISABLE_TIMING),
        "creating an event");
  stream_ = isOwn ? own_ : static_cast<CUstream>(stream);
  usesEvent_ = !isOwn || !waits;
}

void Accelerator::finishStream() {
  CUresult result = CUDA_SUCCESS;
  device_->check(device_->enter(), "entering its context");
  if (isBusy_ || stream_ != own_)
    result = device_->driver.cuStreamSynchronize(stream_);
  leaveStream();
  device_->check(result, "waiting for a stream");
}

void Accelerator::endStream() noexcept {
  if (isBusy_ && device_->enter() == CUDA_SUCCESS)
    device_->driver.cuStreamSynchronize(stream_);
  leaveStream();
}

void Accelerator::leaveStream() {
  stream_ = own_;
  usesEvent_ = isBusy_ = false;
}

void Accelerator::upload(uint8_t *to, const uint8_t *from, int64_t bytes) {
  isBusy_ = true;
  device_->check(device_->enter(), "entering its context");
  device_->check(
      device_->driver.cuMemcpyHtoDAsync(reinterpret_cast<CUdeviceptr>(to), from,
                                        static_cast<size_t>(bytes), stream_),
      "copying to its memory");
}

void Accelerator::copy(uint8_t *to, const uint8_t *from, int64_t bytes) {
  isBusy_ = true;
  device_->check(device_->enter(), "entering its context");
  device_->check(
      device_->driver.cuMemcpyAsync(reinterpret_cast<CUdeviceptr>(to),
                                    reinterpret_cast<CUdeviceptr>(from),
                                    static_cast<size_t>(bytes), stream_),
      "copying in its memory");
}

void Accelerator::download(uint8_t *to, const uint8_t *from, int64_t bytes) {
  isBusy_ = true;
  device_->check(device_->enter(), "entering its context");
  device_->check(
      device_->driver.cuMemcpyDtoHAsync(to, reinterpret_cast<CUdeviceptr>(from),
                                        static_cast<size_t>(bytes), stream_),
      "copying from its memory");
}

void Accelerator::clear(uint8_t *data, int64_t bytes) {
  isBusy_ = true;
  device_->check(device_->enter(), "entering its context");
  device_->check(
      device_->driver.cuMemsetD8Async(reinterpret_cast<CUdeviceptr>(data), 0,
                                      static_cast<size_t>(bytes), stream_),
      "clearing its memory");
}

int32_t Accelerator::read(const int32_t *data) {
  auto *room = reinterpret_cast<int32_t *>(progress_ + 1);
  download(reinterpret_cast<uint8_t *>(room),
           reinterpret_cast<const uint8_t *>(data), sizeof(*room));
  device_->check(device_->driver.cuStreamSynchronize(stream_),
                 "copying from its memory");
  return *room;
}

// --- Kernels -----------------------------------------------------------------

bool Accelerator::canWaitInGrids() const {
  return device_->attribute(CU_DEVICE_ATTRIBUTE_COOPERATIVE_LAUNCH) != 0;
}

CUfunction Accelerator::find(const std::string &kernel) {
  if (!OwnKernels::has(kernel))
    return module_.find(kernel);
  CUfunction &function = ownFunctions_[kernel];
  if (!function)
    function = device_->ownKernels().find(kernel);
  return function;
}

int64_t Accelerator::residentBlocks(const std::string &kernel,
                                    int64_t threads) {
  auto found = residentBlocks_.find(kernel);
  if (found != residentBlocks_.end())
    return found->second;
  device_->check(device_->enter(), "entering its context");
  int blocks = 0;
  device_->check(
      device_->driver.cuOccupancyMaxActiveBlocksPerMultiprocessor(
          &blocks, find(kernel), static_cast<int>(threads), /*sharedBytes=*/0),
      "asking how many blocks are resident of " + module_.describe(kernel));
  return residentBlocks_[kernel] = std::max(blocks, 1) * processors_;
}

/// Joins wait for memory: two blocks to a multiprocessor, where it has the
/// registers, ask for twice as much of it at a time.
int64_t Accelerator::joinBlocks(const std::string &kernel) {
  return std::min({residentBlocks(kernel, joinThreads), 2 * processors_,
                   int64_t(mostJoinBlocks)});
}

void Accelerator::launch(const char *kernel, int64_t blocks, int64_t threads,
                         const void *arguments, int64_t count) {
  const auto *words = static_cast<const int64_t *>(arguments);
  Step step{Step::Kind::Grid,
            {kernel, blocks, threads, {words, words + count}, false}};
  enqueue({&step, 1});
  await({&step, 1});
}

void Accelerator::launch(const GridLaunch &grid, CUstream stream) {
  if (grid.blocks > INT32_MAX)
    throw Failure{PIKORT_TOO_MANY, module_.describe(grid.kernel) +
                                       ": expected at most 2147483647 blocks, "
                                       "but got " +
                                       std::to_string(grid.blocks)};
  CUfunction function = find(grid.kernel);
  std::vector<void *> places;
  for (const int64_t &word : grid.arguments)
    places.push_back(const_cast<int64_t *>(&word));
  auto blocks = static_cast<unsigned>(grid.blocks),
       threads = static_cast<unsigned>(grid.threads);
  const Driver &driver = device_->driver;
  CUresult result =
      grid.isJoin
          ? driver.cuLaunchCooperativeKernel(function, blocks, 1, 1, threads, 1,
                                             1, /*sharedBytes=*/0, stream,
                                             places.data())
          : driver.cuLaunchKernel(function, blocks, 1, 1, threads, 1, 1,
                                  /*sharedBytes=*/0, stream, places.data(),
                                  nullptr);
  if (result != CUDA_SUCCESS)
    device_->check(result, "running " + module_.describe(grid.kernel));
}

void Accelerator::loadKernels() {
  device_->check(device_->enter(), "entering its context");
  module_.require();
}

void Accelerator::load(std::span<const Step> steps) {
  device_->check(device_->enter(), "entering its context");
  for (const Step &step : steps)
    if (step.kind == Step::Kind::Grid)
      find(step.grid.kernel);
}

void Accelerator::noteEnd() {
  if (usesEvent_)
    device_->check(device_->driver.cuEventRecord(done_, stream_),
                   "running a frame");
}

void Accelerator::enqueue(std::span<const Step> steps) {
  load(steps);
  isBusy_ = true;
  submission_.run(steps);
  noteEnd();
}

void Accelerator::enqueue(std::span<const Step> steps, const Exchange &exchange,
                          const void *end) {
  load(steps);
  exchange.forAll([&](uint8_t *device, const uint8_t *host, size_t bytes) {
    upload(device, host, static_cast<int64_t>(bytes));
  });
  submission_.run(steps);
  exchange.forFirst(
      end, [&](const uint8_t *device, uint8_t *host, size_t bytes) {
        // May say how the grids went.
        if (CUresult result = device_->driver.cuMemcpyDtoHAsync(
                host, reinterpret_cast<CUdeviceptr>(device), bytes, stream_))
          device_->check(result, "running " + describeFailed(steps));
      });
  noteEnd();
}

bool Accelerator::isDone() const {
  device_->check(device_->enter(), "entering its context");
  CUresult result = device_->driver.cuEventQuery(done_);
  if (result != CUDA_ERROR_NOT_READY)
    device_->check(result, "looking at a frame");
  return result == CUDA_SUCCESS;
}

void Accelerator::await(std::span<const Step> steps) {
  device_->check(device_->enter(), "entering its context");
  if (!usesEvent_)
    wait(steps);
  else if (CUresult result = device_->driver.cuEventSynchronize(done_))
    device_->check(result, "running " + describeFailed(steps));
  submission_.addTimes();
  leaveStream();
}

void Accelerator::wait(std::span<const Step> steps) {
  CUresult result = device_->driver.cuStreamSynchronize(stream_);
  if (result != CUDA_SUCCESS)
    device_->check(result, "running " + describeFailed(steps));
}

std::string Accelerator::describeFailed(std::span<const Step> steps) {
  auto at = static_cast<size_t>(
      progress_ ? *static_cast<volatile int64_t *>(progress_) : 0);
  for (; at < steps.size(); ++at)
    if (steps[at].kind == Step::Kind::Grid) {
      const std::string &kernel = steps[at].grid.kernel;
      return module_.describe(kernel);
    }
  return "a frame";
}

int64_t *Accelerator::progress() {
  if (!progress_) {
    void *memory = nullptr;
    device_->check(device_->enter(), "entering its context");
    device_->check(device_->driver.cuMemAllocHost(&memory, 2 * sizeof(int64_t)),
                   "allocating memory of the host");
    progress_ = static_cast<int64_t *>(memory);
  }
  *progress_ = 0;
  return progress_;
}

// --- What generated code calls ----------------------------------------------

extern "C" {

void pikoir_cuda_module(pikort_pipeline *p, const pikoir_cuda_image *images) {
  piko::rt::guarded(p, "pipeline", [&] {
    auto device = std::make_unique<Accelerator>(*p, images);
    auto executor = std::make_unique<CudaExecutor>(*p, *device);
    p->useAccelerator(std::move(device));
    p->executor = std::move(executor);
  });
}

void pikoir_cuda_program(pikort_pipeline *p, const pikoir_cuda_step *steps,
                         int64_t count) {
  piko::rt::guarded(p, "pipeline", [&] {
    auto *executor = dynamic_cast<CudaExecutor *>(p->executor.get());
    if (!executor || count < 0)
      throw Failure{PIKORT_BAD_PROGRAM,
                    "pipeline " + quoted(p->name) +
                        ": expected pikoir_cuda_module before "
                        "pikoir_cuda_program, and at least 0 steps"};
    executor->setProgram({steps, static_cast<size_t>(count)});
  });
}

void pikoir_cuda_kernel(pikort_pipeline *p, const char *kernel,
                        const char *stage, const char *place) {
  piko::rt::guarded(p, "pipeline", [&] {
    if (auto *device = static_cast<Accelerator *>(p->accelerator.get()))
      device->name(kernel, stage, place);
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
