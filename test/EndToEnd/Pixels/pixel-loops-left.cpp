// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Loops over pixels whose iterations depend on one another, or that are no loop
// over a box, stay as they are: a remark says why, and they do what the reference
// does.
// REQUIRES: all
// RUN: pikoc %s --remarks --emit=kernels -o %t.mlir 2>%t.remarks
// RUN: not grep parallel_pixels %t.mlir
// RUN: FileCheck %s --check-prefix=STAYS --implicit-check-not='stays one that counts' --input-file=%t.remarks
// RUN: %compare_targets %s --domain 67 35 --count 200 | FileCheck %s
// CHECK: equal
#include "../Inputs/boxes.h"

// Each reads what the one before it left.
struct Stores : piko::Stage<8, 8, 64, Seed>, piko::Uses<State> {
  void assignBin(const Seed &s) { assignToAll(s); }
  void schedule(piko::BinId) { everyBin(); }
  void process(const piko::List<Seed> &) {
    // STAYS: pixel-loops-left.cpp:[[#@LINE + 2]]:5: remark: this loop over pixels of stage 'stores' stays one that counts; parallelForPixels(lo, hi, f) has independent iterations
    // STAYS: [[#@LINE + 4]]:38: note: this reads 'copied', which iterations change, at a pixel that may be another's
    for (int y = binLo().y; y < binHi().y; ++y)
      for (int x = binLo().x; x < binHi().x; ++x) {
        int from = x > binLo().x ? x - 1 : x;
        state().copied.store({x, y}, state().copied({from, y}) * 3 + 1);
      }
  }
};

// A value that is carried along.
struct Carried : Loops<6> {
  void process(const Seed &s) {
    Box b = clipped(s);
    int row = s.width;
    // STAYS: [[#@LINE + 1]]:5: remark: this loop over pixels of stage 'carried' stays
    for (int y = b.lo.y; y <= b.hi.y; ++y, row += s.y) {
      // STAYS: [[#@LINE - 1]]:48: note: this value goes from one iteration to the next; compute it from the pixel
      int value = row;
      for (int x = b.lo.x; x <= b.hi.x; ++x, value += s.x)
        mark(x, y, value);
    }
  }
};

struct Neighbour : Loops<7> {
  void process(const Seed &s) {
    Box b = clipped(s);
    // STAYS: [[#@LINE + 1]]:5: remark: this loop over pixels of stage 'neighbour' stays
    for (int y = b.lo.y; y <= b.hi.y; ++y)
      for (int x = b.lo.x; x <= b.hi.x; ++x)
        // STAYS: note: this changes 'image' at an element that another iteration may change
        mark(b.lo.x, y, x);
  }
};

struct Down : Loops<8> {
  void process(const Seed &s) {
    Box b = clipped(s);
    // STAYS: [[#@LINE + 2]]:5: remark: this loop over pixels of stage 'down' stays
    // STAYS: [[#@LINE + 2]]:{{.*}}: note: it counts down
    for (int y = b.lo.y; y <= b.hi.y; ++y)
      for (int x = b.hi.x; x >= b.lo.x; --x)
        mark(x, y, x);
  }
};

// y in x.
struct Columns : Loops<9> {
  void process(const Seed &s) {
    Box b = clipped(s);
    // STAYS: [[#@LINE + 1]]:5: remark: this loop over pixels of stage 'columns' stays
    for (int x = b.lo.x; x <= b.hi.x; ++x)
      for (int y = b.lo.y; y <= b.hi.y; ++y)
        // STAYS: [[#@LINE - 2]]:{{.*}}: note: x is not what its innermost loop counts
        mark(x, y, x);
  }
};

struct Triangle : Loops<10> {
  void process(const Seed &s) {
    Box b = clipped(s);
    // STAYS: [[#@LINE + 2]]:5: remark: this loop over pixels of stage 'triangle' stays
    // STAYS: [[#@LINE + 2]]:{{.*}}: note: this bound differs from row to row
    for (int y = b.lo.y; y <= b.hi.y; ++y)
      for (int x = b.lo.x; x <= b.hi.x - (y & 3); ++x)
        mark(x, y, x);
  }
};

