//===- ParallelForTest.cpp - parallelFor, sync and collectives ------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Trace.h"

#include <cmath>

namespace {

/// A stage whose Process is a lambda of the test, over one bin of 4 by 3.
template <class F> struct Body : Whole<int, int> {
  static inline F *body = nullptr;
  void process(const int &i) { (*body)(*this, i); }
};
template <class F> struct BodyPipe : piko::Pipe<> {
  Body<F> stage;
  Sink sink;
  BodyPipe() {
    this->source(stage);
    this->connect(stage, 0, sink);
    this->setDomain({4, 3});
  }
};
/// What a Process with the given body does with the primitive 0.
template <class F> std::vector<int> process(F body) {
  Body<F>::body = &body;
  BodyPipe<F> pipe;
  return run(pipe, {0});
}

TEST(ParallelFor, EmitsInOrderOfIterations) {
  EXPECT_THAT(process([](auto &self, int) {
                self.parallelFor(3, [&](int i) {
                  self.emit(i);
                  self.emit(10 + i);
                });
                self.emit(99);
              }),
              ElementsAre(0, 10, 1, 11, 2, 12, 99));
}

TEST(ParallelFor, MayBeEmpty) {
  EXPECT_THAT(process([](auto &self, int) {
                self.parallelFor(0, [&](int) { self.emit(1); });
                self.parallelFor(-1, [&](int) { self.emit(1); });
              }),
              IsEmpty());
}

TEST(ParallelFor, Nests) {
  EXPECT_THAT(process([](auto &self, int) {
                self.parallelFor(2, [&](int i) {
                  self.parallelFor(2, [&](int j) { self.emit(10 * i + j); });
                  self.emit(100 + i);
                });
              }),
              ElementsAre(0, 1, 100, 10, 11, 101));
}

TEST(ParallelFor, PixelsOfTheBin) {
  EXPECT_THAT(process([](auto &self, int) {
                self.parallelForPixels(
                    [&](glm::ivec2 p) { self.emit(10 * p.y + p.x); });
              }),
              ElementsAre(0, 1, 2, 3, 10, 11, 12, 13, 20, 21, 22, 23));
}

TEST(ParallelFor, PixelsOfABox) {
  auto cells = [](glm::ivec2 lo, glm::ivec2 hi) {
    return process([=](auto &self, int) {
      self.parallelForPixels(lo, hi,
                             [&](glm::ivec2 p) { self.emit(10 * p.y + p.x); });
    });
  };
  EXPECT_THAT(cells({1, 1}, {2, 2}), ElementsAre(11, 12, 21, 22));
  EXPECT_THAT(cells({-3, 2}, {0, 9}), ElementsAre(20));
  EXPECT_THAT(cells({INT32_MIN, 1}, {INT32_MAX, 1}),
              ElementsAre(10, 11, 12, 13));
  EXPECT_THAT(cells({2, 1}, {1, 2}), IsEmpty());
  EXPECT_THAT(cells({INT32_MAX, 0}, {INT32_MIN, 2}), IsEmpty());
  EXPECT_THAT(cells({4, 0}, {5, 2}), IsEmpty());
}

TEST(ParallelFor, SyncSeparatesPhases) {
  EXPECT_THAT(process([](auto &self, int) {
                int shared[4] = {};
                self.parallelFor(4, [&](int i) {
                  trace.push_back(i);
                  shared[i] = i * i;
                  self.sync();
                  trace.push_back(10 + shared[3 - i]);
                  self.sync();
                  trace.push_back(20 + i);
                });
              }),
              ElementsAre(0, 1, 2, 3, 19, 14, 11, 10, 20, 21, 22, 23));
}

TEST(ParallelFor, EmissionsStayInOrderAcrossSyncs) {
  EXPECT_THAT(
      process([](auto &self, int) {
        self.parallelFor(3, [&](int i) {
          self.emit(i);
          self.sync();
          self.emit(10 + i);
          self.parallelFor(2, [&](int j) { self.emit(100 + j); });
        });
        self.emit(99);
      }),
      ElementsAre(0, 10, 100, 101, 1, 11, 100, 101, 2, 12, 100, 101, 99));
}

TEST(ParallelFor, SyncInAUniformLoop) {
  EXPECT_THAT(process([](auto &self, int) {
                int data[5] = {1, 1, 1, 1, 1};
                self.parallelFor(5, [&](int i) {
                  for (int s = 1; s < 5; s *= 2) {
                    int left = i >= s ? data[i - s] : 0;
                    self.sync();
                    data[i] += left;
                    self.sync();
                  }
                  self.emit(data[i]);
                });
              }),
              ElementsAre(1, 2, 3, 4, 5));
}

TEST(ParallelFor, SyncMustBeUniform) {
  auto divergent = [](int which, int times) {
    return messageOf([&] {
      process([&](auto &self, int) {
        self.parallelFor(3, [&](int i) {
          self.sync();
          if (i == which)
            for (int k = 0; k < times; ++k)
              self.sync();
        });
      });
    });
  };
  EXPECT_THAT(divergent(0, 1), HasSubstr("iteration 1 does not"));
  EXPECT_THAT(divergent(2, 1), HasSubstr("iteration 2 does not"));
  EXPECT_THAT(divergent(-1, 1), "(no error)");
  EXPECT_THAT(messageOf([] {
                process([](auto &self, int) {
                  self.parallelFor(3, [&](int i) {
                    if (i == 1)
                      self.sync();
                  });
                });
              }),
              HasSubstr("iteration 1 does not"));
}

TEST(ParallelFor, SyncOnlyDirectlyInside) {
  EXPECT_THAT(messageOf([] { process([](auto &self, int) { self.sync(); }); }),
              HasSubstr("expected sync inside a parallelFor"));
  EXPECT_THAT(
      messageOf([] {
        process([](auto &self, int) {
          self.parallelFor(
              2, [&](int) { self.parallelFor(2, [&](int) { self.sync(); }); });
        });
      }),
      HasSubstr("expected sync inside a parallelFor that is not nested"));
}

TEST(ParallelFor, ErrorsLeaveFibersAndUnwindThem) {
  static int alive;
  alive = 0;
  struct Guard {
    Guard() { ++alive; }
    ~Guard() { --alive; }
  };
  auto body = [](auto &self, int) {
    self.parallelFor(4, [&](int i) {
      Guard guard;
      self.sync();
      if (i == 2)
        throw piko::Error("from iteration 2");
      self.sync();
    });
  };
  EXPECT_EQ(messageOf([&] { process(body); }), "from iteration 2");
  EXPECT_EQ(alive, 0);
}

TEST(ParallelFor, Collectives) {
  EXPECT_THAT(process([](auto &self, int) {
                self.parallelFor(5, [&](int i) {
                  int keys[] = {3, 1, 2, 1, 0};
                  auto add = [](int a, int b) { return a + b; };
                  bool any = self.any(i == 3), all = self.all(i != 3);
                  int evens = int(self.count(i % 2 == 0));
                  int sum = self.reduce(i, add);
                  int before = self.scan(i, add);
                  int rank = int(self.sort(keys[i]));
                  self.emit(100000 * any + 10000 * all + 1000 * evens +
                            100 * before + 10 * rank + (sum == 10));
                });
              }),
              ElementsAre(103041, 103011, 103131, 103321, 103601));
}

TEST(ParallelFor, CollectivesOverARange) {
  EXPECT_THAT(process([](auto &self, int) {
                auto isTwo = [](int i) { return i == 2; };
                auto square = [](int i) { return i * i; };
                auto add = [](int a, int b) { return a + b; };
                self.emit(int(self.any(5, isTwo)));
                self.emit(int(self.all(5, isTwo)));
                self.emit(int(self.any(0, isTwo)));
                self.emit(int(self.all(0, isTwo)));
                self.emit(int(self.count(5, isTwo)));
                self.emit(self.template reduce<int>(5, square, add, -1));
                self.emit(self.template reduce<int>(0, square, add, -1));
              }),
              ElementsAre(1, 0, 0, 1, 1, 30, -1));
}

// The tree for n = 7: ((0 1) (2 3)) ((4 5) 6); the scan joins aligned blocks
// from the left.
TEST(ParallelFor, FloatsCombineInAFixedTree) {
  auto text = [](std::string a, std::string b) { return "(" + a + b + ")"; };
  std::vector<std::string> v{"0", "1", "2", "3", "4", "5", "6"};
  EXPECT_EQ(piko::reference::reduceTree(v, text, std::string()),
            "(((01)(23))((45)6))");
  EXPECT_THAT(piko::reference::scanTree(v, text, std::string()),
              ElementsAre("", "0", "(01)", "((01)2)", "((01)(23))",
                          "(((01)(23))4)", "(((01)(23))(45))"));
}

TEST(ParallelFor, SortIsStableWithNaNsLast) {
  std::vector<float> keys{NAN, 2, -0.0f, 0.0f, NAN, -INFINITY};
  EXPECT_THAT(piko::reference::sortedIndices(keys),
              ElementsAre(5, 2, 3, 1, 0, 4));
}

// Lists, too, spread their work.
struct Brighten : Whole<int, int> {
  void process(const piko::List<int> &list) {
    parallelFor(list.size(), [&](int i) {
      int before = scan(list[i], [](int a, int b) { return a + b; });
      emit(before);
    });
  }
};
struct BrightenPipe : piko::Pipe<> {
  Brighten brighten;
  Sink sink;
  BrightenPipe() {
    source(brighten);
    connect(brighten, 0, sink);
    setDomain({1, 1});
  }
};

TEST(ParallelFor, OverAList) {
  BrightenPipe pipe;
  EXPECT_THAT(run(pipe, {1, 2, 3}), ElementsAre(0, 1, 3));
}

// Emissions in a loop of a stage on a cycle keep their order, too.
struct Grow : Whole<int, int, int> {
  void process(const int &i) {
    parallelFor(2, [&](int k) {
      emit(10 * i + k, 1);
      sync();
      if (i < 10)
        emit(10 * i + k, 0);
    });
  }
};
struct GrowPipe : piko::Pipe<> {
  Grow grow;
  Sink sink;
  GrowPipe() {
    source(grow);
    connect(grow, 0, grow);
    connect(grow, 1, sink);
    setDomain({1, 1});
  }
};

TEST(ParallelFor, OnACycle) {
  GrowPipe pipe;
  EXPECT_THAT(run(pipe, {1}), ElementsAre(10, 100, 101, 11, 110, 111));
}

} // namespace
