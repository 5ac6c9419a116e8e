// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Updates whose pixels follow from data: threads of a block share them, grouped
// by pixel, and those of a pixel keep the order of iterations.
// RUN: %compare_targets %s --cases %s --runs 1
// CASE: --pipe Splats --count 700 --domain 40 30
// CASE: --pipe Guarded --count 700 --domain 40 30
// CASE: --pipe Passed --count 700 --domain 40 30
// CASE: --pipe TwoImages --count 700 --domain 40 30
// CASE: --pipe Sorted --count 700 --domain 40 30
// CASE: --pipe Rounds --count 700 --domain 40 30
// CASE: --pipe Either --count 700 --domain 40 30
// CASE: --pipe Twice --count 700 --domain 40 30
// CASE: --pipe Cases --count 700 --domain 40 30
// CASE: --pipe Strokes --count 700 --domain 40 30
// CASE: --pipe Tables --count 700 --domain 40 30
// CASE: --pipe Scattered --count 300 --domain 40 30
// CASE: --pipe Looped --count 300 --domain 40 30
// CASE: --pipe Line --count 700 --domain 300
// CASE: --pipe Voxels --count 700 --domain 9 8 7
// RUN: %if all %{ env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_SEED=5 piko-compare %s --cases %s --gpu-threads 8 --target cuda --runs 1 --threads 2 | FileCheck %s %}
// RUN: piko-compare %s --pipe Passed --count 700 --domain 40 30 --gpu-threads 128 --target gpu-on-cpu --gpu-seed 3 --runs 1 --threads 2 | FileCheck %s
// CHECK: equal
// What is outside of the bin is the error that it is on a CPU.
// RUN: not piko-compare %s --pipe Outside --count 90 --domain 40 30 --runs 1 --threads 2 | FileCheck %s --check-prefix=OUTSIDE
// RUN: not piko-compare %s --pipe Outside --count 90 --domain 40 30 --runs 1 --threads 2 --target gpu-on-cpu --gpu-threads 16 | FileCheck %s --check-prefix=OUTSIDE
// OUTSIDE: got: stage 'stage', bin 0: expected an update inside the stage's own bin, but got pixel (40, 2)
// RUN: pikoc %s --pipe Splats,Guarded,Passed,TwoImages,Sorted,Rounds,Tables,Scattered,Line,Voxels --emit=gpu --remarks -o /dev/null 2>&1 | FileCheck %s --check-prefix=SHARED
// SHARED-NOT: one thread does
// SHARED: remark: stage 'stage': lanes are given
// SHARED-NOT: one thread does
// RUN: pikoc %s --pipe Twice --emit=gpu --remarks -o /dev/null 2>&1 | FileCheck %s --check-prefix=TWICE
// TWICE: remark: one thread does what iterations do that may update a pixel of another one: an iteration has two updates of one image; one update would be shared
// RUN: pikoc %s --pipe Strokes --emit=gpu --remarks -o /dev/null 2>&1 | FileCheck %s --check-prefix=STROKES
// STROKES: remark: one thread does what iterations do that may update a pixel of another one: an iteration updates pixels in a loop of its own; a parallel loop over all of its pixels would be shared
// RUN: pikoc %s --pipe Cases --emit=gpu --remarks -o /dev/null 2>&1 | FileCheck %s --check-prefix=CASES
// CASES: remark: one thread does what iterations do that may update a pixel of another one: the update is in a switch; in branches of if it would be shared
// A barrier that not all come to is named as the text has it, and no group runs after.
// RUN: not piko-compare %s --pipe Parted --count 90 --domain 40 30 --runs 1 --threads 2 --target gpu-on-cpu --gpu-threads 16 | FileCheck %s --check-prefix=PARTED
// PARTED: got: stage 'stage', bin 0: expected every iteration of parallelFor to call sync() as often as iteration 0, but iteration {{[0-9]+}} does not
#include <piko.h>

struct Point {
  int x, y;
  float value;
  int tag;
};
struct Cell {
  float sum = 0.25f;
  int last = -1;
};
struct State {
  piko::Image<Cell> image, other;
  piko::Buffer<int> out;
};

struct Body : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  glm::ivec2 pixelOf(const Point &p, int i) const {
    int64_t w = domain().x, h = domain().y;
    return {(p.x * 7 + i % 3) % w, (p.y + p.tag % 2) % h};
  }
  static void mix(Cell &c, float value, int tag) {
    c.sum = c.sum * 0.75f + value;
    c.last = c.last * 3 + tag;
  }
};

struct Splat : Body {
  void process(const piko::List<Point> &list) {
    parallelFor(list.size(), [&](int i) {
      const Point &p = list[i];
      update(state().image, pixelOf(p, i),
             [&](Cell &c) { mix(c, p.value, p.tag); });
    });
  }
};

