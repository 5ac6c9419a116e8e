// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Loop.cpp - What goes into a loop, and what its stages emit ---------===//

#include "cpu/Loop.h"
#include "cpu/Check.h"
#include "cpu/Parallel.h"
#include "cpu/StackLoop.h"
#include "cpu/WaveLoop.h"

#include <algorithm>

using namespace piko::rt;

std::unique_ptr<Loop> Loop::make(pikort_pipeline &p, const LoopShape &shape) {
  if (shape.ordered)
    return std::make_unique<StackLoop>(p, shape);
  return std::make_unique<WaveLoop>(p, shape);
}

size_t Loop::memberOf(int32_t stage) const {
  return static_cast<size_t>(
      std::find(shape_.stages.begin(), shape_.stages.end(), stage) -
      shape_.stages.begin());
}

void Loop::start(bool fromOutside) {
  entries_.clear();
  places_.clear();
  entryCount_ = 0;
  size_t used = 0;
  for (size_t m = 0; m < members(); ++m) {
    entries_.push_back(gatherInputs(p_, member(m), fromOutside));
    entryCount_ += entries_[m].count;
    used += entries_[m].count > 0;
  }
  checkCount(member(0), entryCount_);
  if (used > 1)
    places_ = mergePlaces(p_, entries_);
  else
    places_.resize(members());
  if (shape_.keyed) {
    int32_t width = shape_.keyWidth;
    keys_ = Array<uint64_t>(p_.memory, entryCount_ * width);
    for (size_t m = 0; m < members(); ++m) {
      const Keys &keys = entries_[m].keys;
      parallelChunks(p_.threads, entries_[m].count, 1 << 14,
                     [&](int64_t begin, int64_t end) {
                       for (int64_t i = begin; i < end; ++i) {
                         int64_t place = places_[m] ? places_[m][i] : i;
                         for (int32_t w = 0; w < width; ++w)
                           keys_[place * width + w] =
                               w < keys.width ? keys.word(i, w) : 0;
                       }
                     });
    }
  }
  begin();
}

void Loop::writeKey(const Edge &edge, uint64_t *key, int64_t entry,
                    uint64_t place) const {
  for (int32_t w = 0; w < edge.keyWidth; ++w)
    key[w] = w < shape_.keyWidth    ? keys_[entry * shape_.keyWidth + w]
             : w == shape_.keyWidth ? place
                                    : 0;
}

void Loop::failHops(const Stage &stage, int64_t cell,
                    const uint8_t *record) const {
  std::string text = "stage " + quoted(stage.name) + ", bin " +
                     std::to_string(cell / stage.tiles) +
                     ": a loop did not end within " +
                     std::to_string(p_.loopLimit) + " hops";
  if (p_.checker)
    text += p_.checker->contextOf(stage, record);
  throw Failure{PIKORT_ENDLESS, text};
}

// --- What a kernel emitted --------------------------------------------------

void Loop::absorb(Kernel &kernel) {
  std::vector<Port> ports;
  int64_t count = 0;
  for (int32_t e : p_.stages[kernel.stage].outputs)
    if (e >= 0) {
      ports.push_back({e, gatherPort(p_, p_.edges[e]), {}});
      count += ports.back().count();
    }
  checkCount(p_.stages[kernel.stage], count);
  Array<uint32_t> items(p_.memory, count);
  numberRecords(kernel, ports, items.data());
  kernel.clear();
  absorb(ports, std::move(items));
}

/// A record's number is its place in its port, plus the records of the other
/// ports before its position, plus those at its position with a lower ordinal.
void Loop::numberRecords(const Kernel &kernel, std::vector<Port> &ports,
                         uint32_t *items) {
  int64_t ranks = kernel.rank ? kernel.rankSize : kernel.positions;
  Array<uint32_t> itemOf(p_.memory, ranks);
  parallelChunks(
      p_.threads, kernel.positions, 1 << 16, [&](int64_t begin, int64_t end) {
        for (int64_t i = begin; i < end; ++i)
          itemOf[kernel.rank ? kernel.rank[i] : i] =
              kernel.order ? kernel.order[i] : static_cast<uint32_t>(i);
      });
  for (Port &port : ports)
    port.numbers = Array<uint32_t>(p_.memory, port.count());
  auto first = [](const Port &port, int64_t rank) -> int64_t {
    return rank < port.records.starts.size() ? port.records.starts[rank]
                                             : port.count();
  };
  auto number = [&](Port &port, int64_t rank) {
    int64_t begin = first(port, rank), end = first(port, rank + 1);
    if (begin == end)
      return;
    uint32_t *numbers = port.numbers.data();
    for (int64_t k = begin; k < end; ++k)
      numbers[k] = static_cast<uint32_t>(k);
    for (const Port &other : ports) {
      if (&other == &port)
        continue;
      int64_t before = first(other, rank), last = first(other, rank + 1);
      for (int64_t k = begin; k < end; ++k) {
        while (before < last &&
               other.records.ordinals[before] < port.records.ordinals[k])
          ++before;
        numbers[k] += static_cast<uint32_t>(before);
      }
    }
    for (int64_t k = begin; k < end; ++k)
      items[numbers[k]] = itemOf[rank];
  };
  parallelChunks(p_.threads, ranks, 1 << 14, [&](int64_t begin, int64_t end) {
    for (Port &port : ports)
      for (int64_t rank = begin; rank < end; ++rank)
        number(port, rank);
  });
}
