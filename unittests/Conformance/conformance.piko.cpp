//===- conformance.piko.cpp - What every target must run alike ------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Small pipelines that between them have each thing that the runtime promises.
// Expected.cpp computes the same by hand.
//
//===----------------------------------------------------------------------===//
#include "Records.h"

#include <piko.h>

using namespace conformance;

//===----------------------------------------------------------------------===//
// Joins and Strips: sources, branches, several bins for a primitive
//===----------------------------------------------------------------------===//

struct Traced {
  int32_t bias;
  piko::Image<Trace> trace;
  piko::Image<Trace> passed; // by Stacks
};

/// Sends a dot up to three times, by two ports in turn.
struct Split : piko::Stage<0, 0, 64, Dot, Dot, Dot> {
  void process(const Dot &d) {
    for (int i = 0; i < d.value % 4; ++i)
      if ((d.value + i) % 2 == 0)
        emit({d.x, d.y, d.value + i}, 0);
      else
        emit({d.x, d.y, d.value + i}, 1);
  }
};

/// Once in each bin of a box.
struct Shift : piko::Stage<binExtent, binExtent, 64, Dot, Dot>,
               piko::Uses<Traced> {
  void assignBin(const Dot &d) {
    assignToBoundingBox(d, glm::ivec2(d.x, d.y), glm::ivec2(d.x + 9, d.y + 4));
  }
  void process(const Dot &d) {
    emit({d.x, d.y, d.value + state().bias});
    emit({d.x + 2, d.y, int32_t(bin().index)});
  }
};

struct Draw : piko::Stage<16, 16, 64, Dot>, piko::Uses<Traced> {
  void assignBin(const Dot &d) {
    assignToBoundingBox(d, glm::ivec2(d.x, d.y), glm::ivec2(d.x + 2, d.y + 1));
  }
  void process(const Dot &d) {
    parallelForPixels(glm::ivec2(d.x, d.y), glm::ivec2(d.x + 2, d.y + 1),
                      [&](const glm::ivec2 &at) {
                        update(state().trace, at,
                               [&](Trace &trace) { trace.add(d.value); });
                      });
  }
};

struct Joins : piko::Pipe<Traced> {
  Split split;
  Shift shift;
  Draw draw;
  Joins() {
    source(split);
    source(draw);
    connect(split, 0, shift);
    connect(split, 1, draw);
    connect(shift, 0, draw);
  }
};

/// All from one source, so that it can run in strips.
struct Strips : piko::Pipe<Traced> {
  Split split;
  Shift shift;
  Draw draw;
  Strips() {
    source(split);
    connect(split, 0, shift);
    connect(split, 1, draw);
    connect(shift, 0, draw);
  }
};

//===----------------------------------------------------------------------===//
// Hops: cycles of stages that do not collect
//===----------------------------------------------------------------------===//

struct Mark : piko::Stage<binExtent, binExtent, 64, Dot>, piko::Uses<Traced> {
  void assignBin(const Dot &d) {
    assignToBin(d, binFromPosition(glm::ivec2(d.x, d.y)));
  }
  void process(const Dot &d) {
    update(state().trace, glm::ivec2(d.x, d.y),
           [&](Trace &trace) { trace.add(d.value); });
  }
};

/// With `IsOrdered` the order of hops shows, so that waves would.
template <bool IsOrdered>
struct Walk : piko::Stage<binExtent, binExtent, 64, Walker, Walker, Dot>,
              piko::Uses<Traced> {
  void assignBin(const Walker &w) {
    assignToBin(w, binFromPosition(glm::ivec2(w.x, w.y)));
  }
  void process(const Walker &w) {
    if constexpr (IsOrdered)
      update(state().passed, glm::ivec2(w.x, w.y),
             [&](Trace &trace) { trace.add(-w.value); });
    emit(Dot{w.x, w.y, w.value}, 1);
    if (w.left == 0)
      return;
    Walker next = hop(w, domain().x, domain().y);
    emit(next, 0);
    if (w.value % 3 == 0 && w.left > 1) {
      next.left -= 1;
      next.value += state().bias;
      emit(next, 0);
    }
  }
};

template <bool IsOrdered> struct WalkPipe : piko::Pipe<Traced> {
  Walk<IsOrdered> walk;
  Mark mark;
  WalkPipe() {
    source(walk);
    connect(walk, 0, walk);
    connect(walk, 1, mark);
  }
};

