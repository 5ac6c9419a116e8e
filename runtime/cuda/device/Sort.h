// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Sort.h - A stable radix sort ---------------------------------------===//
//
// From the least significant digit on; for each digit:
//   1. count    each block counts the digits of its chunk;
//   2. scan     over (digit, block), gives each its first place;
//   3. scatter  a block takes its chunk tile by tile, an element a thread: its
//               place in the tile follows from votes in its warp and a sum over
//               warps.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CUDA_DEVICE_SORT_H
#define PIKO_RUNTIME_CUDA_DEVICE_SORT_H

#include "cuda/device/Grid.h"

namespace piko::cuda {

constexpr int32_t digitBits = 8, digits = 1 << digitBits;
static_assert(digits == joinThreads, "a thread for each digit");

inline PIKO_BLOCK_MEMORY uint32_t digitPlaces[digits];
inline PIKO_BLOCK_MEMORY uint32_t warpDigits[warpsOfBlock][digits];

/// Keys, and a number that goes with each.
struct KeyedNumbers {
  uint32_t *keys, *numbers;
};

class RadixSort {
public:
  RadixSort(Grid &grid, int64_t count) : grid_(grid), count_(count) {}

  /// Sorts by keys below 2 ^ `bits`; the result is in `from` or in `to`, and is
  /// returned. Between two barriers.
  KeyedNumbers run(KeyedNumbers from, KeyedNumbers to, int32_t bits) {
    counts_ = grid_.take<uint32_t>(digits * grid_.blocks());
    for (int32_t shift = 0; shift < bits && !grid_.hasFailed();
         shift += digitBits) {
      sortDigit(from, to, shift);
      KeyedNumbers other = from;
      from = to;
      to = other;
    }
    return from;
  }

private:
  static uint32_t digitOf(uint32_t key, int32_t shift) {
    return key >> shift & (digits - 1);
  }

  void sortDigit(KeyedNumbers from, KeyedNumbers to, int32_t shift) {
    int64_t chunk =
        ceilDivide(ceilDivide(count_, grid_.blocks()), joinThreads) *
        joinThreads;
    int64_t begin = smaller(grid_.block() * chunk, count_),
            end = smaller(begin + chunk, count_);
    digitPlaces[Grid::thread()] = 0;
    __syncthreads();
    for (int64_t i = begin + Grid::thread(); i < end; i += joinThreads)
      __atomic_fetch_add(&digitPlaces[digitOf(from.keys[i], shift)], 1u,
                         __ATOMIC_RELAXED);
    __syncthreads();
    uint32_t *mine = &counts_[Grid::thread() * grid_.blocks() + grid_.block()];
    *mine = digitPlaces[Grid::thread()];
    grid_.exclusiveScan(counts_, digits * grid_.blocks());
    digitPlaces[Grid::thread()] = *mine;
    for (int64_t i = begin; i < end; i += joinThreads)
      scatterTile(from, to, shift, i + Grid::thread(), end);
    grid_.sync();
  }

  void scatterTile(KeyedNumbers from, KeyedNumbers to, int32_t shift, int64_t i,
                   int64_t end) {
    bool has = i < end;
    uint32_t key = has ? from.keys[i] : 0;
    uint32_t digit = digitOf(key, shift);
    for (auto &ofWarp : warpDigits)
      ofWarp[Grid::thread()] = 0;
    __syncthreads();
    // Lanes with the same digit.
    uint32_t same = __nvvm_vote_ballot_sync(~0u, has);
    for (int32_t bit = 0; bit < digitBits; ++bit) {
      bool is = digit >> bit & 1;
      uint32_t votes = __nvvm_vote_ballot_sync(~0u, is);
      same &= is ? votes : ~votes;
    }
    uint32_t below = (1u << Grid::lane()) - 1;
    auto rank = static_cast<uint32_t>(__builtin_popcount(same & below));
    int32_t warp = Grid::thread() / warpSize;
    if (has && rank == 0)
      warpDigits[warp][digit] = static_cast<uint32_t>(__builtin_popcount(same));
    __syncthreads();
    uint32_t place = digitPlaces[Grid::thread()];
    for (auto &ofWarp : warpDigits) {
      uint32_t count = ofWarp[Grid::thread()];
      ofWarp[Grid::thread()] = place;
      place += count;
    }
    digitPlaces[Grid::thread()] = place;
    __syncthreads();
    if (has) {
      uint32_t at = warpDigits[warp][digit] + rank;
      to.keys[at] = key;
      to.numbers[at] = from.numbers[i];
    }
    __syncthreads();
  }

  Grid &grid_;
  int64_t count_;
  uint32_t *counts_ = nullptr;
};

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_DEVICE_SORT_H
