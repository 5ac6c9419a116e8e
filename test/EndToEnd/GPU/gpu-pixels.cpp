// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Styles in which a stage updates the pixels of a primitive. On a GPU, threads
// share the pixels of many primitives at once, or those of one after the other,
// which a remark says; always in lineage order.
// REQUIRES: all
// RUN: pikoc %s --pipe Boxes,Points,Rows,Steps,Discs,Unclipped,Rare --target gpu-on-cpu --remarks -O0 -o /dev/null 2>&1 | FileCheck %s --check-prefix=MANY --allow-empty
// MANY-NOT: the threads of a block
// RUN: pikoc %s --pipe Spans --target gpu-on-cpu --remarks -O0 -o /dev/null 2>&1 | FileCheck %s --check-prefix=SPANS
// SPANS: remark: the threads of a block take one primitive after the other: a row's bounds depend on the row
// RUN: pikoc %s --pipe Frames --target gpu-on-cpu --remarks -O0 -o /dev/null 2>&1 | FileCheck %s --check-prefix=FRAMES
// FRAMES: remark: the threads of a block take one primitive after the other: its pixel is not what its loops count to
// RUN: pikoc %s --pipe Carried --target gpu-on-cpu --remarks -O0 -o /dev/null 2>&1 | FileCheck %s --check-prefix=CARRIED
// CARRIED: remark: the threads of a block take one primitive after the other: a value goes from one pixel to the next; compute it from the pixel
// RUN: pikoc %s --pipe Tables,Columns --target gpu-on-cpu --remarks -O0 -o /dev/null 2>&1 | FileCheck %s --check-prefix=TABLES
// TABLES-COUNT-2: remark: the threads of a block take one primitive after the other: its pixel is not what its loops count to
// RUN: pikoc %s --pipe Diagonals --target gpu-on-cpu --remarks -O0 -o /dev/null 2>&1 | FileCheck %s --check-prefix=DIAGONALS
// DIAGONALS: remark: the threads of a block take one primitive after the other: a loop counts to two coordinates
//
// RUN: %compare_targets %s --cases %s --domain 67 35 --count 900 --runs 1
// CASE: --pipe Boxes
// RUN: piko-compare %s --pipe Boxes --domain 67 35 --count 900 --target gpu-on-cpu --gpu-threads 8 --gpu-seed 7 --runs 1 | FileCheck %s
// CASE: --pipe Points
// RUN: piko-compare %s --pipe Points --domain 67 35 --count 900 --target gpu-on-cpu --gpu-threads 128 --runs 1 | FileCheck %s
// CASE: --pipe Rows
// CASE: --pipe Steps
// CASE: --pipe Discs
// CASE: --pipe Unclipped
// CASE: --pipe Rare
// RUN: piko-compare %s --pipe Rare --domain 67 35 --count 900 --target gpu-on-cpu --gpu-threads 2 --runs 1 | FileCheck %s
// CASE: --pipe Spans
// CASE: --pipe Frames
// CASE: --pipe Carried
// CASE: --pipe Tables
// CASE: --pipe TablesOfPoints
// CASE: --pipe Diagonals
// CASE: --pipe Columns
// CHECK: equal
#include <piko.h>

struct Shape {
  int x, y, width, height;
  float value;
};
struct Pixel {
  float value = 0;
  int count = 0;
};
struct State {
  piko::Image<Pixel> image;
  piko::Buffer<float> weights;
};

// Numbers of any size, as the primitives of piko-compare have them.
struct Area {
  glm::ivec2 lo, hi; // hi is not in it
};
inline Area areaOf(const Shape &s) {
  glm::ivec2 lo = {s.x & 63, s.y & 31};
  return {lo, lo + glm::ivec2(s.width & 7, s.height & 7)};
}

// The order of calls shows.
inline void blend(Pixel &p, float value) {
  p.value = p.value * 0.5f + value;
  ++p.count;
}

struct Drawing : piko::Stage<8, 8, 32, Shape>, piko::Uses<State> {
  void assignBin(const Shape &s) {
    Area area = areaOf(s);
    this->assignToBoundingBox(s, area.lo, area.hi - 1);
  }
  Area clipped(const Shape &s) {
    Area area = areaOf(s);
    return {glm::max(area.lo, this->binLo()), glm::min(area.hi, this->binHi())};
  }
};

