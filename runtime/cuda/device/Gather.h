// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Gather.h - What a kernel has left for a port, in lineage order -----===//
//
// Spans are in the order of emission. Each is walked by a thread:
//   1. count    what it has, and, where the order of positions is another one,
//               what each slot has;
//   2. scan     gives each span, and each slot, its place;
//   3. place    copies buckets there, with keys where they are asked for, and
//               says where records are;
//   4. copy     where spans have many records, warps bring those: a thread
//               alone would wait for one after the other.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CUDA_DEVICE_GATHER_H
#define PIKO_RUNTIME_CUDA_DEVICE_GATHER_H

#include "cuda/device/Records.h"
#include "cuda/device/Siblings.h"

namespace piko::cuda {

class Gather {
public:
  /// What `input` has among `spans`. Within a loop, `siblings` knows what else
  /// its parents have emitted.
  Gather(Grid &grid, const Shape &shape, const JoinInput &input,
         const Spans &spans, const Siblings *siblings = nullptr)
      : grid_(grid), shape_(shape), input_(input), spans_(spans),
        from_(spans.kernel()), siblings_(siblings),
        keyWidth_(input.keyWidth == 0 || siblings ? 0
                  : input.collects                ? 2
                                                  : from_.keys.width + 1),
        byPosition_(!input.isSource && !siblings && !isHosted() &&
                    (keyWidth_ > 0 || (input.permute && from_.rank))) {}

  /// Between two barriers; `stream` is uniform.
  void run(Stream &stream);
  /// Of what was gathered in a loop.
  const Lineage &lineage() const { return lineage_; }

private:
  /// As many records of a span, in the mean, its thread copies itself: that
  /// takes no further barrier.
  static constexpr int64_t mostOfSpan = 2;

  struct Counter;
  struct SlotCounter;
  struct Placer;

  void countSpans();
  void findSlots();
  void place(Stream &stream);
  void placeNone(Stream &stream);
  template <class Sink> void read(Sink &sink, int64_t span) const {
    SpanReader<Sink>(input_, shape_, sink).read(spans_.list[span]);
  }
  /// Whether it is of a stage after a local edge: what that emits is in the
  /// order of bins.
  bool isHosted() const { return input_.stage >= 0; }
  /// The bucket of a position.
  int64_t bucketOf(int64_t position) const;

  Grid &grid_;
  const Shape &shape_;
  const JoinInput &input_;
  const Spans &spans_;
  const KernelState &from_;
  const Siblings *siblings_;
  int32_t keyWidth_;
  bool byPosition_;
  int64_t recordCount_ = 0, pairCount_ = 0;
  uint32_t *records_ = nullptr, *pairs_ = nullptr; ///< Before each span.
  uint32_t *all_ = nullptr;   ///< With those of other ports.
  uint32_t *slots_ = nullptr; ///< Of each span, where it is asked for.
  Spans::Places recordPlaces_{}, pairPlaces_{};
  Lineage lineage_{};
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
  void insert(uint32_t bucket) { place(bucket); }
  void next() { ++slot; }
  void fail() {}
};

struct Gather::Placer {
  const Gather &gather;
  uint8_t *items;
  const uint8_t **sources; ///< Of items, where warps copy them.
  uint32_t *pairs, *pairStarts;
  uint64_t *keys;
  uint32_t record, pair, ordinal; ///< Those before, in the order of emission.
  int64_t slot;
  uint32_t *first = nullptr, *end = nullptr; ///< Buckets of the last record.

  void emit(bool) { ++ordinal; }
  void next() { ++slot; }
  void fail() {}

  void keep(const pikoir_entry *entry) {
    int64_t to = record++, toPair = pair;
    if (gather.byPosition_) {
      int64_t rank = gather.spans_.rankOf(slot);
      const Spans::Places &places = gather.recordPlaces_;
      to = places.starts[rank] + (to - places.emitted[slot]);
      if (pairs)
        toPair = gather.pairPlaces_.starts[rank] +
                 (toPair - gather.pairPlaces_.emitted[slot]);
    }
    if (sources)
      sources[to] = payload(entry);
    else if (entry)
      copyRecord(items + to * gather.shape_.recordSize, payload(entry),
                 gather.shape_.recordSize);
    if (pairs) {
      pairStarts[to] = static_cast<uint32_t>(toPair);
      first = end = pairs + toPair;
    }
    if (keys)
      putKey(keys + to * gather.keyWidth_);
    if (gather.siblings_)
      gather.siblings_->describe(gather.lineage_, to, slot, ordinal - 1);
  }
  void place(uint32_t bucket) {
    if (!pairs)
      return;
    *end = first == end ? bucket | PIKOIR_FIRST_BUCKET : bucket;
    ++end;
    ++pair;
  }
  void insert(uint32_t bucket) {
    *first &= ~PIKOIR_FIRST_BUCKET;
    uint32_t *at = end++;
    for (; at != first && at[-1] > bucket; --at)
      *at = at[-1];
    *at = bucket;
    *first |= PIKOIR_FIRST_BUCKET;
    ++pair;
  }

