// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Units.h - Cuts positions into calls and units ----------------------===//
//
// A unit is what a block takes at a time: a bucket, or a part of one that may
// be split; where Process takes a list, a call, or all of a bin. How units are
// cut is never seen in a result.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CUDA_DEVICE_UNITS_H
#define PIKO_RUNTIME_CUDA_DEVICE_UNITS_H

#include "common/JoinRules.h"
#include "cuda/device/Binning.h"

namespace piko::cuda {

class Cutter {
public:
  Cutter(Grid &grid, const JoinArgs &args, const Binning &bins, bool everyBin)
      : grid_(grid), args_(args), bins_(bins), everyBin_(everyBin),
        buckets_(args.shape.buckets) {}

  pikoir_unit *units = nullptr;
  pikoir_call *calls = nullptr;
  int64_t unitCount = 0, callCount = 0;

  /// After the binning; what the kernel takes is there before a barrier.
  /// All results are uniform.
  void run() {
    if (args_.takesList)
      return cutCalls();
    switch (args_.cutting) {
    case CutNone:
      return addWhole(buckets_, bins_.positions > 0 || args_.visitsAll);
    case CutBins:
      return cutBuckets([&](int64_t bucket) {
        const BinCut &cut = args_.cuts[bucket / args_.tiles];
        return cut.splits ? unitSize(cut.tileSplit) : 0;
      });
    case CutBuckets:
      int64_t size = args_.splits ? unitSize(args_.tileSplit) : 0;
      return cutBuckets([&](int64_t) { return size; });
    }
  }

private:
  /// What each bucket is cut into.
  struct Pieces {
    int64_t count, buckets;
    const uint32_t *starts; ///< Null: the first bucket has all.

    int64_t startOf(int64_t bucket) const {
      return starts ? starts[bucket] : bucket == 0 ? 0 : count;
    }
    /// The last one that begins at or before a piece.
    int64_t bucketOf(int64_t piece) const {
      int64_t low = 0, high = starts ? buckets : 1;
      while (high - low > 1) {
        int64_t middle = (low + high) / 2;
        (starts[middle] <= piece ? low : high) = middle;
      }
      return low;
    }
  };

  /// Each bucket has piecesOf(bucket), which is 0 for empty ones but where
  /// `everyBucket` is true.
  template <class Count> Pieces cut(const Count &piecesOf, bool everyBucket) {
    if (bins_.isInOne() && !everyBucket)
      return {piecesOf(0), buckets_, nullptr};
    auto *starts = grid_.take<uint32_t>(buckets_ + 1);
    int64_t count = grid_.scan(buckets_ + 1, starts, [&](int64_t bucket) {
      return bucket < buckets_ ? static_cast<uint32_t>(piecesOf(bucket)) : 0;
    });
    return {count, buckets_, starts};
  }

  int64_t countOf(int64_t bucket) const {
    return bins_.beginOf(bucket + 1) - bins_.beginOf(bucket);
  }

  /// Units have as many positions as sizeOf(bucket), or, if that is 0, all.
  template <class Size> void cutBuckets(const Size &sizeOf) {
    Pieces all = cut(
        [&](int64_t bucket) {
          int64_t count = countOf(bucket), size = sizeOf(bucket),
                  least = args_.visitsAll ? 1 : 0;
          return larger(least, size > 0 ? ceilDivide(count, size)
                                        : smaller<int64_t>(count, 1));
        },
        args_.visitsAll);
    addUnits(all.count, [&](int64_t u) -> pikoir_unit {
      int64_t bucket = all.bucketOf(u), begin = bins_.beginOf(bucket),
              end = bins_.beginOf(bucket + 1), size = sizeOf(bucket);
      if (size > 0) {
        begin += (u - all.startOf(bucket)) * size;
        end = smaller(end, begin + size);
      }
      return {bucket, bucket + 1, begin, end, -1};
    });
  }

  int64_t unitSize(int64_t tileSplit) const {
    return join::blockUnitSize(tileSplit, bins_.positions, args_.unitsAtOnce);
  }

  template <class UnitAt> void addUnits(int64_t count, const UnitAt &unitAt) {
    unitCount = count;
    units = grid_.take<pikoir_unit>(count);
    if (!grid_.hasFailed())
      grid_.forEach(count, [&](int64_t u) { units[u] = unitAt(u); });
  }

  /// Everything is one unit, if there is any.
  void addWhole(int64_t end, bool any) {
    addUnits(any, [&](int64_t) -> pikoir_unit {
      return {0, end, 0, bins_.positions, -1};
    });
  }

  bool isCutByBin() const { return args_.cutting == CutBins; }
  /// Whether a bin that has nothing is called.
  bool runsEmpty(int64_t bin) const {
    return everyBin_ && (!isCutByBin() || args_.cuts[bin].everyBin);
  }
  int64_t batchOf(int64_t bin, int64_t count) const {
    return join::callSize(isCutByBin() ? args_.cuts[bin].batch : args_.batch,
                          count);
  }

  void cutCalls() {
    Pieces all = cut(
        [&](int64_t bin) {
          int64_t count = countOf(bin);
          return join::callCount(count, batchOf(bin, count), runsEmpty(bin));
        },
        everyBin_);
    auto callAt = [&](int64_t c) -> pikoir_call {
      int64_t bin = all.bucketOf(c), batch = batchOf(bin, countOf(bin)),
              begin = bins_.beginOf(bin) + (c - all.startOf(bin)) * batch;
      return {bin, begin, smaller(bins_.beginOf(bin + 1), begin + batch)};
    };
    callCount = all.count;
    calls = grid_.take<pikoir_call>(callCount);
    if (grid_.hasFailed())
      return;
    grid_.forEach(callCount, [&](int64_t c) { calls[c] = callAt(c); });
    auto unitOf = [&](int64_t first, int64_t end) -> pikoir_unit {
      return {first, end, callAt(first).begin, callAt(end - 1).end, -1};
    };
    if (args_.cutting == CutNone)
      return addWhole(callCount, callCount > 0);
    if (args_.splits)
      return addUnits(callCount, [&](int64_t u) { return unitOf(u, u + 1); });
    Pieces bins = cut(
        [&](int64_t bin) -> int64_t {
          return all.startOf(bin + 1) > all.startOf(bin);
        },
        everyBin_);
    addUnits(bins.count, [&](int64_t u) {
      int64_t bin = bins.bucketOf(u);
      return unitOf(all.startOf(bin), all.startOf(bin + 1));
    });
  }

  Grid &grid_;
  const JoinArgs &args_;
  const Binning &bins_;
  bool everyBin_;
  int64_t buckets_;
};

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_DEVICE_UNITS_H
