// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Grid.h - Threads of a device that work together --------------------===//
//
// A grid of blocks that are all resident: they meet at barriers. Where there is
// little to do, the first block works alone, whose barriers are a hundred times
// as fast. What is said to be uniform has the same value in all threads.
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

constexpr int32_t warpSize = 32;
/// Of a block. What is of one warp alone is compiled by itself (Step.cpp).
#ifdef PIKO_ONE_WARP
constexpr int32_t gridThreads = warpSize;
#else
constexpr int32_t gridThreads = joinThreads;
#endif
constexpr int32_t warpsOfBlock = gridThreads / warpSize;
constexpr bool isOneWarp = warpsOfBlock == 1;

inline PIKO_BLOCK_MEMORY uint64_t blockWords[gridThreads];
inline PIKO_BLOCK_MEMORY uint32_t warpWords[warpsOfBlock];

class Grid {
public:
  /// Memory is taken from `cursor` on. `work` is about how often a loop's body
  /// runs; uniform.
  Grid(FrameState &frame, int64_t cursor, int64_t work)
      : frame_(frame), top_(cursor), limit_(frame.log.limit),
        isAlone_(isOneWarp || work <= frame.mostAlone) {}

  /// True in blocks that are to end at once, as the first one works alone.
  bool isIdle() {
    if (!isAlone_ || firstBlock() == 0)
      return false;
    __syncthreads();
    if (thread() == 0)
      arrive();
    return true;
  }
  int64_t block() const { return isAlone_ ? 0 : firstBlock(); }
  int64_t blocks() const {
    return isAlone_ ? 1 : __nvvm_read_ptx_sreg_nctaid_x();
  }
  static int32_t thread() {
    return static_cast<int32_t>(__nvvm_read_ptx_sreg_tid_x());
  }
  static int32_t lane() { return thread() % warpSize; }
  static bool isFirst() { return firstBlock() == 0 && thread() == 0; }
  int64_t index() const { return block() * gridThreads + thread(); }
  int64_t size() const { return blocks() * gridThreads; }

  /// Calls body(i) for numbers below n, which is uniform.
  template <class Body> void forEach(int64_t n, const Body &body) const {
    for (int64_t i = index(); i < n; i += size())
      body(i);
  }
  /// The same by whole warps, which come to body(i) together; its last numbers
  /// may be n and above.
  template <class Body> void forEachByWarps(int64_t n, const Body &body) const {
    for (int64_t i = index(); i - lane() < n; i += size())
      body(i);
  }

