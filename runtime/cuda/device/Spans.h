// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Spans.h - What a kernel's units have written down ------------------===//

#ifndef PIKO_RUNTIME_CUDA_DEVICE_SPANS_H
#define PIKO_RUNTIME_CUDA_DEVICE_SPANS_H

#include "cuda/device/Entries.h"

namespace piko::cuda {

/// The directories of all units of a kernel, one after the other.
class Spans {
public:
  Spans(Grid &grid, const KernelState &from) : grid_(grid), from_(from) {}

  const KernelState &kernel() const { return from_; }

  int64_t count = 0;
  pikoir_span *list = nullptr; ///< In the order of emission.
  uint32_t *unitOf = nullptr;

  /// Between two barriers.
  void find();
  /// The slot in which each span begins; before it, so many positions end.
  uint32_t *findSlots(Grid &grid, const uint32_t *ends) const;

  int64_t slots() const {
    return from_.input.calls ? from_.input.call_count : from_.input.count;
  }
  int64_t rankOf(int64_t slot) const {
    return from_.rank ? from_.rank[slot] : slot;
  }
  int64_t itemOf(int64_t slot) const {
    return from_.input.order ? from_.input.order[slot] : slot;
  }

  /// Where what slots have emitted begins: in the order of emission, and, by
  /// rank, in that of positions. After the last, their sum.
  struct Places {
    uint32_t *emitted, *starts;
  };
  /// `counts` are those of slots. Between two barriers.
  Places placeSlots(Grid &grid, const uint32_t *counts) const;

private:
  int64_t firstSlotOf(int64_t unit) const {
    const pikoir_unit &u = from_.input.units[unit];
    return from_.input.calls ? u.bucket_begin : u.begin;
  }

  Grid &grid_;
  const KernelState &from_;
  uint32_t *firstSpans_ = nullptr; ///< Of each unit, and the end.
};

inline void Spans::find() {
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
  count = grid_.scan(units + 1, firstSpans_, [&](int64_t unit) {
    int64_t sum = 0;
    if (unit < units)
      forDirectories(unit, [&](auto *, int64_t spans) { sum += spans; });
    return static_cast<uint32_t>(sum);
  });
  list = grid_.take<pikoir_span>(count);
  unitOf = grid_.take<uint32_t>(count);
  if (grid_.hasFailed())
    return;
  int64_t warp = grid_.index() / warpSize, warps = grid_.size() / warpSize;
  for (int64_t unit = warp; unit < units; unit += warps) {
    int64_t to = firstSpans_[unit];
    forDirectories(unit, [&](const pikoir_span *from, int64_t spans) {
      for (int64_t i = Grid::lane(); i < spans; i += warpSize) {
        list[to + i] = from[i];
        unitOf[to + i] = static_cast<uint32_t>(unit);
      }
      to += spans;
    });
  }
  grid_.sync();
}

inline uint32_t *Spans::findSlots(Grid &grid, const uint32_t *ends) const {
  uint32_t *slots = grid.take<uint32_t>(count);
  if (slots)
    grid.forEach(count, [&](int64_t s) {
      uint32_t unit = unitOf[s];
      slots[s] = static_cast<uint32_t>(firstSlotOf(unit) + ends[s] -
                                       ends[firstSpans_[unit]]);
    });
  grid.sync();
  return slots;
}

inline Spans::Places Spans::placeSlots(Grid &grid,
                                       const uint32_t *counts) const {
  int64_t n = slots();
  Places places{grid.take<uint32_t>(n + 1), nullptr};
  if (grid.hasFailed())
    return places;
  grid.scan(n + 1, places.emitted,
            [&](int64_t i) { return i < n ? counts[i] : 0; });
  places.starts = places.emitted;
  if (!from_.rank)
    return places;
  places.starts = grid.takeZeros(from_.rankSize + 1);
  grid.sync();
  if (grid.hasFailed())
    return places;
  grid.forEach(n, [&](int64_t i) { places.starts[from_.rank[i]] = counts[i]; });
  grid.exclusiveScan(places.starts, from_.rankSize + 1);
  return places;
}

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_DEVICE_SPANS_H
