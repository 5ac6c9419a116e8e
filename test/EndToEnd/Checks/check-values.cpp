// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Checking mode finds planted mistakes in values and in what runs several
// times, in the reference ("expected") and compiled ("got"); none are found
// where they are mended.
// HOLE: cuda: what is checked is written down on the host
// REQUIRES: all
// RUN: %compare_checked %s --stops --pipe Number --count 8 --runs 1 --threads 2 --check=nan:Point.value | FileCheck %s --check-prefix=NUMBER
// RUN: %compare_checked %s --stops --pipe NumberMended --count 80 --wide --runs 1 --threads 2 --check=nan:Point.value | FileCheck %s --check-prefix=FED
// RUN: %compare_checked %s --stops --pipe Unwritten --count 8 --runs 1 --threads 2 --check | FileCheck %s --check-prefix=UNWRITTEN
// RUN: %compare_checked %s --stops --pipe Endless --count 2 --loop-limit 20 --runs 1 --threads 2 --check | FileCheck %s --check-prefix=ENDLESS
// RUN: not piko-compare %s --pipe Endless --count 1 --runs 1 --threads 2 --check | FileCheck %s --check-prefix=LONG
// RUN: %compare_checked %s --stops --pipe Rounds --count 8 --runs 1 --threads 2 --check | FileCheck %s --check-prefix=ROUNDS
// RUN: %compare_checked %s --stops --pipe Batches --count 8 --runs 1 --threads 2 --check | FileCheck %s --check-prefix=BATCHES
// RUN: %compare_checked %s --cases %s --runs 1 --threads 2 --check=nan:Point.value
// CASE: --pipe NumberMended --count 8
// CASE: --pipe UnwrittenMended --count 8
// CASE: --pipe EndlessMended --count 8
// CASE: --pipe RoundsMended --count 8
// CASE: --pipe BatchesMended --count 8
#include "../Inputs/ports.h"

struct State {
  piko::Buffer<int> cells;
};

// The host feeds one, with --wide.
// FED: got: stage 'divide': expected a number in field 'value' of 'Point', but got NaN
// FED-NEXT: lineage: source 0 primitive 3
// NUMBER: got: stage 'divide', bin 0: expected a number in field 'value' of 'Point', but got NaN
// NUMBER-NEXT: at {{.*}}check-values.cpp:[[#@LINE+9]]
// NUMBER-NEXT: lineage: source 0 primitive 0
template <bool Mended>
struct Divide : piko::Stage<0, 0, 64, Point, Point>, piko::Uses<State> {
  void process(const Point &p) {
    Point q = p;
    piko::atomicAdd(state().cells[0], 1);
    if (!Mended && state().cells.size() == 64)
      q.value = p.value * 0.0f / 0.0f;
    emit(q);
  }
};
struct Drop : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const Point &p) { piko::atomicAdd(state().cells[1], p.x); }
};
template <bool Mended> struct NumberPipe : piko::Pipe<State> {
  Divide<Mended> divide;
  Drop drop;
  NumberPipe() {
    source(divide);
    connect(divide, 0, drop);
  }
};
struct Number : NumberPipe<false> {};
struct NumberMended : NumberPipe<true> {};

// UNWRITTEN: got: stage 'forget', bin 0: expected field 'value' of 'Point' to be written, but it never was
// UNWRITTEN-NEXT: at {{.*}}check-values.cpp:[[#@LINE+11]]
// UNWRITTEN-NEXT: lineage: source 0 primitive {{[0-9]+}}
template <bool Mended>
struct Forget : piko::Stage<0, 0, 64, Point, Point>, piko::Uses<State> {
  void process(const Point &p) {
    Point q;
    q.x = p.x;
    q.y = p.y;
    q.tag = p.tag;
    if (Mended || p.x % 2 == 0)
      q.value = 1;
    emit(q);
  }
};
template <bool Mended> struct UnwrittenPipe : piko::Pipe<State> {
  Forget<Mended> forget;
  Drop drop;
  UnwrittenPipe() {
    source(forget);
    connect(forget, 0, drop);
  }
};
struct Unwritten : UnwrittenPipe<false> {};
struct UnwrittenMended : UnwrittenPipe<true> {};