struct Waves : WalkPipe<false> {};
struct Stacks : WalkPipe<true> {};

/// Walkers come in at both stages of a loop.
template <bool IsOrdered> struct MeetPipe : piko::Pipe<Traced> {
  Walk<IsOrdered> walk;
  Walk<false> back;
  Mark mark;
  MeetPipe() {
    source(walk);
    source(back);
    connect(walk, 0, back);
    connect(back, 0, walk);
    connect(walk, 1, mark);
    connect(back, 1, mark);
  }
};

struct Meetings : MeetPipe<false> {};
struct Crossings : MeetPipe<true> {};

//===----------------------------------------------------------------------===//
// Rounds: a cycle through a stage that collects
//===----------------------------------------------------------------------===//

struct Gather : piko::Stage<16, 16, 64, Walker, Walker>, piko::Uses<Traced> {
  void assignBin(const Walker &w) {
    assignToBin(w, binFromPosition(glm::ivec2(w.x, w.y)));
  }
  void process(const piko::List<Walker> &list) {
    uint32_t sum = uint32_t(list.size());
    for (int64_t i = 0; i < list.size(); ++i)
      sum += uint32_t(list[i].value);
    for (int64_t i = 0; i < list.size(); ++i) {
      const Walker w = list[i];
      update(state().trace, glm::ivec2(w.x, w.y),
             [&](Trace &trace) { trace.add(w.value ^ int32_t(sum)); });
      if (w.left > 0)
        emit(w);
    }
  }
};

struct Step : piko::Stage<0, 0, 64, Walker, Walker> {
  void process(const Walker &w) { emit(hop(w, domain().x, domain().y)); }
};

struct Rounds : piko::Pipe<Traced> {
  Gather gather;
  Step step;
  Rounds() {
    source(gather);
    connect(gather, 0, step);
    connect(step, 0, gather);
  }
};

//===----------------------------------------------------------------------===//
// Schedules: each that there is, in a chain; and one for each bin
//===----------------------------------------------------------------------===//

struct Direct : piko::Stage<16, 16, 64, Dot, Dot> {
  void assignBin(const Dot &d) {
    assignToBoundingBox(d, glm::ivec2(d.x, d.y), glm::ivec2(d.x + 9, d.y));
  }
  void schedule(piko::BinId) { specifySchedule(piko::DirectMap); }
  void process(const Dot &d) {
    emit({d.x, d.y, d.value * 2 + int32_t(bin().index)});
  }
};

struct Serial : piko::Stage<16, 16, 64, Dot, Dot> {
  void assignBin(const Dot &d) { assignToPreviousBins(d); }
  void schedule(piko::BinId) { specifySchedule(piko::Serialize); }
  void process(const Dot &d) {
    emit(d);
    if (d.value % 5 == 0)
      emit({d.x, d.y, -d.value});
  }
};

struct Tiles : piko::Stage<0, 0, 64, Dot, Dot> {
  void schedule(piko::BinId) { specifySchedule(piko::All, 16); }
  void process(const Dot &d) { emit({d.x, d.y, d.value + 1}); }
};

struct Batches : piko::Stage<binExtent, binExtent, 64, Dot>,
                 piko::Uses<Traced> {
  void assignBin(const Dot &d) {
    assignToBin(d, binFromPosition(glm::ivec2(d.x, d.y)));
  }
  void schedule(piko::BinId) {
    specifySchedule(piko::LoadBalance);
    batch(batchSize);
    everyBin();
  }
  void process(const piko::List<Dot> &list) {
    update(state().trace, binLo(),
           [&](Trace &trace) { trace.add(int32_t(list.size())); });
    for (int64_t i = 0; i < list.size(); ++i) {
      const Dot d = list[i];
      update(state().trace, glm::ivec2(d.x, d.y),
             [&](Trace &trace) { trace.add(d.value); });
    }
  }
};

struct Schedules : piko::Pipe<Traced> {
  Direct direct;
  Serial serial;
  Tiles tiles;
  Batches batches;
  Schedules() {
    source(direct);
    connect(direct, 0, serial);
    connect(serial, 0, tiles);
    connect(tiles, 0, batches);
  }
};

