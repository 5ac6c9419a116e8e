// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Checking mode finds planted mistakes in accesses, in the reference
// ("expected") and compiled ("got"), and says where they are; none are found
// where they are mended.
// RUN: sed -n 's|^// STOP: ||p' %s > %t.stops
// RUN: %compare_checked %s --stops --cases %t.stops --runs 1 --threads 2 --check > %t.out
// RUN: sed -n '/^Race:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=RACE
// RUN: sed -n '/^Early:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=EARLY
// RUN: sed -n '/^Iterations:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=ITERATIONS
// RUN: sed -n '/^Outside:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=OUTSIDE
// RUN: sed -n '/^Index:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=INDEX
// HOLE: cuda: what is checked is written down on the host
// STOP: --pipe Race --count 8
// STOP: --pipe Early --count 8
// STOP: --pipe Iterations --count 1
// STOP: --pipe Outside --count 8
// STOP: --pipe Index --count 8
// RUN: %compare_checked %s --cases %s --runs 1 --threads 2 --check
// CASE: --pipe RaceMended --count 8
// CASE: --pipe EarlyMended --count 8
// CASE: --pipe IterationsMended --count 1
// CASE: --pipe OutsideMended --count 8
// CASE: --pipe IndexMended --count 8
#include "../Inputs/ports.h"

struct State {
  piko::Buffer<int> cells;
  piko::Image<float> depth;
};

// RACE: expected: {{.*}}expected no conflict between concurrent calls, but 'cells[0]' is
// RACE: got: stage 'store', bin 0: expected no conflict between concurrent calls, but 'cells[0]' is stored here and stored by stage 'store', bin 0
// RACE-NEXT: at {{.*}}check.cpp:[[#@LINE+10]]
// RACE-NEXT: lineage: source 0 primitive 1
// RACE-NEXT: other at {{.*}}check.cpp:[[#@LINE+8]]
// RACE-NEXT: other lineage: source 0 primitive 0
template <bool Mended>
struct StoreZero : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const Point &p) {
    if (Mended)
      piko::atomicAdd(state().cells[0], p.x + 100);
    else
      state().cells[0] = p.x + 100;
  }
};
template <bool Mended> struct RacePipe : piko::Pipe<State> {
  StoreZero<Mended> store;
  RacePipe() { source(store); }
};
struct Race : RacePipe<false> {};
struct RaceMended : RacePipe<true> {};

// EARLY: got: stage 'read', bin {{[0-9]+}}: expected no conflict between concurrent calls, but 'cells[3]' is read here and changed atomically by stage 'count', bin 0
// EARLY-NEXT: at {{.*}}check.cpp:[[#@LINE+18]]
// EARLY-NEXT: lineage: source 0 primitive {{[0-9]+}}, 'count' bin 0 emit 0
// EARLY-NEXT: other at {{.*}}check.cpp:[[#@LINE+4]]
// EARLY-NEXT: other lineage: source 0 primitive {{[0-9]+}}
struct Count : piko::Stage<0, 0, 64, Point, Point>, piko::Uses<State> {
  void process(const Point &p) {
    piko::atomicAdd(state().cells[3], 1);
    emit(p);
  }
};
template <bool Mended>
struct ReadCount : piko::Stage<8, 8, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) { assignToBin(p, {p.x % 4}); }
  void schedule(piko::BinId) {
    if constexpr (Mended)
      endStage<Count>();
  }
  void process(const Point &p) {
    if (state().cells[3] > p.tag)
      piko::atomicAdd(state().cells[p.tag % 2], 1);
  }
};
template <bool Mended> struct EarlyPipe : piko::Pipe<State> {
  Count count;
  ReadCount<Mended> read;
  EarlyPipe() {
    source(count);
    connect(count, 0, read);
  }
};
struct Early : EarlyPipe<false> {};
struct EarlyMended : EarlyPipe<true> {};

// ITERATIONS: expected: {{.*}}expected no conflict between iterations, but 'cells[5]' is
// ITERATIONS: got: stage 'loop', bin 0: expected no conflict between iterations, but 'cells[5]' is stored by iteration 1 and stored by iteration 0
// ITERATIONS-NEXT: at {{.*}}check.cpp:[[#@LINE+6]]
// ITERATIONS-NEXT: lineage: source 0 primitive 0
// ITERATIONS-NEXT: other at {{.*}}check.cpp:[[#@LINE+4]]
template <bool Mended>
struct Loop : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const Point &) {
    parallelFor(4, [&](int i) { state().cells[Mended ? i : 5] = i + 100; });
  }
};
template <bool Mended> struct IterationsPipe : piko::Pipe<State> {
  Loop<Mended> loop;
  IterationsPipe() { source(loop); }
};
struct Iterations : IterationsPipe<false> {};
struct IterationsMended : IterationsPipe<true> {};

// OUTSIDE: got: stage 'draw', bin 0: expected an update inside the stage's own bin, but got pixel (63, 40)
// OUTSIDE-NEXT: at {{.*}}check.cpp:[[#@LINE+6]]
// OUTSIDE-NEXT: lineage: source 0 primitive 0
template <bool Mended>
struct Draw : piko::Stage<8, 8, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) { assignToBin(p, {Mended ? 47 : 0}); }
  void process(const Point &p) {
    update(state().depth, glm::ivec2(63, 40), [&](float &z) { z = p.value; });
  }
};
template <bool Mended> struct OutsidePipe : piko::Pipe<State> {
  Draw<Mended> draw;
  OutsidePipe() { source(draw); }
};
struct Outside : OutsidePipe<false> {};
struct OutsideMended : OutsidePipe<true> {};

// INDEX: got: stage 'far', bin 0: expected an index into 'cells' in [0, 64), but got 64
// INDEX-NEXT: at {{.*}}check.cpp:[[#@LINE+5]]
// INDEX-NEXT: lineage: source 0 primitive 0
template <bool Mended>
struct Far : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const Point &) {
    piko::atomicAdd(state().cells[Mended ? 63 : 64], 1);
  }
};
template <bool Mended> struct IndexPipe : piko::Pipe<State> {
  Far<Mended> far;
  IndexPipe() { source(far); }
};
struct Index : IndexPipe<false> {};
struct IndexMended : IndexPipe<true> {};
