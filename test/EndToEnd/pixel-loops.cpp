// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Ways to write a loop over the pixels of a box that lie in a bin: each is
// proved to stay in the bin, and fused with what draws the pixels.
// RUN: pikoc %s --remarks --emit=kernels -o /dev/null 2>%t.remarks
// RUN: FileCheck %s --check-prefix=PROVED --input-file=%t.remarks
// PROVED-COUNT-17: keeps each primitive in the bin that it was emitted from
// RUN: FileCheck %s --check-prefix=FUSED --input-file=%t.remarks
// FUSED-COUNT-17: runs inside stage
// RUN: piko-compare %s --domain 67 35 --count 300 | FileCheck %s
// RUN: piko-compare %s --domain 67 35 --count 100 --without infer-directives | FileCheck %s
// CHECK: equal
#include <piko.h>

#include <algorithm>
#include <array>

struct Seed {
  float x, y;
  int width, height;
};
struct Cell {
  int x, y, id;
};
struct Pixel {
  std::array<int, 17> drawn{};
};
struct State {
  piko::Image<Pixel> image;
};

struct Box {
  glm::ivec2 lo, hi; // closed
  int id;
};
static Box boxOf(const Seed &s) {
  glm::ivec2 lo(piko::toInt(s.x) % 80 - 5, piko::toInt(s.y) % 50 - 5);
  return {lo, lo + glm::ivec2(s.width & 31, s.height & 15), s.width};
}

template <int K> struct Sink : piko::Stage<8, 8, 64, Cell>, piko::Uses<State> {
  void assignBin(const Cell &c) {
    this->assignToBin(c, this->binFromPosition(glm::ivec2(c.x, c.y)));
  }
  void process(const Cell &c) {
    this->update(this->state().image, {c.x, c.y},
                 [&](Pixel &p) { p.drawn[K] = p.drawn[K] * 31 + c.id; });
  }
};
struct Loops : piko::Stage<8, 8, 64, Seed, Cell> {
  void assignBin(const Seed &s) {
    Box b = boxOf(s);
    assignToBoundingBox(s, b.lo, b.hi);
  }
};

struct HalfOpen : Loops {
  void process(const Seed &s) {
    Box b = boxOf(s);
    glm::ivec2 a = glm::max(b.lo, binLo()), e = glm::min(b.hi + 1, binHi());
    for (int y = a.y; y < e.y; ++y)
      for (int x = a.x; x < e.x; ++x)
        emit({x, y, b.id});
  }
};

struct Closed : Loops {
  void process(const Seed &s) {
    Box b = boxOf(s);
    glm::ivec2 a = glm::max(b.lo, binLo()), e = glm::min(b.hi, binHi() - 1);
    for (int y = a.y; y <= e.y; ++y)
      for (int x = a.x; x <= e.x; ++x)
        emit({x, y, b.id});
  }
};

struct Quads : Loops {
  void process(const Seed &s) {
    Box b = boxOf(s);
    glm::ivec2 a = glm::max(b.lo & ~1, binLo()),
               e = glm::min(b.hi + 1, binHi());
    for (int y = a.y; y < e.y; y += 2)
      for (int x = a.x; x < e.x; x += 2)
        for (int j = 0; j < 2; ++j)
          for (int i = 0; i < 2; ++i)
            if (x + i < e.x && y + j < e.y)
              emit({x + i, y + j, b.id});
  }
};

struct Step2 : Loops {
  void process(const Seed &s) {
    Box b = boxOf(s);
    glm::ivec2 a = glm::max(b.lo, binLo()), e = glm::min(b.hi, binHi() - 1);
    for (int y = a.y; y <= e.y; y += 2)
      for (int x = a.x; x <= e.x; x += 2)
        emit({x, y, b.id});
  }
};