// What is left early.
struct Leaves : Loops<11> {
  void process(const Seed &s) {
    Box b = clipped(s);
    // STAYS: [[#@LINE + 2]]:5: remark: this loop over pixels of stage 'leaves' stays
    // STAYS: note: not all of its loops end by a test of their counter alone
    for (int y = b.lo.y; y <= b.hi.y; ++y)
      for (int x = b.lo.x; x <= b.hi.x; ++x) {
        mark(x, y, x);
        if ((x * 7 + y + s.x) % 11 == 0)
          break;
      }
  }
};

// Every second pixel.
struct Step : Loops<12> {
  void process(const Seed &s) {
    Box b = clipped(s);
    // STAYS: [[#@LINE + 2]]:5: remark: this loop over pixels of stage 'step' stays
    // STAYS: [[#@LINE + 2]]:{{.*}}: note: it leaves pixels out
    for (int y = b.lo.y; y <= b.hi.y; ++y)
      for (int x = b.lo.x; x <= b.hi.x; x += 2)
        mark(x, y, x);
  }
};

// An array that is the process's own.
struct Arrays : Loops<13> {
  void process(const Seed &s) {
    Box b = clipped(s);
    int last[4] = {};
    // STAYS: [[#@LINE + 1]]:5: remark: this loop over pixels of stage 'arrays' stays
    for (int y = b.lo.y; y <= b.hi.y; ++y)
      for (int x = b.lo.x; x <= b.hi.x; ++x) {
        // STAYS: note: this uses an array that iterations share and store to
        mark(x, y, last[y & 3]);
        last[(x + s.x) & 3] = x;
      }
  }
};

// What a row does by itself.
struct Spine : Loops<14> {
  void process(const Seed &s) {
    Box b = clipped(s);
    // STAYS: [[#@LINE + 1]]:5: remark: this loop over pixels of stage 'spine' stays
    for (int y = b.lo.y; y <= b.hi.y; ++y) {
      // STAYS: [[#@LINE + 1]]:{{.*}}: note: this is done once for a row, and not for a pixel
      piko::atomicAdd(state().sums[0], y);
      for (int x = b.lo.x; x <= b.hi.x; ++x)
        mark(x, y, x);
    }
  }
};

// Iterations that meet inside.
struct Meets : Loops<15> {
  void process(const Seed &s) {
    Box b = clipped(s);
    int values[4] = {};
    parallelFor(4, [&](int i) {
      // STAYS: [[#@LINE + 1]]:7: remark: this loop over pixels of stage 'meets' stays
      for (int y = b.lo.y; y <= b.hi.y; ++y)
        for (int x = b.lo.x; x <= b.hi.x; ++x) {
          // STAYS: [[#@LINE + 1]]:11: note: iterations of another loop meet here
          sync();
          values[i] = x + i;
          sync();
          mark(x, y, values[3 - i]);
        }
    });
  }
};

// A counter that is seen after its loop.
struct Behind : Loops<16> {
  void process(const Seed &s) {
    Box b = clipped(s);
    int x = b.lo.x, y = b.lo.y;
    // STAYS: [[#@LINE + 2]]:5: remark: this loop over pixels of stage 'after' stays
    // STAYS: note: this value goes from one iteration to the next
    for (; y <= b.hi.y; ++y)
      for (x = b.lo.x; x <= b.hi.x; ++x)
        mark(x, y, x);
    piko::atomicAdd(state().sums[0], x + y);
  }
};

// Work outside the bin.
struct Outside : Loops<17> {
  void process(const Seed &s) {
    Box b = boxOf(s);
    // STAYS: [[#@LINE + 2]]:5: remark: this loop over pixels of stage 'outside' stays
    // STAYS: note: its pixels are not known to lie in the bin
    for (int y = b.lo.y; y <= b.hi.y; ++y)
      for (int x = b.lo.x; x <= b.hi.x; ++x)
        if (binFromPosition(glm::ivec2(x, y)) == bin())
          mark(x, y, s.x);
        else
          piko::atomicAdd(state().sums[0], 1);
  }
};

struct Everything : piko::Pipe<State> {
  Stores stores;
  Carried carried;
  Neighbour neighbour;
  Down down;
  Columns columns;
  Triangle triangle;
  Leaves leaves;
  Step step;
  Arrays arrays;
  Spine spine;
  Meets meets;
  Behind after;
  Outside outside;
  Everything() {
    source(stores);
    source(carried);
    source(neighbour);
    source(down);
    source(columns);
    source(triangle);
    source(leaves);
    source(step);
    source(arrays);
    source(spine);
    source(meets);
    source(after);
    source(outside);
  }
};