// ENDLESS: expected: {{.*}}stage 'Turn<false>', bin 0: a loop did not end within 20 hops
// ENDLESS-NEXT: lineage: source 0 primitive 0, {{(('Turn<false>' bin 0 emit 0, ){8})}}... 5 hops ...{{(, 'Turn<false>' bin 0 emit 0){8}$}}
// ENDLESS: got: stage 'turn', bin 0: a loop did not end within 20 hops
// ENDLESS-NEXT: lineage: source 0 primitive 0, {{(('turn' bin 0 emit 0, ){8})}}... 5 hops ...{{(, 'turn' bin 0 emit 0){8}$}}
// LONG: got: stage 'turn', bin 0: a loop did not end within 1048576 hops
// LONG-NEXT: lineage: source 0 primitive 0, {{(('turn' bin 0 emit 0, ){8})}}... 1048561 hops ...{{(, 'turn' bin 0 emit 0){8}$}}
template <bool Mended> struct Turn : piko::Stage<0, 0, 64, Point, Point> {
  void process(const Point &p) {
    Point q = p;
    q.tag = p.tag / 2;
    if (!Mended || p.tag)
      emit(q);
  }
};
template <bool Mended> struct EndlessPipe : piko::Pipe<State> {
  Turn<Mended> turn;
  Drop drop;
  EndlessPipe() {
    source(turn);
    source(drop);
    connect(turn, 0, turn);
  }
};
struct Endless : EndlessPipe<false> {};
struct EndlessMended : EndlessPipe<true> {};

// The mistake is in the second round alone.
// ROUNDS: expected: {{.*}}stage 'Step<false>', bin 0: expected no conflict between concurrent calls, but 'cells[9]' is
// ROUNDS: got: stage 'step', bin 0: expected no conflict between concurrent calls, but 'cells[9]' is stored here and stored by stage 'step', bin 0
// ROUNDS-NEXT: at {{.*}}check-values.cpp:[[#@LINE+20]]
// ROUNDS-NEXT: lineage: 'gather' bin 0 call 0, 'gather' bin 0 emit 1
// ROUNDS-NEXT: other at {{.*}}check-values.cpp:[[#@LINE+18]]
// ROUNDS-NEXT: other lineage: 'gather' bin 0 call 0, 'gather' bin 0 emit 0
struct Gather : piko::Stage<0, 0, 64, Point, Point> {
  void process(const piko::List<Point> &points) {
    for (const Point &p : points) {
      Point q = p;
      q.x = p.x < 1000 ? 1000 : p.x + 1;
      emit(q);
    }
  }
};
template <bool Mended>
struct Step : piko::Stage<0, 0, 64, Point, Point>, piko::Uses<State> {
  void process(const Point &p) {
    if (p.x == 1001)
      if (Mended)
        piko::atomicAdd(state().cells[9], 1);
      else
        state().cells[9] = p.tag + 1000;
    if (p.x < 1002)
      emit(p);
  }
};
template <bool Mended> struct RoundsPipe : piko::Pipe<State> {
  Gather gather;
  Step<Mended> step;
  RoundsPipe() {
    source(gather);
    connect(gather, 0, step);
    connect(step, 0, gather);
  }
};
struct Rounds : RoundsPipe<false> {};
struct RoundsMended : RoundsPipe<true> {};

// BATCHES: expected: {{.*}}stage 'Pairs<false>', bin 0: expected no conflict between concurrent calls, but 'cells[7]' is
// BATCHES: got: stage 'pairs', bin 0: expected no conflict between concurrent calls, but 'cells[7]' is stored here and stored by stage 'pairs', bin 0
// BATCHES-NEXT: at {{.*}}check-values.cpp:[[#@LINE+11]]
// BATCHES-NEXT: lineage: 'pairs' bin 0 call 1
// BATCHES-NEXT: other at {{.*}}check-values.cpp:[[#@LINE+9]]
// BATCHES-NEXT: other lineage: 'pairs' bin 0 call 0
template <bool Mended>
struct Pairs : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void schedule(piko::BinId) { batch(2); }
  void process(const piko::List<Point> &points) {
    if (Mended)
      piko::atomicMax(state().cells[7], points[0].x);
    else
      state().cells[7] = 1000 + int(points[0].x);
  }
};
template <bool Mended> struct BatchesPipe : piko::Pipe<State> {
  Pairs<Mended> pairs;
  BatchesPipe() { source(pairs); }
};
struct Batches : BatchesPipe<false> {};
struct BatchesMended : BatchesPipe<true> {};
