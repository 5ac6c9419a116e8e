// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- DriverCallsTest.cpp - What the driver for tests finds wrong --------===//

#include "test/DriverFixture.h"

#include <array>
#include <dlfcn.h>
#include <elf.h>

using namespace piko::testdriver;

namespace {

class DriverCallsTest : public DriverTest {
protected:
  static std::string error() { return pikoTestDriverError(); }
};

TEST_F(DriverCallsTest, HasEveryFunction) {
#define PIKO_CUDA_FUNCTION(NAME, SYMBOL, PARAMETERS)                           \
  EXPECT_NE(dlsym(RTLD_DEFAULT, SYMBOL), nullptr) << SYMBOL;
#define PIKO_CUDA_OPTIONAL PIKO_CUDA_FUNCTION
#include "cuda/DriverAPI.def"
}

TEST_F(DriverCallsTest, Devices) {
  int count = 0, value = 0;
  CUdevice device = -1;
  EXPECT_EQ(cuDeviceGetCount(&count), CUDA_SUCCESS);
  EXPECT_EQ(count, 1);
  EXPECT_EQ(cuDeviceGet(&device, 0), CUDA_SUCCESS);
  EXPECT_EQ(cuDeviceGet(&device, 1), CUDA_ERROR_INVALID_DEVICE);
  EXPECT_EQ(cuDeviceGetAttribute(
                &value, CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MAJOR, 0),
            CUDA_SUCCESS);
  EXPECT_EQ(value, 9);
  std::array<char, 6> name{};
  EXPECT_EQ(cuDeviceGetName(name.data(), 5, 0), CUDA_SUCCESS);
  EXPECT_STREQ(name.data(), "Piko");
  const char *text = nullptr;
  EXPECT_EQ(cuGetErrorName(CUDA_ERROR_INVALID_PTX, &text), CUDA_SUCCESS);
  EXPECT_STREQ(text, "CUDA_ERROR_INVALID_PTX");
}

TEST_F(DriverCallsTest, NeedsAContext) {
  CUcontext context = nullptr;
  CUdeviceptr address = 0;
  EXPECT_EQ(cuCtxGetCurrent(&context), CUDA_SUCCESS);
  EXPECT_EQ(cuCtxSetCurrent(nullptr), CUDA_SUCCESS);
  EXPECT_EQ(cuMemAlloc(&address, 8), CUDA_ERROR_INVALID_CONTEXT);
  EXPECT_EQ(cuCtxSetCurrent(context), CUDA_SUCCESS);
  EXPECT_EQ(cuMemAlloc(&address, 8), CUDA_SUCCESS);
  EXPECT_EQ(cuMemFree(address), CUDA_SUCCESS);
}

TEST_F(DriverCallsTest, Memory) {
  CUdeviceptr address = 0, managed = 0;
  void *host = nullptr;
  EXPECT_EQ(cuMemAlloc(&address, 0), CUDA_ERROR_INVALID_VALUE);
  EXPECT_EQ(cuMemAlloc(&address, size_t(1) << 40), CUDA_ERROR_OUT_OF_MEMORY);
  ASSERT_EQ(cuMemAlloc(&address, 100), CUDA_SUCCESS);
  // Address space that nothing touches costs nothing.
  ASSERT_EQ(cuMemAllocManaged(&managed, size_t(64) << 30, CU_MEM_ATTACH_GLOBAL),
            CUDA_SUCCESS);
  auto *number = reinterpret_cast<uint64_t *>(managed + (size_t(63) << 30));
  *number = 17;
  ASSERT_EQ(cuMemAllocHost(&host, 100), CUDA_SUCCESS);

  EXPECT_EQ(cuMemcpyHtoDAsync(address, host, 101, nullptr),
            CUDA_ERROR_INVALID_VALUE);
  EXPECT_NE(error().find("byte 0 of an allocation of 100"), error().npos)
      << error();
  EXPECT_EQ(cuMemcpyAsync(address + 92, reinterpret_cast<CUdeviceptr>(number),
                          8, nullptr),
            CUDA_SUCCESS);
  EXPECT_EQ(cuMemsetD8Async(address, 1, 92, nullptr), CUDA_SUCCESS);
  EXPECT_EQ(cuMemcpyDtoHAsync(host, address, 100, nullptr), CUDA_SUCCESS);
  EXPECT_EQ(static_cast<uint8_t *>(host)[91], 1);
  EXPECT_EQ(static_cast<uint8_t *>(host)[92], 17);
  EXPECT_EQ(cuMemPrefetchAsync(managed, 4096, 0, nullptr), CUDA_SUCCESS);
  EXPECT_EQ(cuMemPrefetchAsync(address, 8, 0, nullptr),
            CUDA_ERROR_INVALID_VALUE);

  EXPECT_EQ(cuMemFree(address + 8), CUDA_ERROR_INVALID_VALUE);
  EXPECT_EQ(cuMemFreeHost(reinterpret_cast<void *>(managed)),
            CUDA_ERROR_INVALID_VALUE);
  EXPECT_EQ(cuMemFree(address), CUDA_SUCCESS);
  EXPECT_EQ(cuMemFree(address), CUDA_ERROR_INVALID_VALUE);
  EXPECT_NE(error().find("were freed"), error().npos) << error();
  EXPECT_EQ(cuMemFree(managed), CUDA_SUCCESS);
  EXPECT_EQ(cuMemFreeHost(host), CUDA_SUCCESS);
}

TEST_F(DriverCallsTest, StreamsAndEvents) {
  CUstream stream = nullptr;
  CUevent start = nullptr, end = nullptr;
  float milliseconds = -1;
  ASSERT_EQ(cuStreamCreate(&stream, CU_STREAM_NON_BLOCKING), CUDA_SUCCESS);
  ASSERT_EQ(cuEventCreate(&start, CU_EVENT_DEFAULT), CUDA_SUCCESS);
  ASSERT_EQ(cuEventCreate(&end, CU_EVENT_DEFAULT), CUDA_SUCCESS);
  EXPECT_EQ(cuEventRecord(start, stream), CUDA_SUCCESS);
  EXPECT_EQ(cuEventElapsedTime(&milliseconds, start, end),
            CUDA_ERROR_INVALID_HANDLE);
  EXPECT_EQ(cuEventRecord(end, stream), CUDA_SUCCESS);
  EXPECT_EQ(cuEventElapsedTime(&milliseconds, start, end), CUDA_SUCCESS);
  EXPECT_GE(milliseconds, 0);
  EXPECT_EQ(cuStreamSynchronize(stream), CUDA_SUCCESS);
  EXPECT_EQ(cuStreamDestroy(stream), CUDA_SUCCESS);
  EXPECT_EQ(cuStreamSynchronize(stream), CUDA_ERROR_INVALID_HANDLE);
  EXPECT_EQ(cuEventDestroy(start), CUDA_SUCCESS);
  EXPECT_EQ(cuEventDestroy(start), CUDA_ERROR_INVALID_HANDLE);
  EXPECT_EQ(cuEventDestroy(end), CUDA_SUCCESS);
}

TEST_F(DriverCallsTest, WhereMemoryLies) {
  CUdeviceptr device = 0, managed = 0;
  void *hosts = nullptr;
  ASSERT_EQ(cuMemAlloc(&device, 100), CUDA_SUCCESS);
  ASSERT_EQ(cuMemAllocManaged(&managed, 8, CU_MEM_ATTACH_GLOBAL), CUDA_SUCCESS);
  ASSERT_EQ(cuMemAllocHost(&hosts, 8), CUDA_SUCCESS);
  auto look = [](CUdeviceptr at, uint32_t type, bool isManaged, uint64_t begin,
                 uint64_t bytes) {
    CUpointer_attribute which[] = {
        CU_POINTER_ATTRIBUTE_MEMORY_TYPE, CU_POINTER_ATTRIBUTE_IS_MANAGED,
        CU_POINTER_ATTRIBUTE_RANGE_START_ADDR, CU_POINTER_ATTRIBUTE_RANGE_SIZE};
    uint64_t found[4] = {};
    void *values[] = {&found[0], &found[1], &found[2], &found[3]};
    EXPECT_EQ(cuPointerGetAttributes(4, which, values, at), CUDA_SUCCESS);
    EXPECT_EQ(found[0], type);
    EXPECT_EQ(found[1], uint64_t(isManaged));
    EXPECT_EQ(found[2], begin);
    EXPECT_EQ(found[3], bytes);
  };
  look(device + 99, CU_MEMORYTYPE_DEVICE, false, device, 100);
  look(device + 100, 0, false, 0, 0);
  look(managed, CU_MEMORYTYPE_DEVICE, true, managed, 8);
  look(reinterpret_cast<uint64_t>(hosts), CU_MEMORYTYPE_HOST, false,
       reinterpret_cast<uint64_t>(hosts), 8);
  look(reinterpret_cast<uint64_t>(&device), 0, false, 0, 0);
  EXPECT_EQ(cuPointerGetAttributes(1, nullptr, nullptr, device),
            CUDA_ERROR_INVALID_VALUE);
  EXPECT_EQ(cuMemFree(device), CUDA_SUCCESS);
  EXPECT_EQ(cuMemFree(managed), CUDA_SUCCESS);
  EXPECT_EQ(cuMemFreeHost(hosts), CUDA_SUCCESS);
}

TEST_F(DriverCallsTest, ContextsOfStreams) {
  CUstream stream = nullptr;
  CUcontext context = nullptr, own = nullptr;
  ASSERT_EQ(cuCtxGetCurrent(&own), CUDA_SUCCESS);
  ASSERT_EQ(cuStreamCreate(&stream, CU_STREAM_NON_BLOCKING), CUDA_SUCCESS);
  for (CUstream each : {stream, CUstream(), CU_STREAM_PER_THREAD}) {
    EXPECT_EQ(cuStreamGetCtx(each, &context), CUDA_SUCCESS);
    EXPECT_EQ(context, own);
  }
  EXPECT_EQ(cuStreamDestroy(stream), CUDA_SUCCESS);
  EXPECT_EQ(cuStreamGetCtx(stream, &context), CUDA_ERROR_INVALID_HANDLE);
}

/// Two streams that do what they have to when they are waited for.
class Delayed : public DriverCallsTest {
protected:
  void SetUp() override {
    DriverCallsTest::SetUp();
    pikoTestDriverDelay(1);
    ASSERT_EQ(cuMemAllocManaged(&address, 8, CU_MEM_ATTACH_GLOBAL),
              CUDA_SUCCESS);
    bytes = reinterpret_cast<volatile uint8_t *>(address);
    for (int i = 0; i < 8; ++i)
      bytes[i] = 0;
    for (CUstream &stream : streams)
      ASSERT_EQ(cuStreamCreate(&stream, CU_STREAM_NON_BLOCKING), CUDA_SUCCESS);
  }
  void TearDown() override {
    for (CUstream stream : streams)
      EXPECT_EQ(cuStreamDestroy(stream), CUDA_SUCCESS);
    EXPECT_EQ(cuMemFree(address), CUDA_SUCCESS);
    pikoTestDriverDelay(0);
    DriverCallsTest::TearDown();
  }
  void fill(int at, int stream) {
    ASSERT_EQ(cuMemsetD8Async(address + at, 1, 1, streams[stream]),
              CUDA_SUCCESS);
  }

