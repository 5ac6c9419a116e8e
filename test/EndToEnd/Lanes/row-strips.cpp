// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Convex shapes in strips of columns, of which each has its own rows: the pixels
// of the reference executor, however a text says what is inside.
// RUN: %compare_targets %s --cases %s --runs 1
// CASE: --pipe Bits --domain 167 93 --count 400
// CASE: --pipe Returns --domain 167 93 --count 400
// CASE: --pipe All --domain 167 93 --count 400
// CASE: --pipe Least --domain 167 93 --count 400
// CASE: --pipe Negative --domain 167 93 --count 400
// CASE: --pipe Bounds --domain 167 93 --count 400
// CASE: --pipe Slab --domain 167 93 --count 400
// CASE: --pipe Corner --domain 167 93 --count 400
// CASE: --pipe Octagon --domain 167 93 --count 400
// CASE: --pipe Lit --domain 167 93 --count 400
// CASE: --pipe Neighbours --domain 167 93 --count 400
// CASE: --pipe Counted --domain 167 93 --count 400
// CASE: --pipe Either --domain 167 93 --count 400
//
// DEFINE: %{target} = pikoc %s --emit=target --cpu x86-64-v4 -o -
// RUN: %{target} --pipe Bits | FileCheck %s --check-prefix=STRIPS
// RUN: %{target} --pipe Returns | FileCheck %s --check-prefix=STRIPS
// RUN: %{target} --pipe All | FileCheck %s --check-prefix=STRIPS
// RUN: %{target} --pipe Least | FileCheck %s --check-prefix=STRIPS
// RUN: %{target} --pipe Negative | FileCheck %s --check-prefix=STRIPS
// RUN: %{target} --pipe Bounds | FileCheck %s --check-prefix=STRIPS
// RUN: %{target} --pipe Slab | FileCheck %s --check-prefix=STRIPS
// RUN: %{target} --pipe Octagon | FileCheck %s --check-prefix=STRIPS
// RUN: %{target} --pipe Lit | FileCheck %s --check-prefix=STRIPS
// STRIPS: arith.fptosi %{{.*}} : vector<8xf64> to vector<8xi32>
//
// Upright bounds leave rows full. What others read or count keeps its order, and
// a union is not convex.
// RUN: %{target} --pipe Corner | FileCheck %s --check-prefix=ROWS
// RUN: %{target} --pipe Neighbours | FileCheck %s --check-prefix=ROWS
// RUN: %{target} --pipe Counted | FileCheck %s --check-prefix=ROWS
// RUN: %{target} --pipe Either | FileCheck %s --check-prefix=ROWS
// ROWS-NOT: arith.fptosi %{{.*}} : {{.*}}f64{{.*}}i32
// REQUIRES: all, x86_64
#include <piko.h>

struct Prim {
  int a, b, c;
  unsigned kind;
};
struct Cell {
  int count = 0;
  float light = 0;
  int64_t last = 0;
};
struct Total {
  int count = 0;
};
struct State {
  piko::Image<Cell> seen;
  piko::Buffer<Total> totals;
};

struct Edge {
  int64_t x, y, first;
  int64_t at(glm::ivec2 p) const { return first + x * p.x + y * p.y; }
};

// Clockwise corners in 1/16 pixels: some large, some slivers, some beyond the
// screen.
struct Shape {
  Edge edges[3];
  glm::ivec2 lo, hi;

  explicit Shape(const Prim &p) {
    int size = 16 << (p.kind & 7), mask = size - 1;
    glm::ivec2 at((p.a >> 3) % 3000, (p.b >> 5) % 1700);
    glm::ivec2 q(p.a & mask, p.b & mask), r(p.c & mask, (p.kind >> 8) & mask);
    if (int64_t(q.x) * r.y - int64_t(q.y) * r.x < 0)
      std::swap(q, r);
    glm::ivec2 corner[3] = {at, at + q, at + r};
    for (int i = 0; i < 3; ++i) {
      glm::ivec2 u = corner[i], v = corner[(i + 1) % 3];
      int64_t dx = v.x - u.x, dy = v.y - u.y;
      edges[i] = {-dy * 16, dx * 16, dy * u.x - dx * u.y};
    }
    lo = glm::min(at, glm::min(at + q, at + r)) / 16;
    hi = glm::max(at, glm::max(at + q, at + r)) / 16 + 1;
  }
};

