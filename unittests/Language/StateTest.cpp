//===- StateTest.cpp - Constants, buffers, images, update, atomics --------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Trace.h"

namespace {

struct Sample {
  glm::ivec2 at;
  int value;
};
struct Depth {
  float z = 1;
  int writes = 0;
};
struct Nested {
  piko::Image<int> inner;
};
struct DrawState {
  float scale = 0;
  piko::Buffer<int> histogram;
  piko::Buffer<int> copies;
  piko::Image<Depth> depth;
  piko::Image<uint64_t> last;
  Nested nested;
};

struct Draw : piko::Stage<8, 8, 64, Sample>, piko::Uses<DrawState> {
  void assignBin(const Sample &s) { assignToBin(s, binFromPosition(s.at)); }
  void process(const Sample &s) {
    bool first = update(state().depth, s.at, [&](Depth &pixel) {
      pixel.z = pixel.z * 0.5f + state().scale * float(s.value);
      return pixel.writes++ == 0;
    });
    if (first)
      piko::atomicAdd(state().histogram[s.value % 4], 1);
    piko::atomicMax(state().last(s.at), uint64_t(s.value));
    if (first)
      state().nested.inner.store(s.at, s.value);
  }
};
struct DrawPipe : piko::Pipe<DrawState> {
  Draw draw;
  DrawPipe() {
    source(draw);
    allocateForSource(state().copies, 0);
    setDomain({10, 9});
    state().scale = 2;
    state().histogram.assign({0, 0, 0, 0});
  }
};

TEST(State, UpdatesOfAPixelAreInLineageOrder) {
  DrawPipe pipe;
  std::vector<Sample> samples{{{9, 8}, 1}, {{9, 8}, 3}, {{0, 0}, 5}};
  run(pipe, samples);
  EXPECT_EQ(pipe.state().depth({9, 8}).z, (0.5f + 2) * 0.5f + 6);
  EXPECT_EQ(pipe.state().depth({9, 8}).writes, 2);
  EXPECT_EQ(pipe.state().last({9, 8}), 3u);
  EXPECT_EQ(pipe.state().nested.inner({0, 0}), 5);
  EXPECT_THAT(pipe.state().histogram, ElementsAre(0, 2, 0, 0));
}

TEST(State, ImagesAreClearedToTheirDefaultAtEachRun) {
  DrawPipe pipe;
  std::vector<Sample> samples{{{1, 1}, 1}};
  run(pipe, samples);
  run(pipe, samples);
  EXPECT_EQ(pipe.state().depth({1, 1}).writes, 1);
  EXPECT_EQ(pipe.state().depth({2, 1}).z, 1.0f);
  EXPECT_EQ(pipe.state().depth.extent(), glm::ivec2(10, 9));
  EXPECT_EQ(pipe.state().depth.size(), 90);
  EXPECT_EQ(pipe.state().depth.data()[11].writes, 1); // row-major
  EXPECT_EQ(pipe.state().nested.inner.size(), 90);
  // What the host binds stays.
  EXPECT_THAT(pipe.state().histogram, ElementsAre(0, 2, 0, 0));
}

TEST(State, BuffersForASourceAreZeroedAtEachRun) {
  DrawPipe pipe;
  std::vector<Sample> samples(3, Sample{{1, 1}, 1});
  run(pipe, samples);
  EXPECT_THAT(pipe.state().copies, ElementsAre(0, 0, 0));
  pipe.state().copies[1] = 7;
  run(pipe, samples);
  EXPECT_THAT(pipe.state().copies, ElementsAre(0, 0, 0));
}

TEST(State, BuffersBindTheHostsMemory) {
  DrawPipe pipe;
  int bins[4] = {10, 20, 30, 40};
  pipe.state().histogram.bind(bins, 4);
  run(pipe, std::vector<Sample>{{{1, 1}, 2}});
  EXPECT_EQ(bins[2], 31);
}

TEST(State, UpdateOutsideTheBinIsAnError) {
  struct Stray : piko::Stage<8, 8, 64, Sample>, piko::Uses<DrawState> {
    void assignBin(const Sample &s) { assignToBin(s, {1}); }
    void process(const Sample &s) {
      update(state().depth, s.at, [](Depth &d) { d.z = 0; });
    }
  };
  struct StrayPipe : piko::Pipe<DrawState> {
    Stray stray;
    StrayPipe() {
      source(stray);
      setDomain({10, 9});
    }
  } pipe;
  EXPECT_THAT(
      messageOf([&] { run(pipe, std::vector<Sample>{{{7, 0}, 0}}); }),
      HasSubstr("Stray', bin 1: expected an update inside the stage's own "
                "bin, but got pixel (7, 0)"));
}

TEST(State, AccessOutOfRangeIsAnError) {
  DrawPipe pipe;
  EXPECT_THAT(messageOf([&] { pipe.state().histogram[4] = 1; }),
              "expected an index in [0, 4), but got 4");
  run(pipe, std::vector<Sample>{});
  EXPECT_THAT(messageOf([&] { pipe.state().depth({0, 9}); }),
              "expected an index in [0, 9), but got 9");
}

TEST(State, ImagesOfOtherRanks) {
  struct Grids {
    piko::Image<int, 1> rows;
    piko::Image<int, 3> voxels;
  };
  struct Fill : piko::BasicStage<piko::Bins<2, 2, 2>, 1, glm::ivec3>,
                piko::Uses<Grids> {
    void assignBin(const glm::ivec3 &p) { assignToBin(p, binFromPosition(p)); }
    void process(const glm::ivec3 &p) {
      update(state().voxels, p, [](int &v) { ++v; });
      piko::atomicAdd(state().rows(piko::Cells<1>(p.x)), 1);
    }
  };
  struct FillPipe : piko::Pipe<Grids> {
    Fill fill;
    FillPipe() {
      source(fill);
      setDomain({3, 4, 5});
    }
  } pipe;
  run(pipe, std::vector<glm::ivec3>{{2, 3, 4}, {2, 3, 4}, {2, 0, 0}});
  EXPECT_EQ(pipe.state().voxels({2, 3, 4}), 2);
  EXPECT_EQ(pipe.state().voxels.size(), 60);
  EXPECT_EQ(pipe.state().voxels.data()[59], 2);
  EXPECT_EQ(pipe.state().rows.size(), 3);
  EXPECT_EQ(pipe.state().rows.data()[2], 3);
}

struct Cells {
  int32_t add = INT32_MAX, min = 3, max = 3, bits = 12;
  float sum = 0;
};
struct AtomicState {
  piko::Buffer<Cells> cells;
};
template <bool Any> struct Atomics : Whole<int>, piko::Uses<AtomicState> {
  void schedule(piko::BinId) {
    if constexpr (Any)
      specifyOrder(piko::Unordered);
  }
  void process(const int &i) {
    Cells &c = state().cells[0];
    piko::atomicAdd(c.add, i);
    piko::atomicMin(c.min, i);
    piko::atomicMax(c.max, i);
    piko::atomicAnd(c.bits, 8);
    piko::atomicOr(c.bits, 3);
    piko::atomicXor(c.bits, 1);
    if (i == 9)
      trace.push_back(piko::atomicAddFetch(c.max, 1));
    if (i == 10)
      piko::atomicAdd(c.sum, 0.5f);
  }
};
template <bool Any> struct AtomicPipe : piko::Pipe<AtomicState> {
  Atomics<Any> atomics;
  AtomicPipe() {
    source(atomics);
    setDomain({1, 1});
    state().cells.assign({Cells()});
  }
};

TEST(State, IntegerAtomics) {
  AtomicPipe<false> pipe;
  run(pipe, {5});
  Cells c = pipe.state().cells[0];
  EXPECT_EQ(c.add, INT32_MIN + 4); // wraps
  EXPECT_EQ(c.min, 3);
  EXPECT_EQ(c.max, 5);
  EXPECT_EQ(c.bits, 10);
}

TEST(State, AtomicsWhoseOrderShowsNeedUnordered) {
  AtomicPipe<false> ordered;
  EXPECT_THAT(
      messageOf([&] { run(ordered, {9}); }),
      HasSubstr("expected the stage to be unordered, because the result of an "
                "atomic shows"));
  EXPECT_THAT(
      messageOf([&] { run(ordered, {10}); }),
      HasSubstr("because a float atomic shows the order of its primitives"));
  AtomicPipe<true> unordered;
  EXPECT_THAT(run(unordered, {9, 10}), ElementsAre(9));
  EXPECT_EQ(unordered.state().cells[0].sum, 0.5f);
}

} // namespace
