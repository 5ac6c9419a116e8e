// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Gather.h - What a kernel has left for a port, in lineage order -----===//
//
// Spans are in the order of emission. Each is walked by a thread:
//   1. count    what it has, and, where the order of positions is another one,
//               what each slot has;
//   2. scan     gives each span, and each slot, its place;
//   3. place    copies records and cells there, with keys where they are asked
//               for.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CUDA_DEVICE_GATHER_H
#define PIKO_RUNTIME_CUDA_DEVICE_GATHER_H

#include "cuda/device/Entries.h"

namespace piko::cuda {

class Gather {
public:
  Gather(Grid &grid, const JoinArgs &args, int32_t input)
      : Gather(grid, args, args.inputs[input], args.kernel->received[input]) {}
  Gather(Grid &grid, const JoinArgs &args, const JoinInput &input,
         uint64_t &received)
      : grid_(grid), args_(args), input_(input), from_(*input.producer),
        received_(received), keyWidth_(!input.keyed     ? 0
                                       : input.collects ? 2
                                                        : from_.keys.width + 1),
        byPosition_(!input.isSource &&
                    (keyWidth_ > 0 || (input.permute && from_.rank))) {}

  /// Between two barriers; `stream` is uniform.
  void run(Stream &stream);

private:
  /// Where a slot's records and cells begin: in the order of emission, and in
  /// that of positions.
  struct Places {
    uint32_t *counts, *emitted, *starts;
  };
  struct Counter;
  struct SlotCounter;
  struct Placer;

  void listSpans();
  void countSpans();
  void findSlots();
  Places placeSlots(uint32_t *counts);
  void place(Stream &stream);
  void placeNone(Stream &stream);

  int64_t slots() const {
    return from_.input.calls ? from_.input.call_count : from_.input.count;
  }
  int64_t slotOf(int64_t unit) const {
    const pikoir_unit &u = from_.input.units[unit];
    return from_.input.calls ? u.cell_begin : u.begin;
  }
  int64_t rankOf(int64_t slot) const {
    return from_.rank ? from_.rank[slot] : slot;
  }
  /// The cell of a position.
  int64_t cellOf(int64_t position) const;

  Grid &grid_;
  const JoinArgs &args_;
  const JoinInput &input_;
  const KernelState &from_;
  uint64_t &received_;
  int32_t keyWidth_;
  bool byPosition_;
  int64_t spanCount_ = 0, recordCount_ = 0, pairCount_ = 0;
  uint32_t *firstSpans_ = nullptr; ///< Of each unit, and the end.
  pikoir_span *spans_ = nullptr;
  uint32_t *records_ = nullptr, *pairs_ = nullptr; ///< In front of each span.
  uint32_t *all_ = nullptr; ///< With those of other ports.
  uint32_t *slotOfSpan_ = nullptr;
  Places recordPlaces_{}, pairPlaces_{};
};

struct Gather::Counter {
  uint32_t all = 0, mine = 0, records = 0, pairs = 0, ends = 0;
  bool failed = false;
  void emit(bool isMine) {
    ++all;
    mine += isMine;
  }
  void keep(const pikoir_entry *) { ++records; }
  void place(uint32_t) { ++pairs; }
  void insert(uint32_t) { ++pairs; }
  void next() { ++ends; }
  void fail() { failed = true; }
};

/// Counts for slots; one may be in several spans.
struct Gather::SlotCounter {
  uint32_t *records, *pairs;
  int64_t slot;
  void emit(bool) {}
  void keep(const pikoir_entry *) {
    __atomic_fetch_add(&records[slot], 1u, __ATOMIC_RELAXED);
  }
  void place(uint32_t) {
    if (pairs)
      __atomic_fetch_add(&pairs[slot], 1u, __ATOMIC_RELAXED);
  }
  void insert(uint32_t cell) { place(cell); }
  void next() { ++slot; }
  void fail() {}
};

struct Gather::Placer {
  const Gather &gather;
  uint8_t *items;
  uint32_t *pairs, *pairStarts;
  uint64_t *keys;
  uint32_t record, pair, ordinal; ///< Those before, in the order of emission.
  int64_t slot;
  uint32_t *first = nullptr, *end = nullptr; ///< Cells of the last record.

  void emit(bool) { ++ordinal; }
  void next() { ++slot; }
  void fail() {}

