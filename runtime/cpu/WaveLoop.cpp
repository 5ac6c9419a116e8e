// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- WaveLoop.cpp - A loop that runs in waves ---------------------------===//

#include "cpu/WaveLoop.h"
#include "cpu/Parallel.h"

#include <algorithm>
#include <numeric>

using namespace piko::rt;

WaveLoop::WaveLoop(pikort_pipeline &p, const LoopShape &shape)
    : Loop(p, shape) {
  for (int32_t s : shape.stages)
    for (int32_t e : p.stages[s].outputs)
      if (e >= 0 && !p.edges[e].insideLoop)
        exits_.push_back(e);
}

void WaveLoop::begin() {
  for (std::vector<Queue> &queues : queues_)
    queues = std::vector<Queue>(members());
  left_ = std::vector<Queue>(p_.edges.size());
  now_.assign(entries_.begin(), entries_.end());
  for (size_t m = 0; m < members(); ++m) {
    if (places_[m])
      current()[m].nodes.append(p_.memory, places_[m].data(), now_[m].count);
  }
  places_.clear();
  tree_.reset(entryCount_);
  leftCount_ = 0;
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
  int64_t waiting = 0;
  turn_ = 1 - turn_;
  for (size_t m = 0; m < members(); ++m) {
    now_[m] = current()[m].view();
    waiting += now_[m].count;
    if (later()[m].count > 0)
      later()[m].reset();
  }
  if (waiting == 0)
    return false;
  if (++hops_ > p_.loopLimit)
    fail();
  if (tree_.isTall(waiting + leftCount_))
    flatten();
  cursor_ = 0;
  return true;
}

// --- What a kernel takes ----------------------------------------------------

bool WaveLoop::runsSerially(Kernel &kernel) const {
  const Items &input = now_[running_];
  return Serial::takes(p_, kernel, std::max(input.count, input.pairCount));
}

/// A wave's memory is freed with it, or with all entries.
Stream WaveLoop::takeInput() {
  if (hops_ == 0)
    return std::move(entries_[running_]);
  return current()[running_].take(0);
}

Queue &WaveLoop::queueBehind(const Edge &edge) {
  return edge.insideLoop ? later()[memberOf(edge.consumer)]
                         : left_[static_cast<size_t>(&edge - p_.edges.data())];
}

void WaveLoop::noteCount(const Edge &edge, const Items &emitted) {
  const Stage &to = p_.stages[edge.consumer];
  const Queue &queue = queueBehind(edge);
  leftCount_ += edge.insideLoop ? 0 : emitted.count;
  checkCount(to, queue.count + emitted.count);
  checkCount(to, queue.pairCount() + emitted.pairCount);
}

void WaveLoop::put(int32_t e, const Items &emitted, int64_t base,
                   const uint32_t *numbers) {
  const Edge &edge = p_.edges[e];
  noteCount(edge, emitted);
  Queue &queue = queueBehind(edge);
  queue.append(p_.memory, Stream{emitted, {}, {}, {}, {}, {}},
               recordSize(p_.stages[edge.consumer]), 0);
  uint32_t *nodes = queue.nodes.extend(p_.memory, emitted.count);
  for (int64_t i = 0; i < emitted.count; ++i)
    nodes[i] = static_cast<uint32_t>(base) + numbers[i];
}

// --- What a serial launch emitted -------------------------------------------

/// Children of a node are numbered as they were emitted, since its cells were
/// taken in order.
void WaveLoop::absorb(const Serial &launch) {
  if (launch.emitted() == 1 && launch.slots() == 1)
    return absorbOne(launch);
  int64_t base = tree_.size();
  checkCount(member(running_), base + launch.emitted());
  uint32_t *parents = tree_.extend(p_.memory, launch.emitted());
  uint32_t number = 0;
  for (int64_t slot = 0; slot < launch.slots(); ++slot)
    for (uint32_t parent = nodeOf(launch.itemAt(slot));
         number < launch.emittedUntil(slot); ++number)
      parents[number] = parent;
  const std::vector<int32_t> &outputs = member(running_).outputs;
  for (size_t port = 0; port < outputs.size(); ++port) {
    const Serial::Emitted &emitted = launch.ports()[port];
    if (emitted.count > 0)
      put(outputs[port], emitted, base, emitted.numbers);
  }
  current()[running_].nodes.shrink(0);
}

