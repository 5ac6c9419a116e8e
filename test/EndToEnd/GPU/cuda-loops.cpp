// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Loops in which primitives come in at several stages, and those whose order
// across hops shows, in one submission, in the lineage order that the reference
// executor has.
// REQUIRES: all
// DEFINE: %{compare} = piko-compare %s --count 70 --domain 64 48 --runs 1 --threads 2 --target cuda --gpu-threads 64
// RUN: %compare_targets %s --cases %s --count 70 --domain 64 48 --runs 1
// CASE: --pipe TwoEntries
// CASE: --pipe Entries --count 40
// CASE: --pipe FlatEntries
// CASE: --pipe StripEntries --strip 13
// CASE: --pipe RoundEntries --count 30
// CASE: --pipe Ordered
// CASE: --pipe Strokes --count 20
// CASE: --pipe Both --count 9
// CASE: --pipe StripStrokes --count 18 --strip 7
// CASE: --pipe RoundStrokes --count 9
// RUN: export PIKO_TEST_DRIVER_COUNTS=1
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_SEED=3 %{compare} --pipe TwoEntries 2>&1 | FileCheck %s
// RUN: env PIKO_CUDA_DRIVER=%test_driver %{compare} --pipe TwoEntries --count 0 31 2>&1 | FileCheck %s
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_CUDA_ALONE=0 %{compare} --pipe Entries --count 40 2>&1 | FileCheck %s
// RUN: env PIKO_CUDA_DRIVER=%test_driver %{compare} --pipe FlatEntries 2>&1 | FileCheck %s
// RUN: env PIKO_CUDA_DRIVER=%test_driver %{compare} --pipe StripEntries --strip 13 2>&1 | FileCheck %s
// RUN: env PIKO_CUDA_DRIVER=%test_driver %{compare} --pipe RoundEntries --count 30 2>&1 | FileCheck %s
// CHECK-DAG: {{^equal$}}
// CHECK-DAG: host: 0 launches of kernels, 1 of graphs with {{[0-9]+}} kernels, {{[0-9]+}} copies, 0 fills, 3 waits
// CHECK-DAG: piko_enter: {{[1-9]}}
//
// RUN: env PIKO_CUDA_DRIVER=%test_driver_11 %{compare} --pipe Entries --count 20 2>&1 | FileCheck %s --check-prefix=OLD
// OLD-DAG: {{^equal$}}
// OLD-DAG: host: {{[0-9]+}} launches of kernels, 0 of graphs with 0 kernels, {{[0-9]+}} copies, 0 fills, {{[1-9][0-9]+}} waits
//
// Where the order across hops shows, one position runs at a time.
// RUN: env PIKO_CUDA_DRIVER=%test_driver %{compare} --pipe Ordered 2>&1 | FileCheck %s --check-prefixes=CHECK,STACK
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_SEED=3 %{compare} --pipe Strokes --count 20 2>&1 | FileCheck %s --check-prefixes=CHECK,STACK
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_CUDA_ALONE=0 %{compare} --pipe Both --count 9 2>&1 | FileCheck %s --check-prefixes=CHECK,STACK
// RUN: env PIKO_CUDA_DRIVER=%test_driver %{compare} --pipe Both --count 3 0 0 2>&1 | FileCheck %s --check-prefixes=CHECK,STACK
// RUN: env PIKO_CUDA_DRIVER=%test_driver %{compare} --pipe StripStrokes --count 18 --strip 7 2>&1 | FileCheck %s --check-prefixes=CHECK,STACK
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_CUDA_ALONE=0 %{compare} --pipe RoundStrokes --count 9 2>&1 | FileCheck %s --check-prefixes=CHECK,STACK
// RUN: env PIKO_CUDA_DRIVER=%test_driver_11 %{compare} --pipe Both --count 5 2>&1 | FileCheck %s --check-prefix=OLD
// STACK-DAG: piko_step: {{[1-9]}}
//
// One hop too many is one hop too many.
// RUN: env PIKO_CUDA_DRIVER=%test_driver not %{compare} --pipe TwoEntries --loop-limit 5 2>&1 | FileCheck %s --check-prefix=HOPS
// RUN: env PIKO_CUDA_DRIVER=%test_driver not %{compare} --pipe Ordered --loop-limit 3 2>&1 | FileCheck %s --check-prefix=HOPS
// HOPS: got: stage '{{ping|pong|draw}}', bin {{[0-9]+}}: a loop did not end within {{5|3}} hops
//
// So is what a hop does wrong, of the primitive that a CPU names.
// RUN: not piko-compare %s --pipe Strays --count 70 --domain 64 48 --runs 1 --threads 2 2>&1 | grep got: > %t.cpu
// RUN: env PIKO_CUDA_DRIVER=%test_driver not %{compare} --pipe Strays 2>&1 | grep got: > %t.cuda
// RUN: cmp %t.cpu %t.cuda && FileCheck %s --check-prefix=STRAY --input-file %t.cuda
// STRAY: got: stage 'stray': expected a bin id in [0, 48), but got 10{{[0-9]+}}
#include "../Inputs/hops.h"

