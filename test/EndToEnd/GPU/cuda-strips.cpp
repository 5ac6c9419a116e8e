// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Strips that a device repeats by itself: updates that do not commute show the
// lineage order that the reference executor has, also of what leaves the strips
// to be merged by keys.
// REQUIRES: all
// DEFINE: %{compare} = piko-compare %s --domain 64 48 --runs 1 --threads 2 --target cuda --gpu-threads 64
// DEFINE: %{meet} = %{compare} --pipe Meet --count 60
// RUN: %compare_targets %s --cases %s --count 60 --domain 64 48 --runs 1
// CASE: --pipe Meet --strip 7
// CASE: --pipe Tiles --count 100
// CASE: --pipe Twice --count 40 30 --strip 4
// RUN: export PIKO_TEST_DRIVER_COUNTS=1
// RUN: env PIKO_CUDA_DRIVER=%test_driver %{compare} --pipe Meet --count 301 --strip 1 2>&1 | FileCheck %s --check-prefixes=CHECK,HUNDREDS
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_SEED=3 PIKO_CUDA_ALONE=0 %{meet} --strip 7 2>&1 | FileCheck %s
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_CUDA_ALONE=300 %{meet} --strip 59 2>&1 | FileCheck %s
// RUN: env PIKO_CUDA_DRIVER=%test_driver %{meet} --strip 60 2>&1 | FileCheck %s
// RUN: env PIKO_CUDA_DRIVER=%test_driver %{meet} --count 0 9 --strip 2 2>&1 | FileCheck %s
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_SEED=4 %{compare} --pipe Tiles --count 100 2>&1 | FileCheck %s
// RUN: env PIKO_CUDA_DRIVER=%test_driver %{compare} --pipe Twice --count 40 30 --strip 4 2>&1 | FileCheck %s
// CHECK-DAG: {{^equal$}}
// CHECK-DAG: host: 0 launches of kernels, 1 of graphs with {{[0-9]+}} kernels, {{[0-9]+}} copies, 0 fills, 3 waits
// HUNDREDS-DAG: piko_strip: 301 launches
//
// How many there are is not seen in the graph.
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_COUNTS=%t.30 %{meet} --strip 30
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_COUNTS=%t.3 %{meet} --strip 3
// RUN: grep -o '"cuLaunch[A-Za-z]*": [0-9]*' %t.30 > %t.few
// RUN: grep -o '"cuLaunch[A-Za-z]*": [0-9]*' %t.3 > %t.many
// RUN: cmp %t.few %t.many && FileCheck %s --check-prefix=CALLS --input-file %t.few
// CALLS: "cuLaunchCooperativeKernel": {{[1-9][0-9]}}
//
// A driver without conditional nodes gets the grids one by one, and waits for
// each strip.
// RUN: env PIKO_CUDA_DRIVER=%test_driver_11 %{meet} --strip 7 2>&1 | FileCheck %s --check-prefix=OLD
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_FAIL=cuGraphAddNode:2:801 %{meet} --strip 7 2>&1 | FileCheck %s --check-prefix=OLD
// OLD-DAG: {{^equal$}}
// OLD-DAG: host: {{[0-9]+}} launches of kernels, 0 of graphs with 0 kernels, {{[0-9]+}} copies, 0 fills, {{[1-9][0-9]+}} waits
//
// What breaks a rule in some strip is the error that a CPU reports.
// RUN: not piko-compare %s --pipe Strays --count 90 --domain 64 48 --runs 1 --threads 2 --strip 4 2>&1 | grep got: > %t.cpu
// RUN: env PIKO_CUDA_DRIVER=%test_driver not %{compare} --pipe Strays --count 90 --strip 4 > %t.all 2>&1
// RUN: grep got: %t.all > %t.cuda
// RUN: cmp %t.cpu %t.cuda && FileCheck %s --check-prefix=STRAY --input-file %t.all
// STRAY: got: stage 'stray': expected a bin id in [0, 48), but got 10{{[0-9]+}}
// Of 23.
// STRAY: piko_strip: 19 launches
// RUN: env PIKO_CUDA_DRIVER=%test_driver not %{meet} --strip 3 --loop-limit 1 2>&1 | FileCheck %s --check-prefix=HOPS
// HOPS: got: stage 'split', bin {{[0-9]+}}: a loop did not end within 1 hops
//
// What the driver refuses, while strips and the waves in them are put into a graph
// and when that is launched, runs grid by grid.
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_FAIL=cuGraphAddNode:1:999 %{meet} --strip 7 2>&1 | FileCheck %s --check-prefix=OLD --implicit-check-not="alive at the end"
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_FAIL=cuStreamBeginCaptureToGraph:2:999 %{meet} --strip 7 2>&1 | FileCheck %s --check-prefix=OLD --implicit-check-not="alive at the end"
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_FAIL=cuGraphLaunch:1:999 %{meet} --strip 7 2>&1 | FileCheck %s --check-prefix=OLD --implicit-check-not="alive at the end"
#include "../Inputs/hops.h"

