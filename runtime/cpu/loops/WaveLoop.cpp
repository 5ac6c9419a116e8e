// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- WaveLoop.cpp - A loop that runs in waves ---------------------------===//

#include "cpu/loops/WaveLoop.h"
#include "cpu/Parallel.h"

#include <algorithm>
#include <numeric>

using namespace piko::rt;

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
  bool keyed = std::any_of(exits_.begin(), exits_.end(),
                           [&](int32_t e) { return p_.edges[e].keyed(); });
  tree_.reset(entryCount_, keyed);
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

Queue &WaveLoop::queueAfter(const Edge &edge) {
  return edge.insideLoop ? later()[memberOf(edge.consumer)]
                         : left_[static_cast<size_t>(&edge - p_.edges.data())];
}

void WaveLoop::noteCount(const Edge &edge, const Items &emitted) {
  const Stage &to = p_.stages[edge.consumer];
  const Queue &queue = queueAfter(edge);
  leftCount_ += edge.insideLoop ? 0 : emitted.count;
  checkCount(to, queue.count + emitted.count);
  checkCount(to, queue.pairCount() + emitted.pairCount);
}

void WaveLoop::put(int32_t e, const Items &emitted, int64_t base,
                   const uint32_t *numbers) {
  const Edge &edge = p_.edges[e];
  noteCount(edge, emitted);
  Queue &queue = queueAfter(edge);
  queue.append(p_.memory, Stream{emitted, {}, {}, {}, {}, {}},
               recordSize(p_.stages[edge.consumer]), 0);
  uint32_t *nodes = queue.nodes.extend(p_.memory, emitted.count);
  for (int64_t i = 0; i < emitted.count; ++i)
    nodes[i] = static_cast<uint32_t>(base) + numbers[i];
}

// --- What a serial launch emitted -------------------------------------------

/// Children of a node are numbered as they were emitted, since its buckets were
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
      Growing<uint32_t> &nodes = queueAfter(p_.edges[e]).nodes;
      ports.back().firstNode = nodes.size();
      nodes.extend(p_.memory, stream.count);
    }
  numberRecords(kernel, ports);
  kernel.clear();
  current()[running_].nodes.reset();
  for (Port &port : ports) {
    const Edge &edge = p_.edges[port.edge];
    queueAfter(edge).add(p_.memory, std::move(port.records.stream),
                         recordSize(p_.stages[edge.consumer]), 0);
  }
}

/// At the begin of each chunk of slots, and after the last.
std::vector<WaveLoop::Cursors>
WaveLoop::findChunks(const std::vector<Port> &ports, int64_t slots) {
  Cursors all;
  for (const Port &port : ports)
    all.push_back(
        {port.records.counts.data(), port.records.ordinals.data(),
         queueAfter(p_.edges[port.edge]).nodes.data() + port.firstNode});
  auto chunks = static_cast<size_t>((slots + slotChunk - 1) / slotChunk);
  std::vector<Cursors> result(chunks + 1, all);
  parallelChunks(p_.threads, slots, slotChunk, [&](int64_t begin, int64_t end) {
    for (PortCursor &port : result[static_cast<size_t>(begin / slotChunk) + 1])
      port.next =
          std::accumulate(port.counts + begin, port.counts + end, int64_t(0));
  });
  for (size_t p = 0; p < all.size(); ++p) {
    int64_t before = 0;
    for (Cursors &cursors : result)
      cursors[p].advance(before += std::exchange(cursors[p].next, 0));
  }
  return result;
}

/// Numbers what a slot emitted to several ports by ordinal, from `first` on.
template <class PortCursor>
static void numberMixed(std::vector<PortCursor> &ports, int64_t slot,
                        uint32_t first) {
  for (PortCursor &port : ports)
    for (uint32_t k = 0; k < port.counts[slot]; ++k) {
      uint32_t before = k;
      for (const PortCursor &other : ports)
        if (&other != &port)
          before += static_cast<uint32_t>(
              std::lower_bound(other.ordinals,
                               other.ordinals + other.counts[slot],
                               port.ordinals[k]) -
              other.ordinals);
      port.nodes[k] = first + before;
    }
}

/// Whether each of eight slots emitted to the same port, and one record, or
/// nothing at all; numbers these, and returns how many there are, or -1.
template <class PortCursor>
static int64_t numberAlike(std::vector<PortCursor> &ports, int64_t slot,
                           uint32_t first) {
  constexpr int64_t alike = 8;
  PortCursor *only = nullptr;
  for (PortCursor &port : ports) {
    uint32_t any = 0, other = 0;
    for (int64_t i = 0; i < alike; ++i) {
      any |= port.counts[slot + i];
      other |= port.counts[slot + i] ^ 1;
    }
    if (any == 0)
      continue;
    if (other != 0 || only)
      return -1;
    only = &port;
  }
  if (!only)
    return 0;
  for (int64_t i = 0; i < alike; ++i)
    only->nodes[i] = first + static_cast<uint32_t>(i);
  only->advance(alike);
  return alike;
}