  /// A barrier of all that work: what was written before it is seen
  /// behind.
  void sync() {
    if (isAlone_)
      __syncthreads();
    else
      meet();
  }
  /// Once, before the first thread changes what says how much work there is:
  /// idle blocks have seen it.
  void settle() {
    if constexpr (isOneWarp)
      __syncthreads();
    else
      meet();
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
  /// The same, zero after a barrier.
  uint32_t *takeZeros(int64_t count) {
    uint32_t *words = take<uint32_t>(count);
    if (words)
      forEach(count, [&](int64_t i) { words[i] = 0; });
    return words;
  }
  void fail() { failed_ = true; }         ///< Uniform.
  void failFrame() { frame_.failed = 1; } ///< By any thread.
  bool hasFailed() const { return failed_; }
  int64_t top() const { return top_; }

  /// Exclusive prefix sums of several arrays at a time: numbersOf(i, numbers)
  /// gives element i of each, from what all threads see. `sums` has the arrays,
  /// or null, and `totals` their sums, uniform. Fails where one has more than
  /// 32 bits. Before a barrier.
  template <int32_t Count, class NumbersOf>
  void scan(int64_t n, uint32_t *const (&sums)[Count], int64_t (&totals)[Count],
            const NumbersOf &numbersOf);
  /// The same of one; returns the sum of all.
  template <class NumberOf>
  int64_t scan(int64_t n, uint32_t *sums, const NumberOf &numberOf) {
    int64_t total[1];
    scan<1>(n, {sums}, total,
            [&](int64_t i, uint32_t (&number)[1]) { number[0] = numberOf(i); });
    return total[0];
  }
  /// In place. Between two barriers.
  int64_t exclusiveScan(uint32_t *numbers, int64_t n) {
    sync();
    return scan(n, numbers, [&](int64_t i) { return numbers[i]; });
  }

private:
  /// Returns how many have to arrive until all are there.
  uint64_t arrive() {
    auto all = static_cast<uint64_t>(__nvvm_read_ptx_sreg_nctaid_x());
    __nvvm_membar_gl();
    uint64_t before =
        __atomic_fetch_add(&frame_.arrived, uint64_t(1), __ATOMIC_RELAXED);
    return (before / all + 1) * all;
  }
  [[gnu::noinline]] void meet() {
    __syncthreads();
    if (thread() == 0) {
      uint64_t target = arrive();
      while (__atomic_load_n(&frame_.arrived, __ATOMIC_RELAXED) < target)
        __nvvm_nanosleep(32);
      __nvvm_membar_gl();
    }
    __syncthreads();
  }

  static int64_t firstBlock() { return __nvvm_read_ptx_sreg_ctaid_x(); }
  /// The sum over the block's threads, in all of them.
  static uint64_t sumOfBlock(uint64_t mine);
  /// The sum over the block's threads before this one, and of all.
  static uint32_t scanBlock(uint32_t mine, uint32_t &total);
  static uint64_t scanBlock(uint64_t mine, uint64_t &total);
  /// As scan, by one block that has a thread for each element.
  template <int32_t Count, class NumbersOf>
  void scanFew(int64_t n, uint32_t *const (&sums)[Count],
               int64_t (&totals)[Count], const NumbersOf &numbersOf);

  FrameState &frame_;
  int64_t top_, limit_;
  bool isAlone_, failed_ = false;
};

inline uint64_t Grid::sumOfBlock(uint64_t mine) {
  __syncthreads();
  blockWords[thread()] = mine;
  for (int32_t half = gridThreads / 2; half > 0; half /= 2) {
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

inline uint64_t Grid::scanBlock(uint64_t mine, uint64_t &total) {
  uint64_t sum = mine;
  for (int32_t distance = 1; distance < warpSize; distance *= 2) {
    uint64_t other = 0;
    for (int32_t shift = 0; shift < 64; shift += 32)
      other |=
          static_cast<uint64_t>(static_cast<uint32_t>(__nvvm_shfl_sync_up_i32(
              ~0u, static_cast<int32_t>(sum >> shift), distance, 0)))
          << shift;
    if (lane() >= distance)
      sum += other;
  }
  int32_t warp = thread() / warpSize;
  __syncthreads();
  if (lane() == warpSize - 1)
    blockWords[warp] = sum;
  __syncthreads();
  uint64_t before = 0;
  total = 0;
  for (int32_t w = 0; w < warpsOfBlock; ++w) {
    before += w < warp ? blockWords[w] : 0;
    total += blockWords[w];
  }
  return before + sum - mine;
}

template <int32_t Count, class NumbersOf>
void Grid::scanFew(int64_t n, uint32_t *const (&sums)[Count],
                   int64_t (&totals)[Count], const NumbersOf &numbersOf) {
  uint32_t numbers[Count] = {};
  if (thread() < n)
    numbersOf(thread(), numbers);
  for (int32_t c = 0; c < Count; ++c) {
    uint64_t total, sum = scanBlock(uint64_t(numbers[c]), total);
    if (sums[c] && thread() < n)
      sums[c][thread()] = static_cast<uint32_t>(sum);
    totals[c] = static_cast<int64_t>(total);
    if (total > UINT32_MAX)
      fail();
  }
  __syncthreads();
}

template <int32_t Count, class NumbersOf>
void Grid::scan(int64_t n, uint32_t *const (&sums)[Count],
                int64_t (&totals)[Count], const NumbersOf &numbersOf) {
  static_assert(Count <= mostScans);
  for (int64_t &total : totals)
    total = 0;
  if (failed_)
    return;
  if (isAlone_ && n <= gridThreads)
    return scanFew<Count>(n, sums, totals, numbersOf);
  int64_t chunk =
      ceilDivide(ceilDivide(n, blocks()), gridThreads) * gridThreads;
  int64_t begin = smaller(block() * chunk, n), end = smaller(begin + chunk, n);
  uint64_t mine[Count] = {};
  for (int64_t i = begin + thread(); i < end; i += gridThreads) {
    uint32_t numbers[Count];
    numbersOf(i, numbers);
    for (int32_t c = 0; c < Count; ++c) {
      mine[c] += numbers[c];
      if (sums[c])
        sums[c][i] = numbers[c];
    }
  }
  for (int32_t c = 0; c < Count; ++c) {
    uint64_t ofBlock = sumOfBlock(mine[c]);
    if (thread() == 0)
      frame_.blockSums[c][block()] = ofBlock;
  }
  sync();
  for (int32_t c = 0; c < Count; ++c) {
    uint64_t before = 0, all = 0;
    for (int64_t b = thread(); b < blocks(); b += gridThreads) {
      uint64_t sum = frame_.blockSums[c][b];
      before += b < block() ? sum : 0;
      all += sum;
    }
    auto base = static_cast<uint32_t>(sumOfBlock(before));
    all = sumOfBlock(all);
    for (int64_t i = begin; i < end && sums[c]; i += gridThreads) {
      int64_t at = i + thread();
      uint32_t total;
      uint32_t sum = scanBlock(at < end ? sums[c][at] : 0, total);
      if (at < end)
        sums[c][at] = base + sum;
      base += total;
    }
    totals[c] = static_cast<int64_t>(all);
    if (all > UINT32_MAX)
      fail();
  }
  sync();
}

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_DEVICE_GRID_H
