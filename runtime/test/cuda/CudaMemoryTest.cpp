// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- CudaMemoryTest.cpp - Memory of a device's, bound and viewed --------===//

#include "Symbols.h"
#include "cuda/CudaFixture.h"

#include <algorithm>

using namespace piko::cuda;
using piko::rt::Device;
using piko::rt::DeviceSpan;
using piko::rt::Pipeline;

namespace {

constexpr uint64_t arrayBytes = 5000 * sizeof(int32_t);

class CudaMemory : public Cuda {};

/// That arrays were copied so often, beside what host and device say to each
/// other.
void expectArrays(uint64_t bytes, uint64_t arrays) {
  EXPECT_EQ(bytes / arrayBytes, arrays) << bytes;
}

TEST_F(CudaMemory, HostMemoryIsCopiedForEachRun) {
  ASSERT_TRUE(scale(3));
  expectArrays(hostCounts().bytesToDevice, 3 * 2);
  expectArrays(hostCounts().bytesFromDevice, 3);
  EXPECT_EQ(hostCounts().bytesOnDevice, 0u);
}

TEST_F(CudaMemory, StaticInputIsCopiedOnce) {
  Pipeline pipe{program, Device{0}};
  ASSERT_TRUE(bind(pipe));
  ASSERT_TRUE(pipe.staticInput(true));
  for (int32_t factor : {3, 4, 5}) {
    ASSERT_TRUE(pipe.constant("factor", factor));
    ASSERT_TRUE(pipe.run());
    expectScaled(out, factor);
  }
  expectArrays(hostCounts().bytesToDevice, 2);
  numbers[1] = 7; // is not seen ...
  ASSERT_TRUE(pipe.run());
  expectScaled(out, 5);
  ASSERT_TRUE(pipe.source(0, numbers)); // ... until it is bound again
  ASSERT_TRUE(pipe.run());
  EXPECT_EQ(out[1], 7 * 5);
  expectArrays(hostCounts().bytesToDevice, 3);
  ASSERT_TRUE(pipe.staticInput(false));
  numbers[1] = 8;
  ASSERT_TRUE(pipe.run());
  EXPECT_EQ(out[1], 8 * 5);
}

// Both write to it, and each sees what the other one has written.
TEST_F(CudaMemory, AllocatedBuffersGoBothWays) {
  Pipeline pipe{program, Device{0}};
  ASSERT_TRUE(bind(pipe));
  ASSERT_TRUE(pipe.allocate("out", 5000));
  for (bool needsHost : {false, true, false}) {
    ASSERT_TRUE(pipe.memoryLimit(needsHost ? int64_t(1) << 30 : 0));
    ASSERT_TRUE(pipe.source(0, std::span<const int32_t>(numbers).first(4999)));
    auto view = pipe.view<int32_t>("out").elements;
    view[4999] = 77;
    ASSERT_TRUE(pipe.run());
    view = pipe.view<int32_t>("out").elements;
    EXPECT_EQ(view[4998], 3 * 4998);
    EXPECT_EQ(view[4999], 77);
    view[4998] = 0;
  }
}

TEST_F(CudaMemory, DeviceMemoryIsUsedInPlace) {
  HostContext host;
  DeviceNumbers from(numbers), to(out);
  Pipeline pipe{program, Device{0}};
  ASSERT_TRUE(bind(pipe));
  ASSERT_TRUE(pipe.source(0, from.span()));
  ASSERT_TRUE(pipe.buffer("out", to.span()));
  uint64_t before = hostCounts().bytesToDevice;
  for (int run = 0; run < 3; ++run)
    ASSERT_TRUE(pipe.run());
  expectArrays(hostCounts().bytesToDevice - before, 0);
  expectArrays(hostCounts().bytesFromDevice, 0);
  EXPECT_EQ(hostCounts().bytesOnDevice, 0u);
  expectScaled(to.get());
  EXPECT_EQ(from.get(), numbers);
}

/// Each number of the source is an index of what is written.
struct IndexProgram : ScaleProgram {
  static const pikort_program program;
};
const pikort_program IndexProgram::program{
    PIKORT_ABI_VERSION, "Indices",
    [](pikort_pipeline *p) {
      ScaleProgram::program.setup(p);
      pikoir_declare_contract(p, 0, -1, "value", PIKORT_I32, 0, 0, 1, 0, 1, 0);
    },
    ScaleProgram::program.run};

TEST_F(CudaMemory, IndicesThatAreThereAreTestedOnce) {
  HostContext host;
  DeviceNumbers from(numbers);
  Pipeline pipe{IndexProgram::program, Device{0}};
  ASSERT_TRUE(bind(pipe));
  ASSERT_TRUE(pipe.source(0, from.span()));
  for (int run = 0; run < 3; ++run)
    ASSERT_TRUE(pipe.run());
  expectScaled(out);
  // The source once, and what each run writes.
  expectArrays(hostCounts().bytesFromDevice, 1 + 3);
  numbers[17] = 5000;
  DeviceNumbers wrong(numbers);
  ASSERT_TRUE(pipe.source(0, wrong.span()));
  out.assign(5000, 0);
  expectIn(pipe.run(), {"expected primitive 17 of source 0 to be an index into "
                        "'out', in [0, 5000), but got 5000"});
  expectIn(pipe.runAsync(), {"primitive 17 of source 0"});
  EXPECT_EQ(out, std::vector<int32_t>(5000));
  ASSERT_TRUE(pipe.source(0, from.span()));
  ASSERT_TRUE(pipe.run());
  expectScaled(out);
  // What the pipeline has itself a view may have changed there.
  ASSERT_TRUE(pipe.allocate("out", 4000));
  expectIn(pipe.run(), {"in [0, 4000), but got 4000"});
}

TEST_F(CudaMemory, ManagedMemoryCanBeBoundAsEither) {
  HostContext host;
  CUdeviceptr managed = 0;
  ASSERT_EQ(cuMemAllocManaged(&managed, arrayBytes, CU_MEM_ATTACH_GLOBAL),
            CUDA_SUCCESS);
  DeviceSpan<int32_t> device(managed, out.size());
  std::span<int32_t> hosts(device.data(), out.size());
  {
    Pipeline pipe{program, Device{0}};
    ASSERT_TRUE(bind(pipe));
    ASSERT_TRUE(pipe.buffer("out", device));
    ASSERT_TRUE(pipe.run());
    expectScaled({hosts.begin(), hosts.end()});
    ASSERT_TRUE(pipe.buffer("out", hosts));
    ASSERT_TRUE(pipe.constant("factor", int32_t(4)));
    ASSERT_TRUE(pipe.run());
    expectScaled({hosts.begin(), hosts.end()}, 4);
  }
  EXPECT_EQ(cuMemFree(managed), CUDA_SUCCESS);
}

/// Refused as a buffer and as a source.
void expectRefused(Pipeline &pipe, DeviceSpan<int32_t> span,
                   std::initializer_list<const char *> parts) {
  for (const auto &status : {pipe.buffer("out", span), pipe.source(0, span)}) {
    EXPECT_EQ(status.code(), PIKORT_INVALID_ARGUMENT);
    for (const char *part : parts)
      EXPECT_NE(status.message().find(part), std::string::npos)
          << status.message();
  }
}

TEST_F(CudaMemory, WhatIsNotThere) {
  HostContext host;
  Pipeline pipe{program, Device{0}};
  ASSERT_TRUE(bind(pipe));
  expectRefused(pipe, {out.data(), out.size()},
                {"expected memory of CUDA device 0 (Piko test device), but 0x",
                 " is memory of the host"});
  expectRefused(pipe, {uint64_t(0), 5}, {"5 records, but got a null pointer"});
  CUdeviceptr freed = 0;
  {
    DeviceNumbers made(out);
    freed = made.address;
    expectRefused(pipe, {made.address, 5001},
                  {"4 of 20004 bytes from 0x", " on lie after the allocation"});
    expectRefused(pipe, {made.address + 2, 10},
                  {"a pointer aligned to 4 bytes"});
    expectRefused(pipe, {made.address, size_t(1) << 62},
                  {"an array that fits into memory"});
    EXPECT_TRUE(pipe.source(0, made.span().subspan(4990, 10)));
  }
  expectRefused(pipe, {freed, 5}, {"is memory of the host"});
  void *pinned = nullptr;
  ASSERT_EQ(cuMemAllocHost(&pinned, arrayBytes), CUDA_SUCCESS);
  auto *data = static_cast<int32_t *>(pinned);
  expectRefused(pipe, {data, 5}, {"is memory of the host"});
  EXPECT_TRUE(pipe.source(0, std::span<const int32_t>(data, 5)));
  EXPECT_EQ(cuMemFreeHost(pinned), CUDA_SUCCESS);
  // What was refused has changed nothing; nor is the device lost.
  ASSERT_TRUE(bind(pipe));
  ASSERT_TRUE(pipe.run());
  expectScaled();
}

TEST_F(CudaMemory, OfAnotherDevice) {
  HostContext other(1);
  DeviceNumbers far(numbers);
  Pipeline pipe{program, Device{0}}, near{program, Device{1}};
  auto status = pipe.source(0, far.span());
  EXPECT_EQ(status.code(), PIKORT_INVALID_ARGUMENT);
  expectIn(status, {"source 0: expected memory of CUDA device 0 (Piko test "
                    "device), but 0x",
                    " is memory of device 1"});
  ASSERT_TRUE(bind(near));
  ASSERT_TRUE(near.source(0, far.span()));
  ASSERT_TRUE(near.run());
  expectScaled();
}

TEST_F(CudaMemory, BoundAsTheHosts) {
  HostContext host;
  DeviceNumbers made(out);
  Pipeline pipe{program, Device{0}};
  auto *data = made.span().data();
  auto status = pipe.source(0, std::span<const int32_t>(data, 5));
  EXPECT_EQ(status.code(), PIKORT_INVALID_ARGUMENT);
  expectIn(status, {"source 0: expected memory of the host, but 0x",
                    " is memory of a device, which is bound as such"});
  EXPECT_FALSE(pipe.buffer("out", std::span<int32_t>(data, 5)));
}

TEST_F(CudaMemory, ViewsAndCopies) {
  HostContext host;
  DeviceNumbers to(out);
  Pipeline pipe{program, Device{0}};
  EXPECT_TRUE(pipe.deviceView<int32_t>("out").empty());
  ASSERT_TRUE(bind(pipe));
  EXPECT_TRUE(pipe.deviceView<int32_t>("out").empty()); // the host's
  pikort_device_view view;
  EXPECT_EQ(pikort_get_device_view(pipe.get(), "out", &view),
            PIKORT_INVALID_ARGUMENT);
  ASSERT_TRUE(pipe.buffer("out", to.span()));
  EXPECT_EQ(pipe.deviceView<int32_t>("out").address(), to.address);
  ASSERT_TRUE(pipe.run());
  EXPECT_TRUE(pipe.view<int32_t>("out").elements.empty());
  EXPECT_STREQ(pikort_message(pipe.get()),
               "buffer 'out': expected memory of the host, but what is bound "
               "is a device's, which pikort_read copies");
  std::vector<int32_t> copy(5000);
  ASSERT_TRUE(pipe.read("out", std::span(copy)));
  expectScaled(copy);
  auto status = pipe.read("out", std::span(copy).first(10));
  EXPECT_EQ(status.code(), PIKORT_INVALID_ARGUMENT);
  expectIn(status, {"state 'out': expected room for 5000 records, but got some "
                    "for 10"});
  EXPECT_FALSE(pipe.read("out", std::span<int32_t>{}));
  EXPECT_EQ(pipe.read("out", std::span<int64_t>()).code(),
            PIKORT_SIZE_MISMATCH);
}

TEST_F(CudaMemory, AllocatedBuffersStayOnTheDevice) {
  Pipeline pipe{program, Device{0}};
  ASSERT_TRUE(bind(pipe));
  ASSERT_TRUE(pipe.allocate("out", 5000));
  ASSERT_TRUE(pipe.run());
  expectArrays(hostCounts().bytesFromDevice, 0);
  auto view = pipe.deviceView<int32_t>("out");
  EXPECT_EQ(view.width(), 5000);
  EXPECT_EQ(view.height(), 1);
  EXPECT_EQ(view.pitch(), 20000);
  EXPECT_EQ(view.channels, 1);
  EXPECT_EQ(view.type, PIKORT_I32);
  EXPECT_EQ(view.device, 0);
  ASSERT_TRUE(pipe.read("out", std::span(out)));
  expectScaled();
  expectArrays(hostCounts().bytesFromDevice, 1);
}

// A limit of memory has the host between kernels.
TEST_F(CudaMemory, WhereTheHostGoesStepByStep) {
  HostContext host;
  DeviceNumbers from(numbers), to(out);
  Pipeline pipe{program, Device{0}};
  ASSERT_TRUE(bind(pipe));
  ASSERT_TRUE(pipe.memoryLimit(int64_t(1) << 30));
  ASSERT_TRUE(pipe.source(0, from.span()));
  ASSERT_TRUE(pipe.buffer("out", to.span()));
  ASSERT_TRUE(pipe.run());
  expectArrays(hostCounts().bytesFromDevice, 0);
  EXPECT_EQ(hostCounts().bytesOnDevice, 3 * arrayBytes);
  expectScaled(to.get());
}

TEST_F(CudaMemory, OneKindAfterTheOther) {
  HostContext host;
  DeviceNumbers from(numbers), to(out);
  Pipeline pipe{program, Device{0}};
  ASSERT_TRUE(bind(pipe));
  for (int32_t factor : {10, 11, 12}) {
    ASSERT_TRUE(pipe.constant("factor", factor));
    ASSERT_TRUE(pipe.buffer("out", to.span()));
    ASSERT_TRUE(pipe.run());
    expectScaled(to.get(), factor);
    ASSERT_TRUE(pipe.buffer("out", out));
    ASSERT_TRUE(pipe.source(0, from.span()));
    ASSERT_TRUE(pipe.run());
    expectScaled(out, factor);
    ASSERT_TRUE(pipe.source(0, numbers));
    std::fill(out.begin(), out.end(), 0);
  }
}

TEST_F(CudaMemory, WhatIsWrittenIsApart) {
  HostContext host;
  DeviceNumbers both(numbers);
  Pipeline pipe{program, Device{0}};
  ASSERT_TRUE(bind(pipe));
  ASSERT_TRUE(pipe.source(0, both.span()));
  ASSERT_TRUE(pipe.buffer("out", both.span()));
  expectIn(pipe.run(), {"expected buffer 'out', which is written, to be apart "
                        "from source 0, but they share memory"});
}

TEST_F(CudaMemory, TheThreadsContextStays) {
  HostContext other(1);
  DeviceNumbers far(numbers);
  auto isKept = [&] {
    CUcontext current = nullptr;
    EXPECT_EQ(cuCtxGetCurrent(&current), CUDA_SUCCESS);
    return current == other.handle;
  };
  {
    Pipeline pipe{program, Device{0}};
    EXPECT_TRUE(isKept());
    EXPECT_TRUE(bind(pipe) && isKept());
    EXPECT_TRUE(pipe.allocate("out", 5000) && isKept());
    EXPECT_TRUE(pipe.run() && isKept());
    EXPECT_TRUE(!pipe.source(0, far.span()) && isKept());
    EXPECT_TRUE(pipe.read("out", std::span(out)) && isKept());
    EXPECT_TRUE(pipe.runAsync() && isKept());
    EXPECT_TRUE(pipe.isDone() && isKept());
    EXPECT_TRUE(pipe.wait() && isKept());
    strayPointer = true;
    EXPECT_TRUE(!pipe.run() && isKept());
  }
  EXPECT_TRUE(isKept());
  ASSERT_EQ(cuCtxSetCurrent(nullptr), CUDA_SUCCESS);
  strayPointer = false;
  ASSERT_TRUE(scale(1, Device{0}));
  CUcontext current = other.handle;
  EXPECT_EQ(cuCtxGetCurrent(&current), CUDA_SUCCESS);
  EXPECT_EQ(current, nullptr);
  ASSERT_EQ(cuCtxSetCurrent(other.handle), CUDA_SUCCESS);
}

} // namespace
