//===- OrderTest.cpp - Lineage --------------------------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Trace.h"

namespace {

// Primitives of a source are processed in order, and what one emits before
// what the next emits.
struct Twice : Whole<int, int> {
  void process(const int &i) {
    emit(10 * i);
    emit(10 * i + 1);
  }
};
struct TwicePipe : piko::Pipe<> {
  Twice twice;
  Sink sink;
  TwicePipe() {
    source(twice);
    connect(twice, 0, sink);
    setDomain({4, 4});
  }
};

TEST(Order, EmissionsFollowTheirPrimitive) {
  TwicePipe pipe;
  EXPECT_THAT(run(pipe, {1, 2, 3}), ElementsAre(10, 11, 20, 21, 30, 31));
}

// The ordinal counts the emissions over all ports.
struct Split : Whole<int, int, float> {
  void process(const int &i) {
    emit(float(i), 1);
    emit(i, 0);
    emit(float(i) + 0.5f, 1);
  }
};
struct ToInt : Whole<float, int> {
  void process(const float &f) { emit(int(2 * f) + 100); }
};
struct JoinPipe : piko::Pipe<> {
  Split split;
  ToInt toInt;
  Sink sink;
  JoinPipe() {
    source(split);
    connect(split, 0, sink);
    connect(split, 1, toInt);
    connect(toInt, 0, sink);
    setDomain({4, 4});
  }
};

TEST(Order, BranchesThatJoinMergeByLineage) {
  JoinPipe pipe;
  EXPECT_THAT(run(pipe, {1, 2}), ElementsAre(102, 1, 103, 104, 2, 105));
}

// A stage may have the same type on several ports, each with its own consumer.
struct Parity : Whole<int, int, int> {
  void process(const int &i) { emit(i, i % 2); }
};
struct Negate : Whole<int, int> {
  void process(const int &i) { emit(-i); }
};
struct PortsPipe : piko::Pipe<> {
  Parity parity;
  Negate negate;
  Sink sink;
  PortsPipe() {
    source(parity);
    connect(parity, 0, sink);
    connect(parity, 1, negate);
    connect(negate, 0, sink);
    setDomain({4, 4});
  }
};

TEST(Order, PortsOfOneType) {
  PortsPipe pipe;
  EXPECT_THAT(run(pipe, {1, 2, 3, 4}), ElementsAre(-1, 2, -3, 4));
}

// Sources run one after the other, by number.
struct TwoSourcesPipe : piko::Pipe<> {
  Negate negate;
  Sink sink;
  TwoSourcesPipe() {
    source(sink);
    source(negate);
    connect(negate, 0, sink);
    setDomain({4, 4});
  }
};

TEST(Order, SourcesInTurn) {
  TwoSourcesPipe pipe;
  std::vector<int> first{1, 2}, second{3, 4};
  trace.clear();
  pipe.feed(pipe.negate, second);
  pipe.feed(pipe.sink, first);
  pipe.run();
  EXPECT_THAT(trace, ElementsAre(1, 2, -3, -4));
}

// In several bins: all that follows from a bin comes before the next bin.
struct Spread : piko::Stage<2, 0, 32, int, int> {
  void assignBin(const int &i) {
    assignToBin(i, {2}); // the set is visited in ascending order
    assignToBin(i, {0});
    assignToBin(i, {2});
  }
  void process(const int &i) {
    emit(100 * i + 10 * int(bin().index));
    emit(100 * i + 10 * int(bin().index) + 1);
  }
};
struct SpreadPipe : piko::Pipe<> {
  Spread spread;
  Sink sink;
  SpreadPipe() {
    source(spread);
    connect(spread, 0, sink);
    setDomain({6, 1});
  }
};

TEST(Order, BinsAscendWithinAPrimitive) {
  SpreadPipe pipe;
  EXPECT_THAT(run(pipe, {1, 2}),
              ElementsAre(100, 101, 120, 121, 200, 201, 220, 221));
}

// A self-loop in the order of recursion, though its stack is explicit.
struct Halve : Whole<int, int, int> {
  void process(const int &i) {
    emit(i, 1);
    if (i >= 4) {
      emit(i / 2, 0);
      emit(i / 2 + 1, 0);
    }
    emit(-i, 1);
  }
};
struct HalvePipe : piko::Pipe<> {
  Halve halve;
  Sink sink;
  HalvePipe() {
    source(halve);
    connect(halve, 0, halve);
    connect(halve, 1, sink);
    setDomain({1, 1});
  }
};
void halveByRecursion(int i, std::vector<int> &out) {
  out.push_back(i);
  if (i >= 4) {
    halveByRecursion(i / 2, out);
    halveByRecursion(i / 2 + 1, out);
  }
  out.push_back(-i);
}

TEST(Order, SelfLoopAsIfRecursive) {
  HalvePipe pipe;
  std::vector<int> expected;
  for (int i : {9, 21, 2})
    halveByRecursion(i, expected);
  EXPECT_EQ(run(pipe, {9, 21, 2}), expected);
}

// A primitive of a self-loop may go to several bins.
struct Descend : piko::Stage<1, 0, 32, int, int, int> {
  void assignBin(const int &i) { assignToAll(i); }
  void process(const int &i) {
    emit(10 * i + int(bin().index), 1);
    if (i > 0)
      emit(i - 1, 0);
  }
};
struct DescendPipe : piko::Pipe<> {
  Descend descend;
  Sink sink;
  DescendPipe() {
    source(descend);
    connect(descend, 0, descend);
    connect(descend, 1, sink);
    setDomain({2, 1});
  }
};

TEST(Order, SelfLoopOverBins) {
  DescendPipe pipe;
  EXPECT_THAT(run(pipe, {1}), ElementsAre(10, 0, 1, 11, 0, 1));
}

// A cycle of two stages behaves in the same way, and is not limited by the
// stack.
struct Count : Whole<int, int> {
  void process(const int &i) { emit(i + 1); }
};
struct Again : Whole<int, int, int> {
  void process(const int &i) { emit(i, i < 100000 ? 0 : 1); }
};
struct CyclePipe : piko::Pipe<> {
  Count count;
  Again again;
  Sink sink;
  CyclePipe() {
    source(count);
    connect(count, 0, again);
    connect(again, 0, count);
    connect(again, 1, sink);
    setDomain({1, 1});
  }
};

TEST(Order, CycleOfStages) {
  CyclePipe pipe;
  EXPECT_THAT(run(pipe, {0, 7, 100005}), ElementsAre(100000, 100000, 100006));
}

TEST(Order, EndlessLoopIsAnError) {
  CyclePipe pipe;
  pipe.setLoopLimit(1000);
  EXPECT_EQ(messageOf([&] { run(pipe, {0}); }).substr(0, 5), "stage");
  EXPECT_THAT(messageOf([&] { run(pipe, {0}); }),
              HasSubstr("a loop did not end within 1000 hops"));
}

// A pipeline without primitives does nothing; one that runs twice does the
// same twice.
TEST(Order, RunsAreIndependent) {
  TwicePipe pipe;
  EXPECT_THAT(run(pipe, {}), IsEmpty());
  EXPECT_THAT(run(pipe, {4}), ElementsAre(40, 41));
  EXPECT_THAT(run(pipe, {4}), ElementsAre(40, 41));
}

} // namespace
