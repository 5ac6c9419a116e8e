//===- cycles.piko.cpp - Cycles whose stages do next to nothing -----------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Walkers make `left` hops and leave their sum: what a hop takes is what the
// cycle costs. All pipelines have the same state and source.
//
//===----------------------------------------------------------------------===//
#include <piko.h>

struct Walker {
  int32_t index; ///< in the source
  int32_t left;  ///< hops
  int32_t x, y;
  float sum;
};

struct Pixel {
  float sum = 0;
};

struct State {
  piko::Buffer<float> sums; ///< one for each walker
  piko::Image<Pixel> image;
};

/// One hop to a place nearby that looks random.
inline Walker move(Walker w, glm::ivec2 domain) {
  w.x = (w.x + 5 + w.left % 7) % domain.x;
  w.y = (w.y + 3 + w.left % 5) % domain.y;
  w.sum = w.sum * 0.5f + float(w.left % 64);
  --w.left;
  return w;
}

struct Leave : piko::Stage<0, 0, 64, Walker>, piko::Uses<State> {
  void process(const Walker &w) { state().sums[w.index] = w.sum; }
};

/// A stage that feeds itself, in one bin.
struct Hop : piko::Stage<0, 0, 64, Walker, Walker, Walker> {
  void process(const Walker &w) {
    if (w.left > 0)
      emit(move(w, domain()), 0);
    else
      emit(w, 1);
  }
};

/// The same in bins.
struct BinnedHop : piko::Stage<8, 8, 64, Walker, Walker, Walker> {
  void assignBin(const Walker &w) {
    assignToBin(w, binFromPosition(glm::ivec2(w.x, w.y)));
  }
  void process(const Walker &w) {
    if (w.left > 0)
      emit(move(w, domain()), 0);
    else
      emit(w, 1);
  }
};

/// The same, and each hop is drawn: the order of hops can be seen.
struct DrawnHop : piko::Stage<8, 8, 64, Walker, Walker, Walker>,
                  piko::Uses<State> {
  void assignBin(const Walker &w) {
    assignToBin(w, binFromPosition(glm::ivec2(w.x, w.y)));
  }
  void process(const Walker &w) {
    update(state().image, glm::ivec2(w.x, w.y),
           [&](Pixel &p) { p.sum = p.sum * 0.5f + w.sum; });
    if (w.left > 0)
      emit(move(w, domain()), 0);
    else
      emit(w, 1);
  }
};

/// Half of a hop, for a cycle of two stages.
struct Turn : piko::Stage<32, 32, 64, Walker, Walker> {
  void assignBin(const Walker &w) {
    assignToBin(w, binFromPosition(glm::ivec2(w.x, w.y)));
  }
  void process(const Walker &w) {
    Walker turned = w;
    turned.sum = -turned.sum;
    emit(turned, 0);
  }
};

/// The same with the list of a bin: one hop in a round.
struct ListHop : piko::Stage<64, 64, 64, Walker, Walker, Walker> {
  void assignBin(const Walker &w) {
    assignToBin(w, binFromPosition(glm::ivec2(w.x, w.y)));
  }
  void process(const piko::List<Walker> &list) {
    for (const Walker &w : list)
      if (w.left > 0)
        emit(move(w, domain()), 0);
      else
        emit(w, 1);
  }
};

template <class H> struct Walk : piko::Pipe<State> {
  H hop;
  Leave leave;
  Walk() {
    source(hop);
    connect(hop, 0, hop);
    connect(hop, 1, leave);
  }
};

struct Self : Walk<Hop> {};
struct Binned : Walk<BinnedHop> {};
struct Drawn : Walk<DrawnHop> {};
struct Rounds : Walk<ListHop> {};

struct TwoStages : piko::Pipe<State> {
  BinnedHop hop;
  Turn turn;
  Leave leave;
  TwoStages() {
    source(hop);
    connect(hop, 0, turn);
    connect(turn, 0, hop);
    connect(hop, 1, leave);
  }
};
