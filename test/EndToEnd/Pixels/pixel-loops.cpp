// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Ways to write a loop over the pixels of a box that lie in a bin, row by row: each
// is proved to stay in the bin, and fused with what draws the pixels.
// RUN: pikoc %s --remarks --emit=kernels -o /dev/null 2>%t.remarks
// RUN: FileCheck %s --check-prefix=PROVED --input-file=%t.remarks
// PROVED-COUNT-9: keeps each primitive in the bin that it was emitted from
// RUN: FileCheck %s --check-prefix=FUSED --input-file=%t.remarks
// FUSED-COUNT-9: runs inside stage
// RUN: %compare_targets %s --domain 67 35 --count 300 | FileCheck %s
// RUN: %if all %{ piko-compare %s --domain 67 35 --count 100 --without infer-directives | FileCheck %s %}
// CHECK: equal
#include "../Inputs/emitting-loops.h"

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

struct Rows : piko::Pipe<State> {
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
  Clamp clampLoop;
  Sink<6> sink6;
  While whileLoop;
  Sink<7> sink7;
  Unequal unequalLoop;
  Sink<8> sink8;
  Rows() {
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
    source(clampLoop);
    connect(clampLoop, 0, sink6);
    source(whileLoop);
    connect(whileLoop, 0, sink7);
    source(unequalLoop);
    connect(unequalLoop, 0, sink8);
  }
};
