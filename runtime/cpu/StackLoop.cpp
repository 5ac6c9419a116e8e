// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- StackLoop.cpp - A loop that runs one position at a time ------------===//

#include "cpu/StackLoop.h"

#include <algorithm>

using namespace piko::rt;

void StackLoop::begin() {
  stack_.shrink(0);
  records_.shrink(0);
  cells_.shrink(0);
  nextEntry_ = 0;
  left_ = 0;
  order_ = Array<Entry>(p_.memory, entryCount_);
  starts_.clear();
  for (size_t m = 0; m < members(); ++m) {
    bool placed = member(m).placed() && entries_[m].count > 0;
    starts_.push_back(placed ? pairStarts(p_.memory, entries_[m])
                             : Array<uint32_t>());
    for (int64_t i = 0; i < entries_[m].count; ++i)
      order_[places_[m] ? places_[m][i] : i] = {static_cast<uint32_t>(m),
                                                static_cast<uint32_t>(i)};
  }
}

void StackLoop::push(const Waiting &waiting, const uint8_t *record,
                     const uint32_t *cells) {
  records_.append(p_.memory, record, recordSize(p_.stages[waiting.stage]));
  cells_.append(p_.memory, cells, waiting.cells);
  *stack_.extend(p_.memory, 1) = waiting;
}

/// Pushes an item in each of its cells, the last one first.
void StackLoop::pushCells(int32_t stage, int64_t hops, const Stream &stream,
                          int64_t item, const Array<uint32_t> &pairStarts) {
  const uint8_t *record = stream.items + item * recordSize(p_.stages[stage]);
  if (!p_.stages[stage].placed())
    return push({-1, stage, hops, 0}, record, nullptr);
  for (uint32_t k = pairStarts[item + 1]; k-- > pairStarts[item];)
    if (uint32_t cell = stream.pairs[k]; cell != noCell) {
      cell |= PIKOIR_FIRST_CELL;
      push({-1, stage, hops, 1}, record, &cell);
    }
}

Stream StackLoop::pop() {
  Waiting top = stack_[stack_.size() - 1];
  stack_.shrink(stack_.size() - 1);
  Stream stream;
  stream.count = 1;
  stream.pairCount = top.cells;
  int64_t size = recordSize(p_.stages[top.stage]);
  records_.shrink(records_.size() - size);
  cells_.shrink(cells_.size() - top.cells);
  stream.items = records_.data() + records_.size();
  stream.pairs = cells_.data() + cells_.size();
  return stream;
}

/// The top of the stack leaves the loop.
void StackLoop::leave() {
  const Edge &edge = p_.edges[stack_[stack_.size() - 1].edge];
  Stream stream = pop();
  if (edge.keyed) {
    stream.keys.width = edge.keyWidth;
    stream.keys.words = Array<uint64_t>(p_.memory, edge.keyWidth);
    writeKey(edge, stream.keys.words.data(), nextEntry_ - 1, left_++);
  }
  const Stage &to = p_.stages[edge.consumer];
  checkCount(to, edge.queue->count + 1);
  checkCount(to, edge.queue->pairs.size() + stream.pairCount);
  edge.queue->append(p_.memory, stream, recordSize(to), stream.keys.width);
}

int32_t StackLoop::next() {
  for (;;) {
    while (stack_.size() > 0) {
      running_ = stack_[stack_.size() - 1];
      if (running_.edge < 0) {
        const Stage &stage = p_.stages[running_.stage];
        if (running_.hops > p_.loopLimit)
          failHops(stage,
                   running_.cells
                       ? cells_[cells_.size() - 1] & ~PIKOIR_FIRST_CELL
                       : 0,
                   records_.data() + records_.size() - recordSize(stage));
        return running_.stage;
      }
      leave();
    }
    if (nextEntry_ == entryCount_) {
      entries_.clear();
      return -1;
    }
    const Entry &entry = order_[nextEntry_++];
    pushCells(shape_.stages[entry.member], 0, entries_[entry.member],
              entry.item, starts_[entry.member]);
  }
}

Stream StackLoop::takeInput() {
  Stream top = pop(), stream;
  int64_t size = recordSize(p_.stages[running_.stage]);
  stream.count = 1;
  stream.itemStorage = Array<uint8_t>(p_.memory, size);
  std::memcpy(stream.itemStorage.data(), top.items, static_cast<size_t>(size));
  stream.items = stream.itemStorage.data();
  stream.pairCount = top.pairCount;
  stream.pairStorage = Array<uint32_t>(p_.memory, 1);
  std::copy_n(top.pairs, top.pairCount, stream.pairStorage.data());
  stream.pairs = stream.pairStorage.data();
  return stream;
}

/// Pushes what the position emitted, the last one first.
void StackLoop::absorb(std::vector<Port> &ports, Array<uint32_t> items) {
  struct Place {
    size_t port;
    int64_t item;
  };
  std::vector<Place> order(static_cast<size_t>(items.size()));
  std::vector<Array<uint32_t>> starts(ports.size());
  for (size_t q = 0; q < ports.size(); ++q) {
    if (p_.stages[p_.edges[ports[q].edge].consumer].placed())
      starts[q] = pairStarts(p_.memory, ports[q].records.stream);
    for (int64_t i = 0; i < ports[q].count(); ++i)
      order[ports[q].numbers[i]] = {q, i};
  }
  for (size_t n = order.size(); n-- > 0;) {
    auto [q, item] = order[n];
    const Edge &edge = p_.edges[ports[q].edge];
    const Stream &stream = ports[q].records.stream;
    if (edge.insideLoop) {
      pushCells(edge.consumer, running_.hops + 1, stream, item, starts[q]);
      continue;
    }
    int64_t begin = starts[q] ? starts[q][item] : 0;
    int64_t end = starts[q] ? starts[q][item + 1] : 0;
    push({ports[q].edge, edge.consumer, 0, end - begin},
         stream.items + item * recordSize(p_.stages[edge.consumer]),
         stream.pairs + begin);
  }
}
