// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Threads reduce to private copies: on any number of threads, and in lanes, the
// state is what atomic operations would have made of it.
// REQUIRES: all
// RUN: %compare_targets %s --cases %s --threads 1 2 4 7
// CASE: --pipe Nearest --count 30000 --domain 67 35
// CASE: --pipe Nearest --count 3 --domain 670 350
// CASE: --pipe Boxes --count 4000 --domain 67 35
// CASE: --pipe Boxes --count 3 --domain 670 350
// CASE: --pipe Counts --count 50000
// CASE: --pipe Lists --count 20000 --domain 67 35
// CASE: --pipe Rounds --count 5000 --domain 67 35
// RUN: piko-compare %s --pipe Nearest --count 30000 --domain 67 35 --without vectorize -O0 | FileCheck %s --check-prefix=SCALAR
// RUN: piko-compare %s --pipe Counts --count 30000 --without vectorize -O0 | FileCheck %s --check-prefix=SCALAR
// SCALAR: equal
// RUN: %if x86_64 %{ piko-compare %s --pipe Boxes --count 4000 --runs 1 --domain 67 35 --threads 1 2 12 --cpu x86-64 | FileCheck %s --check-prefix=SCALAR %}
// RUN: %if x86_64 %{ piko-compare %s --pipe Boxes --count 4000 --runs 1 --domain 67 35 --threads 2 --cpu x86-64-v3 | FileCheck %s --check-prefix=SCALAR %}
// RUN: pikoc %s --pipe Counts --explain | FileCheck %s --check-prefix=COUNTS
// COUNTS: piko-privatize
// COUNTS: changes private copies of 'counts'
// COUNTS: changes private copies of 'least'
// COUNTS: changes private copies of 'bits'
// RUN: not piko-compare %s --pipe Outside --count 4000 --runs 1 --threads 1 2 4 | FileCheck %s --check-prefix=OUTSIDE
#include "../Inputs/ports.h"

struct Key {
  uint64_t key = 0;
};
struct Row {
  unsigned counts[3][5];
  int step;
};
struct State {
  piko::Image<Key> nearest;
  piko::Image<Key> copy;
  piko::Buffer<Row> rows;
  piko::Buffer<unsigned> counts;
  piko::Buffer<int64_t> least;
  piko::Buffer<unsigned> bits;
};

/// A box of pixels, each with what is most there.
struct Draw : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const Point &p) {
    for (int y = p.y; y < p.y + p.tag % 4; ++y)
      for (int x = p.x; x < p.x + p.tag % 5; ++x)
        if (x >= 0 && y >= 0 && x < domain().x && y < domain().y)
          piko::atomicMax(state().nearest({x, y}).key,
                          uint64_t(p.tag * 77 % 1000) << 40 | unsigned(p.x));
  }
};
/// Reads what all threads have made of it.
struct Read : piko::Stage<8, 8, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) { assignToAll(p); }
  void schedule(piko::BinId) {
    everyBin();
    endStage<Draw>();
  }
  void process(const piko::List<Point> &) {
    parallelForPixels([&](glm::ivec2 p) {
      uint64_t key = state().nearest(p).key;
      update(state().copy, p, [&](Key &k) { k.key = key * 3 + 1; });
    });
  }
};
struct Nearest : piko::Pipe<State> {
  Draw draw;
  Read read;
  Nearest() {
    source(draw);
    source(read);
  }
};

/// Rows of pixels, some of them, in records of one number and of several.
struct Hits {
  unsigned count = 0;
};
struct Seen {
  int16_t kind = 7;
  int64_t first = 1 << 20;
  unsigned bits = 0;
  int marks[3] = {};
};
struct Pixels {
  piko::Image<Hits> hits;
  piko::Image<Seen> seen;
};
struct Box : piko::Stage<0, 0, 64, Point>, piko::Uses<Pixels> {
  void process(const Point &p) {
    glm::ivec2 lo(p.x - p.tag % 9, p.y - p.tag % 5);
    glm::ivec2 hi = glm::min(glm::ivec2(p.x, p.y) + p.tag % 40, domain() - 1);
    parallelForPixels(glm::max(lo, 0), hi, [&](glm::ivec2 q) {
      piko::atomicAdd(state().hits(q).count, unsigned(p.tag + q.x));
      if ((q.x + q.y) % 3 != p.tag % 3)
        piko::atomicMin(state().seen(q).first, int64_t(p.tag) - q.x);
      piko::atomicOr(state().seen(q).bits, 1u << ((p.tag + q.y) & 31));
      piko::atomicXor(state().seen(q).marks[p.tag & 1], q.x * p.tag);
    });
    for (int y = lo.y; y < hi.y; ++y)
      for (int x = lo.x - 20; x < hi.x; ++x) // some lanes are outside
        if (x >= 0 && y >= 0)
          piko::atomicAdd(state().hits({x, y}).count, 3u);
  }
};
struct Boxes : piko::Pipe<Pixels> {
  Box box;
  Boxes() { source(box); }
};

struct Count : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const Point &p) {
    Row &row = state().rows[(p.x & 31) + 1];
    piko::atomicAdd(row.counts[p.y % 3 & 1][p.tag & 3], 5u);
    piko::atomicAdd(state().counts[p.x & 63], unsigned(row.step + p.y));
    piko::atomicMin(state().least[p.tag & 15], int64_t(p.x) - 31 - p.y);
    piko::atomicXor(state().bits[p.x & 63], unsigned(p.tag));
  }
};
struct Counts : piko::Pipe<State> {
  Count count;
  Counts() { source(count); }
};

/// Calls that take lists, one of them for a bin without primitives.
struct Sum : piko::Stage<16, 16, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    assignToBin(p, binFromPosition(glm::vec2(p.x % 32, p.y % 32)));
  }
  void schedule(piko::BinId) { everyBin(); }
  void process(const piko::List<Point> &list) {
    for (int64_t i = 0; i < list.size(); ++i)
      piko::atomicAnd(state().bits[list[i].x & 63], ~unsigned(list[i].tag));
    parallelForPixels([&](glm::ivec2 p) {
      piko::atomicAdd(state().counts[(p.x + p.y) & 7], unsigned(p.x));
    });
  }
};
struct Lists : piko::Pipe<State> {
  Sum sum;
  Lists() { source(sum); }
};

/// A cycle: launches of few primitives and of many.
struct Hop : piko::Stage<0, 0, 64, Point, Point>, piko::Uses<State> {
  void process(const Point &p) {
    piko::atomicMax(state().counts[(p.x + p.tag) & 63], unsigned(p.y * p.tag));
    if (p.tag > 0) {
      Point next = p;
      next.tag = p.tag / 2;
      emit(next, 0);
    }
  }
};
struct Rounds : piko::Pipe<State> {
  Hop hop;
  Rounds() {
    source(hop);
    connect(hop, 0, hop);
  }
};

// OUTSIDE: expected: {{.*}}stage 'Past'{{.*}}: expected an index into 'counts' in [0, 64), but got 64
// OUTSIDE: got: stage 'stage'{{.*}}: expected an index into 'counts' in [0, 64), but got 64
struct Past : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const Point &p) {
    piko::atomicAdd(
        state().counts[p.x == 3 ? int(state().counts.size()) : p.x & 3], 1u);
  }
};
struct Outside : piko::Pipe<State> {
  Past stage;
  Outside() { source(stage); }
};
