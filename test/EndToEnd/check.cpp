// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Checking mode finds planted mistakes, in the reference ("expected") and
// compiled ("got"), and says where they are.
// RUN: not piko-compare %s --pipe Race --count 8 --runs 1 --threads 2 --check | FileCheck %s --check-prefix=RACE
// RUN: not piko-compare %s --pipe Early --count 8 --runs 1 --threads 2 --check | FileCheck %s --check-prefix=EARLY
// RUN: not piko-compare %s --pipe Iterations --count 1 --runs 1 --threads 2 --check | FileCheck %s --check-prefix=ITERATIONS
// RUN: not piko-compare %s --pipe Outside --count 8 --runs 1 --threads 2 --check | FileCheck %s --check-prefix=OUTSIDE
// RUN: not piko-compare %s --pipe Number --count 8 --runs 1 --threads 2 --check=nan:Point.value | FileCheck %s --check-prefix=NUMBER
// RUN: not piko-compare %s --pipe Unwritten --count 8 --runs 1 --threads 2 --check | FileCheck %s --check-prefix=UNWRITTEN
// RUN: not piko-compare %s --pipe Index --count 8 --runs 1 --threads 2 --check | FileCheck %s --check-prefix=INDEX
#include "Inputs/ports.h"

struct State {
  piko::Buffer<int> cells;
  piko::Image<float> depth;
};

// RACE: expected: {{.*}}expected no conflict between concurrent calls, but 'cells[0]' is
// RACE: got: stage 'store', bin 0: expected no conflict between concurrent calls, but 'cells[0]' is stored here and stored by stage 'store', bin 0
// RACE-NEXT: at {{.*}}check.cpp:[[#@LINE+5]]
// RACE-NEXT: lineage: source 0 primitive 1
// RACE-NEXT: other at {{.*}}check.cpp:[[#@LINE+3]]
// RACE-NEXT: other lineage: source 0 primitive 0
struct StoreZero : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const Point &p) { state().cells[0] = p.x + 100; }
};
struct Race : piko::Pipe<State> {
  StoreZero store;
  Race() { source(store); }
};

// EARLY: got: stage 'read', bin {{[0-9]+}}: expected no conflict between concurrent calls, but 'cells[3]' is read here and changed atomically by stage 'count', bin 0
// EARLY-NEXT: at {{.*}}check.cpp:[[#@LINE+13]]
// EARLY-NEXT: lineage: source 0 primitive {{[0-9]+}}, 'count' bin 0 emit 0
// EARLY-NEXT: other at {{.*}}check.cpp:[[#@LINE+4]]
// EARLY-NEXT: other lineage: source 0 primitive {{[0-9]+}}
struct Count : piko::Stage<0, 0, 64, Point, Point>, piko::Uses<State> {
  void process(const Point &p) {
    piko::atomicAdd(state().cells[3], 1);
    emit(p);
  }
};
struct ReadCount : piko::Stage<8, 8, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) { assignToBin(p, {p.x % 4}); }
  void process(const Point &p) {
    if (state().cells[3] > p.tag)
      piko::atomicAdd(state().cells[p.tag % 2], 1);
  }
};
struct Early : piko::Pipe<State> {
  Count count;
  ReadCount read;
  Early() {
    source(count);
    connect(count, 0, read);
  }
};

// ITERATIONS: expected: {{.*}}expected no conflict between iterations, but 'cells[5]' is
// ITERATIONS: got: stage 'loop', bin 0: expected no conflict between iterations, but 'cells[5]' is stored by iteration 1 and stored by iteration 0
// ITERATIONS-NEXT: at {{.*}}check.cpp:[[#@LINE+5]]
// ITERATIONS-NEXT: lineage: source 0 primitive 0
// ITERATIONS-NEXT: other at {{.*}}check.cpp:[[#@LINE+3]]
struct Loop : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const Point &) {
    parallelFor(4, [&](int i) { state().cells[5] = i + 100; });
  }
};
struct Iterations : piko::Pipe<State> {
  Loop loop;
  Iterations() { source(loop); }
};

// OUTSIDE: got: stage 'draw': expected an update inside the stage's own bin, but got pixel (63, 40)
// OUTSIDE-NEXT: at {{.*}}check.cpp:[[#@LINE+5]]
// OUTSIDE-NEXT: lineage: source 0 primitive 0
struct Draw : piko::Stage<8, 8, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) { assignToBin(p, {0}); }
  void process(const Point &p) {
    update(state().depth, glm::ivec2(63, 40), [&](float &z) { z = p.value; });
  }
};
struct Outside : piko::Pipe<State> {
  Draw draw;
  Outside() { source(draw); }
};

// NUMBER: got: stage 'divide', bin 0: expected a number in field 'value' of 'Point', but got NaN
// NUMBER-NEXT: at {{.*}}check.cpp:[[#@LINE+8]]
// NUMBER-NEXT: lineage: source 0 primitive 0
struct Divide : piko::Stage<0, 0, 64, Point, Point>, piko::Uses<State> {
  void process(const Point &p) {
    Point q = p;
    piko::atomicAdd(state().cells[0], 1);
    if (state().cells.size() == 64)
      q.value = p.value * 0.0f / 0.0f;
    emit(q);
  }
};
struct Drop : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const Point &p) { piko::atomicAdd(state().cells[1], p.x); }
};
struct Number : piko::Pipe<State> {
  Divide divide;
  Drop drop;
  Number() {
    source(divide);
    connect(divide, 0, drop);
  }
};

// UNWRITTEN: got: stage 'forget', bin 0: expected field 'value' of 'Point' to be written, but it never was
// UNWRITTEN-NEXT: at {{.*}}check.cpp:[[#@LINE+10]]
// UNWRITTEN-NEXT: lineage: source 0 primitive {{[0-9]+}}
struct Forget : piko::Stage<0, 0, 64, Point, Point>, piko::Uses<State> {
  void process(const Point &p) {
    Point q;
    q.x = p.x;
    q.y = p.y;
    q.tag = p.tag;
    if (p.x % 2 == 0)
      q.value = 1;
    emit(q);
  }
};
struct Unwritten : piko::Pipe<State> {
  Forget forget;
  Drop drop;
  Unwritten() {
    source(forget);
    connect(forget, 0, drop);
  }
};

// INDEX: got: stage 'far': expected an index in [0, 64), but got 64
// INDEX-NEXT: at {{.*}}check.cpp:[[#@LINE+3]]
// INDEX-NEXT: lineage: source 0 primitive 0
struct Far : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const Point &) { piko::atomicAdd(state().cells[64], 1); }
};
struct Index : piko::Pipe<State> {
  Far far;
  Index() { source(far); }
};
