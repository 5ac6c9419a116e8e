//===- cuda.h - The part of the driver API that tests need ----------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// For applications that include NVIDIA's header, where there is no toolkit.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_TEST_CUDA_H
#define PIKO_TEST_CUDA_H

#include <cstddef>

extern "C" {
typedef int CUdevice, CUresult;
typedef unsigned long long CUdeviceptr;
typedef struct CUctx_st *CUcontext;
typedef struct CUmod_st *CUmodule;
typedef struct CUfunc_st *CUfunction;
typedef struct CUstream_st *CUstream;
enum { CUDA_SUCCESS = 0, CU_STREAM_NON_BLOCKING = 1 };

CUresult cuInit(unsigned);
CUresult cuGetErrorName(CUresult, const char **);
CUresult cuDeviceGet(CUdevice *, int);
CUresult cuDevicePrimaryCtxRetain(CUcontext *, CUdevice);
CUresult
    cuDevicePrimaryCtxRelease(CUdevice) __asm__("cuDevicePrimaryCtxRelease_v2");
CUresult cuCtxSetCurrent(CUcontext);
CUresult cuModuleLoadDataEx(CUmodule *, const void *, unsigned, void *, void *);
CUresult cuModuleUnload(CUmodule);
CUresult cuModuleGetFunction(CUfunction *, CUmodule, const char *);
CUresult cuMemAlloc(CUdeviceptr *, size_t) __asm__("cuMemAlloc_v2");
CUresult cuMemFree(CUdeviceptr) __asm__("cuMemFree_v2");
CUresult cuMemcpyHtoDAsync(CUdeviceptr, const void *, size_t,
                           CUstream) __asm__("cuMemcpyHtoDAsync_v2");
CUresult cuMemcpyDtoHAsync(void *, CUdeviceptr, size_t,
                           CUstream) __asm__("cuMemcpyDtoHAsync_v2");
CUresult cuStreamCreate(CUstream *, unsigned);
CUresult cuStreamDestroy(CUstream) __asm__("cuStreamDestroy_v2");
CUresult cuStreamSynchronize(CUstream);
CUresult cuLaunchKernel(CUfunction, unsigned, unsigned, unsigned, unsigned,
                        unsigned, unsigned, unsigned, CUstream, void **,
                        void **);
}

#endif // PIKO_TEST_CUDA_H
