//===- AssignTest.cpp - Which bins a primitive belongs to -----------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Trace.h"

namespace {

struct Box {
  glm::vec2 lo, hi;
};

// Notes the bins of boxes.
template <class Corner> struct ByBox : piko::Stage<8, 8, 64, Box> {
  void assignBin(const Box &b) {
    assignToBoundingBox(b, Corner(b.lo), Corner(b.hi));
  }
  void process(const Box &) { trace.push_back(int(bin().index)); }
};
template <class Corner> struct BoxPipe : piko::Pipe<> {
  ByBox<Corner> byBox;
  BoxPipe() {
    source(byBox);
    setDomain({20, 10}); // 3 by 2 bins
  }
};

TEST(Assign, BoundingBoxIsClosedAndClipped) {
  BoxPipe<glm::vec2> pipe;
  auto bins = [&](glm::vec2 lo, glm::vec2 hi) {
    return run(pipe, std::vector<Box>{{lo, hi}});
  };
  EXPECT_THAT(bins({0, 0}, {7.9f, 7.9f}), ElementsAre(0));
  EXPECT_THAT(bins({7.9f, 0}, {8, 8}), ElementsAre(0, 1, 3, 4));
  EXPECT_THAT(bins({-100, 9}, {1e20f, 9}), ElementsAre(3, 4, 5));
  EXPECT_THAT(bins({-100, -100}, {100, 100}), ElementsAre(0, 1, 2, 3, 4, 5));
  EXPECT_THAT(bins({20, 0}, {30, 9}), IsEmpty());
  EXPECT_THAT(bins({-5, 0}, {-0.1f, 9}), IsEmpty());
  EXPECT_THAT(bins({5, 5}, {4, 5}), IsEmpty());
  EXPECT_THAT(messageOf([&] { bins({0, 0}, {NAN, 1}); }),
              HasSubstr("expected positions of numbers, but got NaN"));
}

TEST(Assign, BoundingBoxOfCells) {
  BoxPipe<glm::ivec2> pipe;
  EXPECT_THAT(run(pipe, std::vector<Box>{{{8, 7}, {15, 8}}}),
              ElementsAre(1, 4));
}

// Positions are floored, and have no bin outside the domain.
struct ByPosition : piko::Stage<8, 8, 64, glm::vec2> {
  void assignBin(const glm::vec2 &p) {
    trace.push_back(int(binFromPosition(p).index));
    glm::ivec2 cell(piko::toInt(piko::floor(p.x)),
                    piko::toInt(piko::floor(p.y)));
    trace.push_back(int(binFromPosition(cell).index));
  }
  void process(const glm::vec2 &) {}
};
struct PositionPipe : piko::Pipe<> {
  ByPosition byPosition;
  PositionPipe() {
    source(byPosition);
    setDomain({20, 10});
  }
};

TEST(Assign, BinFromPosition) {
  PositionPipe pipe;
  auto bin = [&](float x, float y) {
    return run(pipe, std::vector<glm::vec2>{{x, y}});
  };
  EXPECT_THAT(bin(0, 0), ElementsAre(0, 0));
  EXPECT_THAT(bin(7.99f, 8), ElementsAre(3, 3));
  EXPECT_THAT(bin(19.99f, 9.99f), ElementsAre(5, 5));
  EXPECT_THAT(bin(20, 0), ElementsAre(-1, -1));
  EXPECT_THAT(bin(0, 10), ElementsAre(-1, -1));
  EXPECT_THAT(bin(-0.01f, 0), ElementsAre(-1, -1));
  std::vector<glm::vec2> nan{{NAN, 0}, {INFINITY, 0}, {0, -INFINITY}};
  for (glm::vec2 p : nan)
    EXPECT_EQ(run(pipe, std::vector<glm::vec2>{p})[0], -1);
}

// A primitive with no bin is culled.
struct Cull : piko::Stage<1, 1, 1, int> {
  void assignBin(const int &i) {
    if (i >= 0)
      assignToBin(i, {i});
  }
  void process(const int &i) { trace.push_back(i); }
};
struct CullPipe : piko::Pipe<> {
  Cull cull;
  CullPipe() {
    source(cull);
    setDomain({2, 2});
  }
};

TEST(Assign, NoBinCulls) {
  CullPipe pipe;
  EXPECT_THAT(run(pipe, {3, -1, 0}), ElementsAre(3, 0));
}

TEST(Assign, BinOutOfRangeIsAnError) {
  CullPipe pipe;
  EXPECT_THAT(messageOf([&] { run(pipe, {1, 4}); }),
              testing::MatchesRegex(
                  "stage '.*Cull': expected a bin id in .0, 4., but got 4"));
}

// Previous bins: those in which the producer emitted.
struct First : piko::Stage<4, 4, 1, int, int> {
  void assignBin(const int &i) {
    assignToBin(i, {1});
    assignToBin(i, {3});
  }
  void process(const int &i) { emit(i); }
};
template <int Size> struct Second : piko::Stage<Size, Size, 1, int> {
  void assignBin(const int &i) { this->assignToPreviousBins(i); }
  void process(const int &) { trace.push_back(int(this->bin().index)); }
};
template <int Size> struct PreviousPipe : piko::Pipe<> {
  First first;
  Second<Size> second;
  PreviousPipe() {
    source(first);
    connect(first, 0, second);
    setDomain({8, 8});
  }
};

TEST(Assign, PreviousBins) {
  PreviousPipe<4> pipe;
  EXPECT_THAT(run(pipe, {0, 0}), ElementsAre(1, 3, 1, 3));
  PreviousPipe<2> other;
  EXPECT_THAT(messageOf([&] { run(other, {0}); }),
              HasSubstr("expected bins of the same size as those of stage"));
}

// Any rank: 3D bins, one of them over the whole depth.
struct Voxel {
  glm::vec3 p;
};
template <class Grid> struct ByVoxel : piko::BasicStage<Grid, 1, Voxel> {
  void assignBin(const Voxel &v) {
    this->assignToBin(v, this->binFromPosition(v.p));
  }
  void process(const Voxel &) {
    glm::ivec3 lo = this->binLo(), hi = this->binHi();
    trace.push_back(int(this->bin().index));
    for (int d = 0; d < 3; ++d)
      trace.push_back(lo[d]), trace.push_back(hi[d]);
  }
};
template <class Grid> struct VoxelPipe : piko::Pipe<> {
  ByVoxel<Grid> byVoxel;
  VoxelPipe() {
    source(byVoxel);
    setDomain({10, 6, 5});
  }
};

TEST(Assign, ThreeDimensions) {
  VoxelPipe<piko::Bins<4, 4, 4>> pipe; // 3 by 2 by 2 bins
  EXPECT_THAT(run(pipe, std::vector<Voxel>{{{9, 5, 4}}}),
              ElementsAre(11, 8, 10, 4, 6, 4, 5));
  VoxelPipe<piko::Bins<4, 4, 0>> columns;
  EXPECT_THAT(run(columns, std::vector<Voxel>{{{3, 5, 4}}}),
              ElementsAre(3, 0, 4, 4, 6, 0, 5));
}

TEST(Assign, BoxInThreeDimensions) {
  struct Boxed : piko::BasicStage<piko::Bins<4, 4, 4>, 1, Voxel> {
    void assignBin(const Voxel &v) {
      assignToBoundingBox(v, v.p, v.p + glm::vec3(1, 0, 1));
    }
    void process(const Voxel &) { trace.push_back(int(bin().index)); }
  };
  struct BoxedPipe : piko::Pipe<> {
    Boxed boxed;
    BoxedPipe() {
      source(boxed);
      setDomain({10, 6, 5});
    }
  } pipe;
  EXPECT_THAT(run(pipe, std::vector<Voxel>{{{3, 0, 3}}}),
              ElementsAre(0, 1, 6, 7));
}

TEST(Assign, OneAndFourDimensions) {
  struct Line : piko::BasicStage<piko::Bins<4>, 1, int> {
    void assignBin(const int &i) {
      assignToBin(i, binFromPosition(piko::Cells<1>(i)));
    }
    void process(const int &) {
      trace.push_back(int(bin().index));
      trace.push_back(binHi().x);
    }
  };
  struct LinePipe : piko::Pipe<> {
    Line line;
    LinePipe() {
      source(line);
      setDomain({10});
    }
  } pipe;
  EXPECT_THAT(run(pipe, {9}), ElementsAre(2, 10));

  struct Hyper : piko::BasicStage<piko::Bins<2, 2, 2, 2>, 1, int> {
    void assignBin(const int &i) {
      assignToBin(i, binFromPosition(glm::ivec4(i)));
    }
    void process(const int &) { trace.push_back(int(bin().index)); }
  };
  struct HyperPipe : piko::Pipe<> {
    Hyper hyper;
    HyperPipe() {
      source(hyper);
      setDomain({4, 4, 4, 4});
    }
  } hyper;
  EXPECT_THAT(run(hyper, {3}), ElementsAre(15));
}

// The last bins of a dimension are partial; domain() is the whole.
TEST(Assign, PartialEdgeBins) {
  struct Edge : piko::Stage<8, 8, 64, int> {
    void assignBin(const int &i) { assignToAll(i); }
    void process(const int &) {
      trace.push_back(binHi().x - binLo().x);
      trace.push_back(binHi().y - binLo().y);
      EXPECT_EQ(domain(), glm::ivec2(20, 10));
    }
  };
  struct EdgePipe : piko::Pipe<> {
    Edge edge;
    EdgePipe() {
      source(edge);
      setDomain({20, 10});
    }
  } pipe;
  EXPECT_THAT(run(pipe, {0}), ElementsAre(8, 8, 8, 8, 4, 8, 8, 2, 8, 2, 4, 2));
}

} // namespace
