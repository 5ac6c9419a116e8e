// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Stack.h - A loop that runs one position at a time ------------------===//
//
// If the order of some stage's calls can be seen, all that follows from a
// position runs before the next one. What is to run, or to leave the loop,
// waits on a stack. After each position
//   1. what its kernel has emitted is pushed, the last one first;
//   2. what lies on top and leaves the loop does so;
//   3. the next position becomes the input of its kernel.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CUDA_DEVICE_STACK_H
#define PIKO_RUNTIME_CUDA_DEVICE_STACK_H

#include "cuda/device/Queues.h"

namespace piko::cuda {

class Stack {
public:
  Stack(Grid &grid, const StackArgs &args)
      : grid_(grid), args_(args), loop_(*args.loop), state_(*args.stack) {
    now_ = state_;
    exits_ = {loop_.exits, loop_.exitCount, loop_.exitCapacity};
  }

  /// Empties it; what comes into the loop follows, in its order. Between two
  /// barriers.
  void begin(const Waiting *entries, int64_t count) {
    now_ = {};
    now_.entries = entries;
    now_.entryCount = count;
    now_.running = -1;
    now_.numbers = grid_.take<uint32_t>(2 * mostAtOnce);
    for (int32_t m = 0; m < args_.memberCount; ++m) {
      const StackMember &member = args_.members()[m];
      auto *offsets = grid_.take<int64_t>(member.shape.buckets + 1);
      if (Grid::isFirst())
        member.kernel->input.offsets = offsets;
    }
  }

  /// Pushes what the position that ran has emitted. Between two barriers.
  void push();
  /// Finds the position that is to run next. Between two barriers.
  void next();
  /// Says what is next; by the first thread, after all of that.
  void publish(FrameState &frame);

private:
  static constexpr int64_t mostAtOnce = 4096;
  /// Up to how much one thread does by itself: records, and bytes of entries.
  static constexpr uint32_t fewRecords = 8;
  static constexpr uint64_t fewBytes = 1024;

  static constexpr Waiting nobody{nullptr, nullptr, 0, 0, -1, -1, 0};

  /// What has left the loop.
  struct Exits {
    Exit *list;
    int64_t count, capacity;
  };

  struct Few;
  struct Counter;
  struct Pusher;

  bool pushFew(const StackMember &member);
  void countFew(const StackMember &member, const Few &few);
  void writeFew(const StackMember &member, const Few &few, uint32_t *buckets);
  void makeRoom(int64_t more);
  void makeRoomForExits(int64_t more);
  void pushPort(const QueuePort &port, const Spans &spans,
                const Siblings &siblings, int64_t end);
  bool findTop();
  Waiting &fromTop(int64_t i) const { return now_.waiting[now_.count - 1 - i]; }
  void leave(const Waiting &waiting, int64_t place) const {
    exits_.list[place] = {waiting.item,
                          waiting.pairs,
                          waiting.pairCount,
                          static_cast<uint32_t>(waiting.group),
                          static_cast<uint32_t>(place),
                          /*child=*/0,
                          waiting.entry};
  }

  Grid &grid_;
  const StackArgs &args_;
  LoopState &loop_;
  StackState &state_; ///< Seen by all; changed where nothing is said.
  StackState now_;    ///< Uniform.
  Exits exits_;       ///< Uniform.
};

inline void Stack::makeRoom(int64_t more) {
  int64_t least = now_.count + more;
  if (least <= now_.capacity)
    return;
  now_.capacity = larger<int64_t>(larger<int64_t>(64, 2 * now_.count), least);
  auto *room = grid_.take<Waiting>(now_.capacity);
  if (!room)
    return;
  const Waiting *old = now_.waiting;
  grid_.forEach(now_.count, [&](int64_t i) { room[i] = old[i]; });
  now_.waiting = room;
  grid_.sync();
}

inline void Stack::makeRoomForExits(int64_t more) {
  int64_t least = exits_.count + more;
  if (least > UINT32_MAX)
    return grid_.fail();
  if (least <= exits_.capacity)
    return;
  exits_.capacity =
      larger<int64_t>(larger<int64_t>(64, 2 * exits_.count), least);
  auto *room = grid_.take<Exit>(exits_.capacity);
  if (!room)
    return;
  const Exit *old = exits_.list;
  grid_.forEach(exits_.count, [&](int64_t i) { room[i] = old[i]; });
  exits_.list = room;
}

// --- What one thread pushes --------------------------------------------------

/// The spans of a position whose entries are few.
struct Stack::Few {
  const pikoir_span *list = nullptr;
  int64_t count = 0;
  bool isTrue = true;