/// An only child takes its parent's place in the tree.
void WaveLoop::absorbOne(const Serial &launch) {
  static constexpr uint32_t first = 0;
  uint32_t node = nodeOf(launch.itemAt(0));
  current()[running_].nodes.shrink(0);
  const std::vector<int32_t> &outputs = member(running_).outputs;
  for (size_t port = 0; port < outputs.size(); ++port)
    if (const Serial::Emitted &emitted = launch.ports()[port];
        emitted.count > 0)
      return put(outputs[port], emitted, node, &first);
}

// --- What other launches emitted --------------------------------------------

static constexpr int64_t slotChunk = int64_t(1) << 14;

void WaveLoop::absorb(Kernel &kernel) {
  std::vector<Port> ports;
  for (int32_t e : p_.stages[kernel.stage].outputs)
    if (e >= 0) {
      ports.push_back({e, takePort(p_, p_.edges[e])});
      const Stream &stream = ports.back().records.stream;
      noteCount(p_.edges[e], stream);
      Growing<uint32_t> &nodes = queueBehind(p_.edges[e]).nodes;
      ports.back().firstNode = nodes.size();
      nodes.extend(p_.memory, stream.count);
    }
  numberRecords(kernel, ports);
  kernel.clear();
  current()[running_].nodes.reset();
  for (Port &port : ports) {
    const Edge &edge = p_.edges[port.edge];
    queueBehind(edge).add(p_.memory, std::move(port.records.stream),
                          recordSize(p_.stages[edge.consumer]), 0);
  }
}

/// Up to each chunk of slots, and up to the last.
std::vector<WaveLoop::Cursor>
WaveLoop::countRecords(const std::vector<Port> &ports, int64_t slots) const {
  int64_t chunks = (slots + slotChunk - 1) / slotChunk;
  std::vector<Cursor> result(static_cast<size_t>(chunks + 1),
                             Cursor{0, std::vector<int64_t>(ports.size())});
  parallelChunks(p_.threads, slots, slotChunk, [&](int64_t begin, int64_t end) {
    Cursor &in = result[static_cast<size_t>(begin / slotChunk)];
    for (size_t p = 0; p < ports.size(); ++p) {
      const uint32_t *counts = ports[p].records.counts.data();
      in.ofPort[p] = std::accumulate(counts + begin, counts + end, int64_t(0));
    }
  });
  Cursor sum = result.back();
  for (Cursor &cursor : result) {
    cursor.all = sum.all;
    for (size_t p = 0; p < ports.size(); ++p) {
      sum.all += cursor.ofPort[p];
      sum.ofPort[p] += std::exchange(cursor.ofPort[p], sum.ofPort[p]);
    }
  }
  return result;
}

/// Numbers the nodes of what was emitted as that was. Children of a node are
/// then numbered in their order, since its cells were taken in order.
void WaveLoop::numberRecords(const Kernel &kernel,
                             const std::vector<Port> &ports) {
  int64_t slots = kernel.slots(), base = tree_.size();
  std::vector<Cursor> cursors = countRecords(ports, slots);
  int64_t count = cursors.back().all;
  checkCount(member(running_), base + count);
  uint32_t *parents = tree_.extend(p_.memory, count);
  parallelChunks(p_.threads, slots, slotChunk, [&](int64_t begin, int64_t end) {
    Cursor &at = cursors[static_cast<size_t>(begin / slotChunk)];
    for (int64_t slot = begin; slot < end; ++slot)
      numberSlot(slot,
                 nodeOf(kernel.order ? kernel.order[slot]
                                     : static_cast<uint32_t>(slot)),
                 ports, base, parents, at);
  });
}

