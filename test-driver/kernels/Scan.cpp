// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Scan.cpp - A scan in one cooperative launch ------------------------===//
//
// 1. Each block scans its part of the numbers, and writes the part's sum.
// 2. Block 0 scans the sums.
// 3. Each block adds the sum of all parts before its own.
//
// All blocks wait for each other between these steps.
//
//===----------------------------------------------------------------------===//

#include "Device.h"

__shared__ static u32 sums[32];

/// All blocks come to it equally often. The counter begins at 0.
[[gnu::noinline]] static void waitForGrid(u32 *counter) {
  __syncthreads();
  if (threadX() == 0) {
    __nvvm_membar_gl();
    u32 ticket = __atomic_fetch_add(counter, 1, __ATOMIC_ACQ_REL);
    u32 target = (ticket / blocksX() + 1) * blocksX();
    while (__atomic_load_n(counter, __ATOMIC_ACQUIRE) < target)
      __nvvm_nanosleep(100);
  }
  __syncthreads();
}

static u32 scanWarp(u32 value) {
  for (u32 distance = 1; distance < 32; distance *= 2) {
    auto other =
        u32(__nvvm_shfl_sync_up_i32(~0u, int(value), int(distance), 0));
    if (threadX() % 32 >= distance)
      value += other;
  }
  return value;
}

/// The sum of the values of all threads up to this one.
static u32 scanBlock(u32 value) {
  u32 sum = scanWarp(value), warp = threadX() / 32, warps = threadsX() / 32;
  if (threadX() % 32 == 31)
    sums[warp] = sum;
  __syncthreads();
  if (warp == 0)
    sums[threadX()] = scanWarp(threadX() < warps ? sums[threadX()] : 0);
  __syncthreads();
  sum += warp ? sums[warp - 1] : 0;
  __syncthreads();
  return sum;
}

static u32 scanPart(const u32 *in, u32 *out, u32 first, u32 last) {
  __shared__ static u32 total;
  u32 before = 0;
  for (u32 start = first; start < last; start += threadsX()) {
    u32 i = start + threadX();
    u32 sum = before + scanBlock(i < last ? in[i] : 0);
    if (i < last)
      out[i] = sum;
    if (threadX() == threadsX() - 1)
      total = sum;
    __syncthreads();
    before = total;
    __syncthreads();
  }
  return before;
}

extern "C" kernel void scan(const u32 *in, u32 *out, u32 count, u32 *parts,
                            u32 *counter) {
  u32 size = (count + blocksX() - 1) / blocksX(), first = blockX() * size;
  u32 last = first + size < count ? first + size : count;
  u32 total = scanPart(in, out, first, last);
  if (threadX() == 0)
    parts[blockX()] = total;
  waitForGrid(counter);
  if (blockX() == 0) {
    u32 sum = scanBlock(threadX() < blocksX() ? parts[threadX()] : 0);
    if (threadX() < blocksX())
      parts[threadX()] = sum;
  }
  waitForGrid(counter);
  for (u32 i = first + threadX(); blockX() && i < last; i += threadsX())
    out[i] += parts[blockX() - 1];
}