  explicit Few(const KernelState &kernel) {
    int64_t at =
        reinterpret_cast<const pikoir_unit_log *>(kernel.log.units)->first;
    if (at == 0)
      return;
    const auto *piece = reinterpret_cast<const pikoir_piece *>(at);
    list = reinterpret_cast<const pikoir_span *>(piece + 1);
    count = piece->spans;
    isTrue = piece->next == 0 && count <= fewRecords;
    for (int64_t s = 0; s < count && isTrue; ++s)
      isTrue = static_cast<uint64_t>(list[s].end - list[s].begin) <= fewBytes;
  }

  template <class Sink> void read(const QueuePort &port, Sink &sink) const {
    for (int64_t s = 0; s < count; ++s)
      SpanReader<Sink>(port.input, port.shape, sink).read(list[s]);
  }
};

struct Stack::Counter {
  uint32_t records = 0, buckets = 0;
  void emit(bool) { ++records; }
  void keep(const pikoir_entry *) {}
  void place(uint32_t) { ++buckets; }
  void insert(uint32_t) { ++buckets; }
  void next() {}
  void fail() {}
};

struct Stack::Pusher {
  const Stack &stack;
  const QueuePort &port;
  Waiting *end;      ///< After the first one's place.
  uint32_t *buckets; ///< Room for more.
  uint32_t ordinal = 0, received = 0;
  Waiting *last = nullptr;

