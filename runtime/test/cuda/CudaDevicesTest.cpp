// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- CudaDevicesTest.cpp - Several devices, and some that are lost ------===//

#include "Symbols.h"
#include "cuda/CudaFixture.h"

#include <cstdlib>
#include <thread>

using namespace piko::cuda;
using piko::rt::Device;

namespace {

TEST_F(Cuda, DevicesOfTheMachine) {
  ASSERT_EQ(pikort_device_count(), 2);
  pikort_device_info info;
  ASSERT_EQ(pikort_get_device(1, &info), PIKORT_OK);
  EXPECT_STREQ(info.name, "Piko test device");
  EXPECT_EQ(info.capability, 90);
  EXPECT_EQ(info.usable, 1);
  EXPECT_EQ(info.memory, int64_t(16) << 30);
  EXPECT_EQ(pikort_get_device(2, &info), PIKORT_NOT_FOUND);
  EXPECT_EQ(pikort_get_device(-1, &info), PIKORT_NOT_FOUND);
  EXPECT_EQ(pikort_get_device(0, nullptr), PIKORT_INVALID_ARGUMENT);
  pikoTestDriverFail("cuDeviceTotalMem", 1, CUDA_ERROR_UNKNOWN);
  EXPECT_EQ(pikort_get_device(0, &info), PIKORT_DEVICE_FAILED);
}

TEST_F(Cuda, HostChoosesTheDevice) {
  for (int32_t number : {0, 1}) {
    piko::rt::Pipeline pipe(program, Device{number});
    ASSERT_TRUE(pipe.created());
    EXPECT_EQ(pipe.device().number, number);
    ASSERT_TRUE(bind(pipe));
    ASSERT_TRUE(pipe.run());
    expectScaled();
  }
  // It has the last word.
  setenv("PIKO_CUDA_DEVICE", "1", 1);
  EXPECT_EQ(piko::rt::Pipeline(program, Device{0}).device().number, 0);
  EXPECT_EQ(piko::rt::Pipeline(program).device().number, 1);
}

TEST_F(Cuda, ChoiceThatIsNoDevice) {
  auto status = scale(1, Device{2});
  EXPECT_EQ(status.code(), PIKORT_NO_DEVICE);
  expectIn(status, {"no CUDA device: expected one from 0 to 1, but got 2"});
  status = scale(1, Device{PIKORT_PROCESSOR});
  EXPECT_EQ(status.code(), PIKORT_NO_DEVICE);
  status = scale(1, Device{-3});
  EXPECT_EQ(status.code(), PIKORT_INVALID_ARGUMENT);
  expectIn(status, {"expected a device's number, but got -3"});
}

/// Of two pipelines, each on a thread and a device; what both are on is theirs
/// together from the first kernel of the runtime's on.
class CudaTogether
    : public Cuda,
      public testing::WithParamInterface<std::pair<int32_t, int32_t>> {};

TEST_P(CudaTogether, Run) {
  constexpr int frames = 20;
  std::vector<int32_t> results[2];
  int failures[2] = {};
  auto work = [&](int32_t number, int32_t device) {
    results[number].resize(numbers.size());
    piko::rt::Pipeline pipe(program, Device{device});
    int32_t factor = 5 + number;
    bool isBound = pipe.domain({8}) && pipe.constant("factor", factor) &&
                   pipe.buffer("out", results[number]) &&
                   pipe.source(0, numbers);
    for (int frame = 0; frame < frames; ++frame)
      failures[number] += !isBound || !pipe.run();
  };
  std::thread first(work, 0, GetParam().first),
      second(work, 1, GetParam().second);
  first.join();
  second.join();
  for (int32_t number : {0, 1}) {
    EXPECT_EQ(failures[number], 0);
    for (size_t i = 0; i < numbers.size(); ++i)
      ASSERT_EQ(results[number][i], numbers[i] * (5 + number));
  }
}

INSTANTIATE_TEST_SUITE_P(Devices, CudaTogether,
                         testing::Values(std::pair(0, 1), std::pair(0, 0)));

/// A pipeline on the first device, which its kernel has made useless.
class LostDevice : public Cuda {
protected:
  void lose(piko::rt::Pipeline &pipe) {
    ASSERT_TRUE(bind(pipe));
    strayPointer = true;
    EXPECT_EQ(pipe.run().code(), PIKORT_DEVICE_FAILED);
    strayPointer = false;
  }
};

TEST_F(LostDevice, SaysSoUntilItsEnd) {
  piko::rt::Pipeline pipe(program, Device{0}), neighbour(program, Device{0});
  ASSERT_TRUE(bind(neighbour));
  ASSERT_TRUE(neighbour.run());
  lose(pipe);
  for (piko::rt::Pipeline *each : {&pipe, &neighbour})
    for (int i = 0; i < 2; ++i) {
      uint64_t calls = pikoTestDriverCalls(nullptr);
      auto status = each->run();
      EXPECT_EQ(status.code(), PIKORT_DEVICE_FAILED);
      expectIn(status, {"CUDA device 0 (Piko test device) is lost",
                        "since running kernel 'scale' of stage 'scaler' "
                        "(scale.cpp:7): CUDA_ERROR_ILLEGAL_ADDRESS"});
      EXPECT_EQ(pikoTestDriverCalls(nullptr), calls);
    }
  // The host's own memory is as good as before.
  EXPECT_EQ(pipe.view<int32_t>("out").elements.data(), out.data());
}

TEST_F(LostDevice, OthersGoOn) {
  piko::rt::Pipeline pipe(program, Device{0}), other(program, Device{1});
  ASSERT_TRUE(bind(other));
  ASSERT_TRUE(other.run());
  lose(pipe);
  std::fill(out.begin(), out.end(), -1);
  ASSERT_TRUE(other.run());
  expectScaled();
}

TEST_F(LostDevice, NewPipelineResetsIt) {
  auto pipe = std::make_unique<piko::rt::Pipeline>(program, Device{0});
  lose(*pipe);
  uint64_t resets = pikoTestDriverCalls("cuDevicePrimaryCtxReset");
  piko::rt::Pipeline fresh(program, Device{0});
  ASSERT_TRUE(fresh.created()) << fresh.created().message();
  EXPECT_EQ(pikoTestDriverCalls("cuDevicePrimaryCtxReset"), resets + 1);
  ASSERT_TRUE(bind(fresh));
  ASSERT_TRUE(fresh.run());
  expectScaled();
  // The one before touches nothing of it, not even when it goes.
  EXPECT_EQ(pipe->run().code(), PIKORT_DEVICE_FAILED);
  pipe.reset();
  std::fill(out.begin(), out.end(), -1);
  ASSERT_TRUE(fresh.run());
  expectScaled();
  EXPECT_EQ(pikoTestDriverCalls("cuDevicePrimaryCtxReset"), resets + 1);
}

// Also if the host keeps its context alive.
TEST_F(LostDevice, IsResetWhenItsPipelinesAreGone) {
  CUcontext context = nullptr;
  ASSERT_EQ(cuInit(0), CUDA_SUCCESS);
  ASSERT_EQ(cuDevicePrimaryCtxRetain(&context, 0), CUDA_SUCCESS);
  {
    piko::rt::Pipeline pipe(program, Device{0});
    lose(pipe);
  }
  uint64_t resets = pikoTestDriverCalls("cuDevicePrimaryCtxReset");
  ASSERT_TRUE(scale(1, Device{0}));
  expectScaled();
  EXPECT_EQ(pikoTestDriverCalls("cuDevicePrimaryCtxReset"), resets + 1);
  EXPECT_EQ(cuDevicePrimaryCtxRelease(0), CUDA_SUCCESS);
}

TEST_F(LostDevice, ResetThatFails) {
  piko::rt::Pipeline pipe(program, Device{0});
  lose(pipe);
  pikoTestDriverFail("cuDevicePrimaryCtxReset", 1, CUDA_ERROR_UNKNOWN);
  auto status = scale(1, Device{0});
  EXPECT_EQ(status.code(), PIKORT_DEVICE_FAILED);
  expectIn(status, {"resetting its context: CUDA_ERROR_UNKNOWN"});
  ASSERT_TRUE(scale(1, Device{0})); // now it does
  expectScaled();
}

// The call fails once, but what it says is meant for good.
TEST_F(LostDevice, ByACallOfTheHost) {
  for (CUresult error :
       {CUDA_ERROR_DEVICE_UNAVAILABLE, CUDA_ERROR_CONTAINED,
        CUDA_ERROR_TENSOR_MEMORY_LEAK, CUDA_ERROR_MPS_CLIENT_TERMINATED,
        CUDA_ERROR_EXTERNAL_DEVICE}) {
    piko::rt::Pipeline pipe(program, Device{1});
    ASSERT_TRUE(bind(pipe));
    pikoTestDriverFail("cuStreamSynchronize", 1, error);
    auto status = pipe.run();
    EXPECT_EQ(status.code(), PIKORT_DEVICE_FAILED);
    expectIn(status, {"running kernel 'scale' of stage 'scaler' "
                      "(scale.cpp:7): CUDA_ERROR_"});
    expectIn(pipe.run(), {"CUDA device 1 (Piko test device) is lost"});
    ASSERT_TRUE(scale(1, Device{1}));
    expectScaled();
    pikoTestDriverReset(); // the reset found memory of the pipeline
  }
}

// What may pass is tried again.
TEST_F(LostDevice, NotByWhatMayPass) {
  for (CUresult error : {CUDA_ERROR_LAUNCH_OUT_OF_RESOURCES, CUDA_ERROR_UNKNOWN,
                         CUDA_ERROR_NOT_SUPPORTED}) {
    piko::rt::Pipeline pipe(program, Device{0}); // a graph is launched once
    ASSERT_TRUE(bind(pipe));
    pikoTestDriverFail("cuLaunchKernel", 1, error);
    auto status = pipe.run();
    EXPECT_EQ(status.code(), PIKORT_DEVICE_FAILED);
    expectIn(status, {"CUDA device 0 (Piko test device): running kernel "
                      "'scale' of stage 'scaler' (scale.cpp:7): CUDA_ERROR_"});
    std::fill(out.begin(), out.end(), -1);
    ASSERT_TRUE(pipe.run());
    expectScaled();
  }
}

} // namespace
