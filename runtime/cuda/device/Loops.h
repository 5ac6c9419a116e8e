// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Loops.h - Waves and rounds, and what leaves a loop -----------------===//
//
// The places of a loop are numbers of what has left it and of the primitives of
// the wave, in lineage order. A wave puts a primitive's children in its place:
// a scan over the numbers of children, 1 for what has left before, gives each
// place of before where it begins now.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CUDA_DEVICE_LOOPS_H
#define PIKO_RUNTIME_CUDA_DEVICE_LOOPS_H

#include "cuda/device/Queues.h"

namespace piko::cuda {

/// After a wave: places, and whether another one follows.
class Wave : FrameTask {
public:
  explicit Wave(const StepArgs &args)
      : FrameTask(*args.frame, args.number, workOf(args)), args_(args),
        loop_(*args.loop) {}

  void run() {
    int64_t waiting = 0;
    uint32_t *childCounts = nullptr;
    int64_t places = 0;
    bool goesOn = FrameTask::run([&] {
      for (int32_t i = 0; i < args_.queueCount; ++i)
        waiting += args_.queues()[i]->items;
      bool isEndless = waiting > 0 && loop_.hops >= args_.limit;
      if (waiting + loop_.exitCount > 0 && !isEndless)
        places = placeAll();
      if (isEndless)
        grid_.fail();
      childCounts = grid_.takeZeros(places);
    });
    if (!Grid::isFirst())
      return;
    for (int32_t i = 0; i < args_.queueCount; ++i)
      args_.queues()[i]->ready = args_.queues()[i]->count;
    loop_.again = goesOn && waiting > 0;
    ++loop_.hops;
    loop_.places = places;
    loop_.childCounts = childCounts;
    loop_.exitsBefore = loop_.exitCount;
  }

private:
  static int64_t workOf(const StepArgs &args) {
    int64_t work = args.loop->places + args.loop->exitCount;
    for (int32_t i = 0; i < args.queueCount; ++i)
      work += args.queues()[i]->items;
    return work;
  }

  int64_t placeAll() {
    uint32_t *starts = loop_.childCounts;
    grid_.forEach(loop_.exitsBefore,
                  [&](int64_t i) { starts[loop_.exits[i].place] = 1; });
    int64_t places = grid_.exclusiveScan(starts, loop_.places);
    grid_.forEach(loop_.exitCount, [&](int64_t i) {
      Exit &exit = loop_.exits[i];
      exit.place = starts[exit.place] + exit.child;
      exit.child = 0;
    });
    for (int32_t q = 0; q < args_.queueCount; ++q)
      for (int64_t c = 0; c < args_.queues()[q]->count; ++c) {
        const Chunk &chunk = args_.queues()[q]->chunks[c];
        const Lineage &lineage = chunk.lineage;
        grid_.forEach(chunk.stream.count, [&](int64_t i) {
          lineage.places[i] = starts[lineage.places[i]] + lineage.children[i];
        });
      }
    return places;
  }

  const StepArgs &args_;
  LoopState &loop_;
};

/// After a round of a cycle.
class Round : FrameTask {
public:
  explicit Round(const StepArgs &args)
      : FrameTask(*args.frame, args.number, /*work=*/0), args_(args) {}

  void run() {
    CycleState &cycle = *args_.cycle;
    int64_t waiting = 0;
    bool goesOn = FrameTask::run([&] {
      for (int32_t i = 0; i < args_.queueCount; ++i)
        waiting += args_.queues()[i]->items;
      if (waiting > 0 && cycle.rounds >= args_.limit)
        grid_.fail();
    });
    if (!Grid::isFirst())
      return;
    ++cycle.rounds;
    cycle.again = goesOn && waiting > 0;
  }

private:
  const StepArgs &args_;
};

/// After a loop: what has left it goes to the queues of its stages, in order.
class Leave : FrameTask {
public:
  explicit Leave(const LeaveArgs &args)
      : FrameTask(*args.frame, args.number,
                  args.loop->places + args.loop->exitCount),
        args_(args), loop_(*args.loop) {}

  void run() {
    FrameTask::run([&] {
      for (int32_t g = 0; g < args_.groupCount && !grid_.hasFailed(); ++g)
        if (loop_.exitCount > 0)
          leave(static_cast<uint32_t>(g), args_.groups()[g]);
    });
    if (Grid::isFirst()) {
      loop_ = {};
      loop_.again = 1;
    }
  }

private:
  template <class Body> void forExits(uint32_t group, const Body &body) {
    grid_.forEach(loop_.exitCount, [&](int64_t i) {
      if (loop_.exits[i].group == group)
        body(loop_.exits[i]);
    });
  }

  void leave(uint32_t number, const ExitGroup &group) {
    uint32_t *ranks = grid_.takeZeros(loop_.places);
    uint32_t *pairStarts =
        group.shape.placed ? grid_.takeZeros(loop_.places) : nullptr;
    grid_.sync();
    if (grid_.hasFailed())
      return;
    forExits(number, [&](const Exit &exit) {
      ranks[exit.place] = 1;
      if (pairStarts)
        pairStarts[exit.place] = exit.pairCount;
    });
    Chunk chunk{};
    Stream &out = chunk.stream;
    out.count = grid_.exclusiveScan(ranks, loop_.places);
    if (pairStarts)
      out.pairCount = grid_.exclusiveScan(pairStarts, loop_.places);
    if (out.count == 0 || grid_.hasFailed())
      return;
    place(number, group, ranks, pairStarts, out);
    if (!grid_.hasFailed())
      push(grid_, *group.queue, chunk);
  }

  void place(uint32_t number, const ExitGroup &group, const uint32_t *ranks,
             const uint32_t *pairStarts, Stream &out) {
    int64_t size = group.shape.recordSize;
    int32_t width = group.keyWidth;
    auto *items = grid_.take<uint8_t>(out.count * size);
    auto *keys = width > 0 ? grid_.take<uint64_t>(out.count * width) : nullptr;
    uint32_t *pairs = nullptr, *starts = nullptr;
    if (pairStarts) {
      pairs = grid_.take<uint32_t>(out.pairCount);
      starts = grid_.take<uint32_t>(out.count + 1);
    }
    if (grid_.hasFailed())
      return;
    out.items = items;
    out.pairs = pairs;
    out.pairStarts = starts;
    out.keys = {keys, 0, width};
    if (starts && Grid::isFirst())
      starts[out.count] = static_cast<uint32_t>(out.pairCount);
    forExits(number, [&](const Exit &exit) {
      int64_t rank = ranks[exit.place];
      copyRecord(items + rank * size, exit.item, size);
      for (int32_t w = 0; w < width; ++w)
        keys[rank * width + w] = keyWord(exit, w);
      if (!pairs)
        return;
      starts[rank] = pairStarts[exit.place];
      for (uint32_t k = 0; k < exit.pairCount; ++k)
        pairs[starts[rank] + k] = exit.pairs[k];
    });
  }

  /// Those of what came in, then the place.
  uint64_t keyWord(const Exit &exit, int32_t w) const {
    return w < args_.keyWidth    ? loop_.entryKeys.word(exit.entry, w)
           : w == args_.keyWidth ? exit.place
                                 : 0;
  }

  const LeaveArgs &args_;
  LoopState &loop_;
};

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_DEVICE_LOOPS_H