  void emit(bool isMine) {
    ++ordinal;
    received += isMine;
  }
  void keep(const pikoir_entry *entry) {
    last = end - ordinal;
    *last = {payload(entry),     buckets,     0,
             stack.now_.entry,   port.member, port.group,
             stack.now_.hops + 1};
  }
  void place(uint32_t bucket) {
    *buckets++ = last->pairCount++ == 0 ? bucket | PIKOIR_FIRST_BUCKET : bucket;
  }
  void insert(uint32_t bucket) {
    uint32_t *at = buckets++, *first = at - last->pairCount++;
    *first &= ~PIKOIR_FIRST_BUCKET;
    for (; at != first && at[-1] > bucket; --at)
      *at = at[-1];
    *at = bucket;
    *first |= PIKOIR_FIRST_BUCKET;
  }
  void next() {}
  void fail() { stack.grid_.failFrame(); }
};

/// False if it is too much.
inline bool Stack::pushFew(const StackMember &member) {
  Few few(*member.kernel);
  if (!few.isTrue)
    return false;
  if (Grid::isFirst())
    countFew(member, few);
  grid_.sync();
  int64_t records = state_.children, count = state_.buckets;
  if (records > fewRecords)
    return false;
  makeRoom(records);
  auto *buckets = grid_.take<uint32_t>(count);
  if (grid_.hasFailed())
    return true;
  if (Grid::isFirst())
    writeFew(member, few, buckets);
  now_.count += records;
  grid_.sync();
  return true;
}

inline void Stack::countFew(const StackMember &member, const Few &few) {
  state_.children = state_.buckets = 0;
  for (int32_t p = 0; p < member.portCount; ++p) {
    Counter counter;
    few.read(args_.ports()[member.firstPort + p], counter);
    state_.children = counter.records; // of all ports
    state_.buckets += counter.buckets;
  }
}

inline void Stack::writeFew(const StackMember &member, const Few &few,
                            uint32_t *buckets) {
  uint32_t records = state_.children;
  Waiting *begin = now_.waiting + now_.count;
  for (uint32_t i = 0; i < records; ++i)
    begin[i] = nobody;
  for (int32_t p = 0; p < member.portCount; ++p) {
    const QueuePort &port = args_.ports()[member.firstPort + p];
    Pusher pusher{*this, port, begin + records, buckets};
    few.read(port, pusher);
    *port.input.received += pusher.received;
    buckets = pusher.buckets;
  }
}

// --- What all threads push ---------------------------------------------------

inline void Stack::push() {
  if (now_.running < 0)
    return;
  const StackMember &member = args_.members()[now_.running];
  if (member.portCount == 0 || pushFew(member))
    return;
  Spans spans(grid_, *member.kernel);
  spans.find();
  if (spans.count == 0 || grid_.hasFailed())
    return;
  const QueuePort *ports = args_.ports() + member.firstPort;
  Siblings siblings(grid_, spans, ports[0]);
  siblings.run(&state_.children);
  if (grid_.hasFailed())
    return;
  int64_t count = state_.children;
  makeRoom(count);
  if (grid_.hasFailed())
    return;
  // Some may go to no port, or to no bucket.
  grid_.forEach(count,
                [&](int64_t i) { now_.waiting[now_.count + i] = nobody; });
  grid_.sync();
  for (int32_t p = 0; p < member.portCount && !grid_.hasFailed(); ++p)
    pushPort(ports[p], spans, siblings, now_.count + count);
  now_.count += count;
  grid_.sync();
}

inline void Stack::pushPort(const QueuePort &port, const Spans &spans,
                            const Siblings &siblings, int64_t end) {
  Gather gather(grid_, port.shape, port.input, spans, &siblings);
  Stream from{};
  gather.run(from);
  if (grid_.hasFailed())
    return;
  const uint32_t *children = gather.lineage().children;
  grid_.forEach(from.count, [&](int64_t i) {
    uint32_t begin = from.pairs ? from.pairStarts[i] : 0,
             buckets = from.pairs ? from.pairStarts[i + 1] - begin : 0;
    now_.waiting[end - 1 - children[i]] = {from.items +
                                               i * port.shape.recordSize,
                                           from.pairs + begin,
                                           buckets,
                                           now_.entry,
                                           port.member,
                                           port.group,
                                           now_.hops + 1};
  });
}

// --- What is next ------------------------------------------------------------

inline void Stack::next() {
  while (!grid_.hasFailed() && !findTop() && now_.nextEntry < now_.entryCount) {
    makeRoom(1);
    if (grid_.hasFailed())
      return;
    if (Grid::isFirst())
      now_.waiting[0] = now_.entries[now_.nextEntry];
    ++now_.nextEntry;
    now_.count = 1;
    grid_.sync();
  }
  if (now_.count > 0 && !grid_.hasFailed() && fromTop(0).hops > args_.limit)
    grid_.fail();
}

/// Takes from the stack what is not to run; returns whether there is more.
inline bool Stack::findTop() {
  uint32_t *runBefore = now_.numbers, *leaveBefore = runBefore + mostAtOnce;
  while (now_.count > 0 && !grid_.hasFailed()) {
    int64_t n = smaller(now_.count, mostAtOnce), totals[2];
    grid_.scan<2>(n, {runBefore, leaveBefore}, totals,
                  [&](int64_t i, uint32_t (&numbers)[2]) {
                    const Waiting &waiting = fromTop(i);
                    numbers[0] = waiting.member >= 0;
                    numbers[1] = waiting.member < 0 && waiting.group >= 0;
                  });
    makeRoomForExits(totals[1]);
    if (grid_.hasFailed())
      return false;
    grid_.forEach(n, [&](int64_t i) {
      const Waiting &waiting = fromTop(i);
      if (runBefore[i] > 0)
        return;
      if (waiting.member >= 0) {
        state_.found = i;
        state_.foundLeft = leaveBefore[i];
      } else if (waiting.group >= 0) {
        leave(waiting, exits_.count + leaveBefore[i]);
      }
    });
    grid_.sync();
    bool isFound = totals[0] > 0;
    now_.count -= isFound ? state_.found : n;
    exits_.count += isFound ? state_.foundLeft : totals[1];
    grid_.sync(); // all have read that
    if (isFound)
      return true;
  }
  return false;
}

inline void Stack::publish(FrameState &frame) {
  if (now_.running >= 0)
    args_.members()[now_.running].kernel->input.unit_count = 0;
  now_.running = -1;
  loop_.exits = exits_.list;
  loop_.places = loop_.exitCount = exits_.count;
  loop_.exitCapacity = exits_.capacity;
  loop_.again = now_.count > 0;
  if (loop_.again) {
    Waiting &top = fromTop(0);
    const StackMember &member = args_.members()[top.member];
    int64_t bucket = 0;
    if (member.shape.placed) {
      bucket = *top.pairs++ & ~PIKOIR_FIRST_BUCKET;
      --top.pairCount;
    }
    now_.count -= top.pairCount == 0;
    now_.running = top.member;
    now_.entry = top.entry;
    now_.hops = top.hops;
    now_.unit = {bucket, bucket + 1, 0, 1, -1};
    now_.unitLog = {};
    KernelState &kernel = *member.kernel;
    auto *offsets = const_cast<int64_t *>(kernel.input.offsets);
    offsets[bucket] = 0;
    offsets[bucket + 1] = 1;
    kernel.input = {top.item,     1,       nullptr, offsets, &state_.unit, 1,
                    member.tiles, nullptr, 0,       0,       nullptr,      0};
    kernel.log = frame.log;
    kernel.log.cursor = kernel.logBegin = grid_.top();
    kernel.log.units = reinterpret_cast<int64_t>(&state_.unitLog);
    kernel.items = 1;
    ++kernel.in;
    ++kernel.placed;
    frame.latest = &kernel;
  }
  state_ = now_;
}

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_DEVICE_STACK_H