template <int Bin>
struct Stage : piko::Stage<Bin, Bin, 64, Prim>, piko::Uses<State> {
  void assignBin(const Prim &p) { this->assignToAll(p); }
  void schedule(piko::BinId) { this->specifyLanes(piko::Lanes::Iterations); }
  template <class Body> void forShape(const Shape &s, Body body) {
    this->parallelForPixels(s.lo, s.hi, body);
  }
  void count(glm::ivec2 p, const Prim &prim) {
    this->update(this->state().seen, p, [&](Cell &cell) {
      ++cell.count;
      cell.last = cell.last * 31 + prim.kind;
    });
  }
};

struct SignBits : Stage<0> {
  void process(const Prim &prim) {
    Shape s(prim);
    forShape(s, [&](glm::ivec2 p) {
      if ((s.edges[0].at(p) | s.edges[1].at(p) | s.edges[2].at(p)) >= 0)
        count(p, prim);
    });
  }
};

struct EarlyReturn : Stage<64> {
  void process(const Prim &prim) {
    Shape s(prim);
    forShape(s, [&](glm::ivec2 p) {
      if (s.edges[0].at(p) < 0)
        return;
      if (s.edges[1].at(p) < 0)
        return;
      if (s.edges[2].at(p) < 0)
        return;
      count(p, prim);
    });
  }
};

struct Conjunction : Stage<32> {
  void process(const Prim &prim) {
    Shape s(prim);
    forShape(s, [&](glm::ivec2 p) {
      if (s.edges[0].at(p) >= 0 && s.edges[1].at(p) >= 0 &&
          s.edges[2].at(p) >= 0)
        count(p, prim);
    });
  }
};

struct Minimum : Stage<32> {
  void process(const Prim &prim) {
    Shape s(prim);
    forShape(s, [&](glm::ivec2 p) {
      int64_t least = s.edges[0].at(p);
      for (int i = 1; i < 3; ++i)
        least = glm::min(least, s.edges[i].at(p));
      if (least > -1)
        count(p, prim);
    });
  }
};

// The other sign: inside where all are negative.
struct Turned : Stage<64> {
  void process(const Prim &prim) {
    Shape s(prim);
    for (Edge &e : s.edges)
      e = {-e.x, -e.y, -1 - e.first};
    forShape(s, [&](glm::ivec2 p) {
      if (glm::max(s.edges[0].at(p), s.edges[1].at(p)) < 0 &&
          s.edges[2].at(p) < 0)
        count(p, prim);
    });
  }
};

struct Interval : Stage<0> {
  void process(const Prim &prim) {
    Shape s(prim);
    int64_t width = (prim.c & 1023) * 64;
    forShape(s, [&](glm::ivec2 p) {
      int64_t e = s.edges[0].at(p);
      if (e >= -width && e <= width && s.edges[1].at(p) > s.edges[2].at(p))
        count(p, prim);
    });
  }
};

// One slope, and bounds of rows and columns.
struct Steps : Stage<64> {
  void process(const Prim &prim) {
    int64_t left = prim.a & 127, top = prim.b & 63, right = prim.c & 127;
    int64_t bottom = prim.kind & 63;
    parallelForPixels(glm::ivec2(0), domain(), [&](glm::ivec2 p) {
      if (p.x - left >= 0 && int64_t(p.y) - top >= 0 &&
          right - int64_t(p.x) >= 0 && bottom - int64_t(p.y) >= 0 &&
          p.x * 3 + p.y * 2 < 300)
        count(p, prim);
    });
  }
};

