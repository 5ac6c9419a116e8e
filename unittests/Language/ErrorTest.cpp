//===- ErrorTest.cpp - Pipelines and hosts that break a rule --------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Trace.h"

#include <span>

namespace {

struct Two : Whole<int, int, int> {
  void process(const int &i) { emit(i, 7); }
};
struct Floats : Whole<float> {
  void process(const float &) {}
};

/// A pipeline that the test wires.
struct OpenPipe : piko::Pipe<> {
  Two two;
  Sink a, b;
  Floats floats;
  using piko::Pipe<>::connect;
  using piko::Pipe<>::source;
  OpenPipe() { setDomain({2, 2}); }
};

TEST(Errors, UnconnectedPort) {
  OpenPipe pipe;
  pipe.source(pipe.two);
  pipe.connect(pipe.two, 0, pipe.a);
  EXPECT_THAT(messageOf([&] { pipe.run(); }),
              testing::MatchesRegex("stage '.*Two': port 1 is not connected"));
}

TEST(Errors, PortConnectedTwice) {
  OpenPipe pipe;
  pipe.source(pipe.two);
  pipe.connect(pipe.two, 0, pipe.a);
  pipe.connect(pipe.two, 1, pipe.b);
  pipe.connect(pipe.two, 0, pipe.b);
  EXPECT_THAT(messageOf([&] { pipe.run(); }),
              HasSubstr("Two': port 0 is connected twice, to stage '"));
}

TEST(Errors, MismatchedTypesOnAnEdge) {
  OpenPipe pipe;
  pipe.source(pipe.two);
  pipe.connect(pipe.two, 0, pipe.a);
  pipe.connect(pipe.two, 1, pipe.floats);
  EXPECT_THAT(messageOf([&] { pipe.run(); }),
              testing::MatchesRegex("stage '.*Two': expected an edge between "
                                    "equal types, but port 1 emits 'int' and "
                                    "stage '.*Floats' takes 'float'"));
}

TEST(Errors, PortOutOfRange) {
  OpenPipe pipe;
  EXPECT_THAT(messageOf([&] { pipe.connect(pipe.two, 2, pipe.a); }),
              HasSubstr("Two': expected one of the 2 ports, but got port 2"));
  pipe.source(pipe.two);
  pipe.connect(pipe.two, 0, pipe.a);
  pipe.connect(pipe.two, 1, pipe.b);
  pipe.source(pipe.floats);
  EXPECT_THAT(
      messageOf([&] { run(pipe, {1}); }),
      HasSubstr("Two', bin 0: expected one of the 2 ports, but got port 7"));
}

TEST(Errors, StageWithoutInput) {
  OpenPipe pipe;
  pipe.source(pipe.a);
  EXPECT_THAT(messageOf([&] { pipe.run(); }),
              HasSubstr("stage 0 of the pipeline, which takes 'int', has no "
                        "input: expected an edge or a source that feeds it"));
  pipe.source(pipe.b);
  pipe.connect(pipe.two, 0, pipe.a);
  pipe.connect(pipe.two, 1, pipe.b);
  EXPECT_THAT(
      messageOf([&] { pipe.run(); }),
      HasSubstr("stage 3 of the pipeline, which takes 'float', has no"));
  pipe.source(pipe.floats);
  EXPECT_THAT(messageOf([&] { pipe.run(); }),
              testing::MatchesRegex("stage '.*Two': has no input: .*"));
}

// The stages of one pipeline are not another's, nor are those of none.
TEST(Errors, StageOfNoPipeline) {
  OpenPipe outer; // still names no stage
  struct OnePipe : piko::Pipe<> {
    Sink sink;
    OnePipe() {
      source(sink);
      setDomain({1, 1});
    }
  } pipe;
  [[maybe_unused]] Sink free;
  trace.clear();
  run(pipe, {1});
  EXPECT_THAT(trace, ElementsAre(1));
}

struct Impatient : Whole<int> {
  void schedule(piko::BinId) { endStage<Floats>(); }
  void process(const int &) {}
};

TEST(Errors, WaitForAStageOfNoPipeline) {
  struct ImpatientPipe : piko::Pipe<> {
    Impatient impatient;
    ImpatientPipe() {
      source(impatient);
      setDomain({1, 1});
    }
  } pipe;
  EXPECT_THAT(messageOf([&] { pipe.run(); }),
              testing::MatchesRegex("stage '.*Impatient': expected endStage of "
                                    "a stage of the pipeline, but got "
                                    "'.*Floats'"));
}

struct WrongPort : Whole<int, int, float> {
  void process(const int &i) { emit(i, 1); }
};

TEST(Errors, EmissionOfAnotherTypeThanItsPort) {
  struct WrongPipe : piko::Pipe<> {
    WrongPort wrong;
    Sink sink;
    Floats floats;
    WrongPipe() {
      source(wrong);
      connect(wrong, 0, sink);
      connect(wrong, 1, floats);
      setDomain({1, 1});
    }
  } pipe;
  EXPECT_THAT(messageOf([&] { run(pipe, {1}); }),
              HasSubstr("bin 0: expected a primitive of type 'float' for port "
                        "1, but got 'int'"));
}

TEST(Errors, Domain) {
  struct NoDomain : piko::Pipe<> {
    Sink sink;
    NoDomain() { source(sink); }
  } pipe;
  EXPECT_THAT(messageOf([&] { pipe.run(); }), HasSubstr("has no domain"));
  EXPECT_THAT(messageOf([&] { pipe.setDomain({4, 0}); }),
              HasSubstr("but got 0"));
  EXPECT_THAT(messageOf([&] { pipe.setDomain({1073741825}); }),
              HasSubstr("expected a domain of 1 to 1073741824 cells"));
  EXPECT_THAT(messageOf([&] { pipe.setDomain({1, 1, 1, 1, 1}); }),
              HasSubstr("expected a domain of 1 to 4 dimensions, but got 5"));
  pipe.setDomain({4, 4, 4});
  EXPECT_THAT(messageOf([&] { pipe.run(); }),
              HasSubstr("Sink': expected bins of 3 dimensions as the domain "
                        "has, but got 2"));
}

TEST(Errors, Feed) {
  OpenPipe pipe;
  pipe.source(pipe.a);
  std::vector<float> floats{1};
  EXPECT_THAT(messageOf([&] { pipe.feed(0, floats.data(), 1); }),
              HasSubstr("expected primitives of type 'int' for source 0, but "
                        "got 'float'"));
  EXPECT_THAT(messageOf([&] { pipe.feed(1, floats.data(), 1); }),
              HasSubstr("expected one of the 1 sources, but got source 1"));
  EXPECT_THAT(messageOf([&] { pipe.feed(pipe.b, floats); }),
              HasSubstr("has no source"));
  pipe.source(pipe.a);
  EXPECT_THAT(messageOf([&] { pipe.feed(pipe.a, std::span<const int>()); }),
              HasSubstr("has several sources"));
}

// A wrong domain leaves the one before it.
TEST(Errors, DomainStays) {
  struct SinkPipe : piko::Pipe<> {
    Sink sink;
    SinkPipe() { source(sink); }
  } pipe;
  pipe.setDomain({2, 2});
  EXPECT_THAT(messageOf([&] { pipe.setDomain({0, 4, 4}); }),
              HasSubstr("but got 0"));
  EXPECT_TRUE(pipe.run());
}

TEST(Errors, LoopLimit) {
  OpenPipe pipe;
  EXPECT_THAT(messageOf([&] { pipe.setLoopLimit(-1); }),
              "expected a loop limit of at least 0, but got -1");
}

// What hosts of compiled pipelines write works, and an error can be a status.
TEST(Errors, Status) {
  struct StrayPipe : piko::Pipe<> {
    Sink sink;
    StrayPipe() { source(sink); }
  } pipe;
  piko::Status status = pipe.tryRun();
  EXPECT_FALSE(status);
  EXPECT_THAT(status.message(), HasSubstr("has no domain"));
  EXPECT_EQ(messageOf([&] { status.orThrow(); }), status.message());
  EXPECT_TRUE(pipe.setDomain({1, 1}));
  EXPECT_TRUE(pipe.setThreads(2));
  EXPECT_TRUE(pipe.setMemoryLimit(1));
  EXPECT_TRUE(pipe.setMemoryBudget(1));
  EXPECT_TRUE(pipe.setStripSize(1));
  const std::vector<int> values{4, 5};
  trace.clear();
  EXPECT_TRUE(pipe.feed(size_t(0), values));
  EXPECT_TRUE(pipe.tryRun());
  EXPECT_THAT(trace, ElementsAre(4, 5));
}

// Bytes without a type, as generated code feeds them.
TEST(Errors, FeedOfBytesIsNotChecked) {
  struct BytesPipe : piko::Pipe<> {
    Sink sink;
    BytesPipe() {
      source(sink);
      setDomain({1, 1});
    }
  } pipe;
  int values[] = {4, 5};
  trace.clear();
  pipe.feed(0, static_cast<const void *>(values), 2);
  pipe.run();
  EXPECT_THAT(trace, ElementsAre(4, 5));
}

struct Confused : Whole<int, int> {
  void assignBin(const int &i) {
    if (i == 1)
      emit(i);
    if (i == 2)
      bin();
    assignToBin(i, {0});
  }
  void process(const int &i) {
    if (i == 3)
      assignToBin(i, {0});
    if (i == 4)
      endBin();
  }
};

TEST(Errors, PhasesThatSayWhatIsNotTheirs) {
  struct ConfusedPipe : piko::Pipe<> {
    Confused confused;
    Sink sink;
    ConfusedPipe() {
      source(confused);
      connect(confused, 0, sink);
      setDomain({1, 1});
    }
  } pipe;
  EXPECT_THAT(messageOf([&] { run(pipe, {1}); }),
              HasSubstr("expected emit in process, but it is in assignBin"));
  EXPECT_THAT(messageOf([&] { run(pipe, {2}); }),
              HasSubstr("bin in assignBin"));
  EXPECT_THAT(messageOf([&] { run(pipe, {3}); }),
              HasSubstr("in assignBin, but it is in process"));
  EXPECT_THAT(messageOf([&] { run(pipe, {4}); }),
              HasSubstr("expected endBin in schedule, but it is in process"));
  EXPECT_THAT(messageOf([&] { pipe.confused.emit(1); }),
              "emit outside a running pipeline");
}

TEST(Errors, ListDirectivesNeedAList) {
  struct Single : Whole<int> {
    void schedule(piko::BinId) { batch(4); }
    void process(const int &) {}
  };
  struct SinglePipe : piko::Pipe<> {
    Single single;
    SinglePipe() {
      source(single);
      setDomain({1, 1});
    }
  } pipe;
  EXPECT_THAT(messageOf([&] { run(pipe, {1}); }),
              HasSubstr("expected batch only in a stage that takes a list"));
}

TEST(Errors, ListIndexOutOfRange) {
  struct Past : Whole<int> {
    void process(const piko::List<int> &list) { list[1]; }
  };
  struct PastPipe : piko::Pipe<> {
    Past past;
    PastPipe() {
      source(past);
      setDomain({1, 1});
    }
  } pipe;
  EXPECT_THAT(messageOf([&] { run(pipe, {1}); }),
              HasSubstr("Past', bin 0: expected an index in [0, 1), but got "
                        "1"));
}

TEST(Errors, AllocateForAMissingSource) {
  struct State {
    piko::Buffer<int> buffer;
  };
  struct MissingPipe : piko::Pipe<State> {
    Sink sink;
    MissingPipe() {
      source(sink);
      allocateForSource(state().buffer, 1);
      setDomain({1, 1});
    }
  } pipe;
  EXPECT_THAT(messageOf([&] { pipe.run(); }),
              HasSubstr("allocateForSource: expected one of the 1 sources"));
}

// What stages wait for, and whether they keep the order, is the same in all
// bins.
enum class Varying { EndStage, EndBin, Order, Precision, Name, Nothing };
Varying varying;
struct Varied : piko::Stage<1, 1, 1, int> {
  void assignBin(const int &i) { assignToAll(i); }
  void schedule(piko::BinId bin) {
    specifySchedule(bin.index % 2 ? piko::DirectMap : piko::LoadBalance);
    if (varying == Varying::EndStage && bin.index != 1)
      endStage<Sink>();
    if (varying == Varying::EndBin && bin.index == 2)
      endBin();
    if (varying == Varying::Order && bin.index == 0)
      specifyOrder(piko::Unordered);
    if (varying == Varying::Precision && bin.index != 2)
      specifyPrecision(piko::Precision::Relaxed);
    if (varying == Varying::Name && bin.index != 3)
      specifyName("Varied one");
  }
  void process(const int &) {}
};

TEST(Errors, SchedulesThatDependOnTheBin) {
  struct VariedPipe : piko::Pipe<> {
    Varied varied;
    Sink sink;
    VariedPipe() {
      source(varied);
      source(sink);
      setDomain({2, 2});
    }
  } pipe;
  varying = Varying::EndStage;
  EXPECT_THAT(messageOf([&] { run(pipe, {}); }),
              HasSubstr("Varied', bin 1: expected endStage to be said for all "
                        "bins or for none"));
  varying = Varying::EndBin;
  EXPECT_THAT(messageOf([&] { run(pipe, {}); }),
              HasSubstr("bin 2: expected endBin to be said for all bins or "
                        "for none"));
  varying = Varying::Order;
  EXPECT_THAT(messageOf([&] { run(pipe, {}); }),
              HasSubstr("bin 1: expected specifyOrder to be said for all bins "
                        "or for none"));
  varying = Varying::Precision;
  EXPECT_THAT(messageOf([&] { run(pipe, {}); }),
              HasSubstr("bin 2: expected specifyPrecision to be said for all "
                        "bins or for none"));
  varying = Varying::Name;
  EXPECT_THAT(messageOf([&] { run(pipe, {}); }),
              HasSubstr("bin 3: expected specifyName to be said for all bins "
                        "or for none"));
  varying = Varying::Nothing;
  EXPECT_EQ(messageOf([&] { run(pipe, {}); }), "(no error)");
}

// Messages call a stage what it is named, which no other one is.
struct Named : Whole<int, int> {
  std::vector<const char *> names;
  void schedule(piko::BinId) {
    for (const char *name : names)
      specifyName(name);
  }
  void process(const int &i) { emit(i, i); }
};

TEST(Errors, Names) {
  struct NamedPipe : piko::Pipe<> {
    Named first, second;
    Sink sink;
    NamedPipe() {
      source(first);
      connect(first, 0, second);
      connect(second, 0, sink);
      setDomain({1, 1});
    }
  } pipe;
  auto message = [&](std::vector<const char *> names) {
    pipe.first.names = std::move(names);
    return messageOf([&] { run(pipe, {1}); });
  };
  EXPECT_THAT(message({"First pass"}),
              HasSubstr("stage 'First pass', bin 0: expected one of the 1 "
                        "ports, but got port 1"));
  EXPECT_THAT(message({""}),
              HasSubstr("expected a name of letters, digits, spaces and _-.(), "
                        "but got ''"));
  EXPECT_THAT(message({"a=b"}), HasSubstr("but got 'a=b'"));
  EXPECT_THAT(message({"a", "a", "b"}),
              HasSubstr("expected one name of a stage, but got 'a' and 'b'"));
  pipe.second.names = {"a"};
  EXPECT_THAT(message({"a"}),
              HasSubstr("stage 'a': expected a name that no other stage has"));
}

struct Pixels {
  piko::Image<int> image;
};
struct Nest : Whole<int>, piko::Uses<Pixels> {
  void process(const int &kind) {
    if (kind == 1)
      update(state().image, {0, 0}, [&](int &) {
        update(state().image, {1, 0}, [](int &i) { ++i; });
      });
    auto twice = [](int i) { return 2 * i; };
    auto add = [](int a, int b) { return a + b; };
    parallelFor(2, [&](int) {
      if (kind == 2)
        any(2, twice);
      if (kind == 3)
        all(2, twice);
      if (kind == 4)
        count(2, twice);
      if (kind == 5)
        reduce<int>(2, twice, add, 0);
    });
  }
};

TEST(Errors, WhatCannotBeInsideAnother) {
  struct NestPipe : piko::Pipe<Pixels> {
    Nest nest;
    NestPipe() {
      source(nest);
      setDomain({2, 2});
    }
  } pipe;
  const char *const messages[] = {
      "expected an update outside an update",
      "expected any(n, f) outside a parallelFor",
      "expected all(n, f) outside a parallelFor",
      "expected count(n, f) outside a parallelFor",
      "expected reduce(n, f) outside a parallelFor"};
  for (int kind = 1; kind <= 5; ++kind)
    EXPECT_THAT(messageOf([&] { run(pipe, {kind}); }),
                HasSubstr(std::string("Nest', bin 0: ") + messages[kind - 1]));
}

} // namespace