  void putKey(uint64_t *to) const {
    const KernelState &from = gather.from_;
    if (gather.isHosted()) { // a new lineage, of all that it emits
      uint64_t launch = static_cast<uint64_t>(larger<int64_t>(from.strip, 0));
      to[0] = static_cast<uint64_t>(gather.input_.root) << 32 | launch;
      to[1] = ordinal;
      return;
    }
    if (gather.input_.collects) { // a new lineage
      to[0] = static_cast<uint64_t>(gather.input_.root) << 32 | from.launch;
      to[1] = static_cast<uint64_t>(gather.spans_.rankOf(slot)) << 32 | ordinal;
      return;
    }
    int64_t item = gather.spans_.itemOf(slot);
    for (int32_t w = 0; w < from.keys.width; ++w)
      to[w] = from.keys.word(item, w);
    to[from.keys.width] =
        static_cast<uint64_t>(gather.bucketOf(slot)) << 32 | ordinal;
  }
};

inline int64_t Gather::bucketOf(int64_t position) const {
  const int64_t *offsets = from_.input.offsets;
  int64_t low = 0, high = from_.buckets; // offsets[low] <= position
  while (high - low > 1) {
    int64_t middle = (low + high) / 2;
    (offsets[middle] <= position ? low : high) = middle;
  }
  return low;
}

inline void Gather::countSpans() {
  auto takeWords = [&](bool wanted) {
    return wanted ? grid_.take<uint32_t>(spans_.count) : nullptr;
  };
  records_ = takeWords(true);
  pairs_ = takeWords(shape_.placed);
  all_ = takeWords(keyWidth_ > 0);
  uint32_t *ends = takeWords(byPosition_);
  uint64_t received = 0;
  bool failed = false;
  int64_t totals[4];
  grid_.scan<4>(spans_.count, {records_, pairs_, all_, ends}, totals,
                [&](int64_t s, uint32_t (&numbers)[4]) {
                  Counter counter;
                  read(counter, s);
                  numbers[0] = counter.records;
                  numbers[1] = counter.pairs;
                  numbers[2] = counter.all;
                  numbers[3] = counter.ends;
                  received += counter.mine;
                  failed |= counter.failed;
                });
  if (received > 0)
    __atomic_fetch_add(input_.received, received, __ATOMIC_RELAXED);
  if (failed)
    grid_.failFrame();
  recordCount_ = totals[0];
  pairCount_ = shape_.placed ? totals[1] : 0;
  if (ends && !grid_.hasFailed())
    slots_ = spans_.findSlots(grid_, ends);
}

inline void Gather::findSlots() {
  uint32_t *records = grid_.takeZeros(spans_.slots());
  uint32_t *pairs = shape_.placed ? grid_.takeZeros(spans_.slots()) : nullptr;
  grid_.sync();
  if (grid_.hasFailed())
    return;
  grid_.forEach(spans_.count, [&](int64_t s) {
    SlotCounter counter{records, pairs, slots_[s]};
    read(counter, s);
  });
  grid_.sync();
  recordPlaces_ = spans_.placeSlots(grid_, records);
  if (pairs && !grid_.hasFailed())
    pairPlaces_ = spans_.placeSlots(grid_, pairs);
}

inline void Gather::place(Stream &stream) {
  uint8_t *items = nullptr;
  const uint8_t **sources = nullptr;
  uint32_t *pairs = nullptr, *pairStarts = nullptr;
  uint64_t *keys = nullptr;
  int64_t size = shape_.recordSize;
  if (!input_.isSource) {
    stream.items = items = grid_.take<uint8_t>(recordCount_ * size);
    if (isCopiedByWarps(size) && recordCount_ > mostOfSpan * spans_.count)
      sources = grid_.take<const uint8_t *>(recordCount_);
  }
  if (shape_.placed) {
    stream.pairs = pairs = grid_.take<uint32_t>(pairCount_);
    stream.pairStarts = pairStarts = grid_.take<uint32_t>(recordCount_ + 1);
  }
  if (keyWidth_ > 0) {
    keys = grid_.take<uint64_t>(recordCount_ * keyWidth_);
    stream.keys = {keys, 0, keyWidth_};
  }
  if (siblings_)
    lineage_ = {grid_.take<uint32_t>(recordCount_),
                grid_.take<uint32_t>(recordCount_),
                grid_.take<uint32_t>(recordCount_)};
  if (grid_.hasFailed())
    return;
  if (pairStarts && Grid::isFirst())
    pairStarts[recordCount_] = static_cast<uint32_t>(pairCount_);
  const uint32_t *all = siblings_ ? siblings_->before() : all_;
  const uint32_t *slots = siblings_ ? siblings_->slots() : slots_;
  grid_.forEach(spans_.count, [&](int64_t s) {
    Placer placer{*this,
                  items,
                  sources,
                  pairs,
                  pairStarts,
                  keys,
                  records_[s],
                  pairs_ ? pairs_[s] : 0,
                  all ? all[s] : 0,
                  slots ? slots[s] : 0};
    read(placer, s);
  });
  grid_.sync();
  if (!sources)
    return;
  grid_.forEachByWarps(recordCount_, [&](int64_t i) {
    copyRecords(items + i * size, i < recordCount_ ? sources[i] : nullptr,
                size);
  });
  grid_.sync();
}

/// All items begin and end at no pair.
inline void Gather::placeNone(Stream &stream) {
  stream.pairs = stream.pairStarts = grid_.takeZeros(stream.count + 1);
  grid_.sync();
}

inline void Gather::run(Stream &stream) {
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