  void keep(const pikoir_entry *entry) {
    int64_t to = record++, toPair = pair;
    if (gather.byPosition_) {
      int64_t rank = gather.rankOf(slot);
      const Places &places = gather.recordPlaces_;
      to = places.starts[rank] + (to - places.emitted[slot]);
      if (pairs)
        toPair = gather.pairPlaces_.starts[rank] +
                 (toPair - gather.pairPlaces_.emitted[slot]);
    }
    if (entry)
      copyRecord(items + to * gather.args_.recordSize, payload(entry),
                 gather.args_.recordSize);
    if (pairs) {
      pairStarts[to] = static_cast<uint32_t>(toPair);
      first = end = pairs + toPair;
    }
    if (keys)
      putKey(keys + to * gather.keyWidth_);
  }
  void place(uint32_t cell) {
    if (!pairs)
      return;
    *end = first == end ? cell | PIKOIR_FIRST_CELL : cell;
    ++end;
    ++pair;
  }
  void insert(uint32_t cell) {
    *first &= ~PIKOIR_FIRST_CELL;
    uint32_t *at = end++;
    for (; at != first && at[-1] > cell; --at)
      *at = at[-1];
    *at = cell;
    *first |= PIKOIR_FIRST_CELL;
    ++pair;
  }

  void putKey(uint64_t *to) const {
    const KernelState &from = gather.from_;
    if (gather.input_.collects) { // a new lineage
      to[0] = static_cast<uint64_t>(gather.input_.root) << 32;
      to[1] = static_cast<uint64_t>(gather.rankOf(slot)) << 32 | ordinal;
      return;
    }
    int64_t item = from.input.order ? from.input.order[slot] : slot;
    Stream parents{};
    parents.keys = from.keys;
    for (int32_t w = 0; w < from.keys.width; ++w)
      to[w] = parents.key(item, w);
    to[from.keys.width] =
        static_cast<uint64_t>(gather.cellOf(slot)) << 32 | ordinal;
  }
};

inline int64_t Gather::cellOf(int64_t position) const {
  const int64_t *offsets = from_.input.offsets;
  int64_t low = 0, high = from_.cells; // offsets[low] <= position
  while (high - low > 1) {
    int64_t middle = (low + high) / 2;
    (offsets[middle] <= position ? low : high) = middle;
  }
  return low;
}

/// Puts the units' directories one behind the other.
inline void Gather::listSpans() {
  int64_t units = from_.input.unit_count;
  const auto *logs = reinterpret_cast<const pikoir_unit_log *>(from_.log.units);
  auto forDirectories = [&](int64_t unit, auto &&body) {
    for (int64_t at = logs[unit].first; at != 0;) {
      const auto *piece = reinterpret_cast<const pikoir_piece *>(at);
      body(reinterpret_cast<const pikoir_span *>(piece + 1), piece->spans);
      at = piece->next;
    }
  };
  firstSpans_ = grid_.take<uint32_t>(units + 1);
  if (grid_.hasFailed())
    return;
  grid_.forEach(units + 1, [&](int64_t unit) {
    int64_t count = 0;
    if (unit < units)
      forDirectories(unit, [&](auto *, int64_t spans) { count += spans; });
    firstSpans_[unit] = static_cast<uint32_t>(count);
  });
  spanCount_ = grid_.exclusiveScan(firstSpans_, units + 1);
  spans_ = grid_.take<pikoir_span>(spanCount_);
  slotOfSpan_ = grid_.take<uint32_t>(spanCount_); // the unit, for now
  if (grid_.hasFailed())
    return;
  int64_t warp = Grid::index() / warpSize, warps = Grid::size() / warpSize;
  for (int64_t unit = warp; unit < units; unit += warps) {
    int64_t to = firstSpans_[unit];
    forDirectories(unit, [&](const pikoir_span *from, int64_t count) {
      for (int64_t i = Grid::lane(); i < count; i += warpSize) {
        spans_[to + i] = from[i];
        slotOfSpan_[to + i] = static_cast<uint32_t>(unit);
      }
      to += count;
    });
  }
  grid_.sync();
}

inline void Gather::countSpans() {
  records_ = grid_.take<uint32_t>(spanCount_);
  pairs_ = args_.placed ? grid_.take<uint32_t>(spanCount_) : nullptr;
  all_ = keyWidth_ > 0 ? grid_.take<uint32_t>(spanCount_) : nullptr;
  uint32_t *ends = byPosition_ ? grid_.take<uint32_t>(spanCount_) : nullptr;
  if (grid_.hasFailed())
    return;
  uint64_t received = 0;
  bool failed = false;
  grid_.forEach(spanCount_, [&](int64_t s) {
    Counter counter;
    SpanReader<Counter>(input_, args_, counter).read(spans_[s]);
    records_[s] = counter.records;
    if (pairs_)
      pairs_[s] = counter.pairs;
    if (all_)
      all_[s] = counter.all;
    if (ends)
      ends[s] = counter.ends;
    received += counter.mine;
    failed |= counter.failed;
  });
  if (received > 0)
    __atomic_fetch_add(&received_, received, __ATOMIC_RELAXED);
  if (failed)
    args_.frame->failed = 1;
  recordCount_ = grid_.exclusiveScan(records_, spanCount_);
  if (pairs_)
    pairCount_ = grid_.exclusiveScan(pairs_, spanCount_);
  if (all_)
    grid_.exclusiveScan(all_, spanCount_);
  if (!ends)
    return;
  grid_.exclusiveScan(ends, spanCount_);
  grid_.forEach(spanCount_, [&](int64_t s) {
    uint32_t unit = slotOfSpan_[s];
    slotOfSpan_[s] =
        static_cast<uint32_t>(slotOf(unit) + ends[s] - ends[firstSpans_[unit]]);
  });
  grid_.sync();
}

/// `counts` are those of slots.
inline Gather::Places Gather::placeSlots(uint32_t *counts) {
  int64_t n = slots();
  Places places{counts, grid_.take<uint32_t>(n), nullptr};
  if (grid_.hasFailed())
    return places;
  grid_.forEach(n, [&](int64_t i) { places.emitted[i] = counts[i]; });
  grid_.exclusiveScan(places.emitted, n);
  places.starts = places.emitted;
  if (!from_.rank)
    return places;
  places.starts = grid_.takeZeros(from_.rankSize);
  if (grid_.hasFailed())
    return places;
  grid_.forEach(n,
                [&](int64_t i) { places.starts[from_.rank[i]] = counts[i]; });
  grid_.exclusiveScan(places.starts, from_.rankSize);
  return places;
}

inline void Gather::findSlots() {
  uint32_t *records = grid_.takeZeros(slots());
  uint32_t *pairs = args_.placed ? grid_.takeZeros(slots()) : nullptr;
  if (grid_.hasFailed())
    return;
  grid_.forEach(spanCount_, [&](int64_t s) {
    SlotCounter counter{records, pairs, slotOfSpan_[s]};
    SpanReader<SlotCounter>(input_, args_, counter).read(spans_[s]);
  });
  grid_.sync();
  recordPlaces_ = placeSlots(records);
  if (pairs && !grid_.hasFailed())
    pairPlaces_ = placeSlots(pairs);
}

inline void Gather::place(Stream &stream) {
  uint8_t *items = nullptr;
  uint32_t *pairs = nullptr, *pairStarts = nullptr;
  uint64_t *keys = nullptr;
  if (!input_.isSource)
    stream.items = items = grid_.take<uint8_t>(recordCount_ * args_.recordSize);
  if (args_.placed) {
    stream.pairs = pairs = grid_.take<uint32_t>(pairCount_);
    stream.pairStarts = pairStarts = grid_.take<uint32_t>(recordCount_ + 1);
  }
  if (keyWidth_ > 0) {
    keys = grid_.take<uint64_t>(recordCount_ * keyWidth_);
    stream.keys = {keys, 0, keyWidth_};
  }
  if (grid_.hasFailed())
    return;
  if (pairStarts && Grid::isFirst())
    pairStarts[recordCount_] = static_cast<uint32_t>(pairCount_);
  grid_.forEach(spanCount_, [&](int64_t s) {
    Placer placer{*this,
                  items,
                  pairs,
                  pairStarts,
                  keys,
                  records_[s],
                  pairs_ ? pairs_[s] : 0,
                  all_ ? all_[s] : 0,
                  slotOfSpan_[s]};
    SpanReader<Placer>(input_, args_, placer).read(spans_[s]);
  });
  grid_.sync();
}

/// All items begin and end at no pair.
inline void Gather::placeNone(Stream &stream) {
  stream.pairs = stream.pairStarts = grid_.takeZeros(stream.count + 1);
}

inline void Gather::run(Stream &stream) {
  listSpans();
  if (!grid_.hasFailed())
    countSpans();
  if (byPosition_ && !grid_.hasFailed())
    findSlots();
  if (grid_.hasFailed())
    return;
  if (!input_.isSource)
    stream.count = recordCount_;
  else if (recordCount_ == 0) // it cannot place any, and ends no position
    return placeNone(stream);
  stream.pairCount = pairCount_;
  place(stream);
}

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_DEVICE_GATHER_H
