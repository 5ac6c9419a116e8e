// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Siblings.h - What each primitive of a wave has emitted -------------===//
//
// A wave's primitives have places in the lineage order of all that a loop
// holds. How many children each has, by all ports, and which of them a record
// is, gives the places of the next wave (Loops.h).
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CUDA_DEVICE_SIBLINGS_H
#define PIKO_RUNTIME_CUDA_DEVICE_SIBLINGS_H

#include "cuda/device/Spans.h"

namespace piko::cuda {

class Siblings {
public:
  Siblings(Grid &grid, const Spans &spans, const QueuePort &port)
      : grid_(grid), spans_(spans), from_(spans.kernel()), port_(port) {}

  /// Sets the counts at the places of the kernel's primitives. Between two
  /// barriers.
  void run(uint32_t *childCounts);

  /// Records before each span, and the slot in which it begins.
  const uint32_t *before() const { return before_; }
  const uint32_t *slots() const { return slots_; }
  /// Says of record `to` where it stands: number `ordinal` of all records, in
  /// the order of emission, from a slot.
  void describe(const Lineage &lineage, int64_t to, int64_t slot,
                uint32_t ordinal) const {
    int64_t item = spans_.itemOf(slot);
    lineage.places[to] = placeOf(item);
    lineage.children[to] = places_.starts[spans_.rankOf(slot)] +
                           (ordinal - places_.emitted[slot]) -
                           places_.starts[firstRankOf(item)];
    lineage.entries[to] = from_.lineage.entries ? from_.lineage.entries[item]
                                                : static_cast<uint32_t>(item);
  }

private:
  struct Counter {
    uint32_t records = 0, ends = 0;
    void emit(bool) { ++records; }
    void keep(const pikoir_entry *) {}
    void place(uint32_t) {}
    void insert(uint32_t) {}
    void next() { ++ends; }
    void fail() {}
  };
  /// Counts for slots; one may be in several spans.
  struct SlotCounter {
    uint32_t *records;
    int64_t slot;
    void emit(bool) {
      __atomic_fetch_add(&records[slot], 1u, __ATOMIC_RELAXED);
    }
    void keep(const pikoir_entry *) {}
    void place(uint32_t) {}
    void insert(uint32_t) {}
    void next() { ++slot; }
    void fail() {}
  };

  template <class Sink> void read(Sink &sink, int64_t span) const {
    SpanReader<Sink>(port_.input, port_.shape, sink).read(spans_.list[span]);
  }
  uint32_t placeOf(int64_t item) const {
    return from_.lineage.places ? from_.lineage.places[item]
                                : static_cast<uint32_t>(item);
  }
  int64_t firstRankOf(int64_t item) const {
    return from_.pairStarts ? from_.pairStarts[item] : item;
  }

  Grid &grid_;
  const Spans &spans_;
  const KernelState &from_;
  const QueuePort &port_;
  uint32_t *before_ = nullptr, *slots_ = nullptr;
  Spans::Places places_{};
};

inline void Siblings::run(uint32_t *childCounts) {
  before_ = grid_.take<uint32_t>(spans_.count);
  uint32_t *ends = grid_.take<uint32_t>(spans_.count);
  if (grid_.hasFailed())
    return;
  int64_t totals[2];
  grid_.scan<2>(spans_.count, {before_, ends}, totals,
                [&](int64_t s, uint32_t (&numbers)[2]) {
                  Counter counter;
                  read(counter, s);
                  numbers[0] = counter.records;
                  numbers[1] = counter.ends;
                });
  slots_ = spans_.findSlots(grid_, ends);
  uint32_t *counts = grid_.takeZeros(spans_.slots());
  grid_.sync();
  if (grid_.hasFailed())
    return;
  grid_.forEach(spans_.count, [&](int64_t s) {
    SlotCounter counter{counts, slots_[s]};
    read(counter, s);
  });
  grid_.sync();
  places_ = spans_.placeSlots(grid_, counts);
  if (grid_.hasFailed())
    return;
  grid_.forEach(from_.items, [&](int64_t item) {
    childCounts[placeOf(item)] = places_.starts[firstRankOf(item + 1)] -
                                 places_.starts[firstRankOf(item)];
  });
  grid_.sync();
}

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_DEVICE_SIBLINGS_H