/// A dot's bin is its value.
struct Place : piko::Stage<binExtent, binExtent, 64, Dot>, piko::Uses<Traced> {
  void assignBin(const Dot &d) { assignToBin(d, piko::BinId{d.value}); }
  void schedule(piko::BinId bin) {
    switch (bin.index % 4) {
    case 0:
      return specifySchedule(piko::LoadBalance);
    case 1:
      return specifySchedule(piko::DirectMap);
    case 2:
      return specifySchedule(piko::Serialize);
    default:
      return specifySchedule(piko::All, 4);
    }
  }
  void process(const Dot &d) {
    parallelForPixels([&](const glm::ivec2 &at) {
      update(state().trace, at, [&](Trace &trace) { trace.add(d.x); });
    });
  }
};

struct Policies : piko::Pipe<Traced> {
  Place place;
  Policies() { source(place); }
};

//===----------------------------------------------------------------------===//
// Frames: state of all kinds, from one run to the next
//===----------------------------------------------------------------------===//

struct FrameState {
  int32_t scale;
  piko::Buffer<int32_t> table; // read
  piko::Buffer<int32_t> sums;  // added to
  piko::Buffer<Item> kept;     // as long as source 0
  piko::Buffer<int32_t> found; // written by the last stage
  piko::Image<Nearest> nearest;
  piko::Image<int32_t> touched;
};

struct Count : piko::Stage<0, 0, 64, Item, Item>, piko::Uses<FrameState> {
  void process(const Item &item) {
    int32_t amount = state().table[item.kind] * state().scale;
    piko::atomicAdd(state().sums[item.index % state().sums.size()], amount);
    if (item.kind != 0)
      state().kept[item.index] = item;
    emit(item);
  }
};

struct Test : piko::Stage<binExtent, binExtent, 64, Item>,
              piko::Uses<FrameState> {
  void assignBin(const Item &item) {
    glm::vec2 at(item.x, item.y);
    assignToBoundingBox(item, at, at);
  }
  void process(const Item &item) {
    glm::ivec2 at(piko::toInt(item.x), piko::toInt(item.y));
    bool isNearer = update(state().nearest, at, [&](Nearest &nearest) {
      if (item.z >= nearest.z)
        return false;
      nearest = {item.z, item.index};
      return true;
    });
    if (isNearer)
      update(state().touched, at, [&](int32_t &count) { count += 1; });
  }
};

/// Reads what is complete.
struct Find : piko::Stage<0, 0, 64, int32_t>, piko::Uses<FrameState> {
  void schedule(piko::BinId) { endStage<Count>(); }
  void process(const int32_t &i) {
    state().found[i] = state().sums[i % state().sums.size()] + i;
  }
};

struct Frames : piko::Pipe<FrameState> {
  Count count;
  Test test;
  Find find;
  Frames() {
    source(count);
    source(find);
    connect(count, 0, test);
    allocateForSource(state().kept, 0);
  }
};

//===----------------------------------------------------------------------===//
// Fetches: indices that the host's numbers are expected to be
//===----------------------------------------------------------------------===//

struct FetchState {
  piko::Buffer<Item> items;
  piko::Buffer<int32_t> table;
  piko::Buffer<int32_t> sums; // by kind
};

struct Fetch : piko::Stage<0, 0, 64, int32_t, int32_t>, piko::Uses<FetchState> {
  void process(const int32_t &i) {
    const Item &item = state().items[i];
    piko::atomicAdd(state().sums[item.kind], state().table[item.kind] + i);
    emit(i);
  }
};

/// Where an index of another table is wrong, a read of it gives one.
struct FetchAgain : piko::Stage<binExtent, binExtent, 64, int32_t>,
                    piko::Uses<FetchState> {
  void assignBin(const int32_t &i) {
    const Item &item = state().items[i];
    assignToBin(i, binFromPosition(glm::ivec2(item.kind, item.kind)));
  }
  void process(const int32_t &i) {
    const Item &item = state().items[state().table[i]];
    piko::atomicAdd(state().sums[item.kind], 1);
  }
};

struct Fetches : piko::Pipe<FetchState> {
  Fetch fetch;
  FetchAgain again;
  Fetches() {
    source(fetch);
    connect(fetch, 0, again);
    expectIndex<int32_t>(0, state().items);
    expectIndex<&Item::kind>(state().items, state().table);
    expectIndex<&Item::kind>(state().items, state().sums);
    expectIndex(state().table, state().items);
  }
};
