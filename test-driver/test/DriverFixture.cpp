// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- DriverFixture.cpp - Kernels in tests of the driver for tests -------===//

#include "test/DriverFixture.h"

#include <algorithm>

using namespace piko::testdriver;

void DriverTest::SetUp() {
  pikoTestDriverReset();
  CUcontext context = nullptr;
  ASSERT_EQ(cuInit(0), CUDA_SUCCESS);
  ASSERT_EQ(cuDevicePrimaryCtxRetain(&context, 0), CUDA_SUCCESS);
  ASSERT_EQ(cuCtxSetCurrent(context), CUDA_SUCCESS);
}

void DriverTest::TearDown() {
  unload();
  EXPECT_EQ(cuDevicePrimaryCtxRelease(0), CUDA_SUCCESS);
  if (!expectsLeaks) {
    EXPECT_STREQ(pikoTestDriverLeaks(), "");
  }
  pikoTestDriverReset();
}

void DriverTest::renewContext() {
  module = nullptr;
  CUcontext context = nullptr;
  ASSERT_EQ(cuDevicePrimaryCtxRelease(0), CUDA_SUCCESS);
  ASSERT_EQ(cuDevicePrimaryCtxRetain(&context, 0), CUDA_SUCCESS);
  ASSERT_EQ(cuCtxSetCurrent(context), CUDA_SUCCESS);
}

std::string DriverTest::kernel(const std::string &body,
                               const std::string &before) {
  return R"(
.version 7.8
.target sm_70
.address_size 64
)" + before +
         R"(
.visible .entry k(.param .u64 k_param_0, .param .u64 k_param_1)
{
  .reg .pred %p<20>;
  .reg .b16 %rs<20>;
  .reg .b32 %r<40>;
  .reg .b64 %rd<40>;
  .reg .f32 %f<20>;
  .reg .f64 %fd<20>;
  ld.param.b64 %rd1, [k_param_0];
  ld.param.b64 %rd2, [k_param_1];
  mov.u32 %r1, %tid.x;
  mov.u32 %r2, %ctaid.x;
  mov.u32 %r3, %ntid.x;
  mad.lo.s32 %r4, %r2, %r3, %r1;
  mul.wide.u32 %rd5, %r4, 8;
  add.s64 %rd3, %rd1, %rd5;
  add.s64 %rd4, %rd2, %rd5;
)" + body +
         "\n  ret;\n}\n";
}

CUfunction DriverTest::load(const std::string &source, const char *name) {
  unload();
  CUfunction function = nullptr;
  EXPECT_EQ(cuModuleLoadDataEx(&module, source.c_str(), 0, nullptr, nullptr),
            CUDA_SUCCESS)
      << pikoTestDriverError();
  if (module) {
    EXPECT_EQ(cuModuleGetFunction(&function, module, name), CUDA_SUCCESS)
        << pikoTestDriverError();
  }
  return function;
}

CUfunction DriverTest::loadForCapture(const char *name) {
  CUfunction function = nullptr;
  int registers = 0;
  EXPECT_EQ(cuModuleGetFunction(&function, module, name), CUDA_SUCCESS)
      << pikoTestDriverError();
  EXPECT_EQ(
      cuFuncGetAttribute(&registers, CU_FUNC_ATTRIBUTE_NUM_REGS, function),
      CUDA_SUCCESS)
      << pikoTestDriverError();
  return function;
}

std::string DriverTest::loadError(const std::string &source) {
  std::string text(1000, '\0');
  CUjit_option options[] = {CU_JIT_ERROR_LOG_BUFFER,
                            CU_JIT_ERROR_LOG_BUFFER_SIZE_BYTES};
  void *values[] = {text.data(), reinterpret_cast<void *>(text.size())};
  CUmodule loaded = nullptr;
  CUresult result =
      cuModuleLoadDataEx(&loaded, source.c_str(), 2, options, values);
  if (result == CUDA_SUCCESS) {
    cuModuleUnload(loaded);
    return "";
  }
  EXPECT_EQ(result, CUDA_ERROR_INVALID_PTX);
  text.resize(reinterpret_cast<size_t>(values[1]));
  return text;
}

void DriverTest::unload() {
  if (module) {
    EXPECT_EQ(cuModuleUnload(module), CUDA_SUCCESS);
  }
  module = nullptr;
}

static std::vector<void *> placesOf(std::vector<uint64_t> &parameters) {
  std::vector<void *> places;
  for (uint64_t &parameter : parameters)
    places.push_back(&parameter);
  return places;
}

CUresult DriverTest::launchTogether(CUfunction function, unsigned blocks,
                                    unsigned threads,
                                    std::vector<uint64_t> parameters) {
  CUresult result =
      cuLaunchCooperativeKernel(function, blocks, 1, 1, threads, 1, 1, 0,
                                nullptr, placesOf(parameters).data());
  return result ? result : cuCtxSynchronize();
}

CUresult DriverTest::launch(CUfunction function, unsigned blocks,
                            unsigned threads,
                            std::vector<uint64_t> parameters) {
  CUresult result =
      cuLaunchKernel(function, blocks, 1, 1, threads, 1, 1, 0, nullptr,
                     placesOf(parameters).data(), nullptr);
  return result ? result : cuCtxSynchronize();
}

std::vector<uint64_t> DriverTest::run(const std::string &body,
                                      std::vector<uint64_t> in,
                                      unsigned threads, unsigned blocks,
                                      const std::string &before) {
  CUfunction function = load(kernel(body, before));
  if (!function)
    return {};
  std::vector<uint64_t> out(size_t(threads) * blocks);
  in.resize(std::max(in.size(), out.size()));
  const size_t bytes = in.size() * sizeof(uint64_t);
  CUdeviceptr from = 0, to = 0;
  EXPECT_EQ(cuMemAlloc(&from, bytes), CUDA_SUCCESS);
  EXPECT_EQ(cuMemAlloc(&to, bytes), CUDA_SUCCESS);
  EXPECT_EQ(cuMemcpyHtoDAsync(from, in.data(), bytes, nullptr), CUDA_SUCCESS);
  EXPECT_EQ(cuMemsetD8Async(to, 0, bytes, nullptr), CUDA_SUCCESS);
  EXPECT_EQ(launch(function, blocks, threads, {from, to}), CUDA_SUCCESS)
      << pikoTestDriverError();
  EXPECT_EQ(
      cuMemcpyDtoHAsync(out.data(), to, out.size() * sizeof(uint64_t), nullptr),
      CUDA_SUCCESS);
  EXPECT_EQ(cuMemFree(from), CUDA_SUCCESS);
  EXPECT_EQ(cuMemFree(to), CUDA_SUCCESS);
  unload();
  return out;
}
