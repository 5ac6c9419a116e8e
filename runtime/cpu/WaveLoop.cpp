// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- WaveLoop.cpp - A loop that runs in waves ---------------------------===//

#include "cpu/WaveLoop.h"
#include "cpu/Parallel.h"

#include <algorithm>

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
    uint32_t *nodes = current()[m].nodes.extend(p_.memory, now_[m].count);
    for (int64_t i = 0; i < now_[m].count; ++i)
      nodes[i] = places_[m] ? places_[m][i] : static_cast<uint32_t>(i);
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

void WaveLoop::put(int32_t e, const Items &emitted, int64_t base,
                   const uint32_t *numbers) {
  const Edge &edge = p_.edges[e];
  const Stage &to = p_.stages[edge.consumer];
  Queue &queue = edge.insideLoop ? later()[memberOf(edge.consumer)]
                                 : left_[static_cast<size_t>(e)];
  leftCount_ += edge.insideLoop ? 0 : emitted.count;
  checkCount(to, queue.count + emitted.count);
  checkCount(to, queue.pairs.size() + emitted.pairCount);
  queue.append(p_.memory, emitted, recordSize(to));
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
  Growing<uint32_t> &nodes = current()[running_].nodes;
  uint32_t number = 0;
  for (int64_t slot = 0; slot < launch.slots(); ++slot)
    for (uint32_t parent = nodes[launch.itemAt(slot)];
         number < launch.emittedUntil(slot); ++number)
      parents[number] = parent;
  const std::vector<int32_t> &outputs = member(running_).outputs;
  for (size_t port = 0; port < outputs.size(); ++port) {
    const Serial::Emitted &emitted = launch.ports()[port];
    if (emitted.count > 0)
      put(outputs[port], emitted, base, emitted.numbers);
  }
  nodes.shrink(0);
}

/// An only child takes its parent's place in the tree.
void WaveLoop::absorbOne(const Serial &launch) {
  static constexpr uint32_t first = 0;
  Growing<uint32_t> &nodes = current()[running_].nodes;
  uint32_t node = nodes[launch.itemAt(0)];
  nodes.shrink(0);
  const std::vector<int32_t> &outputs = member(running_).outputs;
  for (size_t port = 0; port < outputs.size(); ++port)
    if (const Serial::Emitted &emitted = launch.ports()[port];
        emitted.count > 0)
      return put(outputs[port], emitted, node, &first);
}

// --- What other launches emitted --------------------------------------------

void WaveLoop::absorb(std::vector<Port> &ports, const Array<uint32_t> &items) {
  int64_t base = tree_.size();
  checkCount(member(running_), base + items.size());
  uint32_t *parents = tree_.extend(p_.memory, items.size());
  Growing<uint32_t> &nodes = current()[running_].nodes;
  parallelChunks(p_.threads, items.size(), 1 << 16,
                 [&](int64_t begin, int64_t end) {
                   for (int64_t i = begin; i < end; ++i)
                     parents[i] = nodes[items[i]];
                 });
  nodes.reset();
  for (Port &port : ports)
    put(port.edge, port.records.stream, base, port.numbers.data());
}

void WaveLoop::absorb(Kernel &kernel) {
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
  absorb(ports, items);
}

/// A record's number is its place in its port, plus the records of the other
/// ports before its position, plus those at its position with a lower ordinal.
void WaveLoop::numberRecords(const Kernel &kernel, std::vector<Port> &ports,
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
  int64_t size = recordSize(to);
  sorted.itemStorage = Array<uint8_t>(p_.memory, from.count * size);
  sorted.items = sorted.itemStorage.data();
  if (edge.keyed()) {
    sorted.keys.width = edge.keyWidth;
    sorted.keys.words = Array<uint64_t>(p_.memory, from.count * edge.keyWidth);
  }
  parallelChunks(
      p_.threads, from.count, 1 << 12, [&](int64_t begin, int64_t end) {
        for (int64_t i = begin; i < end; ++i) {
          std::memcpy(sorted.itemStorage.data() + i * size,
                      from.items + order[i] * size, static_cast<size_t>(size));
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
  queueOf(p_, edge).append(p_.memory, sorted, size, sorted.keys.width);
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