/// The records of a slot: port by port, or by ordinal if several have some.
void WaveLoop::numberSlot(int64_t slot, uint32_t node,
                          const std::vector<Port> &ports, int64_t base,
                          uint32_t *parents, Cursor &at) {
  int64_t begin = at.all;
  for (size_t p = 0; p < ports.size(); ++p) {
    const PortRecords &own = ports[p].records;
    const uint32_t *ordinals = own.ordinals.data() + at.ofPort[p];
    uint32_t *nodes = queueBehind(p_.edges[ports[p].edge]).nodes.data() +
                      ports[p].firstNode + at.ofPort[p];
    uint32_t count = own.counts[slot];
    for (uint32_t k = 0; k < count; ++k)
      nodes[k] = static_cast<uint32_t>(base + begin + k);
    for (size_t q = 0; q < ports.size() && count > 0; ++q) {
      const PortRecords &other = ports[q].records;
      if (q == p)
        continue;
      const uint32_t *others = other.ordinals.data() + at.ofPort[q];
      uint32_t before = 0, most = other.counts[slot];
      for (uint32_t k = 0; k < count && most > 0; ++k) {
        while (before < most && others[before] < ordinals[k])
          ++before;
        nodes[k] += before;
      }
    }
    at.all += count;
  }
  for (size_t p = 0; p < ports.size(); ++p)
    at.ofPort[p] += ports[p].records.counts[slot];
  std::fill(parents + begin, parents + at.all, node);
}

// --- Order ------------------------------------------------------------------

void WaveLoop::flatten() {
  std::vector<Growing<uint32_t> *> leaves;
  for (Queue &queue : current())
    leaves.push_back(&queue.nodes);
  for (int32_t e : exits_)
    leaves.push_back(&left_[static_cast<size_t>(e)].nodes);
  tree_.flatten(p_.memory, leaves);
}

/// Puts what left the loop into the queues of its edges, in order.
void WaveLoop::finish() {
  flatten();
  for (int32_t e : exits_)
    if (Queue &left = left_[static_cast<size_t>(e)]; left.count > 0)
      sortLeft(p_.edges[e], left);
  left_.clear();
  entries_.clear();
  for (std::vector<Queue> &queues : queues_)
    queues.clear();
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
  sorted.items = from.items;
  sorted.extent = from.reach();
  sorted.indexStorage = Array<uint32_t>(p_.memory, from.count);
  sorted.index = sorted.indexStorage.data();
  if (edge.keyed()) {
    sorted.keys.width = edge.keyWidth;
    sorted.keys.words = Array<uint64_t>(p_.memory, from.count * edge.keyWidth);
  }
  parallelChunks(
      p_.threads, from.count, 1 << 12, [&](int64_t begin, int64_t end) {
        for (int64_t i = begin; i < end; ++i) {
          sorted.indexStorage[i] = from.index ? from.index[order[i]] : order[i];
          uint32_t place = places[order[i]];
          if (edge.keyed())
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
  sorted.blocks = std::move(from.blocks);
  sorted.blocks.push_back(std::move(from.itemStorage));
  enqueue(p_, edge, std::move(sorted));
}

/// Names the first primitive, in order, that makes one hop too many.
void WaveLoop::fail() {
  left_ = std::vector<Queue>(left_.size());
  flatten();
  for (size_t m = 0; m < members(); ++m)
    for (int64_t i = 0; i < now_[m].count; ++i)
      if (current()[m].nodes[i] == 0) {
        uint32_t first = 0;
        if (member(m).placed())
          first = now_[m].pairs[pairStarts(p_.memory, now_[m])[i]];
        failHops(member(m), first & ~PIKOIR_FIRST_CELL,
                 now_[m].items + i * recordSize(member(m)));
      }
  throw Failure{PIKORT_BAD_PROGRAM, "expected a loop to hold a primitive"};
}
