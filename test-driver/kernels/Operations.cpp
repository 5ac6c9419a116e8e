// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Operations.cpp - What device code of clang may hold ----------------===//
//
// Kernels that write numbers which CompiledKernelsTest.cpp knows.
//
//===----------------------------------------------------------------------===//

#include "Device.h"

__constant__ extern const u32 weights[4] = {1, 10, 100, 1000};
__device__ u32 table[4] = {7, 11, 13, 17};
__device__ u32 *pointer = table + 2;
__shared__ static u32 words[64];

/// Atomic operations of all threads on out[0..7], one of them a loop of
/// compare and swap.
extern "C" kernel void atomics(u32 *out, u64 *wide) {
  u32 number = blockX() * threadsX() + threadX();
  __nvvm_atom_add_gen_i(reinterpret_cast<int *>(out), 1);
  __atomic_fetch_max(out + 1, number, __ATOMIC_RELAXED);
  __atomic_fetch_min(out + 2, number, __ATOMIC_RELAXED);
  __atomic_fetch_or(out + 3, 1u << number % 32, __ATOMIC_RELAXED);
  __atomic_fetch_and(out + 4, ~(1u << number % 32), __ATOMIC_RELAXED);
  __atomic_fetch_xor(out + 5, number, __ATOMIC_RELAXED);
  u32 seen = __atomic_load_n(out + 6, __ATOMIC_RELAXED);
  while (!__atomic_compare_exchange_n(out + 6, &seen, seen + number, true,
                                      __ATOMIC_ACQ_REL, __ATOMIC_ACQUIRE))
    ;
  __atomic_exchange_n(out + 7, 5u, __ATOMIC_SEQ_CST);
  __atomic_fetch_add(wide, u64(number) << 32, __ATOMIC_SEQ_CST);
  __atomic_fetch_max(wide + 1, u64(number) << 33, __ATOMIC_RELAXED);
}

/// The last thread to say so reads what all have written.
extern "C" kernel void lastThread(u32 *out, u32 *counter, u32 *result) {
  u32 number = blockX() * threadsX() + threadX(), all = blocksX() * threadsX();
  *const_cast<volatile u32 *>(out + number) = number;
  __nvvm_membar_gl();
  if (__atomic_fetch_add(counter, 1, __ATOMIC_ACQ_REL) != all - 1)
    return;
  __atomic_thread_fence(__ATOMIC_ACQUIRE);
  u32 sum = 0;
  for (u32 i = 0; i < all; ++i)
    sum += *const_cast<volatile u32 *>(out + i);
  __atomic_thread_fence(__ATOMIC_SEQ_CST);
  __atomic_store_n(result, sum, __ATOMIC_RELEASE);
}

/// Ten numbers of each thread of a warp.
extern "C" kernel void warpOperations(u32 *out) {
  u32 lane = threadX();
  u32 *mine = out + 10 * lane;
  mine[0] = __nvvm_vote_ballot_sync(~0u, lane % 3 == 0);
  mine[1] = __nvvm_vote_all_sync(~0u, lane < 32);
  mine[2] = __nvvm_vote_any_sync(~0u, lane == 40);
  mine[3] = __nvvm_match_any_sync_i32(~0u, lane / 8);
  mine[4] = __nvvm_shfl_sync_idx_i32(~0u, int(lane * lane), 5, 31);
  mine[5] = __nvvm_shfl_sync_bfly_i32(~0u, int(lane), 1, 31);
  mine[6] = __nvvm_shfl_sync_down_i32(~0u, int(lane), 4, 31);
  mine[7] = __builtin_popcount(__nvvm_vote_ballot_sync(~0u, lane & 1) &
                               __nvvm_read_ptx_sreg_lanemask_lt());
  mine[8] = u32(__nvvm_bar0_popc(lane < 5));
  mine[9] = u32(__nvvm_bar0_or(lane == 31));
}

/// Eight numbers of each thread.
extern "C" kernel void bits(u32 *out, const u32 *in) {
  u32 value = in[threadX()];
  u32 *mine = out + 8 * threadX();
  mine[0] = u32(__builtin_popcount(value));
  mine[1] = u32(__builtin_clz(value | 1));
  mine[2] = u32(__builtin_ctz(value | 1u << 31));
  mine[3] = __builtin_bitreverse32(value);
  mine[4] = __builtin_bswap32(value);
  mine[5] = u32((u64(value) * weights[value % 4]) >> 7);
  mine[6] = (value << 9 | value >> 23) + table[value & 3] * value;
  mine[7] = pointer[value & 1];
}

[[gnu::noinline]] static u64 collatz(u32 value, u32 *steps) {
  u64 largest = value;
  for (u64 it = value; it != 1; ++*steps) {
    it = it % 2 ? 3 * it + 1 : it / 2;
    largest = it > largest ? it : largest;
  }
  return largest;
}

/// A function that is called, arrays of a block and of a thread.
extern "C" kernel void memories(u32 *out) {
  u32 steps = 0, mine[8];
  auto largest = u32(collatz(threadX() + 1, &steps));
  for (u32 i = 0; i < 8; ++i)
    mine[i] = steps * i;
  words[threadX()] = mine[largest % 8];
  __syncthreads();
  out[threadX()] = words[threadsX() - 1 - threadX()] + largest;
}
