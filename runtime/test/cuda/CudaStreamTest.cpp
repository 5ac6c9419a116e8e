// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- CudaStreamTest.cpp - Runs in streams of the host's -----------------===//

#include "Symbols.h"
#include "cuda/CudaFixture.h"

using namespace piko::cuda;
using piko::rt::Device;
using piko::rt::Pipeline;
using piko::rt::Status;
using piko::rt::Stream;

namespace {

/// Streams are as late as they may be.
class CudaStream : public Cuda {
protected:
  void SetUp() override {
    Cuda::SetUp();
    pikoTestDriverDelay(1);
  }
  static uint64_t launches() {
    PikoTestDriverCounts counts;
    pikoTestDriverCounts("scale", &counts);
    return counts.launches;
  }
};

/// A pipeline whose arrays are in the device's memory, and a stream.
struct Scene {
  Scene(const pikort_program &program, const std::vector<int32_t> &numbers)
      : from(numbers), to(std::vector<int32_t>(numbers.size(), -1)),
        pipe(program, Device{0}) {
    EXPECT_EQ(cuStreamCreate(&stream, CU_STREAM_NON_BLOCKING), CUDA_SUCCESS);
    EXPECT_TRUE(pipe.domain({8}));
    EXPECT_TRUE(pipe.constant("factor", int32_t(3)));
    EXPECT_TRUE(pipe.source(0, from.span()));
    EXPECT_TRUE(pipe.buffer("out", to.span()));
  }
  Scene(const Scene &) = delete;
  Scene &operator=(const Scene &) = delete;
  ~Scene() { cuStreamDestroy(stream); }

