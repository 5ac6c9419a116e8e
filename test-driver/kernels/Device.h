// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Device.h - Device code in plain C++ --------------------------------===//
//
// Clang's builtins for a GPU need neither the CUDA language nor its headers.
// Atomic operations that read and write have no order in the PTX of LLVM 22,
// whatever they say (loads, stores, fences and compare and swap have theirs):
// what needs one has a fence beside it.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_TEST_DRIVER_KERNELS_DEVICE_H
#define PIKO_TEST_DRIVER_KERNELS_DEVICE_H

using u32 = unsigned;
using u64 = unsigned long long;

#define kernel [[clang::nvptx_kernel]]
#define __device__ __attribute__((address_space(1)))
#define __shared__ __attribute__((address_space(3)))
#define __constant__ __attribute__((address_space(4)))

inline u32 threadX() { return __nvvm_read_ptx_sreg_tid_x(); }
inline u32 threadsX() { return __nvvm_read_ptx_sreg_ntid_x(); }
inline u32 blockX() { return __nvvm_read_ptx_sreg_ctaid_x(); }
inline u32 blocksX() { return __nvvm_read_ptx_sreg_nctaid_x(); }

#endif // PIKO_TEST_DRIVER_KERNELS_DEVICE_H