// A box, all of it.
struct Box : Drawing {
  void process(const Shape &s) {
    Area a = clipped(s);
    this->parallelForPixels(a.lo, a.hi - 1, [&](glm::ivec2 p) {
      this->update(this->state().image, p,
                   [&](Pixel &o) { blend(o, s.value); });
    });
  }
};

// One pixel, of two updates, the second of which depends on the first.
struct Point : piko::Stage<8, 8, 64, Shape>, piko::Uses<State> {
  static glm::ivec2 at(const Shape &s) { return {s.x & 63, s.y & 31}; }
  void assignBin(const Shape &s) {
    this->assignToBin(s, this->binFromPosition(at(s)));
  }
  void process(const Shape &s) {
    bool passed = false;
    this->update(this->state().image, at(s), [&](Pixel &o) {
      passed = o.value < s.value;
      ++o.count;
    });
    if (passed)
      this->update(this->state().image, at(s),
                   [&](Pixel &o) { o.value = s.value; });
  }
};

// A loop along one dimension.
struct Row : Drawing {
  void process(const Shape &s) {
    Area a = clipped(s);
    if (areaOf(s).lo.y < a.lo.y || a.lo.y >= a.hi.y)
      return;
    for (int x = a.lo.x; x < a.hi.x; ++x)
      this->update(this->state().image, {x, a.lo.y},
                   [&](Pixel &o) { blend(o, s.value + x); });
  }
};

// Integers that are stepped from pixel to pixel, and a row that is left out.
struct Step : Drawing {
  void process(const Shape &s) {
    Area a = clipped(s);
    int64_t row = int64_t(s.width) * 5 - s.height;
    for (int y = a.lo.y; y < a.hi.y; ++y, row -= s.height & 15) {
      if (row < 0)
        continue;
      int64_t edge = row;
      for (int x = a.lo.x; x < a.hi.x; ++x, edge += (s.width & 31) - 16)
        if (edge >= 0)
          this->update(this->state().image, {x, y},
                       [&](Pixel &o) { blend(o, s.value + float(edge)); });
    }
  }
};

// Nested tests, and a loop in the work.
struct Disc : Drawing {
  void process(const Shape &s) {
    Area a = clipped(s);
    glm::ivec2 centre = (areaOf(s).lo + areaOf(s).hi) / 2;
    for (int x = a.lo.x; x < a.hi.x; ++x)
      for (int y = a.lo.y; y < a.hi.y; ++y) {
        glm::ivec2 d = glm::ivec2(x, y) - centre;
        int distance = d.x * d.x + d.y * d.y;
        if (distance > 9)
          continue;
        if ((x + y) % 3 == 0)
          continue;
        float sum = 0;
        for (int64_t i = 0; i < this->state().weights.size() && i < 5; ++i)
          sum += this->state().weights[i] * distance;
        this->update(this->state().image, {x, y},
                     [&](Pixel &o) { blend(o, s.value + sum); });
      }
  }
};

// Loops over more than the bin.
struct Whole : Drawing {
  void process(const Shape &s) {
    Area a = areaOf(s);
    for (int y = a.lo.y; y < a.hi.y; ++y)
      for (int x = a.lo.x; x < a.hi.x; ++x)
        if (this->binFromPosition(glm::ivec2(x, y)) == this->bin())
          this->update(this->state().image, {x, y},
                       [&](Pixel &o) { blend(o, s.value); });
  }
};

// Another way for a few, which needs an array.
struct Clipping : Drawing {
  void process(const Shape &s) {
    Area a = clipped(s);
    if ((s.width & 0x38) == 0) {
      float corners[8];
      int count = 0;
      for (int i = 0; i < 8; ++i)
        if ((s.height >> i) & 1)
          corners[count++] = s.value * i;
      for (int i = 1; i < count; ++i)
        this->parallelForPixels(a.lo, a.hi - 1, [&](glm::ivec2 p) {
          if ((p.x + i) & 1)
            this->update(this->state().image, p,
                         [&](Pixel &o) { blend(o, corners[i] - corners[0]); });
        });
      return;
    }
    for (int y = a.lo.y; y < a.hi.y; ++y)
      for (int x = a.lo.x; x < a.hi.x; ++x)
        if ((x ^ y) & 3)
          this->update(this->state().image, {x, y},
                       [&](Pixel &o) { blend(o, s.value); });
  }
};

