// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Signs of 64-bit functions of the pixel are those of the reference executor,
// whether they fit into 32 bits or overflow 64.
// RUN: %compare_targets %s --cases %s --runs 1
// CASE: --pipe Edges --domain 67 53 --count 600
// CASE: --pipe Between --domain 67 53 --count 600
// CASE: --pipe Carried --domain 67 53 --count 600
// CASE: --pipe Extremes --domain 67 53 --count 600
// CASE: --pipe Nearest --domain 67 53 --count 600
// CASE: --pipe Shared --domain 67 53 --count 60
// CASE: --pipe Weighted --domain 67 53 --count 600
// CASE: --pipe Rows --domain 67 53 --count 600
// CASE: --pipe Limits --domain 67 53 --count 600
//
// RUN: pikoc %s --pipe Edges --emit=llvmir --cpu x86-64-v4 -o - | FileCheck %s --check-prefix=NARROW
// RUN: pikoc %s --pipe Between --emit=llvmir --cpu x86-64-v4 -o - | FileCheck %s --check-prefix=NARROW
// RUN: pikoc %s --pipe Extremes --emit=llvmir --cpu x86-64-v4 -o - | FileCheck %s --check-prefix=NARROW
// RUN: pikoc %s --pipe Nearest --emit=llvmir --cpu x86-64-v4 -o - | FileCheck %s --check-prefix=NARROW
// RUN: pikoc %s --pipe Weighted --emit=llvmir --cpu x86-64-v4 -o - | FileCheck %s --check-prefix=VALUE
// RUN: pikoc %s --pipe Limits --emit=llvmir --cpu x86-64-v4 -o - | FileCheck %s --check-prefix=VALUE
// VALUE: sitofp <16 x i32> %{{.*}} to <16 x float>
// NARROW: icmp s{{lt|ge}} <16 x i32> %{{.*}}, zeroinitializer
// REQUIRES: all, x86_64
#include <piko.h>

#include <bit>

struct Prim {
  int a, b, c;
  unsigned kind;
};
struct Cell {
  int count = 0;
  int64_t last = 0;
};
struct State {
  piko::Image<Cell> seen;
};

// Numbers of all sizes, so that some functions fit and some do not.
inline int64_t spread(int x, unsigned kind) {
  int64_t large = int64_t(x) * 0x9e3779b97f4a7c15;
  return large >> (kind % 61);
}

struct Stage : piko::Stage<32, 32, 64, Prim>, piko::Uses<State> {
  void assignBin(const Prim &p) { assignToAll(p); }
  void schedule(piko::BinId) { specifyLanes(piko::Lanes::Iterations); }

  template <class Inside> void draw(const Prim &p, Inside inside) {
    glm::ivec2 lo(p.a & 15, p.b & 15), hi(p.b & 63, p.c & 63);
    parallelForPixels(lo, hi, [&](glm::ivec2 at) {
      if (inside(at))
        update(state().seen, at, [&](Cell &cell) {
          ++cell.count;
          cell.last = cell.last * 31 + p.kind;
        });
    });
  }
};

struct Edge : Stage {
  void process(const Prim &p) {
    int64_t dx = spread(p.a, p.kind), dy = spread(p.b, p.kind >> 6);
    int64_t first = spread(p.c, p.kind >> 12);
    draw(p, [&](glm::ivec2 at) {
      int64_t e = first + dx * 256 * at.x - dy * 256 * at.y;
      int64_t f = dy * 256 * at.x + (dx << 8) * at.y - first;
      return ((e - 1) | f) >= 0;
    });
  }
};

struct Range : Stage {
  void process(const Prim &p) {
    int64_t dx = spread(p.a, p.kind), dy = spread(p.b, p.kind >> 6);
    int64_t lo = spread(p.c, p.kind >> 12), hi = lo + spread(p.a, 40);
    draw(p, [&](glm::ivec2 at) {
      int64_t e = dx * at.x + dy * at.y;
      return e > lo && e <= hi + at.y;
    });
  }
};

struct Carry : Stage {
  void process(const Prim &p) {
    int64_t dx = spread(p.a, p.kind), dy = spread(p.b, p.kind >> 6);
    int64_t row = spread(p.c, p.kind >> 12);
    glm::ivec2 lo = binLo(), hi = glm::min(binHi(), domain());
    for (int y = lo.y; y < hi.y; ++y, row += dy) {
      int64_t e = row;
      for (int x = lo.x; x < hi.x; ++x, e += dx) {
        if (e < 0)
          continue;
        update(state().seen, {x, y}, [&](Cell &cell) { ++cell.count; });
      }
    }
  }
};

