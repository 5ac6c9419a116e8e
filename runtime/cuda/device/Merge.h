// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Merge.h - Merges streams by lineage key ----------------------------===//
//
// An item's place is its own number plus, for each other stream, how many of
// its items come before: a binary search each.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CUDA_DEVICE_MERGE_H
#define PIKO_RUNTIME_CUDA_DEVICE_MERGE_H

#include "common/JoinRules.h"
#include "cuda/device/Records.h"

namespace piko::cuda {

/// The lineage order of streams, each of which is in it.
class KeyOrder {
public:
  KeyOrder(const Stream *streams, int32_t count)
      : streams_(streams), count_(count) {
    for (int32_t s = 0; s < count; ++s)
      width_ = larger(width_, streams[s].keys.width);
  }

  /// Of the longest key.
  int32_t width() const { return width_; }

  /// Among all, of item i of stream s.
  int64_t placeOf(int32_t s, int64_t i) const {
    int64_t place = i;
    for (int32_t other = 0; other < count_; ++other) {
      if (other == s)
        continue;
      int64_t low = 0, high = streams_[other].count;
      while (low < high) {
        int64_t middle = (low + high) / 2;
        if (before(other, middle, s, i))
          low = middle + 1;
        else
          high = middle;
      }
      place += low;
    }
    return place;
  }

private:
  /// True if item i of stream a comes before item j of stream b.
  bool before(int32_t a, int64_t i, int32_t b, int64_t j) const {
    return join::comesBefore(streams_[a].keys, i, streams_[b].keys, j, a < b);
  }

  const Stream *streams_;
  int32_t count_, width_ = 0;
};

class Merge {
public:
  /// Whether what comes out has keys.
  Merge(Grid &grid, const Shape &shape, const Stream *streams, int32_t count,
        bool keepsKeys)
      : grid_(grid), shape_(shape), streams_(streams), count_(count),
        keepsKeys_(keepsKeys), keyOrder_(streams, count) {}

  /// Between two barriers; `out` is uniform.
  void run(Stream &out) {
    for (int32_t s = 0; s < count_; ++s) {
      out.count += streams_[s].count;
      out.pairCount += streams_[s].pairCount;
    }
    if (out.count > UINT32_MAX || out.pairCount > UINT32_MAX)
      return grid_.fail();
    takeRoom(out);
    if (grid_.hasFailed())
      return;
    for (int32_t s = 0; s < count_; ++s)
      grid_.forEach(streams_[s].count, [&](int64_t i) { move(s, i); });
    if (!shape_.placed)
      return grid_.sync();
    grid_.exclusiveScan(pairStarts_, out.count + 1);
    for (int32_t s = 0; s < count_; ++s)
      grid_.forEach(streams_[s].count, [&](int64_t i) { movePairs(s, i); });
    grid_.sync();
  }

private:
  void takeRoom(Stream &out) {
    out.items = items_ = grid_.take<uint8_t>(out.count * shape_.recordSize);
    if (keepsKeys_) {
      keys_ = grid_.take<uint64_t>(out.count * keyOrder_.width());
      out.keys = {keys_, 0, keyOrder_.width()};
    }
    if (!shape_.placed)
      return;
    out.pairs = pairs_ = grid_.take<uint32_t>(out.pairCount);
    out.pairStarts = pairStarts_ = grid_.take<uint32_t>(out.count + 1);
    for (int32_t s = 0; s < count_; ++s)
      places_[s] = grid_.take<uint32_t>(streams_[s].count);
    if (!grid_.hasFailed() && Grid::isFirst())
      pairStarts_[out.count] = 0;
  }

  void move(int32_t s, int64_t i) {
    const Stream &from = streams_[s];
    int64_t to = keyOrder_.placeOf(s, i);
    int32_t width = keyOrder_.width();
    copyRecord(items_ + to * shape_.recordSize,
               from.items + i * shape_.recordSize, shape_.recordSize);
    if (keys_)
      for (int32_t w = 0; w < width; ++w)
        keys_[to * width + w] = from.keys.word(i, w);
    if (!pairs_)
      return;
    places_[s][i] = static_cast<uint32_t>(to);
    pairStarts_[to] = from.pairStarts[i + 1] - from.pairStarts[i];
  }

  void movePairs(int32_t s, int64_t i) {
    const Stream &from = streams_[s];
    uint32_t *to = pairs_ + pairStarts_[places_[s][i]];
    for (uint32_t k = from.pairStarts[i]; k < from.pairStarts[i + 1]; ++k)
      *to++ = from.pairs[k];
  }

  Grid &grid_;
  const Shape &shape_;
  const Stream *streams_;
  int32_t count_;
  bool keepsKeys_;
  KeyOrder keyOrder_;
  uint8_t *items_ = nullptr;
  uint64_t *keys_ = nullptr;
  uint32_t *pairs_ = nullptr, *pairStarts_ = nullptr;
  uint32_t *places_[mostMerged] = {};
};

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_DEVICE_MERGE_H