struct Span : Drawing {
  void process(const Shape &s) {
    Area a = clipped(s);
    for (int y = a.lo.y; y < a.hi.y; ++y) {
      int end = glm::min(a.hi.x, a.lo.x + (y & 3));
      for (int x = a.lo.x; x < end; ++x)
        this->update(this->state().image, {x, y},
                     [&](Pixel &o) { blend(o, s.value); });
    }
  }
};

// Pixels that loops do not count to.
struct Frame : Drawing {
  void process(const Shape &s) {
    Area a = clipped(s);
    if (a.lo.y >= a.hi.y)
      return;
    for (int x = a.lo.x; x < a.hi.x; ++x) {
      this->update(this->state().image, {x, a.lo.y},
                   [&](Pixel &o) { blend(o, s.value); });
      this->update(this->state().image, {x, a.hi.y - 1},
                   [&](Pixel &o) { blend(o, -s.value); });
    }
  }
};

// A number that is no function of the pixel alone.
struct Carry : Drawing {
  void process(const Shape &s) {
    Area a = clipped(s);
    float sum = s.value;
    for (int y = a.lo.y; y < a.hi.y; ++y)
      for (int x = a.lo.x; x < a.hi.x; ++x) {
        sum = sum * 0.75f + 1;
        this->update(this->state().image, {x, y},
                     [&](Pixel &o) { blend(o, sum); });
      }
  }
};

// Where its pixels are, a table of its own says.
struct Table : Drawing {
  void process(const Shape &s) {
    Area a = clipped(s);
    int begins[4] = {a.lo.x, a.lo.x + 1, a.lo.x + 2, a.lo.x};
    int lo = begins[s.width & 3];
    for (int y = a.lo.y; y < a.hi.y; ++y)
      for (int x = lo; x < a.hi.x; ++x)
        this->update(this->state().image, {x, y},
                     [&](Pixel &o) { blend(o, s.value); });
  }
};
struct TableOfPoints : Drawing {
  void process(const Shape &s) {
    Area a = clipped(s);
    int places[4] = {a.lo.x, a.hi.x - 1, (a.lo.x + a.hi.x) / 2, a.lo.x};
    if (a.lo.x >= a.hi.x || a.lo.y >= a.hi.y)
      return;
    this->update(this->state().image, {places[s.height & 3], a.lo.y},
                 [&](Pixel &o) { blend(o, s.value); });
  }
};

// One loop counts both coordinates.
struct Diagonal : Drawing {
  void process(const Shape &s) {
    Area a = clipped(s);
    int lo = glm::max(a.lo.x, a.lo.y), hi = glm::min(a.hi.x, a.hi.y);
    for (int i = lo; i < hi; ++i)
      this->update(this->state().image, {i, i},
                   [&](Pixel &o) { blend(o, s.value - i); });
  }
};

// Iterations of a loop in a loop.
struct Column : Drawing {
  void process(const Shape &s) {
    Area a = clipped(s);
    for (int x = a.lo.x; x < a.hi.x; ++x)
      this->parallelFor(a.hi.y - a.lo.y, [&](int i) {
        this->update(this->state().image, {x, a.lo.y + i},
                     [&](Pixel &o) { blend(o, s.value + i); });
      });
  }
};

template <class S> struct Pipe : piko::Pipe<State> {
  S draw;
  Pipe() { this->source(draw); }
};
struct Boxes : Pipe<Box> {};
struct Points : Pipe<Point> {};
struct Rows : Pipe<Row> {};
struct Steps : Pipe<Step> {};
struct Discs : Pipe<Disc> {};
struct Unclipped : Pipe<Whole> {};
struct Rare : Pipe<Clipping> {};
struct Spans : Pipe<Span> {};
struct Frames : Pipe<Frame> {};
struct Carried : Pipe<Carry> {};
struct Tables : Pipe<Table> {};
struct TablesOfPoints : Pipe<TableOfPoints> {};
struct Diagonals : Pipe<Diagonal> {};
struct Columns : Pipe<Column> {};
