//===- CollectTest.cpp - Lists, waits, batches, rounds --------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Trace.h"

namespace {

/// Sends i to bin i % 4 of four.
template <class... Out> using Four = piko::Stage<1, 0, 8, int, Out...>;
template <class S> void toBin(S &stage, const int &i) {
  stage.assignToBin(i, {i % 4});
}

/// A source, a stage under test over four bins, and a sink.
template <class S> struct FourPipe : piko::Pipe<> {
  S stage;
  Sink sink;
  FourPipe() {
    this->source(stage);
    this->connect(stage, 0, sink);
    this->setDomain({4, 1});
  }
};

// A list Process: once for each bin that is not empty, ascending, with the
// list in lineage order.
struct Lists : Four<int> {
  void assignBin(const int &i) { toBin(*this, i); }
  void process(const piko::List<int> &list) {
    trace.push_back(-int(list.size()));
    for (int i : list)
      emit(i);
    EXPECT_EQ(list[0] % 4, bin().index);
  }
};

TEST(Collect, ListsOfBins) {
  FourPipe<Lists> pipe;
  EXPECT_THAT(run(pipe, {3, 9, 2, 5, 7, 1}),
              ElementsAre(-3, 9, 5, 1, -1, 2, -2, 3, 7));
}

// Batches have exactly n primitives but the last.
struct Batches : Four<int> {
  void assignBin(const int &i) { toBin(*this, i); }
  void schedule(piko::BinId b) { batch(b.index == 0 ? 2 : 3); }
  void process(const piko::List<int> &list) {
    trace.push_back(-int(list.size()));
    for (int i : list)
      emit(i);
  }
};

TEST(Collect, Batches) {
  FourPipe<Batches> pipe;
  EXPECT_THAT(run(pipe, {0, 1, 4, 5, 8, 9, 12, 13, 16}),
              ElementsAre(-2, 0, 4, -2, 8, 12, -1, 16, -3, 1, 5, 9, -1, 13));
}

// everyBin runs empty bins, too, even in a pipeline without primitives.
struct Every : Four<int> {
  void assignBin(const int &i) { toBin(*this, i); }
  void schedule(piko::BinId) { everyBin(); }
  void process(const piko::List<int> &list) {
    emit(int(10 * bin().index + list.size()));
  }
};

TEST(Collect, EveryBin) {
  FourPipe<Every> pipe;
  EXPECT_THAT(run(pipe, {1, 1}), ElementsAre(0, 12, 20, 30));
  EXPECT_THAT(run(pipe, {}), ElementsAre(0, 10, 20, 30));
}

// endStage: all of the other stage is done. The waiting stage then runs bin
// by bin, and its emissions start a new lineage.
struct Tally {
  piko::Buffer<int> sum;
};
struct Fill : Whole<int>, piko::Uses<Tally> {
  void process(const int &i) { piko::atomicAdd(state().sum[0], i); }
};
struct AfterFill : Four<int>, piko::Uses<Tally> {
  void assignBin(const int &i) { toBin(*this, i); }
  void schedule(piko::BinId) { endStage<Fill>(); }
  void process(const int &i) { emit(100 * state().sum[0] + i); }
};
struct WaitPipe : piko::Pipe<Tally> {
  AfterFill after;
  Fill fill;
  Sink sink;
  WaitPipe() {
    source(after);
    source(fill);
    connect(after, 0, sink);
    state().sum.assign({0});
    setDomain({4, 1});
  }
};

TEST(Collect, EndStage) {
  WaitPipe pipe;
  trace.clear();
  std::vector<int> first{3, 2, 7, 1}, second{4, 5};
  pipe.feed(pipe.after, first);
  pipe.feed(pipe.fill, second);
  pipe.run();
  EXPECT_THAT(trace, ElementsAre(901, 902, 903, 907));
}

// endBin: nothing can reach the bin any more.
struct Cover : Four<int> {
  void assignBin(const int &i) { toBin(*this, i); }
  void process(const int &i) {
    trace.push_back(i);
    emit(i);
  }
};
struct Resolve : Four<> {
  void assignBin(const int &i) { assignToPreviousBins(i); }
  void schedule(piko::BinId) { endBin(); }
  void process(const int &i) { trace.push_back(100 + i); }
};
struct EndBinPipe : piko::Pipe<> {
  Cover cover;
  Resolve resolve;
  EndBinPipe() {
    source(cover);
    connect(cover, 0, resolve);
    setDomain({4, 1});
  }
};

TEST(Collect, EndBin) {
  EndBinPipe pipe;
  EXPECT_THAT(run(pipe, {3, 0, 7}), ElementsAre(3, 0, 7, 100, 103, 107));
}

// Collecting stages run in stage order: producers first, then as declared.
template <int Id> struct Collector : Whole<int, int> {
  void process(const piko::List<int> &list) {
    for (int i : list)
      emit(10 * i + Id);
  }
};
struct Fan : Whole<int, int, int, int> {
  void process(const int &i) {
    for (int port = 0; port < 3; ++port)
      emit(i, port);
  }
};
struct ListSink : Whole<int> {
  void process(const piko::List<int> &list) {
    for (int i : list)
      trace.push_back(i);
  }
};
struct StageOrderPipe : piko::Pipe<> {
  ListSink sink; // declared first, but runs last
  Collector<1> one;
  Collector<2> two;
  Collector<3> three; // feeds one
  Fan fan;
  StageOrderPipe() {
    source(fan);
    connect(fan, 0, three);
    connect(fan, 1, two);
    connect(fan, 2, sink);
    connect(three, 0, one);
    connect(two, 0, sink);
    connect(one, 0, sink);
    setDomain({1, 1});
  }
};

TEST(Collect, StageOrder) {
  StageOrderPipe pipe;
  // What the sources send comes first; then `two` (declared before `three`),
  // and `one`, after `three`.
  EXPECT_THAT(run(pipe, {5, 6}), ElementsAre(5, 6, 52, 62, 531, 631));
}

// A cycle through a collecting stage runs in rounds: each takes all that was
// collected in the round before.
struct Round : Whole<int, int, int> {
  void process(const piko::List<int> &list) {
    emit(-int(list.size()), 1);
    for (int i : list) {
      emit(i, 1);
      if (i > 1) {
        emit(i / 2, 0);
        emit(i - i / 2, 0);
      }
    }
  }
};
struct Pass : Whole<int, int> {
  void process(const int &i) { emit(i); }
};
struct RoundPipe : piko::Pipe<> {
  Pass pass;
  Round round;
  Sink sink;
  RoundPipe() {
    source(pass);
    connect(pass, 0, round);
    connect(round, 0, pass);
    connect(round, 1, sink);
    setDomain({1, 1});
  }
};

TEST(Collect, CyclesRunInRounds) {
  RoundPipe pipe;
  EXPECT_THAT(run(pipe, {4, 1}),
              ElementsAre(-2, 4, 1, -2, 2, 2, -4, 1, 1, 1, 1));
}

struct Forever : Whole<int, int> {
  void process(const piko::List<int> &) { emit(1); }
};
struct ForeverPipe : piko::Pipe<> {
  Forever forever;
  ForeverPipe() {
    source(forever);
    connect(forever, 0, forever);
    setDomain({1, 1});
    setLoopLimit(10);
  }
};

TEST(Collect, EndlessRoundsAreAnError) {
  ForeverPipe pipe;
  EXPECT_THAT(messageOf([&] { run(pipe, {1}); }),
              HasSubstr("Forever': a loop did not end within 10 rounds"));
}

// A stage cannot wait for one that it feeds, nor for itself.
struct Late : Whole<int> {
  void process(const int &) {}
};
struct Early : Whole<int, int> {
  void schedule(piko::BinId) { endStage<Late>(); }
  void process(const int &i) { emit(i); }
};
struct DeadlockPipe : piko::Pipe<> {
  Early early;
  Late late;
  DeadlockPipe() {
    source(early);
    connect(early, 0, late);
    setDomain({1, 1});
  }
};

TEST(Collect, DeadlockIsAnError) {
  DeadlockPipe pipe;
  EXPECT_THAT(messageOf([&] { run(pipe, {1}); }), HasSubstr("waits for stage"));
}

// A schedule may have control flow of its own.
struct Choosy : Four<int> {
  void assignBin(const int &i) { toBin(*this, i); }
  void schedule(piko::BinId b) {
    if (b.index % 2)
      specifySchedule(piko::DirectMap);
    else
      specifySchedule(piko::All, 16);
    if (b.index == 2)
      everyBin();
  }
  void process(const piko::List<int> &list) { emit(int(list.size())); }
};

TEST(Collect, ScheduleWithControlFlow) {
  FourPipe<Choosy> pipe;
  EXPECT_THAT(run(pipe, {1, 5}), ElementsAre(2, 0));
}

} // namespace