struct Upright : Stage<64> {
  void process(const Prim &prim) {
    int left = prim.a & 127, top = prim.b & 63;
    parallelForPixels(glm::ivec2(0), domain(), [&](glm::ivec2 p) {
      if (p.x >= left && p.y >= top)
        count(p, prim);
    });
  }
};

struct EightSides : Stage<64> {
  void process(const Prim &prim) {
    glm::ivec2 middle((prim.a >> 3) % 167, (prim.b >> 3) % 93);
    int64_t size = prim.c & 63, cut = size + size / 2;
    glm::ivec2 lo = middle - int(size), hi = middle + int(size);
    parallelForPixels(lo, hi, [&](glm::ivec2 p) {
      int64_t x = p.x - middle.x, y = p.y - middle.y;
      if (cut - x - y < 0 || cut + x - y < 0 || cut - x + y < 0 ||
          cut + x + y < 0)
        return;
      count(p, prim);
    });
  }
};

// A loop, an array and a condition that differs inside.
struct Shaded : Stage<32> {
  void process(const Prim &prim) {
    Shape s(prim);
    forShape(s, [&](glm::ivec2 p) {
      int64_t e0 = s.edges[0].at(p), e1 = s.edges[1].at(p);
      if ((e0 | e1 | s.edges[2].at(p)) < 0)
        return;
      float weights[2] = {float(e0), float(e1)};
      float sum = 0;
      for (int i = 0; i < 2; ++i)
        sum += weights[i] * float(prim.kind & 3);
      if (sum > 100)
        update(state().seen, p,
               [&](Cell &cell) { cell.light = cell.light * 0.5f + sum; });
    });
  }
};

// What a pixel reads was another one's a row before, or not.
struct Smear : Stage<0> {
  void process(const Prim &prim) {
    Shape s(prim);
    for (int y = glm::max(s.lo.y, 0); y < glm::min(s.hi.y, domain().y); ++y)
      for (int x = glm::max(s.lo.x, 0); x < glm::min(s.hi.x, domain().x); ++x)
        if ((s.edges[0].at({x, y}) | s.edges[1].at({x, y}) |
             s.edges[2].at({x, y})) >= 0 &&
            y > 0) {
          int above = state().seen({x, y - 1}).count;
          update(state().seen, {x, y},
                 [&](Cell &cell) { cell.count += above + 1; });
        }
  }
};

struct Sums : Stage<0> {
  void process(const Prim &prim) {
    Shape s(prim);
    forShape(s, [&](glm::ivec2 p) {
      if ((s.edges[0].at(p) | s.edges[1].at(p) | s.edges[2].at(p)) >= 0)
        piko::atomicAdd(state().totals[(p.x + p.y) & 15].count, 1);
    });
  }
};

struct Union : Stage<64> {
  void process(const Prim &prim) {
    Shape s(prim);
    forShape(s, [&](glm::ivec2 p) {
      if (s.edges[0].at(p) < 0 || s.edges[1].at(p) < 0)
        count(p, prim);
    });
  }
};

template <class S> struct Pipe : piko::Pipe<State> {
  S stage;
  Pipe() {
    source(stage);
    allocateForSource(state().totals, 0);
  }
};
struct Bits : Pipe<SignBits> {};
struct Returns : Pipe<EarlyReturn> {};
struct All : Pipe<Conjunction> {};
struct Least : Pipe<Minimum> {};
struct Negative : Pipe<Turned> {};
struct Bounds : Pipe<Interval> {};
struct Slab : Pipe<Steps> {};
struct Corner : Pipe<Upright> {};
struct Octagon : Pipe<EightSides> {};
struct Lit : Pipe<Shaded> {};
struct Neighbours : Pipe<Smear> {};
struct Counted : Pipe<Sums> {};
struct Either : Pipe<Union> {};