struct TwoEntries : piko::Pipe<State> {
  Ping ping;
  Pong pong;
  Blend blend;
  TwoEntries() {
    source(ping);
    source(pong);
    connect(ping, 0, pong);
    connect(pong, 0, ping);
    connect(ping, 1, blend);
    connect(pong, 1, blend);
    connect(ping, 2, blend);
    connect(pong, 2, blend);
  }
};

// At each of the two by a source and an edge; what leaves is merged with others.
struct Entries : piko::Pipe<State> {
  Ping ping;
  Pong pong;
  Deal deal;
  Shift shift;
  Blend blend;
  Entries() {
    source(pong);
    source(shift);
    source(ping);
    source(deal);
    connect(deal, 0, pong);
    connect(deal, 1, ping);
    connect(ping, 0, pong);
    connect(pong, 0, ping);
    connect(ping, 1, shift);
    connect(pong, 1, shift);
    connect(ping, 2, blend);
    connect(pong, 2, blend);
    connect(shift, 0, blend);
  }
};

// No kernel is before the loop.
struct Halve : piko::Stage<0, 0, 64, Point, Point, Point> {
  void process(const Point &p) {
    emit(moved(p, 1, 0, p.value, p.tag), 1);
    if (p.tag > 1)
      emit(moved(p, 0, 1, p.value + 1, p.tag / 2), 0);
  }
};
struct Thirds : piko::Stage<0, 0, 64, Point, Point> {
  void process(const Point &p) {
    if (p.tag % 2 == 0)
      emit(moved(p, 2, 1, p.value, p.tag / 3));
    emit(moved(p, 0, 3, -p.value, p.tag / 3));
  }
};
struct FlatEntries : piko::Pipe<State> {
  Halve halve;
  Thirds thirds;
  Blend blend;
  FlatEntries() {
    source(thirds);
    source(halve);
    connect(halve, 0, thirds);
    connect(thirds, 0, halve);
    connect(halve, 1, blend);
  }
};

struct StripEntries : piko::Pipe<State> {
  Ping ping;
  Pong pong;
  Deal deal;
  Blend blend;
  StripEntries() {
    source(deal);
    source(blend);
    connect(deal, 0, pong);
    connect(deal, 1, ping);
    connect(ping, 0, pong);
    connect(pong, 0, ping);
    connect(ping, 1, blend);
    connect(pong, 1, blend);
    connect(ping, 2, blend);
    connect(pong, 2, blend);
  }
};

// In each round what a stage has collected comes in again, at both.
struct RoundEntries : piko::Pipe<State> {
  Merge merge;
  Ping ping;
  Pong pong;
  Deal deal;
  Blend blend;
  RoundEntries() {
    source(merge);
    source(pong);
    connect(merge, 0, deal);
    connect(deal, 0, pong);
    connect(deal, 1, ping);
    connect(ping, 0, pong);
    connect(pong, 0, ping);
    connect(ping, 1, merge);
    connect(pong, 1, blend);
    connect(ping, 2, blend);
    connect(pong, 2, merge);
    connect(merge, 1, blend);
  }
};

// Each hop changes a pixel in its order.
struct Draw : piko::Stage<8, 8, 64, Point, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x, p.y), glm::ivec2(p.x, p.y));
  }
  void process(const Point &p) {
    update(state().drawn, glm::ivec2(p.x, p.y),
           [&](Pixel &pixel) { pixel.sum = pixel.sum * 0.5f + p.value; });
    if (p.tag > 1)
      emit(moved(p, p.tag % 2, 0, p.value, p.tag / 2));
  }
};
struct Ordered : piko::Pipe<State> {
  Draw draw;
  Ordered() {
    source(draw);
    connect(draw, 0, draw);
  }
};