// An iteration may have no update; what it does after one is its own.
struct Guard : Body {
  void process(const piko::List<Point> &list) {
    parallelFor(list.size(), [&](int i) {
      const Point &p = list[i];
      if (p.tag % 3 == 0)
        return;
      float scale = p.value * 2;
      if (p.x > p.y) {
        float weight = scale + float(i);
        if (p.tag % 7 != 1)
          update(state().image, pixelOf(p, i),
                 [&](Cell &c) { mix(c, weight, i); });
        piko::atomicAdd(state().out[0], int(weight) % 16);
      } else {
        piko::atomicAdd(state().out[1], p.tag % 16);
      }
    });
  }
};

// What an update finds goes on.
struct Pass : piko::Stage<16, 16, 64, Point, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x - 5, p.y - 5), glm::ivec2(p.x, p.y));
  }
  void process(const piko::List<Point> &list) {
    parallelFor(list.size(), [&](int i) {
      Point p = list[i];
      glm::ivec2 at = glm::clamp(glm::ivec2(p.x - i % 6, p.y - p.tag % 6),
                                 binLo(), binHi() - 1);
      bool first = false;
      float before = 0;
      if (p.tag % 5)
        update(state().image, at, [&](Cell &c) {
          first = c.last < 0;
          before = c.sum;
          c.last = p.tag & 1023;
          c.sum = before * 0.5f + p.value;
        });
      p.value = before;
      if (first || p.tag % 4 == 0)
        emit(p);
    });
  }
};
struct Keep : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const Point &p) {
    update(state().other, glm::ivec2(p.x % domain().x, p.y % domain().y),
           [&](Cell &c) {
             c.sum = c.sum * 0.5f + p.value;
             c.last = c.last * 5 + p.tag;
           });
  }
};

struct Two : Body {
  void process(const piko::List<Point> &list) {
    parallelFor(list.size(), [&](int i) {
      const Point &p = list[i];
      update(state().image, pixelOf(p, i),
             [&](Cell &c) { mix(c, p.value, p.tag); });
      if (i % 2)
        update(state().other, pixelOf(p, 2),
               [&](Cell &c) { mix(c, p.value, i); });
    });
  }
};

struct Sort : Body {
  void process(const piko::List<Point> &list) {
    parallelFor(list.size(), [&](int i) {
      int which = sort(list[i].value);
      const Point &p = list[which];
      float sum = scan(p.value, [](float a, float b) { return a + b; });
      update(state().image, pixelOf(p, which),
             [&](Cell &c) { mix(c, p.value + sum, i); });
    });
  }
};

// Updates in rounds that all iterations take part in.
struct Round : Body {
  void process(const piko::List<Point> &list) {
    parallelFor(list.size(), [&](int i) {
      const Point &p = list[i];
      for (int k = 0; k < 3; ++k) {
        int most =
            reduce(p.tag ^ k, [](int a, int b) { return a > b ? a : b; });
        if (most > p.tag + 40)
          update(state().image, pixelOf(p, i + k),
                 [&](Cell &c) { mix(c, p.value, k); });
      }
    });
  }
};

struct OneOrOther : Body {
  void process(const piko::List<Point> &list) {
    parallelFor(list.size(), [&](int i) {
      const Point &p = list[i];
      if (p.tag % 2)
        update(state().image, pixelOf(p, i),
               [&](Cell &c) { mix(c, p.value, i); });
      else
        update(state().image, pixelOf(p, 1), [&](Cell &c) { c.sum -= 1; });
    });
  }
};

struct TwoOfOne : Body {
  void process(const piko::List<Point> &list) {
    parallelFor(list.size(), [&](int i) {
      const Point &p = list[i];
      update(state().image, pixelOf(p, i),
             [&](Cell &c) { mix(c, p.value, i); });
      update(state().image, pixelOf(p, 1), [&](Cell &c) { c.sum *= 0.5f; });
    });
  }
};

struct Stroke : Body {
  void process(const piko::List<Point> &list) {
    parallelFor(list.size(), [&](int i) {
      const Point &p = list[i];
      for (int k = 0; k < p.tag % 5; ++k)
        update(state().image, pixelOf(p, i + k),
               [&](Cell &c) { mix(c, p.value, k); });
    });
  }
};

struct Case : Body {
  void process(const piko::List<Point> &list) {
    parallelFor(list.size(), [&](int i) {
      const Point &p = list[i];
      switch (p.tag % 5) {
      case 1:
        update(state().image, pixelOf(p, i),
               [&](Cell &c) { mix(c, p.value, i); });
        break;
      case 2:
        piko::atomicAdd(state().out[3], 1);
        break;
      case 3:
        piko::atomicAdd(state().out[3], p.tag % 8);
      }
    });
  }
};