struct Extreme : Stage {
  void process(const Prim &p) {
    int64_t first = p.kind & 1   ? std::numeric_limits<int64_t>::min() + p.a
                    : p.kind & 2 ? std::numeric_limits<int64_t>::max() - p.a
                                 : int64_t(p.a) << 31;
    int64_t dx = p.kind & 4   ? std::numeric_limits<int64_t>::min()
                 : p.kind & 8 ? int64_t(1) << 31
                              : -1;
    draw(p, [&](glm::ivec2 at) { return first + dx * at.x + at.y < 0; });
  }
};

// The least of several, as of the planes of a convex region.
struct Near : Stage {
  void process(const Prim &p) {
    int64_t a = spread(p.a, p.kind), b = spread(p.b, p.kind >> 6),
            c = spread(p.c, p.kind >> 12);
    draw(p, [&](glm::ivec2 at) {
      int64_t e = a + b * at.x, f = b + c * at.y, g = c - a * at.x;
      return glm::min(glm::min(e, f), g) >= 0 || glm::max(e, g) < 0;
    });
  }
};

// Sums that each use the one before twice: what takes them apart looks at each
// once, or does not end.
struct Twice : Stage {
  static void add(int64_t &e, int64_t &f) {
    e += f;
    f += e;
  }
  static void addMore(int64_t &e, int64_t &f) {
    add(e, f), add(e, f), add(e, f), add(e, f);
  }
  void process(const Prim &p) {
    int64_t a = p.a, b = p.b;
    draw(p, [&](glm::ivec2 at) {
      int64_t e = a * at.x, f = b * at.y;
      addMore(e, f), addMore(e, f), addMore(e, f), addMore(e, f);
      return e < 0;
    });
  }
};

// An edge function, with a bias for its sign, and its value.
struct Weight : Stage {
  void process(const Prim &p) {
    int64_t dx = spread(p.a, p.kind), dy = spread(p.b, p.kind >> 6);
    int64_t first = spread(p.c, p.kind >> 12), bias = p.kind & 1;
    glm::ivec2 lo(p.a & 15, p.b & 15), hi(p.b & 63, p.c & 63);
    parallelForPixels(lo, hi, [&](glm::ivec2 at) {
      int64_t e = first + dx * 256 * at.x - dy * 256 * at.y;
      if (e - bias < 0)
        return;
      float weight = float(e);
      update(state().seen, at, [&](Cell &cell) {
        cell.last = glm::max(cell.last, int64_t(std::bit_cast<int>(weight)));
      });
    });
  }
};

// A sign that all pixels of a row have.
struct Row : Stage {
  void process(const Prim &p) {
    int64_t step = spread(p.b, p.kind >> 6), first = spread(p.c, p.kind >> 12);
    draw(p, [&](glm::ivec2 at) { return first + step * at.y >= 0; });
  }
};

// What is 2^31 or -2^31, or next to it, at some pixel of the box.
struct Limit : Stage {
  void process(const Prim &p) {
    glm::ivec2 lo(p.a & 15, p.b & 15), hi(32 + (p.b & 31), 32 + (p.c & 15));
    glm::ivec2 where = p.kind & 1 ? hi : lo;
    int64_t dx = (p.a >> 8) % 70000, dy = (p.b >> 8) % 70000;
    int64_t limit = p.kind & 2 ? -(int64_t(1) << 31) : int64_t(1) << 31;
    int64_t first =
        limit + int(p.kind >> 2 & 3) - 2 - dx * where.x - dy * where.y;
    parallelForPixels(lo, hi, [&](glm::ivec2 at) {
      float value = float(first + dx * at.x + dy * at.y);
      update(state().seen, at, [&](Cell &cell) {
        cell.last = cell.last * 31 + std::bit_cast<int>(value);
      });
    });
  }
};

template <class S> struct Pipe : piko::Pipe<State> {
  S stage;
  Pipe() { source(stage); }
};
struct Edges : Pipe<Edge> {};
struct Between : Pipe<Range> {};
struct Carried : Pipe<Carry> {};
struct Extremes : Pipe<Extreme> {};
struct Nearest : Pipe<Near> {};
struct Shared : Pipe<Twice> {};
struct Weighted : Pipe<Weight> {};
struct Rows : Pipe<Row> {};
struct Limits : Pipe<Limit> {};
