// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The same with pixels that are numbered, tested, shifted or taken from Piko's own
// loops; see pixel-loops.cpp.
// REQUIRES: all
// RUN: pikoc %s --remarks --emit=kernels -o /dev/null 2>%t.remarks
// RUN: FileCheck %s --check-prefix=PROVED --input-file=%t.remarks
// PROVED-COUNT-8: keeps each primitive in the bin that it was emitted from
// RUN: FileCheck %s --check-prefix=FUSED --input-file=%t.remarks
// FUSED-COUNT-8: runs inside stage
// RUN: %compare_targets %s --domain 67 35 --count 300 | FileCheck %s
// RUN: piko-compare %s --domain 67 35 --count 100 --without infer-directives | FileCheck %s
// CHECK: equal
#include "../Inputs/emitting-loops.h"

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

struct Numbered : piko::Pipe<State> {
  Flat flatLoop;
  Sink<0> sink0;
  Flat64 flat64Loop;
  Sink<1> sink1;
  Bits bitsLoop;
  Sink<2> sink2;
  Offset offsetLoop;
  Sink<3> sink3;
  Guard guardLoop;
  Sink<4> sink4;
  Vector vectorLoop;
  Sink<5> sink5;
  Pixels pixelsLoop;
  Sink<6> sink6;
  Parallel parallelLoop;
  Sink<7> sink7;
  Numbered() {
    source(flatLoop);
    connect(flatLoop, 0, sink0);
    source(flat64Loop);
    connect(flat64Loop, 0, sink1);
    source(bitsLoop);
    connect(bitsLoop, 0, sink2);
    source(offsetLoop);
    connect(offsetLoop, 0, sink3);
    source(guardLoop);
    connect(guardLoop, 0, sink4);
    source(vectorLoop);
    connect(vectorLoop, 0, sink5);
    source(pixelsLoop);
    connect(pixelsLoop, 0, sink6);
    source(parallelLoop);
    connect(parallelLoop, 0, sink7);
  }
};
