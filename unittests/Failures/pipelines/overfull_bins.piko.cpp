// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Boxes in bins: how many cover each pixel. `FixedBins` has room for so many
// boxes in a bin, and `FourBins` for four bins of a box, which is what most
// need; both drop the rest. `GrownBins` leaves bins to the runtime, whose lists
// are exactly as long as they must be.
#include <piko.h>

struct Box {
  glm::i16vec2 lo, hi; // pixels of the domain, both included
};
struct Cell {
  uint32_t boxes = 0;
};
struct Nothing {};

constexpr int binSide = 16, boxesOfBin = 1024, binsOfBox = 4;

struct State {
  piko::Buffer<uint32_t> counts; // of each bin's boxes
  piko::Buffer<Box> members;     // boxesOfBin for each bin
  piko::Image<Cell> image;
};

// Calls f for the numbers of all bins that a box touches.
template <class F> void forBins(const Box &b, int binsAlong, F f) {
  for (int y = b.lo.y / binSide; y <= b.hi.y / binSide; ++y)
    for (int x = b.lo.x / binSide; x <= b.hi.x / binSide; ++x)
      f(y * binsAlong + x);
}

//===----------------------------------------------------------------------===//
// Bins with room for so many
//===----------------------------------------------------------------------===//

struct Append : piko::Stage<0, 0, 64, Box>, piko::Uses<State> {
  void schedule(piko::BinId) { specifyOrder(piko::Unordered); }
  void process(const Box &b) {
    forBins(b, domain().x / binSide, [&](int bin) {
      uint32_t place = piko::atomicAddFetch(state().counts[bin], 1u);
      if (place < boxesOfBin)
        state().members[bin * boxesOfBin + int(place)] = b;
    });
  }
};

struct DrawMembers : piko::Stage<binSide, binSide, 64, Nothing>,
                     piko::Uses<State> {
  void assignBin(const Nothing &n) { assignToAll(n); }
  void schedule(piko::BinId) {
    everyBin();
    endStage<Append>();
  }
  void process(const piko::List<Nothing> &) {
    int first = int(bin().index) * boxesOfBin;
    int count =
        int(glm::min(state().counts[bin().index], uint32_t(boxesOfBin)));
    parallelForPixels([&](glm::ivec2 p) {
      uint32_t boxes = 0;
      for (int i = 0; i < count; ++i) {
        Box b = state().members[first + i];
        boxes +=
            p.x >= b.lo.x && p.x <= b.hi.x && p.y >= b.lo.y && p.y <= b.hi.y;
      }
      update(state().image, p, [&](Cell &cell) { cell.boxes = boxes; });
    });
  }
};

struct FixedBins : piko::Pipe<State> {
  Append append;
  DrawMembers drawMembers;
  FixedBins() {
    source(append);
    source(drawMembers);
  }
};

//===----------------------------------------------------------------------===//
// Piko's bins
//===----------------------------------------------------------------------===//

template <bool Grown>
struct Draw : piko::Stage<binSide, binSide, 64, Box>, piko::Uses<State> {
  void assignBin(const Box &b) {
    if (Grown)
      return assignToBoundingBox(b, glm::ivec2(b.lo), glm::ivec2(b.hi));
    int room = binsOfBox;
    forBins(b, domain().x / binSide, [&](int bin) {
      if (room-- > 0)
        assignToBin(b, piko::BinId{bin});
    });
  }
  void process(const Box &b) {
    parallelForPixels(glm::ivec2(b.lo), glm::ivec2(b.hi), [&](glm::ivec2 p) {
      update(state().image, p, [](Cell &cell) { ++cell.boxes; });
    });
  }
};

template <bool Grown> struct Pipeline : piko::Pipe<State> {
  Draw<Grown> draw;
  Pipeline() { source(draw); }
};
struct FourBins : Pipeline<false> {};
struct GrownBins : Pipeline<true> {};