// A loop.
struct Split : piko::Stage<16, 16, 64, Point, Point, Point> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x, p.y), glm::ivec2(p.x + 4, p.y + 2));
  }
  void process(const Point &p) {
    for (int i = 0; i < p.tag % 3; ++i)
      if (p.tag > 4)
        emit(moved(p, 5 * i, i, p.value + float(i), p.tag / 2), 0);
      else
        emit(moved(p, i, 5 * i, p.value - float(i), p.tag), 1);
    if (p.tag % 5 == 1)
      emit(p, 1);
  }
};

// Changes an image in each strip, which the first one clears.
struct Draw : piko::Stage<8, 8, 64, Point, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x, p.y), glm::ivec2(p.x, p.y));
  }
  void process(const Point &p) {
    update(state().drawn, glm::ivec2(p.x, p.y),
           [&](Pixel &pixel) { pixel.sum = pixel.sum * 0.5f + p.value; });
    if (p.tag % 4 != 3)
      emit(p);
  }
};

// Three ways out of the strips lead to one stage, one of them out of the loop.
struct Meet : piko::Pipe<State> {
  Deal deal;
  Split split;
  Draw draw;
  Merge merge;
  Blend blend;
  Meet() {
    source(deal);
    source(blend);
    connect(deal, 0, split);
    connect(split, 0, split);
    connect(split, 1, merge);
    connect(deal, 1, draw);
    connect(draw, 0, merge);
    connect(merge, 0, blend);
    connect(merge, 1, blend);
  }
};

// The stage's own strips, of which nothing is left.
struct DealTiles : Deal {
  void schedule(piko::BinId) { specifySchedule(piko::All, 7); }
};
struct Tiles : piko::Pipe<State> {
  DealTiles deal;
  Draw draw;
  Blend blend;
  Tiles() {
    source(deal);
    connect(deal, 0, draw);
    connect(deal, 1, blend);
    connect(draw, 0, blend);
  }
};

// Two groups of strips, one after the other.
struct Turn : piko::Stage<0, 0, 64, Point, Point> {
  void process(const Point &p) { emit(moved(p, 1, p.tag, p.value, p.tag)); }
};
struct Twist : piko::Stage<8, 16, 64, Point, Point> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x, p.y), glm::ivec2(p.x + 8, p.y));
  }
  void process(const Point &p) { emit(moved(p, p.tag, 2, p.value, p.tag)); }
};
struct Twice : piko::Pipe<State> {
  Deal deal;
  Split split;
  Turn turn;
  Twist twist;
  Merge merge;
  Blend blend;
  Twice() {
    source(deal);
    source(turn);
    connect(deal, 0, split);
    connect(split, 0, split);
    connect(split, 1, merge);
    connect(deal, 1, merge);
    connect(turn, 0, twist);
    connect(twist, 0, merge);
    connect(merge, 0, blend);
    connect(merge, 1, blend);
  }
};

struct Stray : piko::Stage<8, 8, 64, Point, Point> {
  void assignBin(const Point &p) {
    if (p.tag % 8 == 5 && p.y > 40)
      assignToBin(p, piko::BinId{1000 + p.x});
    else
      assignToBin(p, binFromPosition(glm::ivec2(p.x % 64, p.y % 48)));
  }
  void process(const Point &p) { emit(p); }
};
struct Strays : piko::Pipe<State> {
  Deal deal;
  Stray stray;
  Draw draw;
  Blend blend;
  Strays() {
    source(deal);
    connect(deal, 0, stray);
    connect(deal, 1, blend);
    connect(stray, 0, draw);
    connect(draw, 0, blend);
  }
};