/// The same for any slot; returns how many there are.
template <class PortCursor>
static uint32_t numberSlot(std::vector<PortCursor> &ports, int64_t slot,
                           uint32_t first) {
  uint32_t sum = 0, most = 0;
  for (const PortCursor &port : ports) {
    sum += port.counts[slot];
    most = std::max(most, port.counts[slot]);
  }
  if (sum != most)
    numberMixed(ports, slot, first);
  for (PortCursor &port : ports) {
    uint32_t count = port.counts[slot];
    for (uint32_t k = 0; k < count && sum == most; ++k)
      port.nodes[k] = first + k;
    port.advance(count);
  }
  return sum;
}

/// Numbers the nodes of what was emitted as that was. Children of a node are
/// then numbered in their order, since its buckets were taken in order.
void WaveLoop::numberRecords(const Kernel &kernel,
                             const std::vector<Port> &ports) {
  auto sumOf = [](const Cursors &cursors) {
    int64_t sum = 0;
    for (const PortCursor &port : cursors)
      sum += port.next;
    return sum;
  };
  int64_t slots = kernel.slots(), base = tree_.size();
  std::vector<Cursors> chunks = findChunks(ports, slots);
  int64_t count = sumOf(chunks.back());
  checkCount(member(running_), base + count);
  uint32_t *parents = tree_.extend(p_.memory, count);
  parallelChunks(p_.threads, slots, slotChunk, [&](int64_t begin, int64_t end) {
    Cursors at = std::move(chunks[static_cast<size_t>(begin / slotChunk)]);
    int64_t number = sumOf(at);
    auto parentAt = [&](int64_t slot) {
      return nodeOf(kernel.order ? kernel.order[slot]
                                 : static_cast<uint32_t>(slot));
    };
    for (int64_t slot = begin; slot < end; slot += 8) {
      int64_t last = std::min(end, slot + 8);
      auto first = static_cast<uint32_t>(base + number);
      int64_t alike = last - slot == 8 ? numberAlike(at, slot, first) : -1;
      for (int64_t i = 0; i < alike; ++i)
        parents[number++] = parentAt(slot + i);
      for (int64_t i = slot; i < last && alike < 0; ++i) {
        first = static_cast<uint32_t>(base + number);
        if (uint32_t emitted = numberSlot(at, i, first)) {
          std::fill_n(parents + number, emitted, parentAt(i));
          number += emitted;
        }
      }
    }
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
    if (&exitTo(p_.edges[e]) == &p_.edges[e])
      joinLeft(p_.edges[e]);
  left_.clear();
  entries_.clear();
  for (std::vector<Queue> &queues : queues_)
    queues.clear();
}

/// Puts what left to the consumer of an edge there, by whichever edges.
void WaveLoop::joinLeft(Edge &edge) {
  std::vector<Stream> streams;
  Places places;
  int64_t count = 0;
  for (int32_t e : exits_) {
    Queue &left = left_[static_cast<size_t>(e)];
    if (p_.edges[e].consumer != edge.consumer || left.count == 0)
      continue;
    count += left.count;
    places.push_back(left.nodes.take());
    streams.push_back(left.take(0));
  }
  if (count == 0)
    return;
  Array<uint32_t> ranks;
  if (count < tree_.size()) // some is for others
    ranks = rankPlaces(streams, places);
  Keys keys;
  if (edge.keyed())
    keys = {edge.keyWidth, 0,
            Array<uint64_t>(p_.memory, count * edge.keyWidth)};
  for (size_t s = 0; s < streams.size(); ++s)
    parallelChunks(p_.threads, streams[s].count, 1 << 14,
                   [&](int64_t begin, int64_t end) {
                     for (int64_t i = begin; i < end; ++i) {
                       uint32_t &place = places[s][i];
                       uint32_t rank = ranks ? ranks[place] : place;
                       if (keys.words)
                         writeKey(edge, &keys.words[rank * int64_t(keys.width)],
                                  tree_.entry(place), place);
                       place = rank;
                     }
                   });
  Stream joined =
      placeStreams(p_, streams, std::move(places), p_.stages[edge.consumer]);
  if (edge.keyed())
    joined.keys = std::move(keys);
  enqueue(p_, edge, std::move(joined));
}

/// For each place in the tree that some stream has, how many are before it.
Array<uint32_t> WaveLoop::rankPlaces(const std::vector<Stream> &streams,
                                     const Places &places) const {
  Array<uint32_t> ranks(p_.memory, tree_.size());
  std::memset(ranks.data(), 0, static_cast<size_t>(ranks.size()) * 4);
  for (size_t s = 0; s < streams.size(); ++s)
    for (int64_t i = 0; i < streams[s].count; ++i)
      ranks[places[s][i]] = 1;
  exclusiveScan(p_.threads, ranks.data(), ranks.data(), ranks.size());
  return ranks;
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
        failHops(member(m), first & ~PIKOIR_FIRST_BUCKET,
                 now_[m].item(i, recordSize(member(m))));
      }
  throw Failure{PIKORT_BAD_PROGRAM, "expected a loop to hold a primitive"};
}
