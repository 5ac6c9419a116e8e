//===- CheckTest.cpp - What checking mode finds ---------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Trace.h"

#include <cmath>
#include <functional>

namespace {

struct Point {
  glm::ivec2 at;
  int value = 0;
  float weight = 0;
};
struct Memory {
  piko::Buffer<int> data;
  piko::Image<int> image;
};

/// A stage that does what a test says; it emits what it gets otherwise.
template <int Number>
struct Step : piko::Stage<4, 4, 8, Point, Point>, piko::Uses<Memory> {
  static inline std::function<void(Step &, const Point &)> body, assigning;
  static inline std::function<void(Step &)> plan;

  void assignBin(const Point &p) {
    if (assigning)
      assigning(*this, p);
    assignToBin(p, binFromPosition(p.at));
  }
  void schedule(piko::BinId) {
    if (plan)
      plan(*this);
  }
  void process(const Point &p) {
    if (body)
      body(*this, p);
    emit(p);
  }
  int &at(int i) { return state().data[i]; }
  int seen(glm::ivec2 p) { return state().image(p); }
};
using First = Step<0>;
using Second = Step<1>;
struct End : Whole<Point> {
  void process(const Point &) {}
};

struct CheckPipe : piko::Pipe<Memory> {
  First first;
  Second second;
  End end;
  CheckPipe() {
    setDomain({8, 8});
    state().data.assign(std::vector<int>(16));
    nameState(&state().data, "data");
    nameState(&state().image, "image");
    connect(second, 0, end);
  }
};
/// One stage after the other.
struct Chain : CheckPipe {
  Chain() {
    source(first);
    connect(first, 0, second);
  }
};
/// Each stage has a source.
struct Fork : CheckPipe {
  Fork() {
    source(first);
    source(second);
    connect(first, 0, end);
  }
};

/// Of two bins; the value is the index.
const std::vector<Point> points{{{1, 1}, 0}, {{6, 1}, 1}, {{1, 1}, 2}};

class Check : public testing::Test {
protected:
  void SetUp() override {
    First::body = First::assigning = nullptr;
    Second::body = Second::assigning = nullptr;
    First::plan = nullptr;
    Second::plan = nullptr;
  }
  std::string reportOfChain() {
    Chain pipe;
    return reportOf([&] { ::run(pipe, points); });
  }
  std::string reportOfFork() {
    Fork pipe;
    pipe.feed(1, points.data(), points.size());
    return reportOf([&] { ::run(pipe, points); });
  }
};

constexpr auto nothing = "(no error)";
#define CONFLICT(TEXT)                                                         \
  AllOf(HasSubstr("expected no conflict between concurrent calls, but "),      \
        HasSubstr(TEXT))
using testing::AllOf;

// Calls of one stage.

TEST_F(Check, StoresOfTwoCallsToOneElement) {
  First::body = [](First &s, const Point &p) { s.at(3) = p.value + 1; };
  EXPECT_THAT(reportOfChain(),
              CONFLICT("'data[3]' is stored here and stored by stage '"));
}

TEST_F(Check, StoresToElementsOfTheirOwn) {
  First::body = [](First &s, const Point &p) {
    s.at(p.value) = p.value + 1;
    s.at(p.value) += 2;
    s.state().image.store({p.value, 0}, s.at(p.value));
  };
  EXPECT_EQ(reportOfChain(), nothing);
}

// The second call stores what is there: it is known to have had a reference.
TEST_F(Check, AStoreThatChangesNothing) {
  First::body = [](First &s, const Point &) { s.at(3) = 7; };
  EXPECT_THAT(reportOfChain(),
              CONFLICT("'data[3]' is read or stored unchanged here and stored "
                       "by stage '"));
}

TEST_F(Check, StoresToOnePixel) {
  First::body = [](First &s, const Point &) {
    s.state().image.store({5, 6}, 0);
  };
  EXPECT_THAT(reportOfChain(),
              CONFLICT("'image[5, 6]' is stored here and stored by stage '"));
}

TEST_F(Check, AReadOfWhatAnotherCallStores) {
  First::body = [](First &s, const Point &p) {
    if (p.value == 0)
      s.at(9) = 1;
    if (p.value == 2)
      s.at(1) = s.at(9);
  };
  EXPECT_THAT(reportOfChain(), CONFLICT("'data[9]' is read"));
}

TEST_F(Check, ReadsOfWhatNoneStores) {
  First::body = [](First &s, const Point &p) {
    s.at(p.value) = s.at(9) + s.seen({7, 7});
  };
  EXPECT_EQ(reportOfChain(), nothing);
}

TEST_F(Check, Atomics) {
  First::body = [](First &s, const Point &p) {
    piko::atomicAdd(s.state().data[3], p.value);
    piko::atomicMax(s.state().image({1, 1}), p.value);
  };
  EXPECT_EQ(reportOfChain(), nothing);
  First::body = [](First &s, const Point &p) {
    if (p.value == 1)
      s.at(3) = 4;
    else
      piko::atomicAdd(s.state().data[3], 1);
  };
  EXPECT_THAT(reportOfChain(),
              CONFLICT("'data[3]' is stored here and changed atomically by "));
  First::body = [](First &s, const Point &p) {
    piko::atomicAdd(s.state().image({1, 1}), p.value);
    s.at(p.value) = s.seen({1, 1}) + 1;
  };
  EXPECT_THAT(
      reportOfChain(),
      CONFLICT("'image[1, 1]' is changed atomically here and read by "));
}

TEST_F(Check, UpdatesAreInOrder) {
  First::body = [](First &s, const Point &p) {
    int before = s.seen(p.at);
    s.update(s.state().image, p.at, [&](int &i) { i += p.value + before; });
    s.at(p.value) = s.seen(p.at);
  };
  EXPECT_EQ(reportOfChain(), nothing);
}

TEST_F(Check, AReadOfAPixelThatOnlyOthersUpdate) {
  First::body = [](First &s, const Point &p) {
    if (p.value == 0)
      s.update(s.state().image, p.at, [](int &i) { ++i; });
    else
      s.at(p.value) = s.seen({1, 1});
  };
  EXPECT_THAT(reportOfChain(),
              CONFLICT("'image[1, 1]' is read here and updated by stage '"));
}

TEST_F(Check, AStoreToAPixelThatIsUpdated) {
  First::body = [](First &s, const Point &p) {
    if (p.value == 0)
      s.state().image.store({1, 1}, 5);
    else if (p.value == 2)
      s.update(s.state().image, p.at, [](int &i) { ++i; });
  };
  EXPECT_THAT(reportOfChain(),
              CONFLICT("'image[1, 1]' is updated here and stored by stage '"));
}

// Calls of two stages.

TEST_F(Check, AReadWithoutAWait) {
  First::body = [](First &s, const Point &p) { s.at(p.value) = 1; };
  Second::body = [](Second &s, const Point &p) {
    if (s.at(p.value) == 1)
      s.at(8 + p.value) = 1;
  };
  EXPECT_THAT(reportOfChain(), CONFLICT("'data[0]' is read or stored "
                                        "unchanged here and stored by stage"));
  EXPECT_THAT(reportOfFork(), CONFLICT("'data[0]' is read"));
}

TEST_F(Check, AReadAfterAWait) {
  First::body = [](First &s, const Point &p) {
    s.at(p.value) = 1;
    piko::atomicAdd(s.state().image({1, 1}), 1);
  };
  Second::plan = [](Second &s) { s.endStage<First>(); };
  Second::body = [](Second &s, const Point &p) {
    s.at(8 + p.value) = s.at(p.value) + s.seen({1, 1});
    s.update(s.state().image, p.at, [](int &i) { ++i; });
  };
  // Its own update is concurrent with the reads of other calls.
  EXPECT_THAT(reportOfChain(), CONFLICT("image[1, 1]"));
  Second::body = [](Second &s, const Point &p) {
    s.at(8 + p.value) = s.at(p.value) + s.seen({1, 1});
  };
  EXPECT_EQ(reportOfChain(), nothing);
  EXPECT_EQ(reportOfFork(), nothing);
}

// A stage that collects comes after all that can reach it.
TEST_F(Check, AReadByAStageThatCollects) {
  First::body = [](First &s, const Point &p) { s.at(p.value) = 1; };
  Second::body = [](Second &s, const Point &p) {
    s.at(8 + p.value) = s.at(p.value);
  };
  Second::plan = [](Second &s) { s.endBin(); };
  EXPECT_EQ(reportOfChain(), nothing);
  EXPECT_THAT(reportOfFork(), CONFLICT("'data[0]' is read"));
}

TEST_F(Check, UpdatesOfTwoStages) {
  First::body = [](First &s, const Point &p) {
    s.update(s.state().image, p.at, [](int &i) { ++i; });
  };
  Second::body = [](Second &s, const Point &p) {
    s.update(s.state().image, p.at, [](int &i) { i *= 2; });
  };
  EXPECT_THAT(reportOfChain(),
              CONFLICT("'image[1, 1]' is updated here and updated by stage '"));
  Second::plan = [](Second &s) { s.endStage<First>(); };
  EXPECT_EQ(reportOfChain(), nothing);
}

/// What is after a stage that waits has waited, too, if nothing else feeds it.
struct Behind : Whole<Point, Point>, piko::Uses<Memory> {
  void process(const Point &p) {
    if (state().data[p.value] == 1)
      emit(p);
  }
};
template <bool HasShortcut> struct BehindPipe : piko::Pipe<Memory> {
  First first;
  Second second;
  Behind after;
  End end, other;
  BehindPipe() {
    setDomain({8, 8});
    state().data.assign(std::vector<int>(16));
    source(first);
    source(second);
    if (HasShortcut)
      source(after);
    connect(first, 0, other);
    connect(second, 0, after);
    connect(after, 0, end);
  }
};

TEST_F(Check, AWaitHoldsForWhatFollows) {
  First::body = [](First &s, const Point &p) { s.at(p.value) = 1; };
  Second::plan = [](Second &s) { s.endStage<First>(); };
  BehindPipe<false> pipe;
  pipe.feed(1, points.data(), points.size());
  EXPECT_EQ(reportOf([&] { ::run(pipe, points); }), nothing);
  BehindPipe<true> shortcut;
  shortcut.feed(1, points.data(), points.size());
  shortcut.feed(2, points.data(), points.size());
  EXPECT_THAT(reportOf([&] { ::run(shortcut, points); }),
              CONFLICT("[0] of a buffer of 'int' is "));
}

// Rounds come one after the other.
struct Round : Whole<Point, Point, Point>, piko::Uses<Memory> {
  void process(const piko::List<Point> &list) {
    for (Point p : list) {
      state().data[p.value] = state().data[p.value] + 1;
      emit(p, state().data[p.value] < 5 ? 0 : 1);
    }
  }
};
TEST_F(Check, RoundsOfACycle) {
  struct RoundPipe : piko::Pipe<Memory> {
    Round round;
    End end;
    RoundPipe() {
      setDomain({8, 8});
      state().data.assign(std::vector<int>(16));
      source(round);
      connect(round, 0, round);
      connect(round, 1, end);
    }
  } pipe;
  EXPECT_EQ(reportOf([&] { ::run(pipe, points); }), nothing);
}

// Phases.

TEST_F(Check, AssignBinReadsWhatIsComplete) {
  First::body = [](First &s, const Point &) {
    piko::atomicAdd(s.state().data[0], 1);
  };
  Second::assigning = [](Second &s, const Point &p) {
    if (s.at(0) + p.value < 0)
      s.assignToAll(p);
  };
  EXPECT_THAT(reportOfFork(),
              HasSubstr("Step<1>': expected assignBin to read what is "
                        "complete, but 'data[0]' is changed atomically by "
                        "stage '"));
  Second::plan = [](Second &s) { s.endStage<First>(); };
  EXPECT_EQ(reportOfFork(), nothing);
  EXPECT_THAT(reportOfChain(), HasSubstr("read what is complete"));
}

TEST_F(Check, OnlyProcessWrites) {
  First::assigning = [](First &s, const Point &p) { s.at(0) = p.value + 1; };
  EXPECT_THAT(reportOfChain(),
              HasSubstr("Step<0>': expected only process to write state, but "
                        "assignBin stores 'data[0]'"));
  First::assigning = nullptr;
  First::plan = [](First &s) {
    if (s.at(2) == 0)
      s.specifySchedule(piko::Serialize);
  };
  EXPECT_THAT(reportOfChain(),
              HasSubstr("bin 0: expected schedule to depend on the bin and on "
                        "constants, but it reads 'data[2]'"));
}

// References.

TEST_F(Check, AnUpdateThatSeesItsImage) {
  First::body = [](First &s, const Point &p) {
    s.update(s.state().image, p.at, [&](int &i) { i += s.seen({7, 7}); });
  };
  EXPECT_THAT(reportOfChain(),
              HasSubstr("expected an update to see 'image' only through the "
                        "pixel that it is given"));
  First::body = [](First &s, const Point &p) {
    s.update(s.state().image, p.at, [&](int &i) { i += s.at(7); });
  };
  EXPECT_EQ(reportOfChain(), nothing);
}

TEST_F(Check, AReferenceThatIsKept) {
  static int *pixel;
  First::body = [](First &s, const Point &p) {
    if (p.value == 0)
      s.update(s.state().image, p.at, [](int &i) { pixel = &i; });
    if (p.value == 1)
      *pixel = 3;
  };
  EXPECT_THAT(reportOfChain(),
              HasSubstr("expected 'image[1, 1]' to stay as it is between "
                        "calls, but it was changed through a reference that "
                        "was kept"));
}

// Iterations.

TEST_F(Check, IterationsThatConflict) {
  First::body = [](First &s, const Point &p) {
    if (p.value != 0)
      return;
    s.parallelFor(4, [&](int i) {
      s.at(i) = i + 1;
      if (i == 2)
        s.at(8) = s.at(1);
    });
  };
  EXPECT_THAT(reportOfChain(),
              HasSubstr("bin 0: expected no conflict between iterations, but "
                        "'data[1]' is read or stored unchanged by iteration 2 "
                        "and stored by iteration 1"));
}

TEST_F(Check, IterationsWithABarrier) {
  First::body = [](First &s, const Point &p) {
    if (p.value != 0)
      return;
    s.parallelFor(4, [&](int i) {
      s.at(i) = i + 1;
      s.sync();
      s.at(8 + i) = s.at((i + 1) % 4);
      s.sync();
      s.at((i + 2) % 4) = 9;
    });
    s.parallelFor(4, [&](int i) { s.at(i) = s.at(12 - i) + s.at(i); });
  };
  EXPECT_EQ(reportOfChain(), nothing);
  First::body = [](First &s, const Point &p) {
    if (p.value != 0)
      return;
    s.parallelFor(4, [&](int i) {
      s.sync();
      s.at(i) = i + 1;
      if (s.at(3 - i) == 0)
        s.at(8 + i) = 1;
      s.sync();
    });
  };
  EXPECT_THAT(reportOfChain(),
              HasSubstr("expected no conflict between iterations, but"));
}

// Numbers.

TEST_F(Check, NamedFieldsAreNumbers) {
  std::vector<Point> fed = points;
  fed[2].weight = NAN;
  Chain pipe;
  EXPECT_EQ(reportOf([&] { ::run(pipe, fed); }), nothing);
  pipe.expectNumbers<&Point::weight>();
  EXPECT_THAT(reportOf([&] { ::run(pipe, fed); }),
              AllOf(HasSubstr("expected a number in field 'weight' of '"),
                    HasSubstr("lineage: source 0 primitive 2")));
  First::body = [](First &s, const Point &p) {
    if (p.value == 1)
      s.emit({p.at, 1, NAN});
  };
  EXPECT_THAT(reportOf([&] { ::run(pipe, points); }),
              AllOf(HasSubstr("Step<0>', bin 1: expected a number in field "),
                    HasSubstr("lineage: source 0 primitive 1")));
}

// Where it happened.

TEST_F(Check, ErrorsSayWhere) {
  constexpr int line = __LINE__ + 3;
  Second::body = [](Second &s, const Point &p) {
    if (p.value == 1)
      s.state().data[99] = 1;
  };
  EXPECT_THAT(
      reportOfChain(),
      AllOf(HasSubstr("Step<1>', bin 1: expected an index into 'data' in "
                      "[0, 16), but got 99\n  at "),
            HasSubstr("CheckTest.cpp:" + std::to_string(line) +
                      "\n  lineage: source 0 primitive 1, '"),
            HasSubstr("Step<0>' bin 1 emit 0")));
}

TEST_F(Check, BothSidesOfAConflictSayWhere) {
  constexpr int line = __LINE__ + 3;
  First::body = [](First &s, const Point &p) {
    if (p.value != 1)
      s.state().data[3] = p.value + 1;
  };
  std::string place = "CheckTest.cpp:" + std::to_string(line) + "\n  ";
  EXPECT_THAT(reportOfChain(),
              AllOf(HasSubstr(place + "lineage: source 0 primitive 2"),
                    HasSubstr("\n  other at "),
                    HasSubstr(place + "other lineage: source 0 primitive 0")));
}

TEST_F(Check, LineageBeginsAnewWhereAStageCollects) {
  First::plan = [](First &s) { s.endBin(); };
  Second::body = [](Second &s, const Point &p) {
    s.state().data[p.value == 2 ? -1 : 0];
  };
  EXPECT_THAT(reportOfChain(), HasSubstr("Step<0>' bin 0 call 1, '"));
}

} // namespace
