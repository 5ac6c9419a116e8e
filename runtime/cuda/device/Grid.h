// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Grid.h - Threads of a device that work together --------------------===//
//
// A grid of blocks that are all resident: they meet at barriers. What is said
// to be uniform has the same value in all threads.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CUDA_DEVICE_GRID_H
#define PIKO_RUNTIME_CUDA_DEVICE_GRID_H

#include "cuda/device/Joins.h"

#define PIKO_BLOCK_MEMORY __attribute__((address_space(3)))

namespace piko::cuda {

template <class T> T smaller(T a, T b) { return b < a ? b : a; }
template <class T> T larger(T a, T b) { return a < b ? b : a; }
inline int64_t ceilDivide(int64_t a, int64_t b) { return (a + b - 1) / b; }

constexpr int32_t warpSize = 32, warpsOfBlock = joinThreads / warpSize;

inline PIKO_BLOCK_MEMORY uint64_t blockWords[joinThreads];
inline PIKO_BLOCK_MEMORY uint32_t warpWords[warpsOfBlock];

class Grid {
public:
  /// Memory is taken from `cursor` on.
  Grid(FrameState &frame, int64_t cursor)
      : frame_(frame), top_(cursor), limit_(frame.log.limit) {}

  static int64_t block() { return __nvvm_read_ptx_sreg_ctaid_x(); }
  static int64_t blocks() { return __nvvm_read_ptx_sreg_nctaid_x(); }
  static int32_t thread() {
    return static_cast<int32_t>(__nvvm_read_ptx_sreg_tid_x());
  }
  static int32_t lane() { return thread() % warpSize; }
  static bool isFirst() { return block() == 0 && thread() == 0; }
  static int64_t index() { return block() * joinThreads + thread(); }
  static int64_t size() { return blocks() * joinThreads; }

  /// Calls body(i) for numbers below n, which is uniform.
  template <class Body> static void forEach(int64_t n, const Body &body) {
    for (int64_t i = index(); i < n; i += size())
      body(i);
  }

  /// A barrier of all threads: what was written in front of it is seen behind.
  [[gnu::noinline]] void sync() {
    __syncthreads();
    if (thread() == 0) {
      __nvvm_membar_gl();
      auto all = static_cast<uint32_t>(blocks());
      uint32_t before =
          __atomic_fetch_add(&frame_.arrived, 1u, __ATOMIC_RELAXED);
      uint32_t target = (before / all + 1) * all;
      while (static_cast<int32_t>(
                 __atomic_load_n(&frame_.arrived, __ATOMIC_RELAXED) - target) <
             0)
        __nvvm_nanosleep(32);
      __nvvm_membar_gl();
    }
    __syncthreads();
  }

  /// Memory that all threads see, not initialised; uniform. Null, and
  /// hasFailed, where there is none.
  template <class T> T *take(int64_t count) {
    int64_t bytes = (count * static_cast<int64_t>(sizeof(T)) + 63) / 64 * 64;
    if (count < 0 || bytes > limit_ - top_)
      failed_ = true;
    if (failed_)
      return nullptr;
    top_ += bytes;
    return reinterpret_cast<T *>(top_ - bytes);
  }
  /// The same, zero; behind a barrier.
  uint32_t *takeZeros(int64_t count) {
    uint32_t *words = take<uint32_t>(count);
    if (words)
      forEach(count, [&](int64_t i) { words[i] = 0; });
    sync();
    return words;
  }
  void fail() { failed_ = true; }         ///< Uniform.
  void failFrame() { frame_.failed = 1; } ///< By any thread.
  bool hasFailed() const { return failed_; }
  int64_t top() const { return top_; }

  /// Each number becomes the sum of those before it; returns the sum of all,
  /// uniform. Fails where that has more than 32 bits. Between two barriers.
  int64_t exclusiveScan(uint32_t *numbers, int64_t count);

private:
  /// The sum over the block's threads, in all of them.
  static uint64_t sumOfBlock(uint64_t mine);
  /// The sum over the block's threads before this one, and of all.
  static uint32_t scanBlock(uint32_t mine, uint32_t &total);

  FrameState &frame_;
  int64_t top_, limit_;
  bool failed_ = false;
};

inline uint64_t Grid::sumOfBlock(uint64_t mine) {
  __syncthreads();
  blockWords[thread()] = mine;
  for (int32_t half = joinThreads / 2; half > 0; half /= 2) {
    __syncthreads();
    if (thread() < half)
      blockWords[thread()] += blockWords[thread() + half];
  }
  __syncthreads();
  return blockWords[0];
}

inline uint32_t Grid::scanBlock(uint32_t mine, uint32_t &total) {
  uint32_t sum = mine;
  for (int32_t distance = 1; distance < warpSize; distance *= 2) {
    auto other = static_cast<uint32_t>(
        __nvvm_shfl_sync_up_i32(~0u, static_cast<int32_t>(sum), distance, 0));
    if (lane() >= distance)
      sum += other;
  }
  int32_t warp = thread() / warpSize;
  __syncthreads();
  if (lane() == warpSize - 1)
    warpWords[warp] = sum;
  __syncthreads();
  uint32_t before = 0;
  total = 0;
  for (int32_t w = 0; w < warpsOfBlock; ++w) {
    before += w < warp ? warpWords[w] : 0;
    total += warpWords[w];
  }
  return before + sum - mine;
}

[[gnu::noinline]] inline int64_t Grid::exclusiveScan(uint32_t *numbers,
                                                     int64_t count) {
  if (failed_)
    return 0;
  sync();
  int64_t chunk =
      ceilDivide(ceilDivide(count, blocks()), joinThreads) * joinThreads;
  int64_t begin = smaller(block() * chunk, count),
          end = smaller(begin + chunk, count);
  uint64_t mine = 0;
  for (int64_t i = begin + thread(); i < end; i += joinThreads)
    mine += numbers[i];
  uint64_t ofBlock = sumOfBlock(mine);
  if (thread() == 0)
    frame_.blockSums[block()] = ofBlock;
  sync();
  uint64_t before = 0, all = 0;
  for (int64_t b = thread(); b < blocks(); b += joinThreads) {
    uint64_t sum = frame_.blockSums[b];
    before += b < block() ? sum : 0;
    all += sum;
  }
  before = sumOfBlock(before);
  all = sumOfBlock(all);
  auto base = static_cast<uint32_t>(before);
  for (int64_t i = begin; i < end; i += joinThreads) {
    int64_t at = i + thread();
    uint32_t total;
    uint32_t sum = scanBlock(at < end ? numbers[at] : 0, total);
    if (at < end)
      numbers[at] = base + sum;
    base += total;
  }
  if (all > UINT32_MAX)
    fail();
  sync();
  return static_cast<int64_t>(all);
}

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_DEVICE_GRID_H
