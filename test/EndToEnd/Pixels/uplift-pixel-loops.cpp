// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Loops over pixels in plain C++ whose iterations are independent become
// piko.parallel_pixels, and do what the reference does.
// REQUIRES: all
// RUN: pikoc %s --remarks --emit=kernels -o %t.mlir 2>%t.remarks
// RUN: FileCheck %s --check-prefix=UPLIFTED --input-file=%t.mlir
// UPLIFTED-COUNT-8: piko.parallel_pixels
// UPLIFTED-NOT: piko.parallel_pixels
// RUN: not grep 'stays one that counts' %t.remarks
// RUN: %compare_targets %s --cases %s
// CASE: --domain 67 35 --count 200
// CASE: --domain 9 1 --count 40
// RUN: piko-compare %s --domain 67 35 --count 60 --without uplift-pixel-loops | FileCheck %s
// CHECK: equal
#include "../Inputs/boxes.h"

// What is computed once for a row, a local variable, and loops in the body.
struct Rows : Loops<0> {
  void process(const Seed &s) {
    Box b = clipped(s);
    for (int y = b.lo.y; y <= b.hi.y; ++y) {
      int row = y * s.width + 7;
      for (int x = b.lo.x; x <= b.hi.x; ++x) {
        int sum = 0;
        for (int k = 0; k < (x & 3); ++k)
          sum += row * k;
        mark(x, y, sum);
      }
    }
  }
};

struct Guarded : Loops<1> {
  void process(const Seed &s) {
    Box b = boxOf(s);
    for (int y = b.lo.y; y <= b.hi.y; ++y)
      for (int x = b.lo.x; x <= b.hi.x; ++x)
        if (binFromPosition(glm::ivec2(x, y)) == bin())
          mark(x, y, s.x);
  }
};

// A test of coordinates that leaves some pixels of the bin out as well.
struct Compared : Loops<2> {
  void process(const Seed &s) {
    Box b = boxOf(s);
    for (int y = b.lo.y; y <= b.hi.y; ++y)
      for (int x = b.lo.x; x <= b.hi.x; ++x) {
        if (x < binLo().x || y < binLo().y || x >= binHi().x ||
            y >= binHi().y || (x ^ y) % 3 == 1)
          continue;
        mark(x, y, s.y);
      }
  }
};

// Several bounds of one counter.
struct Bounds : Loops<3> {
  void process(const Seed &s) {
    Box b = boxOf(s);
    glm::ivec2 a = glm::max(b.lo, binLo());
    for (int y = a.y; y < binHi().y && y <= b.hi.y; ++y)
      for (int x = a.x; x <= b.hi.x && x < binHi().x; ++x)
        mark(x, y, s.width);
  }
};

// Atomics that give nothing, and a loop around.
struct Counts : Loops<4> {
  void process(const Seed &s) {
    Box b = clipped(s);
    for (int i = 0; i < (s.width & 3); ++i)
      for (int y = b.lo.y; y <= b.hi.y; ++y)
        for (int x = b.lo.x; x <= b.hi.x; ++x) {
          piko::atomicAdd(state().sums[(x + y) & 7 % state().sums.size()], i);
          mark(x, y, i);
        }
  }
};

// In the iterations of another loop.
struct Nested : Loops<5> {
  void process(const Seed &s) {
    Box b = clipped(s);
    parallelFor(3, [&](int i) {
      for (int y = b.lo.y; y <= b.hi.y; ++y)
        for (int x = b.lo.x; x <= b.hi.x; ++x)
          mark(x, y, i);
    });
  }
};

// Stores and reads of the own pixel.
struct Stores : piko::Stage<8, 8, 64, Seed>, piko::Uses<State> {
  void assignBin(const Seed &s) { assignToAll(s); }
  void schedule(piko::BinId) { everyBin(); }
  void process(const piko::List<Seed> &seeds) {
    for (int y = binLo().y; y < binHi().y; ++y)
      for (int x = binLo().x; x < binHi().x; ++x)
        state().copied.store({x, y}, int(seeds.size()) + x);
    for (int y = binLo().y; y < binHi().y; ++y)
      for (int x = binLo().x; x < binHi().x; ++x)
        if (state().copied({x, y}) % 3)
          state().copied.store({x, y}, state().copied({x, y}) + y);
  }
};

struct Everything : piko::Pipe<State> {
  Rows rows;
  Guarded guarded;
  Compared compared;
  Bounds bounds;
  Counts counts;
  Nested nested;
  Stores stores;
  Everything() {
    source(rows);
    source(guarded);
    source(compared);
    source(bounds);
    source(counts);
    source(nested);
    source(stores);
  }
};