// An update, and then a barrier that only some come to.
struct Part : Body {
  void process(const piko::List<Point> &list) {
    int n = int(list.size());
    parallelFor(n, [&](int i) {
      if (i % 16 < 7) {
        update(state().image, pixelOf(list[i], i),
               [&](Cell &c) { mix(c, 1, i); });
        if (n > 2)
          sync();
        update(state().other, pixelOf(list[i], 1),
               [&](Cell &c) { mix(c, 2, i); });
      }
    });
  }
};

// An array of the iteration, before and after.
struct Table : Body {
  void process(const piko::List<Point> &list) {
    parallelFor(list.size(), [&](int i) {
      const Point &p = list[i];
      int table[4] = {p.tag, i, p.x, p.y};
      if (p.tag % 3) {
        table[p.tag % 4] += 2;
        int sum = table[i % 4];
        update(state().image, pixelOf(p, i),
               [&](Cell &c) { mix(c, p.value, sum); });
        table[1] = sum;
      }
      piko::atomicAdd(state().out[2], table[p.tag % 4] & 7);
    });
  }
};

// Iterations of one primitive, whose number is its own.
struct Scatter : Body {
  void process(const Point &p) {
    parallelFor(p.tag % 40, [&](int i) {
      int w = domain().x, h = domain().y;
      glm::ivec2 at((p.x + i * i) % w, (p.y + i / 3) % h);
      update(state().image, at, [&](Cell &c) { mix(c, p.value, i); });
    });
  }
};

// Branches inside of the update, and a loop.
struct Loop : Body {
  void process(const piko::List<Point> &list) {
    parallelFor(list.size(), [&](int i) {
      const Point &p = list[i];
      update(state().image, pixelOf(p, i), [&](Cell &c) {
        for (int k = 0; k < p.tag % 6; ++k)
          if (c.last % 3 != k)
            mix(c, p.value, k);
      });
    });
  }
};

struct Beyond : Body {
  void process(const piko::List<Point> &list) {
    parallelFor(list.size(), [&](int i) {
      int n = list.size();
      glm::ivec2 at = i % 7 == 3 ? glm::ivec2(40, i) : glm::ivec2(n - i, 2);
      update(state().image, at % 41, [&](Cell &c) { mix(c, 1, i); });
    });
  }
};

template <class S> struct Alone : piko::Pipe<State> {
  S stage;
  Alone() { source(stage); }
};
struct Splats : Alone<Splat> {};
struct Guarded : Alone<Guard> {};
struct TwoImages : Alone<Two> {};
struct Sorted : Alone<Sort> {};
struct Rounds : Alone<Round> {};
struct Either : Alone<OneOrOther> {};
struct Twice : Alone<TwoOfOne> {};
struct Strokes : Alone<Stroke> {};
struct Cases : Alone<Case> {};
struct Parted : Alone<Part> {};
struct Tables : Alone<Table> {};
struct Scattered : Alone<Scatter> {};
struct Looped : Alone<Loop> {};
struct Outside : Alone<Beyond> {};
struct Passed : piko::Pipe<State> {
  Pass pass;
  Keep keep;
  Passed() {
    source(pass);
    connect(pass, 0, keep);
  }
};

// Domains of one dimension and of three.
struct LineState {
  piko::Image<Cell, 1> image;
};
struct Sample : piko::BasicStage<piko::Bins<64>, 64, Point>,
                piko::Uses<LineState> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec1(p.x), glm::ivec1(p.x + 70));
  }
  void process(const piko::List<Point> &list) {
    parallelFor(list.size(), [&](int i) {
      const Point &p = list[i];
      glm::ivec1 at = binLo() + (p.tag + i % 5) % (binHi() - binLo());
      update(state().image, at, [&](Cell &c) {
        c.sum = c.sum * 0.5f + p.value;
        c.last = c.last * 3 + i;
      });
    });
  }
};
struct Line : piko::Pipe<LineState> {
  Sample stage;
  Line() { source(stage); }
};

struct VoxelState {
  piko::Image<Cell, 3> image;
};
struct Fill : piko::BasicStage<piko::Bins<4, 4, 4>, 64, Point>,
              piko::Uses<VoxelState> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec3(p.x % 8, p.y % 7, 0),
                        glm::ivec3(p.x % 8 + 2, p.y % 7 + 3, p.tag % 7));
  }
  void process(const piko::List<Point> &list) {
    parallelFor(list.size(), [&](int i) {
      const Point &p = list[i];
      glm::ivec3 size = binHi() - binLo();
      glm::ivec3 at = binLo() + glm::ivec3(p.x, p.y, i % 3) % size;
      if (p.tag % 4)
        update(state().image, at, [&](Cell &c) {
          c.sum = c.sum * 0.5f + p.value;
          c.last = c.last * 3 + i;
        });
    });
  }
};
struct Voxels : piko::Pipe<VoxelState> {
  Fill stage;
  Voxels() { source(stage); }
};