struct Backward : Loops {
  void process(const Seed &s) {
    Box b = boxOf(s);
    glm::ivec2 a = glm::max(b.lo, binLo()), e = glm::min(b.hi, binHi() - 1);
    for (int y = e.y; y >= a.y; --y)
      for (int x = e.x; x >= a.x; --x)
        emit({x, y, b.id});
  }
};

struct CountDown : Loops {
  void process(const Seed &s) {
    Box b = boxOf(s);
    glm::ivec2 a = glm::max(b.lo, binLo()), e = glm::min(b.hi + 1, binHi());
    for (int y = e.y; y-- > a.y;)
      for (int x = e.x; x-- > a.x;)
        emit({x, y, b.id});
  }
};

struct Flat : Loops {
  void process(const Seed &s) {
    Box b = boxOf(s);
    glm::ivec2 a = glm::max(b.lo, binLo()), e = glm::min(b.hi, binHi() - 1) + 1;
    int w = std::max(e.x - a.x, 0), h = std::max(e.y - a.y, 0);
    for (int i = 0; i < w * h; ++i)
      emit({a.x + i % w, a.y + i / w, b.id});
  }
};

struct Flat64 : Loops {
  void process(const Seed &s) {
    Box b = boxOf(s);
    for (int i = 0; i < 64; ++i) {
      glm::ivec2 p = binLo() + glm::ivec2(i % 8, i / 8);
      if (p.x < b.lo.x || p.y < b.lo.y || p.x > b.hi.x || p.y > b.hi.y)
        continue;
      if (p.x >= domain().x || p.y >= domain().y)
        continue;
      emit({p.x, p.y, b.id});
    }
  }
};

struct Bits : Loops {
  void process(const Seed &s) {
    Box b = boxOf(s);
    for (unsigned i = 0; i < 64; ++i) {
      int x = binLo().x + int(i & 7), y = binLo().y + int(i >> 3);
      if (x >= b.lo.x && y >= b.lo.y && x <= b.hi.x && y <= b.hi.y &&
          x < binHi().x && y < binHi().y)
        emit({x, y, b.id});
    }
  }
};

struct Offset : Loops {
  void process(const Seed &s) {
    Box b = boxOf(s);
    for (int dy = 0; dy < binHi().y - binLo().y; ++dy)
      for (int dx = 0; dx < binHi().x - binLo().x; ++dx) {
        glm::ivec2 p = binLo() + glm::ivec2(dx, dy);
        if (glm::all(glm::greaterThanEqual(p, b.lo)) &&
            glm::all(glm::lessThanEqual(p, b.hi)))
          emit({p.x, p.y, b.id});
      }
  }
};

struct Guard : Loops {
  void process(const Seed &s) {
    Box b = boxOf(s);
    for (int y = b.lo.y; y <= b.hi.y; ++y)
      for (int x = b.lo.x; x <= b.hi.x; ++x)
        if (binFromPosition(glm::ivec2(x, y)) == bin())
          emit({x, y, b.id});
  }
};

struct Vector : Loops {
  void process(const Seed &s) {
    Box b = boxOf(s);
    glm::ivec2 a = glm::max(b.lo, binLo()), e = glm::min(b.hi + 1, binHi());
    for (glm::ivec2 p = a; p.y < e.y; ++p.y)
      for (p.x = a.x; p.x < e.x; ++p.x)
        emit({p.x, p.y, b.id});
  }
};

struct Pixels : Loops {
  void process(const Seed &s) {
    Box b = boxOf(s);
    parallelForPixels([&](glm::ivec2 p) {
      if (p.x >= b.lo.x && p.y >= b.lo.y && p.x <= b.hi.x && p.y <= b.hi.y)
        emit({p.x, p.y, b.id});
    });
  }
};

struct Parallel : Loops {
  void process(const Seed &s) {
    Box b = boxOf(s);
    glm::ivec2 a = glm::max(b.lo, binLo()), e = glm::min(b.hi, binHi() - 1) + 1;
    int w = e.x - a.x, h = e.y - a.y;
    if (w <= 0 || h <= 0)
      return;
    parallelFor(w * h, [&](int i) { emit({a.x + i % w, a.y + i / w, b.id}); });
  }
};

