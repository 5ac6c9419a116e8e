// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The pixels of a bin in a tile: with partial bins at the edges of the domain and
// bins in which nothing is, in strips, after a wait for the bin, in a list that
// runs for every bin. What is in the images is the reference executor's, from run
// to run.
// REQUIRES: all
// RUN: pikoc %s --pipe Waits --emit=target --remarks -o %t.mlir 2>&1 | FileCheck %s --check-prefix=REMARK
// REMARK-DAG: remark: stage 'count' keeps a bin's pixels of 'image' in 5120 bytes, which it clears
// REMARK-DAG: remark: stage 'count' keeps a bin's pixels of 'last' in 1024 bytes, which it clears
// REMARK-DAG: remark: stage 'copy' has no tiles of 'copied'
// REMARK-DAG: note: threads share the primitives of a bin
//
// RUN: %compare_targets %s --cases %s
// CASE: --pipe Items --domain 67 35 --count 2000
// CASE: --pipe Items --domain 67 35 --count 5
// CASE: --pipe Items --domain 67 35 --count 0
// CASE: --pipe Items --domain 7 3 --count 50
// CASE: --pipe Items --domain 67 35 --count 200 --strip 7
// CASE: --pipe Waits --domain 67 35 --count 500
// CASE: --pipe Waits --domain 67 35 --count 5
// CASE: --pipe Every --domain 67 35 --count 5
// CASE: --pipe Batches --domain 35 20 --count 300
// RUN: piko-compare %s --pipe Items --domain 67 35 --count 200 --runs 1 --without form-tiles | FileCheck %s
// RUN: piko-compare %s --pipe Waits --domain 67 35 --count 500 --runs 1 --without form-tiles | FileCheck %s
// CHECK: equal
#include "../Inputs/ports.h"

struct Pixel {
  float value = 0.25f;
  int passes = 7;
  int16_t tags[2][3] = {{1, 2, 3}, {4, 5, 6}};
};
struct State {
  piko::Image<Pixel> image;
  piko::Image<int> last, copied;
};

inline void change(Pixel &pixel, const Point &p) {
  pixel.value = pixel.value * 0.5f + p.value;
  pixel.tags[p.tag & 1][pixel.passes % 3] = int16_t(p.tag);
  ++pixel.passes;
}

struct Count : piko::Stage<16, 16, 64, Point, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    if (isOnScreen(p, domain()))
      assignToBin(p, binFromPosition(glm::ivec2(p.x, p.y)));
  }
  void process(const Point &p) {
    update(state().image, glm::ivec2(p.x, p.y),
           [&](Pixel &pixel) { change(pixel, p); });
    emit(p);
  }
};

// Strips, as nothing waits.
struct Drop : piko::Stage<0, 0, 64, Point> {
  void process(const Point &) {}
};
struct Items : piko::Pipe<State> {
  Count count;
  Drop drop;
  Items() {
    source(count);
    connect(count, 0, drop);
  }
};

// Reads and stores pixels of the bin, after all updates of it.
template <bool Every>
struct Mark : piko::Stage<16, 16, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) { this->assignToPreviousBins(p); }
  void schedule(piko::BinId) {
    this->endBin();
    if constexpr (Every)
      this->everyBin();
  }
  void process(const piko::List<Point> &list) {
    int size = int(list.size());
    this->parallelForPixels([&](glm::ivec2 at) {
      this->update(state().last, at, [&](int &last) { last += size + 1; });
    });
  }
};
// Another kernel reads the image when all of it is there.
struct Copy : piko::Stage<8, 8, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) { assignToBin(p, piko::BinId{0}); }
  void schedule(piko::BinId) {
    endStage<Count>();
    everyBin();
  }
  void process(const piko::List<Point> &) {
    parallelForPixels([&](glm::ivec2 at) {
      state().copied.store(at, state().image(at).passes + state().last(at));
    });
  }
};
template <bool Every> struct Waiting : piko::Pipe<State> {
  Count count;
  Mark<Every> mark;
  Copy copy;
  Waiting() {
    source(count);
    source(copy);
    connect(count, 0, mark);
  }
};
struct Waits : Waiting<false> {};
struct Every : Waiting<true> {};

// A bin may have several calls, each of which would begin with a tile.
struct Batch : piko::Stage<16, 16, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    if (isOnScreen(p, domain()))
      assignToBin(p, binFromPosition(glm::ivec2(p.x, p.y)));
  }
  void schedule(piko::BinId bin) { batch(bin.index % 3 + 1); }
  void process(const piko::List<Point> &list) {
    for (const Point &p : list)
      update(state().image, glm::ivec2(p.x, p.y),
             [&](Pixel &pixel) { change(pixel, p); });
  }
};
struct Batches : piko::Pipe<State> {
  Batch batches;
  Batches() { source(batches); }
};