  CUdeviceptr address = 0;
  volatile uint8_t *bytes = nullptr;
  CUstream streams[2] = {};
};

TEST_F(Delayed, UntilTheHostWaits) {
  CUevent event = nullptr;
  ASSERT_EQ(cuEventCreate(&event, CU_EVENT_DISABLE_TIMING), CUDA_SUCCESS);
  EXPECT_EQ(cuEventQuery(event), CUDA_SUCCESS);
  fill(0, 0);
  ASSERT_EQ(cuEventRecord(event, streams[0]), CUDA_SUCCESS);
  fill(1, 0);
  fill(2, 1);
  EXPECT_EQ(cuEventQuery(event), CUDA_ERROR_NOT_READY);
  EXPECT_EQ(bytes[0], 0);
  EXPECT_EQ(cuEventSynchronize(event), CUDA_SUCCESS);
  EXPECT_EQ(cuEventQuery(event), CUDA_SUCCESS);
  EXPECT_EQ(bytes[0], 1);
  EXPECT_EQ(bytes[1], 0);
  EXPECT_EQ(cuStreamSynchronize(streams[0]), CUDA_SUCCESS);
  EXPECT_EQ(bytes[1], 1);
  EXPECT_EQ(bytes[2], 0);
  EXPECT_EQ(cuCtxSynchronize(), CUDA_SUCCESS);
  EXPECT_EQ(bytes[2], 1);
  EXPECT_EQ(cuEventDestroy(event), CUDA_SUCCESS);
}

// What is not pinned is copied in the call.
TEST_F(Delayed, CopiesOfTheHostsMemory) {
  uint8_t from = 5, to = 0;
  ASSERT_EQ(cuMemcpyHtoDAsync(address, &from, 1, streams[0]), CUDA_SUCCESS);
  from = 6;
  EXPECT_EQ(bytes[0], 0);
  ASSERT_EQ(cuMemcpyDtoHAsync(&to, address, 1, streams[0]), CUDA_SUCCESS);
  EXPECT_EQ(to, 5);
  PikoTestDriverHostCounts counts;
  pikoTestDriverHostCounts(&counts);
  EXPECT_EQ(counts.bytesToDevice, 1u);
  EXPECT_EQ(counts.bytesFromDevice, 1u);
}

TEST_F(DriverCallsTest, LaunchesThatCannotBe) {
  CUfunction function = load(R"(
.version 7.8
.target sm_70
.address_size 64
.visible .entry k(.param .u32 k_param_0)
.maxntid 64, 1, 1
{
  .shared .align 4 .b8 memory[40000];
  ret;
}
)");
  int value = 0;
  EXPECT_EQ(
      cuFuncGetAttribute(&value, CU_FUNC_ATTRIBUTE_SHARED_SIZE_BYTES, function),
      CUDA_SUCCESS);
  EXPECT_EQ(value, 40000);
  EXPECT_EQ(
      cuOccupancyMaxActiveBlocksPerMultiprocessor(&value, function, 64, 0),
      CUDA_SUCCESS);
  EXPECT_EQ(value, 5);
  auto run = [&](unsigned blocks, unsigned threads, unsigned shared) {
    int parameter = 0;
    void *parameters[] = {&parameter};
    return cuLaunchKernel(function, blocks, 1, 1, threads, 1, 1, shared,
                          nullptr, parameters, nullptr);
  };
  EXPECT_EQ(run(1, 64, 0), CUDA_SUCCESS);
  EXPECT_EQ(run(0, 64, 0), CUDA_ERROR_INVALID_VALUE);
  EXPECT_EQ(run(1, 65, 0), CUDA_ERROR_INVALID_VALUE);
  EXPECT_EQ(run(1, 1025, 0), CUDA_ERROR_INVALID_VALUE);
  EXPECT_EQ(run(1, 64, 10000), CUDA_ERROR_INVALID_VALUE);
  EXPECT_EQ(
      cuLaunchKernel(function, 1, 1, 1, 1, 1, 1, 0, nullptr, nullptr, nullptr),
      CUDA_ERROR_INVALID_VALUE);
  unload();
  EXPECT_EQ(run(1, 64, 0), CUDA_ERROR_INVALID_HANDLE);
}

TEST_F(DriverCallsTest, ModulesThatAreNotValid) {
  CUmodule loaded = nullptr;
  Elf64_Ehdr elf{};
  std::memcpy(elf.e_ident, ELFMAG, SELFMAG);
  EXPECT_EQ(cuModuleLoadDataEx(&loaded, &elf, 0, nullptr, nullptr),
            CUDA_ERROR_INVALID_IMAGE);
  elf.e_ident[EI_CLASS] = ELFCLASS64;
  elf.e_machine = 190;
  elf.e_flags = 0x56;
  EXPECT_EQ(cuModuleLoadDataEx(&loaded, &elf, 0, nullptr, nullptr),
            CUDA_ERROR_NO_BINARY_FOR_GPU);
  EXPECT_NE(error().find("a cubin for sm_86"), error().npos) << error();
  elf.e_ident[EI_ABIVERSION] = 8;
  elf.e_flags = 0x6005a04;
  EXPECT_EQ(cuModuleLoadDataEx(&loaded, &elf, 0, nullptr, nullptr),
            CUDA_ERROR_NO_BINARY_FOR_GPU);
  EXPECT_NE(error().find("a cubin for sm_90"), error().npos) << error();
  EXPECT_EQ(cuModuleLoadDataEx(&loaded,
                               ".version 7.8 .target sm_100 .address_size 64",
                               0, nullptr, nullptr),
            CUDA_ERROR_NO_BINARY_FOR_GPU);
  EXPECT_EQ(cuModuleLoadDataEx(&loaded,
                               ".version 99.0 .target sm_70 .address_size 64",
                               0, nullptr, nullptr),
            CUDA_ERROR_UNSUPPORTED_PTX_VERSION);
  CUfunction function = load(kernel(""));
  EXPECT_EQ(cuModuleGetFunction(&function, module, "other"),
            CUDA_ERROR_NOT_FOUND);
}

TEST_F(DriverCallsTest, TextsOfErrorsOfModules) {
  const std::pair<std::string, std::string> errors[] = {
      {"frob.b32 %r5, %r6;",
       "line 23: expected an instruction that is known in "
       "'frob.b32'"},
      {"add.weird.s32 %r5, %r6, %r7;",
       "line 23: expected an instruction that is known, but got '.weird' in "
       "'add.weird.s32'"},
      {"add.s32 %r5, %r6;",
       "line 23: expected 3 operands, but got 2 in 'add.s32'"},
      {"add.s32 %rd5, %r6, %r7;",
       "line 23: expected a register of 32 bits, but got '%rd5' of 64 in "
       "'add.s32'"},
      {"bra NOWHERE;",
       "line 23: expected a label that is there, but got 'NOWHERE'"},
      {".frob 5;", "line 23: expected a directive that is known, but got "
                   "'.frob'"},
      {"st.global.b32 [%rd4], %r5", "line 24: expected ';', but got 'ret'"}};
  for (const auto &[code, text] : errors)
    EXPECT_EQ(loadError(kernel(code)), text);
  EXPECT_NE(loadError(kernel("mov.b64 %rd6, missing;")).find("'missing'"),
            std::string::npos);
  EXPECT_NE(loadError(kernel("mov.b32 %r5, %frob;")).find("'%frob'"),
            std::string::npos);
  EXPECT_EQ(loadError(".version 7.8\n.target sm_70\n.texref x;"),
            "line 3: expected a directive that is known, but got '.texref'");
}

TEST_F(DriverCallsTest, FailuresOnDemand) {
  CUdeviceptr address = 0;
  pikoTestDriverFail("cuMemAlloc", 2, CUDA_ERROR_OUT_OF_MEMORY);
  EXPECT_EQ(cuMemAlloc(&address, 8), CUDA_SUCCESS);
  EXPECT_EQ(cuMemFree(address), CUDA_SUCCESS);
  EXPECT_EQ(cuMemAlloc(&address, 8), CUDA_ERROR_OUT_OF_MEMORY);
  EXPECT_EQ(error(), "cuMemAlloc: CUDA_ERROR_OUT_OF_MEMORY: made to fail");
  pikoTestDriverFail(nullptr, 1, CUDA_ERROR_UNKNOWN);
  EXPECT_EQ(cuCtxSynchronize(), CUDA_ERROR_UNKNOWN);
  EXPECT_EQ(cuCtxSynchronize(), CUDA_SUCCESS);
  EXPECT_EQ(pikoTestDriverCalls("cuMemAlloc"), 2u);
  EXPECT_EQ(pikoTestDriverCalls("cuCtxSynchronize"), 2u);
}

TEST_F(DriverCallsTest, Leaks) {
  expectsLeaks = true;
  CUdeviceptr address = 0;
  CUstream stream = nullptr;
  CUevent event = nullptr;
  load(kernel(""));
  ASSERT_EQ(cuMemAlloc(&address, 24), CUDA_SUCCESS);
  ASSERT_EQ(cuStreamCreate(&stream, 0), CUDA_SUCCESS);
  ASSERT_EQ(cuEventCreate(&event, 0), CUDA_SUCCESS);
  const char *text =
      "24 bytes of device memory\nmodule k\n1 streams\n1 events\n";
  EXPECT_STREQ(pikoTestDriverAlive(), text);
  renewContext();
  EXPECT_STREQ(pikoTestDriverLeaks(), text);
  EXPECT_STREQ(pikoTestDriverAlive(), "");
  EXPECT_EQ(cuStreamSynchronize(stream), CUDA_ERROR_INVALID_HANDLE);
}

} // namespace