// A tree whose nodes lie in several bins, each of which emits for it.
struct Stroke : piko::Stage<16, 16, 64, Point, Point, Point, Point>,
                piko::Uses<State> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x, p.y),
                        glm::ivec2(p.x + p.tag % 7, p.y + 2));
  }
  void process(const Point &p) {
    parallelForPixels(glm::ivec2(p.x, p.y),
                      glm::ivec2(p.x + p.tag % 7, p.y + 2),
                      [&](const glm::ivec2 &at) {
                        update(state().drawn, at, [&](Pixel &pixel) {
                          pixel.sum = pixel.sum * 0.5f + p.value;
                          ++pixel.count;
                        });
                      });
    if (p.tag % 3 == 0)
      emit(moved(p, 3, 1, -p.value, p.tag), 1);
    for (int i = 0; i < p.tag % 3; ++i)
      if (p.tag > 4)
        emit(moved(p, 5 * i, i, p.value + float(i), p.tag / 3), 0);
      else
        emit(moved(p, i, 60 * i, p.value - float(i), p.tag), 1);
    if (p.tag % 5 == 1)
      emit(p, 2);
    if (p.tag % 8 == 7) // more than one thread pushes
      parallelFor(40, [&](int i) {
        if (i % 3 == 1)
          emit(moved(p, i, 2, float(i), 2), 1);
        else if (i % 3 == 2)
          emit(moved(p, i, 2, float(i), 2), 2);
        else if (i % 9 == 0)
          emit(moved(p, i, 2, float(i), 1), 0);
      });
  }
};
struct Strokes : piko::Pipe<State> {
  Stroke stroke;
  Shift shift;
  Blend blend;
  Strokes() {
    source(stroke);
    source(shift);
    connect(stroke, 0, stroke);
    connect(stroke, 1, shift);
    connect(stroke, 2, blend);
    connect(shift, 0, blend);
  }
};

// Entries at both stages of such a loop, by sources and edges.
struct Both : piko::Pipe<State> {
  Stroke stroke;
  Pong pong;
  Deal deal;
  Shift shift;
  Blend blend;
  Both() {
    source(pong);
    source(deal);
    source(stroke);
    connect(deal, 0, pong);
    connect(deal, 1, stroke);
    connect(stroke, 0, pong);
    connect(pong, 0, stroke);
    connect(stroke, 1, shift);
    connect(pong, 1, shift);
    connect(stroke, 2, blend);
    connect(pong, 2, blend);
    connect(shift, 0, blend);
  }
};

struct StripStrokes : piko::Pipe<State> {
  Stroke stroke;
  Pong pong;
  Deal deal;
  Merge merge;
  Blend blend;
  StripStrokes() {
    source(deal);
    source(blend);
    connect(deal, 0, pong);
    connect(deal, 1, stroke);
    connect(stroke, 0, pong);
    connect(pong, 0, stroke);
    connect(pong, 1, merge);
    connect(pong, 2, blend);
    connect(stroke, 1, merge);
    connect(stroke, 2, blend);
    connect(merge, 0, merge);
    connect(merge, 1, blend);
  }
};

struct RoundStrokes : piko::Pipe<State> {
  Merge merge;
  Stroke stroke;
  Blend blend;
  RoundStrokes() {
    source(stroke);
    source(merge);
    connect(merge, 0, stroke);
    connect(stroke, 0, stroke);
    connect(stroke, 1, merge);
    connect(stroke, 2, merge);
    connect(merge, 1, blend);
  }
};

struct Stray : piko::Stage<8, 8, 64, Point, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    if (p.tag == 1016) // no source has that
      assignToBin(p, piko::BinId{1000 + p.x});
    else
      assignToBin(p, binFromPosition(glm::ivec2(p.x % 64, p.y % 48)));
  }
  void process(const Point &p) {
    update(state().drawn, glm::ivec2(p.x, p.y),
           [&](Pixel &pixel) { pixel.sum = pixel.sum * 0.5f + p.value; });
    int next = p.tag % 1000 * 3 % 17;
    if (next > 0)
      emit(moved(p, p.tag % 2, 0, p.value, 1000 + next));
  }
};
struct Strays : piko::Pipe<State> {
  Stray stray;
  Strays() {
    source(stray);
    connect(stray, 0, stray);
  }
};