  HostContext host;
  DeviceNumbers from, to;
  CUstream stream = nullptr;
  Pipeline pipe;
};

TEST_F(CudaStream, ReturnsBeforeItBegins) {
  Scene scene(program, numbers);
  Pipeline &pipe = scene.pipe;
  uint64_t waits = hostCounts().waits;
  ASSERT_TRUE(pipe.runAsync(Stream(scene.stream)));
  EXPECT_EQ(hostCounts().waits, waits);
  EXPECT_EQ(launches(), 0u);
  EXPECT_FALSE(pipe.isDone());
  ASSERT_TRUE(pipe.wait());
  EXPECT_EQ(hostCounts().waits, waits + 1);
  EXPECT_EQ(launches(), 1u);
  EXPECT_TRUE(pipe.isDone());
  ASSERT_TRUE(pipe.wait()); // again
  expectScaled(scene.to.get());
}

// Before and after it in the stream: no call waits.
TEST_F(CudaStream, IsInTheOrderOfTheStream) {
  Scene scene(program, std::vector<int32_t>(5000));
  void *pinned = nullptr;
  constexpr size_t bytes = 5000 * sizeof(int32_t);
  ASSERT_EQ(cuMemAllocHost(&pinned, bytes), CUDA_SUCCESS);
  std::copy(numbers.begin(), numbers.end(), static_cast<int32_t *>(pinned));
  ASSERT_EQ(cuMemcpyHtoDAsync(scene.from.address, pinned, bytes, scene.stream),
            CUDA_SUCCESS);
  ASSERT_TRUE(scene.pipe.runAsync(Stream(scene.stream)));
  ASSERT_EQ(cuMemcpyDtoHAsync(pinned, scene.to.address, bytes, scene.stream),
            CUDA_SUCCESS);
  EXPECT_EQ(launches(), 0u);
  ASSERT_EQ(cuStreamSynchronize(scene.stream), CUDA_SUCCESS);
  expectScaled(
      {static_cast<int32_t *>(pinned), static_cast<int32_t *>(pinned) + 5000});
  EXPECT_TRUE(scene.pipe.isDone());
  ASSERT_TRUE(scene.pipe.wait());
  EXPECT_EQ(cuMemFreeHost(pinned), CUDA_SUCCESS);
}

// What the host has bound has the results when it has waited.
TEST_F(CudaStream, WithMemoryOfTheHosts) {
  Pipeline pipe{program, Device{0}};
  ASSERT_TRUE(bind(pipe));
  ASSERT_TRUE(pipe.runAsync());
  EXPECT_EQ(launches(), 0u);
  EXPECT_EQ(out[1], 0);
  ASSERT_TRUE(pipe.wait());
  expectScaled();
}

TEST_F(CudaStream, TheNextRunIsPreparedMeanwhile) {
  Scene scene(program, numbers);
  DeviceNumbers other(out);
  Pipeline &pipe = scene.pipe;
  ASSERT_TRUE(pipe.runAsync(Stream(scene.stream)));
  ASSERT_TRUE(pipe.constant("factor", int32_t(7)));
  ASSERT_TRUE(pipe.buffer("out", other.span()));
  ASSERT_TRUE(pipe.domain({9}));
  EXPECT_EQ(pipe.source(0, std::span<const int64_t>()).code(),
            PIKORT_SIZE_MISMATCH);
  EXPECT_EQ(launches(), 0u);
  ASSERT_TRUE(pipe.runAsync(Stream(scene.stream)));
  EXPECT_EQ(launches(), 1u); // one at a time
  expectScaled(scene.to.get());
  ASSERT_TRUE(pipe.wait());
  expectScaled(scene.to.get());
  expectScaled(other.get(), 7);
}

TEST_F(CudaStream, WhatNeedsItsEndWaits) {
  Scene scene(program, numbers);
  Pipeline &pipe = scene.pipe;
  ASSERT_TRUE(pipe.allocate("out", 5000));
  ASSERT_TRUE(pipe.runAsync(Stream(scene.stream)));
  ASSERT_FALSE(pipe.deviceView<int32_t>("out").empty());
  EXPECT_EQ(launches(), 0u);
  auto view = pipe.view<int32_t>("out").elements;
  EXPECT_EQ(launches(), 1u);
  expectScaled({view.begin(), view.end()});
  ASSERT_TRUE(pipe.runAsync(Stream(scene.stream)));
  ASSERT_TRUE(pipe.read("out", std::span(out)));
  expectScaled();
  ASSERT_TRUE(pipe.runAsync(Stream(scene.stream)));
  ASSERT_TRUE(pipe.allocate("out", 10));
  EXPECT_EQ(launches(), 3u);
  ASSERT_TRUE(pipe.buffer("out", scene.to.span()));
  ASSERT_TRUE(pipe.runAsync(Stream(scene.stream)));
  {
    Pipeline gone = std::move(pipe);
  }
  EXPECT_EQ(launches(), 4u);
  expectScaled(scene.to.get());
}

TEST_F(CudaStream, StreamsThatAreNotCreated) {
  Scene scene(program, numbers);
  for (Stream stream :
       {Stream(nullptr), Stream(CU_STREAM_LEGACY), Stream(CU_STREAM_PER_THREAD),
        Stream(), Stream(scene.stream)}) {
    ASSERT_TRUE(scene.pipe.runAsync(stream));
    ASSERT_TRUE(scene.pipe.wait());
    ASSERT_TRUE(scene.pipe.run());
  }
  expectScaled(scene.to.get());
}

TEST_F(CudaStream, StreamsThatAreRefused) {
  Scene scene(program, numbers);
  Pipeline &pipe = scene.pipe;
  {
    HostContext other(1);
    CUstream far = nullptr;
    ASSERT_EQ(cuStreamCreate(&far, CU_STREAM_NON_BLOCKING), CUDA_SUCCESS);
    auto status = pipe.runAsync(Stream(far));
    EXPECT_EQ(status.code(), PIKORT_INVALID_ARGUMENT);
    expectIn(status, {"expected a stream of the primary context of CUDA device "
                      "0 (Piko test device), but got one of another"});
    ASSERT_EQ(cuStreamDestroy(far), CUDA_SUCCESS);
    expectIn(pipe.runAsync(Stream(far)), {"looking at the stream: CUDA_ERROR"});
  }
  ASSERT_EQ(cuCtxSetCurrent(scene.host.handle), CUDA_SUCCESS);
  ASSERT_EQ(
      cuStreamBeginCapture(scene.stream, CU_STREAM_CAPTURE_MODE_THREAD_LOCAL),
      CUDA_SUCCESS);
  auto status = pipe.runAsync(Stream(scene.stream));
  EXPECT_EQ(status.code(), PIKORT_INVALID_ARGUMENT);
  expectIn(status, {"but it is captured; a run cannot be a part of a graph"});
  CUgraph graph = nullptr;
  ASSERT_EQ(cuStreamEndCapture(scene.stream, &graph), CUDA_SUCCESS);
  ASSERT_EQ(cuGraphDestroy(graph), CUDA_SUCCESS);
  EXPECT_EQ(launches(), 0u);
  ASSERT_TRUE(pipe.runAsync(Stream(scene.stream)));
  ASSERT_TRUE(pipe.wait());
  expectScaled(scene.to.get());
}

// A limit of memory has the host between kernels.
TEST_F(CudaStream, WhereTheHostGoesStepByStep) {
  Scene scene(program, std::vector<int32_t>(5000));
  ASSERT_TRUE(scene.pipe.memoryLimit(int64_t(1) << 30));
  ASSERT_EQ(cuMemcpyHtoDAsync(scene.from.address, numbers.data(),
                              numbers.size() * sizeof(int32_t), scene.stream),
            CUDA_SUCCESS);
  ASSERT_TRUE(scene.pipe.runAsync(Stream(scene.stream)));
  EXPECT_TRUE(scene.pipe.isDone());
  EXPECT_EQ(launches(), 1u);
  expectScaled(scene.to.get());
  ASSERT_TRUE(scene.pipe.wait());
}

// --- Errors ------------------------------------------------------------------

TEST_F(CudaStream, AnErrorIsSaidOnce) {
  Scene scene(program, numbers);
  Pipeline &pipe = scene.pipe;
  auto isOf = [&](const Status &status) {
    expectIn(status, {"running kernel ", ": CUDA_ERROR_UNKNOWN"});
    return status.code() == PIKORT_DEVICE_FAILED;
  };
  auto fail = [&] {
    ASSERT_TRUE(pipe.runAsync(Stream(scene.stream)));
    pikoTestDriverFail("cuEventSynchronize", 1, CUDA_ERROR_UNKNOWN);
  };
  fail();
  EXPECT_TRUE(isOf(pipe.wait()));
  EXPECT_TRUE(pipe.wait());
  fail();
  EXPECT_TRUE(isOf(pipe.runAsync(Stream(scene.stream))));
  EXPECT_TRUE(pipe.isDone()); // nothing is on its way
  fail();
  EXPECT_TRUE(isOf(pipe.run()));
  fail(); // others do not say it
  EXPECT_TRUE(pipe.allocate("out", 5000));
  EXPECT_TRUE(isOf(pipe.wait()));
  ASSERT_TRUE(pipe.run());
  ASSERT_TRUE(pipe.read("out", std::span(out)));
  expectScaled();
}

TEST_F(CudaStream, WhatFailsOnTheDeviceIsRepeated) {
  std::string ptx = failingPTX();
  bring(ptx.c_str());
  Pipeline pipe{program, Device{0}};
  ASSERT_TRUE(bind(pipe));
  ASSERT_TRUE(pipe.run()); // nobody has seen it
  expectScaled();
  std::fill(out.begin(), out.end(), -1);
  ASSERT_TRUE(pipe.runAsync());
  ASSERT_TRUE(pipe.constant("factor", int32_t(7))); // for the next one
  auto status = pipe.wait();
  EXPECT_EQ(status.code(), PIKORT_REPEATED);
  expectIn(status, {"pipeline 'Scale': the host has repeated the run"});
  expectScaled();
  ASSERT_TRUE(pipe.run());
  expectScaled(out, 7);
}

// There is no repeating what has changed its own input.
TEST_F(CudaStream, WhatItHasWrittenInPlaceIsSpoilt) {
  std::string ptx = failingPTX();
  bring(ptx.c_str());
  Scene scene(program, numbers);
  ASSERT_TRUE(scene.pipe.runAsync(Stream(scene.stream)));
  auto status = scene.pipe.wait();
  EXPECT_EQ(status.code(), PIKORT_OUT_OF_MEMORY);
  expectIn(status, {"out of memory on the device"});
}

TEST_F(CudaStream, AKernelThatFails) {
  {
    Scene scene(program, numbers);
    strayPointer = true;
    ASSERT_TRUE(scene.pipe.runAsync(Stream(scene.stream)));
    auto status = scene.pipe.wait();
    EXPECT_EQ(status.code(), PIKORT_DEVICE_FAILED);
    expectIn(status, {"running kernel 'scale' of stage 'scaler' (scale.cpp:7): "
                      "CUDA_ERROR_ILLEGAL_ADDRESS"});
    expectIn(scene.pipe.runAsync(Stream(scene.stream)), {" is lost"});
    expectIn(scene.pipe.source(0, scene.from.span()), {" is lost"});
    EXPECT_TRUE(scene.pipe.deviceView<int32_t>("out").empty());
    EXPECT_TRUE(scene.pipe.wait());
    strayPointer = false;
  }
  pikoTestDriverReset();
  ASSERT_TRUE(scale());
  expectScaled();
}

TEST_F(CudaStream, GoesWithoutAWait) {
  Scene scene(program, numbers);
  strayPointer = true;
  ASSERT_TRUE(scene.pipe.runAsync(Stream(scene.stream)));
  strayPointer = false;
  {
    Pipeline gone = std::move(scene.pipe);
  }
  pikoTestDriverReset();
}

/// Runs twice in a stream, on memory of either kind; the first error.
Status runTwice(Scene &scene, std::vector<int32_t> &hosts) {
  Pipeline &pipe = scene.pipe;
  Status status = pipe.runAsync(Stream(scene.stream));
  if (status)
    status = pipe.buffer("out", std::span(hosts));
  if (status)
    status = pipe.runAsync(Stream(scene.stream));
  if (status)
    status = pipe.wait();
  if (status)
    status = pipe.buffer("out", scene.to.span());
  return status;
}

TEST_F(CudaStream, EachCallFails) {
  uint64_t calls = 0;
  numbers.resize(300);
  out.resize(300);
  int failed = 0;
  for (uint64_t n = 0; n <= calls; ++n) {
    Scene scene(program, numbers);
    ASSERT_TRUE(scene.pipe.created());
    pikoTestDriverReset();
    if (n > 0)
      pikoTestDriverFail(nullptr, n, CUDA_ERROR_UNKNOWN);
    Status status = runTwice(scene, out);
    if (n == 0) {
      ASSERT_TRUE(status) << status.message();
      calls = pikoTestDriverCalls(nullptr);
      ASSERT_GT(calls, 20u);
      continue;
    }
    std::string error = pikoTestDriverError();
    ASSERT_FALSE(error.empty()) << "call " << n;
    failed += !status;
    if (!status)
      expectIn(status, {"CUDA"});
    pikoTestDriverReset();
    // The thread has a context again, unless giving it back has failed.
    ASSERT_EQ(cuCtxSetCurrent(scene.host.handle), CUDA_SUCCESS);
    ASSERT_TRUE(scene.pipe.buffer("out", scene.to.span()));
    scene.pipe.wait();
    auto next = scene.pipe.runAsync(Stream(scene.stream));
    ASSERT_TRUE(next) << next.message() << " after " << error;
    ASSERT_TRUE(scene.pipe.wait());
    expectScaled(scene.to.get());
  }
  EXPECT_GT(failed, 10);
  EXPECT_STREQ(pikoTestDriverAlive(), "");
}

} // namespace
