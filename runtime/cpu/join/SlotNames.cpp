// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- SlotNames.cpp - Names of slots that all ranks know -----------------===//
//
// A stage that collects begins a lineage by the number of a slot among all.
// Where ranks share its bins, none knows that number: a slot's name is its bin
// and its number there, or the rank and its number there.
//
//===----------------------------------------------------------------------===//

#include "cpu/Kernel.h"
#include "ranks/Ranks.h"

using namespace piko::rt;

void piko::rt::nameSlots(pikort_pipeline &p, const Stage &stage,
                         Kernel &kernel) {
  kernel.slotNames = Array<uint64_t>(p.memory, kernel.slots());
  auto rankOf = [&](int64_t slot) -> int64_t {
    return kernel.rank ? kernel.rank[slot] : slot;
  };
  // Parts of a source are in the order of ranks.
  if (stage.partition == PIKOIR_PARTS) {
    auto part = static_cast<uint64_t>(p.ranks ? p.ranks->rank() : 0) << 32;
    for (int64_t i = 0; i < kernel.slots(); ++i)
      kernel.slotNames[i] = part + static_cast<uint64_t>(rankOf(i));
    return;
  }
  for (int64_t bin = 0; bin < stage.bins() && !kernel.calls; ++bin) {
    int64_t begin = kernel.offsets[bin * stage.tiles],
            end = kernel.offsets[(bin + 1) * stage.tiles];
    for (int64_t i = begin; i < end; ++i)
      kernel.slotNames[i] =
          (uint64_t(bin) << 32) + static_cast<uint64_t>(rankOf(i) - begin);
  }
  uint64_t number = 0;
  for (int64_t i = 0; i < kernel.calls.size(); ++i) {
    auto bin = static_cast<uint64_t>(kernel.calls[i].bin);
    number = i > 0 && kernel.calls[i - 1].bin == kernel.calls[i].bin
                 ? number + 1
                 : bin << 32;
    kernel.slotNames[i] = number;
  }
}

void piko::rt::nameLocalSlots(pikort_pipeline &p, const Kernel &host,
                              Kernel &kernel, int64_t slots) {
  kernel.slotNames = Array<uint64_t>(p.memory, slots);
  int64_t slot = 0;
  uint64_t previous = UINT64_MAX;
  for (const pikoir_unit &unit : host.units)
    for (int64_t i = unit.bucket_begin; i < unit.bucket_end; ++i) {
      auto bin = static_cast<uint64_t>(host.calls ? host.calls[i].bin : i);
      kernel.slotNames[slot] =
          previous >> 32 == bin && slot > 0 ? previous + 1 : bin << 32;
      previous = kernel.slotNames[slot++];
    }
}
