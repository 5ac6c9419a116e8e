// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- WaveLoop.cpp - A loop that runs in waves ---------------------------===//

#include "cpu/WaveLoop.h"
#include "cpu/Parallel.h"

using namespace piko::rt;

void WaveLoop::begin() {
  later_ = std::vector<Queue>(members());
  left_ = std::vector<Queue>(p_.edges.size());
  now_ = std::move(entries_);
  nodes_ = std::vector<Growing<uint32_t>>(members());
  for (size_t m = 0; m < members(); ++m) {
    uint32_t *nodes = nodes_[m].extend(p_.memory, now_[m].count);
    for (int64_t i = 0; i < now_[m].count; ++i)
      nodes[i] = places_[m] ? places_[m][i] : static_cast<uint32_t>(i);
  }
  places_.clear();
  tree_.reset(entryCount_);
  hops_ = 0;
  cursor_ = 0;
}

int32_t WaveLoop::next() {
  for (;;) {
    for (; cursor_ < members(); ++cursor_)
      if (now_[cursor_].count > 0) {
        running_ = cursor_++;
        return shape_.stages[running_];
      }
    if (!nextLevel()) {
      finish();
      return -1;
    }
  }
}

/// What made one more hop; false if there is nothing.
bool WaveLoop::nextLevel() {
  int64_t waiting = 0, leaves = 0;
  for (size_t m = 0; m < members(); ++m) {
    waiting += later_[m].count;
    nodes_[m] = std::move(later_[m].nodes);
    now_[m] = later_[m].take(0);
  }
  for (const Queue &queue : left_)
    leaves += queue.count;
  if (waiting == 0)
    return false;
  if (++hops_ > p_.loopLimit)
    fail();
  if (tree_.isTall(waiting + leaves))
    flatten();
  cursor_ = 0;
  return true;
}

Stream WaveLoop::takeInput() {
  waveNodes_ = std::move(nodes_[running_]);
  return std::exchange(now_[running_], {});
}

void WaveLoop::absorb(std::vector<Port> &ports, Array<uint32_t> items) {
  int64_t base = tree_.size();
  checkCount(member(running_), base + items.size());
  uint32_t *parents = tree_.extend(p_.memory, items.size());
  parallelChunks(p_.threads, items.size(), 1 << 16,
                 [&](int64_t begin, int64_t end) {
                   for (int64_t i = begin; i < end; ++i)
                     parents[i] = waveNodes_[items[i]];
                 });
  for (Port &port : ports) {
    const Edge &edge = p_.edges[port.edge];
    const Stage &to = p_.stages[edge.consumer];
    Queue &queue =
        edge.insideLoop ? later_[memberOf(edge.consumer)] : left_[port.edge];
    checkCount(to, queue.count + port.count());
    checkCount(to, queue.pairs.size() + port.records.stream.pairCount);
    queue.append(p_.memory, port.records.stream, recordSize(to), 0);
    uint32_t *nodes = queue.nodes.extend(p_.memory, port.count());
    for (int64_t i = 0; i < port.count(); ++i)
      nodes[i] = static_cast<uint32_t>(base) + port.numbers[i];
  }
}

void WaveLoop::flatten() {
  std::vector<Growing<uint32_t> *> leaves;
  for (Growing<uint32_t> &nodes : nodes_)
    leaves.push_back(&nodes);
  for (Queue &queue : left_)
    leaves.push_back(&queue.nodes);
  tree_.flatten(p_.memory, leaves);
}

/// Puts what left the loop into the queues of its edges, in order.
void WaveLoop::finish() {
  flatten();
  for (size_t e = 0; e < left_.size(); ++e)
    if (left_[e].count > 0)
      sortLeft(p_.edges[e], left_[e]);
  left_.clear();
  now_.clear();
  nodes_.clear();
}

void WaveLoop::sortLeft(Edge &edge, Queue &left) {
  constexpr uint32_t none = UINT32_MAX;
  const Stage &to = p_.stages[edge.consumer];
  Growing<uint32_t> places = std::move(left.nodes);
  Stream from = left.take(0), sorted;
  Array<uint32_t> at(p_.memory, tree_.size());
  std::memset(at.data(), 0xff, static_cast<size_t>(at.size()) * 4);
  for (int64_t i = 0; i < from.count; ++i)
    at[places[i]] = static_cast<uint32_t>(i);
  Array<uint32_t> order(p_.memory, from.count);
  for (int64_t place = 0; place < at.size(); ++place)
    if (at[place] != none)
      order[sorted.count++] = at[place];
  int64_t size = recordSize(to);
  sorted.itemStorage = Array<uint8_t>(p_.memory, from.count * size);
  sorted.items = sorted.itemStorage.data();
  if (edge.keyed) {
    sorted.keys.width = edge.keyWidth;
    sorted.keys.words = Array<uint64_t>(p_.memory, from.count * edge.keyWidth);
  }
  parallelChunks(
      p_.threads, from.count, 1 << 12, [&](int64_t begin, int64_t end) {
        for (int64_t i = begin; i < end; ++i) {
          std::memcpy(sorted.itemStorage.data() + i * size,
                      from.items + order[i] * size, static_cast<size_t>(size));
          uint32_t place = places[order[i]];
          if (edge.keyed)
            writeKey(edge, &sorted.keys.words[i * edge.keyWidth],
                     tree_.entry(place), place);
        }
      });
  if (to.placed()) {
    Array<uint32_t> starts = pairStarts(p_.memory, from);
    sorted.pairStorage = Array<uint32_t>(p_.memory, from.pairCount);
    sorted.pairs = sorted.pairStorage.data();
    for (int64_t i = 0; i < from.count; ++i)
      for (uint32_t k = starts[order[i]]; k < starts[order[i] + 1]; ++k)
        sorted.pairStorage[sorted.pairCount++] = from.pairs[k];
  }
  edge.queue->append(p_.memory, sorted, size, sorted.keys.width);
}

/// Names the first primitive, in order, that makes one hop too many.
void WaveLoop::fail() {
  left_.clear();
  flatten();
  for (size_t m = 0; m < members(); ++m)
    for (int64_t i = 0; i < now_[m].count; ++i)
      if (nodes_[m][i] == 0) {
        uint32_t first = 0;
        if (member(m).placed())
          first = now_[m].pairs[pairStarts(p_.memory, now_[m])[i]];
        failHops(member(m), first & ~PIKOIR_FIRST_CELL,
                 now_[m].items + i * recordSize(member(m)));
      }
  throw Failure{PIKORT_BAD_PROGRAM, "expected a loop to hold a primitive"};
}
