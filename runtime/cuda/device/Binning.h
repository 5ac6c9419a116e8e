// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Binning.h - Puts items into buckets
//----------------------------------===//
//
// Pairs of item and bucket are sorted by bucket; the sort is stable, so that
// each bucket has its items in lineage order.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CUDA_DEVICE_BINNING_H
#define PIKO_RUNTIME_CUDA_DEVICE_BINNING_H

#include "cuda/device/Entries.h"
#include "cuda/device/Sort.h"

namespace piko::cuda {

class Binning {
public:
  Binning(Grid &grid, const JoinArgs &args, const Stream &stream)
      : grid_(grid), args_(args), stream_(stream) {}

  int64_t positions = 0;
  int64_t *offsets = nullptr;
  uint32_t *order = nullptr; ///< Null: position and item are the same.
  uint32_t *rank = nullptr;
  int64_t rankSize = 0;

  /// After a barrier; all results are uniform. Before one, unless all is
  /// in one bucket.
  void run() {
    offsets = grid_.take<int64_t>(args_.shape.buckets + 1);
    if (grid_.hasFailed())
      return;
    if (args_.shape.placed)
      return binPairs();
    positions = stream_.count;
    grid_.forEach(args_.shape.buckets + 1,
                  [&](int64_t bucket) { offsets[bucket] = beginOf(bucket); });
  }

  /// Whether everything is in the first bucket, which is known without a
  /// barrier.
  bool isInOne() const { return !args_.shape.placed; }
  int64_t beginOf(int64_t bucket) const {
    return !isInOne() ? offsets[bucket] : bucket == 0 ? 0 : positions;
  }

private:
  KeyedNumbers takeNumbers() {
    return {grid_.take<uint32_t>(stream_.pairCount),
            grid_.take<uint32_t>(stream_.pairCount)};
  }

  static int32_t bitsOf(int64_t numbers) {
    return numbers <= 1
               ? 0
               : 64 - __builtin_clzll(static_cast<uint64_t>(numbers - 1));
  }

  /// Pairs by `buckets`; those without a bucket come last.
  KeyedNumbers sortBy(int64_t bucketsInOne) {
    KeyedNumbers from = takeNumbers(), to = takeNumbers();
    if (grid_.hasFailed())
      return from;
    int64_t groups = ceilDivide(args_.shape.buckets, bucketsInOne);
    grid_.forEach(stream_.pairCount, [&](int64_t k) {
      uint32_t pair = stream_.pairs[k];
      from.keys[k] = pair == noBucket
                         ? static_cast<uint32_t>(groups)
                         : static_cast<uint32_t>((pair & ~PIKOIR_FIRST_BUCKET) /
                                                 bucketsInOne);
      from.numbers[k] = static_cast<uint32_t>(k);
    });
    grid_.sync();
    return RadixSort(grid_, stream_.pairCount)
        .run(from, to, bitsOf(groups + 1));
  }

  void binPairs() {
    KeyedNumbers sorted = sortBy(1);
    uint32_t *itemOf = grid_.take<uint32_t>(stream_.pairCount);
    order = grid_.take<uint32_t>(stream_.pairCount);
    if (grid_.hasFailed())
      return;
    grid_.forEach(stream_.count, [&](int64_t i) {
      for (uint32_t k = stream_.pairStarts[i]; k < stream_.pairStarts[i + 1];
           ++k)
        itemOf[k] = static_cast<uint32_t>(i);
    });
    grid_.forEach(args_.shape.buckets + 1, [&](int64_t bucket) {
      offsets[bucket] = firstOf(sorted.keys, bucket);
    });
    grid_.sync();
    positions = offsets[args_.shape.buckets];
    grid_.forEach(positions,
                  [&](int64_t p) { order[p] = itemOf[sorted.numbers[p]]; });
    bool byBin = args_.collects && args_.tiles > 1;
    if (args_.ranked && (byBin || !args_.collects))
      findRanks(sorted.numbers, byBin);
    grid_.sync();
  }

  /// The first place of a key that is not below `bucket`.
  int64_t firstOf(const uint32_t *keys, int64_t bucket) const {
    int64_t low = 0, high = stream_.pairCount;
    while (low < high) {
      int64_t middle = (low + high) / 2;
      if (keys[middle] < bucket)
        low = middle + 1;
      else
        high = middle;
    }
    return low;
  }

  /// Emission order is that of pairs, or, across owner tiles, of a bin's.
  void findRanks(const uint32_t *pairAt, bool byBin) {
    uint32_t *placeOf = nullptr;
    if (byBin) {
      KeyedNumbers bins = sortBy(args_.tiles);
      placeOf = grid_.take<uint32_t>(stream_.pairCount);
      if (grid_.hasFailed())
        return;
      grid_.forEach(stream_.pairCount, [&](int64_t i) {
        placeOf[bins.numbers[i]] = static_cast<uint32_t>(i);
      });
      grid_.sync();
    }
    rank = grid_.take<uint32_t>(positions);
    rankSize = byBin ? positions : stream_.pairCount;
    if (!grid_.hasFailed())
      grid_.forEach(positions, [&](int64_t p) {
        rank[p] = placeOf ? placeOf[pairAt[p]] : pairAt[p];
      });
  }

  Grid &grid_;
  const JoinArgs &args_;
  const Stream &stream_;
};

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_DEVICE_BINNING_H