struct Clamp : Loops {
  void process(const Seed &s) {
    Box b = boxOf(s);
    glm::ivec2 a = glm::clamp(b.lo, binLo(), binHi() - 1),
               e = glm::clamp(b.hi, binLo(), binHi() - 1);
    for (int y = a.y; y <= e.y; ++y)
      for (int x = a.x; x <= e.x; ++x)
        emit({x, y, b.id});
  }
};

struct While : Loops {
  void process(const Seed &s) {
    Box b = boxOf(s);
    int y = std::max(b.lo.y, binLo().y);
    while (true) {
      if (y >= binHi().y || y > b.hi.y)
        break;
      int x = std::max(b.lo.x, binLo().x);
      do {
        if (x >= binHi().x || x > b.hi.x)
          break;
        emit({x, y, b.id});
        ++x;
      } while (true);
      y++;
    }
  }
};

struct Unequal : Loops {
  void process(const Seed &s) {
    Box b = boxOf(s);
    glm::ivec2 a = glm::max(b.lo, binLo()), e = glm::min(b.hi + 1, binHi());
    if (a.x >= e.x)
      return;
    for (int y = a.y; y < e.y; ++y)
      for (int x = a.x; x != e.x; ++x)
        emit({x, y, b.id});
  }
};

struct Everything : piko::Pipe<State> {
  HalfOpen halfOpenLoop;
  Sink<0> sink0;
  Closed closedLoop;
  Sink<1> sink1;
  Quads quadsLoop;
  Sink<2> sink2;
  Step2 step2Loop;
  Sink<3> sink3;
  Backward backwardLoop;
  Sink<4> sink4;
  CountDown countDownLoop;
  Sink<5> sink5;
  Flat flatLoop;
  Sink<6> sink6;
  Flat64 flat64Loop;
  Sink<7> sink7;
  Bits bitsLoop;
  Sink<8> sink8;
  Offset offsetLoop;
  Sink<9> sink9;
  Guard guardLoop;
  Sink<10> sink10;
  Vector vectorLoop;
  Sink<11> sink11;
  Pixels pixelsLoop;
  Sink<12> sink12;
  Parallel parallelLoop;
  Sink<13> sink13;
  Clamp clampLoop;
  Sink<14> sink14;
  While whileLoop;
  Sink<15> sink15;
  Unequal unequalLoop;
  Sink<16> sink16;
  Everything() {
    source(halfOpenLoop);
    connect(halfOpenLoop, 0, sink0);
    source(closedLoop);
    connect(closedLoop, 0, sink1);
    source(quadsLoop);
    connect(quadsLoop, 0, sink2);
    source(step2Loop);
    connect(step2Loop, 0, sink3);
    source(backwardLoop);
    connect(backwardLoop, 0, sink4);
    source(countDownLoop);
    connect(countDownLoop, 0, sink5);
    source(flatLoop);
    connect(flatLoop, 0, sink6);
    source(flat64Loop);
    connect(flat64Loop, 0, sink7);
    source(bitsLoop);
    connect(bitsLoop, 0, sink8);
    source(offsetLoop);
    connect(offsetLoop, 0, sink9);
    source(guardLoop);
    connect(guardLoop, 0, sink10);
    source(vectorLoop);
    connect(vectorLoop, 0, sink11);
    source(pixelsLoop);
    connect(pixelsLoop, 0, sink12);
    source(parallelLoop);
    connect(parallelLoop, 0, sink13);
    source(clampLoop);
    connect(clampLoop, 0, sink14);
    source(whileLoop);
    connect(whileLoop, 0, sink15);
    source(unequalLoop);
    connect(unequalLoop, 0, sink16);
  }
};
