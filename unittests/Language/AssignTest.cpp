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

// Lines, each with its number.
template <int Rank> struct Line {
  piko::Cells<Rank> a, b;
  int number = 0;
};
template <class B> struct ByLine : piko::BasicStage<B, 64, Line<B::rank>> {
  void assignBin(const Line<B::rank> &l) { this->assignToLine(l, l.a, l.b); }
  void process(const Line<B::rank> &l) {
    trace.push_back(l.number);
    trace.push_back(int(this->bin().index));
  }
};
template <class B> struct LinePipe : piko::Pipe<> {
  ByLine<B> byLine;
  explicit LinePipe(const piko::Cells<B::rank> &domain) {
    source(byLine);
    setDomain(domain);
  }
};

/// Whether the segment between the middles of two cells has a point of the
/// closed box: the places on it, as fractions, at which it is in each of the
/// box's slabs.
template <int Rank>
bool touches(const Line<Rank> &line, const piko::Cells<Rank> &lo,
             const piko::Cells<Rank> &hi) {
  struct Fraction {
    int64_t over, under; // under > 0
    bool operator<(const Fraction &other) const {
      return over * other.under < other.over * under;
    }
  };
  Fraction begin{0, 1}, end{1, 1};
  for (int d = 0; d < Rank; ++d) {
    int64_t from = 2 * line.a[d] + 1, to = 2 * line.b[d] + 1;
    int64_t first = 2 * lo[d] - from, last = 2 * hi[d] - from;
    if (from == to) {
      if (first > 0 || last < 0)
        return false;
      continue;
    }
    if (to < from)
      std::tie(first, last) = std::pair(-last, -first);
    int64_t length = std::abs(to - from);
    begin = std::max(begin, Fraction{first, length});
    end = std::min(end, Fraction{last, length});
  }
  return !(end < begin);
}

/// Calls f with each cell from lo to hi.
template <int Rank, class F>
void forEachCell(const piko::Cells<Rank> &lo, const piko::Cells<Rank> &hi,
                 F f) {
  piko::Cells<Rank> at = lo;
  while (true) {
    f(at);
    int d = 0;
    while (d < Rank && ++at[d] > hi[d]) {
      at[d] = lo[d];
      ++d;
    }
    if (d == Rank)
      return;
  }
}

/// Compares all lines whose cells are at most `around` outside of the domain
/// with what `touches` says of all bins.
template <class B>
void compareAllLines(const piko::Cells<B::rank> &domain, int around) {
  constexpr int rank = B::rank;
  using Cell = piko::Cells<rank>;
  LinePipe<B> pipe(domain);
  std::vector<Line<rank>> lines;
  Cell begin(-around), end = domain - 1 + around;
  forEachCell<rank>(begin, end, [&](const Cell &a) {
    forEachCell<rank>(begin, end, [&](const Cell &b) {
      lines.push_back({a, b, int(lines.size())});
    });
  });
  Cell size, count;
  for (int d = 0; d < rank; ++d) {
    size[d] = B::size[d] ? int(B::size[d]) : domain[d];
    count[d] = (domain[d] + size[d] - 1) / size[d];
  }
  std::vector<int> expected;
  for (const Line<rank> &line : lines) {
    int bin = 0;
    forEachCell<rank>(Cell(0), count - 1, [&](const Cell &place) {
      Cell lo = place * size;
      if (touches(line, lo, glm::min(lo + size, domain))) {
        expected.push_back(line.number);
        expected.push_back(bin);
      }
      ++bin;
    });
  }
  EXPECT_EQ(run(pipe, lines), expected);
}

TEST(Assign, LinesOfOneDimension) {
  compareAllLines<piko::Bins<3>>(glm::ivec1(10), 3);
}
TEST(Assign, LinesOfTwoDimensions) {
  compareAllLines<piko::Bins<2, 3>>({5, 4}, 2);
  compareAllLines<piko::Bins<0, 1>>({4, 4}, 1);
  compareAllLines<piko::Bins<0, 0>>({3, 2}, 1);
}
TEST(Assign, LinesOfThreeDimensions) {
  compareAllLines<piko::Bins<2, 1, 2>>({3, 3, 3}, 1);
}
TEST(Assign, LinesOfFourDimensions) {
  compareAllLines<piko::Bins<1, 2, 1, 1>>({2, 2, 2, 2}, 1);
}

TEST(Assign, LongLinesAreExact) {
  LinePipe<piko::Bins<4, 4>> pipe({8, 16}); // 2 by 4 bins
  auto bins = [&](glm::ivec2 a, glm::ivec2 b) {
    return run(pipe, std::vector<Line<2>>{{a, b, 0}});
  };
  // Through the corners of bins, and beside them.
  EXPECT_THAT(bins({INT32_MIN, INT32_MIN}, {INT32_MAX, INT32_MAX}),
              ElementsAre(0, 0, 0, 1, 0, 2, 0, 3, 0, 5));
  // At y = 8 for x = 0, and below it by 1 / (2^32 - 1) for each x.
  EXPECT_THAT(bins({INT32_MIN, 8}, {INT32_MAX, 7}),
              ElementsAre(0, 2, 0, 3, 0, 4));
  EXPECT_THAT(bins({INT32_MAX, 8}, {INT32_MIN, 7}),
              ElementsAre(0, 2, 0, 4, 0, 5));
}

struct ByPositions : piko::Stage<4, 4, 64, Box> {
  void assignBin(const Box &b) { assignToLine(b, b.lo, b.hi); }
  void process(const Box &) { trace.push_back(int(bin().index)); }
};
struct PositionsPipe : piko::Pipe<> {
  ByPositions byPositions;
  PositionsPipe() {
    source(byPositions);
    setDomain({8, 8}); // 2 by 2 bins
  }
};

TEST(Assign, LinesOfPositions) {
  PositionsPipe pipe;
  auto bins = [&](glm::vec2 a, glm::vec2 b) {
    return run(pipe, std::vector<Box>{{a, b}});
  };
  // From the middle of a position's cell to that of the other.
  EXPECT_THAT(bins({0.9f, 0.1f}, {7.1f, 0.9f}), ElementsAre(0, 1));
  EXPECT_THAT(bins({3.9f, 0}, {3.9f, 3}), ElementsAre(0));
  EXPECT_THAT(bins({0, 7}, {7, 0}), ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(bins({-9, 2}, {-0.1f, 2}), IsEmpty());
  EXPECT_THAT(bins({-1e20f, 2}, {1e20f, 2}), ElementsAre(0, 1));
  EXPECT_THAT(messageOf([&] { bins({0, 0}, {NAN, 1}); }),
              HasSubstr("expected positions of numbers, but got NaN"));
}
