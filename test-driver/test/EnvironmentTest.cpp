// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- EnvironmentTest.cpp - The test driver's environment ----------------===//
//
// CMakeLists.txt sets the variables.
//
//===----------------------------------------------------------------------===//

#include "Symbols.h"
#include "TestDriver.h"

#include <gtest/gtest.h>

using namespace piko::cuda;

TEST(EnvironmentTest, IsRead) {
  int value = 0;
  CUcontext context = nullptr;
  CUdeviceptr address = 0, other = 0;
  size_t free = 0, total = 0;
  CUmodule module = nullptr;
  ASSERT_EQ(cuInit(0), CUDA_SUCCESS);
  EXPECT_EQ(cuDeviceGetCount(&value), CUDA_SUCCESS);
  EXPECT_EQ(value, 2);
  EXPECT_EQ(cuDeviceGetAttribute(
                &value, CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MINOR, 1),
            CUDA_SUCCESS);
  EXPECT_EQ(value, 5);
  EXPECT_EQ(
      cuDeviceGetAttribute(&value, CU_DEVICE_ATTRIBUTE_MULTIPROCESSOR_COUNT, 0),
      CUDA_SUCCESS);
  EXPECT_EQ(value, 132);
  ASSERT_EQ(cuDevicePrimaryCtxRetain(&context, 1), CUDA_SUCCESS);
  ASSERT_EQ(cuCtxSetCurrent(context), CUDA_SUCCESS);
  EXPECT_EQ(cuModuleLoadDataEx(&module,
                               ".version 7.8 .target sm_80 .address_size 64", 0,
                               nullptr, nullptr),
            CUDA_ERROR_NO_BINARY_FOR_GPU);

  EXPECT_EQ(cuMemAlloc(&address, 600), CUDA_SUCCESS);
  EXPECT_EQ(cuMemAlloc(&other, 401), CUDA_ERROR_OUT_OF_MEMORY);
  EXPECT_STREQ(pikoTestDriverError(),
               "cuMemAlloc: CUDA_ERROR_OUT_OF_MEMORY: 401 bytes, and 600 of "
               "1000 are taken");
  EXPECT_EQ(cuMemAlloc(&other, 400), CUDA_SUCCESS);
  EXPECT_EQ(cuMemGetInfo(&free, &total), CUDA_SUCCESS);
  EXPECT_EQ(free, 0u);
  EXPECT_EQ(total, 1000u);

  EXPECT_EQ(cuMemFree(address), CUDA_SUCCESS);
  EXPECT_EQ(cuMemFree(other), CUDA_ERROR_INVALID_VALUE);
  EXPECT_EQ(cuMemFree(other), CUDA_SUCCESS);
  EXPECT_EQ(cuCtxSynchronize(), CUDA_ERROR_UNKNOWN);
  EXPECT_EQ(cuCtxSynchronize(), CUDA_SUCCESS);
  // As a kernel's, it stays.
  EXPECT_EQ(cuCtxSynchronize(), CUDA_ERROR_ILLEGAL_ADDRESS);
  EXPECT_EQ(cuCtxSynchronize(), CUDA_ERROR_ILLEGAL_ADDRESS);
  EXPECT_EQ(cuDevicePrimaryCtxRelease(1), CUDA_SUCCESS);
  EXPECT_STREQ(pikoTestDriverLeaks(), "");
}
