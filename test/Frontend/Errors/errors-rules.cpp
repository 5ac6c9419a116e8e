// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Where Clang would list overloads, the rule of the language is said, once.
// RUN: not piko-translate --cpp-to-piko -DASSIGN='assignToBoundingBox(w, w.lo, w.hi)' %s 2>&1 | FileCheck %s --check-prefix=TYPE
// RUN: not piko-translate --cpp-to-piko -DASSIGN='assignToAll(w)' %s 2>&1 | FileCheck %s --check-prefix=TYPE
// RUN: not piko-translate --cpp-to-piko -DASSIGN='assignToAll(Wall{})' %s 2>&1 | FileCheck %s --check-prefix=TYPE
// RUN: not piko-translate --cpp-to-piko -DASSIGN='assignToLine(w, w.lo, w.hi, 3)' %s 2>&1 | FileCheck %s --check-prefix=TYPE
// RUN: not piko-translate --cpp-to-piko -DDO='emit<1>(lamp)' %s 2>&1 | FileCheck %s --check-prefix=PORT
// RUN: not piko-translate --cpp-to-piko -DDO='state().light(p) = 1' %s 2>&1 | FileCheck %s --check-prefix=CONST
// RUN: not piko-translate --cpp-to-piko -DDO='state().lamps(p) = lamp' %s 2>&1 | FileCheck %s --check-prefix=CONST
// RUN: not piko-translate --cpp-to-piko -DDO='state().lamps(p).at += 1' %s 2>&1 | FileCheck %s --check-prefix=CONST
// RUN: not piko-translate --cpp-to-piko -DDO='lamp.at = glm::vec2(1)' %s 2>&1 | FileCheck %s --check-prefix=CONST
// RUN: not piko-translate --cpp-to-piko -DDO='std::vector<int> v' %s 2>&1 | FileCheck %s --check-prefix=VECTOR
//
// What is no call of Piko's has Clang's words.
// RUN: not piko-translate --cpp-to-piko -DDO='takeLamp(Wall{})' %s 2>&1 | FileCheck %s --check-prefix=CLANG
// RUN: not piko-translate --cpp-to-piko -DDO='std::vactor<int> v' %s 2>&1 | FileCheck %s --check-prefix=UNKNOWN
// RUN: piko-translate --cpp-to-piko %s -o /dev/null
#include <piko.h>

struct Lamp {
  glm::vec2 at;
};
struct Wall {
  glm::vec2 lo, hi;
};
#ifndef ASSIGN
#define ASSIGN assignToAll(lamp)
#endif
#ifndef DO
#define DO emit(lamp, 1)
#endif

struct State {
  piko::Image<float> light;
  piko::Image<Lamp> lamps;
};
struct Draw : piko::Stage<8, 8, 1, Lamp, Wall, Lamp>, piko::Uses<State> {
  static void takeLamp(const Lamp &) {}
  void assignBin(const Lamp &lamp) {
    Wall w{};
    // TYPE: errors-rules.cpp:[[#@LINE+1]]:{{[0-9]+}}: error: expected a 'Lamp', which stage 'Draw' takes, but got a 'Wall'; a stage takes one type: make two kinds one struct with a member that says which
    ASSIGN;
  }
  void process(const Lamp &lamp) {
    glm::ivec2 p = binLo();
    // PORT: errors-rules.cpp:[[#@LINE+5]]:{{[0-9]+}}: error: expected the port as an argument: emit(value, port)
    // CONST: errors-rules.cpp:[[#@LINE+4]]:{{[0-9]+}}: error: expected no assignment to what is const; an image is written by update(image, cell, f) or image.store(cell, value), and of a primitive a copy may be changed
    // VECTOR: errors-rules.cpp:[[#@LINE+3]]:{{[0-9]+}}: error: not supported in Piko: 'std::vector', which allocates; use an array of a fixed size, or a buffer of the state
    // CLANG: errors-rules.cpp:[[#@LINE+2]]:{{[0-9]+}}: error: no viable conversion from 'Wall' to 'const Lamp'
    // UNKNOWN: errors-rules.cpp:[[#@LINE+1]]:{{[0-9]+}}: error: no member named 'vactor' in namespace 'std'
    DO;
    emit(Wall{lamp.at, glm::vec2(p)});
  }
};
// TYPE-NOT: {{error|note}}:
// PORT-NOT: {{error|note}}:
// CONST-NOT: {{error|note}}:
struct Walls : piko::Stage<8, 8, 1, Wall> {
  void assignBin(const Wall &w) { assignToAll(w); }
  void process(const Wall &) {}
};
struct Lamps : piko::Stage<8, 8, 1, Lamp> {
  void assignBin(const Lamp &lamp) { assignToAll(lamp); }
  void process(const Lamp &) {}
};
struct Pipe : piko::Pipe<State> {
  Draw draw;
  Walls walls;
  Lamps lamps;
  Pipe() {
    source(draw);
    connect(draw, 0, walls);
    connect(draw, 1, lamps);
  }
};
